"""Edits are pure: applied, inverted, replayed."""

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ars_web.errors import Conflict
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.keypoints import Keypoint
from ars_web.geometry.polygon import Polygon
from ars_web.geometry.symmetry import NO_SYMMETRY, Symmetry
from ars_web.sessions.edit_json import changes_from_json, changes_json, state_from_json, state_json
from ars_web.sessions.edits import (
    BoxChange,
    Change,
    ClassChange,
    Edit,
    MaskChange,
    NameChange,
    apply,
    differences,
    inverse,
    replay,
    restated,
    same,
)
from ars_web.sessions.model import HullOptions, Mask, ObjectClass, SessionState, VirtualBox

EMPTY = SessionState(0, "s", {}, {}, 0, 1)
AT = datetime(2026, 1, 2, tzinfo=UTC)


def edit(revision: int, *changes: Change, undoes: int | None = None) -> Edit:
    return Edit(revision, "me", "x", changes, undoes, None, AT)


def cube_class(revision: int = 1, name: str = "cube", id_: int = 0) -> ObjectClass:
    return ObjectClass(id_, name, "#56b4e9", revision)


def a_box(revision: int, x: float = 0.0, id_: int = 1, class_id: int = 0) -> VirtualBox:
    T = rigid_transform.from_position_wxyz(np.array([x, 0.1, 0.2]), np.array([1.0, 0.2, 0.3, x]))
    return VirtualBox(id_, class_id, "cube", Box(T, np.array([0.1, 0.2, 0.3])), revision)


TRIANGLE = Polygon(np.array([[0.0, 0.0], [9.0, 0.0], [9.0, 7.5]]))


def a_mask(revision: int, id_: int = 1, box_id: int = 1, frame: int = 0, class_id: int = 0) -> Mask:
    return Mask(id_, box_id, frame, class_id, (TRIANGLE,), "drawn", True, revision)


def with_a_box() -> SessionState:
    state = apply(EMPTY, edit(1, ClassChange(0, None, cube_class())))
    return apply(state, edit(2, BoxChange(1, None, a_box(2))))


def test_adding_moves_the_next_id_on_and_taking_back_does_not_move_it_back():
    state = with_a_box()
    assert (state.revision, state.next_class_id, state.next_box_id) == (2, 1, 2)
    taken_back = apply(state, edit(3, *restated(inverse([BoxChange(1, None, a_box(2))]), state, revision=3)))
    assert taken_back.boxes == {}
    assert taken_back.next_box_id == 2


def test_an_edit_must_be_the_next_one():
    with pytest.raises(Conflict, match="edit 3 cannot follow revision 0"):
        apply(EMPTY, edit(3))


@pytest.mark.parametrize(
    "found",
    [None, a_box(2, x=1.0), replace(a_box(2), name="other"), a_box(7)],
    ids=["nothing", "moved", "renamed", "of another revision"],
)
def test_an_edit_that_does_not_find_what_it_expects_is_a_conflict(found: VirtualBox | None):
    state = with_a_box()
    with pytest.raises(Conflict) as caught:
        apply(state, edit(3, BoxChange(1, found, a_box(3, x=2.0))))
    assert caught.value.current is state.boxes[1]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (BoxChange(2, None, a_box(3, id_=2, class_id=9)), "needs class 9"),
        (ClassChange(0, cube_class(), None), "uses class 'cube'"),
        (ClassChange(1, None, cube_class(3, id_=1)), "another class called 'cube'"),
        (BoxChange(2, None, a_box(2, id_=2)), "revision 2"),
        (BoxChange(3, None, a_box(3, id_=2)), "with id 2"),
        (NameChange("not its name", "t"), "renamed to 's'"),
    ],
)
def test_an_edit_that_would_break_the_state_is_a_conflict(change: Change, message: str):
    with pytest.raises(Conflict, match=message):
        apply(with_a_box(), edit(3, change))


def test_one_edit_may_take_a_class_with_its_boxes():
    state = with_a_box()
    assert apply(state, edit(3, BoxChange(1, state.boxes[1], None), ClassChange(0, state.classes[0], None))).boxes == {}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ([MaskChange(1, None, a_mask(3, class_id=9))], "mask of object 1 in frame 0 needs class 9"),
        (
            [MaskChange(1, None, a_mask(3)), MaskChange(2, None, a_mask(3, id_=2))],
            "there is another mask of object 1 in frame 0",
        ),
        ([MaskChange(1, None, a_mask(2))], "revision 2"),
        ([MaskChange(2, None, a_mask(3))], "with id 1"),
        ([MaskChange(1, a_mask(2), None)], r"mask 1 \(mask of object 1 in frame 0\) was deleted meanwhile"),
        (
            [
                MaskChange(1, None, a_mask(3, box_id=7)),
                BoxChange(1, a_box(2), None),
                ClassChange(0, cube_class(), None),
            ],
            "needs class 0, which is gone",
        ),
    ],
)
def test_a_mask_that_would_break_the_state_is_a_conflict(changes: list[Change], message: str):
    with pytest.raises(Conflict, match=message):
        apply(with_a_box(), edit(3, *changes))


