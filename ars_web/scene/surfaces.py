"""The hulls and meshes of a session's boxes in its shared scene: translucent, and moved and turned with their boxes.

    hulls = SurfaceNodes(server, boxes, kind="hull")    one a viser server, and one for its meshes
    hulls.know(snapshot.hulls)                          before the boxes of that snapshot are shown

The node of box 7's hull is `/boxes/7/at/hull`, which hides with its box; that of its mesh is `/boxes/7/at/mesh`. A hull
scales with its box, a mesh does not. A node is made anew by its name when the box gets another surface, and never
removed: viser remembers the removal of each name for ever.
"""

from collections.abc import Mapping
from typing import Literal

import numpy as np
import viser

from ars_web.scene.boxes import BoxNodes
from ars_web.sessions.hull_mesh import HullMesh
from ars_web.sessions.object_mesh import ObjectMesh

OPACITY = 0.28
"""Enough to see its shape, little enough to see the photo through it."""


class SurfaceNodes:
    """The hulls, or the meshes, of all boxes, as every view of the session sees them. Thread-safe."""

    def __init__(self, server: viser.ViserServer, boxes: BoxNodes, *, kind: Literal["hull", "mesh"]) -> None:
        self._server = server
        self._boxes = boxes
        self._kind = kind
        self._known: Mapping[str, HullMesh | ObjectMesh] = {}
        self._nodes: dict[int, tuple[str, viser.MeshHandle]] = {}
        boxes.watch(self._changed)

    def know(self, surfaces: Mapping[str, HullMesh] | Mapping[str, ObjectMesh]) -> None:
        """Take these surfaces, by their digests, for the boxes that are drawn from now on."""
        with self._boxes.lock:
            self._known = dict(surfaces)

    def _changed(self, box_ids: frozenset[int]) -> None:
        with self._boxes.lock:
            with self._server.atomic():
                for box_id in box_ids:
                    self._draw(box_id)
            self._server.flush()

    def _draw(self, box_id: int) -> None:
        stored, box = self._boxes.stored(box_id), self._boxes.box(box_id)
        if stored is None or box is None:
            return  # its surface is hidden with it
        digest = stored.hull if self._kind == "hull" else self._boxes.mesh(box_id)
        shown, mesh = self._nodes.get(box_id, (None, None))
        if mesh is not None and shown != digest:
            mesh.visible = False
        if digest is None:
            return
        color = self._boxes.color(box_id)
        x, y, z = (float(length) for length in box.size) if self._kind == "hull" else (1.0, 1.0, 1.0)
        if mesh is None or shown != digest:
            # A drag that is stored before its hull is read keeps the box's hull: it is always known.
            surface = self._known.get(digest)
            if surface is None:
                return
            mesh = self._server.scene.add_mesh_simple(
                f"/boxes/{box_id}/at/{self._kind}",
                surface.vertices.astype(np.float32),
                surface.faces.astype(np.uint32),
                color=color,
                opacity=OPACITY,
                side="front",
                cast_shadow=False,
                receive_shadow=False,
                scale=(x, y, z),
            )
            self._nodes[box_id] = (digest, mesh)
        mesh.visible = True
        mesh.scale = (x, y, z)
        mesh.color = color
