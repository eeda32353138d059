"""Locked boxes stay as they are, and classes have usual sizes, through every door of the store."""

from collections.abc import Callable

import numpy as np
import pytest

from ars_web.errors import BadInput, Conflict, Locked, NotFound
from ars_web.geometry.box import Box
from ars_web.sessions.editing import BoxDraft, SessionEditor
from ars_web.sessions.edits import differences, replay
from ars_web.sessions.model import SessionState
from ars_web.sessions.store import SessionStore

MakeBox = Callable[..., Box]


@pytest.fixture
def locked(store: SessionStore, editor: SessionEditor, sid: str, a_box: MakeBox) -> SessionState:
    """A session at revision 2, whose box 1, `cube`, is locked."""
    editor.add_box(sid, class_id=0, box=a_box(), author="me")
    editor.change_box(sid, 1, expected_revision=1, locked=True, author="me")
    return store.state(sid)


def replayed(store: SessionStore, sid: str, origin: SessionState) -> list[str]:
    """In what the log, another store of the folder and this one differ."""
    with SessionStore(store.folder) as again:
        return differences(replay(origin, store.edits(sid)), store.state(sid)) + differences(
            again.state(sid), store.state(sid)
        )


def test_a_locked_box_keeps_class_place_and_size_and_is_not_deleted(
    store: SessionStore, editor: SessionEditor, sid: str, locked: SessionState, a_box: MakeBox
):
    editor.add_class(sid, name="ring", author="me")
    for change, what in (
        ({"class_id": 1}, "its class can be changed"),
        ({"T_world_box": a_box(1.0).T_world_box}, "its place can be changed"),
        ({"size": np.ones(3), "name": "x"}, "its size can be changed"),
        ({"size": np.ones(3), "T_world_box": np.eye(4), "locked": True}, "its place and size can be changed"),
    ):
        with pytest.raises(Locked, match=rf"box 1 \('cube'\) is locked: unlock it before {what}$"):
            editor.change_box(sid, 1, expected_revision=2, author="me", **change)
    with pytest.raises(Locked, match="unlock it before it can be deleted"):
        editor.delete_box(sid, 1, expected_revision=2, author="me")
    with pytest.raises(Locked, match="unlock it before its place"):
        editor.rest_on_ground(sid, 1, expected_revision=2, author="me")
    with pytest.raises(Conflict):  # who has not seen the lock is told of that first
        editor.delete_box(sid, 1, expected_revision=1, author="me")
    assert (store.revision(sid), store.state(sid).boxes[1].locked) == (3, True)


def test_a_locked_box_may_be_renamed_unlocked_and_sent_as_it_is(
    store: SessionStore, editor: SessionEditor, sid: str, locked: SessionState
):
    box = locked.boxes[1].box
    same = editor.change_box(
        sid, 1, expected_revision=2, class_id=0, T_world_box=box.T_world_box, size=box.size, locked=True, author="me"
    )
    assert same.revision == 2
    assert editor.change_box(sid, 1, expected_revision=2, name="left", author="me").locked
    assert not editor.change_box(sid, 1, expected_revision=3, locked=False, author="me").locked
    again = editor.change_box(sid, 1, expected_revision=4, locked=True, size=np.ones(3), author="me")
    assert (again.locked, again.box.size.tolist()) == (True, [1, 1, 1])
    opened = editor.change_box(sid, 1, expected_revision=5, locked=False, size=np.full(3, 2.0), author="me")
    assert (opened.locked, opened.box.size.tolist()) == (False, [2, 2, 2])
    assert [edit.summary for edit in store.edits(sid)] == [
        "Add cube", "Lock cube", "Rename cube", "Unlock left", "Change left", "Change left",
    ]  # fmt: skip
    editor.delete_box(sid, 1, expected_revision=6, author="me")


def test_undo_and_redo_bring_back_what_was_locks_included(
    store: SessionStore, editor: SessionEditor, sid: str, a_box: MakeBox
):
    origin = store.state(sid)
    states = [origin]
    editor.add_box(sid, class_id=0, box=a_box(), author="me")
    states.append(store.state(sid))
    for change in (
        {"size": np.ones(3)},
        {"locked": True},
        {"name": "left"},
        {"locked": False, "T_world_box": np.eye(4)},
        {"locked": True, "size": np.full(3, 2.0)},
    ):
        editor.change_box(sid, 1, expected_revision=store.revision(sid), author="me", **change)
        states.append(store.state(sid))
    for state in reversed(states[:-1]):
        editor.undo(sid, author="me")
        assert seen(store.state(sid)) == seen(state)
    for state in states[1:]:
        editor.redo(sid, author="me")
        assert seen(store.state(sid)) == seen(state)
    assert replayed(store, sid, origin) == []


def seen(state: SessionState) -> list[object]:
    return [(b.name, b.locked, b.box.T_world_box.tolist(), b.box.size.tolist()) for b in state.boxes.values()]


def test_what_someone_else_locked_is_not_undone(store: SessionStore, editor: SessionEditor, sid: str, a_box: MakeBox):
    editor.add_box(sid, class_id=0, box=a_box(), author="me")
    editor.change_box(sid, 1, expected_revision=1, size=np.ones(3), author="me")
    editor.change_box(sid, 1, expected_revision=2, locked=True, author="you")
    with pytest.raises(Conflict, match="was changed meanwhile, in revision 3") as raised:
        editor.undo(sid, author="me")
    assert raised.value.current.locked
    assert store.revision(sid) == 3


