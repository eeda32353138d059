"""Planar polygons in space as meshes that are seen from both sides."""

import numpy as np
import shapely
from jaxtyping import Float, Int

from ars_web.errors import BadInput

FLATNESS = 0.01
"""How far corners may be off their plane, as a share of the polygon's extent. They are then moved into it."""

SMALLEST = 1e-4
"""Metres, of its extent."""

MOST_CORNERS = 10_000


def polygon_mesh(corners: Float[np.ndarray, "k 3"]) -> tuple[Float[np.ndarray, "k 3"], Int[np.ndarray, "f 3"]]:
    """(k, 3) corners, moved into the plane nearest to all of them, and the (f, 3) triangles of both sides.

    The corners are given in order round the polygon, which need not be convex.

    Raises:
        BadInput: they are fewer than three or not finite, span no area, do not lie in a plane, or the outline crosses
            itself.
    """
    points = np.asarray(corners, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3 or not 3 <= len(points) <= MOST_CORNERS:
        raise BadInput(f"a polygon needs 3 to {MOST_CORNERS} corners of three numbers, not shape {list(points.shape)}")
    if not np.isfinite(points).all():
        raise BadInput("a polygon's corners must be finite")
    centre = points.mean(axis=0)
    # The plane of the least sum of squared distances: its normal is the last right singular vector.
    _, _, axes = np.linalg.svd(points - centre)
    flat = (points - centre) @ axes.T
    extent = float(np.ptp(flat, axis=0)[0])
    if extent < SMALLEST or np.ptp(flat[:, 1]) < 1e-6 * extent:
        raise BadInput("the polygon's corners lie in one point or on one line; they must span an area")
    off = float(np.abs(flat[:, 2]).max())
    if off > FLATNESS * extent:
        raise BadInput(
            f"the polygon is not flat: a corner is {1000 * off:.3g} mm off the plane of the others; a surface that is"
            " not flat is a mesh"
        )
    ring = shapely.Polygon(flat[:, :2])
    if not ring.is_valid:
        raise BadInput(
            f"the polygon cannot be used: {shapely.is_valid_reason(ring)}; its outline must not cross itself"
        )
    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(ring))
    places = {tuple(place): i for i, place in enumerate(flat[:, :2].tolist())}
    front = np.array(
        [[places[tuple(corner)] for corner in shapely.get_coordinates(one)[:3].tolist()] for one in triangles]
    )
    in_plane = centre + flat[:, :2] @ axes[:2]
    return in_plane, np.concatenate([front, front[:, ::-1]])
