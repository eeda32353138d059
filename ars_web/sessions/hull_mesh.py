"""The hull that is stored with a box: a mesh in the box's own units, named by what it holds."""

import hashlib
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from jaxtyping import Float, Int

from ars_web.errors import BadInput
from ars_web.geometry.box import Box
from ars_web.geometry.mesh import edges_of_faces
from ars_web.geometry.rigid_transform import invert, transform_points

MOST_CORNERS = 1_000_000
"""Of a hull, and as many faces. Those of drawn outlines have some thousands."""

FARTHEST = 1e6
"""Box sizes from the box's centre. A hull is within its box, or a little beyond one that was fitted anew."""


@dataclass(frozen=True, eq=False)
class HullMesh:
    """A mesh that moves, turns and scales with its box.

    Attributes:
        vertices: (v, 3) v >= 4, along the box's axes in units of its sizes, origin at its centre: within -0.5 to 0.5
            where it is inside the box. Float64 whose values float32 can hold.
        faces: (f, 3) f >= 4, int32 rows of `vertices`, counter-clockwise seen from outside.
    """

    vertices: Float[np.ndarray, "v 3"]
    faces: Int[np.ndarray, "f 3"]

    def __post_init__(self) -> None:
        """Raises BadInput for what is no mesh: wrong shapes, corners that are not finite or too far, faces of corners
        that are not there or that leave the mesh open."""
        # What cannot be held is refused below.
        with np.errstate(over="ignore"):
            vertices = np.asarray(self.vertices, dtype=np.float64).astype(np.float32).astype(np.float64)
        faces = np.array(self.faces)
        for what, rows in (("vertices", vertices), ("faces", faces)):
            if rows.ndim != 2 or rows.shape[1] != 3 or not 4 <= len(rows) <= MOST_CORNERS:
                raise BadInput(
                    f"a hull needs 4 to {MOST_CORNERS} {what} of three numbers, not shape {list(rows.shape)}"
                )
        if not (np.abs(vertices) <= FARTHEST).all():
            raise BadInput(f"a hull's vertices must be finite and within {FARTHEST:g} sizes of their box")
        if not np.issubdtype(faces.dtype, np.integer) or faces.min() < 0 or faces.max() >= len(vertices):
            raise BadInput(f"a hull's faces must be whole numbers from 0 to {len(vertices) - 1}, rows of its vertices")
        faces = faces.astype(np.int32)
        edges_of_faces(faces)
        # Minus zero is zero: one shape has one name.
        vertices += 0.0
        vertices.flags.writeable = False
        faces.flags.writeable = False
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "faces", faces)

    @classmethod
    def of(cls, vertices_world: Float[np.ndarray, "v 3"], faces: Int[np.ndarray, "f 3"], box: Box) -> Self:
        """The hull at (v, 3) world coordinates in metres, as it is kept with `box`; rounded to float32.

        Raises:
            BadInput: see `HullMesh`.
        """
        points_box = transform_points(invert(box.T_world_box), np.asarray(vertices_world, dtype=np.float64))
        return cls(points_box / box.size, faces)

    def in_world(self, box: Box) -> tuple[Float[np.ndarray, "v 3"], Int[np.ndarray, "f 3"]]:
        """(v, 3) world coordinates in metres, and the faces, of the hull that is kept with `box`."""
        return transform_points(box.T_world_box, self.vertices * box.size), self.faces

    @cached_property
    def digest(self) -> str:
        """Its name: the SHA-256 of what it holds, in 64 hexadecimal digits."""
        return hashlib.sha256(b"%d " % len(self.vertices) + self.vertex_bytes + self.face_bytes).hexdigest()

    @property
    def vertex_bytes(self) -> bytes:
        """The vertices as little-endian float32, row by row; nothing is lost."""
        return self.vertices.astype("<f4").tobytes()

    @property
    def face_bytes(self) -> bytes:
        """The faces as little-endian int32, row by row."""
        return self.faces.astype("<i4").tobytes()

    @classmethod
    def from_bytes(cls, vertex_bytes: bytes, face_bytes: bytes) -> Self:
        """The hull that `vertex_bytes` and `face_bytes` were taken of.

        Raises:
            BadInput: they are of no hull.
        """
        if len(vertex_bytes) % 12 or len(face_bytes) % 12:
            raise BadInput(f"{len(vertex_bytes)} and {len(face_bytes)} bytes are no rows of three numbers")
        return cls(
            np.frombuffer(vertex_bytes, dtype="<f4").reshape(-1, 3),
            np.frombuffer(face_bytes, dtype="<i4").reshape(-1, 3),
        )
