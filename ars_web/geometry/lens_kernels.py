"""The compiled loops that bend shadows with a lens: the ring round a shadow's image, its box, and curves.

Within its valid radius, the rim, a lens maps the normalised plane one-to-one, so the image of a shadow's border is the
border of its image: everything here follows that one ring. Coordinates are image coordinates; rings run
counter-clockwise as seen in the image, y down.
"""

import math
from typing import NamedTuple

import numpy as np

from ars_web.geometry.compiled import entry, part

Array = np.ndarray

LONGEST_CURVE = 4096
"""Points on one straight piece, however much it bends."""

MOST_CHORDS = 64
"""On a stretch over which one bound on the bend is used."""

LONGEST_QUARTER = 1024
"""Points on a quarter of the rim."""

CAPACITY = 80_000
"""Points of a ring: 16 pieces and five quarters, with room to spare."""


class Lens(NamedTuple):
    """A camera as the kernels read it; `lens.lens_tables` makes it.

    Attributes:
        fisheye: OpenCV's fisheye polynomial in the angle; else Brown's, a pinhole's being all zeros.
        cx, cy: in image coordinates.
        rim: the valid radius in the normalised plane.
        rim_bend: bound on the second derivative of the rim's image by its angle, pixels.
        bins_per_e: bins of the bend table for each factor e of the radius.
    """

    fisheye: bool
    width: float
    height: float
    fx: float
    fy: float
    cx: float
    cy: float
    k1: float
    k2: float
    k3: float
    k4: float
    p1: float
    p2: float
    rim: float
    rim_bend: float
    bins_per_e: float


@part
def brown_point(lens: Lens, x: float, y: float) -> tuple[float, float]:
    """Image coordinates of a point of the normalised plane within the rim of a Brown or pinhole camera."""
    r2 = x * x + y * y
    radial = 1.0 + r2 * (lens.k1 + r2 * (lens.k2 + r2 * lens.k3))
    u = x * radial + 2.0 * lens.p1 * x * y + lens.p2 * (r2 + 2.0 * x * x)
    v = y * radial + lens.p1 * (r2 + 2.0 * y * y) + 2.0 * lens.p2 * x * y
    return lens.fx * u + lens.cx, lens.fy * v + lens.cy


@part
def fisheye_point(lens: Lens, x: float, y: float) -> tuple[float, float]:
    """Image coordinates of a point of the normalised plane within the rim of a fisheye camera."""
    r = math.sqrt(x * x + y * y)
    theta = math.atan(r)
    t2 = theta * theta
    bent = theta * (1.0 + t2 * (lens.k1 + t2 * (lens.k2 + t2 * (lens.k3 + t2 * lens.k4))))
    scale = bent / r if r > 1e-12 else 1.0
    return lens.fx * x * scale + lens.cx, lens.fy * y * scale + lens.cy


@part
def image_point(lens: Lens, x: float, y: float) -> tuple[float, float]:
    """Image coordinates of a point of the normalised plane within the rim (camera.pixels_from_normalised)."""
    return fisheye_point(lens, x, y) if lens.fisheye else brown_point(lens, x, y)


@part
def sample(lens: Lens, x: float, y: float, dx: float, dy: float, n: int, points: Array) -> None:
    """Image coordinates of the n points (x + i dx, y + i dy), i from 1, written to `points`."""
    # Two loops, because the processor takes several points at a time only where none needs an arc tangent.
    if lens.fisheye:
        for i in range(n):
            points[i, 0], points[i, 1] = fisheye_point(lens, x + (i + 1) * dx, y + (i + 1) * dy)
    else:
        for i in range(n):
            points[i, 0], points[i, 1] = brown_point(lens, x + (i + 1) * dx, y + (i + 1) * dy)


@part
def bend_bin(lens: Lens, bends: Array, r: float) -> int:
    """The bin of a radius in the bend table."""
    last = bends.shape[1] - 1
    if r >= lens.rim:
        return last
    place = last + 1 + math.log(max(r, 1e-30) / lens.rim) * lens.bins_per_e
    return min(max(math.floor(place), 0), last)


@part
def polygon_bend(lens: Lens, bends: Array, bound: int, xy: Array, n: int) -> float:
    """One of the bounds in the bend table for all that a polygon holds within the rim."""
    r2 = 0.0
    for i in range(n):
        r2 = max(r2, xy[i, 0] * xy[i, 0] + xy[i, 1] * xy[i, 1])
    return bends[bound, bend_bin(lens, bends, math.sqrt(r2))]


