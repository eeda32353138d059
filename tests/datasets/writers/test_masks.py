"""Sets of masks beside rays cast at every pixel, read by OpenCV and Pillow; who hides whom, and what does not fit."""

import json
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from ars_web.datasets.jobs import plan_export, run_export
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.planned import ExportPlan
from ars_web.datasets.readback.comparison import compare
from ars_web.datasets.writers.masks import WRITER, color
from ars_web.errors import BadFile, BadInput
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.sessions.model import SessionSnapshot

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    from PIL import Image

Make = Callable[..., SessionSnapshot]


def plan_of(snapshot: SessionSnapshot, out: Path, **changes: object) -> ExportPlan:
    options = ExportOptions.model_validate({"images": "none", "split": {"train": 1.0, "val": 0.0}, **changes})
    return plan_export([snapshot], format="masks", options=options, out=out, frames_per_shard=5)


def objects_of(folder: Path) -> dict[str, list[dict[str, int]]]:
    return {image["masks"]: image["objects"] for image in json.loads((folder / "masks" / "train.json").read_bytes())}


def nearest_by_rays(camera: Camera, T_world_camera: np.ndarray, boxes: list[Box]) -> np.ndarray:
    """(h, w) the box that is met first at each pixel's middle, counted from 1, 0 for none: rays against slabs."""
    columns, rows = np.meshgrid(np.arange(camera.width, dtype=float), np.arange(camera.height, dtype=float))
    pixels = np.stack([columns, rows], axis=-1).reshape(-1, 1, 2)
    flat = cv2.undistortPointsIter(
        pixels, camera.K, np.array(camera.distortion), None, None, (cv2.TERM_CRITERIA_COUNT, 100, 0.0)
    )
    rays = np.concatenate([flat[:, 0], np.ones((len(flat), 1))], axis=1)
    nearest, found = np.full(len(rays), np.inf), np.zeros(len(rays), dtype=int)
    for number, box in enumerate(boxes, start=1):
        T_box_camera = np.linalg.inv(box.T_world_box) @ T_world_camera
        directions, origin = rays @ T_box_camera[:3, :3].T, T_box_camera[:3, 3]
        with np.errstate(divide="ignore"):
            sides = np.stack([(s * box.size / 2 - origin) / directions for s in (-1.0, 1.0)])
        entry, leave = sides.min(axis=0).max(axis=1), sides.max(axis=0).min(axis=1)
        met = (entry < leave) & (entry > 0) & (entry < nearest)
        nearest[met], found[met] = entry[met], number
    return found.reshape(camera.height, camera.width)


