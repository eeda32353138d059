"""The compiled loops that place shapes before a camera for `raster_kernels.py`: where in the image they may be met, and
which rays their contours hold.

The image of a side is off its chord by an eighth of the lens's bend times the side's length squared, at most.
"""

import math

import numpy as np

from ars_web.geometry.compiled import part
from ars_web.geometry.lens_kernels import Lens
from ars_web.geometry.raster_records import (
    AHEAD,
    CUT,
    OUTSIDE,
    ROUND,
    SLACK,
    STRAIGHT,
    Array,
    Grid,
    Placed,
    Shapes,
    View,
)


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
        np.empty(f, np.bool_),
    )


@part
def place_bounds(T_world_camera: Array, shapes: Shapes, depth: Array, within: Array) -> None:
    """The depths (b, 2) along the optical axis between which each shape's bound lies, and whether the camera is in it,
    written to `within` (b,)."""
    Ts, halves = shapes.Ts_world_bound, shapes.halves
    for b in range(len(halves)):
        z, reach = 0.0, 0.0
        within[b] = True
        for i in range(3):
            o, a = 0.0, 0.0
            for j in range(3):
                o += Ts[b, j, i] * (T_world_camera[j, 3] - Ts[b, j, 3])
                a += Ts[b, j, i] * T_world_camera[j, 2]
            z -= a * o
            reach += abs(a) * halves[b, i]
            within[b] &= abs(o) < halves[b, i]
        depth[b, 0], depth[b, 1] = z - reach, z + reach


@part
def find_sides(T_world_camera: Array, parting: Array, sides: Array) -> None:
    """On which side of the plane between each two shapes (b, b, 4) the camera is, written to `sides` (b, b): 1 on the
    other's, -1 on the shape's own or in the plane, 0 where there is no plane."""
    x, y, z = T_world_camera[0, 3], T_world_camera[1, 3], T_world_camera[2, 3]
    for b in range(len(parting)):
        for c in range(len(parting)):
            plane = parting[b, c]
            place = plane[0] * x + plane[1] * y + plane[2] * z + plane[3]
            sides[b, c] = 1 if place > 0.0 else (-1 if place <= 0.0 else 0)


@part
def may_hide(c: int, b: int, depth: Array, sides: Array) -> bool:
    """Whether c may be before b somewhere: by their depths, and not if the camera is on b's side of a plane between."""
    # Depths that are equal but for rounding tell nothing.
    return depth[c, 0] <= depth[b, 1] + 1e-12 * abs(depth[b, 1]) and sides[b, c] >= 0 and sides[c, b] <= 0


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
def image_point(lens: Lens, x: float, y: float) -> tuple[float, float]:
    """Image coordinates of a point of the normalised plane within the lens's rim (camera.pixels_from_normalised)."""
    r2 = x * x + y * y
    if lens.fisheye:
        r = math.sqrt(r2)
        angle = math.atan(r)
        t2 = angle * angle
        scale = angle * (1.0 + t2 * (lens.k1 + t2 * (lens.k2 + t2 * (lens.k3 + t2 * lens.k4)))) / max(r, 1e-12)
        if r < 1e-12:
            scale = 1.0
        return lens.fx * x * scale + lens.cx, lens.fy * y * scale + lens.cy
    radial = 1.0 + r2 * (lens.k1 + r2 * (lens.k2 + r2 * lens.k3))
    u = x * radial + 2.0 * lens.p1 * x * y + lens.p2 * (r2 + 2.0 * x * x)
    v = y * radial + lens.p1 * (r2 + 2.0 * y * y) + 2.0 * lens.p2 * x * y
    return lens.fx * u + lens.cx, lens.fy * v + lens.cy


