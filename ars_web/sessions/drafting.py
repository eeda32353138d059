"""What a change asked for means for a state: pure functions that find, check and name, for `editing.py`."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from ars_web.errors import BadInput, Conflict, NotFound
from ars_web.geometry.box import Box
from ars_web.geometry.rigid_transform import Transform
from ars_web.sessions.model import ObjectClass, SessionState, VirtualBox
from ars_web.sessions.names import FreshNames, checked_name

T = TypeVar("T", VirtualBox, ObjectClass)

SAME_PLACE = 1e-9
"""Metres, and entries of a rotation. A box that moves by less has not moved: a quaternion that was read from the
API and is sent back is off by a rounding error."""


@dataclass(frozen=True, eq=False)
class BoxDraft:
    """A box that is to be added; without a name it is called after its class."""

    class_id: int
    box: Box
    name: str | None = None


def drafted(state: SessionState, drafts: Sequence[BoxDraft]) -> list[VirtualBox]:
    """The boxes that the drafts become in the next revision, named and numbered.

    Raises:
        BadInput: a class does not exist or a name cannot be used; among several, the message says which.
    """
    boxes: list[VirtualBox] = []
    names = FreshNames(box.name for box in state.boxes.values())
    for i, draft in enumerate(drafts):
        try:
            a_class = existing_class(state, draft.class_id)
            name = names.give(a_class.name) if draft.name is None else checked_name(draft.name, what="a box")
        except BadInput as error:
            raise error if len(drafts) == 1 else BadInput(f"box {i}: {error}") from error
        names.take(name)
        boxes.append(
            VirtualBox(state.next_box_id + i, a_class.id, name, draft.box, has_hull=False, revision=state.revision + 1)
        )
    return boxes


def changed_box(
    state: SessionState,
    before: VirtualBox,
    *,
    class_id: int | None,
    T_world_box: Transform | None,
    size: np.ndarray | None,
    name: str | None,
) -> VirtualBox:
    """`before` with what is given in place, of the next revision; `before` itself where nothing differs.

    Raises:
        BadInput: a value cannot be a box's.
    """
    box = before.box
    asked = Box(
        box.T_world_box if T_world_box is None else T_world_box,
        box.size if size is None else size,
    )
    moved = np.abs(asked.T_world_box - box.T_world_box).max() > SAME_PLACE
    resized = np.abs(asked.size - box.size).max() > SAME_PLACE
    after = replace(
        before,
        class_id=before.class_id if class_id is None else existing_class(state, class_id).id,
        name=before.name if name is None else checked_name(name, what="a box"),
        box=Box(asked.T_world_box if moved else box.T_world_box, asked.size if resized else box.size),
        revision=state.revision + 1,
    )
    same = not moved and not resized and (after.class_id, after.name) == (before.class_id, before.name)
    return before if same else after


def change_summary(before: VirtualBox, after: VirtualBox) -> str:
    """One line for the history."""
    said = {
        "Move": not np.array_equal(before.box.T_world_box, after.box.T_world_box),
        "Resize": not np.array_equal(before.box.size, after.box.size),
        "Rename": before.name != after.name,
        "Reclassify": before.class_id != after.class_id,
    }
    verbs = [verb for verb, is_so in said.items() if is_so]
    return f"{verbs[0] if len(verbs) == 1 else 'Change'} {before.name}"


def box_at(state: SessionState, box_id: int, expected_revision: int) -> VirtualBox:
    """The box, which must be at `expected_revision`.

    Raises:
        NotFound: there never was such a box.
        Conflict: it was changed or deleted since; `current` is the box, or None.
    """
    box = state.boxes.get(box_id)
    if box is None and not 0 < box_id < state.next_box_id:
        raise NotFound(f"there is no box {box_id} in this session")
    return _at_revision(box, f"box {box_id}", expected_revision)


def class_at(state: SessionState, class_id: int, expected_revision: int) -> ObjectClass:
    """The class, which must be at `expected_revision`; raises as `box_at` does."""
    a_class = state.classes.get(class_id)
    if a_class is None and not 0 <= class_id < state.next_class_id:
        raise NotFound(f"there is no class {class_id} in this session")
    return _at_revision(a_class, f"class {class_id}", expected_revision)


def existing_class(state: SessionState, class_id: int) -> ObjectClass:
    """The class that a request names.

    Raises:
        BadInput: there is none.
    """
    if class_id not in state.classes:
        known = ", ".join(f"{c.id} {c.name}" for c in state.classes.values()) or "none yet; add one first"
        raise BadInput(f"there is no class {class_id} in this session; its classes are: {known}")
    return state.classes[class_id]


def free_class_name(state: SessionState, name: str, *, own_id: int | None = None) -> str:
    """`name`, checked, which no class but `own_id` may have.

    Raises:
        BadInput: it cannot be a name, or another class has it.
    """
    name = checked_name(name, what="a class")
    for other in state.classes.values():
        if other.name == name and other.id != own_id:
            raise BadInput(f"there is a class {name!r} already, with id {other.id}")
    return name


def _at_revision(thing: T | None, what: str, expected: int) -> T:
    if thing is None:
        raise Conflict(f"{what} was deleted meanwhile", current=None)
    if thing.revision != expected:
        raise Conflict(
            f"{what} ({thing.name!r}) was changed meanwhile: it is at revision {thing.revision}, not {expected}",
            current=thing,
        )
    return thing
