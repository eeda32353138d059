"""Outlines in YOLO's rows: one ring each, read by supervision as masks; what a ring cannot hold is told."""

import warnings
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from ars_web.datasets.jobs import plan_export, run_export
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.readback.comparison import compare
from ars_web.errors import BadFile
from ars_web.sessions.hull_mesh import HullMesh
from ars_web.sessions.model import SessionSnapshot

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    import supervision as sv

Make = Callable[..., SessionSnapshot]


@pytest.fixture(scope="module")
def frame_of_bars() -> HullMesh:
    """A thin square frame: four bars round a hole, seen along the box's x."""
    ring = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    vertices = np.array([[x, *(s * p)] for x in (-0.05, 0.05) for s in (0.5, 0.35) for p in ring.astype(float)])
    faces: list[list[int]] = []
    for i in range(4):
        j = (i + 1) % 4
        # Back, front, outside and inside of a bar; the winding is outward.
        for a, b, c, d in (
            (i, i + 4, j + 4, j),
            (i + 8, j + 8, j + 12, i + 12),
            (i, j, j + 8, i + 8),
            (i + 4, i + 12, j + 12, j + 4),
        ):
            faces += [[a, b, c], [a, c, d]]
    return HullMesh(vertices, np.array(faces))


def test_supervision_reads_the_outlines_as_masks(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(12, one_camera=True)
    options = ExportOptions.model_validate({"images": "copy"})
    run_export(plan_export([snapshot], format="yolo-seg", options=options, out=tmp_path / "d", frames_per_shard=5))
    read = sv.DetectionDataset.from_yolo(
        images_directory_path=str(tmp_path / "d" / "images" / "train"),
        annotations_directory_path=str(tmp_path / "d" / "labels" / "train"),
        data_yaml_path=str(tmp_path / "d" / "data.yaml"),
        force_masks=True,
    )
    camera, compared = snapshot.cameras[0], 0
    for path, detections in read.annotations.items():
        rows = (tmp_path / "d" / "labels" / "train" / f"{Path(path).stem}.txt").read_text().splitlines()
        assert len(detections) == len(rows)
        for mask, row in zip(detections.mask if rows else (), rows, strict=True):
            ring = np.array(row.split()[1:], dtype=float).reshape(-1, 2) * [camera.width, camera.height]
            area = cv2.contourArea(ring.astype(np.float32))
            assert abs(mask.sum() - area) <= cv2.arcLength(ring.astype(np.float32), True) + 4
            compared += 1
    assert compared > 10


def test_shares_are_within_the_image(make_snapshot: Make, tmp_path: Path) -> None:
    options = ExportOptions.model_validate({"images": "none"})
    run_export(plan_export([make_snapshot(12)], format="yolo-seg", options=options, out=tmp_path / "d"))
    rows = [row.split() for path in tmp_path.rglob("labels/*/*.txt") for row in path.read_text().splitlines()]
    shares = np.concatenate([np.array(row[1:], dtype=float) for row in rows])
    assert (shares.min(), shares.max()) >= (0.0, 0.9)
    assert shares.max() <= 1.0
    assert {len(row) % 2 for row in rows} == {1}


def test_a_hole_stays_a_hole_in_one_ring_and_is_told(
    make_snapshot: Make, frame_of_bars: HullMesh, tmp_path: Path
) -> None:
    snapshot = make_snapshot(1, one_camera=True, hulls={2: frame_of_bars})
    options = ExportOptions.model_validate({"images": "none", "split": {"train": 1.0, "val": 0.0}})
    plan = plan_export([snapshot], format="yolo-seg", options=options, out=tmp_path / "d")
    (told,) = run_export(plan).losses
    assert "that outlines of 1 object may have" in told
    assert compare(plan, plan.out).agrees
    rows = (tmp_path / "d" / "labels" / "train" / "0000.txt").read_text().splitlines()
    camera, mask = snapshot.cameras[0], np.zeros((480, 640), dtype=np.uint8)
    (row,) = [row for row in rows if row.startswith("1 ")]
    ring = np.array(row.split()[1:], dtype=float).reshape(-1, 2) * [640, 480]
    cv2.fillPoly(mask, [np.round(ring).astype(np.int32)], 1)
    assert (camera.width, camera.height) == (64, 48)
    centre = ring.min(axis=0) + np.ptp(ring, axis=0) / 2
    assert mask[round(centre[1]), round(centre[0])] == 0
    assert mask.sum() > 1000


def test_boxes_and_convex_hulls_lose_nothing(make_snapshot: Make, octahedron: HullMesh, tmp_path: Path) -> None:
    options = ExportOptions.model_validate({"images": "none"})
    snapshot = make_snapshot(3, hulls={2: octahedron})
    plan = plan_export([snapshot], format="yolo-seg", options=options, out=tmp_path / "d")
    assert run_export(plan).losses == []
    path = next(path for path in sorted((tmp_path / "d" / "labels").rglob("*.txt")) if path.read_text())
    path.write_text("0 0.1 0.1 0.2 0.1\n")
    with pytest.raises(BadFile, match="4 numbers after the class, which are no ring"):
        compare(plan, plan.out)
