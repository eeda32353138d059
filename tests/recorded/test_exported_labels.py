"""Datasets of the recorded scenes against their truth: what is written, not what the geometry says in memory."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import pytest

from ars_web.datasets.jobs import plan_export, run_export
from ars_web.datasets.options import ExportOptions
from ars_web.geometry.box import EDGES, Box
from ars_web.recordings.registry import read_recording
from ars_web.sessions.model import FrameTable, ObjectClass, SessionSnapshot, SessionState, VirtualBox

DATA = Path(__file__).parents[3] / "shared" / "data"


@dataclass(frozen=True)
class Labels:
    """COCO annotations of one image by box number."""

    bbox: dict[int, np.ndarray]
    amodal: dict[int, np.ndarray]
    visible: dict[int, float]


def snapshot_of(folder: Path, objects: list[dict[str, object]]) -> SessionSnapshot:
    """A session of the scene folder with a class and a box for each object."""
    recording = read_recording(folder)
    frames = FrameTable(
        tuple(frame.name for frame in recording.frames),
        tuple(frame.image for frame in recording.frames),
        np.array([frame.camera_id for frame in recording.frames]),
        recording.Ts_world_camera,
    )
    boxes = [Box(np.array(o["T_world_box"]), np.array(o["size"])) for o in objects]
    state = SessionState(
        revision=1,
        name=folder.name,
        classes={i: ObjectClass(i, f"{i} {o['label']}", "#e6194b", 1) for i, o in enumerate(objects)},
        boxes={i: VirtualBox(i, i - 1, str(i), box, 1) for i, box in enumerate(boxes, start=1)},
        next_class_id=len(objects),
        next_box_id=len(objects) + 1,
    )
    return SessionSnapshot(folder.name, state, recording.cameras, frames)


def exported(snapshot: SessionSnapshot, out: Path) -> list[Labels]:
    """What the COCO dataset says of each frame, its splits put together again."""
    options = ExportOptions.model_validate({"images": "none", "min_area_px": 0})
    run_export(plan_export([snapshot], format="coco", options=options, out=out))
    found = [Labels({}, {}, {}) for _ in range(len(snapshot.frames))]
    for split in ("train", "val"):
        for annotation in json.loads((out / f"annotations/instances_{split}.json").read_bytes())["annotations"]:
            labels, box = found[annotation["image_id"] - 1], annotation["category_id"] - 1
            for name, boxes in (("bbox", labels.bbox), ("amodal_bbox", labels.amodal)):
                x, y, w, h = annotation[name]
                boxes[box] = np.array([x, y, x + w, y + h])
            labels.visible[box] = annotation["visible"]
    return found


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, object], SessionSnapshot, list[Labels]]:
    truth = json.loads((DATA / "cell" / "truth" / "truth.json").read_bytes())
    snapshot = snapshot_of(DATA / "cell", truth["objects"])
    return truth, snapshot, exported(snapshot, tmp_path_factory.mktemp("cell") / "coco")


def test_amodal_boxes_are_the_exact_projection(cell) -> None:
    """Every edge sampled 500 times and projected by OpenCV, wherever the whole box is in front of the lens."""
    truth, snapshot, found = cell
    K, dist = np.array(truth["K"]), np.array(truth["dist"])
    t = np.linspace(0, 1, 500)[:, None]
    compared = 0
    for frame, labels in enumerate(found):
        T_camera_world = np.linalg.inv(snapshot.frames.Ts_world_camera[frame])
        for number, amodal in labels.amodal.items():
            corners = (
                snapshot.state.boxes[number + 1].box.corners_world @ T_camera_world[:3, :3].T + T_camera_world[:3, 3]
            )
            if corners[:, 2].min() < 0.05:
                continue
            edges = np.concatenate([corners[i] + t * (corners[j] - corners[i]) for i, j in EDGES])
            if np.hypot(*(edges[:, :2] / edges[:, 2:]).T).max() > 0.95 * snapshot.cameras[0].valid_radius:
                continue
            image = cv2.projectPoints(edges, np.zeros(3), np.zeros(3), K, dist)[0][:, 0] + 0.5
            expected = np.concatenate([image.min(axis=0), image.max(axis=0)])
            assert np.abs(amodal - expected).max() < 0.1
            compared += 1
    assert compared > 300


def test_amodal_boxes_contain_the_true_surfaces(cell) -> None:
    truth, _, found = cell
    compared = 0
    for labels, frame in zip(found, truth["frames"], strict=True):
        for number, amodal in labels.amodal.items():
            x0, y0, x1, y1 = frame["objects"][number]["bbox_amodal"]
            assert (amodal[:2] <= [x0 + 1, y0 + 1]).all()
            assert (amodal[2:] >= [x1 - 1, y1 - 1]).all()
            compared += 1
    assert compared > 300


def test_visible_follows_the_true_visible_fraction(
    cell, record_testsuite_property: Callable[[str, object], None]
) -> None:
    """Boxes hide more than the objects in them, balls twice as much: the two agree as far as boxes can."""
    truth, _, found = cell
    pairs = [
        (visible, frame["objects"][number]["visible_fraction"])
        for labels, frame in zip(found, truth["frames"], strict=True)
        for number, visible in labels.visible.items()
        if frame["objects"][number]["px_in_image"] > 100
    ]
    correlation = float(np.corrcoef(np.array(pairs).T)[0, 1])
    record_testsuite_property("correlation of visible with the truth", round(correlation, 3))
    assert len(pairs) > 300
    assert correlation > 0.75


def test_every_object_that_is_seen_has_a_label(cell) -> None:
    truth, _, found = cell
    for labels, frame in zip(found, truth["frames"], strict=True):
        seen = {o["object"] for o in frame["objects"] if o["px_visible"] > 0}
        assert seen <= set(labels.bbox)


def test_the_dragons_label_contains_the_dragon(tmp_path: Path) -> None:
    objects = json.loads((DATA / "tabletop" / "truth" / "boxes.json").read_bytes())["objects"]
    dragon = [o["label"] for o in objects].index("dragon")
    snapshot = snapshot_of(DATA / "tabletop", objects)
    seen = json.loads((DATA / "tabletop" / "truth" / "dragon_boxes_2d.json").read_bytes())["frames"]
    found = exported(snapshot, tmp_path / "coco")
    beyond = []
    for name, labels in zip(snapshot.frames.names, found, strict=True):
        if name in seen:
            x0, y0, x1, y1 = seen[name]
            box = labels.bbox[dragon]
            beyond.append(max(box[0] - x0, box[1] - y0, x1 - box[2], y1 - box[3]))
    assert len(beyond) > 90
    assert max(beyond) < 8
    assert np.percentile(beyond, 90) < 4
