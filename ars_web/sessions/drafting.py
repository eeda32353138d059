"""What a change asked for means for a state: pure functions that find, check and name, for `editing.py`."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum, auto
from typing import Literal, TypeVar

import numpy as np

from ars_web.errors import BadInput, Conflict, Locked, NotFound
from ars_web.geometry.box import Box
from ars_web.geometry.keypoints import Keypoint, checked_keypoints
from ars_web.geometry.rigid_transform import Transform
from ars_web.geometry.symmetry import Symmetry
from ars_web.sessions.edits import same_content
from ars_web.sessions.model import ObjectClass, SessionState, VirtualBox
from ars_web.sessions.names import FreshNames, checked_name
from ars_web.sessions.palette import checked_color
from ars_web.sessions.sizes import checked_class_size

T = TypeVar("T", VirtualBox, ObjectClass)

SAME_PLACE = 1e-9
"""Metres, and entries of a rotation. A box that moves by less has not moved: a quaternion that was read from the
API and is sent back is off by a rounding error."""


class Unset(Enum):
    """Says of an argument that it was not given, where None means something."""

    UNSET = auto()


UNSET: Literal[Unset.UNSET] = Unset.UNSET

ClassSize = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class BoxDraft:
    """A box that is to be added; without a name it is called after its class.

    Attributes:
        hull, mesh: the digests of ones that the session has.
    """

    class_id: int
    box: Box
    name: str | None = None
    locked: bool = False
    hull: str | None = None
    mesh: str | None = None


def drafted_box(state: SessionState, draft: BoxDraft) -> VirtualBox:
    """The box that the draft becomes in the next revision, named and numbered.

    Raises:
        BadInput: its class does not exist or its name cannot be used.
    """
    return _drafted(state, draft, state.next_box_id, FreshNames(box.name for box in state.boxes.values()))


def drafted_boxes(state: SessionState, drafts: Sequence[BoxDraft]) -> list[VirtualBox]:
    """The boxes that the drafts become; raises as `drafted_box` does, and says which box it is, from 0."""
    boxes: list[VirtualBox] = []
    names = FreshNames(box.name for box in state.boxes.values())
    for i, draft in enumerate(drafts):
        try:
            boxes.append(_drafted(state, draft, state.next_box_id + i, names))
        except BadInput as error:
            raise BadInput(f"box {i}: {error}") from error
    return boxes


def _drafted(state: SessionState, draft: BoxDraft, box_id: int, names: FreshNames) -> VirtualBox:
    a_class = existing_class(state, draft.class_id)
    name = names.give(a_class.name) if draft.name is None else checked_name(draft.name, what="a box")
    names.take(name)
    return VirtualBox(
        box_id,
        a_class.id,
        name,
        draft.box,
        revision=state.revision + 1,
        locked=draft.locked,
        hull=draft.hull,
        mesh=draft.mesh,
    )


def changed_box(
    state: SessionState,
    before: VirtualBox,
    *,
    class_id: int | None,
    T_world_box: Transform | None,
    size: np.ndarray | None,
    name: str | None,
    locked: bool | None,
    mesh: str | Literal[Unset.UNSET] | None = UNSET,
) -> VirtualBox:
    """`before` with what is given in place, of the next revision; `before` itself where nothing differs.

    `mesh` is the digest of a stored one, or None for none.

    Raises:
        BadInput: a value cannot be a box's.
        Locked: the box is locked, is not to be unlocked with this, and more than its name would change.
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
        locked=before.locked if locked is None else locked,
        mesh=before.mesh if mesh is UNSET else mesh,
    )
    if after.locked:
        reclassed, reshaped = after.class_id != before.class_id, after.mesh != before.mesh
        changes = {"class": reclassed, "place": moved, "size": resized, "mesh": reshaped}
        refuse_locked(before, *(what for what, is_so in changes.items() if is_so))
    return before if same_content(before, after) else after


