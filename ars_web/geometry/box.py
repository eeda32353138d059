"""Virtual boxes: corners, edges, overlap, and the box that four points along its edges give.

A box is `T_world_box`, origin at its centre, and `size` (3,) in metres along its own axes.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import ArrayLike

from ars_web.errors import BadInput
from ars_web.geometry import rigid_transform
from ars_web.geometry.rigid_transform import Transform

CORNER_SIGNS: Float[np.ndarray, "8 3"] = np.array(list(product((-1.0, 1.0), repeat=3)))
"""Corner k of a box is at CORNER_SIGNS[k] * size / 2 in its frame; bit 2 of k is x, bit 1 y, bit 0 z."""

EDGES: Int[np.ndarray, "12 2"] = np.array([(i, j) for i in range(8) for j in range(i + 1, 8) if (i ^ j) in (1, 2, 4)])
"""Corner pairs of the twelve edges."""

LARGEST_SIZE = 1e4
"""Metres. A side beyond this is a mistake in the unit, not an object."""

FARTHEST = 1e7
"""Metres from the world's origin along each axis. Beyond this the arithmetic of labels loses its last digits, and far
beyond it overflows."""


@dataclass(frozen=True, eq=False)
class Box:
    """A box in the world.

    Attributes:
        T_world_box: (4, 4), origin at the centre.
        size: (3,) along the box's own axes, metres, each > 0.
    """

    T_world_box: Transform
    size: Float[np.ndarray, "3"]

    def __post_init__(self) -> None:
        """Raises BadInput for a size that is not three positive finite lengths, or a transform that is none or leads
        further than FARTHEST."""
        size = checked_size(self.size)
        T = rigid_transform.checked(self.T_world_box)
        if (np.abs(T[:3, 3]) > FARTHEST).any():
            raise BadInput(f"a box must be within {FARTHEST:g} m of the world's origin, not at {T[:3, 3].tolist()}")
        T.flags.writeable = False
        object.__setattr__(self, "size", size)
        object.__setattr__(self, "T_world_box", T)

    @property
    def corners_world(self) -> Float[np.ndarray, "8 3"]:
        """The eight corners in the world, ordered as CORNER_SIGNS."""
        return rigid_transform.transform_points(self.T_world_box, CORNER_SIGNS * self.size / 2)

    @property
    def volume(self) -> float:
        """Cubic metres."""
        return float(np.prod(self.size))


def checked_size(size: ArrayLike) -> Float[np.ndarray, "3"]:
    """`size` as (3,), which nobody can write to.

    Raises:
        BadInput: it is not three lengths in metres, each > 0 and at most LARGEST_SIZE.
    """
    try:
        checked = np.array(size, dtype=np.float64)
    except (ValueError, TypeError) as error:
        raise BadInput(f"a box's size must be three lengths in metres, not {size!r}") from error
    if checked.shape != (3,) or not (np.isfinite(checked) & (checked > 0) & (checked <= LARGEST_SIZE)).all():
        raise BadInput(
            f"a box's size must be three lengths in metres, each > 0 and at most {LARGEST_SIZE:g},"
            f" not {checked.tolist()}"
        )
    checked.flags.writeable = False
    return checked


def beside(box: Box, *, gap: float = 0.01) -> Box:
    """A box of the same size and orientation next to `box`: along its own x, `gap` metres between the two."""
    T = box.T_world_box.copy()
    T[:3, 3] += T[:3, 0] * (box.size[0] + gap)
    return Box(T, box.size)


def resting_on_ground(box: Box) -> Box:
    """`box` moved along the world's z until its lowest corner is at z = 0; its orientation stays."""
    T = box.T_world_box.copy()
    T[2, 3] -= box.corners_world[:, 2].min()
    return Box(T, box.size)


def stack(boxes: list[Box]) -> tuple[Float[np.ndarray, "b 4 4"], Float[np.ndarray, "b 3"]]:
    """`Ts_world_box` (b, 4, 4) and `sizes` (b, 3) of b boxes, b = 0 included."""
    Ts = np.array([box.T_world_box for box in boxes]).reshape(-1, 4, 4)
    sizes = np.array([box.size for box in boxes]).reshape(-1, 3)
    return Ts, sizes