def test_a_class_that_masks_use_stays():
    state = apply(with_a_box(), edit(3, MaskChange(1, None, a_mask(3, box_id=2)), BoxChange(1, a_box(2), None)))
    with pytest.raises(Conflict, match="mask of object 2 in frame 0 uses class 'cube': delete the mask first"):
        apply(state, edit(4, ClassChange(0, cube_class(), None)))


def test_a_mask_keeps_the_id_of_its_object_for_ever():
    state = apply(with_a_box(), edit(3, MaskChange(4, None, a_mask(3, id_=4, box_id=9))))
    assert (state.next_box_id, state.next_mask_id) == (10, 5)
    state = apply(state, edit(4, MaskChange(4, a_mask(3, id_=4, box_id=9), None)))
    assert (state.next_box_id, state.next_mask_id, state.masks) == (10, 5, {})


def test_one_edit_may_put_a_mask_in_the_place_of_another():
    state = apply(with_a_box(), edit(3, MaskChange(1, None, a_mask(3))))
    state = apply(state, edit(4, MaskChange(2, None, a_mask(4, id_=2)), MaskChange(1, a_mask(3), None)))
    assert list(state.masks) == [2]


def test_restating_accepts_another_revision_but_no_other_content():
    state = apply(with_a_box(), edit(3, BoxChange(1, a_box(2), a_box(3, x=1.0))))
    state = apply(state, edit(4, BoxChange(1, a_box(3, x=1.0), a_box(4))))
    (change,) = restated(inverse([BoxChange(1, None, a_box(2))]), state, revision=5)
    assert isinstance(change, BoxChange)
    assert change.before is state.boxes[1]
    moved = apply(state, edit(5, BoxChange(1, a_box(4), a_box(5, x=2.0))))
    with pytest.raises(Conflict, match=r"box 1 \('cube'\) was changed meanwhile, in revision 5"):
        restated(inverse([BoxChange(1, None, a_box(2))]), moved, revision=6)


numbers = st.floats(-1e3, 1e3, allow_nan=False)
options = st.builds(
    HullOptions,
    st.sampled_from(["world", "upright", "free"]),
    st.sampled_from(["box", "mass"]),
    st.floats(0, 100),
    st.none() | numbers,
)
boxes = st.builds(
    lambda id_, position, wxyz, size, revision, hull, mesh: VirtualBox(
        id_, 0, "b", Box(rigid_transform.from_position_wxyz(np.array(position), np.array(wxyz)), np.array(size)),
        revision, False, *hull, mesh,
    ),
    st.integers(1, 5),
    st.tuples(numbers, numbers, numbers),
    st.tuples(numbers, numbers, numbers, numbers).filter(lambda q: np.linalg.norm(q) > 1e-3),
    st.tuples(*[st.floats(1e-6, 1e3)] * 3),
    st.integers(0, 10**6),
    st.tuples(st.sampled_from(["0a" * 32, "b1" * 32]), st.none() | options) | st.just((None, None)),
    st.none() | st.just("2c" * 32),
)  # fmt: skip
pixels = st.tuples(numbers, numbers)
rings = st.lists(pixels, min_size=3, max_size=5).map(np.array)
masks = st.builds(
    Mask,
    st.integers(1, 5),
    st.integers(1, 9),
    st.integers(0, 9),
    st.integers(0, 5),
    st.lists(st.builds(Polygon, rings, st.lists(rings, max_size=2).map(tuple)), min_size=1, max_size=3).map(tuple),
    st.sampled_from(["drawn", "smart", "proposed"]),
    st.booleans(),
    st.integers(0, 10**6),
)
axes = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda axis: np.linalg.norm(axis) > 1e-3)
symmetries = st.one_of(
    st.just(NO_SYMMETRY),
    st.builds(lambda axis, order: Symmetry("discrete", ((axis, order),)), axes, st.integers(2, 72)),
    st.builds(lambda axis, flip: Symmetry("continuous", axis=axis, flip=flip), axes, st.booleans()),
)
places = st.tuples(*[st.floats(-2, 2)] * 3)
classes = st.builds(
    ObjectClass,
    st.integers(0, 5),
    st.text("abcö漢", min_size=1),
    st.just("#aabbcc"),
    st.integers(0, 9),
    st.none() | st.just((0.1, 0.2, 0.3)),
    st.none() | st.just("2c" * 32),
    symmetries,
    st.dictionaries(st.text("abö", min_size=1, max_size=3), places, max_size=3).map(
        lambda points: tuple(Keypoint(name, place) for name, place in points.items())
    ),
)
changes = st.one_of(
    st.builds(lambda a, b: BoxChange(a.id, a, b and replace(b, id=a.id)), boxes, st.none() | boxes),
    st.builds(lambda b: BoxChange(b.id, None, b), boxes),
    st.builds(lambda a, b: ClassChange(a.id, a, b and replace(b, id=a.id)), classes, st.none() | classes),
    st.builds(lambda a, b: MaskChange(a.id, a, b and replace(b, id=a.id)), masks, st.none() | masks),
    st.builds(lambda b: MaskChange(b.id, None, b), masks),
    st.builds(NameChange, st.text("ab", min_size=1), st.text("ab", min_size=1)),
)


