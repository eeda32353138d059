"""The mesh of a class or of one box: the object's own surface in metres, named by what it holds."""

import hashlib
import re
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from jaxtyping import Float, Int

from ars_web.errors import BadInput
from ars_web.geometry.box import Box
from ars_web.geometry.mesh import edges_of_faces
from ars_web.geometry.rigid_transform import transform_points
from ars_web.sessions.names import checked_name

MOST_FACES = 200_000
"""Of a mesh, those that are seen from the back included. Labels of every frame are computed from them."""

MOST_CORNERS = 3 * MOST_FACES

MESH_UNITS = ("mm", "cm", "m", "in")
MESH_ORIGINS = ("centre", "file")

_AXES = re.compile(r"-?[xyz],-?[xyz],-?[xyz]")

FARTHEST = 100.0
"""Metres from the box's centre, along each of its axes."""


@dataclass(frozen=True, eq=False)
class ObjectMesh:
    """A closed mesh that moves and turns with its box, and does not scale with it.

    Attributes:
        vertices: (v, 3) v >= 3, metres along the box's axes, origin at its centre. Float64 whose values float32 can
            hold.
        faces: (f, 3) f >= 2, int32 rows of `vertices`, counter-clockwise seen from outside. Closed in the sense of
            `geometry.mesh.Mesh`; a surface that is open has every face twice, once from each side.
    """

    vertices: Float[np.ndarray, "v 3"]
    faces: Int[np.ndarray, "f 3"]

    def __post_init__(self) -> None:
        """Raises BadInput for what is no mesh: wrong shapes, corners that are not finite or too far, faces of corners
        that are not there or that leave the mesh open, too many of them."""
        # What cannot be held is refused below.
        with np.errstate(over="ignore"):
            vertices = np.asarray(self.vertices, dtype=np.float64).astype(np.float32).astype(np.float64)
        faces = np.array(self.faces)
        for what, rows, least, most in (
            ("vertices", vertices, 3, MOST_CORNERS),
            ("faces", faces, 2, MOST_FACES),
        ):
            if rows.ndim != 2 or rows.shape[1] != 3 or len(rows) < least:
                raise BadInput(f"a mesh needs {least} {what} or more, of three numbers, not shape {list(rows.shape)}")
            if len(rows) > most:
                raise BadInput(f"a mesh can have at most {most} {what}, not {len(rows)}: simplify it first")
        if not (np.abs(vertices) <= FARTHEST).all():
            raise BadInput(f"a mesh's vertices must be finite and within {FARTHEST:g} m of their box's centre")
        if not np.issubdtype(faces.dtype, np.integer) or faces.min() < 0 or faces.max() >= len(vertices):
            raise BadInput(f"a mesh's faces must be whole numbers from 0 to {len(vertices) - 1}, rows of its vertices")
        faces = faces.astype(np.int32)
        edges_of_faces(faces)
        # Minus zero is zero: one shape has one name.
        vertices += 0.0
        vertices.flags.writeable = False
        faces.flags.writeable = False
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "faces", faces)

    def in_world(self, box: Box) -> tuple[Float[np.ndarray, "v 3"], Int[np.ndarray, "f 3"]]:
        """(v, 3) world coordinates in metres, and the faces, of the mesh of the object in `box`."""
        return transform_points(box.T_world_box, self.vertices), self.faces

    @cached_property
    def extent(self) -> Float[np.ndarray, "3"]:
        """Metres along the box's axes, from the lowest vertex to the highest; 0 across a flat mesh."""
        return np.ptp(self.vertices, axis=0)

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
        """The mesh that `vertex_bytes` and `face_bytes` were taken of.

        Raises:
            BadInput: they are of no mesh.
        """
        if len(vertex_bytes) % 12 or len(face_bytes) % 12:
            raise BadInput(f"{len(vertex_bytes)} and {len(face_bytes)} bytes are no rows of three numbers")
        return cls(
            np.frombuffer(vertex_bytes, dtype="<f4").reshape(-1, 3),
            np.frombuffer(face_bytes, dtype="<i4").reshape(-1, 3),
        )


@dataclass(frozen=True)
class MeshSource:
    """Where a mesh came from, for people.

    Attributes:
        name: of its file, or what else it was made from.
        unit: of the file's numbers: mm, cm, m or in.
        axes: which of the file's axes run along the box's x, y and z: `x,-z,y`.
        origin: what lies at the box's centre: the `centre` of the mesh's bounds, or the `file`'s own origin.
    """

    name: str
    unit: str
    axes: str
    origin: str

    def __post_init__(self) -> None:
        """Raises BadInput for what cannot be shown, or is none of what they can be."""
        object.__setattr__(self, "name", checked_name(self.name, what="the file of a mesh"))
        for what, value, known in (("unit", self.unit, MESH_UNITS), ("origin", self.origin, MESH_ORIGINS)):
            if value not in known:
                raise BadInput(f"a mesh's {what} must be one of {', '.join(known)}, not {value!r}")
        if not _AXES.fullmatch(self.axes):
            raise BadInput(f"a mesh's axes must be such as x,-z,y, not {self.axes!r}")


@dataclass(frozen=True, eq=False)
class SourcedMesh:
    """A mesh with where it came from, as a session keeps it."""

    mesh: ObjectMesh
    source: MeshSource
