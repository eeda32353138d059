"""Closed triangle meshes, as the labels of hulls read them."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from ars_web.errors import BadInput


@dataclass(frozen=True, eq=False)
class Mesh:
    """The surface of a solid. It may have several pieces, tunnels and hollows, and need not be convex.

    Attributes:
        vertices_world: (v, 3) metres.
        faces: (f, 3) vertices of each triangle, counter-clockwise as seen from outside. Each edge belongs to as many
            faces in one direction as in the other, so that the surface has no border.
    """

    vertices_world: Float[np.ndarray, "v 3"]
    faces: Int[np.ndarray, "f 3"]

    def __post_init__(self) -> None:
        """Raises BadInput for a mesh without faces, with numbers that cannot be, or with a border."""
        vertices = np.array(self.vertices_world, dtype=np.float64, order="C")
        faces = np.array(self.faces, dtype=np.int64, order="C")
        if vertices.ndim != 2 or vertices.shape[1] != 3 or faces.ndim != 2 or faces.shape[1] != 3 or len(faces) == 0:
            shapes = f"vertices {list(vertices.shape)} and faces {list(faces.shape)}"
            raise BadInput(f"a mesh needs vertices (v, 3) and at least one face (f, 3), not {shapes}")
        if not np.isfinite(vertices).all():
            raise BadInput(
                f"a mesh's vertices must be finite: {vertices[~np.isfinite(vertices).all(axis=1)][0].tolist()}"
            )
        wrong = faces[(faces < 0) | (faces >= len(vertices))]
        if len(wrong):
            raise BadInput(f"a mesh's face has vertex {wrong[0]}; its vertices are 0 to {len(vertices) - 1}")
        vertices.flags.writeable = faces.flags.writeable = False
        object.__setattr__(self, "vertices_world", vertices)
        object.__setattr__(self, "faces", faces)
        _ = self.edges

    @cached_property
    def edges(self) -> Int[np.ndarray, "e 4"]:
        """Each edge with its two faces, the longest first: start, end, the face that runs along it from start to end,
        and the face that runs back."""
        found = edges_of_faces(self.faces)
        return np.ascontiguousarray(found[np.argsort(-self._lengths(found), kind="stable")])

    @cached_property
    def edge_lengths(self) -> Float[np.ndarray, "e"]:
        """Metres, of each edge."""
        return self._lengths(self.edges)

    def _lengths(self, edges: Int[np.ndarray, "e 4"]) -> Float[np.ndarray, "e"]:
        return np.linalg.norm(self.vertices_world[edges[:, 0]] - self.vertices_world[edges[:, 1]], axis=1)

    @cached_property
    def planes(self) -> Float[np.ndarray, "f 4"]:
        """(nx, ny, nz, d) of each face: n . p + d is how far the point p is outside it. A face without an area has
        every point inside."""
        a, b, c = (self.vertices_world[self.faces[:, i]] for i in range(3))
        normals = np.cross(b - a, c - a)
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        flat = lengths[:, 0] == 0.0
        normals = normals / np.where(lengths == 0.0, 1.0, lengths)
        offsets = np.where(flat, -np.inf, -(normals * a).sum(axis=1))
        return np.column_stack([normals, offsets])

    @cached_property
    def is_convex(self) -> bool:
        """Whether no vertex lies outside of any face, but for a millionth of the mesh's size."""
        planes, slack = self.planes, 2e-6 * self.sphere[1]
        real = planes[np.isfinite(planes[:, 3])]
        # Face by face in pieces: together they would be faces times vertices.
        return all(
            float((part[:, :3] @ self.vertices_world.T + part[:, 3:]).max(initial=-np.inf)) <= slack
            for part in np.array_split(real, max(len(real) // 256, 1))
        )

    @cached_property
    def sphere(self) -> tuple[Float[np.ndarray, "3"], float]:
        """Centre and radius of a sphere round all vertices."""
        centre = (self.vertices_world.min(axis=0) + self.vertices_world.max(axis=0)) / 2
        return centre, float(np.linalg.norm(self.vertices_world - centre, axis=1).max())

    @cached_property
    def hull_vertices_world(self) -> Float[np.ndarray, "h 3"]:
        """Those vertices that span the convex hull; all that faces have where a mesh is flat."""
        # SciPy takes half a second to load. manifold3d is there already, but its hulls leave out corners now and then.
        from scipy.spatial import ConvexHull, QhullError

        used = self.vertices_world[np.unique(self.faces)]
        try:
            return np.ascontiguousarray(used[ConvexHull(used).vertices])
        except QhullError:
            return used


def edges_of_faces(faces: Int[np.ndarray, "f 3"]) -> Int[np.ndarray, "e 4"]:
    """Each edge of a closed mesh with its two faces: the smaller of its vertices, the larger, the face that runs along
    it in this order, and the face that runs back.

    Raises:
        BadInput: an edge belongs to more faces in one direction than in the other, so that the mesh has a border.
    """
    starts, ends = faces.ravel().astype(np.int64), np.roll(faces, -1, axis=1).ravel().astype(np.int64)
    owners, back = np.repeat(np.arange(len(faces)), 3), starts > ends
    low, high = np.minimum(starts, ends), np.maximum(starts, ends)
    key = low * (int(high.max()) + 1) + high
    forward, backward = np.flatnonzero(~back), np.flatnonzero(back)
    forward = forward[np.argsort(key[forward], kind="stable")]
    backward = backward[np.argsort(key[backward], kind="stable")]
    if len(forward) != len(backward) or (key[forward] != key[backward]).any():
        _, places, which = np.unique(key, return_index=True, return_inverse=True)
        wrong = places[np.flatnonzero(np.bincount(which, np.where(back, -1, 1)))[0]]
        raise BadInput(
            "a mesh must be closed, and all its faces turned the same way: the edge between vertices"
            f" {low[wrong]} and {high[wrong]} is not run along as often in one direction as in the other"
        )
    return np.column_stack([low[forward], high[forward], owners[forward], owners[backward]])
