"""Editing one view's selected box by dragging: a gizmo or six handles, previewed for all, stored once on release.

    editor = BoxEditor(client, nodes, by=…, commit=…, workers=…, tell=…)           one a connected client
    editor.show(state)      what the page wants: which box, which tool, whose axes, which snaps
    editor.cancel()         a drag in progress is as if it had not been
    editor.close()          the client is gone; the same

`commit(box_id, expected_revision, T_world_box, size) -> VirtualBox` stores a drag; it may block and raise ArsError, and
is called on `workers`. `tell(event)` is called by any thread with Dragged (own=True), Conflicted and Refused.
"""

import logging
from collections.abc import Callable
from concurrent.futures import Executor, Future
from dataclasses import dataclass

import numpy as np
import viser

from ars_web.errors import ArsError, Conflict
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.rigid_transform import Transform
from ars_web.scene.boxes import BoxNodes
from ars_web.scene.drags import Dragging, Move, Resize, Turn, along_axis
from ars_web.scene.face_handles import FaceHandles, Pull
from ars_web.scene.gizmo import Gizmo, Phase
from ars_web.scene.hardening import is_gone
from ars_web.sessions.model import VirtualBox
from ars_web.workspace import BoxPreview, Conflicted, Dragged, Refused, ViewState

log = logging.getLogger(__name__)

Commit = Callable[[int, int, Transform, np.ndarray], VirtualBox]


@dataclass(frozen=True, eq=False)
class _Drag:
    """A drag in progress.

    Attributes:
        start: the box as it was drawn when the drag began.
        revision: it is stored only if the box is still at this one.
        after: an earlier drag of the same box that is being stored; its outcome is what this one began from.
        last: where it has got to.
    """

    box_id: int
    how: Move | Turn | Resize
    start: Box
    revision: int
    after: "Future[VirtualBox | None] | None"
    last: Dragging


