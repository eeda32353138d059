"""Flat objects: a polygon in space as a mesh that is seen from both sides."""

import numpy as np
import shapely
from jaxtyping import Float
from manifold3d import triangulate

from ars_web.errors import BadInput
from ars_web.geometry.box import FARTHEST
from ars_web.geometry.mesh import Mesh
from ars_web.geometry.two_sided import two_sided

FLATNESS = 1e-3
"""Metres that corners may be off their plane unless a caller says otherwise."""

THINNEST = 1e-9
"""Of the area of the square over its longest extent: a polygon of less has none."""


def flat_mesh(corners_world: Float[np.ndarray, "k 3"], *, tolerance: float = FLATNESS) -> Mesh:
    """The two-sided mesh of a polygon with the corners (k, 3), in order either way round.

    The plane is the one of least squares, and the corners are moved onto it; `tolerance` is how far that may be, in
    metres. The mesh has these k vertices, in the same order.

    Raises:
        BadInput: there are fewer than three corners; one is not finite, beyond FARTHEST or where the next one is; they
            do not lie in a plane; the polygon crosses or touches itself, or has no area.
    """
    corners = np.array(corners_world, dtype=np.float64)
    if corners.ndim != 2 or corners.shape[1] != 3 or len(corners) < 3:
        raise BadInput(f"a flat polygon needs at least three corners (k, 3), not shape {list(corners.shape)}")
    wrong = corners[~(np.abs(corners) <= FARTHEST).all(axis=1)]
    if len(wrong):
        raise BadInput(
            f"a polygon's corners must be finite and within {FARTHEST:g} m of the world's origin: {wrong[0]}"
        )
    same = np.flatnonzero((corners == np.roll(corners, -1, axis=0)).all(axis=1))
    if len(same):
        following = (int(same[0]) + 1) % len(corners)
        raise BadInput(f"corners {same[0]} and {following} of a polygon are one point: leave one of them out")
    centre = corners.mean(axis=0)
    _, _, axes = np.linalg.svd(corners - centre, full_matrices=True)
    off = np.abs((corners - centre) @ axes[2])
    if off.max() > tolerance:
        raise BadInput(
            f"a flat polygon's corners must lie in one plane to {tolerance:g} m: corner {off.argmax()} is"
            f" {off.max():.4g} m off the plane that fits them best"
        )
    flat = (corners - centre) @ axes[:2].T
    _check_polygon(flat)
    order = np.arange(len(flat))
    if not shapely.LinearRing(flat).is_ccw:
        order = order[::-1]
    # Of about the size 1: what is triangulated is rounded to a share of its size.
    faces = order[np.asarray(triangulate([flat[order] / np.abs(flat).max()]), dtype=np.int64)]
    return two_sided(centre + flat @ axes[:2], faces)


def _check_polygon(flat: Float[np.ndarray, "k 2"]) -> None:
    polygon = shapely.Polygon(flat)
    extent = float(np.ptp(flat, axis=0).max())
    if polygon.convex_hull.area <= THINNEST * extent**2:
        raise BadInput(f"a flat polygon must have an area, but its {len(flat)} corners lie in a row")
    if not polygon.is_valid:
        # Where, in the plane's own coordinates, says nothing to anyone.
        reason = shapely.is_valid_reason(polygon).split("[")[0].strip().lower()
        raise BadInput(
            f"a flat polygon must not cross or touch itself; this one of {len(flat)} corners does ({reason})"
        )
