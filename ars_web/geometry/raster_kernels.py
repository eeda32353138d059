"""The compiled loops behind `shape_occlusion.py` and `instance_masks.py`: triangles on grids of rays.

With a, b and c a triangle's corners in camera coordinates, the ray d = (x, y, 1) passes them on the sides that the
signs of (a x b) . d, (b x c) . d and (c x a) . d tell, and meets the triangle's plane at the inverse depth that is
their sum over a . (b x c): all linear in x and y, whatever of the triangle is behind the camera (Olano and Greer,
Triangle Scan Conversion using 2D Homogeneous Coordinates, 1997). A lens changes only which rays there are.

Which rays those are is told by the images of the corners: the image of a side is off its chord by an eighth of the
lens's bend times the side's length squared, at most.
"""

import math
from typing import NamedTuple

import numpy as np

from ars_web.geometry.compiled import entry, part
from ars_web.geometry.lens_kernels import Lens

Array = np.ndarray

AHEAD = 1e-9
"""Metres of depth, from which on x / z and y / z are used."""

MARGIN = 1.1
"""Times the largest radius that the image has on the normalised plane: up to there corners are said to have an image.
Beyond, the lens may bend too much for the image of a corner to tell anything."""

SLACK = 0.05
"""Pixels that rays may be off their image points, because they are taken between others, and corners' images."""

FEW = 3
"""Columns of a triangle's box, up to which every ray in it is tried."""

NEARER = 1.0 + 1e-9
"""Times the other's inverse depth: surfaces that lie in each other do not hide each other."""

OUTSIDE, ROUND, CUT = 0, 1, 2
"""What a shape is to a camera: all beyond the near plane; with the camera inside; cut by the near plane."""


class Shapes(NamedTuple):
    """`shape_stack.ShapeStack` as the kernels read it.

    Attributes:
        vertices: (3, v).
        faces: (3, f).
        planes: (4, f).
        sides: (f,) the square of each face's longest side.
    """

    vertices: Array
    faces: Array
    planes: Array
    sides: Array
    first_vertex: Array
    first_face: Array
    Ts_world_bound: Array
    halves: Array


class Placed(NamedTuple):
    """The shapes of one frame, as its camera sees them; overwritten frame by frame.

    Attributes:
        points: (3, v) camera coordinates of the vertices.
        image: (2, v) their image coordinates; the first is NaN where they have none.
        nearness: (v,) the square of their inverse depth.
        listed: (f,) the faces to draw, from `first_face` on for each shape.
        reach: (5, f) the least and largest u, and the least and largest v, of those faces, in the order of `listed`,
            infinite where a corner has no image; and by how much they may be off the triangles of the corners' images.
        counts: (b,) how many faces are listed.
        kinds: (b,) OUTSIDE, ROUND or CUT.
    """

    points: Array
    image: Array
    nearness: Array
    listed: Array
    reach: Array
    counts: Array
    kinds: Array


class Frustum(NamedTuple):
    """What of the normalised plane an image shows: the largest radius, the least and largest x, and y."""

    radius: float
    low_x: float
    high_x: float
    low_y: float
    high_y: float


class Grid(NamedTuple):
    """Rays row by row, at the image points (u + j du, v + i dv)."""

    u: float
    v: float
    du: float
    dv: float
    rows: int
    columns: int


@part
def room(shapes: Shapes) -> Placed:
    """Room for the shapes of a frame."""
    v, f, b = shapes.vertices.shape[1], shapes.faces.shape[1], len(shapes.halves)
    return Placed(
        np.empty((3, v)),
        np.empty((2, v)),
        np.empty(v),
        np.empty(f, np.int64),
        np.empty((5, f)),
        np.zeros(b, np.int64),
        np.zeros(b, np.int64),
    )


