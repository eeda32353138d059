"""The one door for change."""

from collections.abc import Callable

import numpy as np
import pytest

from ars_web.errors import BadInput, Conflict, NotFound
from ars_web.geometry.box import Box
from ars_web.sessions.boxes_json import TransformJson, transform_json
from ars_web.sessions.editing import BoxDraft, NothingToUndo, SessionEditor
from ars_web.sessions.edits import Edit, differences, same
from ars_web.sessions.model import SessionState
from ars_web.sessions.outlines import polygons_json
from ars_web.sessions.store import SessionStore

MakeBox = Callable[..., Box]


def contents(state: SessionState) -> dict[str, object]:
    """The state without revisions: what a user sees."""
    return {
        "name": state.name,
        "classes": [(c.id, c.name, c.color, c.default_size) for c in state.classes.values()],
        "boxes": [
            (b.id, b.class_id, b.name, b.locked, b.hull, b.box.T_world_box.tolist(), b.box.size.tolist())
            for b in state.boxes.values()
        ],
        "masks": [
            (m.id, m.box_id, m.frame, m.class_id, m.accepted, polygons_json(m.polygons)) for m in state.masks.values()
        ],
    }


def test_a_box_is_added_named_and_numbered(store: SessionStore, editor: SessionEditor, sid: str, a_box: MakeBox):
    first = editor.add_box(sid, class_id=0, box=a_box(), author="me")
    second = editor.add_box(sid, class_id=0, box=a_box(1.0), author="me")
    third = editor.add_box(sid, class_id=0, box=a_box(), name=" cube ", author="me")
    assert [(b.id, b.name, b.revision, b.has_hull) for b in (first, second, third)] == [
        (1, "cube", 1, False), (2, "cube 2", 2, False), (3, "cube", 3, False),
    ]  # fmt: skip
    assert all(same(box, store.state(sid).boxes[box.id]) for box in (first, second, third))
    with SessionStore(store.folder) as again:
        assert differences(again.state(sid), store.state(sid)) == []


def test_a_box_changes_only_where_told(store: SessionStore, editor: SessionEditor, sid: str, a_box: MakeBox):
    box = editor.add_box(sid, class_id=0, box=a_box(), author="me")
    ring = editor.add_class(sid, name="ring", author="me")
    resized = editor.change_box(sid, 1, expected_revision=box.revision, size=np.array([1.0, 2.0, 3.0]), author="me")
    assert resized.box.size.tolist() == [1.0, 2.0, 3.0]
    assert np.array_equal(resized.box.T_world_box, box.box.T_world_box)
    assert (resized.name, resized.class_id, resized.revision) == ("cube", 0, 3)
    moved = editor.change_box(sid, 1, expected_revision=3, T_world_box=a_box(2.0).T_world_box, author="me")
    renamed = editor.change_box(sid, 1, expected_revision=4, name="left", author="me")
    other = editor.change_box(sid, 1, expected_revision=5, class_id=ring.id, author="me")
    both = editor.change_box(
        sid, 1, expected_revision=6, class_id=0, size=np.array([1.0, 1.0, 1.0]), name="x", author="me"
    )
    assert (moved.box.size.tolist(), renamed.name, other.class_id, both.name) == ([1.0, 2.0, 3.0], "left", 1, "x")
    assert [edit.summary for edit in store.edits(sid, after=2)] == [
        "Resize cube", "Move cube", "Rename cube", "Reclassify left", "Change left",
    ]  # fmt: skip


