"""Which corners of a box lie on its silhouette, by where the camera is among the slabs of its three axes."""

from itertools import product

import numpy as np
from jaxtyping import Int


def silhouette_rings() -> Int[np.ndarray, "27 7"]:
    """For each of the 27 regions: how many corners the silhouette has (0, 4 or 6), and which, in order.

    Region 9 a + 3 b + c, each digit 0 below, 1 within and 2 above the box's slab of x, y and z. Corners are numbered
    as in box.CORNER_SIGNS; a ring runs counter-clockwise as the camera sees it; unused places hold -1.
    """
    rings = np.full((27, 7), -1, dtype=np.int64)
    for region, place in enumerate(product(range(3), repeat=3)):
        seen = [_face(axis, side) for axis, side in enumerate(place) if side != 1]
        edges = {(face[i - 1], face[i]) for face in seen for i in range(4)}
        # An edge between two faces that are both seen is run along in both directions, and is not on the silhouette.
        follows = {a: b for a, b in edges if (b, a) not in edges}
        ring = list(follows)[:1]
        while len(ring) < len(follows):
            ring.append(follows[ring[-1]])
        rings[region, : len(ring) + 1] = [len(ring), *ring]
    return rings


def _face(axis: int, side: int) -> list[int]:
    """The four corners of a box's face, counter-clockwise as seen from outside; `side` is 0 below and 2 above."""
    first, second = 4 >> (axis + 1) % 3, 4 >> (axis + 2) % 3
    across = [0, first, first | second, second]
    face = [corner | (4 >> axis if side == 2 else 0) for corner in across]
    return face if side == 2 else face[::-1]