class BoxEditor:
    """Lets one view edit its selected box. Thread-safe; drags arrive on viser's event loop."""

    def __init__(
        self,
        client: viser.ClientHandle,
        nodes: BoxNodes,
        *,
        by: str,
        commit: Commit,
        workers: Executor,
        tell: Callable[[Dragged | Conflicted | Refused], None],
    ) -> None:
        self._client = client
        self._nodes = nodes
        self._by = by
        self._commit = commit
        self._workers = workers
        self._tell = tell
        self._lock = nodes.lock
        self._state = ViewState()
        self._drag: _Drag | None = None
        self._storing: dict[int, Future[VirtualBox | None]] = {}
        self._closed = False
        self._gizmo = Gizmo(client, self._gizmo_dragged)
        self._handles = FaceHandles(client, self._handle_dragged)
        self._stop = nodes.watch(self._changed)

    def show(self, state: ViewState) -> None:
        """Offer what the page's tool offers, at the box that it has selected."""
        with self._lock:
            before, self._state = self._state, state
            drag = self._drag
        if drag is not None and (drag.box_id != state.selected or before.tool != state.tool):
            self.cancel()
        with self._lock:
            self._offer()

    def cancel(self) -> None:
        """Forget a drag in progress; the box is shown as it is stored."""
        with self._lock:
            drag, self._drag = self._drag, None
        if drag is None:
            return
        self._nodes.preview(None, by=self._by)
        self._tell(Dragged("cancel", BoxPreview(drag.box_id, drag.start), "", own=True))

    def close(self) -> None:
        """The client is gone."""
        self._stop()
        self.cancel()
        with self._lock:
            self._closed = True

    def _offer(self) -> None:
        """Put gizmo or handles at the selected box. While it is dragged the gizmo stays with the pointer."""
        if self._closed or is_gone(self._client):
            return
        state = self._state
        stored = None if state.selected is None else self._nodes.stored(state.selected)
        box = None if stored is None else self._nodes.box(stored.id)
        editable = stored is not None and not stored.locked and stored.id not in state.hidden
        with self._client.atomic():
            if box is None or not editable or state.tool == "select":
                self._gizmo.hide()
                self._handles.hide()
            elif state.tool == "resize":
                self._gizmo.hide()
                self._handles.show(box)
            else:
                self._handles.hide()
                if self._drag is None:
                    rings = state.tool == "rotate"
                    only_z = rings and state.upright
                    self._gizmo.show(self._gizmo_pose(box, world=only_z), rings=rings, only_z=only_z)
        self._client.flush()

    def _gizmo_pose(self, box: Box, *, world: bool) -> Transform:
        if self._state.axes == "box" and not world:
            return box.T_world_box
        return rigid_transform.from_rotation(np.eye(3), box.T_world_box[:3, 3])

    def _changed(self, box_ids: frozenset[int]) -> None:
        if self._state.selected in box_ids:
            self._offer()

    def _gizmo_dragged(self, phase: Phase, T_world_gizmo: Transform) -> None:
        state = self._state
        if phase == "start":

            def how(box: Box) -> Move | Turn:
                if state.tool == "rotate":
                    return Turn(box, T_world_gizmo, snap=state.snap_angle, upright=state.upright)
                return Move(box, T_world_gizmo, snap=state.snap_length)

            self._begin(how)
            return
        drag = self._drag
        if drag is None or isinstance(drag.how, Resize):
            return
        if phase == "update":
            self._follow(drag.how.to(T_world_gizmo))
        else:  # at the pose of the last update
            self._release()

    def _handle_dragged(self, pull: Pull) -> None:
        if pull.phase == "start":

            def how(box: Box) -> Resize:
                # Where the face was taken, which is beside its middle; along the face's own axis where that is seen
                # end on, and the drag will say nothing until it is seen from the side.
                grip = along_axis(box, axis=pull.axis, eye=pull.eye, pointer=pull.pointer)
                at = pull.side * float(box.size[pull.axis]) / 2 if grip is None else grip
                return Resize(box, pull.axis, pull.side, at, snap=self._state.snap_length)

            self._begin(how)
            return
        drag = self._drag
        if drag is None or not isinstance(drag.how, Resize):
            return
        reached = drag.how.to(pull.eye, pull.pointer)
        if reached is not None:
            self._follow(reached)
        if pull.phase == "end":
            self._release()

    def _begin(self, how: Callable[[Box], Move | Turn | Resize]) -> None:
        self.cancel()
        with self._lock:
            selected = self._state.selected
            stored = None if selected is None else self._nodes.stored(selected)
            box = None if stored is None else self._nodes.box(stored.id)
            if stored is None or box is None or stored.locked:
                return
            after = self._storing.get(stored.id)
            self._drag = _Drag(stored.id, how(box), box, stored.revision, after, Dragging(box, ""))
        self._tell(Dragged("start", BoxPreview(stored.id, box), "", own=True))

    def _follow(self, reached: Dragging) -> None:
        with self._lock:
            drag = self._drag
            if drag is None:
                return
            self._drag = _Drag(drag.box_id, drag.how, drag.start, drag.revision, drag.after, reached)
            preview = BoxPreview(drag.box_id, reached.box)
            self._nodes.preview(preview, by=self._by)
        self._tell(Dragged("move", preview, reached.text, own=True))

    def _release(self) -> None:
        connected = self._nodes.has_client(self._client)
        drag = self._drag
        # viser ends the drags of a browser that vanishes; what it had not let go of is not stored.
        if drag is None or not connected or drag.last.box is drag.start or _same(drag.last.box, drag.start):
            self.cancel()
            with self._lock:
                self._offer()
            return
        with self._lock:
            self._drag = None
            storing = self._workers.submit(self._store, drag)
            self._storing[drag.box_id] = storing
            self._offer()
        storing.add_done_callback(lambda done: self._stored(drag, done))

    def _store(self, drag: _Drag) -> VirtualBox | None:
        """Store a drag, on a worker; None where that was refused, which has been told then."""
        before = None if drag.after is None else drag.after.result()
        revision = drag.revision if before is None else before.revision
        yours = BoxPreview(drag.box_id, drag.last.box)
        try:
            stored = self._commit(drag.box_id, revision, drag.last.box.T_world_box, drag.last.box.size)
        except ArsError as error:
            self._nodes.preview(None, by=self._by)
            if isinstance(error, Conflict):
                current = error.current if isinstance(error.current, VirtualBox) else None
                self._tell(Conflicted(str(error), yours, current))
            else:
                self._tell(Refused(str(error)))
            self._tell(Dragged("cancel", BoxPreview(drag.box_id, drag.start), "", own=True))
            return None
        self._nodes.settle(stored)
        self._tell(Dragged("end", BoxPreview(drag.box_id, stored.box), drag.last.text, own=True))
        return stored

    def _stored(self, drag: _Drag, done: "Future[VirtualBox | None]") -> None:
        with self._lock:
            if self._storing.get(drag.box_id) is done:
                del self._storing[drag.box_id]
        error = None if done.cancelled() else done.exception()
        if error is not None:
            log.error("a drag of box %d cannot be stored", drag.box_id, exc_info=error)
            self._nodes.preview(None, by=self._by)
            self._tell(Refused("the box could not be stored, by a fault in the program; see its log"))
            self._tell(Dragged("cancel", BoxPreview(drag.box_id, drag.start), "", own=True))


def _same(a: Box, b: Box) -> bool:
    return np.array_equal(a.T_world_box, b.T_world_box) and np.array_equal(a.size, b.size)