def test_a_change_that_changes_nothing_makes_no_revision(
    store: SessionStore, editor: SessionEditor, sid: str, a_box: MakeBox
):
    box = editor.add_box(sid, class_id=0, box=a_box(0.7), author="me")
    told: list[Edit] = []
    editor.listen(lambda sid, edit: told.append(edit))
    as_read = TransformJson.model_validate(transform_json(box.box.T_world_box)).matrix
    again = editor.change_box(
        sid, 1, expected_revision=1, T_world_box=as_read, size=box.box.size.copy(), name="cube", class_id=0, author="me"
    )
    assert same(again, box)
    assert editor.change_box(sid, 1, expected_revision=1, author="me") is not None
    assert editor.change_class(sid, 0, expected_revision=0, name="cube", color="#56B4E9", author="me").revision == 0
    assert editor.rename(sid, name="table", expected_revision=1, author="me").revision == 1
    assert editor.add_boxes(sid, [], author="me") == []
    assert store.revision(sid) == 1
    assert told == []


def test_a_stale_change_is_a_conflict_with_what_is_there_now(
    store: SessionStore, editor: SessionEditor, sid: str, a_box: MakeBox
):
    editor.add_box(sid, class_id=0, box=a_box(), author="me")
    now = editor.change_box(sid, 1, expected_revision=1, name="mine", author="me")
    for stale in (
        lambda: editor.change_box(sid, 1, expected_revision=1, name="yours", author="you"),
        lambda: editor.delete_box(sid, 1, expected_revision=1, author="you"),
        lambda: editor.change_box(sid, 1, expected_revision=3, name="yours", author="you"),
    ):
        with pytest.raises(Conflict, match="at revision 2, not") as caught:
            stale()
        assert same(caught.value.current, now)
    ring = editor.change_class(sid, 0, expected_revision=0, name="ring", author="me")
    with pytest.raises(Conflict) as caught:
        editor.change_class(sid, 0, expected_revision=0, color="#000000", author="you")
    assert caught.value.current == ring
    with pytest.raises(Conflict) as caught:
        editor.rename(sid, name="t", expected_revision=2, author="you")
    assert caught.value.current == store.summary(sid)
    editor.delete_box(sid, 1, expected_revision=2, author="me")
    with pytest.raises(Conflict, match="box 1 was deleted meanwhile") as caught:
        editor.change_box(sid, 1, expected_revision=2, name="yours", author="you")
    assert caught.value.current is None
    assert store.revision(sid) == 4


def test_what_is_not_there_is_not_found(editor: SessionEditor, sid: str):
    for box_id in (0, 1, -1, 99):
        with pytest.raises(NotFound, match=f"no box {box_id}"):
            editor.delete_box(sid, box_id, expected_revision=1, author="me")
    with pytest.raises(NotFound, match="no class 1"):
        editor.change_class(sid, 1, expected_revision=0, name="x", author="me")


def test_bad_values_are_refused_and_nothing_is_kept(
    store: SessionStore, editor: SessionEditor, sid: str, a_box: MakeBox
):
    editor.add_box(sid, class_id=0, box=a_box(), author="me")
    skewed = np.eye(4)
    skewed[0, 1] = 0.5
    for bad, message in (
        (lambda: editor.add_box(sid, class_id=7, box=a_box(), author="me"), "no class 7 .* its classes are: 0 cube"),
        (lambda: editor.add_box(sid, class_id=0, box=a_box(), name="", author="me"), "a box needs a name"),
        (lambda: editor.add_box(sid, class_id=0, box=a_box(), author=""), "an author needs a name"),
        (lambda: editor.change_box(sid, 1, expected_revision=1, class_id=7, author="me"), "no class 7"),
        (lambda: editor.change_box(sid, 1, expected_revision=1, size=np.array([1.0, -1.0, 1.0]), author="me"), "size"),
        (lambda: editor.change_box(sid, 1, expected_revision=1, size=np.array([np.nan, 1, 1]), author="me"), "size"),
        (lambda: editor.change_box(sid, 1, expected_revision=1, T_world_box=skewed, author="me"), "not a rotation"),
        (lambda: editor.change_box(sid, 1, expected_revision=1, name="a\tb", author="me"), "control character"),
        (lambda: editor.add_class(sid, name="cube", author="me"), "a class 'cube' already, with id 0"),
        (lambda: editor.add_class(sid, name="ring", color="red", author="me"), "#rrggbb"),
        (lambda: editor.delete_class(sid, 0, expected_revision=0, author="me"), r"used by 1 box\(es\), such as 'cube'"),
        (lambda: editor.rename(sid, name="", expected_revision=1, author="me"), "a session needs a name"),
    ):
        with pytest.raises(BadInput, match=message):
            bad()
    assert store.revision(sid) == 1


