"""Boxes and meshes of one scene as the compiled loops read them: all of them triangles, one after the other."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from jaxtyping import Float, Int

from ars_web.errors import BadInput
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.mesh import Mesh
from ars_web.geometry.raster_records import Shapes

BOX_FACES: Int[np.ndarray, "12 3"] = np.array(
    [
        triangle
        for a, b, c, d in ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
        for triangle in ((a, b, c), (a, c, d))
    ]
)
"""Of a box's corners in the order of box.CORNER_SIGNS, counter-clockwise as seen from outside."""

TOUCHING = 1e-12
"""Of how far the shapes are from the world's origin: what is no further apart than this lies in each other, perhaps."""

DIRECTIONS = 200
"""All round, in which shapes that are apart are looked for a plane between them."""


@dataclass(frozen=True, eq=False)
class ShapeStack:
    """b shapes.

    Attributes:
        vertices: (v, 3) in the world, of all shapes.
        faces: (f, 3) vertices of all triangles, counter-clockwise as seen from outside.
        planes: (f, 4) as `Mesh.planes`.
        edges: (e, 4) as `Mesh.edges`.
        first_vertex, first_face, first_edge: (b + 1,) where each shape's begin; the last is where they end.
        Ts_world_bound, halves: (b, 4, 4) and (b, 3) the boxes, along the axes of `boxes`, round the shapes.
    """

    vertices: Float[np.ndarray, "v 3"]
    faces: Int[np.ndarray, "f 3"]
    planes: Float[np.ndarray, "f 4"]
    edges: Int[np.ndarray, "e 4"]
    first_vertex: Int[np.ndarray, "_"]
    first_face: Int[np.ndarray, "_"]
    first_edge: Int[np.ndarray, "_"]
    Ts_world_bound: Float[np.ndarray, "b 4 4"]
    halves: Float[np.ndarray, "b 3"]

    @cached_property
    def parting(self) -> Float[np.ndarray, "b b 4"]:
        """For each shape and each other one a plane (nx, ny, nz, d) with all of the first on or below it,
        n . p + d <= 0, and all of the other on or above it; NaN where none of the directions that are tried has one.

        Tried are the axes of the bounds, the lines between their centres, and DIRECTIONS all round.
        """
        b, centres = len(self.halves), self.Ts_world_bound[:, :3, 3]
        if b < 2:
            return np.full((b, b, 4), np.nan)
        i, j = np.triu_indices(b, k=1)
        axes = np.swapaxes(self.Ts_world_bound[:, :3, :3], -1, -2).reshape(-1, 3)
        normals = np.concatenate([axes, centres[j] - centres[i], _all_round(DIRECTIONS)])
        lengths = np.linalg.norm(normals, axis=1)
        normals = normals[lengths > 0] / lengths[lengths > 0, None]
        normals = np.concatenate([normals, -normals])
        places = normals @ self.vertices.T
        low = np.minimum.reduceat(places, self.first_vertex[:-1], axis=1)
        high = np.maximum.reduceat(places, self.first_vertex[:-1], axis=1)
        planes = np.full((b, b, 4), np.nan)
        for first in range(b):
            gaps = low - high[:, first, None]
            best = np.argmax(gaps, axis=0)
            apart = gaps[best, np.arange(b)] > TOUCHING * np.abs(places).max()
            apart[first] = False
            planes[first, apart, :3] = normals[best[apart]]
            planes[first, apart, 3] = -(high[best, first] + low[best, np.arange(b)])[apart] / 2
        return planes


def mesh_of_box(box: Box) -> Mesh:
    """The box's surface, as twelve triangles."""
    return Mesh(box.corners_world, BOX_FACES)


def stack_shapes(boxes: Sequence[Box], meshes: Sequence[Mesh | None]) -> ShapeStack:
    """The shapes, of which each is its mesh, or its box where that is None; kept for the next call with the same ones.

    Raises:
        BadInput: there are not as many meshes as boxes.
    """
    if len(boxes) != len(meshes):
        raise BadInput(f"each shape needs a box, and a mesh or None: {len(boxes)} boxes and {len(meshes)} meshes")
    return _stack(tuple(boxes), tuple(meshes))


@lru_cache(maxsize=4)
def _stack(boxes: tuple[Box, ...], meshes: tuple[Mesh | None, ...]) -> ShapeStack:
    solids = [mesh_of_box(box) if mesh is None else mesh for box, mesh in zip(boxes, meshes, strict=True)]
    first_vertex = np.cumsum([0, *(len(solid.vertices_world) for solid in solids)])
    first_face = np.cumsum([0, *(len(solid.faces) for solid in solids)])
    first_edge = np.cumsum([0, *(len(solid.edges) for solid in solids)])
    faces = [np.zeros((0, 3), np.int64)]
    edges = [np.zeros((0, 4), np.int64)]
    for solid, vertex, face in zip(solids, first_vertex[:-1].tolist(), first_face[:-1].tolist(), strict=True):
        faces.append(solid.faces + vertex)
        edges.append(solid.edges + np.array([vertex, vertex, face, face]))
    Ts_world_bound, halves = np.empty((len(boxes), 4, 4)), np.empty((len(boxes), 3))
    for i, (box, solid) in enumerate(zip(boxes, solids, strict=True)):
        inside = rigid_transform.transform_points(rigid_transform.invert(box.T_world_box), solid.vertices_world)
        low, high = inside.min(axis=0), inside.max(axis=0)
        halves[i] = (high - low) / 2
        Ts_world_bound[i] = box.T_world_box
        Ts_world_bound[i, :3, 3] += box.T_world_box[:3, :3] @ ((low + high) / 2)
    return ShapeStack(
        np.concatenate([np.zeros((0, 3)), *(solid.vertices_world for solid in solids)]),
        np.concatenate(faces),
        np.concatenate([np.zeros((0, 4)), *(solid.planes for solid in solids)]),
        np.concatenate(edges),
        first_vertex,
        first_face,
        first_edge,
        Ts_world_bound,
        halves,
    )


def _all_round(n: int) -> Float[np.ndarray, "n 3"]:
    """n unit vectors, nearly evenly spread over half of the sphere: on a spiral, a golden angle apart."""
    z = (np.arange(n) + 0.5) / n
    turn, radius = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(n), np.sqrt(1.0 - z * z)
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn), z])


def kernel_shapes(stack: ShapeStack) -> Shapes:
    """The stack for one thread: copies, because threads that count the users of one array stand in each other's way."""
    a, b, c = (stack.vertices[stack.faces[:, i]] for i in range(3))
    sides = np.max([((b - a) ** 2).sum(axis=1), ((c - b) ** 2).sum(axis=1), ((a - c) ** 2).sum(axis=1)], axis=0)
    return Shapes(
        np.ascontiguousarray(stack.vertices.T),
        np.ascontiguousarray(stack.faces.T, dtype=np.uint32),
        np.ascontiguousarray(stack.planes.T),
        np.ascontiguousarray(stack.edges.T, dtype=np.uint32),
        sides,
        stack.first_vertex.copy(),
        stack.first_face.copy(),
        stack.first_edge.copy(),
        stack.Ts_world_bound.copy(),
        stack.halves.copy(),
    )