def iou(a: Box, b: Box) -> float:
    """Volume of the intersection over volume of the union, exact for any two orientations.

    The twelve face half-spaces are intersected (Qhull) round a point found by the linear programme for the
    largest inscribed ball.
    """
    # SciPy takes half a second to load, which commands and workers that never compare boxes need not wait for.
    from scipy.spatial import ConvexHull, HalfspaceIntersection

    halfspaces = np.concatenate([_halfspaces(a), _halfspaces(b)])
    centre, radius = _inscribed_ball(halfspaces)
    if radius <= 1e-9 * float(min(a.size.min(), b.size.min())):
        return 0.0
    corners = HalfspaceIntersection(halfspaces, centre).intersections
    shared = float(ConvexHull(corners).volume)
    return min(shared / (a.volume + b.volume - shared), 1.0)


def _halfspaces(box: Box) -> Float[np.ndarray, "6 4"]:
    """Rows (n, d) with n . p + d <= 0 inside the box, |n| = 1."""
    R, centre = box.T_world_box[:3, :3], box.T_world_box[:3, 3]
    normals = np.concatenate([R.T, -R.T])
    offsets = -normals @ centre - np.tile(box.size / 2, 2)
    return np.column_stack([normals, offsets])


def _inscribed_ball(halfspaces: Float[np.ndarray, "n 4"]) -> tuple[Float[np.ndarray, "3"], float]:
    """Centre and radius of the largest ball within the half-spaces; the radius is -1 where there is none."""
    from scipy.optimize import linprog

    # maximise r subject to n . c + r <= -d: the Chebyshev centre (Boyd and Vandenberghe, 8.5.1)
    A = np.column_stack([halfspaces[:, :3], np.ones(len(halfspaces))])
    found = linprog([0, 0, 0, -1], A_ub=A, b_ub=-halfspaces[:, 3], bounds=[(None, None)] * 3 + [(0, None)])
    return (found.x[:3], float(found.x[3])) if found.success else (np.zeros(3), -1.0)


def from_four_points(points_world: Float[np.ndarray, "4 3"]) -> tuple[Box, float]:
    """The box whose three consecutive edges run through p0, p1, p2, p3, and the residual angle in radians.

    De Gregorio et al., section on the pen: v_z = (p1 - p0)/|p1 - p0|, v_x = (p2 - p1)/|p2 - p1|,
    size = (|p2 - p1|, |p3 - p2|, |p1 - p0|), with a corner at p0. Points drawn by hand are not exactly
    perpendicular: the three edge directions are projected to the nearest rotation, and the residual is the
    largest angle between an edge as drawn and as kept.

    Raises:
        BadInput: a point is not finite or beyond FARTHEST, two consecutive points coincide, or the edges are nearly
            parallel.
    """
    p = np.asarray(points_world, dtype=np.float64)
    if p.shape != (4, 3) or not np.isfinite(p).all():
        raise BadInput(f"four points of three finite coordinates are needed, not {p.tolist()}")
    if (np.abs(p) > FARTHEST).any():
        raise BadInput(f"the points must be within {FARTHEST:g} m of the world's origin: {p.tolist()}")
    edge_z, edge_x, edge_y = p[1] - p[0], p[2] - p[1], p[3] - p[2]
    edges = np.column_stack([edge_x, edge_y, edge_z])
    lengths = np.linalg.norm(edges, axis=0)
    for length, (first, second) in zip(lengths, ((1, 2), (2, 3), (0, 1)), strict=True):
        if length < 1e-6:
            raise BadInput(f"points p{first} and p{second} coincide: the edge between them has no length")
    directions = edges / lengths
    # p3 says on which side y lies; the frame must stay right-handed, so y may be turned round.
    side = 1.0 if np.linalg.det(directions) > 0 else -1.0
    if abs(np.linalg.det(directions)) < 0.1:
        raise BadInput(
            "the edges p0-p1, p1-p2 and p2-p3 are nearly parallel to one plane; they must run along three"
            " edges of the box that are perpendicular to each other"
        )
    R = rigid_transform.nearest_rotation(directions * [1.0, side, 1.0])
    residual = float(np.arccos(np.clip((R * [1.0, side, 1.0] * directions).sum(axis=0), -1.0, 1.0)).max())
    # From the corner at p0 the box extends along +x, along y to p3's side, and along +z.
    centre = p[0] + R @ (np.array([1.0, side, 1.0]) * lengths / 2)
    return Box(rigid_transform.from_rotation(R, centre), lengths), residual
