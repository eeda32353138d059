"""The compiled loops that label what a contour encloses: where its winding number is positive.

A contour is a set of directed sides in image coordinates that together are closed. It may cross itself and have
several rings. They run counter-clockwise as seen in the image, y down, round what they enclose.
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
def place_in_image(width: float, height: float, u: float, v: float) -> tuple[float, float]:
    """A point of the image without what rounding put beyond its borders."""
    return min(max(u, 0.0), width), min(max(v, 0.0), height)


@part
def start_bbox(bbox: Array) -> None:
    """A box of nothing."""
    bbox[0], bbox[1], bbox[2], bbox[3] = np.inf, np.inf, -np.inf, -np.inf


@part
def grow_bbox(bbox: Array, u: float, v: float) -> None:
    """Make a box hold a point."""
    bbox[0], bbox[1] = min(bbox[0], u), min(bbox[1], v)
    bbox[2], bbox[3] = max(bbox[2], u), max(bbox[3], v)


@part
def gather_sides(points: Array, lengths: Array, piece: int, pieces: int, at: int, sides: Array) -> tuple[int, int]:
    """The sides of some curves, from the point `at` on, written to `sides` as (u0, v0, u1, v1); how many, and where the
    next curve begins."""
    n = 0
    for i in range(piece, piece + pieces):
        for j in range(at, at + lengths[i] - 1):
            sides[n, 0], sides[n, 1] = points[j, 0], points[j, 1]
            sides[n, 2], sides[n, 3] = points[j + 1, 0], points[j + 1, 1]
            n += 1
        at += lengths[i]
    return n, at


@part
def holds(sides: Array, u: float, v: float) -> bool:
    """Whether the sides enclose a point."""
    turns = 0
    for i in range(len(sides)):
        u0, v0, u1, v1 = sides[i, 0], sides[i, 1], sides[i, 2], sides[i, 3]
        if (v0 > v) != (v1 > v) and u0 + (v - v0) / (v1 - v0) * (u1 - u0) > u:
            turns += 1 if v0 > v1 else -1
    return turns > 0


@part
def bbox_in_image(width: float, height: float, margin: float, sides: Array, bbox: Array) -> None:
    """The box, cut to the image, of what of the sides lies in the image widened by a margin, which may be negative."""
    start_bbox(bbox)
    wide, high = width + 2.0 * margin, height + 2.0 * margin
    for i in range(len(sides)):
        u0, v0, u1, v1 = sides[i, 0] + margin, sides[i, 1] + margin, sides[i, 2] + margin, sides[i, 3] + margin
        if (u0 < 0.0 and u1 < 0.0) or (u0 > wide and u1 > wide) or (v0 < 0.0 and v1 < 0.0) or min(v0, v1) > high:
            continue
        if min(u0, u1) >= 0.0 and max(u0, u1) <= wide and min(v0, v1) >= 0.0 and max(v0, v1) <= high:
            grow_bbox(bbox, u0, v0)
            grow_bbox(bbox, u1, v1)
            continue
        start, end = in_image(wide, high, u0, v0, u1, v1)
        if start <= end:
            grow_bbox(bbox, u0 + start * (u1 - u0), v0 + start * (v1 - v0))
            grow_bbox(bbox, u0 + end * (u1 - u0), v0 + end * (v1 - v0))
    for i in range(2):
        bbox[2 * i], bbox[2 * i + 1] = place_in_image(width, height, bbox[2 * i] - margin, bbox[2 * i + 1] - margin)


@part
def is_rough(width: float, height: float, sides: Array, tolerance: float, allowed: float) -> bool:
    """Whether sides that are off by `tolerance` may leave the box of what is in the image off by more than `allowed`:
    a side that meets the image's border at a small angle is cut far from where it should be."""
    least, most = np.empty(4), np.empty(4)
    bbox_in_image(width, height, -tolerance, sides, least)
    bbox_in_image(width, height, tolerance, sides, most)
    for i in range(4):
        if not abs(most[i] - least[i]) <= 2.0 * allowed:
            return True
    return False


@part
def clamped_integral(u: float, width: float) -> float:
    """Integral of min(max(u, 0), width) from 0 to u."""
    return 0.0 if u <= 0.0 else (0.5 * u * u if u <= width else width * (u - 0.5 * width))


@part
def clamped_mean(ua: float, ub: float, width: float) -> float:
    """Mean of min(max(u, 0), width) from one u to another."""
    if abs(ub - ua) < 1e-9:
        return min(max(0.5 * (ua + ub), 0.0), width)
    return (clamped_integral(ub, width) - clamped_integral(ua, width)) / (ub - ua)


