"""Masks as regions of the plane: from outlines and from pixels, and back; what is inside is told by even-odd.

All in image coordinates: a mask's pixel in column i and row j covers (i, j) to (i + 1, j + 1).
"""

from collections.abc import Iterable, Sequence
from typing import Literal

import numpy as np
import shapely
from jaxtyping import Bool, Float
from manifold3d import CrossSection, FillRule

from ars_web.errors import BadInput
from ars_web.geometry.mask_outlines import even_outlines, pixel_outlines
from ars_web.geometry.polygon import Polygon

Operation = Literal["add", "subtract"]

ROUND_SEGMENTS = 8
"""Of a quarter circle, where a stroke begins, turns and ends."""

MOST_CROSSINGS = 2000
"""Of an outline with itself."""

SMALLEST_AREA = 1e-6
"""Square pixels. What is smaller is a rounding error of the arithmetic on rings."""


def region(polygons: Iterable[Polygon]) -> shapely.MultiPolygon:
    """What lies inside an odd number of all the polygons' rings; valid, whatever crosses whatever.

    Raises:
        BadInput: the rings cross themselves and each other more than MOST_CROSSINGS times.
    """
    rings = [ring for polygon in polygons for ring in polygon.rings]
    if len(rings) == 1:
        # What people draw, as a rule: nothing to work out.
        simple = shapely.Polygon(rings[0])
        if simple.is_valid:
            return shapely.MultiPolygon([simple])
    elif not rings:
        return shapely.MultiPolygon()
    _refuse_tangles(rings)
    return _of_rings(rings)


def _refuse_tangles(rings: Sequence[Float[np.ndarray, "_ 2"]]) -> None:
    """Clipper takes a minute over the pieces of a tangle of a thousand edges, or ends the process."""
    edges = [np.stack([ring, np.roll(ring, -1, axis=0)], axis=1) for ring in rings]
    lines = np.asarray(shapely.linestrings(np.concatenate(edges)))
    tree = shapely.STRtree(lines)
    crossings = 0
    for start in range(0, len(lines), 16):
        # Each is found from both its edges.
        crossings += tree.query(lines[start : start + 16], predicate="crosses").shape[1] / 2
        if crossings > MOST_CROSSINGS:
            raise BadInput(f"the outline crosses itself more than {MOST_CROSSINGS} times; draw it again")


def multipolygon(geometry: shapely.Geometry) -> shapely.MultiPolygon:
    """The areas of any valid geometry; lines and points that an operation left between them are dropped."""
    parts = shapely.get_parts(shapely.get_parts(geometry))
    return shapely.MultiPolygon([p for p in parts if isinstance(p, shapely.Polygon) and p.area > SMALLEST_AREA])


def _of_rings(rings: Sequence[Float[np.ndarray, "_ 2"]]) -> shapely.MultiPolygon:
    # Clipper counts windings of rings that cross themselves and each other, which GEOS takes as an error.
    pieces = CrossSection([np.ascontiguousarray(ring) for ring in rings], FillRule.EvenOdd).decompose()
    areas: list[shapely.Geometry] = []
    for outer, *holes in (piece.to_polygons() for piece in pieces if not piece.is_empty()):
        areas.append(shapely.make_valid(shapely.Polygon(outer, holes)))
    return multipolygon(shapely.GeometryCollection(areas) if len(areas) < 2 else shapely.union_all(areas))


def polygons_of(region: shapely.Geometry, *, tolerance: float = 0.0) -> tuple[Polygon, ...]:
    """A region's pieces as polygons with holes, the biggest first, simplified to `tolerance` pixels."""
    simple = shapely.simplify(region, tolerance) if tolerance > 0 else region
    pieces = sorted(multipolygon(simple).geoms, key=lambda piece: (-piece.area, piece.bounds))
    return tuple(
        Polygon(
            shapely.get_coordinates(piece.exterior)[:-1],
            tuple(shapely.get_coordinates(hole)[:-1] for hole in piece.interiors),
        )
        for piece in pieces
    )


