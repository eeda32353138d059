"""The compiled loops behind `shape_occlusion.py` and `instance_masks.py`: triangles on grids of rays.

With a, b and c a triangle's corners in camera coordinates, the ray d = (x, y, 1) passes them on the sides that the
signs of (a x b) . d, (b x c) . d and (c x a) . d tell, and meets the triangle's plane at the inverse depth that is
their sum over a . (b x c): all linear in x and y, whatever of the triangle is behind the camera (Olano and Greer,
Triangle Scan Conversion using 2D Homogeneous Coordinates, 1997). A lens changes only which rays there are.

A grid's rays lie nearly evenly on the normalised plane. Its `fit` says which column and row of an even grid a point
of that plane is in, and by how much the grid's own rays are off that: so a triangle need only be tried with few.
"""

import math
from typing import NamedTuple

import numpy as np

from ars_web.geometry.compiled import entry, part

Array = np.ndarray

AHEAD = 1e-9
"""Metres of depth, from which on x / z and y / z are used."""

NEARER = 1.0 + 1e-9
"""Times the other's inverse depth: surfaces that lie in each other do not hide each other."""

OUTSIDE, ROUND, CUT = 0, 1, 2
"""What a shape is to a camera: all beyond the near plane; with the camera inside; cut by the near plane."""


class Shapes(NamedTuple):
    """`shape_stack.ShapeStack` as the kernels read it."""

    vertices: Array
    faces: Array
    planes: Array
    first_vertex: Array
    first_face: Array
    Ts_world_bound: Array
    halves: Array


class Placed(NamedTuple):
    """The shapes of one frame, as its camera sees them; overwritten frame by frame.

    Attributes:
        X, Y, Z: (v,) camera coordinates of the vertices.
        x, y: (v,) X / Z and Y / Z, used where Z > AHEAD.
        listed: (f,) the faces to draw, from `first_face` on for each shape.
        counts: (b,) how many those are.
        kinds: (b,) OUTSIDE, ROUND or CUT.
        columns, rows: (v,) room for the vertices' places on a grid.
    """

    X: Array
    Y: Array
    Z: Array
    x: Array
    y: Array
    listed: Array
    counts: Array
    kinds: Array
    columns: Array
    rows: Array


