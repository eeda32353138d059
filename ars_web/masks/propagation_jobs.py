"""Outlining the rest of an object while a page watches: worked out by a thread, stored in one edit or not at all.

Jobs are in memory alone: a server that is killed loses them, and nothing of them is in the session.
"""

import logging
import secrets
import threading
import time
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from jaxtyping import UInt8

from ars_web.errors import ArsError, BadInput, Cancelled, Conflict, NotFound
from ars_web.geometry.box import Box
from ars_web.masks.photographs import photograph
from ars_web.masks.propagation import FRAMES_MOST, Dropped, Propagation, propagate
from ars_web.masks.views import object_of, photographs, views_of
from ars_web.sessions.drafting import refuse_locked
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.hull_mesh import HullMesh
from ars_web.sessions.model import HullOptions, Mask, SessionState, VirtualBox
from ars_web.sessions.names import checked_key
from ars_web.sessions.object_drafting import MaskDraft
from ars_web.sessions.store import SessionStore

_log = logging.getLogger(__name__)

AT_ONCE = 1
"""Objects that are worked on side by side; a second one would only slow the first."""

REMEMBERED = 200
"""Jobs that are told about after they have ended."""

MOST_FRAMES = 50
"""Outlines that one job adds at most."""

State = Literal["queued", "running", "done", "failed", "cancelled"]