@part
def within_disc(xy: Array, n: int, radius: float) -> bool:
    """Whether all corners of a polygon lie in a disc round the origin."""
    for i in range(n):
        if not xy[i, 0] * xy[i, 0] + xy[i, 1] * xy[i, 1] < radius * radius:
            return False
    return True


@part
def append_curve(
    lens: Lens,
    bends: Array,
    bend: float,
    x0: float,
    y0: float,
    x1: float,
    y1: float,
    tolerance: float,
    points: Array,
    m: int,
) -> int:
    """Append the image of a straight piece within the rim to `points` after the first m, its start left out.

    A chord over a length L is off by at most max|f''| L^2 / 8, where f'' counts across the chord. `bend` bounds it.
    """
    dx, dy = x1 - x0, y1 - y0
    sagitta = bend * (dx * dx + dy * dy) / 8.0
    if sagitta > MOST_CHORDS * MOST_CHORDS * tolerance:
        return append_long_curve(lens, bends, x0, y0, x1, y1, tolerance, points, m)
    n = max(math.ceil(math.sqrt(sagitta / tolerance)), 1)
    sample(lens, x0, y0, dx / n, dy / n, n - 1, points[m:])
    points[m + n - 1, 0], points[m + n - 1, 1] = image_point(lens, x1, y1)
    return m + n


@part
def far_tolerance(distance: float) -> float:
    """What a curve may be off in addition where it is some pixels away from the image."""
    return distance * min(2e-5 * (1.0 + 1e-4 * distance), 1e-3)


@part
def append_outside_curve(
    lens: Lens,
    bend: float,
    x0: float,
    y0: float,
    x1: float,
    y1: float,
    tolerance: float,
    points: Array,
    m: int,
) -> tuple[int, float]:
    """The same where the whole piece is seen to lie on one side of the image: a quarter of the chords do, with the area
    between them and the curve, by Simpson's rule. Elsewhere nothing is appended. `points` holds the start already."""
    u0, v0 = points[m - 1, 0], points[m - 1, 1]
    u1, v1 = image_point(lens, x1, y1)
    sagitta = bend * ((x1 - x0) ** 2 + (y1 - y0) ** 2) / 8.0
    # Along its chord a curve bends three times as much as across, at most.
    beyond_u = max(-max(u0, u1), min(u0, u1) - lens.width) > 3.0 * sagitta
    beyond_v = max(-max(v0, v1), min(v0, v1) - lens.height) > 3.0 * sagitta
    if not (beyond_u or beyond_v) or sagitta > MOST_CHORDS * MOST_CHORDS * tolerance:
        return m, 0.0
    n = max(2 * math.ceil(math.sqrt(sagitta / tolerance) / 8.0), 2)
    sample(lens, x0, y0, (x1 - x0) / n, (y1 - y0) / n, n - 1, points[m:])
    points[m + n - 1, 0], points[m + n - 1, 1] = u1, v1
    missed = 0.0
    for i in range(m, m + n, 2):
        du, dv = points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1]
        missed += (du * (points[i + 1, 1] - points[i - 1, 1]) - dv * (points[i + 1, 0] - points[i - 1, 0])) / 6.0
    return m + n, missed


@part
def append_long_curve(
    lens: Lens, bends: Array, x0: float, y0: float, x1: float, y1: float, tolerance: float, points: Array, m: int
) -> int:
    """The same for a piece so long that one bound on f'' is too much for most of it: it is taken in stretches, each
    with the bound for its own range of radii, and with more tolerance far from the image."""
    dx, dy = x1 - x0, y1 - y0
    length2 = dx * dx + dy * dy
    nearest = -(x0 * dx + y0 * dy) / length2
    limit = m + LONGEST_CURVE
    s, stretch = 0.0, 1.0
    u, v = image_point(lens, x0, y0)
    while True:
        s_end = s + stretch if s + stretch < 1.0 - 1e-12 else 1.0
        x_end, y_end = (x1, y1) if s_end == 1.0 else (x0 + s_end * dx, y0 + s_end * dy)
        u_end, v_end = image_point(lens, x_end, y_end)
        s_near = min(max(nearest, s), s_end)
        r_low = math.hypot(x0 + s_near * dx, y0 + s_near * dy)
        r_high = max(math.hypot(x0 + s * dx, y0 + s * dy), math.hypot(x_end, y_end))
        bend = min(bends[0, bend_bin(lens, bends, r_high)], bends[1, bend_bin(lens, bends, r_low)])
        sagitta = bend * length2 * (s_end - s) ** 2 / 8.0
        away_u = max(min(u, u_end) - sagitta - lens.width, -max(u, u_end) - sagitta)
        away_v = max(min(v, v_end) - sagitta - lens.height, -max(v, v_end) - sagitta)
        allowed = tolerance + far_tolerance(max(away_u, away_v, 0.0))
        n = math.ceil(min(math.sqrt(sagitta / allowed), 1e6))
        if n > MOST_CHORDS and stretch > 2e-4:
            stretch *= 0.5
            continue
        n = max(min(n, limit - m), 1)
        part = (s_end - s) / n
        sample(lens, x0 + s * dx, y0 + s * dy, part * dx, part * dy, n - 1, points[m:])
        m += n - 1
        if m >= limit:
            s_end = 1.0
            u_end, v_end = image_point(lens, x1, y1)
        points[m, 0], points[m, 1] = u_end, v_end
        m += 1
        if s_end == 1.0:
            return m
        s, u, v = s_end, u_end, v_end
        stretch *= 2.0


