"""Edits: every change to a session is one of these, and its inverse is one too.

An `Edit` is a list of changes, each holding what it found and what it left. So the inverse swaps the two, undo
appends an inverse edit, and an edit that no longer finds what it expects is a conflict, never a silent loss.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from functools import reduce
from typing import TypeVar

import numpy as np

from ars_web.errors import Conflict
from ars_web.sessions.model import Mask, ObjectClass, SessionState, VirtualBox
from ars_web.sessions.outlines import same_polygons


@dataclass(frozen=True, eq=False)
class BoxChange:
    """One box from `before` to `after`; None before: it is added; None after: it is deleted."""

    box_id: int
    before: VirtualBox | None
    after: VirtualBox | None


@dataclass(frozen=True)
class ClassChange:
    """One class from `before` to `after`; None before: it is added; None after: it is deleted."""

    class_id: int
    before: ObjectClass | None
    after: ObjectClass | None


@dataclass(frozen=True, eq=False)
class MaskChange:
    """One mask from `before` to `after`; None before: it is added; None after: it is deleted."""

    mask_id: int
    before: Mask | None
    after: Mask | None

    @property
    def box_id(self) -> int:
        """The object's."""
        known = self.before or self.after
        return 0 if known is None else known.box_id


@dataclass(frozen=True)
class NameChange:
    """The session's own name."""

    before: str
    after: str


Change = BoxChange | ClassChange | MaskChange | NameChange


@dataclass(frozen=True, eq=False)
class Edit:
    """One entry of the log; applying it makes `revision`.

    Attributes:
        revision: the session's revision after it, gap-free from 1.
        author: who, as the door that took it in calls them (`local`, `cli`, a page's user); undo is each author's own.
        summary: one line for the history, such as `Move cube`.
        changes: applied together or not at all; no box, class or mask occurs twice in them.
        undoes: the revision whose edit this one inverts, for undo; None otherwise.
        redoes: the revision of the undo that this one inverts, for redo; None otherwise.
        at: UTC.
    """

    revision: int
    author: str
    summary: str
    changes: tuple[Change, ...]
    undoes: int | None
    redoes: int | None
    at: datetime

    @property
    def deed(self) -> str:
        """What was done, taken back or made again: `Move cube`, also of `Undo: Move cube`."""
        if self.undoes is None and self.redoes is None:
            return self.summary
        return self.summary.removeprefix("Undo: ").removeprefix("Redo: ")


Thing = VirtualBox | ObjectClass | Mask
T = TypeVar("T", VirtualBox, ObjectClass, Mask)


def same_content(a: Thing | None, b: Thing | None) -> bool:
    """Whether two boxes, classes or masks are alike in everything but the revision that made them so."""
    if isinstance(a, ObjectClass) and isinstance(b, ObjectClass):
        return replace(a, revision=b.revision) == b
    if isinstance(a, VirtualBox) and isinstance(b, VirtualBox):
        return (
            (a.id, a.class_id, a.name, a.locked, a.hull, a.hull_options, a.mesh)
            == (b.id, b.class_id, b.name, b.locked, b.hull, b.hull_options, b.mesh)
            and np.array_equal(a.box.T_world_box, b.box.T_world_box)
            and np.array_equal(a.box.size, b.box.size)
        )
    if isinstance(a, Mask) and isinstance(b, Mask):
        return (
            (a.id, a.box_id, a.frame, a.class_id, a.origin, a.accepted)
            == (b.id, b.box_id, b.frame, b.class_id, b.origin, b.accepted)
        ) and same_polygons(a.polygons, b.polygons)
    return a is None and b is None


def same(a: Thing | None, b: Thing | None) -> bool:
    """Whether two boxes, classes or masks are alike, their revisions included."""
    return same_content(a, b) and (a is None or b is None or a.revision == b.revision)


