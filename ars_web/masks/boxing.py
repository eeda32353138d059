"""Boxes of outlines: an object's masks give its visual hull, and the hull gives its box.

The hull follows the masks: whoever changes one of an object whose box was made of them changes mask, hull and box in
one edit, or nothing where the outlines no longer fit one object.
"""

from collections.abc import Callable, Sequence
from typing import TypeVar

from ars_web.errors import BadInput, Conflict, NotFound
from ars_web.geometry.polygon import Polygon
from ars_web.masks.views import Outlines, object_of, photographs, views_of
from ars_web.sessions.drafting import box_at, existing_class, refuse_locked
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.edits import MaskChange
from ars_web.sessions.hull_json import options_json
from ars_web.sessions.model import HullOptions, Mask, Origin, SessionState, VirtualBox
from ars_web.sessions.object_drafting import MaskDraft, mask_at
from ars_web.sessions.outlines import polygons_json
from ars_web.sessions.store import SessionStore

TRIES = 10
"""How often a change is made anew because somebody changed another mask of the same object meanwhile."""

T = TypeVar("T")


class ObjectBoxes:
    """Makes boxes of masks, and lets them follow when those change; for any number of threads.

    Methods raise what those of `SessionEditor` do, and ViewsDisagree where outlines are of no one object. Then nothing
    is stored.
    """

    def __init__(self, store: SessionStore, editor: SessionEditor) -> None:
        self._store = store
        self._editor = editor

    def from_masks(
        self,
        sid: str,
        outlines: Outlines,
        *,
        class_id: int,
        options: HullOptions,
        name: str | None = None,
        box_id: int | None = None,
        author: str,
        key: str | None = None,
    ) -> VirtualBox:
        """A new box of an object's outlines, which are kept with it as drawn.

        With `box_id` it is the box of an object that has masks and no box yet, and the outlines take the place of
        those. A repeat with the same idempotency `key` returns what the first returned, and adds nothing.
        """
        views = views_of(photographs(self._store, sid), outlines)
        asked = [[view.frame, polygons_json(view.polygons)] for view in views]
        request = ["from masks", asked, class_id, options_json(options), name, box_id]
        if key is not None:
            answered = self._editor.object_made(sid, request=request, author=author, key=key)
            if answered is not None:
                return answered
        state = self._store.state(sid)
        existing_class(state, class_id)
        box, hull = object_of(views, options)
        drawn = () if box_id is None else state.masks_of(box_id)
        frames = {view.frame for view in views}
        return self._editor.put_object(
            sid,
            box_id=box_id,
            class_id=class_id,
            name=name,
            box=box,
            hull=hull,
            hull_options=options,
            masks=[MaskDraft(view.frame, view.polygons) for view in views],
            drop_masks=[mask.id for mask in drawn if mask.frame not in frames],
            expected_masks={mask.id: mask.revision for mask in drawn},
            author=author,
            key=key,
            request=request,
        )

    def remake(
        self,
        sid: str,
        box_id: int,
        *,
        options: HullOptions,
        class_id: int | None = None,
        name: str | None = None,
        expected_revision: int | None = None,
        author: str,
    ) -> VirtualBox:
        """Make an object's box of its accepted masks, or make it again: by other options, or after it was moved.

        Args:
            class_id, name: None: as they are; of a new box the masks' class, and a name after it.
            expected_revision: the box's; None where there is none yet.

        Raises:
            NotFound: the object has neither a box nor masks.
        """

        def make(state: SessionState) -> VirtualBox:
            before = state.boxes.get(box_id)
            if expected_revision is not None:
                before = box_at(state, box_id, expected_revision)
            elif before is None and not state.masks_of(box_id):
                raise NotFound(f"there is no object {box_id} in this session: no box, and no masks to make one of")
            return self._made(
                sid,
                state,
                box_id,
                options=options,
                class_id=class_id,
                name=name,
                summary=None if before is None else f"Make {before.name} from its masks again",
                author=author,
            )

        return self._in_time(sid, make, still=lambda state: _revision(state.boxes.get(box_id)) == expected_revision)

    def add_mask(
        self,
        sid: str,
        *,
        box_id: int | None,
        frame: int,
        class_id: int | None,
        polygons: Sequence[Polygon],
        origin: Origin = "drawn",
        accepted: bool = True,
        author: str,
        key: str | None = None,
    ) -> Mask:
        """A mask of an object that has none in that frame; of a new object where `box_id` is None.

        `class_id` None: the object's own. A repeat with the same idempotency `key` returns what the first returned,
        and adds nothing.
        """
        draft = MaskDraft(frame, tuple(polygons), origin, accepted)
        asked = [frame, polygons_json(draft.polygons), origin, accepted]
        request = ["add mask", asked, class_id, box_id]

        def put(state: SessionState) -> Mask:
            box = None if box_id is None else state.boxes.get(box_id)
            if box is None or not (accepted and _follows(box)):
                return self._editor.put_mask(
                    sid,
                    box_id=box_id,
                    frame=frame,
                    class_id=class_id,
                    polygons=polygons,
                    origin=origin,
                    accepted=accepted,
                    expected_revision=None,
                    unmade=accepted,
                    author=author,
                    key=key,
                )
            if key is not None:
                answered = self._editor.object_made(sid, request=request, author=author, key=key)
                if answered is not None:
                    return self._mask_put(sid, answered, frame)
            there = _mask_in(state, box.id, frame)
            if there is not None:
                raise Conflict(f"box {box.id} ({box.name!r}) has a mask in frame {frame} already", current=there)
            if class_id not in (None, box.class_id):
                raise BadInput(
                    f"box {box.id} ({box.name!r}) is of class {box.class_id}, not {class_id}, and so are its masks"
                )
            made = self._made(
                sid,
                state,
                box.id,
                draft=draft,
                summary=f"Outline {box.name} in frame {frame}",
                author=author,
                key=key,
                request=request,
            )
            return self._mask_put(sid, made, frame)

        def still(state: SessionState) -> bool:
            return box_id is not None and _mask_in(state, box_id, frame) is None

        return self._in_time(sid, put, still=still)

    def change_mask(
        self,
        sid: str,
        mask_id: int,
        *,
        polygons: Sequence[Polygon] | None = None,
        origin: Origin | None = None,
        accepted: bool | None = None,
        expected_revision: int,
        author: str,
    ) -> Mask:
        """Change what is given of a mask and leave the rest."""

        def put(state: SessionState) -> Mask:
            before = mask_at(state, mask_id, expected_revision)
            draft = MaskDraft(
                before.frame,
                before.polygons if polygons is None else tuple(polygons),
                before.origin if origin is None else origin,
                before.accepted if accepted is None else accepted,
            )
            box = state.boxes.get(before.box_id)
            counts = before.accepted or draft.accepted
            if box is None or not (counts and _follows(box)):
                return self._editor.put_mask(
                    sid,
                    box_id=before.box_id,
                    frame=before.frame,
                    polygons=draft.polygons,
                    origin=draft.origin,
                    accepted=draft.accepted,
                    expected_revision=before.revision,
                    unmade=counts,
                    author=author,
                )
            deed = "Change" if before.accepted == draft.accepted else "Accept" if draft.accepted else "Set aside"
            summary = f"{deed} outline of {box.name} in frame {before.frame}"
            made = self._made(sid, state, box.id, draft=draft, summary=summary, author=author)
            return self._mask_put(sid, made, before.frame)

        return self._in_time(sid, put, still=lambda state: _revision(state.masks.get(mask_id)) == expected_revision)

    def delete_mask(self, sid: str, mask_id: int, *, expected_revision: int, author: str) -> None:
        """Take a mask away."""

        def delete(state: SessionState) -> None:
            mask = mask_at(state, mask_id, expected_revision)
            box = state.boxes.get(mask.box_id)
            if box is None or not (mask.accepted and _follows(box)):
                self._editor.delete_mask(
                    sid, mask_id, expected_revision=expected_revision, unmade=mask.accepted, author=author
                )
                return
            summary = f"Delete outline of {box.name} in frame {mask.frame}"
            self._made(sid, state, box.id, drop=mask, summary=summary, author=author)

        self._in_time(sid, delete, still=lambda state: _revision(state.masks.get(mask_id)) == expected_revision)

    def _made(
        self,
        sid: str,
        state: SessionState,
        box_id: int,
        *,
        draft: MaskDraft | None = None,
        drop: Mask | None = None,
        options: HullOptions | None = None,
        class_id: int | None = None,
        name: str | None = None,
        summary: str | None,
        author: str,
        key: str | None = None,
        request: object = None,
    ) -> VirtualBox:
        """The object's box, made of its masks in `state` with one in place, or one gone, and stored with that."""
        before, masks = state.boxes.get(box_id), state.masks_of(box_id)
        if before is not None:
            refuse_locked(before, "masks")
        outlines = {mask.frame: mask.polygons for mask in masks if mask.accepted and mask is not drop}
        if draft is not None:
            outlines.pop(draft.frame, None)
            if draft.accepted:
                outlines[draft.frame] = draft.polygons
        if before is not None and len(outlines) < 2:
            raise BadInput(
                f"box {before.id} ({before.name!r}) is made from its masks and needs two that count; outline the object"
                " in another frame first, or delete the box"
            )
        options = options or (None if before is None else before.hull_options) or HullOptions()
        views = views_of(photographs(self._store, sid), sorted(outlines.items()))
        box, hull = object_of(views, options, before=None if before is None else before.box)
        return self._editor.put_object(
            sid,
            box_id=box_id,
            class_id=next(id_ for id_ in (class_id, before and before.class_id, masks[0].class_id) if id_ is not None),
            name=name,
            box=box,
            hull=hull,
            hull_options=options,
            masks=() if draft is None else (draft,),
            drop_masks=() if drop is None else (drop.id,),
            expected_revision=_revision(before),
            expected_masks={mask.id: mask.revision for mask in masks},
            summary=summary,
            author=author,
            key=key,
            request=request,
        )

    def _mask_put(self, sid: str, box: VirtualBox, frame: int) -> Mask:
        """The mask in a frame that the edit left which made `box` what it is; as it is now where that changed none."""
        (edit,) = self._store.edits(sid, after=box.revision - 1, limit=1)
        for change in edit.changes:
            if isinstance(change, MaskChange) and change.after is not None and change.after.frame == frame:
                return change.after
        mask = _mask_in(self._store.state(sid), box.id, frame)
        if mask is None:
            raise Conflict(f"the mask of box {box.id} in frame {frame} was deleted meanwhile")
        return mask

    def _in_time(self, sid: str, make: Callable[[SessionState], T], *, still: Callable[[SessionState], bool]) -> T:
        """What `make` does with the newest state; again, where the object moved on meanwhile in what the caller did
        not say to expect, and what it did still is so."""
        for _ in range(TRIES - 1):
            try:
                return make(self._store.state(sid))
            except Conflict:
                if not still(self._store.state(sid)):
                    break  # once more all the same: it then says what of the caller's own moved on
        return make(self._store.state(sid))


def _follows(box: VirtualBox) -> bool:
    return box.hull_options is not None


def _revision(thing: VirtualBox | Mask | None) -> int | None:
    return None if thing is None else thing.revision


def _mask_in(state: SessionState, box_id: int, frame: int) -> Mask | None:
    return next((mask for mask in state.masks_of(box_id) if mask.frame == frame), None)