@part
def append_arc(lens: Lens, start: float, sweep: float, tolerance: float, points: Array, m: int) -> int:
    """Append the image of the rim from the angle `start`, `sweep` radians counter-clockwise, its start left out.

    It is taken from quarter to quarter, so that the furthest points along both axes are among the samples.
    """
    quarter = 0.5 * math.pi
    density = min(math.sqrt(lens.rim_bend / (8.0 * tolerance)), LONGEST_QUARTER / quarter)
    done = 0.0
    while done < sweep:
        # Angles grow clockwise, y being down: the arc runs towards smaller ones.
        angle = start - done
        stretch = min(angle - quarter * (math.ceil(angle / quarter - 1e-9) - 1.0), sweep - done)
        n = max(math.ceil(stretch * density), 1)
        x, y = lens.rim * math.cos(angle), lens.rim * math.sin(angle)
        c, s = math.cos(stretch / n), math.sin(stretch / n)
        for _ in range(n):
            x, y = c * x + s * y, c * y - s * x
            points[m, 0], points[m, 1] = image_point(lens, x, y)
            m += 1
        done += max(stretch, 1e-9)
    return m


@part
def within_rim(lens: Lens, x0: float, y0: float, x1: float, y1: float) -> tuple[float, float]:
    """The part (from, to) of a straight piece, in [0, 1], that lies within the rim; (1, 0) where none does."""
    dx, dy = x1 - x0, y1 - y0
    a, b, c = dx * dx + dy * dy, x0 * dx + y0 * dy, x0 * x0 + y0 * y0 - lens.rim * lens.rim
    inside = b * b - a * c
    if not (a > 0.0 and inside > 0.0):
        return 1.0, 0.0
    root = math.sqrt(inside)
    low, high = max((-b - root) / a, 0.0), min((-b + root) / a, 1.0)
    # A piece that only grazes the rim is none: the arc passes there, and its two ends must not be one angle.
    cut = low > 0.0 or high < 1.0
    if not low < high or (cut and (high - low) * (high - low) * a < 1e-14 * lens.rim * lens.rim):
        return 1.0, 0.0
    return low, high


@part
def outline_ring(lens: Lens, bends: Array, xy: Array, n: int, tolerance: float, points: Array) -> tuple[int, float]:
    """The image of a convex polygon cut to the rim, as a ring written to `points`; how many, 0 for none, and how much
    more area there is within the true outline than within the ring."""
    m, bend, missed = 0, polygon_bend(lens, bends, 0, xy, n), 0.0
    whole = within_disc(xy, n, lens.rim)
    last_x, last_y, last_cut = 0.0, 0.0, False
    first_x, first_y, first_cut = 0.0, 0.0, False
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        x0, y0, x1, y1 = xy[i, 0], xy[i, 1], xy[j, 0], xy[j, 1]
        low, high = (0.0, 1.0) if whole else within_rim(lens, x0, y0, x1, y1)
        if low > high:
            continue
        xs, ys = x0 + low * (x1 - x0), y0 + low * (y1 - y0)
        xe, ye = x0 + high * (x1 - x0), y0 + high * (y1 - y0)
        if m == 0:
            first_x, first_y, first_cut = xs, ys, low > 0.0
            points[0, 0], points[0, 1] = image_point(lens, xs, ys)
            m = 1
        elif low > 0.0 or last_cut:
            m = append_arc_between(lens, last_x, last_y, xs, ys, tolerance, points, m)
        before = m
        if whole:
            m, more = append_outside_curve(lens, bend, xs, ys, xe, ye, tolerance, points, m)
            missed += more
        if m == before:
            m = append_curve(lens, bends, bend, xs, ys, xe, ye, tolerance, points, m)
        last_x, last_y, last_cut = xe, ye, high < 1.0
    if m == 0:
        return (append_arc(lens, 0.0, 2.0 * math.pi, tolerance, points, 0), 0.0) if holds(xy, n, 0.0, 0.0) else (0, 0.0)
    if first_cut or last_cut:
        m = append_arc_between(lens, last_x, last_y, first_x, first_y, tolerance, points, m)
    return m - 1, missed  # the last point is the first again


