"""The box round a hull: along the world's axes, upright, or the smallest of all."""

from typing import Literal

import numpy as np
import shapely
from jaxtyping import Bool, Float
from manifold3d import Manifold

from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.rigid_transform import rotation_about_z
from ars_web.geometry.visual_hull import VisualHull

LONGEST_EDGES = 24
"""Of the convex hull, of which each pair is tried as two sides of the smallest box."""

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

_UP = np.array([[0.0, 0.0, 1.0]])

_AXES_FIRST = [np.eye(3)[:, order] for order in ((0, 1, 2), (1, 2, 0), (2, 0, 1))]
"""Turns after which z is what z, x and y were."""


def _smallest_box_rotation(points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "3 3"]:
    """The axes of the smallest box that is found with a side along a face of the convex hull, along two of its longest
    edges, or level, and then by turning it about each axis in turn as long as it gets smaller: no upright box is.

    (Every smallest box has two sides that meet and hold an edge each: O'Rourke 1985, who tries all pairs of edges.)
    A box with a side of a given normal is no smaller than the height along it times the area of what is seen along it,
    which by Cauchy is half the sum of all faces' areas as seen along it: what cannot do better is not tried.
    """
    corners, normals, areas, edges = _convex_hull(points)
    best, smallest = np.eye(3), _volume(corners, np.eye(3))
    along = _distinct(np.concatenate([normals, _normals_of_pairs(edges), _UP]))
    heights = np.ptp(corners @ along.T, axis=0)
    bounds = heights * (np.abs(along @ normals.T) @ areas) / 2
    for i in np.argsort(bounds, kind="stable"):
        if bounds[i] > smallest:
            break
        best, smallest = _smaller(corners, _frame_with_z(along[i]), best, smallest)
    while True:
        before = smallest
        for turn in _AXES_FIRST:
            best, smallest = _smaller(corners, best @ turn, best, smallest)
        if smallest >= before * (1 - 1e-6):
            return best


def _smaller(
    corners: Float[np.ndarray, "n 3"],
    R: Float[np.ndarray, "3 3"],
    best: Float[np.ndarray, "3 3"],
    smallest: float,
) -> tuple[Float[np.ndarray, "3 3"], float]:
    """The better of the best box yet, and of the smallest with the z axis of R."""
    turned = R @ rotation_about_z(smallest_rectangle_angle((corners @ R)[:, :2]))
    volume = _volume(corners, turned)
    # By more than rounding, so that equally good boxes are told apart by their order, and that by the faces'.
    return (turned, volume) if volume < smallest * (1 - 1e-9) else (best, smallest)


def _convex_hull(
    points: Float[np.ndarray, "n 3"],
) -> tuple[Float[np.ndarray, "k 3"], Float[np.ndarray, "f 3"], Float[np.ndarray, "f"], Float[np.ndarray, "e 3"]]:
    """Corners of the convex hull in a stated order, its faces' normals and areas, and its edges; of points in a plane,
    all points and that plane."""
    middle = points.mean(axis=0)
    mesh = Manifold.hull_points(points - middle).to_mesh64()
    corners, faces = np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts).astype(np.int64)
    if len(faces) == 0:
        normal = np.linalg.svd(points - middle)[2][-1:]
        return points, normal, np.zeros(1), np.zeros((0, 3))
    a, b, c = np.moveaxis(corners[faces], 1, 0)
    normals = np.cross(b - a, c - a)
    doubled = np.linalg.norm(normals, axis=1)
    real = doubled > 1e-12 * doubled.max()
    edges = np.concatenate([b - a, c - b, a - c])
    return np.unique(corners + middle, axis=0), normals[real] / doubled[real, None], doubled[real] / 2, edges


def _normals_of_pairs(edges: Float[np.ndarray, "e 3"]) -> Float[np.ndarray, "n 3"]:
    """The directions at right angles to two of the longest edges each."""
    lengths = np.linalg.norm(edges, axis=1)
    some = np.argsort(-lengths, kind="stable")[: 6 * LONGEST_EDGES]
    directions = _distinct(edges[some] / lengths[some, None])[:LONGEST_EDGES]
    i, j = np.triu_indices(len(directions), 1)
    normals = np.cross(directions[i], directions[j])
    lengths = np.linalg.norm(normals, axis=1)
    return normals[lengths > 1e-3] / lengths[lengths > 1e-3, None]


def _distinct(directions: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "m 3"]:
    """Directions of unit length, one of every two opposite ones, in the order of their coordinates."""
    one_way = np.where(_points_down(np.round(directions, 9))[:, None], -directions, directions)
    return one_way[np.unique(np.round(one_way, 9) + 0.0, axis=0, return_index=True)[1]]


def _points_down(directions: Float[np.ndarray, "n 3"]) -> Bool[np.ndarray, "n"]:
    """Whether the last coordinate that is not zero is negative: one of every two opposite directions."""
    x, y, z = directions.T
    return (z < 0) | ((z == 0) & ((y < 0) | ((y == 0) & (x < 0))))


def _frame_with_z(z: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    z = z / np.linalg.norm(z)
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def _volume(points: Float[np.ndarray, "n 3"], R: Float[np.ndarray, "3 3"]) -> float:
    return float(np.prod(np.ptp(points @ R, axis=0)))
