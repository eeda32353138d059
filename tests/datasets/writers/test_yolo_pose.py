"""Keypoints in YOLO's rows: where OpenCV projects them, those out of the image `0 0 0`, and classes filled up."""

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from ars_web.datasets.jobs import run_export
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.plan import plan_export
from ars_web.datasets.planned import ExportPlan
from ars_web.datasets.readback.comparison import compare
from ars_web.datasets.samples import LabelTable
from ars_web.datasets.writers.yolo_pose import WRITER, pose_rows
from ars_web.errors import BadInput
from ars_web.geometry.box import CORNER_SIGNS
from ars_web.geometry.keypoints import Keypoint
from ars_web.geometry.symmetry import Symmetry
from ars_web.sessions.model import SessionSnapshot

Make = Callable[..., SessionSnapshot]


def slow_rows(
    bbox: np.ndarray, points: np.ndarray, states: np.ndarray, sizes: np.ndarray, class_of_box: np.ndarray, count: int
) -> list[str]:
    """The readable twin of `pose_rows`, of labels that are all kept: the text of each frame's file."""

    def share(value: float, *, least: int = 0) -> str:
        m = min(max(math.floor(value * 1e6 + 0.5), least), 10**6)
        return f"{m // 10**6}.{m % 10**6:06d}"

    files: list[str] = []
    for frame, (width, height) in enumerate(sizes.tolist()):
        lines: list[str] = []
        for box, number in enumerate(class_of_box.tolist()):
            x0, y0, x1, y1 = bbox[frame, box].tolist()
            words = [str(number), share((x0 + x1) / (2 * width)), share((y0 + y1) / (2 * height))]
            words += [share((x1 - x0) / width, least=1), share((y1 - y0) / height, least=1)]
            for k in range(count):
                if k < states.shape[2] and states[frame, box, k]:
                    x, y = points[frame, box, k].tolist()
                    words += [share(x / width), share(y / height), str(states[frame, box, k])]
                else:
                    words += ["0.000000", "0.000000", "0"]
            lines.append(" ".join(words))
        files.append("".join(f"{line}\n" for line in lines))
    return files


@settings(deadline=None)
@given(
    seed=st.integers(0, 2**32), n=st.integers(0, 4), b=st.integers(0, 5), k=st.integers(0, 9), more=st.integers(0, 3)
)
def test_fast_and_readable_rows_agree(seed: int, n: int, b: int, k: int, more: int) -> None:
    random = np.random.default_rng(seed)
    sizes = random.integers(1, 5000, (n, 2))
    bbox = (np.sort(random.random((n, b, 2, 2)), axis=2) * sizes[:, None, None, :]).reshape(n, b, 4)
    points = (random.random((n, b, k, 2)) * 1.2 - 0.1) * sizes[:, None, None, :]
    states = random.integers(0, 3, (n, b, k))
    points[states == 0] = np.nan
    class_of_box = random.integers(0, 200, b)
    table = LabelTable(bbox, bbox, np.zeros((n, b)), np.ones((n, b)))
    keep = np.ones((n, b), dtype=bool)
    buffer, edges = pose_rows(table, keep, points, states, sizes, class_of_box, count=k + more)
    assert edges[-1] == len(buffer)
    found = [buffer[a:b].tobytes().decode() for a, b in pairwise(edges.tolist())]
    assert found == slow_rows(bbox, points, states, sizes, class_of_box, k + more)


def plan_of(snapshot: SessionSnapshot, out: Path) -> ExportPlan:
    options = ExportOptions.model_validate({"images": "none"})
    return plan_export([snapshot], format="yolo-pose", options=options, out=out, frames_per_shard=5)


def with_classes(plan: ExportPlan, **changes: object) -> ExportPlan:
    """The plan with other keypoints or another symmetry of its second class."""
    return replace(plan, classes=(plan.classes[0], replace(plan.classes[1], **changes)))


