"""What outlines and boxes asked for mean for a state: pure functions that find, check and name, for
`object_editing.py`."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

from ars_web.errors import BadInput, Conflict, NotFound
from ars_web.geometry.box import Box
from ars_web.geometry.polygon import Polygon
from ars_web.sessions.drafting import box_at, existing_class, refuse_locked
from ars_web.sessions.edits import BoxChange, MaskChange, same_content
from ars_web.sessions.model import HullOptions, Mask, Origin, SessionState, VirtualBox
from ars_web.sessions.names import FreshNames, checked_name


@dataclass(frozen=True, eq=False)
class MaskDraft:
    """An outline that an object is to have in a frame; see `Mask`."""

    frame: int
    polygons: tuple[Polygon, ...]
    origin: Origin = "drawn"
    accepted: bool = True


@dataclass(frozen=True, eq=False)
class ObjectDraft:
    """A box that is to be made, or made anew, with masks that go with it.

    Attributes:
        box_id: of the box, or that is kept for it; None: the next.
        name: None: it keeps its name, or is called after its class.
        hull: the digest of one that is stored; None: it has none.
        masks: to be added, or to take the place of the object's in the same frames.
        drop_masks: ids of masks of the object that are deleted.
        expected_revision: of the box; None: there is no box yet.
        expected_masks: the revision of every mask that the object has; None: whatever masks it has, none of which is
            changed.
    """

    box_id: int | None
    class_id: int
    name: str | None
    box: Box
    hull: str | None
    hull_options: HullOptions | None
    masks: Sequence[MaskDraft]
    drop_masks: Collection[int]
    expected_revision: int | None
    expected_masks: Mapping[int, int] | None


def object_name(state: SessionState, box_id: int, class_id: int) -> str:
    """What people call the object: its box's name, or `a new cube`."""
    box = state.boxes.get(box_id)
    return f"a new {state.classes[class_id].name}" if box is None else box.name


def refuse_made(state: SessionState, box_id: int | None) -> None:
    """Refuse where the object's box is made from its masks.

    Raises:
        Conflict: it is; `current` is the box.
    """
    box = state.boxes.get(box_id or 0)
    if box is not None and box.hull_options is not None:
        raise Conflict(f"box {box.id} ({box.name!r}) was made from its masks meanwhile", current=box)


def mask_at(state: SessionState, mask_id: int, expected_revision: int) -> Mask:
    """The mask, which must be at `expected_revision`.

    Raises:
        NotFound: there never was such a mask.
        Conflict: it was changed or deleted since; `current` is the mask, or None.
    """
    mask = state.masks.get(mask_id)
    if mask is None and not 0 < mask_id < state.next_mask_id:
        raise NotFound(f"there is no mask {mask_id} in this session")
    return _at_revision(mask, f"mask {mask_id}", expected_revision)


def mask_changes(
    state: SessionState, draft: MaskDraft, *, box_id: int | None, class_id: int | None, expected_revision: int | None
) -> tuple[MaskChange, ...]:
    """What giving an object this outline changes: that mask first, also where it stays as it is.

    An object is of one class: its box's, or what is asked for here, which all its masks then are of.

    Raises:
        BadInput: the class does not exist, or is not the box's; a new object, without one.
        NotFound: the object has neither box nor masks.
        Conflict: the mask in that frame is not at `expected_revision` (None: there must be none); `current` is it.
        Locked: the box is.
    """
    object_id = _object_id(state, box_id)
    before = _mask_in(state, object_id, draft.frame)
    if expected_revision is None and before is not None:
        raise Conflict(f"object {object_id} has a mask in frame {draft.frame} already", current=before)
    if expected_revision is not None:
        _at_revision(before, f"the mask of object {object_id} in frame {draft.frame}", expected_revision)
    class_id = _object_class(state, object_id, class_id)
    after = _drafted(state, draft, object_id, class_id, before=before, new_id=state.next_mask_id)
    others = [mask for mask in state.masks_of(object_id) if mask is not before]
    return (MaskChange(after.id, before, after), *reclassed(state, others, class_id))


def reclassed(state: SessionState, masks: Sequence[Mask], class_id: int) -> tuple[MaskChange, ...]:
    """What having `masks` be of a class changes."""
    revision = state.revision + 1
    changed = (mask for mask in masks if mask.class_id != class_id)
    return tuple(MaskChange(mask.id, mask, replace(mask, class_id=class_id, revision=revision)) for mask in changed)


def object_changes(state: SessionState, draft: ObjectDraft) -> tuple[BoxChange, tuple[MaskChange, ...]]:
    """What making the draft's box changes: the box, also where it stays as it is, and masks.

    Raises:
        BadInput: the class does not exist, the name cannot be used, there is a hull's making without a hull, a frame
            twice, or a mask that is not among the object's or that is to go and to be there.
        NotFound: the object has neither box nor masks.
        Conflict: the box or a mask is not at its expected revision, or there are others; `current` is it, or None.
        Locked: the box is.
    """
    if draft.hull_options is not None and draft.hull is None:
        raise BadInput("how the hull was made says nothing where there is no hull; leave it out")
    before = state.boxes.get(draft.box_id or 0)
    if draft.box_id is not None and draft.expected_revision is not None:
        before = box_at(state, draft.box_id, draft.expected_revision)
    elif draft.box_id is None and draft.expected_revision is not None:
        raise BadInput("a new box has no revision that could be expected; leave it out, or say which box it is")
    elif before is not None:
        raise Conflict(f"box {before.id} ({before.name!r}) is there already", current=before)
    if before is not None:
        refuse_locked(before, "place", "size")
    object_id = _object_id(state, draft.box_id)
    class_id = existing_class(state, draft.class_id).id
    after = VirtualBox(
        id=object_id,
        class_id=class_id,
        name=_box_name(state, draft, before),
        box=draft.box,
        revision=state.revision + 1,
        hull=draft.hull,
        hull_options=draft.hull_options,
        mesh=None if before is None else before.mesh,
    )
    return BoxChange(object_id, before, after), _masks_of_object(state, draft, object_id, class_id)


