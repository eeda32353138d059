"""The box round a hull: along the world's axes, upright, or the smallest of all."""

from typing import Literal

import numpy as np
import shapely
from jaxtyping import Float

from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.rigid_transform import rotation_about_z
from ars_web.geometry.visual_hull import VisualHull

Orientation = Literal["world", "upright", "free"]
Position = Literal["box", "mass"]

THINNEST = 1e-6
"""Metres. A box has a size along each axis, however flat the hull is."""


def box_of_hull(hull: VisualHull, *, orientation: Orientation, position: Position = "box") -> Box:
    """The box round a hull, with its origin at its own middle or, for "mass", at the hull's centre of mass, in which
    case it grows until it holds the hull.

    "world": the world's axes. "upright": the smallest rectangle round the hull as seen along z, turned by less than 45
    degrees either way. "free": the smallest volume, with the axes named so that they are nearest to the world's.
    """
    points = np.unique(hull.vertices, axis=0)
    if orientation == "world":
        R = np.eye(3)
    elif orientation == "upright":
        R = canonical(rotation_about_z(smallest_rectangle_angle(points[:, :2])), upright=True)
    else:
        R = canonical(_smallest_box_rotation(points))
    along = points @ R
    low, high = along.min(axis=0), along.max(axis=0)
    if position == "mass":
        centre = hull.centre_of_mass @ R
        half = np.maximum(high - centre, centre - low)
    else:
        centre, half = (low + high) / 2, (high - low) / 2
    return Box(rigid_transform.from_rotation(R, R @ centre), np.maximum(2 * half, THINNEST))


def smallest_rectangle_angle(points: Float[np.ndarray, "n 2"]) -> float:
    """Radians by which x is turned in the smallest rectangle round points: one side lies along an edge of their convex
    hull (Freeman and Shapira 1975)."""
    ring = shapely.get_coordinates(shapely.convex_hull(shapely.multipoints(points)))
    edges = np.diff(ring, axis=0)
    edges = edges[np.linalg.norm(edges, axis=1) > 0]
    if len(edges) < 1:
        return 0.0
    angles = np.arctan2(edges[:, 1], edges[:, 0]) % (np.pi / 2)
    c, s = np.cos(angles)[:, None], np.sin(angles)[:, None]
    x, y = ring[:, 0], ring[:, 1]
    areas = np.ptp(c * x + s * y, axis=1) * np.ptp(c * y - s * x, axis=1)
    return float(angles[int(np.argmin(areas))])


def canonical(R: Float[np.ndarray, "3 3"], *, upright: bool = False) -> Float[np.ndarray, "3 3"]:
    """The same three axes in another order and direction, right-handed, nearest to the world's; upright: only turned
    about z."""
    best, nearest = R, -np.inf
    for turned in _TURNS:
        axes = R @ turned
        trace = round(float(np.trace(axes)), 9)
        if trace > nearest and (not upright or turned[2, 2] == 1):
            best, nearest = axes, trace
    return best


def _turns() -> list[Float[np.ndarray, "3 3"]]:
    """The 24 rotations of a cube."""
    found: list[np.ndarray] = []
    for order in ((0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (1, 0, 2), (2, 1, 0)):
        for signs in np.ndindex(2, 2, 2):
            turn = np.eye(3)[:, order] * (1.0 - 2.0 * np.array(signs))
            if np.linalg.det(turn) > 0:
                found.append(turn)
    return found


_TURNS = _turns()


def _smallest_box_rotation(points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "3 3"]:
    """Each face of the convex hull as a side of the box, with the smallest rectangle round what is seen along its
    normal; then turned about each axis in turn as long as the box gets smaller."""
    # SciPy takes half a second to load, which commands that never ask for this box need not wait for.
    from scipy.spatial import ConvexHull

    shape = ConvexHull(points)
    corners = points[np.sort(shape.vertices)]
    normals = np.unique(np.round(shape.equations[:, :3], 9) + 0.0, axis=0)
    normals = normals[(normals[:, 2] > 0) | ((normals[:, 2] == 0) & (normals[:, 0] >= 0))]
    best, smallest = np.eye(3), float(np.prod(np.ptp(corners, axis=0)))
    for normal in normals:
        R = _turned_in_plane(corners, _frame_with_z(normal))
        volume = _volume(corners, R)
        if volume < smallest * (1 - 1e-9):
            best, smallest = R, volume
    for _ in range(20):
        before = smallest
        for turn in _TURNS[0], _TURNS[4], _TURNS[8]:
            R = _turned_in_plane(corners, best @ turn)
            volume = _volume(corners, R)
            if volume < smallest * (1 - 1e-9):
                best, smallest = R, volume
        if smallest == before:
            break
    return best


def _turned_in_plane(points: Float[np.ndarray, "n 3"], R: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "3 3"]:
    return R @ rotation_about_z(smallest_rectangle_angle((points @ R)[:, :2]))


def _frame_with_z(z: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    z = z / np.linalg.norm(z)
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def _volume(points: Float[np.ndarray, "n 3"], R: Float[np.ndarray, "3 3"]) -> float:
    return float(np.prod(np.ptp(points @ R, axis=0)))
