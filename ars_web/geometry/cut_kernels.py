"""The compiled loop that cuts rings to the image.

Kernels call only kernels of their own file: numba's cache notices a change only in the file of the function that it
keeps.
"""

import numpy as np
from numba import njit

Array = np.ndarray


@njit(error_model="numpy")
def cut_to_image(width: float, height: float, ring: Array, m: int, spare: Array) -> int:
    """Cut a ring to the image in place (Sutherland and Hodgman); how many points are left, 0 for none.

    Where the lens bends the ring out of the image and back in, its parts stay joined along the image's border.
    """
    source, target = ring, spare
    for side in range(4):
        axis, sign = side % 2, 1.0 if side < 2 else -1.0
        border = 0.0 if side < 2 else (width if axis == 0 else height)
        k = 0
        for i in range(m):
            j = i + 1 if i + 1 < m else 0
            a, b = sign * (source[i, axis] - border), sign * (source[j, axis] - border)
            if a >= 0.0:
                target[k, 0], target[k, 1] = source[i, 0], source[i, 1]
                k += 1
            if (a >= 0.0) != (b >= 0.0):
                target[k, axis] = border
                target[k, 1 - axis] = source[i, 1 - axis] + a / (a - b) * (source[j, 1 - axis] - source[i, 1 - axis])
                k += 1
        m = k
        source, target = target, source
    return without_spikes(width, height, ring, m)


@njit(error_model="numpy")
def without_spikes(width: float, height: float, ring: Array, m: int) -> int:
    """Take out of a ring, in place, repeated points and those between two others on one of the image's borders."""
    k = 0
    for i in range(m):
        while k >= 2 and spare_point(width, height, ring[k - 2], ring[k - 1], ring[i]):
            k -= 1
        if k == 0 or ring[k - 1, 0] != ring[i, 0] or ring[k - 1, 1] != ring[i, 1]:
            ring[k, 0], ring[k, 1] = ring[i, 0], ring[i, 1]
            k += 1
    first = 0
    while k - first >= 3:
        if spare_point(width, height, ring[k - 2], ring[k - 1], ring[first]):
            k -= 1
        elif spare_point(width, height, ring[k - 1], ring[first], ring[first + 1]):
            first += 1
        else:
            break
    for i in range(first, k):
        ring[i - first, 0], ring[i - first, 1] = ring[i, 0], ring[i, 1]
    return k - first if k - first >= 3 else 0


@njit(error_model="numpy")
def spare_point(width: float, height: float, a: Array, b: Array, c: Array) -> bool:
    """Whether b says nothing that a and c do not: all three lie on one border of the image."""
    return (
        (a[0] == 0.0 and b[0] == 0.0 and c[0] == 0.0)
        or (a[1] == 0.0 and b[1] == 0.0 and c[1] == 0.0)
        or (a[0] == width and b[0] == width and c[0] == width)
        or (a[1] == height and b[1] == height and c[1] == height)
    )


@njit(cache=True, nogil=True, error_model="numpy")
def cut_rings(width: float, height: float, points: Array, lengths: Array) -> tuple[Array, Array]:
    """Rings, one after the other in `points` (k, 2), cut to the image: all points left, and how many each has."""
    # Each of the four cuts can leave half as many points again, where a ring zigzags across a border.
    longest = 6 * (lengths.max() if len(lengths) else 0) + 16
    ring, spare = np.empty((longest, 2)), np.empty((longest, 2))
    cut, counts = np.empty((len(points) + 8 * len(lengths), 2)), np.zeros(len(lengths), np.int64)
    start, k = 0, 0
    for i in range(len(lengths)):
        m = lengths[i]
        inside = True
        for j in range(m):
            u, v = points[start + j, 0], points[start + j, 1]
            ring[j, 0], ring[j, 1] = u, v
            inside = inside and 0.0 <= u <= width and 0.0 <= v <= height
        if not inside:
            m = cut_to_image(width, height, ring, m, spare)
        if k + m > len(cut):
            grown = np.empty((2 * len(cut) + m, 2))
            grown[:k] = cut[:k]
            cut = grown
        cut[k : k + m] = ring[:m]
        counts[i] = m
        start += lengths[i]
        k += m
    return cut[:k].copy(), counts
