from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ars_web.datasets.options import ExportOptions, FrameChoice
from ars_web.datasets.plan import plan_export
from ars_web.datasets.plan_files import digest_of, read_digest, read_plan, write_plan
from ars_web.datasets.planned import ExportPlan
from ars_web.datasets.registry import WRITERS
from ars_web.errors import BadFile, BadInput
from ars_web.sessions.model import SessionSnapshot

Make = Callable[..., SessionSnapshot]


def options(**changes: object) -> ExportOptions:
    return ExportOptions.model_validate(changes)


def plan_of(*snapshots: SessionSnapshot, out: Path, format: str = "yolo", **changes: object) -> ExportPlan:  # noqa: A002
    return plan_export(snapshots, format=format, options=options(**changes), out=out)


@pytest.mark.parametrize(
    ("choice", "expected"),
    [
        ({}, list(range(12))),
        ({"step": 5}, [0, 5, 10]),
        ({"start": 3, "stop": 9, "step": 2}, [3, 5, 7]),
        ({"stop": 1000, "start": 10}, [10, 11]),
        ({"list": [7, 2, 7]}, [2, 7]),
    ],
)
def test_frames_are_chosen_as_asked(
    make_snapshot: Make, tmp_path: Path, choice: dict[str, object], expected: list[int]
) -> None:
    plan = plan_of(make_snapshot(12), out=tmp_path / "d", frames=choice)
    assert plan.frames.index.tolist() == expected
    assert plan.frames.names == tuple(f"{i:04d}.jpg" for i in expected)


def test_a_listed_frame_that_is_not_there_is_named(make_snapshot: Make, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="frame 12 is listed, but session s1 has 12 frames"):
        plan_of(make_snapshot(12), out=tmp_path / "d", frames={"list": [3, 12]})


@pytest.mark.parametrize("choice", [{"start": 12}, {"stop": 0}, {"list": []}])
def test_a_choice_of_no_frame_is_refused(make_snapshot: Make, tmp_path: Path, choice: dict[str, object]) -> None:
    with pytest.raises(BadInput, match="no frame is chosen"):
        plan_of(make_snapshot(12), out=tmp_path / "d", frames=choice)


def test_a_session_without_frames_is_refused(make_snapshot: Make, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"0 \(s1\) frames"):
        plan_of(make_snapshot(0), out=tmp_path / "d")


def test_merged_sessions_share_classes_by_name_and_keep_their_own_names(make_snapshot: Make, tmp_path: Path) -> None:
    first = make_snapshot(4, sid="s1", classes=("cube", "ball"))
    second = make_snapshot(3, sid="s2", classes=("duck", "cube"))
    plan = plan_of(first, second, out=tmp_path / "d")
    assert plan.class_names == ("cube", "ball", "duck")
    assert [s.class_of_box for s in plan.sessions] == [(0, 1, 0), (2, 0, 2)]
    assert plan.frames.stems == tuple([f"s1_{i:04d}" for i in range(4)] + [f"s2_{i:04d}" for i in range(3)])
    assert plan.options.sessions == ("s2",)


