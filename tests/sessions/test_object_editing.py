"""Outlines of objects, and boxes that are made with them in one step."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ars_web.errors import ArsError, BadInput, Conflict, Locked, NotFound
from ars_web.geometry.box import Box
from ars_web.geometry.polygon import Polygon
from ars_web.sessions.editing import MaskDraft, SessionEditor
from ars_web.sessions.edits import differences, replay, same, same_content
from ars_web.sessions.hull_mesh import HullMesh
from ars_web.sessions.model import HullOptions, Mask, SessionState
from ars_web.sessions.outlines import same_polygons
from ars_web.sessions.store import SessionStore

MakeBox = Callable[..., Box]
MakeHull = Callable[..., HullMesh]
Outline = Callable[..., tuple[Polygon, ...]]

OPTIONS = HullOptions("upright", "mass", widen=1.5, ground=0.0)


@pytest.fixture(autouse=True)
def replays(store: SessionStore, sid: str):
    """After every test the log leads to the state, and another store reads the very same from the tables."""
    origin = store.state(sid)
    yield
    assert differences(replay(origin, store.edits(sid)), store.state(sid)) == []
    with SessionStore(store.folder) as again:
        assert differences(again.state(sid), store.state(sid)) == []
    assert all("images are not where" in problem for problem in store.check())


@pytest.fixture
def drawn(editor: SessionEditor, sid: str, outline: Outline) -> tuple[Mask, Mask]:
    """The masks of a new object in frames 0 and 2, drawn by me; the session is at revision 2."""
    first = editor.put_mask(
        sid, box_id=None, frame=0, class_id=0, polygons=outline(), expected_revision=None, author="me"
    )
    second = editor.put_mask(sid, box_id=1, frame=2, polygons=outline(40), expected_revision=None, author="me")
    return first, second


@pytest.fixture
def made(editor: SessionEditor, sid: str, drawn: tuple[Mask, Mask], a_box: MakeBox, a_hull: MakeHull) -> SessionState:
    """The session at revision 3, with box 1 and a hull of the two masks, made by me."""
    put(editor, sid, a_box(), a_hull(), box_id=1, expected_masks={1: 1, 2: 2})
    return editor._store.state(sid)


def put(editor: SessionEditor, sid: str, box: Box, hull: HullMesh | None, **more: object):
    given = {"box_id": None, "class_id": 0, "hull_options": OPTIONS if hull else None, "author": "me", **more}
    return editor.put_object(sid, box=box, hull=hull, **given)


def summaries(store: SessionStore, sid: str) -> list[str]:
    return [edit.summary for edit in store.edits(sid)]


def test_the_first_mask_of_an_object_keeps_an_id_for_its_box(
    store: SessionStore, editor: SessionEditor, sid: str, drawn: tuple[Mask, Mask], a_box: MakeBox, outline: Outline
):
    first, second = drawn
    assert (first.id, first.box_id, first.frame, first.class_id, first.revision) == (1, 1, 0, 0, 1)
    assert (second.id, second.box_id, second.frame, second.class_id, second.revision) == (2, 1, 2, 0, 2)
    assert (first.origin, first.accepted) == ("drawn", True)
    assert same_polygons(first.polygons, outline())
    state = store.state(sid)
    assert (state.boxes, state.next_box_id, state.next_mask_id) == ({}, 2, 3)
    assert [mask.id for mask in state.masks_of(1)] == [1, 2]
    assert editor.add_box(sid, class_id=0, box=a_box(), author="you").id == 2
    other = editor.put_mask(
        sid, box_id=None, frame=0, class_id=0, polygons=outline(), expected_revision=None, author="me"
    )
    assert (other.id, other.box_id) == (3, 3)
    assert summaries(store, sid) == [
        "Outline a new cube in frame 0", "Outline a new cube in frame 2", "Add cube", "Outline a new cube in frame 0",
    ]  # fmt: skip


def test_a_mask_changes_where_told(
    store: SessionStore, editor: SessionEditor, sid: str, drawn: tuple[Mask, Mask], outline: Outline
):
    first = drawn[0]
    same_again = editor.put_mask(sid, box_id=1, frame=0, polygons=outline(), expected_revision=1, author="me")
    assert same(same_again, first)
    assert store.revision(sid) == 2
    changed = editor.put_mask(
        sid, box_id=1, frame=0, polygons=outline(5), origin="smart", expected_revision=1, author="me"
    )
    assert (changed.id, changed.revision, changed.origin) == (1, 3, "smart")
    assert same_polygons(changed.polygons, outline(5))
    refused = editor.put_mask(
        sid, box_id=1, frame=0, polygons=outline(5), origin="smart", accepted=False, expected_revision=3, author="me"
    )
    assert (refused.accepted, refused.revision) == (False, 4)
    editor.put_mask(sid, box_id=1, frame=0, polygons=outline(5), expected_revision=4, author="me")
    assert summaries(store, sid)[2:] == [
        "Change outline of a new cube in frame 0",
        "Set aside outline of a new cube in frame 0",
        "Accept outline of a new cube in frame 0",
    ]


def test_a_stale_change_of_a_mask_is_a_conflict_with_what_is_there_now(
    store: SessionStore, editor: SessionEditor, sid: str, drawn: tuple[Mask, Mask], outline: Outline
):
    now = editor.put_mask(sid, box_id=1, frame=0, polygons=outline(5), expected_revision=1, author="you")
    for stale in (
        lambda: editor.put_mask(sid, box_id=1, frame=0, polygons=outline(), expected_revision=1, author="me"),
        lambda: editor.put_mask(sid, box_id=1, frame=0, polygons=outline(), expected_revision=None, author="me"),
        lambda: editor.delete_mask(sid, 1, expected_revision=1, author="me"),
    ):
        with pytest.raises(Conflict) as caught:
            stale()
        assert same(caught.value.current, now)
    editor.delete_mask(sid, 1, expected_revision=3, author="you")
    for gone in (
        lambda: editor.put_mask(sid, box_id=1, frame=0, polygons=outline(), expected_revision=3, author="me"),
        lambda: editor.put_mask(sid, box_id=1, frame=1, polygons=outline(), expected_revision=3, author="me"),
        lambda: editor.delete_mask(sid, 1, expected_revision=3, author="me"),
    ):
        with pytest.raises(Conflict, match="was deleted meanwhile") as caught:
            gone()
        assert caught.value.current is None
    for mask_id in (0, -1, 3):
        with pytest.raises(NotFound, match=f"no mask {mask_id} in this session"):
            editor.delete_mask(sid, mask_id, expected_revision=1, author="me")
    assert store.revision(sid) == 4


def test_what_cannot_be_a_mask_is_refused_and_nothing_is_kept(
    store: SessionStore, editor: SessionEditor, sid: str, made: SessionState, outline: Outline, a_box: MakeBox
):
    ring = editor.add_class(sid, name="ring", author="me")
    deleted = editor.add_box(sid, class_id=0, box=a_box(), author="me")
    editor.delete_box(sid, deleted.id, expected_revision=deleted.revision, author="me")
    before = store.state(sid)
    far = (Polygon(np.array([[0.0, 0.0], [700.0, 0.0], [700.0, 9.0]])),)
    given = {"box_id": 1, "frame": 1, "polygons": outline(), "expected_revision": None, "author": "me"}
    for wrong, error, message in (
        ({"frame": 3}, BadInput, "no frame 3; its frames are 0 to 2"),
        ({"frame": -1}, BadInput, "no frame -1"),
        # Of the frame's own camera, 320 x 240.
        ({"polygons": far}, BadInput, r"the image of 320 x 240 pixels.*\(700, 0\) is not"),
        ({"polygons": ()}, BadInput, "at least one polygon"),
        ({"origin": "guessed"}, BadInput, "one of drawn, smart, proposed, not 'guessed'"),
        ({"box_id": None}, BadInput, "the first mask of a new object needs a class_id"),
        ({"box_id": None, "class_id": 7}, BadInput, "no class 7"),
        ({"class_id": ring.id}, BadInput, r"box 1 \('cube'\) is of class 0, not 1 \('ring'\)"),
        ({"box_id": 2}, NotFound, "object 2 has neither a box nor a mask any more"),
        ({"box_id": 3}, NotFound, "object 3 has neither a box nor a mask in this session"),
        ({"box_id": 0}, NotFound, "object 0 has neither"),
        ({"author": ""}, BadInput, "an author needs a name"),
    ):
        with pytest.raises(error, match=message):
            editor.put_mask(sid, **{**given, **wrong})
    assert store.state(sid) is before


def test_the_masks_of_an_object_are_of_one_class(
    store: SessionStore, editor: SessionEditor, sid: str, drawn: tuple[Mask, Mask], outline: Outline, a_box: MakeBox
):
    for name in ("ring", "ball"):
        editor.add_class(sid, name=name, author="me")
    mask = editor.put_mask(sid, box_id=1, frame=1, class_id=1, polygons=outline(), expected_revision=None, author="me")
    assert {(m.class_id, m.revision) for m in store.state(sid).masks.values()} == {(1, 5)}
    with pytest.raises(BadInput, match=r"class 'ring' is used by 3 outline\(s\), such as that of object 1 in frame 0"):
        editor.delete_class(sid, 1, expected_revision=3, author="me")
    editor.put_mask(
        sid, box_id=1, frame=1, class_id=2, polygons=mask.polygons, expected_revision=mask.revision, author="me"
    )
    assert {m.class_id for m in store.state(sid).masks.values()} == {2}
    editor.delete_class(sid, 1, expected_revision=3, author="you")
    with pytest.raises(Conflict, match=r"mask of object 1 in frame \d needs class 1, which is gone"):
        editor.undo(sid, author="me")
    put(editor, sid, a_box(), None, box_id=1, class_id=0)
    assert {m.class_id for m in store.state(sid).masks.values()} == {0}
    box = store.state(sid).boxes[1]
    editor.change_box(sid, 1, expected_revision=box.revision, class_id=2, author="me")
    assert {m.class_id for m in store.state(sid).masks.values()} == {2}
    assert summaries(store, sid)[-1] == "Reclassify cube"
    editor.undo(sid, author="me")
    assert {m.class_id for m in store.state(sid).masks.values()} == {0}
    assert editor.put_mask(sid, box_id=1, frame=0, polygons=outline(9), expected_revision=10, author="me").class_id == 0


def test_an_object_of_masks_becomes_a_box_with_a_hull_under_the_id_kept_for_it(
    store: SessionStore, editor: SessionEditor, sid: str, made: SessionState, a_box: MakeBox, a_hull: MakeHull
):
    (box,) = made.boxes.values()
    assert (box.id, box.name, box.class_id, box.revision, box.locked) == (1, "cube", 0, 3, False)
    assert (box.hull, box.hull_options, box.has_hull) == (a_hull().digest, OPTIONS, True)
    assert np.array_equal(box.box.T_world_box, a_box().T_world_box)
    # Nothing of the masks changed, so they are at their revisions.
    assert [mask.revision for mask in made.masks.values()] == [1, 2]
    stored = store.hull(sid, a_hull().digest)
    assert np.array_equal(stored.vertices, a_hull().vertices)
    assert np.array_equal(stored.faces, a_hull().faces)
    assert set(store.snapshot(sid).hulls) == {a_hull().digest}
    with SessionStore(store.folder) as again:
        assert again.snapshot(sid).hulls[a_hull().digest].digest == a_hull().digest
        assert again.hull(sid, a_hull().digest).digest == a_hull().digest
    with pytest.raises(NotFound, match="no hull 'abc'"):
        store.hull(sid, "abc")


def test_box_hull_and_masks_are_one_step_of_undo(
    store: SessionStore, editor: SessionEditor, sid: str, a_box: MakeBox, a_hull: MakeHull, outline: Outline
):
    first = put(
        editor, sid, a_box(), a_hull(), name="left", masks=[MaskDraft(0, outline()), MaskDraft(2, outline(3))],
        expected_masks={},
    )  # fmt: skip
    assert (first.id, first.name) == (1, "left")
    assert {(m.id, m.frame, m.box_id, m.revision) for m in store.state(sid).masks.values()} == {
        (1, 0, 1, 1), (2, 2, 1, 1),
    }  # fmt: skip
    second = put(
        editor, sid, a_box(1.0), a_hull(0.5), box_id=1, expected_revision=1, expected_masks={1: 1, 2: 1},
        masks=[MaskDraft(1, outline(7), "proposed", accepted=False), MaskDraft(0, outline(8), "smart")],
        drop_masks=[2], summary="Outline the rest of left",
    )  # fmt: skip
    assert (second.name, second.hull, second.revision) == ("left", a_hull(0.5).digest, 2)
    masks = store.state(sid).masks
    assert {(m.id, m.frame, m.origin, m.accepted) for m in masks.values()} == {
        (1, 0, "smart", True), (3, 1, "proposed", False),
    }  # fmt: skip
    assert editor.undo(sid, author="me").summary == "Undo: Outline the rest of left"
    state = store.state(sid)
    assert same_content(state.boxes[1], first)
    assert set(store.snapshot(sid).hulls) == {a_hull().digest}
    assert {(m.id, m.frame, m.origin) for m in state.masks.values()} == {(1, 0, "drawn"), (2, 2, "drawn")}
    assert same_polygons(state.masks[1].polygons, outline())
    editor.undo(sid, author="me")
    state = store.state(sid)
    assert (state.boxes, state.masks, state.next_box_id, state.next_mask_id) == ({}, {}, 2, 4)
    assert store.snapshot(sid).hulls == {}
    editor.redo(sid, author="me")
    editor.redo(sid, author="me")
    assert same_content(store.state(sid).boxes[1], second)
    assert all(same_content(mask, masks[id_]) for id_, mask in store.state(sid).masks.items())
    assert set(store.snapshot(sid).hulls) == {a_hull(0.5).digest}


def test_undoing_the_box_leaves_an_object_that_was_drawn_before(
    store: SessionStore, editor: SessionEditor, sid: str, made: SessionState, outline: Outline, a_hull: MakeHull
):
    editor.undo(sid, author="me")
    state = store.state(sid)
    assert (state.boxes, list(state.masks)) == ({}, [1, 2])
    assert editor.put_mask(sid, box_id=1, frame=1, polygons=outline(), expected_revision=None, author="me").box_id == 1
    editor.undo(sid, author="me")
    for _ in range(2):
        editor.undo(sid, author="me")
    assert store.state(sid).masks == {}
    with pytest.raises(NotFound, match="any more"):
        editor.put_mask(sid, box_id=1, frame=1, polygons=outline(), expected_revision=None, author="me")


def test_deleting_a_box_deletes_its_masks_and_undo_brings_both_back(
    store: SessionStore, editor: SessionEditor, sid: str, made: SessionState, outline: Outline
):
    other = editor.put_mask(
        sid, box_id=None, frame=0, class_id=0, polygons=outline(), expected_revision=None, author="you"
    )
    editor.delete_box(sid, 1, expected_revision=3, author="me")
    state = store.state(sid)
    assert (state.boxes, list(state.masks)) == ({}, [other.id])
    assert summaries(store, sid)[-1] == "Delete cube"
    with pytest.raises(NotFound):
        editor.put_mask(sid, box_id=1, frame=1, polygons=outline(), expected_revision=None, author="me")
    editor.undo(sid, author="me")
    state = store.state(sid)
    assert same_content(state.boxes[1], made.boxes[1])
    assert all(same_content(state.masks[mask.id], mask) for mask in made.masks.values())
    assert state.boxes[1].hull in store.snapshot(sid).hulls


def test_what_moved_on_since_the_hull_was_made_is_a_conflict(
    store: SessionStore, editor: SessionEditor, sid: str, made: SessionState, a_box: MakeBox, a_hull: MakeHull,
    outline: Outline,
):  # fmt: skip
    now = editor.put_mask(sid, box_id=1, frame=0, polygons=outline(5), expected_revision=1, author="you")
    added = editor.put_mask(sid, box_id=1, frame=1, polygons=outline(5), expected_revision=None, author="you")
    box = editor.change_box(sid, 1, expected_revision=3, name="left", author="you")
    editor.delete_mask(sid, 2, expected_revision=2, author="you")
    right = {"box_id": 1, "expected_revision": box.revision, "expected_masks": {1: now.revision, 3: added.revision}}
    for stale, message, current in (
        ({"expected_revision": 3}, "box 1 .* was changed meanwhile: it is at revision 6, not 3", box),
        ({"expected_revision": None}, "box 1 .* is there already", box),
        ({"expected_masks": {1: 1, 3: added.revision}}, "mask 1 was changed meanwhile", now),
        ({"expected_masks": {1: now.revision}}, "mask 3, of object 1 in frame 1, was added meanwhile", added),
        ({"expected_masks": {1: 4, 2: 2, 3: 5}}, "mask 2 was deleted meanwhile", None),
        ({"expected_masks": None, "masks": [MaskDraft(1, outline())]}, "has a mask in frame 1 already", added),
        ({"box_id": None, "expected_revision": None}, "mask 1 was deleted meanwhile", None),
    ):
        with pytest.raises(Conflict, match=message) as caught:
            put(editor, sid, a_box(), a_hull(), **{**right, **stale})
        assert (caught.value.current is None) if current is None else same(caught.value.current, current)
    assert store.revision(sid) == 7
    assert put(editor, sid, a_box(1.0), a_hull(), **right).revision == 8
    editor.delete_box(sid, 1, expected_revision=8, author="you")
    with pytest.raises(Conflict, match="box 1 was deleted meanwhile") as caught:
        put(editor, sid, a_box(), a_hull(), **{**right, "expected_revision": 8})
    assert caught.value.current is None
    with pytest.raises(NotFound, match="object 1 has neither a box nor a mask any more"):
        put(editor, sid, a_box(), a_hull(), box_id=1)


def test_what_cannot_be_an_object_is_refused_and_nothing_is_kept(
    store: SessionStore, editor: SessionEditor, sid: str, made: SessionState, a_box: MakeBox, a_hull: MakeHull,
    outline: Outline,
):  # fmt: skip
    given = {"box_id": 1, "expected_revision": 3, "expected_masks": {1: 1, 2: 2}}
    twice = [MaskDraft(1, outline()), MaskDraft(1, outline(4))]
    for wrong, error, message in (
        ({"class_id": 7}, BadInput, "no class 7"),
        ({"name": "a\tb"}, BadInput, "control character"),
        ({"masks": twice}, BadInput, "frame 1 has two masks"),
        ({"masks": [MaskDraft(0, outline(4))], "drop_masks": [1]}, BadInput, "frame 0 has two masks"),
        ({"masks": [MaskDraft(9, outline())]}, BadInput, "no frame 9"),
        ({"drop_masks": [9]}, BadInput, "mask 9 cannot go with box 1"),
        ({"expected_masks": None, "drop_masks": [1]}, BadInput, "its revision is not said to be expected"),
        ({"box_id": None, "expected_masks": {}}, BadInput, "a new box has no revision"),
        ({"box_id": 9}, NotFound, "no box 9"),
        ({"box_id": 9, "expected_revision": None, "expected_masks": None}, NotFound, "object 9 has neither"),
        ({"author": ""}, BadInput, "an author needs a name"),
    ):
        with pytest.raises(error, match=message):
            put(editor, sid, a_box(), a_hull(0.7), **{**given, **wrong})
    with pytest.raises(BadInput, match="where there is no hull"):
        put(editor, sid, a_box(), None, hull_options=OPTIONS, **given)
    assert store.state(sid) is made
    with pytest.raises(NotFound):  # nor the hull
        store.hull(sid, a_hull(0.7).digest)


def test_a_locked_box_keeps_its_hull_and_masks(
    store: SessionStore, editor: SessionEditor, sid: str, made: SessionState, a_box: MakeBox, a_hull: MakeHull,
    outline: Outline,
):  # fmt: skip
    editor.put_mask(sid, box_id=1, frame=1, polygons=outline(), expected_revision=None, author="me")
    locked = editor.change_box(sid, 1, expected_revision=3, locked=True, author="you")
    for refused in (
        lambda: editor.put_mask(sid, box_id=1, frame=0, polygons=outline(7), expected_revision=1, author="me"),
        lambda: editor.delete_mask(sid, 1, expected_revision=1, author="me"),
        lambda: put(editor, sid, a_box(), a_hull(), box_id=1, expected_revision=5),
        lambda: editor.delete_box(sid, 1, expected_revision=5, author="me"),
    ):
        with pytest.raises(Locked, match=r"box 1 \('cube'\) is locked: unlock it before"):
            refused()
    with pytest.raises(Conflict, match="was locked meanwhile, and its masks with it") as caught:
        editor.undo(sid, author="me")
    assert same(caught.value.current, locked)
    assert store.revision(sid) == 5
    editor.undo(sid, author="you")
    editor.undo(sid, author="me")
    assert list(store.state(sid).masks) == [1, 2]


def test_nothing_new_makes_no_revision_but_new_masks_do(
    store: SessionStore, editor: SessionEditor, sid: str, made: SessionState, a_box: MakeBox, a_hull: MakeHull,
    outline: Outline,
):  # fmt: skip
    given = {"box_id": 1, "expected_revision": 3, "expected_masks": {1: 1, 2: 2}}
    again = put(editor, sid, a_box(), a_hull(), masks=[MaskDraft(0, outline())], **given)
    assert same(again, made.boxes[1])
    assert store.revision(sid) == 3
    waiting = put(editor, sid, a_box(), a_hull(), masks=[MaskDraft(1, outline(), "proposed", False)], **given)
    assert (waiting.revision, store.state(sid).masks[3].accepted) == (4, False)
    assert same_content(waiting, made.boxes[1])


def test_the_hull_stays_with_a_box_that_is_moved_renamed_or_copied(
    store: SessionStore, editor: SessionEditor, sid: str, made: SessionState, a_box: MakeBox, a_hull: MakeHull
):
    renamed = editor.change_box(sid, 1, expected_revision=3, name="left", author="me")
    resized = editor.change_box(sid, 1, expected_revision=4, size=2 * a_box().size, author="me")
    moved = editor.change_box(sid, 1, expected_revision=5, T_world_box=a_box(2.0).T_world_box, author="me")
    assert {box.hull for box in (renamed, resized, moved)} == {a_hull().digest}
    assert {box.hull_options for box in (renamed, resized, moved)} == {OPTIONS}
    stored = store.snapshot(sid).hulls[a_hull().digest]
    small, large = (stored.in_world(box.box)[0] for box in (renamed, resized))
    centre = a_box().T_world_box[:3, 3]
    assert large - centre == pytest.approx(2 * (small - centre))
    copy = editor.duplicate_box(sid, 1, author="me")
    assert (copy.hull, copy.hull_options) == (a_hull().digest, None)
    assert store.state(sid).masks_of(copy.id) == ()
    editor.delete_box(sid, 1, expected_revision=6, author="me")
    assert set(store.snapshot(sid).hulls) == {a_hull().digest}
    assert store.hull(sid, a_hull().digest).digest == a_hull().digest


def test_a_repeated_key_answers_what_the_first_answered(
    store: SessionStore, editor: SessionEditor, sid: str, a_box: MakeBox, a_hull: MakeHull, outline: Outline
):
    asked = {"box_id": None, "frame": 0, "class_id": 0, "polygons": outline(), "expected_revision": None}
    first = editor.put_mask(sid, **asked, author="me", key="k")
    changed = editor.put_mask(sid, box_id=1, frame=0, polygons=outline(9), expected_revision=1, author="me")
    assert same(editor.put_mask(sid, **asked, author="me", key="k"), first)
    request = ["from masks", {"views": 2}]
    assert editor.object_made(sid, request=request, author="me", key="k2") is None
    made = put(editor, sid, a_box(), a_hull(), box_id=1, expected_masks={1: 2}, key="k2", request=request)
    editor.change_box(sid, 1, expected_revision=3, name="left", author="me")
    known = editor.object_made(sid, request=request, author="me", key="k2")
    # Worked out anew it may be another box by a rounding error; what was asked for is the same.
    repeat = put(editor, sid, a_box(1e-9), a_hull(), box_id=1, expected_masks={1: 2}, key="k2", request=request)
    assert known is not None
    assert same(known, made)
    assert same(repeat, made)
    plain = put(editor, sid, a_box(), a_hull(), masks=[MaskDraft(0, outline())], key="k3")
    assert same(put(editor, sid, a_box(), a_hull(), masks=[MaskDraft(0, outline())], key="k3"), plain)
    assert store.revision(sid) == 5
    assert changed.revision == 2
    for another in (
        lambda: editor.put_mask(sid, **{**asked, "frame": 1}, author="me", key="k"),
        lambda: editor.put_mask(sid, **{**asked, "polygons": outline(1)}, author="me", key="k"),
        lambda: editor.put_mask(sid, **asked, accepted=False, author="me", key="k"),
        lambda: editor.put_mask(sid, **asked, author="you", key="k"),
        lambda: editor.object_made(sid, request=["from masks", {"views": 3}], author="me", key="k2"),
        lambda: put(editor, sid, a_box(), a_hull(), masks=[MaskDraft(1, outline())], key="k3"),
        lambda: put(editor, sid, a_box(), a_hull(0.5), masks=[MaskDraft(0, outline())], key="k3"),
        lambda: put(editor, sid, a_box(), a_hull(), masks=[MaskDraft(0, outline())], key="k"),
    ):
        with pytest.raises(BadInput, match="idempotency key"):
            another()


def test_each_authors_undo_is_their_own_across_masks_and_boxes(
    store: SessionStore, editor: SessionEditor, sid: str, made: SessionState, outline: Outline, a_box: MakeBox,
    a_hull: MakeHull,
):  # fmt: skip
    editor.put_mask(sid, box_id=1, frame=1, polygons=outline(), expected_revision=None, author="you")
    editor.undo(sid, author="me")  # the box; your mask stays, of an object without a box
    assert (list(store.state(sid).boxes), list(store.state(sid).masks)) == ([], [1, 2, 3])
    editor.redo(sid, author="me")
    mask = editor.put_mask(sid, box_id=1, frame=2, polygons=outline(50), expected_revision=2, author="you")
    editor.undo(sid, author="me")
    with pytest.raises(Conflict, match=r"mask 2 .*was changed meanwhile, in revision 7") as caught:
        editor.undo(sid, author="me")
    assert same(caught.value.current, mask)
    editor.undo(sid, author="you")
    editor.undo(sid, author="me")
    assert list(store.state(sid).masks) == [1, 3]
    # In the frame of a mask that was taken back there is another one by now.
    editor.put_mask(sid, box_id=1, frame=2, polygons=outline(), expected_revision=None, author="you")
    with pytest.raises(Conflict, match="another mask of object 1 in frame 2"):
        editor.redo(sid, author="me")


def test_a_mask_may_take_the_place_of_one_that_goes_in_one_edit(
    store: SessionStore, editor: SessionEditor, sid: str, drawn: tuple[Mask, Mask], outline: Outline
):
    """As after a deletion and a new drawing, both taken back and made again."""
    editor.delete_mask(sid, 2, expected_revision=2, author="me")
    new = editor.put_mask(sid, box_id=1, frame=2, polygons=outline(5), expected_revision=None, author="me")
    assert new.id == 3
    for _ in range(2):
        editor.undo(sid, author="me")
    assert list(store.state(sid).masks) == [1, 2]
    for _ in range(2):
        editor.redo(sid, author="me")
    assert list(store.state(sid).masks) == [1, 3]


def test_two_people_make_one_box_of_one_object(
    store: SessionStore, editor: SessionEditor, sid: str, drawn: tuple[Mask, Mask], a_box: MakeBox, a_hull: MakeHull
):
    first = put(editor, sid, a_box(), a_hull(), box_id=1, expected_masks={1: 1, 2: 2}, author="me")
    with SessionStore(store.folder) as other, pytest.raises(Conflict, match="is there already") as caught:
        put(SessionEditor(other), sid, a_box(), a_hull(), box_id=1, expected_masks={1: 1, 2: 2}, author="you")
    assert same(caught.value.current, first)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"orientation": "north"}, "one of world, upright, free, not 'north'"),
        ({"position": "top"}, "one of box, mass, not 'top'"),
        ({"widen": -1.0}, "0 to 100 pixels, not -1.0"),
        ({"widen": float("nan")}, "not nan"),
        ({"ground": float("inf")}, "within 1e"),
    ],
)
def test_options_that_no_hull_can_have_are_refused(wrong: dict[str, object], message: str):
    with pytest.raises(ArsError, match=message):
        replace(OPTIONS, **wrong)
