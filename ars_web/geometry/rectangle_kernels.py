"""The compiled loops that turn calipers round convex rings."""

import math

import numpy as np

from ars_web.geometry.compiled import entry, part

Array = np.ndarray

EVEN = 1e-9
"""Pixels. Corners as near to the top left as this are equally near."""


@part
def further(ring: Array, at: int, x: float, y: float) -> int:
    """The place in a ring, from `at` on, that is the furthest along a direction (x, y)."""
    n = len(ring)
    for _ in range(n):
        following = at + 1 if at + 1 < n else 0
        # Repeated points must not stop it.
        if not (ring[following, 0] - ring[at, 0]) * x + (ring[following, 1] - ring[at, 1]) * y >= 0.0:
            break
        at = following
    return at


@part
def furthest(ring: Array, x: float, y: float) -> int:
    """The place in a ring that is the furthest along a direction (x, y)."""
    at, most = 0, -np.inf
    for i in range(len(ring)):
        reach = ring[i, 0] * x + ring[i, 1] * y
        if reach > most:
            at, most = i, reach
    return at


@part
def minimum_rectangle(ring: Array, rectangle: Array) -> None:
    """The smallest rectangle round a convex ring, as `minimum_rectangles` returns it: one of its sides lies along one
    of the ring's (Freeman and Shapira, 1975), and while that turns round, the points that its other sides touch go
    round with it (Toussaint, 1983)."""
    n, least = len(ring), np.inf
    rectangle[:] = ring[0]
    front, top, back = -1, 0, 0
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        dx, dy = ring[j, 0] - ring[i, 0], ring[j, 1] - ring[i, 1]
        length = math.hypot(dx, dy)
        if not length > 0.0:
            continue
        dx, dy = dx / length, dy / length
        if front < 0:
            front, top, back = furthest(ring, dx, dy), furthest(ring, dy, -dx), furthest(ring, -dx, -dy)
        else:
            front, top, back = further(ring, front, dx, dy), further(ring, top, dy, -dx), further(ring, back, -dx, -dy)
        x, y = ring[i, 0], ring[i, 1]
        high = (ring[front, 0] - x) * dx + (ring[front, 1] - y) * dy
        low = (ring[back, 0] - x) * dx + (ring[back, 1] - y) * dy
        height = (ring[top, 0] - x) * dy - (ring[top, 1] - y) * dx
        area = (high - low) * height
        if area < least:
            least = area
            for corner in range(4):
                along = low if corner < 2 else high
                up = height if corner == 1 or corner == 2 else 0.0
                rectangle[corner, 0] = x + along * dx + up * dy
                rectangle[corner, 1] = y + along * dy - up * dx


@part
def start_top_left(rectangle: Array) -> None:
    """Turn a rectangle's corners on until the first is the one with the least sum of both coordinates, of two the
    upper one."""
    first, turned = 0, np.empty((4, 2))
    for corner in range(1, 4):
        nearer = rectangle[corner, 0] + rectangle[corner, 1] - rectangle[first, 0] - rectangle[first, 1]
        if nearer < -EVEN or (nearer <= EVEN and rectangle[corner, 1] < rectangle[first, 1]):
            first = corner
    for corner in range(4):
        for axis in range(2):
            turned[corner, axis] = rectangle[(first + corner) % 4, axis]
    rectangle[:] = turned


@entry
def rectangles_of_rings(points: Array, offsets: Array, rectangles: Array) -> None:
    """The smallest rectangles round k convex rings, written to `rectangles` (k, 4, 2); those of empty rings stay."""
    for i in range(len(rectangles)):
        if offsets[i] < offsets[i + 1]:
            minimum_rectangle(points[offsets[i] : offsets[i + 1]], rectangles[i])
            start_top_left(rectangles[i])