@part
def place_shape(T_world_camera: Array, shapes: Shapes, b: int, near: float, within: bool, placed: Placed) -> None:
    """One shape's vertices in camera coordinates, what kind it is, and which of its faces are turned to the camera;
    `within`: whether the camera is in its bound."""
    r00, r01, r02 = T_world_camera[0, 0], T_world_camera[1, 0], T_world_camera[2, 0]
    r10, r11, r12 = T_world_camera[0, 1], T_world_camera[1, 1], T_world_camera[2, 1]
    r20, r21, r22 = T_world_camera[0, 2], T_world_camera[1, 2], T_world_camera[2, 2]
    px, py, pz = T_world_camera[0, 3], T_world_camera[1, 3], T_world_camera[2, 3]
    start, end = shapes.first_vertex[b], shapes.first_vertex[b + 1]
    xs, ys, zs = shapes.vertices[0][start:end], shapes.vertices[1][start:end], shapes.vertices[2][start:end]
    X, Y, Z = placed.points[0][start:end], placed.points[1][start:end], placed.points[2][start:end]
    # Short loops that count from 0 and do one thing each: the processor takes several vertices at a time.
    for i in range(len(xs)):
        x, y, z = xs[i] - px, ys[i] - py, zs[i] - pz
        X[i] = r00 * x + r01 * y + r02 * z
        Y[i] = r10 * x + r11 * y + r12 * z
        Z[i] = r20 * x + r21 * y + r22 * z
    cut = 0
    for i in range(len(Z)):
        cut += 1 if Z[i] < near else 0
    placed.kinds[b] = CUT if cut > 0 else OUTSIDE
    if within and surrounds(T_world_camera, shapes, b):
        placed.kinds[b] = ROUND
    elif cut == 0:
        start, end = shapes.first_face[b], shapes.first_face[b + 1]
        nx, ny, nz = shapes.planes[0][start:end], shapes.planes[1][start:end], shapes.planes[2][start:end]
        d, front = shapes.planes[3][start:end], placed.front[start:end]
        for f in range(len(d)):
            front[f] = nx[f] * px + ny[f] * py + nz[f] * pz + d[f] > 0.0


@part
def beside(
    P: Array, i: int, j: int, m: int, near: float, low_x: float, high_x: float, low_y: float, high_y: float
) -> bool:
    """Whether no ray within these bounds meets a triangle of three vertices beyond the near plane, because all three
    are on one side of the rays; some may be behind the camera."""
    return (
        max(P[2, i], max(P[2, j], P[2, m])) < near
        or min(P[0, i] - high_x * P[2, i], min(P[0, j] - high_x * P[2, j], P[0, m] - high_x * P[2, m])) > 0.0
        or max(P[0, i] - low_x * P[2, i], max(P[0, j] - low_x * P[2, j], P[0, m] - low_x * P[2, m])) < 0.0
        or min(P[1, i] - high_y * P[2, i], min(P[1, j] - high_y * P[2, j], P[1, m] - high_y * P[2, m])) > 0.0
        or max(P[1, i] - low_y * P[2, i], max(P[1, j] - low_y * P[2, j], P[1, m] - low_y * P[2, m])) < 0.0
    )


@part
def place_images(lens: Lens, view: View, near: float, shapes: Shapes, b: int, placed: Placed) -> None:
    """What `draw` needs of a shape that is placed: where in the image its faces may be met."""
    points, image, nearness, faces, limit = placed.points, placed.image, placed.nearness, shapes.faces, view.limit
    start, end = shapes.first_vertex[b], shapes.first_vertex[b + 1]
    X, Y, Z = points[0][start:end], points[1][start:end], points[2][start:end]
    U, V, near_by = image[0][start:end], image[1][start:end], nearness[start:end]
    for i in range(len(X)):
        inverse = 1.0 / max(Z[i], AHEAD)
        x, y = X[i] * inverse, Y[i] * inverse
        u, v = image_point(lens, x, y)
        U[i] = u if (Z[i] > AHEAD) & (x * x + y * y < limit) else np.nan
        V[i], near_by[i] = v, inverse * inverse
    # On the normalised plane a side is as long as in space times sqrt(1 + r^2) / z, at most.
    bend, outside = 0.125 * view.bend * (1.0 + limit), placed.kinds[b] == OUTSIDE
    listed, reach, n = placed.listed, placed.reach, shapes.first_face[b]
    for f in range(shapes.first_face[b], shapes.first_face[b + 1]):
        # A closed surface is first met from outside.
        if outside and not placed.front[f]:
            continue
        i, j, m = faces[0, f], faces[1, f], faces[2, f]
        ui, uj, um, vi, vj, vm = image[0, i], image[0, j], image[0, m], image[1, i], image[1, j], image[1, m]
        off = bend * shapes.sides[f] * max(nearness[i], max(nearness[j], nearness[m])) + SLACK
        listed[n], reach[4, n] = f, off
        if math.isnan(ui + uj + um):
            if beside(points, i, j, m, near, view.low_x, view.high_x, view.low_y, view.high_y):
                continue
            reach[0, n], reach[1, n], reach[2, n], reach[3, n] = -np.inf, np.inf, -np.inf, np.inf
        else:
            reach[0, n], reach[1, n] = min(ui, min(uj, um)) - off, max(ui, max(uj, um)) + off
            reach[2, n], reach[3, n] = min(vi, min(vj, vm)) - off, max(vi, max(vj, vm)) + off
            if reach[0, n] > lens.width or reach[1, n] < 0.0 or reach[2, n] > lens.height or reach[3, n] < 0.0:
                continue
        n += 1
    placed.counts[b] = n - shapes.first_face[b]


