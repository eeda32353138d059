"""Rays against shapes, each in its own frame; vectors are tuples of three floats, lengths are metres.

Every shape is three functions: where a ray enters it, which surface coordinates (u, v) a point on it has, and
which point and outward normal some (u, v) have. The first two draw it; the last bakes its light and samples its
true outline. Rays start outside, so that only entries count. `size` is three numbers, 0 where there are fewer:

BOX       half sides x, y, z                        surfaces: -x +x -y +y -z +z
BALL      radius                                    surfaces: all of it
CYLINDER  radius, half height                       surfaces: side, bottom, top; about z
TUBE      outer radius, inner radius, half height   surfaces: outside, inside, bottom ring, top ring; about z
HANDLE    ring radius, thickness radius, least x    surfaces: all of it; a ring about y, cut off below the least x
"""

import math

import numpy as np

from ars_web.demo.compiled import compiled, copied_in

Vector = tuple[float, float, float]

BOX, BALL, CYLINDER, TUBE, HANDLE = range(5)
SURFACE_COUNTS = (6, 1, 3, 4, 1)

MISS = np.inf
TURN = 2 * math.pi


@compiled
def dot(a: Vector, b: Vector) -> float:
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def along(origin: Vector, direction: Vector, t: float) -> Vector:
    """The point `t` along a ray."""
    return origin[0] + t * direction[0], origin[1] + t * direction[1], origin[2] + t * direction[2]


@compiled
def unit(a: Vector) -> Vector:
    """`a` at length 1."""
    scale = 1.0 / math.sqrt(dot(a, a))
    return a[0] * scale, a[1] * scale, a[2] * scale


@compiled
def enter(kind: int, size: Vector, origin: Vector, direction: Vector) -> tuple[float, int]:
    """Distance along a ray of unit direction to where it enters the shape, and through which surface.

    The distance is MISS where it does not.
    """
    if kind == BOX:
        return _enter_box(size, origin, direction)
    if kind == BALL:
        return _enter_ball(size[0], origin, direction)
    if kind == CYLINDER:
        return _enter_cylinder(size[0], size[1], origin, direction)
    if kind == TUBE:
        return _enter_tube(size[0], size[1], size[2], origin, direction)
    return _enter_handle(size[0], size[1], size[2], origin, direction)


@copied_in
def _enter_box(size: Vector, origin: Vector, direction: Vector) -> tuple[float, int]:
    near, far, surface = -np.inf, np.inf, 0
    for axis in range(3):
        o, d, half = origin[axis], direction[axis], size[axis]
        if abs(d) < 1e-12:
            if abs(o) > half:
                return MISS, 0
            continue
        first, last = (-half - o) / d, (half - o) / d
        if d < 0:
            first, last = last, first
        if first > near:
            near = first
            surface = 2 * axis + (1 if d < 0 else 0)
        far = min(far, last)
    if near > far or near <= 0:
        return MISS, 0
    return near, surface


@copied_in
def _enter_ball(radius: float, origin: Vector, direction: Vector) -> tuple[float, int]:
    b = dot(origin, direction)
    under_root = b * b - dot(origin, origin) + radius * radius
    if under_root < 0:
        return MISS, 0
    t = -b - math.sqrt(under_root)
    return (t, 0) if t > 0 else (MISS, 0)


@compiled
def _across_wall(radius: float, origin: Vector, direction: Vector) -> tuple[float, float]:
    """Distances to where the ray crosses the endless cylinder about z; MISS twice where it does not."""
    a = direction[0] * direction[0] + direction[1] * direction[1]
    if a < 1e-14:
        return MISS, MISS
    b = origin[0] * direction[0] + origin[1] * direction[1]
    c = origin[0] * origin[0] + origin[1] * origin[1] - radius * radius
    under_root = b * b - a * c
    if under_root < 0:
        return MISS, MISS
    root = math.sqrt(under_root)
    return (-b - root) / a, (-b + root) / a


