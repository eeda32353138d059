"""The boxes of a session in its shared scene, and what one view shows differently: hidden boxes and the selected one.

    nodes = BoxNodes(server)                       one a viser server
    nodes.show(state)                              as stored; call it after every edit, by any thread
    nodes.preview(preview | None, by=view)         as it would be; one a view at a time; None: no more
    nodes.settle(box)                              a drag was stored: drawn from now on, whatever `show` still brings
    nodes.box(box_id) -> Box | None                as drawn now
    nodes.stored(box_id) -> VirtualBox | None      as stored
    nodes.watch(changed) -> stop                   `changed(box_ids)` after anything was drawn anew

    own = OwnBoxes(client, nodes)                  one a connected client
    own.show(hidden=…, selected=…); own.close()

Boxes are not viser-clickable, so that a handle behind a box can be pressed: clicks are rays, and whoever takes them
meets the boxes of `nodes.drawn()` with it.

The nodes of box 7 are `/boxes/7` (nothing in it but visibility, for views to shadow), `/boxes/7/at` (its place;
invisible while there is no such box) and in that `edges` and `body`. They are made once and never removed: viser
remembers the removal of each name for ever. A box's own name is written by the bridge in the page, over the scene.
"""

from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from threading import RLock

import numpy as np
import viser
from jaxtyping import Float

from ars_web.geometry.box import CORNER_SIGNS, EDGES, Box
from ars_web.scene.hardening import is_gone
from ars_web.scene.poses import place
from ars_web.sessions.model import ObjectClass, SessionState, VirtualBox
from ars_web.workspace import BoxPreview

THICKNESS = 2.0
"""Pixels, of a box's edges."""

SELECTED_THICKNESS = 4.0

UNIT_EDGES: Float[np.ndarray, "12 2 3"] = (CORNER_SIGNS[EDGES] / 2).astype(np.float32)
"""The edges of a box of size 1; nodes are scaled to the box's."""

Watcher = Callable[[frozenset[int]], None]


@dataclass(frozen=True)
class _Nodes:
    """The nodes of one box."""

    at: viser.FrameHandle
    edges: viser.LineSegmentsHandle
    body: viser.BoxHandle


class BoxNodes:
    """All boxes of a session, as every view of it sees them. Thread-safe."""

    def __init__(self, server: viser.ViserServer) -> None:
        self.lock = RLock()
        """Held while boxes are drawn. What watches them uses it too, so that no two wait for each other."""
        self._server = server
        self._nodes: dict[int, _Nodes] = {}
        self._boxes: dict[int, VirtualBox] = {}
        self._classes: dict[int, ObjectClass] = {}
        self._previews: dict[str, BoxPreview] = {}
        self._revision = -1
        self._watchers: list[Watcher] = []

    def show(self, state: SessionState) -> None:
        """Draw the boxes of a state; a box that is being previewed stays where the preview has it.

        A state that was read before a drag was stored does not take that back.
        """
        with self.lock:
            newer = {box_id: box for box_id, box in self._boxes.items() if box.revision > state.revision}
            boxes = {**state.boxes, **newer}
            changed = {
                box_id
                for box_id in self._boxes.keys() | boxes.keys()
                if _differs(self._boxes.get(box_id), boxes.get(box_id))
            }
            recoloured = {c.id for c in state.classes.values() if c != self._classes.get(c.id)}
            changed |= {box.id for box in boxes.values() if box.class_id in recoloured}
            self._boxes, self._classes, self._revision = boxes, dict(state.classes), state.revision
            self._draw(changed)

    def preview(self, preview: BoxPreview | None, *, by: str = "") -> None:
        """Draw a box as a view would have it, instead of that view's last preview."""
        with self.lock:
            before = self._previews.pop(by, None)
            if preview is not None:
                self._previews[by] = preview
            self._draw({p.box_id for p in (before, preview) if p is not None})

    def settle(self, box: VirtualBox) -> None:
        """Draw a box as it has just been stored, and hold no more previews of it.

        A state that came in between knows better: the box may have been deleted since.
        """
        with self.lock:
            known = self._boxes.get(box.id)
            if box.revision > self._revision and (known is None or known.revision < box.revision):
                self._boxes[box.id] = box
            self._previews = {by: p for by, p in self._previews.items() if p.box_id != box.id}
            self._draw({box.id})

    def box(self, box_id: int) -> Box | None:
        """A box as it is drawn now; None: there is none."""
        with self.lock:
            stored = self._boxes.get(box_id)
            if stored is None:
                return None
            previews = [p for p in self._previews.values() if p.box_id == box_id]
            return previews[-1].box if previews else stored.box

    def stored(self, box_id: int) -> VirtualBox | None:
        """A box as it is stored; None: there is none."""
        with self.lock:
            return self._boxes.get(box_id)

    def drawn(self) -> dict[int, Box]:
        """All boxes as they are drawn now."""
        with self.lock:
            return {box_id: box for box_id in self._boxes if (box := self.box(box_id)) is not None}

    def color(self, box_id: int) -> tuple[int, int, int]:
        """Of a box's class, 0 to 255 each; white for a box that is not there."""
        with self.lock:
            stored = self._boxes.get(box_id)
            known = None if stored is None else self._classes.get(stored.class_id)
            return (255, 255, 255) if known is None else rgb(known.color)

    def mesh(self, box_id: int) -> str | None:
        """The digest of the mesh that a box's object has, its own or its class's; None: it has none."""
        with self.lock:
            stored = self._boxes.get(box_id)
            known = None if stored is None else self._classes.get(stored.class_id)
            return None if stored is None else stored.mesh or (None if known is None else known.mesh)

    def has_client(self, client: viser.ClientHandle) -> bool:
        """Whether a browser is still connected; while viser tells of its end, it is not."""
        return client.client_id in self._server.get_clients()

    def watch(self, changed: Watcher) -> Callable[[], None]:
        """Call `changed` with the boxes that were drawn anew. Returns the way to stop."""
        with self.lock:
            self._watchers.append(changed)

        def stop() -> None:
            with self.lock, suppress(ValueError):
                self._watchers.remove(changed)

        return stop

    def _draw(self, box_ids: Iterable[int]) -> None:
        ids = frozenset(box_ids)
        if not ids:
            return
        with self._server.atomic():
            for box_id in ids:
                self._draw_one(box_id)
        self._server.flush()
        for changed in tuple(self._watchers):
            changed(ids)

    def _draw_one(self, box_id: int) -> None:
        stored, box = self._boxes.get(box_id), self.box(box_id)
        if stored is None or box is None:
            if box_id in self._nodes:
                self._nodes[box_id].at.visible = False
            return
        color = self.color(box_id)
        size = _scale(box)
        nodes = self._nodes.get(box_id)
        if nodes is None:
            nodes = self._nodes[box_id] = self._make(box_id, color, size)
        nodes.at.visible = True
        place(nodes.at, box.T_world_box)
        nodes.edges.scale = size
        nodes.edges.colors = np.array(color, dtype=np.uint8)
        nodes.body.scale = size
        nodes.body.color = color
        # It would hide a hull or mesh inside: both are sorted by their middles, which are one, and both write their
        # depth.
        nodes.body.visible = stored.hull is None and self.mesh(box_id) is None

    def _make(self, box_id: int, color: tuple[int, int, int], size: tuple[float, float, float]) -> _Nodes:
        scene, at = self._server.scene, f"/boxes/{box_id}/at"
        scene.add_frame(f"/boxes/{box_id}", show_axes=False)
        return _Nodes(
            at=scene.add_frame(at, show_axes=False),
            edges=scene.add_line_segments(
                f"{at}/edges", UNIT_EDGES, color, thickness=THICKNESS, thickness_units="screen", scale=size
            ),
            body=scene.add_box(
                f"{at}/body",
                color=color,
                dimensions=(1.0, 1.0, 1.0),
                opacity=0.07,
                side="front",
                cast_shadow=False,
                receive_shadow=False,
                scale=size,
            ),
        )