def test_class_names_differ_by_case_and_may_stay(editor: SessionEditor, sid: str):
    assert editor.add_class(sid, name="Cube", author="me").id == 1
    assert editor.change_class(sid, 1, expected_revision=1, name="Cube", color="#111111", author="me").name == "Cube"
    with pytest.raises(BadInput, match="'cube' already"):
        editor.change_class(sid, 1, expected_revision=2, name="cube", author="me")


def test_ids_are_never_used_again(store: SessionStore, editor: SessionEditor, sid: str, a_box: MakeBox):
    ring = editor.add_class(sid, name="ring", author="me")
    editor.undo(sid, author="me")
    ball = editor.add_class(sid, name="ball", author="me")
    assert (ring.id, ball.id) == (1, 2)
    editor.delete_class(sid, ball.id, expected_revision=ball.revision, author="me")
    assert editor.add_class(sid, name="ball", author="me").id == 3
    box = editor.add_box(sid, class_id=0, box=a_box(), author="me")
    editor.delete_box(sid, box.id, expected_revision=box.revision, author="me")
    with SessionStore(store.folder) as again:  # nor by another process
        assert SessionEditor(again).add_box(sid, class_id=0, box=a_box(), author="me").id == 2


def test_several_boxes_are_one_step(store: SessionStore, editor: SessionEditor, sid: str, a_box: MakeBox):
    drafts = [BoxDraft(0, a_box(i)) for i in range(3)] + [BoxDraft(0, a_box(9.0), "own")]
    added = editor.add_boxes(sid, drafts, author="cli")
    assert [(b.id, b.name) for b in added] == [(1, "cube"), (2, "cube 2"), (3, "cube 3"), (4, "own")]
    assert {b.revision for b in added} == {1}
    assert editor.undo(sid, author="cli").summary == "Undo: Import boxes"
    assert store.state(sid).boxes == {}
    editor.redo(sid, author="cli")
    assert list(store.state(sid).boxes) == [1, 2, 3, 4]
    with pytest.raises(BadInput, match="box 1: there is no class 5"):
        editor.add_boxes(sid, [BoxDraft(0, a_box()), BoxDraft(5, a_box())], author="cli")
    assert store.revision(sid) == 3


def test_undo_and_redo_walk_one_line(store: SessionStore, editor: SessionEditor, sid: str, a_box: MakeBox):
    states = [contents(store.state(sid))]

    def keep() -> None:
        states.append(contents(store.state(sid)))

    editor.add_box(sid, class_id=0, box=a_box(), author="me")
    keep()
    editor.change_box(sid, 1, expected_revision=1, T_world_box=a_box(1.0).T_world_box, author="me")
    keep()
    editor.delete_box(sid, 1, expected_revision=2, author="me")
    keep()
    editor.add_class(sid, name="ring", author="me")
    keep()
    editor.rename(sid, name="desk", expected_revision=4, author="me")
    keep()
    for _ in range(2):
        for expected in reversed(states[:-1]):
            editor.undo(sid, author="me")
            assert contents(store.state(sid)) == expected
        with pytest.raises(NothingToUndo, match="'me' has nothing to undo"):
            editor.undo(sid, author="me")
        for expected in states[1:]:
            editor.redo(sid, author="me")
            assert contents(store.state(sid)) == expected
        with pytest.raises(NothingToUndo, match="nothing to redo"):
            editor.redo(sid, author="me")
    assert store.revision(sid) == 5 * 5
    assert store.edits(sid)[-1].summary == "Redo: Rename the session to desk"