@part
def contour(lens: Lens, view: View, shapes: Shapes, b: int, placed: Placed, pieces: Array, k: int) -> tuple[Array, int]:
    """Append the images, (u, v) to (u, v), of the edges between what of a shape is turned to the camera and what is not
    to `pieces` (k, 4) after the first k; none where one of them is beyond the lens's rim.

    The sum of the edges' turns round a ray is how often the ray enters the shape (contour_kernels.py).
    """
    points, front, start = placed.points, placed.front, k
    first, end = shapes.first_edge[b], shapes.first_edge[b + 1]
    starts, ends = shapes.edges[0][first:end], shapes.edges[1][first:end]
    along, back = shapes.edges[2][first:end], shapes.edges[3][first:end]
    for e in range(len(along)):
        if front[along[e]] == front[back[e]]:
            continue
        i, j = starts[e], ends[e]
        if not front[along[e]]:
            i, j = j, i
        near_i, near_j = 1.0 / points[2, i], 1.0 / points[2, j]
        x0, y0, x1, y1 = points[0, i] * near_i, points[1, i] * near_i, points[0, j] * near_j, points[1, j] * near_j
        furthest = max(x0 * x0 + y0 * y0, x1 * x1 + y1 * y1)
        if furthest >= view.rim:
            return pieces, start
        bend = view.bend if furthest <= view.limit else view.rim_bend
        off = 0.125 * bend * ((x1 - x0) ** 2 + (y1 - y0) ** 2)
        n = math.ceil(math.sqrt(off / STRAIGHT)) if off > STRAIGHT else 1
        if k + n > len(pieces):
            more = np.empty((2 * (k + n), 4))
            more[:k] = pieces[:k]
            pieces = more
        u, v = image_point(lens, x0, y0)
        for s in range(1, n + 1):
            pieces[k, 0], pieces[k, 1] = u, v
            # An edge's end is the next one's start, to the last bit.
            x, y = (x1, y1) if s == n else (x0 + (x1 - x0) * s / n, y0 + (y1 - y0) * s / n)
            u, v = image_point(lens, x, y)
            pieces[k, 2], pieces[k, 3] = u, v
            k += 1
    return pieces, k


@part
def cover(pieces: Array, grid: Grid, turns: Array, covered: Array) -> None:
    """Mark in `covered` those of a grid's rays that a contour runs round."""
    rows, columns = grid.rows, grid.columns
    wide = columns + 1
    turns[: rows * wide] = 0
    by_du, by_dv = 1.0 / grid.du, 1.0 / grid.dv
    for k in range(len(pieces)):
        column, row = (pieces[k, 0] - grid.u) * by_du, (pieces[k, 1] - grid.v) * by_dv
        end_column, end_row = (pieces[k, 2] - grid.u) * by_du, (pieces[k, 3] - grid.v) * by_dv
        turn = 1
        if end_row < row:
            column, row, end_column, end_row, turn = end_column, end_row, column, row, -1
        first = math.ceil(max(row, 0.0))
        last = math.ceil(min(end_row, float(rows)))
        if first >= last:
            continue
        slope = (end_column - column) / (end_row - row)
        for i in range(first, last):
            place = min(max(column + (i - row) * slope, 0.0), float(columns))
            turns[i * wide + math.ceil(place)] += turn
    for i in range(rows):
        around, line, marks = 0, turns[i * wide : (i + 1) * wide], covered[i * columns : (i + 1) * columns]
        for j in range(len(marks)):
            around += line[j]
            marks[j] |= around != 0
