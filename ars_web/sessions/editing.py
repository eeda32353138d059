"""All edits of a session; `edit_door.py` says how each is made.

A change that would leave everything as it is makes no edit and no revision.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import Literal

import numpy as np

from ars_web.errors import BadInput, Conflict
from ars_web.geometry.box import Box, beside, resting_on_ground
from ars_web.geometry.keypoints import Keypoint
from ars_web.geometry.rigid_transform import Transform
from ars_web.geometry.symmetry import Symmetry
from ars_web.sessions.drafting import (
    UNSET,
    BoxDraft,
    ClassSize,
    Unset,
    box_at,
    change_summary,
    changed_box,
    changed_class,
    class_at,
    class_change_summary,
    class_size,
    drafted_box,
    drafted_boxes,
    existing_box,
    free_class_name,
    refuse_locked,
)
from ars_web.sessions.edit_json import request_digest
from ars_web.sessions.edits import BoxChange, Change, ClassChange, Edit, MaskChange, NameChange, inverse, restated
from ars_web.sessions.history import LogEntry, to_redo, to_undo
from ars_web.sessions.label_editing import LabelEditing
from ars_web.sessions.model import ObjectClass, SessionState, SessionSummary, VirtualBox
from ars_web.sessions.names import FreshNames, checked_name
from ars_web.sessions.object_drafting import MaskDraft, reclassed
from ars_web.sessions.object_editing import first_box
from ars_web.sessions.object_mesh import SourcedMesh
from ars_web.sessions.palette import checked_color, next_color
from ars_web.sessions.sizes import checked_class_size
from ars_web.sessions.transaction import SessionTransaction

__all__ = ["UNSET", "BoxDraft", "MaskDraft", "NothingToUndo", "SessionEditor"]


class NothingToUndo(BadInput):
    """The author has no edit to take back, or none to make again."""


class SessionEditor(LabelEditing):
    """Changes sessions, for any number of threads; other processes may change the same sessions meanwhile.

    Every method raises NotFound for an unknown session and StoreError where the edit cannot be kept. Methods with
    `expected_revision` raise Conflict where the thing is no longer at that revision; `current` is what it is now.

    A locked box keeps its class, place, size, hull, mesh and masks, and is not deleted: Locked says so. It may be
    renamed and unlocked, also together with other changes, which then count. Undo and redo bring back what was,
    locks included; a box that someone else locked since is a Conflict for them, as after any other change.
    """

    def add_box(
        self,
        sid: str,
        *,
        class_id: int,
        box: Box,
        name: str | None = None,
        locked: bool = False,
        author: str,
        key: str | None = None,
    ) -> VirtualBox:
        """A new box, called after its class unless `name` says otherwise.

        A repeat with the same idempotency `key` returns what the first returned, and adds nothing.
        """
        with self._editing(sid) as session:
            # Nothing more where it is not locked: keys from before there were locks stay good.
            more = ("locked",) if locked else ()
            digest = request_digest("add box", author, class_id, box.T_world_box, box.size, name, *more)
            before = self._answered(session, key, digest=digest)
            if before is not None:
                return first_box(before)
            added = drafted_box(session.state, BoxDraft(class_id, box, name, locked))
            summary = f"Add {added.name}"
            edit = self._append(session, _additions([added]), author=author, summary=summary, key=key, digest=digest)
        return first_box(edit)

    def duplicate_box(self, sid: str, box_id: int, *, author: str, key: str | None = None) -> VirtualBox:
        """A new box like another, beside it along its own x (see `geometry.box.beside`), called `cube 2` after `cube`.

        It has the other one's hull and mesh, no masks, and is not locked, also where the other one is. A repeat with
        the same idempotency `key` returns what the first returned, and adds nothing.
        """
        with self._editing(sid) as session:
            digest = request_digest("duplicate box", author, box_id)
            before = self._answered(session, key, digest=digest)
            if before is not None:
                return first_box(before)
            original = existing_box(session.state, box_id)
            name = FreshNames(box.name for box in session.state.boxes.values()).give_copy(original.name)
            draft = BoxDraft(original.class_id, beside(original.box), name, hull=original.hull, mesh=original.mesh)
            changes, summary = _additions([drafted_box(session.state, draft)]), f"Duplicate {original.name}"
            edit = self._append(session, changes, author=author, summary=summary, key=key, digest=digest)
        return first_box(edit)

    def add_boxes(
        self, sid: str, drafts: Sequence[BoxDraft], *, author: str, summary: str = "Import boxes"
    ) -> list[VirtualBox]:
        """Several boxes in one edit, which one undo takes back; none at all if one of them cannot be added.

        Raises:
            BadInput: it begins with the number of the box, from 0.
        """
        with self._editing(sid) as session:
            boxes = drafted_boxes(session.state, drafts)
            if boxes:
                self._append(session, _additions(boxes), author=author, summary=summary)
        return boxes

    def change_box(
        self,
        sid: str,
        box_id: int,
        *,
        expected_revision: int,
        class_id: int | None = None,
        T_world_box: Transform | None = None,
        size: np.ndarray | None = None,
        name: str | None = None,
        locked: bool | None = None,
        mesh: SourcedMesh | Literal[Unset.UNSET] | None = UNSET,
        author: str,
    ) -> VirtualBox:
        """Change what is given of a box and leave the rest; `mesh` None: it has none of its own any more. Nothing new
        given: the box as it is.

        Its hull moves, turns and scales with it, its mesh moves and turns; its masks are of its class.
        """
        with self._editing(sid) as session:
            before = box_at(session.state, box_id, expected_revision)
            after = changed_box(
                session.state,
                before,
                class_id=class_id,
                T_world_box=T_world_box,
                size=size,
                name=name,
                locked=locked,
                mesh=_kept(session, mesh),
            )
            if after is before:
                return before
            masks = reclassed(session.state, session.state.masks_of(box_id), after.class_id)
            changes = (BoxChange(box_id, before, after), *masks)
            self._append(session, changes, author=author, summary=change_summary(before, after))
        return after

    def rest_on_ground(
        self, sid: str, box_id: int, *, expected_revision: int, author: str, key: str | None = None
    ) -> VirtualBox:
        """Move a box up or down until its lowest corner is at z = 0. It rests there already: the box as it is.

        A repeat with the same idempotency `key` returns what the first returned, and moves nothing.
        """
        with self._editing(sid) as session:
            digest = request_digest("rest on ground", author, box_id, expected_revision)
            answered = self._answered(session, key, digest=digest)
            if answered is not None:
                return first_box(answered)
            before = box_at(session.state, box_id, expected_revision)
            T = resting_on_ground(before.box).T_world_box
            after = changed_box(session.state, before, class_id=None, T_world_box=T, size=None, name=None, locked=None)
            if after is before:
                return before
            summary = f"Put {before.name} on the ground"
            change = BoxChange(box_id, before, after)
            self._append(session, (change,), author=author, summary=summary, key=key, digest=digest)
        return after

    def delete_box(self, sid: str, box_id: int, *, expected_revision: int, author: str) -> None:
        """Take a box and its masks away; undo brings them back with the same ids."""
        with self._editing(sid) as session:
            before = box_at(session.state, box_id, expected_revision)
            refuse_locked(before, "existence")
            masks = (MaskChange(mask.id, mask, None) for mask in session.state.masks_of(box_id))
            changes = (BoxChange(box_id, before, None), *masks)
            self._append(session, changes, author=author, summary=f"Delete {before.name}")

    def add_class(
        self,
        sid: str,
        *,
        name: str,
        color: str | None = None,
        default_size: ClassSize | None = None,
        author: str,
        key: str | None = None,
    ) -> ObjectClass:
        """A new class, in the next colour of the palette unless `color` says otherwise.

        A repeat with the same idempotency `key` returns what the first returned, and adds nothing.
        """
        with self._editing(sid) as session:
            # Nothing more where there is no size: keys from before there were sizes stay good.
            more = () if default_size is None else (default_size,)
            digest = request_digest("add class", author, name, color, *more)
            before = self._answered(session, key, digest=digest)
            if before is not None:
                return _first_class(before)
            state = session.state
            added = ObjectClass(
                id=state.next_class_id,
                name=free_class_name(state, name),
                color=next_color(c.color for c in state.classes.values()) if color is None else checked_color(color),
                revision=state.revision + 1,
                default_size=class_size(default_size),
            )
            change, summary = ClassChange(added.id, None, added), f"Add class {added.name}"
            self._append(session, (change,), author=author, summary=summary, key=key, digest=digest)
        return added

    def change_class(
        self,
        sid: str,
        class_id: int,
        *,
        expected_revision: int,
        name: str | None = None,
        color: str | None = None,
        default_size: ClassSize | Literal[Unset.UNSET] | None = UNSET,
        symmetry: Symmetry | Literal[Unset.UNSET] = UNSET,
        keypoints: Sequence[Keypoint] | Literal[Unset.UNSET] = UNSET,
        mesh: SourcedMesh | Literal[Unset.UNSET] | None = UNSET,
        fit_size: bool | None = False,
        author: str,
    ) -> ObjectClass:
        """Change what is given of a class and leave the rest; `default_size` and `mesh` None: it has none any more,
        `keypoints` empty: the box's centre and corners.

        `fit_size`: the usual size becomes the extent of the mesh that is given; None: where there is no usual size,
        and the mesh is not flat. Nothing new given: the class as it is.

        Raises:
            BadInput: a value cannot be a class's; `fit_size` without a mesh, or with a flat one, which fits no box.
        """
        with self._editing(sid) as session:
            before = class_at(session.state, class_id, expected_revision)
            if fit_size or (fit_size is None and before.default_size is None and default_size is UNSET):
                default_size = _fitting(mesh, default_size, needed=bool(fit_size))
            after = changed_class(
                session.state,
                before,
                name=name,
                color=color,
                default_size=default_size,
                symmetry=symmetry,
                keypoints=keypoints,
                mesh=_kept(session, mesh),
            )
            if after is before:
                return before
            change = ClassChange(class_id, before, after)
            self._append(session, (change,), author=author, summary=class_change_summary(before, after))
        return after

    def delete_class(self, sid: str, class_id: int, *, expected_revision: int, author: str) -> None:
        """Take a class away.

        Raises:
            BadInput: boxes or masks use it.
        """
        with self._editing(sid) as session:
            before = class_at(session.state, class_id, expected_revision)
            users = [box.name for box in session.state.boxes.values() if box.class_id == class_id]
            if users:
                raise BadInput(
                    f"class {before.name!r} is used by {len(users)} box(es), such as {users[0]!r};"
                    " delete them or give them another class first"
                )
            masks = [mask for mask in session.state.masks.values() if mask.class_id == class_id]
            if masks:
                raise BadInput(
                    f"class {before.name!r} is used by {len(masks)} outline(s), such as that of object"
                    f" {masks[0].box_id} in frame {masks[0].frame}; delete them first"
                )
            change = ClassChange(class_id, before, None)
            self._append(session, (change,), author=author, summary=f"Delete class {before.name}")

    def rename(self, sid: str, *, name: str, expected_revision: int, author: str) -> SessionSummary:
        """Rename the session, which must be at `expected_revision`."""
        with self._editing(sid) as session:
            state, name = session.state, checked_name(name, what="a session")
            if state.revision != expected_revision:
                raise Conflict(
                    f"the session is at revision {state.revision}, not {expected_revision}",
                    current=session.summary(sid),
                )
            if name != state.name:
                change = NameChange(state.name, name)
                self._append(session, (change,), author=author, summary=f"Rename the session to {name}")
            summary = session.summary(sid)
        return summary

    def undo(self, sid: str, *, author: str, key: str | None = None) -> Edit:
        """Take back the author's newest edit that stands, by an edit that inverts it.

        A repeat with the same idempotency `key` returns what the first returned, and takes nothing back.

        Raises:
            NothingToUndo: there is none.
            Conflict: someone else changed the same thing since; nothing is changed.
        """
        return self._take_turn(sid, "Undo", to_undo, author=author, key=key)

    def redo(self, sid: str, *, author: str, key: str | None = None) -> Edit:
        """Make again what the author's newest undo took back, unless something new was done since.

        A repeat with the same idempotency `key` returns what the first returned, and makes nothing again.

        Raises:
            NothingToUndo: there is no such undo.
            Conflict: someone else changed the same thing since; nothing is changed.
        """
        return self._take_turn(sid, "Redo", to_redo, author=author, key=key)

    def _take_turn(
        self,
        sid: str,
        verb: str,
        choose: Callable[[Iterable[LogEntry]], int | None],
        *,
        author: str,
        key: str | None,
    ) -> Edit:
        """Invert the edit whose revision `choose` picks from the author's own, once a key."""
        with self._editing(sid) as session:
            digest = request_digest(verb.lower(), author)
            before = self._answered(session, key, digest=digest)
            if before is not None:
                return before
            revision = choose(session.newest_entries(author=author))
            if revision is None:
                raise NothingToUndo(f"{author!r} has nothing to {verb.lower()} in this session")
            edit = self._invert(sid, session, session.edit(revision), author=author, verb=verb)
            if key is not None:
                session.remember(key, digest=digest)
        return edit

    def _invert(self, sid: str, session: SessionTransaction, edit: Edit, *, author: str, verb: str) -> Edit:
        try:
            changes = restated(inverse(edit.changes), session.state, revision=session.state.revision + 1)
        except Conflict as error:
            if isinstance(error.current, str):  # the session's name; callers get the whole summary
                raise Conflict(str(error), current=session.summary(sid)) from error
            raise
        _refuse_locked_since(changes, session.state)
        return self._append(
            session,
            changes,
            author=author,
            summary=f"{verb}: {edit.deed}",
            undoes=edit.revision if verb == "Undo" else None,
            redoes=edit.revision if verb == "Redo" else None,
        )