@part
def append_arc_between(
    lens: Lens, x0: float, y0: float, x1: float, y1: float, tolerance: float, points: Array, m: int
) -> int:
    """Append the image of the rim, counter-clockwise from where one piece left it to where the next one enters."""
    start = math.atan2(y0, x0)
    sweep = (start - math.atan2(y1, x1)) % (2.0 * math.pi)
    # Two pieces that meet on the rim leave a sweep of nothing, which rounding may turn into a whole round.
    if sweep > 2.0 * math.pi - 1e-8:
        sweep = 0.0
    m = append_arc(lens, start, sweep, tolerance, points, m)
    points[m, 0], points[m, 1] = image_point(lens, x1, y1)
    return m + 1


@part
def holds(xy: Array, n: int, x: float, y: float) -> bool:
    """Whether a convex polygon holds a point; NaN it does not."""
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        if not (xy[j, 0] - xy[i, 0]) * (y - xy[i, 1]) - (xy[j, 1] - xy[i, 1]) * (x - xy[i, 0]) <= 0.0:
            return False
    return True


@part
def grow_bbox(bbox: Array, u: float, v: float) -> None:
    """Make a box hold a point."""
    bbox[0], bbox[1] = min(bbox[0], u), min(bbox[1], v)
    bbox[2], bbox[3] = max(bbox[2], u), max(bbox[3], v)


@part
def amodal_bbox(lens: Lens, bends: Array, xy: Array, n: int, tolerance: float, points: Array, bbox: Array) -> bool:
    """The box of a polygon's image without sampling what cannot extend it; False where the rim cuts the polygon.

    Along a piece with ends du apart and a sagitta s, u goes beyond its ends by at most s (1 - |du| / 4s)^2, and not
    at all where |du| >= 4 s.
    """
    bbox[0], bbox[1], bbox[2], bbox[3] = np.inf, np.inf, -np.inf, -np.inf
    if not within_disc(xy, n, lens.rim):
        return False
    for i in range(n):
        u, v = image_point(lens, xy[i, 0], xy[i, 1])
        points[i, 0], points[i, 1] = u, v
        grow_bbox(bbox, u, v)
    bend, any_bend = polygon_bend(lens, bends, 0, xy, n), polygon_bend(lens, bends, 2, xy, n)
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        sagitta = any_bend * ((xy[j, 0] - xy[i, 0]) ** 2 + (xy[j, 1] - xy[i, 1]) ** 2) / 8.0
        if sagitta <= tolerance:
            continue
        beyond_u = sagitta * max(1.0 - abs(points[j, 0] - points[i, 0]) / (4.0 * sagitta), 0.0) ** 2 - tolerance
        beyond_v = sagitta * max(1.0 - abs(points[j, 1] - points[i, 1]) / (4.0 * sagitta), 0.0) ** 2 - tolerance
        if (
            min(points[i, 0], points[j, 0]) - beyond_u < bbox[0]
            or max(points[i, 0], points[j, 0]) + beyond_u > bbox[2]
            or min(points[i, 1], points[j, 1]) - beyond_v < bbox[1]
            or max(points[i, 1], points[j, 1]) + beyond_v > bbox[3]
        ):
            m = append_curve(lens, bends, bend, xy[i, 0], xy[i, 1], xy[j, 0], xy[j, 1], tolerance, points, n)
            for k in range(n, m):
                grow_bbox(bbox, points[k, 0], points[k, 1])
    return True


