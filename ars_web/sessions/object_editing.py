"""Outlines of objects, and boxes that are made with them: their part of `SessionEditor`."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

from ars_web.errors import BadInput
from ars_web.geometry.box import Box
from ars_web.geometry.polygon import Polygon
from ars_web.sessions.drafting import refuse_locked
from ars_web.sessions.edit_door import EditDoor
from ars_web.sessions.edit_json import request_digest
from ars_web.sessions.edits import BoxChange, Edit, MaskChange
from ars_web.sessions.hull_json import options_json
from ars_web.sessions.hull_mesh import HullMesh
from ars_web.sessions.model import HullOptions, Mask, Origin, VirtualBox, checked_origin
from ars_web.sessions.object_drafting import (
    MaskDraft,
    ObjectDraft,
    mask_at,
    mask_changes,
    no_change,
    object_changes,
    object_name,
    refuse_made,
)
from ars_web.sessions.outlines import checked_polygons, polygons_json


class ObjectEditing(EditDoor):
    """Edits of masks, and of boxes together with theirs."""

    def put_mask(
        self,
        sid: str,
        *,
        box_id: int | None,
        frame: int,
        class_id: int | None = None,
        polygons: Sequence[Polygon],
        origin: Origin = "drawn",
        accepted: bool = True,
        expected_revision: int | None,
        unmade: bool = False,
        author: str,
        key: str | None = None,
    ) -> Mask:
        """Give an object this outline in a frame; the box, if it has one, stays as it is.

        `box_id` names the box, or an object that has masks and no box yet; None: a new object, for whose box the next
        id is kept. `class_id` None: the object's own. `expected_revision` None: it has no mask there yet. `unmade`: no
        box is made from the object's masks. A repeat with the same idempotency `key` returns what the first returned,
        and changes nothing.

        Raises:
            BadInput: there is no such frame or class, the box is of another class, or the outline cannot be used (see
                `checked_polygons`).
            NotFound: the object has neither box nor masks.
            Conflict: the mask in that frame is another one; `current` is it, or None. Or there is a box that is made
                from masks, and there should be none; `current` is the box.
            Locked: the box is.
        """
        (draft,) = self._checked(sid, [MaskDraft(frame, tuple(polygons), origin, accepted)])
        digest = request_digest("put mask", author, box_id, class_id, _asked(draft), expected_revision)
        with self._editing(sid) as session:
            answered = self._answered(session, key, digest=digest)
            if answered is not None:
                return _first_mask(answered)
            state = session.state
            if unmade:
                refuse_made(state, box_id)
            changes = mask_changes(state, draft, box_id=box_id, class_id=class_id, expected_revision=expected_revision)
            before, after = changes[0].before, changes[0].after
            assert after is not None
            if before is not None and no_change(changes):
                return before
            name = object_name(state, after.box_id, after.class_id)
            summary = f"{_deed(changes[0])} {name} in frame {frame}"
            edit = self._append(session, changes, author=author, summary=summary, key=key, digest=digest)
        return _first_mask(edit)

    def delete_mask(self, sid: str, mask_id: int, *, expected_revision: int, unmade: bool = False, author: str) -> None:
        """Take a mask away; undo brings it back. The box, if there is one, stays as it is.

        Raises:
            NotFound: there never was such a mask.
            Conflict: it is not at that revision; `current` is the mask, or None. With `unmade`, there is a box that is
                made from masks; `current` is the box.
            Locked: its box is.
        """
        with self._editing(sid) as session:
            state = session.state
            mask = mask_at(state, mask_id, expected_revision)
            if unmade:
                refuse_made(state, mask.box_id)
            box = state.boxes.get(mask.box_id)
            if box is not None:
                refuse_locked(box, "masks")
            name = object_name(state, mask.box_id, mask.class_id)
            summary = f"Delete outline of {name} in frame {mask.frame}"
            self._append(session, (MaskChange(mask_id, mask, None),), author=author, summary=summary)

    def put_object(
        self,
        sid: str,
        *,
        box_id: int | None,
        class_id: int,
        name: str | None = None,
        box: Box,
        hull: HullMesh | None,
        hull_options: HullOptions | None,
        masks: Sequence[MaskDraft] = (),
        drop_masks: Collection[int] = (),
        expected_revision: int | None = None,
        expected_masks: Mapping[int, int] | None = None,
        summary: str | None = None,
        author: str,
        key: str | None = None,
        request: object = None,
    ) -> VirtualBox:
        """Make a box, or make it anew, with its hull and masks, in one edit, which one undo takes back.

        `box_id` None: a new object; else a box, whose `expected_revision` is needed, or the id that masks keep for
        theirs. `name` None: it keeps its name, or is called after its class, of which its masks are, too. `masks` are
        added, or take the place of the object's in the same frames. `expected_masks` has the revision of every mask
        of the object, as the hull was made of them; None: whatever there is, and none is changed.

        A repeat with the same idempotency `key` returns what the first returned, and changes nothing. What was asked
        for is told by `request` (strings, numbers, lists and dicts of them), or else by the other arguments, which
        may differ where they were worked out anew; `object_made` answers a repeat without that work.

        Raises:
            BadInput, NotFound, Conflict, Locked: see `object_changes`.
        """
        drafts = self._checked(sid, masks)
        asked = request
        if asked is None:
            options = None if hull_options is None else options_json(hull_options)
            expected = None if expected_masks is None else sorted(expected_masks.items())
            place = [box.T_world_box.tolist(), box.size.tolist(), None if hull is None else hull.digest, options]
            outlines = [_asked(draft) for draft in drafts]
            asked = [box_id, class_id, name, place, outlines, sorted(drop_masks), expected_revision, expected]
        digest = request_digest("put object", author, asked)
        with self._editing(sid) as session:
            answered = self._answered(session, key, digest=digest)
            if answered is not None:
                return first_box(answered)
            box_change, others = object_changes(
                session.state,
                ObjectDraft(
                    box_id=box_id,
                    class_id=class_id,
                    name=name,
                    box=box,
                    hull=None if hull is None else hull.digest,
                    hull_options=hull_options,
                    masks=drafts,
                    drop_masks=drop_masks,
                    expected_revision=expected_revision,
                    expected_masks=expected_masks,
                ),
            )
            before, after = box_change.before, box_change.after
            assert after is not None
            if before is not None and no_change((box_change, *others)):
                return before
            if hull is not None:
                session.keep_hull(hull)
            edit = self._append(
                session,
                (box_change, *others),
                author=author,
                summary=summary or f"{'Add' if before is None else 'Change'} {after.name}",
                key=key,
                digest=digest,
            )
        return first_box(edit)

    def object_made(self, sid: str, *, request: object, author: str, key: str) -> VirtualBox | None:
        """The box that `put_object` returned for this request with this idempotency key; None for a new key.

        Raises:
            BadInput: the key was used for another request.
        """
        digest = request_digest("put object", author, request)
        with self._editing(sid) as session:
            answered = self._answered(session, key, digest=digest)
        return None if answered is None else first_box(answered)

    def _checked(self, sid: str, drafts: Sequence[MaskDraft]) -> list[MaskDraft]:
        """The drafts, whose frames exist and whose outlines can be used, as they are kept."""
        frames, cameras = self._store.frames(sid), self._store.cameras(sid)
        checked: list[MaskDraft] = []
        for draft in drafts:
            if not 0 <= draft.frame < len(frames):
                raise BadInput(f"this session has no frame {draft.frame}; its frames are 0 to {len(frames) - 1}")
            camera = cameras[int(frames.camera_ids[draft.frame])]
            polygons = checked_polygons(draft.polygons, width=camera.width, height=camera.height)
            checked.append(replace(draft, polygons=polygons, origin=checked_origin(draft.origin)))
        return checked


def first_box(edit: Edit) -> VirtualBox:
    """The box that an edit left whose first change is of it."""
    change = edit.changes[0]
    assert isinstance(change, BoxChange)
    assert change.after is not None
    return change.after


def _first_mask(edit: Edit) -> Mask:
    change = edit.changes[0]
    assert isinstance(change, MaskChange)
    assert change.after is not None
    return change.after


def _asked(draft: MaskDraft) -> list[object]:
    return [draft.frame, polygons_json(draft.polygons), draft.origin, draft.accepted]


def _deed(change: MaskChange) -> str:
    """What a change does, for the history, before the object's name."""
    before, after = change.before, change.after
    if before is None or after is None:
        return "Outline"
    if before.accepted != after.accepted:
        return "Accept outline of" if after.accepted else "Set aside outline of"
    return "Change outline of"
