"""Meshes of objects as sessions keep them, from files and from polygons."""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from ars_web.geometry.box import Box
from ars_web.geometry.rigid_transform import invert, transform_points
from ars_web.meshes.mesh_file import read_mesh_file
from ars_web.meshes.placement import axes_text
from ars_web.meshes.polygon import polygon_mesh
from ars_web.sessions.names import LONGEST_NAME
from ars_web.sessions.object_mesh import MeshSource, ObjectMesh, SourcedMesh


def object_from_file(
    path: Path, *, name: str, unit: str, axes: str, origin: str
) -> tuple[SourcedMesh, tuple[str, ...]]:
    """The mesh of a file that people call `name`, and what was changed of it, in words.

    Raises:
        BadInput, BadFile: see `read_mesh_file`.
    """
    vertices, faces, notes = read_mesh_file(path, name=name, unit=unit, axes=axes, origin=origin)
    source = MeshSource(name[-LONGEST_NAME:], unit, axes_text(axes), origin)
    return SourcedMesh(ObjectMesh(vertices, faces), source), notes


def object_from_polygon(corners: Float[np.ndarray, "k 3"], box: Box, *, in_world: bool) -> SourcedMesh:
    """The mesh of a planar polygon, whose (k, 3) corners are in the box's frame, or in the world; metres.

    Raises:
        BadInput: see `polygon_mesh`; or it is too far from the box.
    """
    points = np.asarray(corners, dtype=np.float64)
    vertices, faces = polygon_mesh(points)
    if in_world:
        vertices = transform_points(invert(box.T_world_box), vertices)
    return SourcedMesh(ObjectMesh(vertices, faces), MeshSource("polygon", "m", "x,y,z", "file"))