def inverse(changes: Iterable[Change]) -> tuple[Change, ...]:
    """The changes that take back `changes`: last first, each from what it left to what it found."""
    return tuple(replace(change, before=change.after, after=change.before) for change in reversed(tuple(changes)))


def restated(changes: Sequence[Change], state: SessionState, *, revision: int) -> tuple[Change, ...]:
    """`changes` as they read when made to `state` now, to make `revision`.

    What they expect to find must be there; only who last touched it, its revision, may differ.

    Raises:
        Conflict: a box, a class, a mask or the name is not what the changes expect; `current` is what it is.
    """
    out: list[Change] = []
    for change in changes:
        if isinstance(change, NameChange):
            _expect_name(change, state.name)
            out.append(change)
        elif isinstance(change, BoxChange):
            found = state.boxes.get(change.box_id)
            if not same_content(found, change.before):
                raise Conflict(_moved_on(change, found), current=found)
            out.append(BoxChange(change.box_id, found, _at(change.after, revision)))
        elif isinstance(change, MaskChange):
            found = state.masks.get(change.mask_id)
            if not same_content(found, change.before):
                raise Conflict(_moved_on(change, found), current=found)
            out.append(MaskChange(change.mask_id, found, _at(change.after, revision)))
        else:
            found = state.classes.get(change.class_id)
            if not same_content(found, change.before):
                raise Conflict(_moved_on(change, found), current=found)
            out.append(ClassChange(change.class_id, found, _at(change.after, revision)))
    return tuple(out)


def _at(thing: T | None, revision: int) -> T | None:
    return None if thing is None else replace(thing, revision=revision)


def apply(state: SessionState, edit: Edit) -> SessionState:
    """The state after `edit`.

    Raises:
        Conflict: the edit is not the next one, does not find what it expects, or would leave a box or a mask
            without its class, two classes of one name, or two masks of one object in one frame. `state` is untouched.
    """
    if edit.revision != state.revision + 1:
        raise Conflict(f"edit {edit.revision} cannot follow revision {state.revision}")
    classes, boxes, masks, name = dict(state.classes), dict(state.boxes), dict(state.masks), state.name
    for change in edit.changes:
        if isinstance(change, NameChange):
            _expect_name(change, name)
            name = change.after
        elif isinstance(change, BoxChange):
            _put(boxes, change.box_id, change.before, change.after, edit.revision, change)
        elif isinstance(change, MaskChange):
            _put(masks, change.mask_id, change.before, change.after, edit.revision, change)
        else:
            _put(classes, change.class_id, change.before, change.after, edit.revision, change)
    _refuse_broken_links(edit.changes, classes, boxes, masks)
    objects = [c.box_id + 1 for c in edit.changes if isinstance(c, BoxChange | MaskChange)]
    return SessionState(
        revision=edit.revision,
        name=name,
        classes=dict(sorted(classes.items())),
        boxes=dict(sorted(boxes.items())),
        masks=dict(sorted(masks.items())),
        # An id that was given once stays given, also when undo has taken its box away; masks keep one for theirs.
        next_class_id=max(
            state.next_class_id, *(c.class_id + 1 for c in edit.changes if isinstance(c, ClassChange)), 0
        ),
        next_box_id=max(state.next_box_id, *objects, 0),
        next_mask_id=max(state.next_mask_id, *(c.mask_id + 1 for c in edit.changes if isinstance(c, MaskChange)), 0),
    )


def replay(origin: SessionState, edits: Iterable[Edit]) -> SessionState:
    """The state that a log of edits leads to, from the state at its beginning.

    Raises:
        Conflict: an edit is missing or does not fit.
    """
    return reduce(apply, edits, origin)


