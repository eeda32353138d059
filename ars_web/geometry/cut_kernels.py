"""The compiled loops that cut rings and curves to the image, and label what is left of them.

Coordinates are image coordinates; rings run counter-clockwise as seen in the image, y down.
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
def clamped_integral(v: float, height: float) -> float:
    """Integral of min(max(v, 0), height) from 0 to v."""
    return 0.0 if v <= 0.0 else (0.5 * v * v if v <= height else height * (v - 0.5 * height))


@part
def area_in_image(width: float, height: float, u0: float, v0: float, u1: float, v1: float) -> float:
    """What one side of a ring adds to the area of the ring within the image: the integral of v, clamped to the
    image's height, over the part of u within its width. Its sum over any ring is the signed area."""
    if u0 == u1:
        return 0.0
    if v0 >= height and v1 >= height:
        return height * (min(max(u1, 0.0), width) - min(max(u0, 0.0), width))
    slope = (v1 - v0) / (u1 - u0)
    ua, ub = min(max(u0, 0.0), width), min(max(u1, 0.0), width)
    va, vb = v0 + slope * (ua - u0), v0 + slope * (ub - u0)
    if 0.0 <= va <= height and 0.0 <= vb <= height:
        return 0.5 * (va + vb) * (ub - ua)
    if abs(vb - va) < 1e-9:
        return min(max(va, 0.0), height) * (ub - ua)
    return (clamped_integral(vb, height) - clamped_integral(va, height)) / (vb - va) * (ub - ua)


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
def label_of_ring(width: float, height: float, ring: Array, missed: float, bbox: Array) -> float:
    """The box of the part of a ring's inside that lies in the image, written to `bbox`, and the share of its area
    that does not. The corners of the part are the ring's own, where it crosses the image's border, and the image's
    corners that it holds. `missed` is the area that the ring's chords cut off outside the image."""
    start_bbox(bbox)
    whole, part = missed, 0.0
    top_left, top_right, bottom_left, bottom_right = False, False, False, False
    u0, v0 = ring[len(ring) - 1, 0], ring[len(ring) - 1, 1]
    inside_before = 0.0 <= u0 <= width and 0.0 <= v0 <= height
    for i in range(len(ring)):
        u1, v1 = ring[i, 0], ring[i, 1]
        area = 0.5 * (v0 + v1) * (u1 - u0)
        whole += area
        inside = 0.0 <= u1 <= width and 0.0 <= v1 <= height
        if inside and inside_before:
            part += area
            grow_bbox(bbox, u1, v1)
        elif not ((u0 <= 0.0 and u1 <= 0.0) or (u0 >= width and u1 >= width) or (v0 <= 0.0 and v1 <= 0.0)):
            part += area_in_image(width, height, u0, v0, u1, v1)
            low, high = in_image(width, height, u0, v0, u1, v1)
            if low <= high:
                grow_bbox(bbox, u0 + low * (u1 - u0), v0 + low * (v1 - v0))
                grow_bbox(bbox, u0 + high * (u1 - u0), v0 + high * (v1 - v0))
            # A ring holds a corner that it passes below an odd number of times.
            if (u0 > 0.0) != (u1 > 0.0):
                v = v0 - u0 / (u1 - u0) * (v1 - v0)
                top_left, bottom_left = top_left != (v > 0.0), bottom_left != (v > height)
            if (u0 >= width) != (u1 >= width):
                v = v0 + (width - u0) / (u1 - u0) * (v1 - v0)
                top_right, bottom_right = top_right != (v > 0.0), bottom_right != (v > height)
        u0, v0, inside_before = u1, v1, inside
    if top_left:
        grow_bbox(bbox, 0.0, 0.0)
    if top_right:
        grow_bbox(bbox, width, 0.0)
    if bottom_left:
        grow_bbox(bbox, 0.0, height)
    if bottom_right:
        grow_bbox(bbox, width, height)
    bbox[0], bbox[1] = place_in_image(width, height, bbox[0], bbox[1])
    bbox[2], bbox[3] = place_in_image(width, height, bbox[2], bbox[3])
    if not (bbox[0] < bbox[2] and bbox[1] < bbox[3]):
        bbox[:] = np.nan
        return 1.0
    return min(max(1.0 - part / whole, 0.0), 1.0) if whole != 0.0 else 0.0