def no_change(changes: Sequence[BoxChange | MaskChange]) -> bool:
    """Whether all is as it was."""
    return all(same_content(change.before, change.after) for change in changes)


def _masks_of_object(state: SessionState, draft: ObjectDraft, object_id: int, class_id: int) -> tuple[MaskChange, ...]:
    had = {mask.id: mask for mask in state.masks_of(object_id)}
    if draft.expected_masks is not None:
        _expect_masks(had, draft.expected_masks)
    changes: list[MaskChange] = []
    for mask_id in sorted(set(draft.drop_masks)):
        if draft.expected_masks is None or mask_id not in had:
            raise BadInput(f"mask {mask_id} cannot go with box {object_id}: its revision is not said to be expected")
        changes.append(MaskChange(mask_id, had.pop(mask_id), None))
    dropped = {change.before.frame for change in changes if change.before is not None}
    drafted: set[int] = set()
    by_frame = {mask.frame: mask for mask in had.values()}
    new_id = state.next_mask_id
    for mask in draft.masks:
        if mask.frame in drafted | dropped:
            raise BadInput(f"frame {mask.frame} has two masks of one object, or one that is to go, too; give it one")
        drafted.add(mask.frame)
        before = by_frame.get(mask.frame)
        if before is not None and draft.expected_masks is None:
            raise Conflict(f"object {object_id} has a mask in frame {mask.frame} already", current=before)
        after = _drafted(state, mask, object_id, class_id, before=before, new_id=new_id)
        new_id += before is None
        if not same_content(before, after):
            changes.append(MaskChange(after.id, before, after))
    untouched = [mask for mask in had.values() if mask.frame not in drafted]
    return (*changes, *reclassed(state, untouched, class_id))


def _expect_masks(had: Mapping[int, Mask], expected: Mapping[int, int]) -> None:
    for mask_id, revision in expected.items():
        _at_revision(had.get(mask_id), f"mask {mask_id}", revision)
    for mask in had.values():
        if mask.id not in expected:
            raise Conflict(
                f"mask {mask.id}, of object {mask.box_id} in frame {mask.frame}, was added meanwhile", current=mask
            )


def _object_id(state: SessionState, box_id: int | None) -> int:
    if box_id is None:
        return state.next_box_id
    box = state.boxes.get(box_id)
    if box is not None:
        refuse_locked(box, "masks")
    elif not state.masks_of(box_id):
        gone = "any more " if 0 < box_id < state.next_box_id else ""
        raise NotFound(
            f"object {box_id} has neither a box nor a mask {gone}in this session; leave the id out for a new object"
        )
    return box_id


def _object_class(state: SessionState, object_id: int, class_id: int | None) -> int:
    box = state.boxes.get(object_id)
    asked = None if class_id is None else existing_class(state, class_id)
    if box is not None:
        if asked is not None and asked.id != box.class_id:
            raise BadInput(
                f"box {box.id} ({box.name!r}) is of class {box.class_id}, not {asked.id} ({asked.name!r}): masks are of"
                " the class of their box; change that of the box"
            )
        return box.class_id
    if asked is not None:
        return asked.id
    masks = state.masks_of(object_id)
    if not masks:
        raise BadInput("the first mask of a new object needs a class_id")
    return masks[0].class_id


def _mask_in(state: SessionState, object_id: int, frame: int) -> Mask | None:
    return next((mask for mask in state.masks_of(object_id) if mask.frame == frame), None)


def _drafted(
    state: SessionState, draft: MaskDraft, object_id: int, class_id: int, *, before: Mask | None, new_id: int
) -> Mask:
    return Mask(
        id=new_id if before is None else before.id,
        box_id=object_id,
        frame=draft.frame,
        class_id=class_id,
        polygons=draft.polygons,
        origin=draft.origin,
        accepted=draft.accepted,
        revision=state.revision + 1,
    )


def _box_name(state: SessionState, draft: ObjectDraft, before: VirtualBox | None) -> str:
    if draft.name is not None:
        return checked_name(draft.name, what="a box")
    if before is not None:
        return before.name
    return FreshNames(box.name for box in state.boxes.values()).give(state.classes[draft.class_id].name)


def _at_revision(mask: Mask | None, what: str, expected: int) -> Mask:
    if mask is None:
        raise Conflict(f"{what} was deleted meanwhile", current=None)
    if mask.revision != expected:
        raise Conflict(f"{what} was changed meanwhile: it is at revision {mask.revision}, not {expected}", current=mask)
    return mask
