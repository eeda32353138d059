"""Meshes of objects as sessions keep them, from files and from polygons."""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from ars_web.geometry.box import Box
from ars_web.geometry.flat_mesh import FLATNESS, flat_mesh
from ars_web.geometry.rigid_transform import invert, transform_points
from ars_web.meshes.mesh_file import read_mesh_file
from ars_web.meshes.placement import axes_text
from ars_web.sessions.names import LONGEST_NAME
from ars_web.sessions.object_mesh import MeshSource, ObjectMesh, SourcedMesh

UNEVEN = 0.01
"""How far a polygon's corners may be off their plane, as a share of its extent: they were found by hand in photos."""


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

    Corners a little off the plane that fits them best are moved into it.

    Raises:
        BadInput: see `flat_mesh`; or it is too far from the box.
    """
    points = np.asarray(corners, dtype=np.float64)
    extent = float(np.ptp(points, axis=0).max())
    flat = flat_mesh(points, tolerance=max(FLATNESS, UNEVEN * extent))
    vertices = transform_points(invert(box.T_world_box), flat.vertices_world) if in_world else flat.vertices_world
    return SourcedMesh(ObjectMesh(vertices, flat.faces), MeshSource("polygon", "m", "x,y,z", "file"))
