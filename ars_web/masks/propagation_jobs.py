"""Outlining the rest of an object while a page watches: worked out by a thread, stored in one edit or not at all.

Jobs are in memory alone: a server that is killed loses them, and nothing of them is in the session.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import UInt8

from ars_web.errors import ArsError, BadInput, Conflict, NotFound
from ars_web.geometry.box import Box
from ars_web.masks.photographs import photograph
from ars_web.masks.propagation import FRAMES_MOST, Dropped, Propagation, propagate
from ars_web.masks.views import object_of, photographs, views_of
from ars_web.sessions.drafting import refuse_locked
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.hull_mesh import HullMesh
from ars_web.sessions.jobs import Job, Jobs, fresh_job_id
from ars_web.sessions.model import HullOptions, Mask, SessionState, VirtualBox
from ars_web.sessions.object_drafting import MaskDraft
from ars_web.sessions.store import SessionStore

AT_ONCE = 1
"""Objects that are worked on side by side; a second one would only slow the first."""

MOST_FRAMES = 50
"""Outlines that one job adds at most."""


@dataclass(frozen=True, kw_only=True)
class OutlineJob(Job):
    """An object's further outlines that were asked for; its steps are of about the same length.

    Attributes:
        seconds_left: of a running job, by how long it took so far; None until that is known.
        accepted: frames whose new outlines count, of a done job.
        doubtful: frames whose new outlines wait for a yes or a no.
        doubts: why they do.
        dropped: frames that were looked at and have no new outline, and why not.
    """

    session_id: str
    box_id: int
    seconds_left: float | None = None
    accepted: tuple[int, ...] = ()
    doubtful: tuple[int, ...] = ()
    doubts: tuple[Dropped, ...] = ()
    dropped: tuple[Dropped, ...] = ()


@dataclass(frozen=True)
class _Order:
    """What is to be done: what a repeat with the same key must ask for again."""

    sid: str
    box_id: int
    frames_most: int
    author: str


@dataclass(frozen=True, eq=False)
class _Beginning:
    """The object as a job found it; what it makes is stored only where that still is so.

    Attributes:
        box: None where there is none yet.
        masks: all that it has.
    """

    box: VirtualBox | None
    masks: tuple[Mask, ...]

    @property
    def accepted(self) -> tuple[Mask, ...]:
        """Those that count."""
        return tuple(mask for mask in self.masks if mask.accepted)

    @property
    def follows(self) -> bool:
        """Whether its box is made of its masks, or is to be; one that was placed by hand stays where it is."""
        return self.box is None or self.box.hull_options is not None

    @property
    def options(self) -> HullOptions:
        """How its hull is made."""
        return (None if self.box is None else self.box.hull_options) or HullOptions()


class OutlineJobs:
    """All such jobs of one server."""

    def __init__(self, store: SessionStore, editor: SessionEditor) -> None:
        self._store = store
        self._editor = editor
        self._jobs = Jobs[OutlineJob](what="outlining", at_once=AT_ONCE, ended={"seconds_left": None})

    def start(
        self, sid: str, box_id: int, *, frames_most: int = FRAMES_MOST, author: str, key: str | None = None
    ) -> OutlineJob:
        """Ask for an object's outlines in up to `frames_most` further frames. While one is at work on the object, that
        one is answered, and so is the first with the same `key`.

        Raises:
            NotFound: the session has neither such a box nor masks kept for it.
            BadInput: the object has fewer than two masks that count, a number that cannot be, or `key` was used for
                something else.
            Locked: the box is locked.
        """
        order = _Order(sid, box_id, frames_most, author)
        if not 1 <= frames_most <= MOST_FRAMES:
            raise BadInput(f"1 to {MOST_FRAMES} frames can be outlined at a time, not {frames_most}")
        answered = self._jobs.answered(order, key)
        if answered is not None:
            return answered
        beginning(self._store.state(sid), sid, box_id)
        return self._jobs.start(
            OutlineJob(id=fresh_job_id("o"), session_id=sid, box_id=box_id),
            order,
            lambda id_: self._make(id_, order),
            key=key,
            words=_words,
            instead=lambda job: (job.session_id, job.box_id) == (sid, box_id),
        )

    def get(self, sid: str, job_id: str) -> OutlineJob:
        """The job as it is now.

        Raises:
            NotFound: the session has none; the server's end forgets all.
        """
        job = self._jobs.get(job_id)
        if job is None or job.session_id != sid:
            raise NotFound(
                f"session {sid} has no outlining {job_id[:40]!r} any more: the server was started again since; the"
                " object's masks show whether it was done, else ask again"
            )
        return job

    def cancel(self, sid: str, job_id: str) -> OutlineJob:
        """Stop a job: cancelled at once, its work ends soon after and leaves nothing. One that has ended, or whose
        outlines are about to be stored, stays as it is.

        Raises:
            NotFound: there is none.
        """
        return self._jobs.cancel(self.get(sid, job_id).id)

    def wait(self, job_id: str, *, timeout: float | None = None) -> OutlineJob:
        """The job once its work has ended, or TimeoutError."""
        return self._jobs.wait(job_id, timeout=timeout)

    def close(self) -> None:
        """Stop all jobs, and wait until they have ended."""
        self._jobs.close()

    def _make(self, job_id: str, order: _Order) -> None:
        taken = photographs(self._store, order.sid)
        state = self._store.state(order.sid)
        begun = beginning(state, order.sid, order.box_id)
        started = time.monotonic()

        def read(frame: int) -> UInt8[np.ndarray, "h w 3"]:
            return photograph(taken, frame)

        def advance(done: int, total: int) -> None:
            left = None if done == 0 else (time.monotonic() - started) / done * (total - done)
            self._jobs.change(job_id, done=done, total=total, seconds_left=left)

        found = propagate(
            views_of(taken, [(mask.frame, mask.polygons) for mask in begun.accepted]),
            taken,
            read=read,
            frames_most=order.frames_most,
            widen=begun.options.widen,
            ground=begun.options.ground,
            progress=advance,
        )
        self._jobs.change(job_id, settled=True, seconds_left=0.0)
        if found.accepted or found.doubtful:
            self._store_found(order, begun, found)
        self._jobs.finish(
            job_id,
            seconds_left=None,
            accepted=tuple(view.frame for view in found.accepted),
            doubtful=tuple(view.frame for view in found.doubtful),
            doubts=found.doubts,
            dropped=found.dropped,
        )

    def _store_found(self, order: _Order, begun: _Beginning, found: Propagation) -> None:
        """Masks, hull and box in one edit. A box that was placed by hand keeps its place."""
        new = [
            *(MaskDraft(view.frame, view.polygons, "proposed", True) for view in found.accepted),
            *(MaskDraft(view.frame, view.polygons, "proposed", False) for view in found.doubtful),
        ]
        frames = {draft.frame for draft in new}
        placed, hull = self._object(order, begun, [draft for draft in new if draft.accepted])
        count = f"{len(new)} further {'frame' if len(new) == 1 else 'frames'}"
        self._editor.put_object(
            order.sid,
            box_id=order.box_id,
            class_id=begun.masks[0].class_id,
            box=placed,
            hull=hull,
            hull_options=begun.options if begun.follows else None,
            masks=new,
            # Earlier doubts that this look at the photographs does not share.
            drop_masks=[mask.id for mask in begun.masks if not mask.accepted and mask.frame not in frames],
            expected_revision=None if begun.box is None else begun.box.revision,
            expected_masks={mask.id: mask.revision for mask in begun.masks},
            summary=f"Outline {'a new object' if begun.box is None else begun.box.name} in {count}",
            author=order.author,
        )

    def _object(self, order: _Order, begun: _Beginning, accepted: Sequence[MaskDraft]) -> tuple[Box, HullMesh | None]:
        """The box and hull of the masks as the session will keep them."""
        if begun.box is not None and not begun.follows:
            stored = begun.box.hull
            return begun.box.box, None if stored is None else self._store.hull(order.sid, stored)
        outlines = {mask.frame: mask.polygons for mask in (*begun.accepted, *accepted)}
        views = views_of(photographs(self._store, order.sid), sorted(outlines.items()))
        return object_of(views, begun.options, before=None if begun.box is None else begun.box.box)


def _words(error: ArsError) -> str:
    if isinstance(error, Conflict):
        return "the object's box or masks were changed meanwhile, and nothing was stored; outline the rest again"
    return str(error)


def beginning(state: SessionState, sid: str, box_id: int) -> _Beginning:
    """The object that is to be outlined further.

    Raises:
        NotFound: there is neither such a box nor masks kept for it.
        BadInput: fewer than two of its masks count.
        Locked: its box is locked.
    """
    box, masks = state.boxes.get(box_id), state.masks_of(box_id)
    if box is None and not masks:
        raise NotFound(f"session {sid} has no object {box_id}: no box, and no masks to make one of")
    if box is not None:
        refuse_locked(box, "masks")
    begun = _Beginning(box, masks)
    if len(begun.accepted) < 2:
        raise BadInput(
            f"object {box_id} has {len(begun.accepted) or 'no'} outline that counts, and two are needed to begin from:"
            " outline it by hand in two frames that see it from different sides"
        )
    return begun
