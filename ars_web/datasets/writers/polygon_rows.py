"""Rows `class x1 y1 x2 y2 ...` of a ring a label, as shares of the image: turned boxes and outlines of YOLO."""

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from numba import njit

from ars_web.datasets.samples import LabelTable, Outlines
from ars_web.datasets.writers.digits import Buffer, put_decimal, put_integer, scaled
from ars_web.geometry.rings import Rings

_CLASS_BYTES = 21
"""A class id of 19 digits, a sign, and the line's end."""

_POINT_BYTES = 2 * 18
"""Twice a space, a sign, nine digits, a point and six decimals: a turned box of an image of a single row of pixels
may leave it by many of its heights."""


def polygon_rows(
    table: LabelTable,
    keep: Bool[np.ndarray, "n b"],
    rings: Outlines,
    sizes: Int[np.ndarray, "n 2"],
    class_of_box: Int[np.ndarray, "b"],
    *,
    within: bool,
) -> tuple[UInt8[np.ndarray, "size"], Int[np.ndarray, "k"]]:
    """The text of all frames' label files in one buffer, and (n + 1,) where each begins.

    Shares are rounded to millionths, halves up, and put within [0, 1] where `within` says so. A label without a ring
    of three points has its box for one.
    """
    kept = int(keep.sum())
    buffer = np.empty(kept * _CLASS_BYTES + (kept * 4 + len(rings.points)) * _POINT_BYTES, dtype=np.uint8)
    starts = np.zeros(len(keep) + 1, dtype=np.int64)
    end = _rows(
        table.bbox,
        keep,
        rings.points,
        rings.starts,
        sizes.astype(np.int64),
        class_of_box.astype(np.int64),
        within,
        buffer,
        starts,
    )
    return buffer[:end], starts


def first_rings(rings: Rings) -> Outlines:
    """The first ring of each label, of rings of which a label has one at most."""
    starts = rings.ring_starts[rings.label_starts]
    return Outlines(rings.points, starts)


@njit(cache=True)
def _rows(
    bbox: Float[np.ndarray, "n b 4"],
    keep: Bool[np.ndarray, "n b"],
    points: Float[np.ndarray, "m 2"],
    ring_starts: Int[np.ndarray, "k"],
    sizes: Int[np.ndarray, "n 2"],
    class_of_box: Int[np.ndarray, "b"],
    within: bool,
    buffer: Buffer,
    starts: Int[np.ndarray, "k"],
) -> int:
    place = 0
    corners = np.empty((4, 2))
    for frame in range(keep.shape[0]):
        starts[frame] = place
        width, height = sizes[frame, 0], sizes[frame, 1]
        for box in range(keep.shape[1]):
            if not keep[frame, box]:
                continue
            place = put_integer(buffer, place, class_of_box[box])
            label = frame * keep.shape[1] + box
            ring = points[ring_starts[label] : ring_starts[label + 1]]
            if len(ring) < 3:
                x0, y0, x1, y1 = bbox[frame, box]
                corners[0, 0], corners[0, 1] = x0, y0
                corners[1, 0], corners[1, 1] = x0, y1
                corners[2, 0], corners[2, 1] = x1, y1
                corners[3, 0], corners[3, 1] = x1, y0
                ring = corners
            for i in range(len(ring)):
                for value in (ring[i, 0] / width, ring[i, 1] / height):
                    millionths = scaled(value, 1e6)
                    if within:
                        millionths = min(max(millionths, 0), 1_000_000)
                    buffer[place] = 32
                    place = put_decimal(buffer, place + 1, millionths, 6)
            buffer[place] = 10
            place += 1
    starts[keep.shape[0]] = place
    return place