@part
def sort_active(keys: Array, active: Array, n: int) -> None:
    """Sort the first n of `active` by their keys; they nearly are."""
    for i in range(1, n):
        j, one = i, active[i]
        while j > 0 and keys[active[j - 1]] > keys[one]:
            active[j] = active[j - 1]
            j -= 1
        active[j] = one


@part
def crossings(active: Array, n: int, top: Array, bottom: Array) -> Array:
    """Where, from 0 at the top of a strip to 1 at its bottom, two of the sides that pass it change places; and 1."""
    found, k = np.empty(n * (n - 1) // 2 + 1), 0
    for i in range(n):
        for j in range(i):
            a, b = top[active[i]] - top[active[j]], bottom[active[i]] - bottom[active[j]]
            if (a < 0.0 and b > 0.0) or (a > 0.0 and b < 0.0):
                found[k] = a / (a - b)
                k += 1
    found[k] = 1.0
    for i in range(1, k):
        j, one = i, found[i]
        while j > 0 and found[j - 1] > one:
            found[j] = found[j - 1]
            j -= 1
        found[j] = one
    return found[: k + 1]


@part
def areas(width: float, height: float, sides: Array) -> tuple[float, float]:
    """The area that the sides enclose, and how much of it lies in the image.

    The plane is cut into strips at all ends of sides and at the image's borders, and where sides cross; within a
    strip all sides are straight and in one order, so that what lies between two of them is a trapezium.
    """
    n = len(sides)
    upper, lower, slopes, turns = np.empty(n), np.empty(n), np.empty(n), np.empty(n, np.int64)
    # Each end of a side is another's start.
    starts = np.empty(n + 2)
    for i in range(n):
        v0, v1 = sides[i, 1], sides[i, 3]
        upper[i], lower[i], turns[i] = min(v0, v1), max(v0, v1), -1 if v0 > v1 else 1
        starts[i] = v0
        # A side along a strip's border is in none.
        slopes[i] = (sides[i, 2] - sides[i, 0]) / (v1 - v0) if v0 != v1 else 0.0
    starts[n], starts[n + 1] = 0.0, height
    levels = starts[np.argsort(starts)]
    order = np.argsort(upper)
    top, bottom, keys = np.empty(n), np.empty(n), np.empty(n)
    active = np.empty(n, np.int64)
    count, following = 0, 0
    whole, inside = 0.0, 0.0
    for level in range(len(levels) - 1):
        va, vb = levels[level], levels[level + 1]
        if not va < vb:
            continue
        left = 0
        for i in range(count):
            if lower[active[i]] > va:
                active[left] = active[i]
                left += 1
        count = left
        while following < n and upper[order[following]] <= va:
            if lower[order[following]] > va:
                active[count] = order[following]
                count += 1
            following += 1
        if count == 0:
            continue
        for i in range(count):
            side = active[i]
            u0, v0, slope = sides[side, 0], sides[side, 1], slopes[side]
            top[side], bottom[side] = u0 + (va - v0) * slope, u0 + (vb - v0) * slope
            keys[side] = top[side] + bottom[side]
        sort_active(keys, active, count)
        ordered = True
        for i in range(1, count):
            a, b = active[i - 1], active[i]
            ordered = ordered and top[a] <= top[b] and bottom[a] <= bottom[b]
        seen = va >= 0.0 and vb <= height
        if ordered:
            found = strip_areas(width, active, count, turns, top, bottom, 0.0, 1.0)
            whole += (vb - va) * found[0]
            inside += (vb - va) * found[1] if seen else 0.0
            continue
        start, cuts = 0.0, crossings(active, count, top, bottom)
        for cut in range(len(cuts)):
            end: float = cuts[cut]
            for i in range(count):
                side = active[i]
                keys[side] = between(top, bottom, side, 0.5 * (start + end))
            sort_active(keys, active, count)
            found = strip_areas(width, active, count, turns, top, bottom, start, end)
            whole += (vb - va) * found[0]
            inside += (vb - va) * found[1] if seen else 0.0
            start = end
    return whole, inside


@part
def between(top: Array, bottom: Array, side: int, share: float) -> float:
    """Where a side is some way down a strip."""
    return top[side] + share * (bottom[side] - top[side])


@part
def strip_areas(
    width: float, active: Array, count: int, turns: Array, top: Array, bottom: Array, start: float, end: float
) -> tuple[float, float]:
    """What the sides enclose in a part of a strip of height 1, and how much of that is within the image's width."""
    whole, inside, level = 0.0, 0.0, 0
    for i in range(count):
        side = active[i]
        before, level = level, level + turns[side]
        if (before > 0) != (level > 0):
            ua, ub = between(top, bottom, side, start), between(top, bottom, side, end)
            sign = (end - start) * (1.0 if before > 0 else -1.0)
            whole += sign * 0.5 * (ua + ub)
            inside += sign * clamped_mean(ua, ub, width)
    return whole, inside


@entry
def label_regions(
    width: float,
    height: float,
    points: Array,
    lengths: Array,
    counts: Array,
    tolerance: float,
    allowed: float,
    bbox: Array,
    bbox_amodal: Array,
    truncated: Array,
    rough: Array,
) -> None:
    """Labels of what n contours enclose, each of `counts` (n,) curves; those one after the other in `points` (k, 2),
    with their `lengths`. Those of contours with a curve are written to `bbox` (n, 4) and `truncated` (n,), and to
    `bbox_amodal` (n, 4) where that is NaN; `rough` (n,) is set where curves that are off by `tolerance` cannot tell the
    box to `allowed` pixels."""
    sides = np.empty((64, 4))
    piece, at = 0, 0
    for row in range(len(counts)):
        if counts[row] == 0:
            continue
        total = 0
        for i in range(piece, piece + counts[row]):
            total += lengths[i]
        if total > len(sides):
            sides = np.empty((2 * total, 4))
        n, at = gather_sides(points, lengths, piece, counts[row], at, sides)
        piece += counts[row]
        label_region(width, height, sides[:n], tolerance, allowed, row, bbox, bbox_amodal, truncated, rough)


@part
def label_region(
    width: float,
    height: float,
    sides: Array,
    tolerance: float,
    allowed: float,
    row: int,
    bboxes: Array,
    bboxes_amodal: Array,
    truncated: Array,
    rough: Array,
) -> None:
    """One row of `label_regions`."""
    if len(sides) == 0:
        return
    if np.isnan(bboxes_amodal[row, 0]):
        start_bbox(bboxes_amodal[row])
        for i in range(len(sides)):
            grow_bbox(bboxes_amodal[row], sides[i, 0], sides[i, 1])
    bbox = bboxes[row]
    bbox_in_image(width, height, 0.0, sides, bbox)
    for u, v in ((0.0, 0.0), (width, 0.0), (0.0, height), (width, height)):
        if holds(sides, u, v):
            grow_bbox(bbox, u, v)
    if not (bbox[0] < bbox[2] and bbox[1] < bbox[3]):
        bbox[:] = np.nan
        truncated[row] = 1.0
        return
    whole, inside = areas(width, height, sides)
    truncated[row] = min(max(1.0 - inside / whole, 0.0), 1.0) if whole > 0.0 else 0.0
    rough[row] = is_rough(width, height, sides, tolerance, allowed)


@entry
def join_loops(points: Array, lengths: Array, counts: Array) -> tuple[Array, Array, Array]:
    """The curves of n contours joined where one ends and another begins, to the last bit, until they are closed.

    `points` (k, 2), `lengths` and `counts` (n,) as in `label_regions`. Returns the points of all loops, each loop's
    number of points, its first not said again, and (n,) how many loops each contour has.
    """
    joined, loops, loop_counts = (
        np.empty_like(points),
        np.empty(len(lengths), np.int64),
        np.zeros(len(counts), np.int64),
    )
    starts = np.zeros(len(lengths) + 1, np.int64)
    for i in range(len(lengths)):
        starts[i + 1] = starts[i] + lengths[i]
    used = np.zeros(len(lengths), np.bool_)
    first, k, found = 0, 0, 0
    for row in range(len(counts)):
        last = first + counts[row]
        # Curves by where they begin, so that the next one is found by halving.
        firsts = points[starts[first:last], 0]
        order = np.argsort(firsts)
        firsts = firsts[order]
        for curve in range(first, last):
            if used[curve] or lengths[curve] < 2:
                continue
            begin, at = k, curve
            while at >= 0:
                used[at] = True
                for i in range(starts[at], starts[at + 1] - 1):
                    joined[k] = points[i]
                    k += 1
                end = points[starts[at + 1] - 1]
                at = -1
                for place in range(np.searchsorted(firsts, end[0]), len(firsts)):
                    if firsts[place] != end[0]:
                        break
                    following = first + order[place]
                    if not used[following] and points[starts[following], 1] == end[1]:
                        at = following
                        break
            loops[found] = k - begin
            loop_counts[row] += 1
            found += 1
        first = last
    return joined[:k].copy(), loops[:found].copy(), loop_counts