@part
def place_bounds(T_world_camera: Array, shapes: Shapes, depth: Array, sides: Array) -> None:
    """The depths (b, 2) along the optical axis between which each shape's bound lies, and beyond which of its six
    faces the camera is, as the bits of `sides` (b,): bit 2 i for the face at +half of axis i, bit 2 i + 1 at -half."""
    Ts, halves = shapes.Ts_world_bound, shapes.halves
    for b in range(len(halves)):
        z, reach = 0.0, 0.0
        sides[b] = 0
        for i in range(3):
            o, a = 0.0, 0.0
            for j in range(3):
                o += Ts[b, j, i] * (T_world_camera[j, 3] - Ts[b, j, 3])
                a += Ts[b, j, i] * T_world_camera[j, 2]
            z -= a * o
            reach += abs(a) * halves[b, i]
            sides[b] |= (o > halves[b, i]) << (2 * i) | (o < -halves[b, i]) << (2 * i + 1)
        depth[b, 0], depth[b, 1] = z - reach, z + reach


@part
def surrounds(T_world_camera: Array, shapes: Shapes, b: int) -> bool:
    """Whether the camera is inside a shape: whether its faces fill the whole sphere of directions, or several (van
    Oosterom and Strackee, The Solid Angle of a Plane Triangle, 1983)."""
    vertices, faces = shapes.vertices, shapes.faces
    px, py, pz = T_world_camera[0, 3], T_world_camera[1, 3], T_world_camera[2, 3]
    angle = 0.0
    for f in range(shapes.first_face[b], shapes.first_face[b + 1]):
        i, j, k = faces[0, f], faces[1, f], faces[2, f]
        ax, ay, az = vertices[0, i] - px, vertices[1, i] - py, vertices[2, i] - pz
        bx, by, bz = vertices[0, j] - px, vertices[1, j] - py, vertices[2, j] - pz
        cx, cy, cz = vertices[0, k] - px, vertices[1, k] - py, vertices[2, k] - pz
        a = math.sqrt(ax * ax + ay * ay + az * az)
        b_ = math.sqrt(bx * bx + by * by + bz * bz)
        c = math.sqrt(cx * cx + cy * cy + cz * cz)
        volume = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
        below = a * b_ * c
        below += (ax * bx + ay * by + az * bz) * c + (bx * cx + by * cy + bz * cz) * a
        below += (cx * ax + cy * ay + cz * az) * b_
        angle += math.atan2(volume, below)
    return abs(angle) > math.pi


@part
def place_vertices(
    T_world_camera: Array, lens: Lens, limit: float, vertices: Array, start: int, end: int, placed: Placed
) -> None:
    """The vertices from `start` to `end` in camera coordinates and in the image (camera.pixels_from_normalised); they
    have an image up to a radius whose square is `limit`."""
    points, image, nearness = placed.points, placed.image, placed.nearness
    r00, r01, r02 = T_world_camera[0, 0], T_world_camera[1, 0], T_world_camera[2, 0]
    r10, r11, r12 = T_world_camera[0, 1], T_world_camera[1, 1], T_world_camera[2, 1]
    r20, r21, r22 = T_world_camera[0, 2], T_world_camera[1, 2], T_world_camera[2, 2]
    px, py, pz = T_world_camera[0, 3], T_world_camera[1, 3], T_world_camera[2, 3]
    # Short loops that each do one thing: the processor takes several vertices at a time.
    for i in range(start, end):
        x, y, z = vertices[0, i] - px, vertices[1, i] - py, vertices[2, i] - pz
        points[0, i] = r00 * x + r01 * y + r02 * z
        points[1, i] = r10 * x + r11 * y + r12 * z
        points[2, i] = r20 * x + r21 * y + r22 * z
    k1, k2, k3, k4, p1, p2 = lens.k1, lens.k2, lens.k3, lens.k4, lens.p1, lens.p2
    fx, fy, cx, cy = lens.fx, lens.fy, lens.cx, lens.cy
    if lens.fisheye:
        for i in range(start, end):
            inverse = 1.0 / max(points[2, i], AHEAD)
            x, y = points[0, i] * inverse, points[1, i] * inverse
            r2 = x * x + y * y
            r = math.sqrt(r2)
            angle = math.atan(r)
            t2 = angle * angle
            scale = angle * (1.0 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4)))) / r if r > 1e-12 else 1.0
            seen = (points[2, i] > AHEAD) & (r2 < limit)
            image[0, i] = fx * x * scale + cx if seen else np.nan
            image[1, i] = fy * y * scale + cy
            nearness[i] = inverse * inverse
    else:
        for i in range(start, end):
            inverse = 1.0 / max(points[2, i], AHEAD)
            x, y = points[0, i] * inverse, points[1, i] * inverse
            r2 = x * x + y * y
            radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
            seen = (points[2, i] > AHEAD) & (r2 < limit)
            u = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)
            image[0, i] = fx * u + cx if seen else np.nan
            image[1, i] = fy * (y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y) + cy
            nearness[i] = inverse * inverse