def _kept(
    session: SessionTransaction, mesh: SourcedMesh | Literal[Unset.UNSET] | None
) -> str | Literal[Unset.UNSET] | None:
    """The digest of `mesh`, which is stored; it is taken back with the edit where that fails."""
    return session.keep_mesh(mesh) if isinstance(mesh, SourcedMesh) else mesh


def _fitting(
    mesh: SourcedMesh | Literal[Unset.UNSET] | None,
    size: ClassSize | Literal[Unset.UNSET] | None,
    *,
    needed: bool,
) -> ClassSize | Literal[Unset.UNSET] | None:
    """The size of a box that fits `mesh`; where there is none, and it is not `needed`, `size`."""
    if not isinstance(mesh, SourcedMesh):
        if needed:
            raise BadInput("there is no mesh that the class's usual size could be fitted to; give one with it")
        return size
    extent = mesh.mesh.extent
    if extent.min() > 0.0:
        return checked_class_size(extent.tolist())
    if needed:
        raise BadInput(f"the mesh is flat ({extent.tolist()} m): no box fits it; give the class a size yourself")
    return size


def _additions(boxes: Sequence[VirtualBox]) -> tuple[BoxChange, ...]:
    return tuple(BoxChange(box.id, None, box) for box in boxes)


def _refuse_locked_since(changes: Sequence[Change], state: SessionState) -> None:
    """A box that someone locked since keeps its masks, also where the edit did not change the box itself."""
    own = {change.box_id for change in changes if isinstance(change, BoxChange)}
    for change in changes:
        if isinstance(change, MaskChange) and change.box_id not in own:
            box = state.boxes.get(change.box_id)
            if box is not None and box.locked:
                raise Conflict(f"box {box.id} ({box.name!r}) was locked meanwhile, and its masks with it", current=box)


def _first_class(edit: Edit) -> ObjectClass:
    change = edit.changes[0]
    assert isinstance(change, ClassChange)
    assert change.after is not None
    return change.after