@compiled
def _enter_end(inner: float, outer: float, half: float, origin: Vector, direction: Vector) -> tuple[float, bool]:
    """Distance to the flat end, a ring, that faces the ray, and whether it is the upper one."""
    if abs(direction[2]) < 1e-12:
        return MISS, False
    upper = direction[2] < 0
    t = ((half if upper else -half) - origin[2]) / direction[2]
    x, y, _ = along(origin, direction, t)
    r2 = x * x + y * y
    if t <= 0 or r2 > outer * outer or r2 < inner * inner:
        return MISS, False
    return t, upper


@copied_in
def _enter_cylinder(radius: float, half: float, origin: Vector, direction: Vector) -> tuple[float, int]:
    t, _ = _across_wall(radius, origin, direction)
    if 0 < t < MISS and abs(origin[2] + t * direction[2]) <= half:
        return t, 0
    t, upper = _enter_end(0.0, radius, half, origin, direction)
    return t, 2 if upper else 1


@copied_in
def _enter_tube(outer: float, inner: float, half: float, origin: Vector, direction: Vector) -> tuple[float, int]:
    best, upper = _enter_end(inner, outer, half, origin, direction)
    surface = 3 if upper else 2
    t, _ = _across_wall(outer, origin, direction)
    if 0 < t < best and abs(origin[2] + t * direction[2]) <= half:
        best, surface = t, 0
    # From the hollow the wall is entered where the ray leaves the inner cylinder.
    _, t = _across_wall(inner, origin, direction)
    if 0 < t < best and abs(origin[2] + t * direction[2]) <= half:
        best, surface = t, 1
    return best, surface


@copied_in
def _enter_handle(ring: float, thick: float, least_x: float, origin: Vector, direction: Vector) -> tuple[float, int]:
    # Sphere tracing (Hart 1996): the distance to the shape is a step that cannot pass it.
    reach = ring + thick
    b = dot(origin, direction)
    under_root = b * b - dot(origin, origin) + reach * reach
    if under_root < 0:
        return MISS, 0
    root = math.sqrt(under_root)
    t, end = max(-b - root, 0.0), -b + root
    for _ in range(200):
        if t > end:
            return MISS, 0
        x, y, z = along(origin, direction, t)
        from_ring = math.sqrt(x * x + z * z) - ring
        gap = max(math.sqrt(from_ring * from_ring + y * y) - thick, least_x - x)
        if gap < 1e-7:
            return (t, 0) if t > 0 else (MISS, 0)
        t += gap
    return MISS, 0


@compiled
def holds(kind: int, size: Vector, point: Vector) -> bool:
    """Whether a point lies within the shape's material."""
    x, y, z = point
    a, b, c = size
    if kind == BOX:
        return abs(x) < a and abs(y) < b and abs(z) < c
    if kind == BALL:
        return dot(point, point) < a * a
    r2 = x * x + y * y
    if kind == CYLINDER:
        return r2 < a * a and abs(z) < b
    if kind == TUBE:
        return b * b < r2 < a * a and abs(z) < c
    from_ring = math.sqrt(x * x + z * z) - a
    return from_ring * from_ring + y * y < b * b and x > c


@compiled
def _turn(x: float, y: float) -> float:
    """The angle of (x, y) as a share of a whole turn, in [0, 1)."""
    share = math.atan2(y, x) / TURN
    return share if share >= 0 else share + 1.0