def differences(a: SessionState, b: SessionState) -> list[str]:
    """In what two states differ, in words; empty where they are alike, bit by bit."""
    found: list[str] = []
    for what in ("revision", "name", "next_class_id", "next_box_id", "next_mask_id"):
        if getattr(a, what) != getattr(b, what):
            found.append(f"{what}: {getattr(a, what)!r} and {getattr(b, what)!r}")
    found += [f"class {id_}" for id_ in _unlike(a.classes, b.classes)]
    found += [f"box {id_}" for id_ in _unlike(a.boxes, b.boxes)]
    found += [f"mask {id_}" for id_ in _unlike(a.masks, b.masks)]
    return found


def _unlike(a: Mapping[int, Thing], b: Mapping[int, Thing]) -> list[int]:
    return [id_ for id_ in sorted(a.keys() | b.keys()) if not same(a.get(id_), b.get(id_))]


def _put(
    things: dict[int, T],
    id_: int,
    before: T | None,
    after: T | None,
    revision: int,
    change: BoxChange | ClassChange | MaskChange,
) -> None:
    found = things.get(id_)
    if not same(found, before):
        raise Conflict(_moved_on(change, found), current=found)
    if after is None:
        things.pop(id_, None)
        return
    if after.id != id_ or after.revision != revision:
        raise Conflict(f"edit {revision} leaves {_called(after)} with id {after.id} and revision {after.revision}")
    things[id_] = after


def _refuse_broken_links(
    changes: Iterable[Change],
    classes: dict[int, ObjectClass],
    boxes: dict[int, VirtualBox],
    masks: dict[int, Mask],
) -> None:
    gone: dict[int, str] = {}
    named: set[str] = set()
    outlined: set[int] = set()
    for change in changes:
        if isinstance(change, BoxChange | MaskChange) and change.after is not None:
            if change.after.class_id not in classes:
                raise Conflict(f"{_called(change.after)} needs class {change.after.class_id}, which is gone")
        if isinstance(change, MaskChange) and change.after is not None:
            outlined.add(change.after.box_id)
        if isinstance(change, ClassChange) and change.before is not None and change.after is None:
            gone[change.class_id] = change.before.name
        if isinstance(change, ClassChange) and change.after is not None:
            named.add(change.after.name)
    if gone:
        for user in (*boxes.values(), *masks.values()):
            if user.class_id in gone:
                it = "the box" if isinstance(user, VirtualBox) else "the mask"
                raise Conflict(f"{_called(user)} uses class {gone[user.class_id]!r}: delete {it} first", current=user)
    if named:
        seen: set[str] = set()
        for a_class in classes.values():
            if a_class.name in seen:
                raise Conflict(f"there is another class called {a_class.name!r}", current=a_class)
            seen.add(a_class.name)
    if outlined:
        places: set[tuple[int, int]] = set()
        for mask in masks.values():
            place = (mask.box_id, mask.frame)
            if mask.box_id in outlined and place in places:
                raise Conflict(f"there is another {_called(mask)}", current=mask)
            places.add(place)


def _expect_name(change: NameChange, name: str) -> None:
    if name != change.before:
        raise Conflict(f"the session was renamed to {name!r} meanwhile", current=name)


def _called(thing: Thing) -> str:
    if isinstance(thing, Mask):
        return f"mask of object {thing.box_id} in frame {thing.frame}"
    return f"{'box' if isinstance(thing, VirtualBox) else 'class'} {thing.name!r}"


def _moved_on(change: BoxChange | ClassChange | MaskChange, found: Thing | None) -> str:
    if isinstance(change, MaskChange):
        known = found or change.before or change.after
        what = f"mask {change.mask_id}" + (f" ({_called(known)})" if known else "")
    else:
        kind, id_ = ("box", change.box_id) if isinstance(change, BoxChange) else ("class", change.class_id)
        known = found or change.before or change.after
        what = f"{kind} {id_} ({known.name!r})" if known and not isinstance(known, Mask) else f"{kind} {id_}"
    if found is None:
        return f"{what} was deleted meanwhile"
    return f"{what} was changed meanwhile, in revision {found.revision}"