@part
def place_faces(
    faces: Array, sides: Array, bend: float, first: int, end: int, placed: Placed
) -> None:
    """Where in the image the listed faces from `first` to `end` may be met; `bend`: pixels by which the image of a side
    is off its chord, for the square of its length a metre before the camera."""
    image, nearness, listed, reach = placed.image, placed.nearness, placed.listed, placed.reach
    for k in range(first, end):
        f = listed[k]
        a, b, c = faces[0, f], faces[1, f], faces[2, f]
        off = bend * sides[f] * max(nearness[a], max(nearness[b], nearness[c])) + SLACK
        ua, ub, uc, va, vb, vc = image[0, a], image[0, b], image[0, c], image[1, a], image[1, b], image[1, c]
        known = ua + ub + uc == ua + ub + uc
        reach[0, k] = min(ua, min(ub, uc)) - off if known else -np.inf
        reach[1, k] = max(ua, max(ub, uc)) + off if known else np.inf
        reach[2, k] = min(va, min(vb, vc)) - off if known else -np.inf
        reach[3, k] = max(va, max(vb, vc)) + off if known else np.inf
        reach[4, k] = off


@part
def place_shape(
    T_world_camera: Array, lens: Lens, bend: float, frustum: Frustum, shapes: Shapes, b: int, near: float, within: bool, placed: Placed
) -> None:
    """One shape as the camera sees it; `bend`: bound on the second derivative of a straight line's image, pixels, where
    corners have an image; `within`: whether the camera is in the shape's bound."""
    start, end = shapes.first_vertex[b], shapes.first_vertex[b + 1]
    limit = (MARGIN * frustum.radius) ** 2
    place_vertices(T_world_camera, lens, limit, shapes.vertices, start, end, placed)
    nearest = np.inf
    for i in range(start, end):
        nearest = placed.points[2, i] if placed.points[2, i] < nearest else nearest
    kind = OUTSIDE if nearest >= near else CUT
    if within and surrounds(T_world_camera, shapes, b):
        kind = ROUND
    first, listed, planes = shapes.first_face[b], placed.listed, shapes.planes
    n = first
    if kind == OUTSIDE:
        # Only what faces the camera: a closed surface is first met from outside.
        px, py, pz = T_world_camera[0, 3], T_world_camera[1, 3], T_world_camera[2, 3]
        for f in range(first, shapes.first_face[b + 1]):
            listed[n] = f
            n += 1 if planes[0, f] * px + planes[1, f] * py + planes[2, f] * pz + planes[3, f] > 0.0 else 0
    else:
        n = shapes.first_face[b + 1]
        for f in range(first, n):
            listed[f] = f
    # On the normalised plane a side is as long as in space times sqrt(1 + r^2) / z, at most.
    place_faces(shapes.faces, shapes.sides, 0.125 * bend * (1.0 + limit), first, n, placed)
    placed.counts[b], placed.kinds[b] = n - first, kind