def test_a_new_edit_ends_what_could_be_redone(editor: SessionEditor, sid: str):
    editor.add_class(sid, name="ring", author="me")
    editor.undo(sid, author="me")
    editor.add_class(sid, name="ball", author="you")
    editor.redo(sid, author="me")  # somebody else's edit does not
    editor.undo(sid, author="me")
    editor.add_class(sid, name="rod", author="me")
    with pytest.raises(NothingToUndo):
        editor.redo(sid, author="me")


def test_undo_says_what_it_undoes(editor: SessionEditor, sid: str):
    editor.add_class(sid, name="ring", author="me")
    undo = editor.undo(sid, author="me")
    redo = editor.redo(sid, author="me")
    again = editor.undo(sid, author="me")
    assert [(e.revision, e.undoes, e.redoes) for e in (undo, redo, again)] == [(2, 1, None), (3, None, 2), (4, 3, None)]
    assert [e.summary for e in (undo, redo, again)] == [
        "Undo: Add class ring", "Redo: Add class ring", "Undo: Add class ring",
    ]  # fmt: skip


def test_undo_is_each_authors_own(store: SessionStore, editor: SessionEditor, sid: str, a_box: MakeBox):
    editor.add_box(sid, class_id=0, box=a_box(), author="me")
    editor.add_box(sid, class_id=0, box=a_box(1.0), author="you")
    editor.undo(sid, author="me")
    assert list(store.state(sid).boxes) == [2]
    with pytest.raises(NothingToUndo):
        editor.undo(sid, author="me")
    with pytest.raises(NothingToUndo):
        editor.undo(sid, author="somebody")


def test_undo_never_takes_away_what_someone_else_did_since(
    store: SessionStore, editor: SessionEditor, sid: str, a_box: MakeBox
):
    editor.add_box(sid, class_id=0, box=a_box(), author="me")
    moved = editor.change_box(sid, 1, expected_revision=1, T_world_box=a_box(1.0).T_world_box, author="you")
    with pytest.raises(Conflict, match=r"box 1 \('cube'\) was changed meanwhile, in revision 2") as caught:
        editor.undo(sid, author="me")
    assert same(caught.value.current, moved)
    assert store.revision(sid) == 2
    editor.undo(sid, author="you")
    editor.undo(sid, author="me")  # what they did is taken back: nothing of theirs is lost
    assert store.state(sid).boxes == {}
    editor.redo(sid, author="me")
    editor.delete_box(sid, 1, expected_revision=5, author="you")
    with pytest.raises(Conflict, match="was deleted meanwhile") as caught:
        editor.undo(sid, author="me")
    assert caught.value.current is None


def test_redo_never_takes_away_what_someone_else_did_since(
    store: SessionStore, editor: SessionEditor, sid: str, a_box: MakeBox
):
    editor.add_box(sid, class_id=0, box=a_box(), author="me")
    editor.change_box(sid, 1, expected_revision=1, name="mine", author="me")
    editor.undo(sid, author="me")
    editor.change_box(sid, 1, expected_revision=3, name="yours", author="you")
    with pytest.raises(Conflict):
        editor.redo(sid, author="me")
    assert store.state(sid).boxes[1].name == "yours"


def test_undoing_a_class_that_is_used_by_now_is_refused(editor: SessionEditor, sid: str, a_box: MakeBox):
    ring = editor.add_class(sid, name="ring", author="me")
    box = editor.add_box(sid, class_id=ring.id, box=a_box(), author="you")
    with pytest.raises(Conflict, match="box 'ring' uses class 'ring'") as caught:
        editor.undo(sid, author="me")
    assert same(caught.value.current, box)


