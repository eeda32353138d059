"""Turned boxes: the smallest rectangles, read by supervision and measured by shapely; what they lose is told."""

import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import shapely

from ars_web.datasets.forecast import forecast
from ars_web.datasets.jobs import plan_export, run_export
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.readback.comparison import compare
from ars_web.datasets.samples import label_table, outlines_in_frames
from ars_web.errors import BadFile
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.sessions.model import SessionSnapshot

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    import supervision as sv

Make = Callable[..., SessionSnapshot]


def corners_by_stem(folder: Path) -> dict[str, np.ndarray]:
    """(k, 4, 2) shares of each image."""
    return {
        path.stem: np.array([row.split()[1:] for row in path.read_text().splitlines()], dtype=float).reshape(-1, 4, 2)
        for path in folder.rglob("labels/*/*.txt")
    }


@pytest.fixture
def snapshot(make_snapshot: Make) -> SessionSnapshot:
    return make_snapshot(12, one_camera=True)


def written(snapshot: SessionSnapshot, out: Path) -> dict[str, np.ndarray]:
    options = ExportOptions.model_validate({"images": "copy"})
    run_export(plan_export([snapshot], format="yolo-obb", options=options, out=out, frames_per_shard=5))
    camera = snapshot.cameras[0]
    return {stem: found * [camera.width, camera.height] for stem, found in corners_by_stem(out).items()}


def test_they_are_the_smallest_rectangles_round_the_part_in_the_image(
    snapshot: SessionSnapshot, tmp_path: Path
) -> None:
    found, frames = written(snapshot, tmp_path / "d"), snapshot.frames
    boxes = [virtual.box for virtual in snapshot.state.boxes.values()]
    seen = ~np.isnan(label_table(snapshot, range(12)).bbox[..., 0])
    outlines = outlines_in_frames(snapshot.cameras, frames.camera_ids, frames.Ts_world_camera, boxes, seen)
    compared = 0
    for frame in range(12):
        rectangles = iter(found[f"{frame:04d}"])
        for column in np.flatnonzero(seen[frame]).tolist():
            at, rectangle = frame * len(boxes) + column, next(rectangles)
            ring = outlines.points[outlines.starts[at] : outlines.starts[at + 1]]
            sides = np.roll(rectangle, -1, axis=0) - rectangle
            assert np.abs((sides * np.roll(sides, -1, axis=0)).sum(axis=1)).max() < 0.01
            polygon = shapely.Polygon(rectangle)
            assert polygon.buffer(0.01).covers(shapely.MultiPoint(ring))
            assert polygon.area <= shapely.oriented_envelope(shapely.MultiPoint(ring)).area + 0.05
            compared += 1
    assert compared > 20


def test_supervision_reads_them(snapshot: SessionSnapshot, tmp_path: Path) -> None:
    found = written(snapshot, tmp_path / "d")
    read = sv.DetectionDataset.from_yolo(
        images_directory_path=str(tmp_path / "d" / "images" / "train"),
        annotations_directory_path=str(tmp_path / "d" / "labels" / "train"),
        data_yaml_path=str(tmp_path / "d" / "data.yaml"),
        is_obb=True,
    )
    assert read.classes == ["cube", "tall one"]
    assert len(read.annotations) > 5
    for path, detections in read.annotations.items():
        truth = found[Path(path).stem]
        assert len(detections) == len(truth)
        if len(truth):
            np.testing.assert_allclose(detections.data["xyxyxyxy"], truth, atol=1.0)


def test_corners_outside_the_image_are_not_cut(make_snapshot: Make, tmp_path: Path) -> None:
    # A thin rod across a corner of the image: cut to the image, its rectangle would have other angles.
    turned = rigid_transform.from_rotation(rigid_transform.rotation_about_z(0.7), np.array([0.0, 0.35, 0.2]))
    snapshot = make_snapshot(12, one_camera=True, objects=[Box(turned, np.array([0.9, 0.1, 0.1]))])
    written(snapshot, tmp_path / "d")
    shares = np.concatenate(list(corners_by_stem(tmp_path / "d").values()))
    assert ((shares < -0.005) | (shares > 1.005)).any()
    assert any("-0." in path.read_text() for path in tmp_path.rglob("labels/*/*.txt"))


def test_the_lost_heading_is_told_before_and_after(snapshot: SessionSnapshot, tmp_path: Path) -> None:
    options = ExportOptions.model_validate({"images": "none"})
    plan = plan_export([snapshot], format="yolo-obb", options=options, out=tmp_path / "d")
    (told,) = forecast(plan).losses
    assert "half a turn" in told
    assert run_export(plan).losses == [told]
    # Half a turn about the view is the same rectangle, and the comparison takes it for the same.
    path = next(path for path in sorted((tmp_path / "d" / "labels").rglob("*.txt")) if path.read_text())
    first, *rest = path.read_text().splitlines()
    words = first.split()
    path.write_text("\n".join([" ".join([words[0], *words[5:], *words[1:5]]), *rest]) + "\n")
    assert compare(plan, plan.out).agrees
    path.write_text(f"{' '.join(words[:7])}\n")
    with pytest.raises(BadFile, match=r"6 numbers after the class, not 8"):
        compare(plan, plan.out)
