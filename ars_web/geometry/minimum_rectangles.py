"""The smallest rectangles, turned any way, round convex outlines in images."""

import numpy as np
from jaxtyping import Float, Int

from ars_web.geometry import rectangle_kernels
from ars_web.geometry.frame_blocks import over_blocks

BLOCK = 16_384
"""Rings that are worked on at once."""


def minimum_rectangles(points: Float[np.ndarray, "m 2"], offsets: Int[np.ndarray, "r"]) -> Float[np.ndarray, "k 4 2"]:
    """The rectangle of the least area round each of k convex rings, as `convex_outlines` returns them: ring i is
    `points[offsets[i] : offsets[i + 1]]`, counter-clockwise as seen in the image (y down).

    Corners run clockwise as seen, from the top left one: that with the least x + y, of two the upper one. That is the
    order of the DOTA data set's annotations (captain-whu.github.io/DOTA/dataset.html). YOLO's oriented boxes have their
    form, and its documentation asks for no order. A ring that is a line or a point has a rectangle of no area, an
    empty one NaN.
    """
    rectangles = np.full((len(offsets) - 1, 4, 2), np.nan)
    points, offsets = np.array(points, dtype=np.float64, order="C"), np.array(offsets, dtype=np.int64)

    def turn(rings: slice) -> None:
        some = offsets[rings.start : rings.stop + 1]
        rectangle_kernels.rectangles_of_rings(points[some[0] : some[-1]], some - some[0], rectangles[rings])

    over_blocks(turn, len(rectangles), block=BLOCK)
    return rectangles
