"""The hulls of a session's boxes in its shared scene: translucent meshes that move, turn and scale with their boxes.

    nodes = HullNodes(server, boxes)               one a viser server
    nodes.know(snapshot.hulls)                     before the boxes of that snapshot are shown

The node of box 7's hull is `/boxes/7/at/hull`, which hides with its box. It is made anew by its name when the box gets
another hull, and never removed: viser remembers the removal of each name for ever.
"""

from collections.abc import Mapping

import numpy as np
import viser

from ars_web.scene.boxes import BoxNodes
from ars_web.sessions.hull_mesh import HullMesh

OPACITY = 0.28
"""Enough to see its shape, little enough to see the photo through it."""


class HullNodes:
    """The hulls of all boxes, as every view of the session sees them. Thread-safe."""

    def __init__(self, server: viser.ViserServer, boxes: BoxNodes) -> None:
        self._server = server
        self._boxes = boxes
        self._known: Mapping[str, HullMesh] = {}
        self._nodes: dict[int, tuple[str, viser.MeshHandle]] = {}
        boxes.watch(self._changed)

    def know(self, hulls: Mapping[str, HullMesh]) -> None:
        """Take these hulls, by their digests, for the boxes that are drawn from now on."""
        with self._boxes.lock:
            self._known = dict(hulls)

    def _changed(self, box_ids: frozenset[int]) -> None:
        with self._boxes.lock:
            with self._server.atomic():
                for box_id in box_ids:
                    self._draw(box_id)
            self._server.flush()

    def _draw(self, box_id: int) -> None:
        stored, box = self._boxes.stored(box_id), self._boxes.box(box_id)
        if stored is None or box is None:
            return  # its hull is hidden with it
        shown, mesh = self._nodes.get(box_id, (None, None))
        if mesh is not None and shown != stored.hull:
            mesh.visible = False
        if stored.hull is None:
            return
        color = self._boxes.color(box_id)
        x, y, z = (float(length) for length in box.size)
        if mesh is None or shown != stored.hull:
            # A drag that is stored before its hull is read keeps the box's hull: it is always known.
            hull = self._known.get(stored.hull)
            if hull is None:
                return
            mesh = self._server.scene.add_mesh_simple(
                f"/boxes/{box_id}/at/hull",
                hull.vertices.astype(np.float32),
                hull.faces.astype(np.uint32),
                color=color,
                opacity=OPACITY,
                side="front",
                cast_shadow=False,
                receive_shadow=False,
                scale=(x, y, z),
            )
            self._nodes[box_id] = (stored.hull, mesh)
        mesh.visible = True
        mesh.scale = (x, y, z)
        mesh.color = color