def test_undo_that_no_longer_fits_is_refused(store: SessionStore, editor: SessionEditor, sid: str, a_box: MakeBox):
    ring = editor.add_class(sid, name="ring", author="me")
    box = editor.add_box(sid, class_id=ring.id, box=a_box(), author="me")
    editor.delete_box(sid, box.id, expected_revision=box.revision, author="me")
    editor.delete_class(sid, ring.id, expected_revision=ring.revision, author="you")
    with pytest.raises(Conflict, match="needs class 1, which is gone"):
        editor.undo(sid, author="me")
    editor.change_class(sid, 0, expected_revision=0, name="ring", author="me")
    with pytest.raises(Conflict, match="another class called 'ring'"):
        editor.undo(sid, author="you")
    editor.rename(sid, name="a", expected_revision=5, author="me")
    editor.rename(sid, name="b", expected_revision=6, author="you")
    with pytest.raises(Conflict, match="renamed to 'b' meanwhile") as caught:
        editor.undo(sid, author="me")
    assert caught.value.current == store.summary(sid)


def test_a_repeated_key_answers_what_the_first_answered(
    store: SessionStore, editor: SessionEditor, sid: str, a_box: MakeBox
):
    first = editor.add_box(sid, class_id=0, box=a_box(), author="me", key="k")
    editor.change_box(sid, 1, expected_revision=1, name="other", author="me")
    repeat = editor.add_box(sid, class_id=0, box=a_box(), author="me", key="k")
    assert same(first, repeat)
    ring = editor.add_class(sid, name="ring", author="me", key="k2")
    with SessionStore(store.folder) as other:
        assert SessionEditor(other).add_class(sid, name="ring", author="me", key="k2") == ring
    assert store.revision(sid) == 3
    for another in (
        lambda: editor.add_box(sid, class_id=0, box=a_box(1.0), author="me", key="k"),
        lambda: editor.add_box(sid, class_id=0, box=a_box(), name="n", author="me", key="k"),
        lambda: editor.add_box(sid, class_id=0, box=a_box(), author="you", key="k"),
        lambda: editor.add_class(sid, name="rod", author="me", key="k"),
        lambda: editor.add_box(sid, class_id=0, box=a_box(), author="me", key=""),
    ):
        with pytest.raises(BadInput, match="idempotency key"):
            another()
    assert store.revision(sid) == 3


def test_a_refused_request_leaves_its_key_free(editor: SessionEditor, sid: str, a_box: MakeBox):
    with pytest.raises(BadInput):
        editor.add_box(sid, class_id=1, box=a_box(), author="me", key="k")
    editor.add_class(sid, name="ring", author="me")
    assert editor.add_box(sid, class_id=1, box=a_box(), author="me", key="k").id == 1


def test_listeners_hear_of_every_edit_once_it_is_kept(
    store: SessionStore, editor: SessionEditor, sid: str, a_box: MakeBox, caplog: pytest.LogCaptureFixture
):
    heard: list[tuple[int, int]] = []

    def fails(sid: str, edit: Edit) -> None:
        raise RuntimeError("a view broke")

    def hears(session: str, edit: Edit) -> None:
        assert session == sid
        heard.append((edit.revision, store.revision(sid)))

    editor.listen(fails)
    stop = editor.listen(hears)
    stop_again = editor.listen(hears)
    editor.add_box(sid, class_id=0, box=a_box(), author="me")
    assert heard == [(1, 1), (1, 1)]
    assert "a listener failed on revision 1" in caplog.text
    stop_again()
    editor.undo(sid, author="me")
    with pytest.raises(BadInput):
        editor.add_box(sid, class_id=8, box=a_box(), author="me")
    stop()
    stop()
    editor.redo(sid, author="me")
    assert heard == [(1, 1), (1, 1), (2, 2)]


def test_a_listener_may_edit(store: SessionStore, editor: SessionEditor, sid: str):
    heard: list[list[int]] = [[], []]

    def answers(session: str, edit: Edit) -> None:
        heard[0].append(edit.revision)
        if edit.revision < 3:
            editor.add_class(session, name=f"c{edit.revision}", author="it")

    editor.listen(answers)
    editor.listen(lambda session, edit: heard[1].append(edit.revision))
    editor.add_class(sid, name="first", author="me")
    assert heard == [[1, 2, 3], [1, 2, 3]]