def test_a_session_merged_with_itself_is_refused(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(2)
    with pytest.raises(BadInput, match="s1 is merged twice"):
        plan_of(snapshot, snapshot, out=tmp_path / "d")


def test_a_frame_is_called_the_same_whatever_else_is_chosen(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(3)
    names = ("a/x.jpg", "b/x.jpg", "a_x.jpg")
    snapshot = replace(snapshot, frames=replace(snapshot.frames, names=names))
    every = plan_of(snapshot, out=tmp_path / "d").frames.stems
    last = plan_of(snapshot, out=tmp_path / "d", frames={"list": [2]}).frames.stems
    assert every == ("a_x", "b_x", "a_x-2")
    assert last == ("a_x-2",)


def test_classes_deleted_leave_no_gap(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(2, classes=("gone", "cube", "ball"))
    classes = {i: c for i, c in snapshot.state.classes.items() if i != 0}
    boxes = {i: b for i, b in snapshot.state.boxes.items() if b.class_id != 0}
    snapshot = replace(snapshot, state=replace(snapshot.state, classes=classes, boxes=boxes))
    plan = plan_of(snapshot, out=tmp_path / "d")
    assert plan.class_names == ("cube", "ball")
    assert plan.sessions[0].class_of_box == (0, 1)


def test_shards_cover_all_frames_once_and_never_span_sessions(make_snapshot: Make, tmp_path: Path) -> None:
    snapshots = [make_snapshot(7, sid="s1"), make_snapshot(5, sid="s2")]
    plan = plan_export(snapshots, format="yolo", options=options(), out=tmp_path / "d", frames_per_shard=3)
    assert [i for a, b in plan.shards for i in range(a, b)] == list(range(12))
    assert all(len(set(plan.frames.session[a:b].tolist())) == 1 for a, b in plan.shards)
    assert max(b - a for a, b in plan.shards) == 3


def test_a_missing_image_is_named_before_any_work(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(4)
    snapshot.frames.images[2].unlink()
    with pytest.raises(BadFile, match=r"0002\.jpg: the image cannot be exported"):
        plan_of(snapshot, out=tmp_path / "d")
    assert len(plan_of(snapshot, out=tmp_path / "d", images="none").frames) == 4


def test_an_image_that_became_a_link_is_named_before_any_work(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(4)
    image = snapshot.frames.images[2]
    image.rename(tmp_path / "moved.jpg")
    image.symlink_to(tmp_path / "moved.jpg")
    with pytest.raises(BadFile, match=r"0002\.jpg: the image has become a link"):
        plan_of(snapshot, out=tmp_path / "d")


def test_folders_in_use_are_refused(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(1)
    used = tmp_path / "used"
    used.mkdir()
    (used / "precious").touch()
    with pytest.raises(BadInput, match="is not empty"):
        plan_of(snapshot, out=used)
    with pytest.raises(BadInput, match="is a file"):
        plan_of(snapshot, out=used / "precious")
    (tmp_path / "link").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(BadInput, match="is a link"):
        plan_of(snapshot, out=tmp_path / "link")
    with pytest.raises(BadInput, match="not empty"):
        plan_of(snapshot, out=Path("/"))
    (tmp_path / "empty").mkdir()
    assert plan_of(snapshot, out=tmp_path / "empty").out == tmp_path / "empty"


def test_unknown_formats_and_meshes_are_refused(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(1)
    with pytest.raises(BadInput, match=f"'nope' is unknown; known are {', '.join(WRITERS)}"):
        plan_of(snapshot, out=tmp_path / "d", format="nope")
    with pytest.raises(BadInput, match="mesh"):
        plan_of(snapshot, out=tmp_path / "d", shape="mesh")


def test_a_plan_read_back_is_the_same_plan(make_snapshot: Make, tmp_path: Path) -> None:
    plan = plan_of(make_snapshot(7), make_snapshot(5, sid="s2", objects=[]), out=tmp_path / "d", frames={"step": 2})
    assert read_digest(tmp_path) is None
    write_plan(plan, tmp_path)
    again = read_plan(tmp_path, out=plan.out)
    assert read_digest(tmp_path) == digest_of(plan) == digest_of(again)
    assert again.options == plan.options
    assert again.sessions[0].cameras == plan.sessions[0].cameras
    assert np.array_equal(again.frames.Ts_world_camera, plan.frames.Ts_world_camera)


def test_every_input_is_in_the_digest(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(6)
    out = tmp_path / "d"

    def digest(changed: SessionSnapshot = snapshot, **changes: object) -> str:
        return digest_of(plan_of(changed, out=out, **changes))

    state, frames = snapshot.state, snapshot.frames
    moved = frames.Ts_world_camera.copy()
    moved[3, 0, 3] += 1e-9
    seen = {
        digest(),
        digest(min_visible=0.1),
        digest(images="copy"),
        digest(frames=FrameChoice(stop=5).model_dump()),
        digest(replace(snapshot, state=replace(state, revision=4))),
        digest(replace(snapshot, state=replace(state, boxes={1: state.boxes[1], 2: state.boxes[2]}))),
        digest(replace(snapshot, frames=replace(frames, Ts_world_camera=moved))),
        digest(replace(snapshot, cameras={0: replace(snapshot.cameras[0], fx=50.001), 1: snapshot.cameras[1]})),
    }
    frames.images[1].write_bytes(frames.images[0].read_bytes())
    seen.add(digest())
    assert len(seen) == 9
    assert digest() == digest_of(plan_of(snapshot, out=tmp_path / "another"))
