"""The polygons of a mask as a session keeps them: checked, in thousandths of a pixel, and as JSON."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from ars_web.errors import BadInput
from ars_web.geometry.polygon import Polygon

MOST_CORNERS = 20_000
"""Of one mask, over all its rings."""

MOST_RINGS = 100
"""Of one mask, holes included."""

STEPS = 1000
"""To a pixel. Finer than anyone draws, and few digits in the log."""

FARTHEST = 1e6
"""Pixels. No image is a third as large."""

FLAT = 1e-3
"""Pixels. A ring whose corners are nearer to one line encloses nothing."""


def checked_polygons(polygons: Sequence[Polygon], *, width: int, height: int) -> tuple[Polygon, ...]:
    """`polygons`, rounded to thousandths of a pixel, as the outline of something in an image of that size.

    They may leave the image by its own size on each side, for an object that the border cuts.

    Raises:
        BadInput: they enclose nothing, are beyond MOST_RINGS or MOST_CORNERS, or a corner is too far outside.
    """
    _refuse_too_many(polygons)
    low, high = np.array([-width, -height], dtype=np.float64), np.array([2 * width, 2 * height], dtype=np.float64)
    for polygon in polygons:
        for ring in polygon.rings:
            outside = (ring < low).any(axis=1) | (ring > high).any(axis=1)
            if outside.any():
                x, y = ring[outside][0].tolist()
                raise BadInput(
                    f"an outline's corners must be from -{width} to {2 * width} in x and from -{height} to {2 * height}"
                    f" in y, which is the image of {width} x {height} pixels and its own size around it;"
                    f" ({x:g}, {y:g}) is not"
                )
    rounded = tuple(Polygon(_rounded(p.outer), tuple(_rounded(hole) for hole in p.holes)) for p in polygons)
    if all(_is_flat(polygon.outer) for polygon in rounded):
        raise BadInput("an outline must enclose something: all corners of each of its rings are on one line")
    return rounded


def same_polygons(a: Sequence[Polygon], b: Sequence[Polygon]) -> bool:
    """Whether two outlines are alike, corner by corner."""
    return len(a) == len(b) and all(
        len(p.rings) == len(q.rings) and all(np.array_equal(r, s) for r, s in zip(p.rings, q.rings, strict=True))
        for p, q in zip(a, b, strict=True)
    )


def polygons_json(polygons: Sequence[Polygon]) -> list[dict[str, Any]]:
    """Each as `{"outer": [[x, y], …], "holes": [[[x, y], …], …]}`; every float comes back bit by bit."""
    return [{"outer": p.outer.tolist(), "holes": [hole.tolist() for hole in p.holes]} for p in polygons]


def polygons_from_json(items: Any) -> tuple[Polygon, ...]:
    """The polygons that `polygons_json` wrote.

    Raises:
        BadInput, ValueError, TypeError, KeyError: they are no such polygons, or no outline.
    """
    polygons = tuple(
        Polygon(
            np.array(item["outer"], dtype=np.float64),
            tuple(np.array(hole, dtype=np.float64) for hole in item["holes"]),
        )
        for item in items
    )
    _refuse_too_many(polygons)
    if any((np.abs(ring) > FARTHEST).any() for polygon in polygons for ring in polygon.rings):
        raise BadInput(f"an outline has a corner beyond {FARTHEST:g} pixels")
    return polygons


def corners_of(polygons: Sequence[Polygon]) -> int:
    """How many corners they have, over all rings."""
    return sum(len(ring) for polygon in polygons for ring in polygon.rings)


def _refuse_too_many(polygons: Sequence[Polygon]) -> None:
    if not polygons:
        raise BadInput("an outline needs at least one polygon; delete the mask where there is nothing to outline")
    rings, corners = sum(len(polygon.rings) for polygon in polygons), corners_of(polygons)
    if rings > MOST_RINGS or corners > MOST_CORNERS:
        raise BadInput(
            f"an outline has at most {MOST_RINGS} rings and {MOST_CORNERS} corners in all, not {rings} and {corners};"
            " simplify it, or leave out its smallest pieces"
        )


def _rounded(ring: Float[np.ndarray, "k 2"]) -> Float[np.ndarray, "k 2"]:
    # Minus zero is zero, so that one outline has one form.
    return np.round(ring * STEPS) / STEPS + 0.0


def _is_flat(ring: Float[np.ndarray, "k 2"]) -> bool:
    return bool(np.linalg.svd(ring - ring.mean(axis=0), compute_uv=False)[1] < FLAT)