class OwnBoxes:
    """What one view shows differently from the others: what it hides, and what it has selected."""

    def __init__(self, client: viser.ClientHandle, nodes: BoxNodes) -> None:
        self._client = client
        self._nodes = nodes
        self._lock = nodes.lock
        self._shadows: dict[int, viser.FrameHandle] = {}
        self._outlines: dict[int, viser.LineSegmentsHandle] = {}
        self._selected: int | None = None
        self._closed = False
        self._stop = nodes.watch(self._changed)

    def show(self, *, hidden: frozenset[int], selected: int | None) -> None:
        """Hide these boxes for this view and draw one with a thicker line."""
        with self._lock:
            if self._closed or is_gone(self._client):
                return
            with self._client.atomic():
                for box_id in hidden - self._shadows.keys():
                    # A client's node stands before the shared one of the same name, and takes its children with it.
                    self._shadows[box_id] = self._client.scene.add_frame(
                        f"/boxes/{box_id}", show_axes=False, visible=False
                    )
                for box_id, shadow in self._shadows.items():
                    shadow.visible = box_id not in hidden
                self._selected = selected
                self._outline()

    def close(self) -> None:
        """Follow the boxes no more; the client is gone."""
        self._stop()
        with self._lock:
            self._closed = True

    def _changed(self, box_ids: frozenset[int]) -> None:
        with self._lock:
            if not self._closed and self._selected in box_ids and not is_gone(self._client):
                with self._client.atomic():
                    self._outline()
                self._client.flush()

    def _outline(self) -> None:
        for box_id, outline in self._outlines.items():
            outline.visible = box_id == self._selected
        box = None if self._selected is None else self._nodes.box(self._selected)
        if self._selected is None or box is None:
            return
        outline = self._outlines.get(self._selected)
        color, size = self._nodes.color(self._selected), _scale(box)
        if outline is None:
            # It hangs on the shared node, and so moves with it when someone else drags the box.
            self._outlines[self._selected] = self._client.scene.add_line_segments(
                f"/boxes/{self._selected}/at/selected",
                UNIT_EDGES,
                color,
                thickness=SELECTED_THICKNESS,
                thickness_units="screen",
                scale=size,
            )
        else:
            outline.scale = size
            outline.colors = np.array(color, dtype=np.uint8)


def rgb(color: str) -> tuple[int, int, int]:
    """`#rrggbb` as three numbers from 0 to 255."""
    red, green, blue = bytes.fromhex(color.removeprefix("#"))
    return red, green, blue


def _differs(a: VirtualBox | None, b: VirtualBox | None) -> bool:
    return a is not b and (a is None or b is None or a.revision != b.revision)


def _scale(box: Box) -> tuple[float, float, float]:
    x, y, z = (float(length) for length in box.size)
    return x, y, z