def test_each_pixel_has_the_object_that_its_ray_meets_first(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(12)
    run_export(plan_of(snapshot, tmp_path / "d"))
    boxes = [virtual.box for virtual in snapshot.state.boxes.values()]
    differing = seen = 0
    for frame, camera_id in enumerate(snapshot.frames.camera_ids.tolist()):
        true = nearest_by_rays(snapshot.cameras[camera_id], snapshot.frames.Ts_world_camera[frame], boxes)
        file = tmp_path / "d" / "masks" / "instances" / f"{frame:04d}.png"
        instances = cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
        assert (instances.dtype, instances.shape) == (np.uint16, true.shape)
        # Where a border runs through a pixel's very middle either is right.
        differing += int((instances != true).sum())
        seen += int((true > 0).sum())
    assert seen > 2000
    assert differing <= 2


def test_classes_follow_the_instances_in_any_reader(make_snapshot: Make, tmp_path: Path) -> None:
    run_export(plan_of(make_snapshot(12), tmp_path / "d"))
    said = {c["value"]: c["name"] for c in json.loads((tmp_path / "d" / "classes.json").read_bytes())}
    assert said == {1: "cube", 2: "tall one"}
    compared = 0
    for name, objects in objects_of(tmp_path / "d").items():
        with Image.open(tmp_path / "d" / "masks" / "instances" / name) as file:
            assert file.mode == "I;16"
            instances = np.array(file)
        with Image.open(tmp_path / "d" / "masks" / "classes" / name) as file:
            assert file.mode == "L"
            classes = np.array(file)
        assert set(np.unique(instances)) <= {0} | {an_object["id"] for an_object in objects}
        for an_object in objects:
            mask = instances == an_object["id"]
            assert mask.sum() == an_object["pixels"]
            assert set(np.unique(classes[mask])) <= {an_object["class"]}
            compared += int(mask.any())
        assert not classes[instances == 0].any()
    assert compared > 20


def test_what_is_dropped_is_background_and_still_hides(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(12, one_camera=True)
    run_export(plan_of(snapshot, tmp_path / "all"))
    run_export(plan_of(snapshot, tmp_path / "large", min_area_px=400.0))
    every, large = objects_of(tmp_path / "all"), objects_of(tmp_path / "large")
    gone = 0
    for name in every:
        a, b = (
            cv2.imread(str(tmp_path / kind / "masks" / "instances" / name), cv2.IMREAD_UNCHANGED)
            for kind in ("all", "large")
        )
        kept = [an_object["id"] for an_object in large[name]]
        assert np.array_equal(np.where(np.isin(a, kept), a, 0), b)
        gone += int((a != b).sum())
    assert gone > 100


def test_an_object_that_is_wholly_hidden_is_listed_with_no_pixels(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(1, one_camera=True)
    # A wall between the camera at x = 1 and the small box at the origin.
    wall, small = np.eye(4), np.eye(4)
    wall[0, 3] = 0.4
    boxes = [Box(wall, np.array([0.05, 1.0, 1.0])), Box(small, np.array([0.1, 0.1, 0.1]))]
    snapshot = make_snapshot(1, one_camera=True, objects=boxes)
    plan = plan_of(snapshot, tmp_path / "d")
    run_export(plan)
    assert [an_object["pixels"] > 0 for an_object in objects_of(tmp_path / "d")["0000.png"]] == [True, False]
    found = compare(plan, plan.out)
    assert (found.labels, found.agrees) == (2, True)


def test_a_pixel_that_differs_is_counted_and_files_that_do_not_fit_are_named(
    make_snapshot: Make, tmp_path: Path
) -> None:
    plan = plan_of(make_snapshot(2, one_camera=True), tmp_path / "d")
    run_export(plan)
    masks = tmp_path / "d" / "masks"
    files = [masks / kind / "0000.png" for kind in ("instances", "classes")]
    whole = [cv2.imread(str(file), cv2.IMREAD_UNCHANGED) for file in files]
    row, column = np.argwhere(whole[0] == 3)[0].tolist()
    for file, values in zip(files, whole, strict=True):
        values[row, column] = 0
        assert cv2.imwrite(str(file), values)
    with pytest.raises(BadFile, match=r"0000.png: box 3 has \d+ pixels, not"):
        compare(plan, plan.out)
    document = json.loads((masks / "train.json").read_bytes())
    (of_third,) = [an_object for an_object in document[0]["objects"] if an_object["id"] == 3]
    of_third["pixels"] -= 1
    (masks / "train.json").write_text(json.dumps(document))
    found = compare(plan, plan.out)
    assert (found.wrong_pixels, found.differing, found.agrees) == (1, 1, False)
    assert found.examples[0].endswith("1 pixels differ")
    whole[1][row, column] = 1
    assert cv2.imwrite(str(files[1]), whole[1])
    with pytest.raises(BadFile, match=r"the pixels of box 0 are of class \[0, 1\], not 0"):
        compare(plan, plan.out)
    assert cv2.imwrite(str(files[0]), whole[1])
    with pytest.raises(BadFile, match="is no PNG of grey values of 16 bits"):
        compare(plan, plan.out)


def test_what_the_files_cannot_hold_is_refused(make_snapshot: Make, tmp_path: Path) -> None:
    plan = plan_of(make_snapshot(1), tmp_path / "d")
    assert list(WRITER.losses(plan)) == ["the hidden parts of objects: a pixel holds the nearest alone"]
    many = replace(plan, classes=tuple(replace(plan.classes[0], name=f"class {i}") for i in range(256)))
    with pytest.raises(BadInput, match="at most 255, not 256"):
        WRITER.losses(many)
    session = replace(plan.sessions[0], box_ids=(1, 2, 65536))
    with pytest.raises(BadInput, match="up to 65535, and one is 65536"):
        WRITER.losses(replace(plan, sessions=(session,)))
    with pytest.raises(BadInput, match="at most 255, not 300"):
        plan_of(make_snapshot(1, classes=tuple(f"class {i}" for i in range(300))), tmp_path / "e")


def test_colours_are_those_of_vocs_segmentations() -> None:
    # Aeroplane, bicycle, bird, ... and the last of 255.
    assert [color(value) for value in (1, 2, 3, 20, 255)] == [
        [128, 0, 0], [0, 128, 0], [128, 128, 0], [0, 64, 128], [224, 224, 192],
    ]  # fmt: skip
    assert len({tuple(color(value)) for value in range(256)}) == 256