def refuse_locked(box: VirtualBox, *changes: str) -> None:
    """Refuse what a lock keeps from being changed: `class`, `place`, `size`, `mesh`, `masks`, or `existence` for
    deletion.

    Raises:
        Locked: the box is locked and there are changes.
    """
    if box.locked and changes:
        deleted = "existence" in changes
        what = "it can be deleted" if deleted else f"its {' and '.join(changes)} can be changed"
        raise Locked(f"box {box.id} ({box.name!r}) is locked: unlock it before {what}")


def changed_class(
    state: SessionState,
    before: ObjectClass,
    *,
    name: str | None,
    color: str | None,
    default_size: ClassSize | Literal[Unset.UNSET] | None,
    symmetry: Symmetry | Literal[Unset.UNSET] = UNSET,
    keypoints: Sequence[Keypoint] | Literal[Unset.UNSET] = UNSET,
    mesh: str | Literal[Unset.UNSET] | None = UNSET,
) -> ObjectClass:
    """`before` with what is given in place, of the next revision; `before` itself where nothing differs.

    `mesh` is the digest of a stored one, or None for none.

    Raises:
        BadInput: a value cannot be a class's.
    """
    after = replace(
        before,
        name=before.name if name is None else free_class_name(state, name, own_id=before.id),
        color=before.color if color is None else checked_color(color),
        default_size=before.default_size if default_size is UNSET else class_size(default_size),
        symmetry=before.symmetry if symmetry is UNSET else symmetry,
        keypoints=before.keypoints if keypoints is UNSET else checked_keypoints(keypoints),
        mesh=before.mesh if mesh is UNSET else mesh,
        revision=state.revision + 1,
    )
    return before if same_content(before, after) else after


def class_size(size: ClassSize | None) -> ClassSize | None:
    """A class's usual size, checked; None: nobody has said."""
    return None if size is None else checked_class_size(size)


def change_summary(before: VirtualBox, after: VirtualBox) -> str:
    """One line for the history."""
    said = {
        "Move": not np.array_equal(before.box.T_world_box, after.box.T_world_box),
        "Resize": not np.array_equal(before.box.size, after.box.size),
        "Rename": before.name != after.name,
        "Reclassify": before.class_id != after.class_id,
        "Lock": after.locked and not before.locked,
        "Unlock": before.locked and not after.locked,
        "Give a mesh to": after.mesh is not None and before.mesh != after.mesh,
        "Take the mesh from": before.mesh is not None and after.mesh is None,
    }
    verbs = [verb for verb, is_so in said.items() if is_so]
    return f"{verbs[0] if len(verbs) == 1 else 'Change'} {before.name}"


def class_change_summary(before: ObjectClass, after: ObjectClass) -> str:
    """One line for the history."""
    differing = {
        "appearance": (before.name, before.color) != (after.name, after.color),
        "mesh": before.mesh != after.mesh,
        "symmetry": before.symmetry != after.symmetry,
        "keypoints": before.keypoints != after.keypoints,
        # Set along with a mesh, it goes without saying.
        "size": before.default_size != after.default_size and before.mesh == after.mesh,
    }
    changed = [what for what, is_so in differing.items() if is_so]
    if changed == ["mesh"]:
        return f"{'Take the mesh from' if after.mesh is None else 'Give a mesh to'} class {before.name}"
    if changed in (["symmetry"], ["keypoints"]):
        return f"Set {changed[0]} of {before.name}"
    if changed != ["size"]:
        return f"Change class {before.name}"
    if after.default_size is None:
        return f"Clear size of {before.name}"
    return f"Set size of {before.name} to {' x '.join(f'{1000 * length:g}' for length in after.default_size)} mm"


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


def existing_box(state: SessionState, box_id: int) -> VirtualBox:
    """The box, at whatever revision.

    Raises:
        NotFound: there is none, or none any more.
    """
    if box_id not in state.boxes:
        deleted = "was deleted from" if 0 < box_id < state.next_box_id else "is not in"
        raise NotFound(f"box {box_id} {deleted} this session")
    return state.boxes[box_id]


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
