"""Written datasets beside their sessions: whole ones agree, and each kind of damage is found and named."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ars_web.datasets.jobs import plan_export, run_export
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.planned import ExportPlan
from ars_web.datasets.readback.comparison import Comparison, compare, pose_error
from ars_web.datasets.registry import WRITERS
from ars_web.errors import BadFile
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.sessions.hull_mesh import HullMesh
from ars_web.sessions.model import SessionSnapshot

Make = Callable[..., SessionSnapshot]


@pytest.fixture
def written(make_snapshot: Make, octahedron: HullMesh, tmp_path: Path) -> Callable[..., ExportPlan]:
    """Exports twelve frames of two cameras, one object with a hull."""

    def write(kind: str, **changes: object) -> ExportPlan:
        options = ExportOptions.model_validate({"split": {"train": 0.6, "val": 0.2, "test": 0.2}, **changes})
        snapshot = make_snapshot(12, hulls={2: octahedron})
        plan = plan_export([snapshot], format=kind, options=options, out=tmp_path / kind, frames_per_shard=5)
        run_export(plan)
        return plan

    return write


def edited(path: Path, change: Callable[[str], str]) -> None:
    text = path.read_text()
    assert change(text) != text
    path.write_text(change(text))


@pytest.mark.parametrize("images", ["copy", "none", "rectify"])
@pytest.mark.parametrize("kind", WRITERS)
def test_a_whole_dataset_agrees_with_its_session(written: Callable[..., ExportPlan], kind: str, images: str) -> None:
    plan = written(kind, images=images)
    found = compare(plan, plan.out)
    assert found.examples == ()
    assert found.agrees, (found.largest_error, found.where)
    assert (found.frames, found.differing) == (12, 0)
    assert found.labels > 10
    # Masks are pixels to count, with nothing to measure.
    assert found.where or kind == "masks"


def labelled(folder: Path) -> Path:
    """The first label file that holds a label."""
    return next(path for path in sorted(folder.rglob("*.txt")) if path.read_text())


def test_a_label_that_is_gone_is_counted(written: Callable[..., ExportPlan]) -> None:
    plan = written("yolo")
    path = labelled(plan.out / "labels")
    edited(path, lambda text: "".join(text.splitlines(keepends=True)[1:]))
    found = compare(plan, plan.out)
    assert (found.wrong_counts, found.differing, found.agrees) == (1, 1, False)
    assert str(path) in found.examples[0]


def test_a_label_of_another_class_is_counted(written: Callable[..., ExportPlan]) -> None:
    plan = written("yolo")
    edited(labelled(plan.out / "labels"), lambda text: ("1" if text[0] == "0" else "0") + text[1:])
    found = compare(plan, plan.out)
    assert (found.wrong_classes, found.agrees) == (1, False)


def test_a_frame_that_is_gone_or_not_asked_for_is_counted(written: Callable[..., ExportPlan]) -> None:
    plan = written("yolo")
    path = labelled(plan.out / "labels")
    path.rename(path.with_name("another.txt"))
    found = compare(plan, plan.out)
    assert (found.missing_frames, found.unknown_frames, found.agrees) == (1, 1, False)


def test_a_frame_in_another_split_is_counted(written: Callable[..., ExportPlan]) -> None:
    plan = written("yolo")
    path = labelled(plan.out / "labels" / "train")
    path.rename(plan.out / "labels" / "val" / path.name)
    found = compare(plan, plan.out)
    assert (found.wrong_splits, found.agrees) == (1, False)


def test_a_keypoint_that_is_off_or_of_another_state_is_told(written: Callable[..., ExportPlan]) -> None:
    plan = written("yolo-pose")
    path = labelled(plan.out / "labels")
    first, *rest = path.read_text().splitlines()
    words = first.split()
    at = next(i for i in range(5, len(words), 3) if words[i + 2] != "0")

    def changed(place: int, word: str) -> Comparison:
        path.write_text("\n".join([" ".join([*words[:place], word, *words[place + 1 :]]), *rest]) + "\n")
        return compare(plan, plan.out)

    moved = changed(at, f"{float(words[at]) + 0.01:.6f}")
    assert (moved.differing, moved.agrees) == (0, False)
    assert moved.largest_error > 0.4
    hidden = changed(at + 2, "1" if words[at + 2] == "2" else "2")
    assert (hidden.wrong_states, hidden.differing, hidden.agrees) == (1, 1, False)
    with pytest.raises(BadFile, match="must be 0, 1 or 2"):
        changed(at + 2, "3")


def test_a_box_that_is_off_is_measured(written: Callable[..., ExportPlan]) -> None:
    plan = written("coco")
    path = plan.out / "annotations" / "instances_train.json"
    document = json.loads(path.read_bytes())
    document["annotations"][1]["bbox"][0] += 0.5
    path.write_text(json.dumps(document))
    found = compare(plan, plan.out)
    assert found.differing == 0
    assert found.largest_error == pytest.approx(0.5, abs=0.01)
    assert not found.agrees
    assert "label" in found.where


def test_a_number_that_is_none_is_as_wrong_as_can_be(written: Callable[..., ExportPlan]) -> None:
    plan = written("yolo")
    path = labelled(plan.out / "labels")
    edited(path, lambda text: " ".join([*text.split(maxsplit=2)[:1], "nan", text.split(maxsplit=2)[2]]))
    assert compare(plan, plan.out).largest_error == np.inf


def test_a_damaged_file_is_named_with_its_line(written: Callable[..., ExportPlan]) -> None:
    plan = written("yolo")
    path = labelled(plan.out / "labels")
    path.write_text(path.read_text() + "0 0.5 half 0.1 0.1\n")
    with pytest.raises(BadFile, match=rf"{path}:\d+: .*half"):
        compare(plan, plan.out)
    path.write_text("7 0.5 0.5 0.1 0.1\n")
    with pytest.raises(BadFile, match=rf"{path}:1: '7' is no class"):
        compare(plan, plan.out)


def test_poses_are_compared_where_they_are_seen() -> None:
    camera, T = Camera(640, 480, 500.0, 500.0, 319.5, 239.5), np.eye(4)
    ahead = np.eye(4)
    ahead[2, 3] = 1.0
    box = Box(ahead, np.array([0.1, 0.2, 0.1]))
    assert pose_error(camera, T, box, box) == 0.0
    aside = ahead.copy()
    aside[0, 3] = 0.001
    # A millimetre, at the nearer corners' 0.95 m.
    assert pose_error(camera, T, replace(box, T_world_box=aside), box) == pytest.approx(0.001 * 500 / 0.95, abs=1e-6)


def test_nothing_read_is_nothing_that_agrees() -> None:
    empty = Comparison("x", 0, 0, 3, 0, 0, 0, 0, 0, 0, 0.0, 0.5, "", ())
    assert not empty.agrees