def test_a_box_may_be_added_locked(store: SessionStore, editor: SessionEditor, sid: str, a_box: MakeBox):
    origin = store.state(sid)
    assert editor.add_box(sid, class_id=0, box=a_box(), locked=True, author="me", key="k").locked
    assert editor.add_box(sid, class_id=0, box=a_box(), locked=True, author="me", key="k").id == 1
    with pytest.raises(BadInput, match="another request"):
        editor.add_box(sid, class_id=0, box=a_box(), author="me", key="k")
    added = editor.add_boxes(sid, [BoxDraft(0, a_box(), locked=True), BoxDraft(0, a_box())], author="me")
    assert [box.locked for box in added] == [True, False]
    assert replayed(store, sid, origin) == []


def test_a_class_has_a_usual_size(store: SessionStore, editor: SessionEditor, sid: str):
    origin = store.state(sid)
    assert store.state(sid).classes[0].default_size is None
    sized = editor.change_class(sid, 0, expected_revision=0, default_size=(0.085, 0.1, 1.25), author="me")
    assert sized.default_size == (0.085, 0.1, 1.25)
    assert editor.change_class(sid, 0, expected_revision=1, default_size=(0.085, 0.1, 1.25), author="me").revision == 1
    assert editor.change_class(sid, 0, expected_revision=1, name="brick", author="me").default_size == (
        0.085,
        0.1,
        1.25,
    )
    assert editor.change_class(sid, 0, expected_revision=2, default_size=None, author="me").default_size is None
    made = editor.add_class(sid, name="ball", default_size=(0.3, 0.3, 0.3), author="me", key="k")
    assert editor.add_class(sid, name="ball", default_size=(0.3, 0.3, 0.3), author="me", key="k") == made
    assert [edit.summary for edit in store.edits(sid)] == [
        "Set size of cube to 85 x 100 x 1250 mm", "Change class cube", "Clear size of brick", "Add class ball",
    ]  # fmt: skip
    assert replayed(store, sid, origin) == []
    editor.undo(sid, author="me")
    editor.undo(sid, author="me")
    assert store.state(sid).classes[0].default_size == (0.085, 0.1, 1.25)


@pytest.mark.parametrize("size", [(0.0, 1, 1), (1, 1), (1, 1, -1), (1, 1, float("nan")), (1, 1, 1e5), ("a", 1, 1)])
def test_a_class_with_a_size_that_no_box_can_have_is_refused(
    store: SessionStore, editor: SessionEditor, sid: str, size: tuple[float, float, float]
):
    with pytest.raises(BadInput, match="three lengths in metres"):
        editor.change_class(sid, 0, expected_revision=0, default_size=size, author="me")
    with pytest.raises(BadInput, match="three lengths in metres"):
        editor.add_class(sid, name="ball", default_size=size, author="me")
    assert store.revision(sid) == 0


def test_a_duplicate_lies_beside_and_has_the_next_free_name(
    store: SessionStore, editor: SessionEditor, sid: str, locked: SessionState
):
    original = locked.boxes[1]
    copy = editor.duplicate_box(sid, 1, author="me", key="k")
    assert (copy.id, copy.name, copy.class_id, copy.locked, copy.revision) == (2, "cube 2", 0, False, 3)
    assert np.array_equal(copy.box.size, original.box.size)
    assert np.array_equal(copy.box.T_world_box[:3, :3], original.box.T_world_box[:3, :3])
    in_its_frame = np.linalg.inv(original.box.T_world_box) @ copy.box.T_world_box[:, 3]
    assert in_its_frame == pytest.approx([0.11, 0, 0, 1], abs=1e-12)
    assert editor.duplicate_box(sid, 1, author="me", key="k").id == 2
    assert [editor.duplicate_box(sid, box_id, author="me").name for box_id in (1, 2, 3)] == [
        "cube 3",
        "cube 4",
        "cube 5",
    ]
    assert store.edits(sid, after=2)[0].summary == "Duplicate cube"
    editor.undo(sid, author="me")
    assert list(store.state(sid).boxes) == [1, 2, 3, 4]
    with pytest.raises(NotFound, match="box 5 was deleted"):
        editor.duplicate_box(sid, 5, author="me")
    with pytest.raises(NotFound, match="box 9 is not in"):
        editor.duplicate_box(sid, 9, author="me")
    with pytest.raises(BadInput, match="another request"):
        editor.duplicate_box(sid, 2, author="me", key="k")


def test_a_box_is_put_on_the_ground_once(store: SessionStore, editor: SessionEditor, sid: str, a_box: MakeBox):
    editor.add_box(sid, class_id=0, box=a_box(), author="me")
    resting = editor.rest_on_ground(sid, 1, expected_revision=1, author="me", key="k")
    assert resting.box.corners_world[:, 2].min() == pytest.approx(0, abs=1e-12)
    assert editor.rest_on_ground(sid, 1, expected_revision=1, author="me", key="k").revision == 2
    assert editor.rest_on_ground(sid, 1, expected_revision=2, author="me").revision == 2
    with pytest.raises(Conflict):
        editor.rest_on_ground(sid, 1, expected_revision=1, author="me")
    assert store.edits(sid, after=1)[0].summary == "Put cube on the ground"


def test_a_file_of_boxes_with_an_unknown_class_says_which_box(
    store: SessionStore, editor: SessionEditor, sid: str, a_box: MakeBox
):
    for drafts, place in (([BoxDraft(7, a_box())], 0), ([BoxDraft(0, a_box()), BoxDraft(7, a_box())], 1)):
        with pytest.raises(BadInput, match=rf"^box {place}: there is no class 7.*its classes are: 0 cube"):
            editor.add_boxes(sid, drafts, author="me")
    assert store.revision(sid) == 0