@part
def bbox_within(width: float, height: float, margin: float, ring: Array, bbox: Array) -> None:
    """The box, cut to the image, of what of a ring's sides lies in the image widened by a margin, which may be
    negative."""
    start_bbox(bbox)
    wide, high = width + 2.0 * margin, height + 2.0 * margin
    u0, v0 = ring[len(ring) - 1, 0] + margin, ring[len(ring) - 1, 1] + margin
    inside_before = 0.0 <= u0 <= wide and 0.0 <= v0 <= high
    for i in range(len(ring)):
        u1, v1 = ring[i, 0] + margin, ring[i, 1] + margin
        inside = 0.0 <= u1 <= wide and 0.0 <= v1 <= high
        if inside and inside_before:
            grow_bbox(bbox, u1, v1)
        elif not (
            (u0 < 0.0 and u1 < 0.0) or (u0 > wide and u1 > wide) or (v0 < 0.0 and v1 < 0.0) or min(v0, v1) > high
        ):
            start, end = in_image(wide, high, u0, v0, u1, v1)
            if start <= end:
                grow_bbox(bbox, u0 + start * (u1 - u0), v0 + start * (v1 - v0))
                grow_bbox(bbox, u0 + end * (u1 - u0), v0 + end * (v1 - v0))
        u0, v0, inside_before = u1, v1, inside
    for i in range(2):
        bbox[2 * i], bbox[2 * i + 1] = place_in_image(width, height, bbox[2 * i] - margin, bbox[2 * i + 1] - margin)


@part
def is_rough(width: float, height: float, ring: Array, tolerance: float, allowed: float) -> bool:
    """Whether a ring that is off by `tolerance` may leave the box of its part in the image off by more than `allowed`.

    A side that meets the image's border at a small angle is cut far from where it should be. The true ring lies
    within `tolerance`, so its box lies between those of this ring in a smaller and in a larger image.
    """
    least, most = np.empty(4), np.empty(4)
    bbox_within(width, height, -tolerance, ring, least)
    bbox_within(width, height, tolerance, ring, most)
    for i in range(4):
        if not abs(most[i] - least[i]) <= 2.0 * allowed:
            return True
    return False


@entry
def label_rings(
    width: float,
    height: float,
    points: Array,
    lengths: Array,
    missed: Array,
    tolerance: float,
    allowed: float,
    bboxes: Array,
    bboxes_amodal: Array,
    truncated: Array,
    rough: Array,
) -> None:
    """Labels of those of m boxes that have a ring, the rings one after the other in `points` (k, 2) and what they
    `missed` (m,) outside, written to `bboxes` (m, 4) and `truncated` (m,), and to `bboxes_amodal` (m, 4) where that is
    NaN; `rough` (m,) is set where rings that are off by `tolerance` cannot tell the box to `allowed` pixels."""
    start = 0
    for i in range(len(lengths)):
        if lengths[i] == 0:
            continue
        ring = points[start : start + lengths[i]]
        start += lengths[i]
        truncated[i] = label_of_ring(width, height, ring, missed[i], bboxes[i])
        rough[i] = is_rough(width, height, ring, tolerance, allowed)
        if np.isnan(bboxes_amodal[i, 0]):
            start_bbox(bboxes_amodal[i])
            for j in range(len(ring)):
                grow_bbox(bboxes_amodal[i], ring[j, 0], ring[j, 1])


@part
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


@part
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


@part
def spare_point(width: float, height: float, a: Array, b: Array, c: Array) -> bool:
    """Whether b says nothing that a and c do not: all three lie on one border of the image."""
    return (
        (a[0] == 0.0 and b[0] == 0.0 and c[0] == 0.0)
        or (a[1] == 0.0 and b[1] == 0.0 and c[1] == 0.0)
        or (a[0] == width and b[0] == width and c[0] == width)
        or (a[1] == height and b[1] == height and c[1] == height)
    )


@entry
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


@entry
def cut_curves(width: float, height: float, points: Array, lengths: Array) -> tuple[Array, Array]:
    """Curves, one after the other in `points` (k, 2), cut to the image: all points left, and how many each part has; a
    curve leaves none, one, or more where it leaves the image and comes back."""
    found = np.empty((2 * len(points), 2))
    counts = np.zeros(len(points), np.int64)
    start, k, parts = 0, 0, 0
    for n in lengths:
        joined = False
        for i in range(start, start + n - 1):
            u, v = points[i, 0], points[i, 1]
            du, dv = points[i + 1, 0] - u, points[i + 1, 1] - v
            low, high = in_image(width, height, u, v, u + du, v + dv)
            if low >= high:
                joined = False
                continue
            if not joined or low > 0.0:
                found[k, 0], found[k, 1] = place_in_image(width, height, u + low * du, v + low * dv)
                counts[parts] = 1
                parts += 1
                k += 1
            found[k, 0], found[k, 1] = place_in_image(width, height, u + high * du, v + high * dv)
            counts[parts - 1] += 1
            k += 1
            joined = high == 1.0
        start += n
    return found[:k].copy(), counts[:parts].copy()