def alike(a: Change, b: Change) -> bool:
    if isinstance(a, BoxChange) and isinstance(b, BoxChange):
        return a.box_id == b.box_id and same(a.before, b.before) and same(a.after, b.after)
    if isinstance(a, MaskChange) and isinstance(b, MaskChange):
        return a.mask_id == b.mask_id and same(a.before, b.before) and same(a.after, b.after)
    return a == b


@given(st.lists(changes, max_size=5))
def test_inverting_twice_is_the_identity(made: list[Change]):
    twice = inverse(inverse(made))
    assert len(twice) == len(made)
    assert all(a is b or alike(a, b) for a, b in zip(made, twice, strict=True))


@given(st.lists(changes, max_size=5))
def test_changes_come_back_from_json_bit_by_bit(made: list[Change]):
    back = changes_from_json(changes_json(tuple(made)))
    assert len(back) == len(made)
    assert all(alike(a, b) for a, b in zip(made, back, strict=True))


@given(
    st.dictionaries(st.integers(1, 5), boxes),
    st.dictionaries(st.integers(0, 5), classes),
    st.dictionaries(st.integers(1, 5), masks),
)
def test_a_state_comes_back_from_json_bit_by_bit(
    some: dict[int, VirtualBox], kinds: dict[int, ObjectClass], outlined: dict[int, Mask]
):
    state = SessionState(
        3,
        "s",
        {k: replace(c, id=k) for k, c in kinds.items()},
        {k: replace(b, id=k) for k, b in some.items()},
        6,
        10,
        {k: replace(m, id=k) for k, m in outlined.items()},
        6,
    )
    assert differences(state, state_from_json(state_json(state))) == []


def test_replaying_reports_a_gap():
    with pytest.raises(Conflict, match="edit 2 cannot follow revision 0"):
        replay(EMPTY, [edit(2, NameChange("s", "t"))])


def test_differences_name_what_differs():
    state = with_a_box()
    other = replace(state, name="t", boxes={1: a_box(2, x=1e-15), 2: a_box(2, id_=2)}, masks={3: a_mask(2, id_=3)})
    assert differences(state, other) == ["name: 's' and 't'", "box 1", "box 2", "mask 3"]
    hulls = [replace(state, boxes={1: replace(a_box(2), hull=hull)}) for hull in ("0a" * 32, "b1" * 32, None)]
    assert [differences(a, b) for a in hulls for b in hulls].count([]) == 3
    shaped = cube_class(2)
    for unlike in (
        replace(shaped, mesh="0a" * 32), replace(shaped, symmetry=Symmetry("continuous", axis=(0.0, 0.0, 1.0))),
        replace(shaped, keypoints=(Keypoint("tip", (0.0, 0.0, 0.5)),)), replace(shaped, default_size=(1.0, 1.0, 1.0)),
    ):  # fmt: skip
        assert differences(replace(state, classes={0: shaped}), replace(state, classes={0: unlike})) == ["class 0"]
    meshed = replace(a_box(2), mesh="0a" * 32)
    assert differences(replace(state, boxes={1: a_box(2)}), replace(state, boxes={1: meshed})) == ["box 1"]
    base = a_mask(2)
    for unlike in (
        replace(base, frame=1), replace(base, box_id=2), replace(base, class_id=1), replace(base, origin="smart"),
        replace(base, accepted=False), replace(base, revision=3),
        replace(base, polygons=(Polygon(TRIANGLE.outer + 0.001),)),
    ):  # fmt: skip
        assert differences(replace(state, masks={1: base}), replace(state, masks={1: unlike})) == ["mask 1"]
