"""The compiled loops that find convex hulls in images: of what contours and rings enclose there, and of shadows.

Coordinates are image coordinates; rings run counter-clockwise as seen in the image, y down. A hull begins with its
leftmost corner, the upper one of two.
"""

import numpy as np

from ars_web.geometry.compiled import entry, part

Array = np.ndarray


@part
def in_image(width: float, height: float, u0: float, v0: float, u1: float, v1: float) -> tuple[float, float]:
    """The part (from, to) of a straight piece, in [0, 1], that lies in the image; (1, 0) where none does."""
    low, high = 0.0, 1.0
    for axis in range(2):
        start, along, side = (u0, u1 - u0, width) if axis == 0 else (v0, v1 - v0, height)
        if along == 0.0:
            if not 0.0 <= start <= side:
                return 1.0, 0.0
        else:
            a, b = -start / along, (side - start) / along
            low, high = max(low, min(a, b)), min(high, max(a, b))
    return (low, high) if low <= high else (1.0, 0.0)


@part
def append_side(
    width: float, height: float, u0: float, v0: float, u1: float, v1: float, turns: Array, points: Array, n: int
) -> int:
    """Append the ends of the part of a side that lies in the image to `points` after the first n, without the end of a
    side that is wholly in it, which is another's start. What the side adds to how often its ring runs round each of
    the image's corners is added to `turns` (4,)."""
    # Sides from or to the upper border may count for a corner.
    start_inside = 0.0 <= u0 <= width and 0.0 < v0 <= height
    if start_inside and 0.0 <= u1 <= width and 0.0 < v1 <= height:
        points[n, 0], points[n, 1] = u0, v0
        return n + 1
    for corner in range(4):
        u, v = width * (corner % 2), height * (corner // 2)
        if (v0 > v) != (v1 > v) and u0 + (v - v0) / (v1 - v0) * (u1 - u0) > u:
            turns[corner] += 1 if v0 > v1 else -1
    low, high = in_image(width, height, u0, v0, u1, v1)
    if low <= high:
        for share in (low, high):
            points[n, 0] = min(max(u0 + share * (u1 - u0), 0.0), width)
            points[n, 1] = min(max(v0 + share * (v1 - v0), 0.0), height)
            n += 1
    return n


@part
def append_corners(width: float, height: float, turns: Array, points: Array, n: int) -> int:
    """Append the image's corners that rings run round."""
    for corner in range(4):
        if turns[corner] > 0:
            points[n, 0], points[n, 1] = width * (corner % 2), height * (corner // 2)
            n += 1
    return n


@part
def across(points: Array, a: int, b: int, c: int) -> float:
    """Twice the area of a triangle, positive counter-clockwise as seen."""
    return (points[b, 1] - points[a, 1]) * (points[c, 0] - points[a, 0]) - (points[b, 0] - points[a, 0]) * (
        points[c, 1] - points[a, 1]
    )


@part
def convex_hull(points: Array, n: int, hull: Array) -> int:
    """The hull of the first n points (Andrew's monotone chain) as their numbers, written to `hull`; how many, 0 where
    they make no area."""
    if n < 3:
        return 0
    order = np.argsort(points[:n, 0])
    # Points with the same u by their v.
    for i in range(1, n):
        j, one = i, order[i]
        while j > 0 and points[order[j - 1], 0] == points[one, 0] and points[order[j - 1], 1] > points[one, 1]:
            order[j] = order[j - 1]
            j -= 1
        order[j] = one
    k = 0
    for i in range(n):
        while k >= 2 and across(points, hull[k - 2], hull[k - 1], order[i]) <= 0.0:
            k -= 1
        hull[k] = order[i]
        k += 1
    lower = k + 1
    for i in range(n - 2, -1, -1):
        while k >= lower and across(points, hull[k - 2], hull[k - 1], order[i]) <= 0.0:
            k -= 1
        hull[k] = order[i]
        k += 1
    # The last is the first again.
    return k - 1 if k > 3 else 0


@part
def grown(points: Array, used: int, more: int) -> Array:
    """`points` with room for more after those used."""
    if used + more <= len(points):
        return points
    larger = np.empty((2 * len(points) + more, 2))
    for i in range(used):
        larger[i, 0], larger[i, 1] = points[i, 0], points[i, 1]
    return larger


@part
def append_hull(points: Array, n: int, hull: Array, found: Array, used: int) -> tuple[Array, int]:
    """The hull of the first n points appended to `found`, and how many are used of it then."""
    corners = convex_hull(points, n, hull)
    found = grown(found, used, corners)
    for i in range(corners):
        found[used + i, 0], found[used + i, 1] = points[hull[i], 0], points[hull[i], 1]
    return found, used + corners


@entry
def hulls_of_rings(width: float, height: float, points: Array, lengths: Array) -> tuple[Array, Array]:
    """The hulls of what m rings, one after the other in `points` (k, 2), enclose in the image: all hulls' points, and
    (m,) how many each has."""
    longest = lengths.max() if len(lengths) else 0
    kept, hull, turns = np.empty((2 * longest + 4, 2)), np.empty(2 * longest + 6, np.int64), np.zeros(4, np.int64)
    found, counts = np.empty((len(points) + 4, 2)), np.zeros(len(lengths), np.int64)
    at, used = 0, 0
    for row in range(len(lengths)):
        n, turns[:] = 0, 0
        end = at + lengths[row]
        for i in range(at, end):
            j = i + 1 if i + 1 < end else at
            n = append_side(width, height, points[i, 0], points[i, 1], points[j, 0], points[j, 1], turns, kept, n)
        n = append_corners(width, height, turns, kept, n)
        before = used
        found, used = append_hull(kept, n, hull, found, used)
        counts[row] = used - before
        at = end
    return found[:used].copy(), counts


@entry
def hulls_of_curves(width: float, height: float, points: Array, lengths: Array, counts: Array) -> tuple[Array, Array]:
    """The hulls of what m contours enclose in the image, each of `counts` (m,) curves that together are closed; those
    one after the other in `points` (k, 2), with their `lengths`. Returned as by `hulls_of_rings`."""
    kept, hull, turns = np.empty((64, 2)), np.empty(66, np.int64), np.zeros(4, np.int64)
    found, found_counts = np.empty((len(points) // 2 + 4, 2)), np.zeros(len(counts), np.int64)
    piece, at, used = 0, 0, 0
    for row in range(len(counts)):
        total = 0
        for i in range(piece, piece + counts[row]):
            total += lengths[i]
        if 2 * total + 4 > len(kept):
            kept, hull = np.empty((4 * total + 4, 2)), np.empty(4 * total + 6, np.int64)
        n, turns[:] = 0, 0
        for i in range(piece, piece + counts[row]):
            for j in range(at, at + lengths[i] - 1):
                n = append_side(
                    width,
                    height,
                    points[j, 0],
                    points[j, 1],
                    points[j + 1, 0],
                    points[j + 1, 1],
                    turns,
                    kept,
                    n,
                )
            at += lengths[i]
        piece += counts[row]
        n = append_corners(width, height, turns, kept, n)
        before = used
        found, used = append_hull(kept, n, hull, found, used)
        found_counts[row] = used - before
    return found[:used].copy(), found_counts


@entry
def shadow_hulls(
    Ts_world_camera: Array, vertices: Array, wanted: Array, near: float, rim: float
) -> tuple[Array, Array, Array, Array]:
    """The hulls of all vertices' shadows on the normalised planes of n frames, those that are `wanted` (n,) and where
    all vertices are in front of the near plane and within the rim.

    Returns all hulls' points (k, 2), and of each frame (n,): how many of them are its, 0 for none; the longest side's
    square; and the largest square of a radius.
    """
    # A copy, because threads that count the users of one array stand in each other's way.
    vertices = vertices.copy()
    plane, hull = np.empty((len(vertices), 2)), np.empty(2 * len(vertices) + 6, np.int64)
    frames = len(Ts_world_camera)
    counts, longest, furthest = np.zeros(frames, np.int64), np.zeros(frames), np.zeros(frames)
    found, used = np.empty((32 * frames + len(vertices), 2)), 0
    for frame in range(frames):
        if not wanted[frame]:
            continue
        T = Ts_world_camera[frame]
        cx, cy, cz = T[0, 3], T[1, 3], T[2, 3]
        whole, most = True, 0.0
        for i in range(len(vertices)):
            x, y, z = vertices[i, 0] - cx, vertices[i, 1] - cy, vertices[i, 2] - cz
            depth = T[0, 2] * x + T[1, 2] * y + T[2, 2] * z
            whole = whole and depth >= near
            plane[i, 0] = (T[0, 0] * x + T[1, 0] * y + T[2, 0] * z) / depth
            plane[i, 1] = (T[0, 1] * x + T[1, 1] * y + T[2, 1] * z) / depth
            most = max(most, plane[i, 0] * plane[i, 0] + plane[i, 1] * plane[i, 1])
        if not (whole and most < rim * rim):
            continue
        corners = convex_hull(plane, len(vertices), hull)
        found = grown(found, used, corners)
        for i in range(corners):
            a, b = hull[i], hull[i + 1 if i + 1 < corners else 0]
            found[used + i, 0], found[used + i, 1] = plane[a, 0], plane[a, 1]
            side = (plane[b, 0] - plane[a, 0]) ** 2 + (plane[b, 1] - plane[a, 1]) ** 2
            longest[frame] = max(longest[frame], side)
        counts[frame], furthest[frame] = corners, most
        used += corners
    return found[:used].copy(), counts, longest, furthest