@part
def room(shapes: Shapes) -> Placed:
    """Room for the shapes of a frame."""
    v, f, b = len(shapes.vertices), len(shapes.faces), len(shapes.halves)
    return Placed(
        np.empty(v),
        np.empty(v),
        np.empty(v),
        np.empty(v),
        np.empty(v),
        np.empty(f, np.int64),
        np.zeros(b, np.int64),
        np.zeros(b, np.int64),
        np.empty(v),
        np.empty(v),
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
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        ax, ay, az = vertices[i, 0] - px, vertices[i, 1] - py, vertices[i, 2] - pz
        bx, by, bz = vertices[j, 0] - px, vertices[j, 1] - py, vertices[j, 2] - pz
        cx, cy, cz = vertices[k, 0] - px, vertices[k, 1] - py, vertices[k, 2] - pz
        a = math.sqrt(ax * ax + ay * ay + az * az)
        b_ = math.sqrt(bx * bx + by * by + bz * bz)
        c = math.sqrt(cx * cx + cy * cy + cz * cz)
        volume = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
        below = a * b_ * c
        below += (ax * bx + ay * by + az * bz) * c + (bx * cx + by * cy + bz * cz) * a + (cx * ax + cy * ay + cz * az) * b_
        angle += math.atan2(volume, below)
    return abs(angle) > math.pi


@part
def place_shape(T_world_camera: Array, shapes: Shapes, b: int, near: float, within: bool, placed: Placed) -> None:
    """One shape's vertices in camera coordinates, and which of its faces to draw; `within`: whether the camera is in
    its bound."""
    r00, r01, r02 = T_world_camera[0, 0], T_world_camera[1, 0], T_world_camera[2, 0]
    r10, r11, r12 = T_world_camera[0, 1], T_world_camera[1, 1], T_world_camera[2, 1]
    r20, r21, r22 = T_world_camera[0, 2], T_world_camera[1, 2], T_world_camera[2, 2]
    px, py, pz = T_world_camera[0, 3], T_world_camera[1, 3], T_world_camera[2, 3]
    vertices, nearest = shapes.vertices, np.inf
    for i in range(shapes.first_vertex[b], shapes.first_vertex[b + 1]):
        vx, vy, vz = vertices[i, 0] - px, vertices[i, 1] - py, vertices[i, 2] - pz
        X = r00 * vx + r01 * vy + r02 * vz
        Y = r10 * vx + r11 * vy + r12 * vz
        Z = r20 * vx + r21 * vy + r22 * vz
        inverse = 1.0 / max(Z, AHEAD)
        placed.X[i], placed.Y[i], placed.Z[i] = X, Y, Z
        placed.x[i], placed.y[i] = X * inverse, Y * inverse
        nearest = min(nearest, Z)
    kind = OUTSIDE if nearest >= near else CUT
    if within and surrounds(T_world_camera, shapes, b):
        kind = ROUND
    first, n = shapes.first_face[b], 0
    if kind == OUTSIDE:
        # Only what faces the camera: a closed surface is first met from outside.
        planes = shapes.planes
        for f in range(first, shapes.first_face[b + 1]):
            placed.listed[first + n] = f
            n += planes[f, 0] * px + planes[f, 1] * py + planes[f, 2] * pz + planes[f, 3] > 0.0
    else:
        for f in range(first, shapes.first_face[b + 1]):
            placed.listed[f] = f
        n = shapes.first_face[b + 1] - first
    placed.counts[b], placed.kinds[b] = n, kind


@part
def fit_grid(xs: Array, ys: Array, rows: int, columns: int, fit: Array) -> None:
    """How a grid of rays, row by row in `xs` and `ys`, lies on the normalised plane, written to `fit` (12,): a point's
    column fit[0] + fit[1] x + fit[2] y, its row likewise from 3 on, by how much rays are off their column and row,
    and the least and largest x and y."""
    row, column = rows // 2, columns // 2
    start, end = row * columns, row * columns + columns - 1
    over, under = column, (rows - 1) * columns + column
    ax, ay = (xs[end] - xs[start]) / max(columns - 1, 1), (ys[end] - ys[start]) / max(columns - 1, 1)
    bx, by = (xs[under] - xs[over]) / max(rows - 1, 1), (ys[under] - ys[over]) / max(rows - 1, 1)
    if columns == 1 and rows == 1:
        ax, by = 1.0, 1.0
    elif columns == 1:
        ax, ay = by, -bx
    elif rows == 1:
        bx, by = -ay, ax
    over_det = 1.0 / (ax * by - ay * bx)
    middle = row * columns + column
    x0, y0 = xs[middle], ys[middle]
    c1, c2, r1, r2 = by * over_det, -bx * over_det, -ay * over_det, ax * over_det
    c0, r0 = column - c1 * x0 - c2 * y0, row - r1 * x0 - r2 * y0
    off_column, off_row = 0.0, 0.0
    low_x, high_x, low_y, high_y = np.inf, -np.inf, np.inf, -np.inf
    for i in range(rows):
        for j in range(columns):
            x, y = xs[i * columns + j], ys[i * columns + j]
            # Beyond the lens's rim rays are NaN, and every comparison with them is false.
            off_c, off_r = abs(c0 + c1 * x + c2 * y - j), abs(r0 + r1 * x + r2 * y - i)
            off_column = off_c if off_c > off_column else off_column
            off_row = off_r if off_r > off_row else off_row
            low_x = x if x < low_x else low_x
            high_x = x if x > high_x else high_x
            low_y = y if y < low_y else low_y
            high_y = y if y > high_y else high_y
    if not math.isfinite(c0 + c1 + c2 + r0 + r1 + r2):
        c0, c1, c2, r0, r1, r2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        off_column, off_row = np.inf, np.inf
    fit[0], fit[1], fit[2], fit[3], fit[4], fit[5] = c0, c1, c2, r0, r1, r2
    fit[6], fit[7] = off_column + 1e-6, off_row + 1e-6
    fit[8], fit[9], fit[10], fit[11] = low_x, high_x, low_y, high_y


@part
def draw(
    shapes: Shapes,
    placed: Placed,
    b: int,
    side: float,
    near: float,
    xs: Array,
    ys: Array,
    rows: int,
    columns: int,
    fit: Array,
    drawn: Array,
) -> None:
    """Raise the inverse depths `drawn` of a grid's rays to those at which they meet a shape's listed faces beyond the
    near plane: from outside where `side` is 1, from inside where it is -1, either where it is 0."""
    X, Y, Z, x, y, faces = placed.X, placed.Y, placed.Z, placed.x, placed.y, shapes.faces
    at_column, at_row = placed.columns, placed.rows
    c0, c1, c2, r0, r1, r2 = fit[0], fit[1], fit[2], fit[3], fit[4], fit[5]
    for i in range(shapes.first_vertex[b], shapes.first_vertex[b + 1]):
        at_column[i] = c0 + c1 * x[i] + c2 * y[i]
        at_row[i] = r0 + r1 * x[i] + r2 * y[i]
    off_column, off_row, low_x, high_x, low_y, high_y = fit[6], fit[7], fit[8], fit[9], fit[10], fit[11]
    last_row, last_column, furthest = rows - 1.0, columns - 1.0, 1.0 / near
    ahead = placed.kinds[b] == OUTSIDE
    first = shapes.first_face[b]
    for k in range(first, first + placed.counts[b]):
        f = placed.listed[k]
        i, j, m = faces[f, 0], faces[f, 1], faces[f, 2]
        if ahead or (Z[i] > AHEAD and Z[j] > AHEAD and Z[m] > AHEAD):
            low = max(min(at_row[i], min(at_row[j], at_row[m])) - off_row, 0.0)
            high = min(max(at_row[i], max(at_row[j], at_row[m])) + off_row, last_row)
            first_row, end_row = math.ceil(low), math.floor(high) + 1
            low = max(min(at_column[i], min(at_column[j], at_column[m])) - off_column, 0.0)
            high = min(max(at_column[i], max(at_column[j], at_column[m])) + off_column, last_column)
            first_column, end_column = math.ceil(low), math.floor(high) + 1
            if first_row >= end_row or first_column >= end_column:
                continue
        else:
            if (
                max(Z[i], max(Z[j], Z[m])) < near
                or min(X[i] - high_x * Z[i], min(X[j] - high_x * Z[j], X[m] - high_x * Z[m])) > 0.0
                or max(X[i] - low_x * Z[i], max(X[j] - low_x * Z[j], X[m] - low_x * Z[m])) < 0.0
                or min(Y[i] - high_y * Z[i], min(Y[j] - high_y * Z[j], Y[m] - high_y * Z[m])) > 0.0
                or max(Y[i] - low_y * Z[i], max(Y[j] - low_y * Z[j], Y[m] - low_y * Z[m])) < 0.0
            ):
                continue
            first_row, end_row, first_column, end_column = 0, rows, 0, columns
        # Of two triangles with a side in common each ray beside it is in one: what is told of the side by one is what
        # is told by the other with the sign turned, to the last bit.
        ax, ay, az = Y[i] * Z[j] - Z[i] * Y[j], Z[i] * X[j] - X[i] * Z[j], X[i] * Y[j] - Y[i] * X[j]
        bx, by, bz = Y[j] * Z[m] - Z[j] * Y[m], Z[j] * X[m] - X[j] * Z[m], X[j] * Y[m] - Y[j] * X[m]
        cx, cy, cz = Y[m] * Z[i] - Z[m] * Y[i], Z[m] * X[i] - X[m] * Z[i], X[m] * Y[i] - Y[m] * X[i]
        volume = X[i] * bx + Y[i] * by + Z[i] * bz
        if volume * side > 0.0 or volume == 0.0:
            continue
        if volume < 0.0:
            ax, ay, az, bx, by, bz, cx, cy, cz = -ax, -ay, -az, -bx, -by, -bz, -cx, -cy, -cz
            volume = -volume
        scale = 1.0 / volume
        for row in range(first_row, end_row):
            for ray in range(row * columns + first_column, row * columns + end_column):
                rx, ry = xs[ray], ys[ray]
                past_a, past_b, past_c = ax * rx + ay * ry + az, bx * rx + by * ry + bz, cx * rx + cy * ry + cz
                met = (past_a + past_b + past_c) * scale
                hit = (past_a >= 0.0) & (past_b >= 0.0) & (past_c >= 0.0) & (met <= furthest) & (met > drawn[ray])
                drawn[ray] = met if hit else drawn[ray]


@part
def draw_shape(
    shapes: Shapes,
    placed: Placed,
    b: int,
    near: float,
    xs: Array,
    ys: Array,
    rows: int,
    columns: int,
    fit: Array,
    drawn: Array,
    spare: Array,
) -> None:
    """Raise the inverse depths `drawn` of a grid's rays to those at which they meet a shape, as box labels have it: it
    is cut off at the near plane, and closed there; from within it, its far side is met. `spare` (2, n) is written."""
    kind = placed.kinds[b]
    if kind == OUTSIDE:
        draw(shapes, placed, b, 1.0, near, xs, ys, rows, columns, fit, drawn)
    elif kind == ROUND:
        draw(shapes, placed, b, 0.0, near, xs, ys, rows, columns, fit, drawn)
    else:
        n = rows * columns
        front, back = spare[0], spare[1]
        front[:n], back[:n] = 0.0, 0.0
        draw(shapes, placed, b, 1.0, near, xs, ys, rows, columns, fit, front)
        draw(shapes, placed, b, -1.0, near, xs, ys, rows, columns, fit, back)
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


@entry
def visible_shares(
    Ts_world_camera: Array,
    shapes: Shapes,
    beyond: Array,
    near: float,
    rays: Array,
    spacing: float,
    bbox: Array,
    step: float,
    fewest: int,
    visible: Array,
) -> None:
    """The share of each shape's rays that reach it before any other shape, written to `visible` (n, b); everything as
    in `ray_kernels.visible_shares`, where shapes are boxes."""
    boxes = len(shapes.halves)
    placed = room(shapes)
    depth, sides, fit = np.empty((boxes, 2)), np.empty(boxes, np.int64), np.empty(12)
    others, is_placed = np.empty(boxes, np.int64), np.empty(boxes, np.bool_)
    xs, ys, seen, other, spare = np.empty(0), np.empty(0), np.empty(0), np.empty(0), np.empty((2, 0))
    for frame in range(len(Ts_world_camera)):
        T = Ts_world_camera[frame]
        place_bounds(T, shapes, depth, sides)
        is_placed[:] = False
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
                        place_shape(T, shapes, c, near, sides[c] == 0, placed)
                        is_placed[c] = True
                    # A shape round the camera hides nothing: what it stands for is no solid block where the camera is.
                    if placed.kinds[c] != ROUND:
                        others[n] = c
                        n += 1
            if n == 0:
                continue
            if not is_placed[b]:
                place_shape(T, shapes, b, near, sides[b] == 0, placed)
                is_placed[b] = True
            for finer in (1, 4):
                rows = max(math.ceil((v1 - v0) * finer / step), fewest)
                columns = max(math.ceil((u1 - u0) * finer / step), fewest)
                du, dv, size = (u1 - u0) / columns, (v1 - v0) / rows, rows * columns
                if size > len(seen):
                    xs, ys, seen, other = np.empty(size), np.empty(size), np.empty(size), np.empty(size)
                    spare = np.empty((2, size))
                cast_grid(rays, spacing, u0, v0, du, dv, rows, columns, xs, ys)
                fit_grid(xs, ys, rows, columns, fit)
                seen[:size], other[:size] = 0.0, 0.0
                draw_shape(shapes, placed, b, near, xs, ys, rows, columns, fit, seen, spare)
                for k in range(n):
                    draw_shape(shapes, placed, others[k], near, xs, ys, rows, columns, fit, other, spare)
                met, left = 0, 0
                for ray in range(size):
                    met += seen[ray] > 0.0
                    left += (seen[ray] > 0.0) & (other[ray] <= seen[ray] * NEARER)
                if met > 0:
                    visible[frame, b] = left / met
                    break