@entry
def boxes_of_shadows(
    lens: Lens,
    bends: Array,
    polygons: Array,
    corners: Array,
    tolerance: float,
    bbox: Array,
    bbox_amodal: Array,
    truncated: Array,
    unsettled: Array,
) -> None:
    """Labels, as far as boxes settle them, of n x b shadows, written to `bbox` and `bbox_amodal` (n, b, 4) and
    `truncated` (n, b); those that need their rings are marked in `unsettled` (n, b), and those of them that the rim
    cuts have no `bbox_amodal` yet."""
    # A copy, because threads that count the users of one array stand in each other's way.
    bends, points = bends.copy(), np.empty((CAPACITY, 2))
    for frame in range(corners.shape[0]):
        for box in range(corners.shape[1]):
            xy, n, whole = polygons[frame, box], corners[frame, box], bbox_amodal[frame, box]
            bbox[frame, box, :], truncated[frame, box], unsettled[frame, box] = np.nan, 1.0, n > 0
            if n == 0 or not amodal_bbox(lens, bends, xy, n, tolerance, points, whole):
                whole[:] = np.nan
            elif whole[0] >= lens.width or whole[1] >= lens.height or whole[2] <= 0.0 or whole[3] <= 0.0:
                unsettled[frame, box] = False
            elif whole[0] >= 0.0 and whole[1] >= 0.0 and whole[2] <= lens.width and whole[3] <= lens.height:
                unsettled[frame, box] = False
                if whole[0] < whole[2] and whole[1] < whole[3]:
                    bbox[frame, box, :] = whole
                    truncated[frame, box] = 0.0


@entry
def rings_of_shadows(
    lens: Lens, bends: Array, polygons: Array, corners: Array, wanted: Array, tolerance: float
) -> tuple[Array, Array, Array]:
    """Rings round n x b shadows, those that are `wanted` (n, b): all points (k, 2), (n * b,) how many each has, and
    (n * b,) how much area they missed."""
    # A copy, because threads that count the users of one array stand in each other's way.
    bends = bends.copy()
    frames, boxes = corners.shape
    lengths, missed = np.zeros(frames * boxes, np.int64), np.zeros(frames * boxes)
    ring = np.empty((CAPACITY, 2))
    found = np.empty((64 * frames * boxes, 2))
    k = 0
    for frame in range(frames):
        for box in range(boxes):
            if not wanted[frame, box] or corners[frame, box] == 0:
                continue
            xy, row = polygons[frame, box], frame * boxes + box
            m, missed[row] = outline_ring(lens, bends, xy, corners[frame, box], tolerance, ring)
            if k + m > len(found):
                grown = np.empty((2 * len(found) + m, 2))
                grown[:k] = found[:k]
                found = grown
            found[k : k + m] = ring[:m]
            lengths[row] = m
            k += m
    return found[:k].copy(), lengths, missed


@entry
def bend_points(lens: Lens, x: Array, y: Array, u: Array, v: Array) -> None:
    """Image coordinates of points of the normalised plane (n, m) within the rim, written to `u` and `v` (n, m)."""
    # Two loops, as in `sample`.
    for i in range(len(x)):
        if lens.fisheye:
            for j in range(x.shape[1]):
                u[i, j], v[i, j] = fisheye_point(lens, x[i, j], y[i, j])
        else:
            for j in range(x.shape[1]):
                u[i, j], v[i, j] = brown_point(lens, x[i, j], y[i, j])


@entry
def curves_of_edges(lens: Lens, bends: Array, edges: Array, tolerance: float) -> tuple[Array, Array]:
    """Images of straight pieces (n, 2, 2), cut to the rim: all points (k, 2), and (n,) how many each has, 0 for those
    beyond the rim."""
    # A copy, because threads that count the users of one array stand in each other's way.
    bends = bends.copy()
    found = np.empty((4 * len(edges) + LONGEST_CURVE + 2, 2))
    lengths = np.zeros(len(edges), np.int64)
    k = 0
    for i in range(len(edges)):
        x0, y0, x1, y1 = edges[i, 0, 0], edges[i, 0, 1], edges[i, 1, 0], edges[i, 1, 1]
        low, high = within_rim(lens, x0, y0, x1, y1)
        if low > high:
            continue
        if k + LONGEST_CURVE + 2 > len(found):
            grown = np.empty((2 * len(found) + LONGEST_CURVE, 2))
            grown[:k] = found[:k]
            found = grown
        xs, ys = x0 + low * (x1 - x0), y0 + low * (y1 - y0)
        # Ends that are not cut stay what they are to the last bit, so that pieces that meet are seen to.
        xe, ye = (x0 + high * (x1 - x0), y0 + high * (y1 - y0)) if high < 1.0 else (x1, y1)
        bend = polygon_bend(lens, bends, 0, edges[i], 2)
        found[k, 0], found[k, 1] = image_point(lens, xs, ys)
        end = append_curve(lens, bends, bend, xs, ys, xe, ye, tolerance, found, k + 1)
        lengths[i] = end - k
        k = end
    return found[:k].copy(), lengths