@part
def trim(image: Array, i: int, j: int, m: int, off: float, grid: Grid, bounds: Array) -> None:
    """Between which columns of a row may be what is `off` pixels at most from the triangle of three vertices' images:
    for each of its sides from bounds[0] + bounds[1] row to bounds[2] + bounds[3] row."""
    ui, uj, um, vi, vj, vm = image[0, i], image[0, j], image[0, m], image[1, i], image[1, j], image[1, m]
    turned = 1.0 if (uj - ui) * (vm - vi) >= (vj - vi) * (um - ui) else -1.0
    for s in range(3):
        # The points (u, v) on the triangle's side of one of its sides: a u + b v + c >= 0.
        a, b = turned * (vi - vj), turned * (uj - ui)
        c = (abs(a) + abs(b)) * off - a * ui - b * vi
        slope, place = -b * grid.dv / (a * grid.du), -(c + b * grid.v + a * grid.u) / (a * grid.du)
        bounds[s, 0], bounds[s, 1], bounds[s, 2], bounds[s, 3] = -np.inf, 0.0, np.inf, 0.0
        if a > 0.0:
            bounds[s, 0], bounds[s, 1] = place, slope
        elif a < 0.0:
            bounds[s, 2], bounds[s, 3] = place, slope
        ui, uj, um, vi, vj, vm = uj, um, ui, vj, vm, vi


@part
def draw(
    shapes: Shapes,
    placed: Placed,
    b: int,
    side: float,
    near: float,
    frustum: Frustum,
    grid: Grid,
    xs: Array,
    ys: Array,
    drawn: Array,
) -> None:
    """Raise the inverse depths `drawn` of a grid's rays to those at which they meet a shape's listed faces beyond the
    near plane: from outside where `side` is 1, from inside where it is -1, either where it is 0."""
    P, image, faces, reach = placed.points, placed.image, shapes.faces, placed.reach
    bounds = np.empty((3, 4))
    furthest, rows, columns = 1.0 / near, grid.rows, grid.columns
    u, v, by_du, by_dv = grid.u, grid.v, 1.0 / grid.du, 1.0 / grid.dv
    last_row, last_column = rows - 1.0, columns - 1.0
    low_x, high_x, low_y, high_y = frustum.low_x, frustum.high_x, frustum.low_y, frustum.high_y
    first = shapes.first_face[b]
    for k in range(first, first + placed.counts[b]):
        first_column = math.ceil(max((reach[0, k] - u) * by_du, 0.0))
        end_column = math.floor(min((reach[1, k] - u) * by_du, last_column)) + 1
        first_row = math.ceil(max((reach[2, k] - v) * by_dv, 0.0))
        end_row = math.floor(min((reach[3, k] - v) * by_dv, last_row)) + 1
        if first_row >= end_row or first_column >= end_column:
            continue
        f = placed.listed[k]
        i, j, m = faces[0, f], faces[1, f], faces[2, f]
        xi, yi, zi = P[0, i], P[1, i], P[2, i]
        xj, yj, zj = P[0, j], P[1, j], P[2, j]
        xm, ym, zm = P[0, m], P[1, m], P[2, m]
        if reach[1, k] == np.inf:
            if (
                max(zi, max(zj, zm)) < near
                or min(xi - high_x * zi, min(xj - high_x * zj, xm - high_x * zm)) > 0.0
                or max(xi - low_x * zi, max(xj - low_x * zj, xm - low_x * zm)) < 0.0
                or min(yi - high_y * zi, min(yj - high_y * zj, ym - high_y * zm)) > 0.0
                or max(yi - low_y * zi, max(yj - low_y * zj, ym - low_y * zm)) < 0.0
            ):
                continue
        # Of two triangles with a side in common each ray beside it is in one: what is told of the side by one is what
        # is told by the other with the sign turned, to the last bit.
        ax, ay, az = yi * zj - zi * yj, zi * xj - xi * zj, xi * yj - yi * xj
        bx, by, bz = yj * zm - zj * ym, zj * xm - xj * zm, xj * ym - yj * xm
        cx, cy, cz = ym * zi - zm * yi, zm * xi - xm * zi, xm * yi - ym * xi
        volume = xi * bx + yi * by + zi * bz
        if volume * side > 0.0 or volume == 0.0:
            continue
        if volume < 0.0:
            ax, ay, az, bx, by, bz, cx, cy, cz = -ax, -ay, -az, -bx, -by, -bz, -cx, -cy, -cz
            volume = -volume
        scale = 1.0 / volume
        # A long thin triangle fills little of its box: within it, each side bounds the columns of a row.
        narrow = end_column - first_column > FEW and end_row > first_row + 1 and reach[1, k] != np.inf
        if narrow:
            trim(image, i, j, m, reach[4, k], grid, bounds)
        for row in range(first_row, end_row):
            start, end = row * columns + first_column, row * columns + end_column
            if narrow:
                low, high = float(first_column), end_column - 1.0
                for s in range(3):
                    low = max(low, bounds[s, 0] + bounds[s, 1] * row)
                    high = min(high, bounds[s, 2] + bounds[s, 3] * row)
                if low > high:
                    continue
                start, end = row * columns + math.ceil(low), row * columns + math.floor(high) + 1
            for ray in range(start, end):
                x, y = xs[ray], ys[ray]
                past_a, past_b, past_c = ax * x + ay * y + az, bx * x + by * y + bz, cx * x + cy * y + cz
                met = (past_a + past_b + past_c) * scale
                hit = (past_a >= 0.0) & (past_b >= 0.0) & (past_c >= 0.0) & (met <= furthest) & (met > drawn[ray])
                drawn[ray] = met if hit else drawn[ray]