@dataclass(frozen=True)
class OutlineJob:
    """An object's further outlines that were asked for.

    Attributes:
        done, total: steps of about the same length; total is 0 until that is known.
        seconds_left: of a running job, by how long it took so far; None until that is known.
        accepted: frames whose new outlines count, of a done job.
        doubtful: frames whose new outlines wait for a yes or a no.
        doubts: why they do.
        dropped: frames that were looked at and have no new outline, and why not.
        error: one clear line, of a failed job.
    """

    id: str
    session_id: str
    box_id: int
    state: State = "queued"
    done: int = 0
    total: int = 0
    seconds_left: float | None = None
    accepted: tuple[int, ...] = ()
    doubtful: tuple[int, ...] = ()
    doubts: tuple[Dropped, ...] = ()
    dropped: tuple[Dropped, ...] = ()
    error: str | None = None


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
        self._lock = threading.Lock()
        self._closing = threading.Event()
        self._runner = ThreadPoolExecutor(max_workers=AT_ONCE, thread_name_prefix="outline")
        self._jobs: dict[str, OutlineJob] = {}
        self._futures: dict[str, Future[None]] = {}
        self._keys: dict[str, tuple[_Order, str]] = {}
        # Jobs whose outlines are about to be stored: too late to cancel.
        self._settled: set[str] = set()

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
        with self._lock:
            if key is not None and checked_key(key) in self._keys:
                first, id_ = self._keys[key]
                if first != order:
                    raise BadInput(f"Idempotency-Key {key!r} was used for something else; use a new one")
                return self._jobs[id_]
        beginning(self._store.state(sid), sid, box_id)
        with self._lock:
            for job in self._jobs.values():
                if (job.session_id, job.box_id) == (sid, box_id) and job.state in ("queued", "running"):
                    if key is not None:
                        self._keys[key] = (order, job.id)
                    return job
            self._forget_oldest()
            job = OutlineJob(id=f"o{secrets.token_hex(6)}", session_id=sid, box_id=box_id)
            self._jobs[job.id] = job
            if key is not None:
                self._keys[key] = (order, job.id)
            self._futures[job.id] = self._runner.submit(self._run, job.id, order)
        return job

    def get(self, sid: str, job_id: str) -> OutlineJob:
        """The job as it is now.

        Raises:
            NotFound: the session has none; the server's end forgets all.
        """
        with self._lock:
            return self._known(sid, job_id)

    def cancel(self, sid: str, job_id: str) -> OutlineJob:
        """Stop a job: cancelled at once, its work ends soon after and leaves nothing. One that has ended, or whose
        outlines are about to be stored, stays as it is.

        Raises:
            NotFound: there is none.
        """
        with self._lock:
            job = self._known(sid, job_id)
            if job.state in ("queued", "running") and job_id not in self._settled:
                job = self._jobs[job_id] = replace(job, state="cancelled", seconds_left=None)
            return job

    def wait(self, job_id: str, *, timeout: float | None = None) -> OutlineJob:
        """The job once its work has ended, or TimeoutError."""
        self._futures[job_id].result(timeout)
        with self._lock:
            return self._jobs[job_id]

    def close(self) -> None:
        """Stop all jobs, and wait until they have ended."""
        self._closing.set()
        self._runner.shutdown(wait=True, cancel_futures=True)

    def _known(self, sid: str, job_id: str) -> OutlineJob:
        job = self._jobs.get(job_id)
        if job is None or job.session_id != sid:
            raise NotFound(
                f"session {sid} has no outlining {job_id[:40]!r} any more: the server was started again since; the"
                " object's masks show whether it was done, else ask again"
            )
        return job

    def _forget_oldest(self) -> None:
        ended = [job.id for job in self._jobs.values() if job.state not in ("queued", "running")]
        for id_ in ended[: max(0, len(self._jobs) - REMEMBERED + 1)]:
            del self._jobs[id_], self._futures[id_]
            self._settled.discard(id_)
            self._keys = {key: made for key, made in self._keys.items() if made[1] != id_}

    def _run(self, job_id: str, order: _Order) -> None:
        """The whole life of a job, in one of the runner's threads."""
        try:
            self._change(job_id, state="running")
            self._make(job_id, order)
        except Cancelled:
            self._change_unless_cancelled(job_id, state="cancelled")
        except Conflict:
            changed = "the object's box or masks were changed meanwhile, and nothing was stored; outline the rest again"
            self._change_unless_cancelled(job_id, state="failed", error=changed)
        except ArsError as error:
            self._change_unless_cancelled(job_id, state="failed", error=str(error))
        except BaseException:
            # A fault of this program: its trace goes on to whoever waits, and the job does not run for ever.
            fault = "outlining ended by a fault in the program; see its log"
            self._change_unless_cancelled(job_id, state="failed", error=fault)
            _log.exception("outlining %s", job_id)
            raise

    def _make(self, job_id: str, order: _Order) -> None:
        taken = photographs(self._store, order.sid)
        state = self._store.state(order.sid)
        begun = beginning(state, order.sid, order.box_id)
        started = time.monotonic()

        def read(frame: int) -> UInt8[np.ndarray, "h w 3"]:
            return photograph(taken, frame)

        def advance(done: int, total: int) -> None:
            left = None if done == 0 else (time.monotonic() - started) / done * (total - done)
            self._change(job_id, done=done, total=total, seconds_left=left)

        found = propagate(
            views_of(taken, [(mask.frame, mask.polygons) for mask in begun.accepted]),
            taken,
            read=read,
            frames_most=order.frames_most,
            widen=begun.options.widen,
            ground=begun.options.ground,
            progress=advance,
        )
        self._change(job_id, settled=True, seconds_left=0.0)
        if found.accepted or found.doubtful:
            self._store_found(order, begun, found)
        self._change_settled(
            job_id,
            state="done",
            done=self._jobs[job_id].total,
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

    def _change(self, job_id: str, *, settled: bool = False, **changes: Any) -> None:
        """Change a job, or raise Cancelled where it is not to go on."""
        with self._lock:
            if self._closing.is_set() or self._jobs[job_id].state == "cancelled":
                raise Cancelled("outlining was cancelled")
            self._jobs[job_id] = replace(self._jobs[job_id], **changes)
            if settled:
                self._settled.add(job_id)

    def _change_settled(self, job_id: str, **changes: Any) -> None:
        with self._lock:
            self._jobs[job_id] = replace(self._jobs[job_id], **changes)

    def _change_unless_cancelled(self, job_id: str, **changes: Any) -> None:
        with self._lock:
            if self._jobs[job_id].state != "cancelled":
                self._jobs[job_id] = replace(self._jobs[job_id], seconds_left=None, **changes)


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