def test_by_default_they_are_the_centre_and_the_corners_where_opencv_projects_them(
    make_snapshot: Make, tmp_path: Path
) -> None:
    snapshot = make_snapshot(12, one_camera=True)
    run_export(plan_of(snapshot, tmp_path / "d"))
    camera, compared, outside = snapshot.cameras[0], 0, 0
    for path in sorted(tmp_path.rglob("labels/*/*.txt")):
        T_camera_world = np.linalg.inv(snapshot.frames.Ts_world_camera[int(path.stem)])
        rows = [np.array(line.split(), dtype=float) for line in path.read_text().splitlines()]
        for row in rows:
            points = row[5:].reshape(9, 3)
            errors: list[float] = []
            # Which box a row is of is not said; the right one fits.
            for virtual in snapshot.state.boxes.values():
                local = np.vstack([np.zeros(3), CORNER_SIGNS / 2]) * virtual.box.size
                T = T_camera_world @ virtual.box.T_world_box
                pixels, _ = cv2.projectPoints(
                    local @ T[:3, :3].T + T[:3, 3], np.zeros(3), np.zeros(3), camera.K, np.array(camera.distortion)
                )
                true = (pixels[:, 0] + 0.5) / [camera.width, camera.height]
                inside = ((true >= 0) & (true <= 1)).all(axis=1)
                held = points[:, 2] > 0
                errors.append(np.abs(points[held, :2] - true[held]).max() if (inside == held).all() else np.inf)
            assert min(errors) < 1e-5
            assert not points[points[:, 2] == 0].any()
            compared += 1
            outside += int((points[:, 2] == 0).sum())
    assert compared > 20
    assert outside > 10


def test_data_yaml_names_them_and_says_nothing_of_mirrored_images(make_snapshot: Make, tmp_path: Path) -> None:
    run_export(plan_of(make_snapshot(3, classes=("a: b", "7")), tmp_path / "d"))
    said = yaml.safe_load((tmp_path / "d" / "data.yaml").read_text())
    assert said["kpt_shape"] == [9, 3]
    assert said["names"] == {0: "a: b", 1: "7"}
    assert said["kpt_names"][1] == ["centre", *(f"corner {i}" for i in range(8))]
    assert "flip_idx" not in said


def test_classes_with_fewer_points_are_filled_up_and_told(make_snapshot: Make, tmp_path: Path) -> None:
    tips = (Keypoint('nose "front"', (0.5, 0.0, 0.0)), Keypoint("tail", (-0.5, 0.0, 0.0)))
    plan = with_classes(plan_of(make_snapshot(12), tmp_path / "d"), keypoints=tips)
    (told,) = run_export(plan).losses
    assert told == ("rows hold 9 points each: of class 'tall one', which has 2, the others are written as not labelled")
    said = yaml.safe_load((tmp_path / "d" / "data.yaml").read_text())
    assert said["kpt_names"][1] == ['nose "front"', "tail", *map(str, range(2, 9))]
    rows = [row.split() for path in tmp_path.rglob("labels/*/*.txt") for row in path.read_text().splitlines()]
    assert {len(row) for row in rows} == {5 + 27}
    filled = [row[11:] for row in rows if row[0] == "1"]
    assert len(filled) > 5
    assert all(row == ["0.000000", "0.000000", "0"] * 7 for row in filled)
    assert compare(plan, plan.out).agrees


def test_a_symmetry_is_told_and_no_keypoints_at_all_are_refused(make_snapshot: Make, tmp_path: Path) -> None:
    plan = plan_of(make_snapshot(3), tmp_path / "d")
    round_one = Symmetry("continuous", axis=(0.0, 0.0, 1.0))
    (told,) = WRITER.losses(with_classes(plan, symmetry=round_one))
    assert told.startswith("symmetry: class 'tall one' looks the same")
    assert list(WRITER.losses(plan)) == []
    bare = replace(plan, classes=tuple(replace(a_class, keypoints=()) for a_class in plan.classes))
    with pytest.raises(BadInput, match="no class has keypoints"):
        WRITER.losses(bare)