@part
def draw_shape(
    shapes: Shapes,
    placed: Placed,
    b: int,
    near: float,
    frustum: Frustum,
    grid: Grid,
    xs: Array,
    ys: Array,
    drawn: Array,
) -> None:
    """Raise the inverse depths `drawn` of a grid's rays to those at which they meet a shape, as box labels have it: it
    is cut off at the near plane, and closed there; from within it, its far side is met."""
    kind = placed.kinds[b]
    if kind == OUTSIDE:
        draw(shapes, placed, b, 1.0, near, frustum, grid, xs, ys, drawn)
    elif kind == ROUND:
        draw(shapes, placed, b, 0.0, near, frustum, grid, xs, ys, drawn)
    else:
        n = grid.rows * grid.columns
        front, back = np.zeros(n), np.zeros(n)
        draw(shapes, placed, b, 1.0, near, frustum, grid, xs, ys, front)
        draw(shapes, placed, b, -1.0, near, frustum, grid, xs, ys, back)
        for ray in range(n):
            # What is left before it is entered was entered nearer than the near plane.
            met = front[ray] if back[ray] <= front[ray] * NEARER else 1.0 / near
            drawn[ray] = max(drawn[ray], met)


@part
def cast_grid(
    rays: Array,
    spacing: float,
    u0: float,
    v0: float,
    du: float,
    dv: float,
    rows: int,
    columns: int,
    xs: Array,
    ys: Array,
) -> None:
    """The rays of rows x columns image points (u0 + (j + 1/2) du, v0 + (i + 1/2) dv), between the four nearest of
    `rays` (2, h, w), written row by row to `xs` and `ys`."""
    start = min(max(int(u0 / spacing), 0), rays.shape[2] - 2)
    end = min(max(int((u0 + columns * du) / spacing), 0), rays.shape[2] - 2) + 2
    line_x, line_y = np.empty(end - start), np.empty(end - start)
    for i in range(rows):
        place = (v0 + (i + 0.5) * dv) / spacing
        row = min(max(int(place), 0), rays.shape[1] - 2)
        down = place - row
        for j in range(end - start):
            line_x[j] = rays[0, row, start + j] + down * (rays[0, row + 1, start + j] - rays[0, row, start + j])
            line_y[j] = rays[1, row, start + j] + down * (rays[1, row + 1, start + j] - rays[1, row, start + j])
        for j in range(columns):
            place = (u0 + (j + 0.5) * du) / spacing
            k = min(max(int(place), start), end - 2) - start
            right = place - (k + start)
            xs[i * columns + j] = line_x[k] + right * (line_x[k + 1] - line_x[k])
            ys[i * columns + j] = line_y[k] + right * (line_y[k + 1] - line_y[k])