@compiled
def surface_coordinates(kind: int, size: Vector, surface: int, point: Vector) -> tuple[float, float, Vector]:
    """(u, v) in [0, 1] of a point on the shape, and the outward normal there.

    Seen from outside with z up, u runs to the right and v down, so that pictures stand upright.
    """
    x, y, z = point
    if kind == BOX:
        hx, hy, hz = size[0], size[1], size[2]
        if surface == 0:
            return 0.5 - y / (2 * hy), 0.5 - z / (2 * hz), (-1.0, 0.0, 0.0)
        if surface == 1:
            return 0.5 + y / (2 * hy), 0.5 - z / (2 * hz), (1.0, 0.0, 0.0)
        if surface == 2:
            return 0.5 + x / (2 * hx), 0.5 - z / (2 * hz), (0.0, -1.0, 0.0)
        if surface == 3:
            return 0.5 - x / (2 * hx), 0.5 - z / (2 * hz), (0.0, 1.0, 0.0)
        if surface == 4:
            return 0.5 + x / (2 * hx), 0.5 + y / (2 * hy), (0.0, 0.0, -1.0)
        return 0.5 + x / (2 * hx), 0.5 - y / (2 * hy), (0.0, 0.0, 1.0)
    if kind == BALL:
        r = size[0]
        return _turn(x, y), math.acos(min(max(z / r, -1.0), 1.0)) / math.pi, (x / r, y / r, z / r)
    if kind == CYLINDER:
        r, half = size[0], size[1]
        if surface == 0:
            return _turn(x, y), 0.5 - z / (2 * half), (x / r, y / r, 0.0)
        if surface == 1:
            return 0.5 + x / (2 * r), 0.5 + y / (2 * r), (0.0, 0.0, -1.0)
        return 0.5 + x / (2 * r), 0.5 - y / (2 * r), (0.0, 0.0, 1.0)
    if kind == TUBE:
        outer, inner, half = size[0], size[1], size[2]
        if surface == 0:
            return _turn(x, y), 0.5 - z / (2 * half), (x / outer, y / outer, 0.0)
        if surface == 1:
            return _turn(x, y), 0.5 - z / (2 * half), (-x / inner, -y / inner, 0.0)
        share = (math.sqrt(x * x + y * y) - inner) / (outer - inner)
        return _turn(x, y), share, (0.0, 0.0, -1.0 if surface == 2 else 1.0)
    r = max(math.sqrt(x * x + z * z), 1e-12)
    out = r - size[0]
    return _turn(x, z), _turn(out, y), unit((out * x / r, y, out * z / r))


@compiled
def surface_point(kind: int, size: Vector, surface: int, u: float, v: float) -> tuple[Vector, Vector]:
    """The point and outward normal that (u, v) have: the inverse of `surface_coordinates`.

    The ends of a cylinder are discs in the square of (u, v): what lies outside is drawn in to the rim. A handle
    has points beyond its cut, which are not on the shape.
    """
    a, b = 2 * u - 1, 1 - 2 * v
    if kind == BOX:
        hx, hy, hz = size[0], size[1], size[2]
        if surface == 0:
            return (-hx, -a * hy, b * hz), (-1.0, 0.0, 0.0)
        if surface == 1:
            return (hx, a * hy, b * hz), (1.0, 0.0, 0.0)
        if surface == 2:
            return (a * hx, -hy, b * hz), (0.0, -1.0, 0.0)
        if surface == 3:
            return (-a * hx, hy, b * hz), (0.0, 1.0, 0.0)
        if surface == 4:
            return (a * hx, -b * hy, -hz), (0.0, 0.0, -1.0)
        return (a * hx, b * hy, hz), (0.0, 0.0, 1.0)
    c, s = math.cos(TURN * u), math.sin(TURN * u)
    if kind == BALL:
        sin_polar, cos_polar = math.sin(math.pi * v), math.cos(math.pi * v)
        n = (sin_polar * c, sin_polar * s, cos_polar)
        return (size[0] * n[0], size[0] * n[1], size[0] * n[2]), n
    if kind == CYLINDER:
        r, half = size[0], size[1]
        if surface == 0:
            return (r * c, r * s, b * half), (c, s, 0.0)
        scale = r / max(math.sqrt(a * a + b * b), 1.0)
        if surface == 1:
            return (a * scale, -b * scale, -half), (0.0, 0.0, -1.0)
        return (a * scale, b * scale, half), (0.0, 0.0, 1.0)
    if kind == TUBE:
        outer, inner, half = size[0], size[1], size[2]
        if surface == 0:
            return (outer * c, outer * s, b * half), (c, s, 0.0)
        if surface == 1:
            return (inner * c, inner * s, b * half), (-c, -s, 0.0)
        r = inner + v * (outer - inner)
        up = -1.0 if surface == 2 else 1.0
        return (r * c, r * s, up * half), (0.0, 0.0, up)
    out, y = math.cos(TURN * v), math.sin(TURN * v)
    r = size[0] + size[1] * out
    return (r * c, size[1] * y, r * s), (out * c, y, out * s)