def polygons_from_mask(mask: Bool[np.ndarray, "h w"], *, tolerance: float = 0.5) -> tuple[Polygon, ...]:
    """The outlines of a mask's pieces, the biggest first; holes are kept.

    A mask of the pixels [x0, x1) x [y0, y1) gives the rectangle from (x0, y0) to (x1, y1). With a tolerance above zero
    a border's steps of one pixel become the slanted line that they stand for, which is then simplified to
    `tolerance` pixels; with zero the outlines run along the pixels' edges. Pixels that touch at a corner only belong
    to two pieces.
    """
    rings = pixel_outlines(mask)
    if tolerance > 0:
        rings = even_outlines(rings)
    return polygons_of(_of_rings(rings), tolerance=tolerance)


def mask_from_polygons(polygons: Iterable[Polygon], width: int, height: int) -> Bool[np.ndarray, "h w"]:
    """The pixels (height, width) whose centres lie inside an odd number of all the polygons' rings.

    Each edge is met by the rows' centre lines; right of such a place, a row is turned inside out.
    """
    inside = np.zeros((height, width), dtype=bool)
    rows, columns = list[np.ndarray](), list[np.ndarray]()
    for ring in (ring for polygon in polygons for ring in polygon.rings):
        a, b = ring, np.roll(ring, -1, axis=0)
        low, high = np.minimum(a[:, 1], b[:, 1]), np.maximum(a[:, 1], b[:, 1])
        # Rows whose centre y + 0.5 is in [low, high): half open, so that a corner is met once.
        first = np.clip(np.ceil(low - 0.5), 0, height).astype(np.int64)
        count = np.clip(np.ceil(high - 0.5), 0, height).astype(np.int64) - first
        edge = np.repeat(np.arange(len(a)), count)
        row = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count) + first[edge]
        along = (row + 0.5 - a[edge, 1]) / (b[edge, 1] - a[edge, 1])
        x = a[edge, 0] + along * (b[edge, 0] - a[edge, 0])
        rows.append(row)
        columns.append(np.clip(np.ceil(x - 0.5), 0, width).astype(np.int64))
    row, column = np.concatenate([np.zeros(0, np.int64), *rows]), np.concatenate([np.zeros(0, np.int64), *columns])
    if len(row) == 0:
        return inside
    (top, bottom), (left, right) = (row.min(), row.max() + 1), (column.min(), column.max())
    shape = (int(bottom - top), int(right - left + 1))
    met = np.bincount((row - top) * shape[1] + column - left, minlength=shape[0] * shape[1]).reshape(shape)
    inside[top:bottom, left:right] = np.logical_xor.accumulate(met % 2 == 1, axis=1)[:, :-1]
    return inside


def iou(first: Iterable[Polygon], second: Iterable[Polygon]) -> float:
    """The area that two masks share over the area of both together; 0 where both are empty."""
    a, b = region(first), region(second)
    shared = a.intersection(b).area
    union = a.area + b.area - shared
    return float(shared / union) if union > 0 else 0.0


def combined(polygons: Iterable[Polygon], shape: Iterable[Polygon], operation: Operation) -> tuple[Polygon, ...]:
    """A mask with a shape added to it or taken off it: what a brush, an eraser, a lasso or a hole does."""
    mask, change = region(polygons), region(shape)
    return polygons_of(mask.union(change) if operation == "add" else mask.difference(change))


def stroke(points: Float[np.ndarray, "k 2"], width: float) -> tuple[Polygon, ...]:
    """What a round brush of `width` pixels covers on its way through points (k, 2), k >= 1; one point gives a disc.

    Raises:
        BadInput: no point, one that is not finite, or a width that is not a positive number.
    """
    path = np.asarray(points, dtype=np.float64)
    if path.ndim != 2 or path.shape[1:] != (2,) or len(path) == 0 or not np.isfinite(path).all():
        raise BadInput(f"a stroke needs points of two finite coordinates, one at least, not {path.tolist()}")
    if not (np.isfinite(width) and width > 0):
        raise BadInput(f"a brush's width must be a positive number of pixels, not {width}")
    line = shapely.LineString(path) if len(path) > 1 else shapely.Point(path[0])
    return polygons_of(line.buffer(width / 2, quad_segs=ROUND_SEGMENTS))