@part
def copy_rays(lattice: Array, row: int, column: int, rows: int, columns: int, xs: Array, ys: Array) -> None:
    """A part of a lattice (2, h, w), row by row, written to `xs` and `ys`."""
    for i in range(rows):
        for j in range(columns):
            xs[i * columns + j] = lattice[0, row + i, column + j]
            ys[i * columns + j] = lattice[1, row + i, column + j]


@part
def crops_of(bbox: Array, step: float, height: int, width: int, crops: Array) -> None:
    """The parts of the lattice, a ray in the middle of every `step` x `step` pixels, that boxes (b, 4) hold, written to
    `crops` (b, 4): first row, first column, rows, columns; none where a box is NaN."""
    for b in range(len(bbox)):
        if math.isnan(bbox[b, 0]):
            crops[b] = 0
            continue
        column = max(math.ceil(bbox[b, 0] / step - 0.5), 0)
        row = max(math.ceil(bbox[b, 1] / step - 0.5), 0)
        crops[b, 0], crops[b, 1] = row, column
        crops[b, 2] = max(min(math.floor(bbox[b, 3] / step - 0.5) + 1, height) - row, 0)
        crops[b, 3] = max(min(math.floor(bbox[b, 2] / step - 0.5) + 1, width) - column, 0)


@part
def hide(seen: Array, crop: Array, other: Array, crop_of_other: Array, hidden: Array) -> None:
    """Mark those of a shape's rays, on its part of the lattice, that another meets first."""
    row, column = max(crop[0], crop_of_other[0]), max(crop[1], crop_of_other[1])
    end_row = min(crop[0] + crop[2], crop_of_other[0] + crop_of_other[2])
    columns = min(crop[1] + crop[3], crop_of_other[1] + crop_of_other[3]) - column
    for i in range(row, end_row):
        here = (i - crop[0]) * crop[3] + column - crop[1]
        there = (i - crop_of_other[0]) * crop_of_other[3] + column - crop_of_other[1]
        for j in range(columns):
            hidden[here + j] |= other[there + j] > seen[here + j] * NEARER


@part
def share_left(seen: Array, hidden: Array, n: int) -> float:
    """The share that is not hidden of the rays that meet a shape; NaN where none does."""
    met, left = 0, 0
    for ray in range(n):
        met += 1 if seen[ray] > 0.0 else 0
        left += 1 if (seen[ray] > 0.0) & (not hidden[ray]) else 0
    return left / met if met > 0 else np.nan


