"""The rings that run along the edges of a mask's pixels, and the smoother ones that they stand for."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int


def pixel_outlines(mask: Bool[np.ndarray, "h w"]) -> list[Float[np.ndarray, "_ 2"]]:
    """The rings (k, 2) between a mask's inside and outside, image coordinates; their corners only.

    A lattice point is a corner where one or three of the four pixels round it are inside; it is two where two
    diagonal ones are. Along each row of the lattice the corners are joined in pairs, and along each column: every
    corner has one neighbour on either line, and following them in turns gives the rings.
    """
    padded = np.pad(np.asarray(mask, dtype=bool), 1)
    a, b, c, d = padded[:-1, :-1], padded[:-1, 1:], padded[1:, :-1], padded[1:, 1:]
    odd, diagonal = a ^ b ^ c ^ d, (a == d) & (b == c) & (a != b)
    y, x = np.nonzero(odd | diagonal)
    twice = np.repeat(np.arange(len(x)), np.where(diagonal[y, x], 2, 1))
    x, y = x[twice], y[twice]
    along_row, along_column = _partners(np.lexsort((x, y))), _partners(np.lexsort((y, x)))
    corners, rings = np.column_stack([x, y]).astype(np.float64), list[np.ndarray]()
    row_partner, column_partner, left = along_row.tolist(), along_column.tolist(), [True] * len(x)
    for start in range(len(x)):
        if not left[start]:
            continue
        ring, corner = list[int](), start
        while left[corner]:
            across = row_partner[corner]
            left[corner] = left[across] = False
            ring += [corner, across]
            corner = column_partner[across]
        rings.append(corners[ring])
    return rings


def _partners(order: Int[np.ndarray, "n"]) -> Int[np.ndarray, "n"]:
    """With whom each of n is paired, when the first in `order` goes with the second, the third with the fourth."""
    partners = np.empty_like(order)
    partners[order[0::2]], partners[order[1::2]] = order[1::2], order[0::2]
    return partners


def even_outlines(rings: Sequence[Float[np.ndarray, "_ 2"]]) -> list[Float[np.ndarray, "_ 2"]]:
    """Rings of pixels' edges with every step of one pixel replaced by its middle, so that stairs become the line that
    they stand for; corners of longer edges, and ends that are one pixel wide, stay."""
    return [_even(ring) for ring in rings]


def _even(ring: Float[np.ndarray, "k 2"]) -> Float[np.ndarray, "m 2"]:
    after = np.roll(ring, -1, axis=0) - ring
    before = np.roll(after, 1, axis=0)
    turn = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    step = (np.abs(after).sum(axis=1) == 1) & (np.sign(turn) != np.sign(np.roll(turn, -1)))
    dropped = step | np.roll(step, 1)
    # Each corner is followed by the middle of the edge after it.
    points = np.stack([ring, ring + after / 2], axis=1)
    kept = points[np.stack([~dropped, step], axis=1)]
    return kept if len(kept) >= 3 else ring
