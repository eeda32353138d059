"""The compiled loops that cast a box's shadow: what lies in front of a camera, on its normalised plane (x/z, y/z).

What is in front of the near plane of a box is convex, so its shadow is a convex polygon. Polygons run
counter-clockwise as seen in the image, y down.
"""

import numpy as np

from ars_web.geometry.compiled import entry, part

Array = np.ndarray

MOST_CORNERS = 16
"""Of a shadow. A box has 8 corners, and a plane cuts at most 6 of its edges."""


@part
def place_box(T_world_camera: Array, T_world_box: Array, R: Array, t: Array) -> None:
    """Rotation `R` (3, 3) and translation `t` (3,) of `T_camera_box`, written in place."""
    for i in range(3):
        t[i] = 0.0
        for j in range(3):
            t[i] += T_world_camera[j, i] * (T_world_box[j, 3] - T_world_camera[j, 3])
            R[i, j] = 0.0
            for k in range(3):
                R[i, j] += T_world_camera[k, i] * T_world_box[k, j]


@part
def place_corner(R: Array, t: Array, half: Array, corner: int, axis: int) -> float:
    """One camera coordinate of a corner, numbered as box.CORNER_SIGNS."""
    x = half[0] if corner & 4 else -half[0]
    y = half[1] if corner & 2 else -half[1]
    z = half[2] if corner & 1 else -half[2]
    return t[axis] + R[axis, 0] * x + R[axis, 1] * y + R[axis, 2] * z


@part
def shadow(R: Array, t: Array, half: Array, near: float, rings: Array, xy: Array) -> int:
    """The corners of a box's shadow on the normalised plane, written to `xy` (MOST_CORNERS, 2); how many, 0 for none.

    A box all in front of the near plane shows one of 27 rings of four or six corners, by where the camera is among
    the slabs of its three axes; `rings` (27, 7) holds each one's length and corners.
    """
    reach = abs(R[2, 0]) * half[0] + abs(R[2, 1]) * half[1] + abs(R[2, 2]) * half[2]
    if not t[2] + reach > near:
        return 0
    if t[2] - reach < near:
        return shadow_of_cut_box(R, t, half, near, xy)
    region = 0
    for i in range(3):
        place = -(R[0, i] * t[0] + R[1, i] * t[1] + R[2, i] * t[2])
        region = 3 * region + (0 if place < -half[i] else (2 if place > half[i] else 1))
    n = rings[region, 0]
    for i in range(n):
        corner = rings[region, 1 + i]
        z = place_corner(R, t, half, corner, 2)
        xy[i, 0] = place_corner(R, t, half, corner, 0) / z
        xy[i, 1] = place_corner(R, t, half, corner, 1) / z
    return n


@part
def shadow_of_cut_box(R: Array, t: Array, half: Array, near: float, xy: Array) -> int:
    """The same for a box that the near plane cuts: the hull of what is left of its corners and edges."""
    found = np.empty((MOST_CORNERS, 2))
    n = 0
    for k in range(8):
        z = place_corner(R, t, half, k, 2)
        if z >= near:
            found[n, 0] = place_corner(R, t, half, k, 0) / z
            found[n, 1] = place_corner(R, t, half, k, 1) / z
            n += 1
        for bit in (1, 2, 4):
            z_end = place_corner(R, t, half, k | bit, 2)
            if not k & bit and (z >= near) != (z_end >= near):
                s = (near - z) / (z_end - z)
                for axis in range(2):
                    start = place_corner(R, t, half, k, axis)
                    found[n, axis] = (start + s * (place_corner(R, t, half, k | bit, axis) - start)) / near
                n += 1
    return hull(found[:n], xy)


@part
def hull(points: Array, ring: Array) -> int:
    """The convex hull of a few points, written to `ring`; how many (Andrew's monotone chain). Sorts `points`."""
    n = len(points)
    for i in range(1, n):
        x, y = points[i, 0], points[i, 1]
        j = i
        while j > 0 and (points[j - 1, 0] > x or (points[j - 1, 0] == x and points[j - 1, 1] > y)):
            points[j, 0], points[j, 1] = points[j - 1, 0], points[j - 1, 1]
            j -= 1
        points[j, 0], points[j, 1] = x, y
    m = 0
    for way in range(2):
        first = m
        for step in range(n):
            i = step if way == 0 else n - 1 - step
            while m >= first + 2 and turn(ring[m - 2], ring[m - 1], points[i]) >= 0.0:
                m -= 1
            ring[m, 0], ring[m, 1] = points[i, 0], points[i, 1]
            m += 1
        m -= 1
    return m if m >= 3 else 0


@part
def turn(a: Array, b: Array, c: Array) -> float:
    """Negative where a, b, c turn counter-clockwise as seen in the image (y down)."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


@entry
def cast_shadows(
    Ts_world_camera: Array,
    Ts_world_box: Array,
    halves: Array,
    near: float,
    rings: Array,
    polygons: Array,
    corners: Array,
) -> None:
    """The shadows of b boxes in n frames, written to `polygons` (n, b, MOST_CORNERS, 2); each one's number of corners,
    0 where nothing is in front, to `corners` (n, b)."""
    # Copies, because threads that count the users of one array stand in each other's way.
    Ts_world_box, halves, rings = Ts_world_box.copy(), halves.copy(), rings.copy()
    R, t = np.empty((3, 3)), np.empty(3)
    for frame in range(len(Ts_world_camera)):
        for box in range(len(halves)):
            place_box(Ts_world_camera[frame], Ts_world_box[box], R, t)
            corners[frame, box] = shadow(R, t, halves[box], near, rings, polygons[frame, box])


@entry
def cast_edges(T_world_camera: Array, T_world_box: Array, half: Array, near: float, edges: Array) -> int:
    """The parts of a box's twelve edges that are in front, written to `edges` (12, 2, 2) as (start, end); how many."""
    R, t = np.empty((3, 3)), np.empty(3)
    place_box(T_world_camera, T_world_box, R, t)
    n = 0
    for k in range(8):
        for bit in (1, 2, 4):
            if k & bit:
                continue
            z0, z1 = place_corner(R, t, half, k, 2), place_corner(R, t, half, k | bit, 2)
            if not max(z0, z1) > near:
                continue
            low = (near - z0) / (z1 - z0) if z0 < near else 0.0
            high = (near - z0) / (z1 - z0) if z1 < near else 1.0
            for end, s in ((0, low), (1, high)):
                z = z0 + s * (z1 - z0)
                for axis in range(2):
                    start = place_corner(R, t, half, k, axis)
                    edges[n, end, axis] = (start + s * (place_corner(R, t, half, k | bit, axis) - start)) / z
            n += 1
    return n