@entry
def visible_shares(
    Ts_world_camera: Array,
    lens: Lens,
    bend: float,
    frustum: Frustum,
    shapes: Shapes,
    beyond: Array,
    near: float,
    lattice: Array,
    rays: Array,
    spacing: float,
    bbox: Array,
    step: float,
    fewest: int,
    visible: Array,
) -> None:
    """The share of each shape's rays that reach it before any other shape, written to `visible` (n, b).

    As `ray_kernels.visible_shares`, but that shapes on which the `lattice` (2, h, w), a ray in the middle of every
    `step` x `step` pixels, has `fewest` rays along each side, are looked at on it, and so are drawn but once a frame.
    """
    boxes, height, width = len(shapes.halves), lattice.shape[1], lattice.shape[2]
    placed = room(shapes)
    depth, sides = np.empty((boxes, 2)), np.empty(boxes, np.int64)
    others, is_placed, is_drawn = np.empty(boxes + 1, np.int64), np.empty(boxes, np.bool_), np.empty(boxes, np.bool_)
    crops, starts = np.empty((boxes, 4), np.int64), np.zeros(boxes + 1, np.int64)
    layers, size = np.empty(0), height * width
    xs, ys, seen, hidden = np.empty(size), np.empty(size), np.empty(size), np.empty(size, np.bool_)
    for frame in range(len(Ts_world_camera)):
        T = Ts_world_camera[frame]
        place_bounds(T, shapes, depth, sides)
        is_placed[:], is_drawn[:] = False, False
        crops_of(bbox[frame], step, height, width, crops)
        for b in range(boxes):
            starts[b + 1] = starts[b] + crops[b, 2] * crops[b, 3]
        if starts[boxes] > len(layers):
            layers = np.empty(2 * starts[boxes])
        for b in range(boxes):
            u0, v0, u1, v1 = bbox[frame, b, 0], bbox[frame, b, 1], bbox[frame, b, 2], bbox[frame, b, 3]
            visible[frame, b] = np.nan if math.isnan(u0) else 1.0
            n = 0
            for c in range(boxes):
                # A plane that parts two bounds tells which of the shapes cannot be before the other.
                if (
                    c != b
                    and depth[c, 0] < depth[b, 1]
                    and beyond[b, c] & ~sides[b] == 0
                    and beyond[c, b] & sides[c] == 0
                    and bbox[frame, c, 0] < u1
                    and bbox[frame, c, 2] > u0
                    and bbox[frame, c, 1] < v1
                    and bbox[frame, c, 3] > v0
                ):
                    if not is_placed[c]:
                        place_shape(T, lens, bend, frustum, shapes, c, near, sides[c] == 0, placed)
                        is_placed[c] = True
                    # A shape round the camera hides nothing: what it stands for is no solid block where the camera is.
                    if placed.kinds[c] != ROUND:
                        others[n] = c
                        n += 1
            if n == 0:
                continue
            if not is_placed[b]:
                place_shape(T, lens, bend, frustum, shapes, b, near, sides[b] == 0, placed)
                is_placed[b] = True
            share = np.nan
            if crops[b, 2] >= fewest and crops[b, 3] >= fewest:
                others[n] = b
                for k in range(n + 1):
                    c = others[k]
                    if not is_drawn[c]:
                        row, column, rows, columns = crops[c, 0], crops[c, 1], crops[c, 2], crops[c, 3]
                        grid = Grid((column + 0.5) * step, (row + 0.5) * step, step, step, rows, columns)
                        copy_rays(lattice, row, column, rows, columns, xs, ys)
                        layer = layers[starts[c] : starts[c + 1]]
                        layer[:] = 0.0
                        draw_shape(shapes, placed, c, near, frustum, grid, xs, ys, layer)
                        is_drawn[c] = True
                layer = layers[starts[b] : starts[b + 1]]
                hidden[: len(layer)] = False
                for k in range(n):
                    c = others[k]
                    hide(layer, crops[b], layers[starts[c] : starts[c + 1]], crops[c], hidden)
                share = share_left(layer, hidden, len(layer))
            finer = 1
            while math.isnan(share) and finer <= 4:
                rows = max(math.ceil((v1 - v0) * finer / step), fewest)
                columns = max(math.ceil((u1 - u0) * finer / step), fewest)
                du, dv, size = (u1 - u0) / columns, (v1 - v0) / rows, rows * columns
                if size > len(seen):
                    xs, ys, seen, hidden = np.empty(size), np.empty(size), np.empty(size), np.empty(size, np.bool_)
                cast_grid(rays, spacing, u0, v0, du, dv, rows, columns, xs, ys)
                grid = Grid(u0 + 0.5 * du, v0 + 0.5 * dv, du, dv, rows, columns)
                own, other = np.zeros(size), np.zeros(size)
                draw_shape(shapes, placed, b, near, frustum, grid, xs, ys, own)
                for k in range(n):
                    draw_shape(shapes, placed, others[k], near, frustum, grid, xs, ys, other)
                for ray in range(size):
                    hidden[ray] = other[ray] > own[ray] * NEARER
                share = share_left(own, hidden, size)
                finer *= 4
            visible[frame, b] = 1.0 if math.isnan(share) else share
