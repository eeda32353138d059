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

MARGIN = 1.25
"""Times the largest radius that the image has on the normalised plane: up to there corners are said to have an image.
Beyond, the lens may bend too much for the image of a corner to tell anything."""

SLACK = 0.05
"""Pixels that rays may be off their image points, because they are taken between others, and corners' images."""

STRAIGHT = 0.05
"""Pixels that the chords of bent edges may be off."""

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
        edges: (4, e) as `Mesh.edges`, their vertices and faces counted through all shapes.
        sides: (f,) the square of each face's longest side.
    """

    vertices: Array
    faces: Array
    planes: Array
    edges: Array
    sides: Array
    first_vertex: Array
    first_face: Array
    first_edge: Array
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
        front: (f,) whether a face is turned to the camera; of shapes that are OUTSIDE.
    """

    points: Array
    image: Array
    nearness: Array
    listed: Array
    reach: Array
    counts: Array
    kinds: Array
    front: Array


class View(NamedTuple):
    """What a camera shows of the normalised plane.

    Attributes:
        limit: the square of the radius up to which points are said to have an image: MARGIN times the image's own.
        bend: bound, up to there, on the second derivative of a straight line's image, in pixels.
        rim, rim_bend: the same up to the lens's valid radius.
        low_x, high_x, low_y, high_y: bounds on the image's rays.
    """

    limit: float
    bend: float
    rim: float
    rim_bend: float
    low_x: float
    high_x: float
    low_y: float
    high_y: float


class Grid(NamedTuple):
    """Rays row by row, at the image points (u + j du, v + i dv).

    Attributes:
        first_row, end_row, first_column, end_column: where there is something to draw.
    """

    u: float
    v: float
    du: float
    dv: float
    rows: int
    columns: int
    first_row: int
    end_row: int
    first_column: int
    end_column: int


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


@part
def sides_of(P: Array, i: int, j: int, m: int, sides: Array) -> float:
    """The planes (3, 3) through the camera and a triangle's sides: sides[s] . (x, y, 1) is at least 0 for all three
    where the ray or its opposite meets the triangle. Their sum over the answer's size is the inverse depth; the answer
    is below 0 where the triangle is turned to the camera.

    Of two triangles with a side in common each ray beside it is in one: what is told of the side by one is what is told
    by the other with the sign turned, to the last bit.
    """
    xi, yi, zi = P[0, i], P[1, i], P[2, i]
    xj, yj, zj = P[0, j], P[1, j], P[2, j]
    xm, ym, zm = P[0, m], P[1, m], P[2, m]
    sides[0, 0], sides[0, 1], sides[0, 2] = yi * zj - zi * yj, zi * xj - xi * zj, xi * yj - yi * xj
    sides[1, 0], sides[1, 1], sides[1, 2] = yj * zm - zj * ym, zj * xm - xj * zm, xj * ym - yj * xm
    sides[2, 0], sides[2, 1], sides[2, 2] = ym * zi - zm * yi, zm * xi - xm * zi, xm * yi - ym * xi
    volume = xi * sides[1, 0] + yi * sides[1, 1] + zi * sides[1, 2]
    if volume < 0.0:
        for s in range(3):
            sides[s, 0], sides[s, 1], sides[s, 2] = -sides[s, 0], -sides[s, 1], -sides[s, 2]
    return volume


@part
def misses(sides: Array, low_x: float, high_x: float, low_y: float, high_y: float) -> bool:
    """Whether all rays within these bounds are beyond one of a triangle's sides."""
    for s in range(3):
        a, b = sides[s, 0], sides[s, 1]
        if max(a * low_x, a * high_x) + max(b * low_y, b * high_y) + sides[s, 2] < 0.0:
            return True
    return False


@part
def touch(shapes: Shapes, placed: Placed, b: int, tile: int, bounds: Array, touched: Array) -> None:
    """Mark the tiles of an image that a shape may be in; `bounds` (4, k, l) are those of the rays of each."""
    faces, reach, sides = shapes.faces, placed.reach, np.empty((3, 3))
    down, across = touched.shape
    touched[:] = False
    for k in range(shapes.first_face[b], shapes.first_face[b] + placed.counts[b]):
        if reach[1, k] == np.inf:
            f = placed.listed[k]
            if sides_of(placed.points, faces[0, f], faces[1, f], faces[2, f], sides) != 0.0:
                for i in range(down):
                    for j in range(across):
                        hit = not misses(sides, bounds[0, i, j], bounds[1, i, j], bounds[2, i, j], bounds[3, i, j])
                        touched[i, j] |= hit
            continue
        top, end_row = int(max(reach[2, k], 0.0)) // tile, int(max(reach[3, k], 0.0)) // tile + 1
        left, end_column = int(max(reach[0, k], 0.0)) // tile, int(max(reach[1, k], 0.0)) // tile + 1
        for i in range(top, min(end_row, down)):
            for j in range(left, min(end_column, across)):
                touched[i, j] = True


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
def bounds_of_rays(xs: Array, ys: Array, n: int) -> tuple[float, float, float, float]:
    """The least and largest x, and the least and largest y, of the first n rays; those beyond the lens are NaN."""
    low_x, high_x, low_y, high_y = np.inf, -np.inf, np.inf, -np.inf
    for ray in range(n):
        x, y = xs[ray], ys[ray]
        low_x = x if x < low_x else low_x
        high_x = x if x > high_x else high_x
        low_y = y if y < low_y else low_y
        high_y = y if y > high_y else high_y
    return low_x, high_x, low_y, high_y


@part
def draw(
    shapes: Shapes,
    placed: Placed,
    b: int,
    side: float,
    near: float,
    grid: Grid,
    xs: Array,
    ys: Array,
    drawn: Array,
) -> None:
    """Raise the inverse depths `drawn` of a grid's rays to those at which they meet a shape's listed faces beyond the
    near plane: from outside where `side` is 1, from inside where it is -1, either where it is 0."""
    image, faces, reach = placed.image, shapes.faces, placed.reach
    sides, bounds = np.empty((3, 3)), np.empty((3, 4))
    furthest, rows, columns = 1.0 / near, grid.rows, grid.columns
    u, v, by_du, by_dv = grid.u, grid.v, 1.0 / grid.du, 1.0 / grid.dv
    top, bottom, left, right = grid.first_row, grid.end_row - 1.0, grid.first_column, grid.end_column - 1.0
    low_x, high_x, low_y, high_y = -np.inf, np.inf, -np.inf, np.inf
    first = shapes.first_face[b]
    for k in range(first, first + placed.counts[b]):
        first_column = math.ceil(max((reach[0, k] - u) * by_du, left))
        end_column = math.floor(min((reach[1, k] - u) * by_du, right)) + 1
        first_row = math.ceil(max((reach[2, k] - v) * by_dv, top))
        end_row = math.floor(min((reach[3, k] - v) * by_dv, bottom)) + 1
        if first_row >= end_row or first_column >= end_column:
            continue
        f = placed.listed[k]
        i, j, m = faces[0, f], faces[1, f], faces[2, f]
        volume = sides_of(placed.points, i, j, m, sides)
        if volume * side > 0.0 or volume == 0.0:
            continue
        ax, ay, az = sides[0, 0], sides[0, 1], sides[0, 2]
        bx, by, bz = sides[1, 0], sides[1, 1], sides[1, 2]
        cx, cy, cz = sides[2, 0], sides[2, 1], sides[2, 2]
        scale = 1.0 / abs(volume)
        if reach[1, k] == np.inf:
            if low_x == -np.inf:
                low_x, high_x, low_y, high_y = bounds_of_rays(xs, ys, rows * columns)
            # Nothing but the bounds of the rays tells that none of them is within the triangle.
            if misses(sides, low_x, high_x, low_y, high_y):
                continue
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
            some_x, some_y, some = xs[start:end], ys[start:end], drawn[start:end]
            # Counted from 0, and no branch on a ray: only then does the processor take several at a time.
            for ray in range(len(some)):
                x, y = some_x[ray], some_y[ray]
                past_a, past_b, past_c = ax * x + ay * y + az, bx * x + by * y + bz, cx * x + cy * y + cz
                met = (past_a + past_b + past_c) * scale
                least = min(past_a, min(past_b, past_c))
                met = met if (least >= 0.0) & (met <= furthest) else 0.0
                some[ray] = max(met, some[ray])


@part
def draw_shape(
    shapes: Shapes,
    placed: Placed,
    b: int,
    near: float,
    grid: Grid,
    xs: Array,
    ys: Array,
    drawn: Array,
) -> None:
    """Raise the inverse depths `drawn` of a grid's rays to those at which they meet a shape, as box labels have it: it
    is cut off at the near plane, and closed there; from within it, its far side is met."""
    kind, n = placed.kinds[b], grid.rows * grid.columns
    front, back = drawn, drawn
    if kind == CUT:
        front, back = np.zeros(n), np.zeros(n)
    for second in range(2 if kind == CUT else 1):
        side = 0.0 if kind == ROUND else (-1.0 if second else 1.0)
        draw(shapes, placed, b, side, near, grid, xs, ys, back if second else front)
    if kind == CUT:
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
    left, right = np.empty(columns, np.uint32), np.empty(columns)
    for j in range(columns):
        place = (u0 + (j + 0.5) * du) / spacing
        column = min(max(int(place), start), end - 2)
        left[j], right[j] = column - start, place - column
    for i in range(rows):
        place = (v0 + (i + 0.5) * dv) / spacing
        row = min(max(int(place), 0), rays.shape[1] - 2)
        down = place - row
        over_x, under_x = rays[0, row][start:end], rays[0, row + 1][start:end]
        over_y, under_y = rays[1, row][start:end], rays[1, row + 1][start:end]
        for j in range(end - start):
            line_x[j] = over_x[j] + down * (under_x[j] - over_x[j])
            line_y[j] = over_y[j] + down * (under_y[j] - over_y[j])
        x, y = xs[i * columns : (i + 1) * columns], ys[i * columns : (i + 1) * columns]
        for j in range(columns):
            k = left[j]
            x[j] = line_x[k] + right[j] * (line_x[k + 1] - line_x[k])
            y[j] = line_y[k] + right[j] * (line_y[k + 1] - line_y[k])


@entry
def visible_shares(
    Ts_world_camera: Array,
    lens: Lens,
    view: View,
    shapes: Shapes,
    parting: Array,
    near: float,
    rays: Array,
    spacing: float,
    bbox: Array,
    step: float,
    fewest: int,
    visible: Array,
) -> None:
    """The share of each shape's rays that reach it before any other shape, written to `visible` (n, b); the grids of
    rays are those of `ray_kernels.visible_shares`.

    Where a plane tells that one shape is before the other, only the other's contour is looked at.
    """
    boxes = len(shapes.halves)
    placed = room(shapes)
    depth, sides, others = np.empty((boxes, 2)), np.empty((boxes, boxes), np.int64), np.empty(boxes, np.int64)
    within = np.empty(boxes, np.bool_)
    is_placed, has_images, parted = np.empty(boxes, np.bool_), np.empty(boxes, np.bool_), np.empty(boxes, np.bool_)
    pieces, starts, ends = np.empty((4096, 4)), np.zeros(boxes, np.int64), np.zeros(boxes, np.int64)
    xs, ys, own, other = np.empty(0), np.empty(0), np.empty(0), np.empty(0)
    seen, hidden, turns = np.empty(0, np.bool_), np.empty(0, np.bool_), np.empty(0, np.int32)
    for frame in range(len(Ts_world_camera)):
        T, used = Ts_world_camera[frame], 0
        place_bounds(T, shapes, depth, within)
        find_sides(T, parting, sides)
        is_placed[:], has_images[:] = False, False
        for b in range(boxes):
            u0, v0, u1, v1 = bbox[frame, b, 0], bbox[frame, b, 1], bbox[frame, b, 2], bbox[frame, b, 3]
            visible[frame, b] = np.nan if math.isnan(u0) else 1.0
            n = 0
            for c in range(boxes):
                if (
                    c != b
                    and may_hide(c, b, depth, sides)
                    and bbox[frame, c, 0] < u1
                    and bbox[frame, c, 2] > u0
                    and bbox[frame, c, 1] < v1
                    and bbox[frame, c, 3] > v0
                ):
                    others[n] = c
                    n += 1
            if n == 0:
                continue
            for k in range(n + 1):
                c = others[k] if k < n else b
                if not is_placed[c]:
                    place_shape(T, shapes, c, near, within[c], placed)
                    starts[c], is_placed[c] = used, True
                    if placed.kinds[c] == OUTSIDE:
                        pieces, used = contour(lens, view, shapes, c, placed, pieces, used)
                    ends[c] = used
            by_depth = ends[b] == starts[b]
            for k in range(n):
                c = others[k]
                parted[k] = ends[c] > starts[c] and placed.kinds[b] != ROUND and not may_hide(b, c, depth, sides)
                by_depth = by_depth or not parted[k]
            if by_depth:
                for k in range(n + 1):
                    c = others[k] if k < n else b
                    if not has_images[c] and (k == n or not parted[k]):
                        place_images(lens, view, near, shapes, c, placed)
                        has_images[c] = True
            for finer in (1, 4):
                rows = max(math.ceil((v1 - v0) * finer / step), fewest)
                columns = max(math.ceil((u1 - u0) * finer / step), fewest)
                du, dv, size = (u1 - u0) / columns, (v1 - v0) / rows, rows * columns
                if size > len(own):
                    xs, ys, own, other = np.empty(size), np.empty(size), np.empty(size), np.empty(size)
                    seen, hidden = np.empty(size, np.bool_), np.empty(size, np.bool_)
                if size + rows > len(turns):
                    turns = np.empty(2 * (size + rows), np.int32)
                # Depths are looked at only where the boxes of others meet the shape's, if its contour tells the rest.
                first_row, end_row, first_column, end_column = rows, 0, columns, 0
                for k in range(n):
                    if not parted[k]:
                        c = others[k]
                        first_row = min(first_row, max(math.floor((bbox[frame, c, 1] - v0) / dv), 0))
                        end_row = max(end_row, min(math.ceil((bbox[frame, c, 3] - v0) / dv), rows))
                        first_column = min(first_column, max(math.floor((bbox[frame, c, 0] - u0) / du), 0))
                        end_column = max(end_column, min(math.ceil((bbox[frame, c, 2] - u0) / du), columns))
                if ends[b] == starts[b]:
                    first_row, end_row, first_column, end_column = 0, rows, 0, columns
                u, v = u0 + 0.5 * du, v0 + 0.5 * dv
                grid = Grid(u, v, du, dv, rows, columns, first_row, end_row, first_column, end_column)
                seen[:size], hidden[:size] = False, False
                if by_depth:
                    cast_grid(rays, spacing, u0, v0, du, dv, rows, columns, xs, ys)
                    own[:size], other[:size] = 0.0, 0.0
                for k in range(n + 1):
                    c = others[k] if k < n else b
                    if ends[c] > starts[c] and (k == n or parted[k]):
                        cover(pieces[starts[c] : ends[c]], grid, turns, hidden if k < n else seen)
                    # A shape round the camera hides nothing: what it stands for is no solid block where the camera is.
                    if by_depth and (k == n or (not parted[k] and placed.kinds[c] != ROUND)):
                        draw_shape(shapes, placed, c, near, grid, xs, ys, other if k < n else own)
                if ends[b] == starts[b]:
                    for ray in range(size):
                        seen[ray] = own[ray] > 0.0
                met, left = 0, 0
                for ray in range(size if by_depth else 0):
                    # The rays that only the contour's chords hold have no depth, and are not hidden.
                    hidden[ray] |= (own[ray] > 0.0) & (other[ray] > own[ray] * NEARER)
                for ray in range(size):
                    met += 1 if seen[ray] else 0
                    left += 1 if seen[ray] & (not hidden[ray]) else 0
                if met > 0:
                    visible[frame, b] = left / met
                    break


@entry
def instances(
    T_world_camera: Array,
    lens: Lens,
    view: View,
    shapes: Shapes,
    near: float,
    rays: Array,
    bounds: Array,
    tile: int,
    visible: Array,
    crops: Array,
) -> Array:
    """The nearest shape at the middle of each pixel, written to `visible` (h, w), -1 where none is, and where each
    shape's silhouette is, written to `crops` (b, 5): first row, first column, rows, columns, and where it begins in
    the answer: the silhouettes' pixels, row by row.

    `rays` (2, h, w) are those of the pixels' middles. Pixels are looked at in tiles of `tile` x `tile`, whose rays are
    within `bounds` (4, k, l): the least and largest x, and the least and largest y.
    """
    boxes, (height, width) = len(shapes.halves), visible.shape
    placed, depth, within = room(shapes), np.empty((boxes, 2)), np.empty(boxes, np.bool_)
    place_bounds(T_world_camera, shapes, depth, within)
    xs, ys, drawn = np.empty(tile * tile), np.empty(tile * tile), np.empty(tile * tile)
    nearest, layer = np.zeros((height, width)), np.zeros((height, width))
    pixels, used = np.empty(height * width, np.bool_), 0
    touched = np.empty(bounds.shape[1:], np.bool_)
    visible[:] = -1
    crops[:] = 0
    rounds = 0
    for b in range(boxes):
        if depth[b, 1] >= near:
            place_shape(T_world_camera, shapes, b, near, within[b], placed)
            rounds += 1 if placed.kinds[b] == ROUND else 0
    # A shape round the camera hides nothing: all others come first, and it cannot be nearer than they are.
    for k in range(2 * boxes if rounds else boxes):
        b = k % boxes
        if k == boxes:
            for i in range(height):
                for j in range(width):
                    nearest[i, j] = np.inf if visible[i, j] >= 0 else 0.0
        if depth[b, 1] < near or (placed.kinds[b] == ROUND) != (k >= boxes):
            continue
        place_images(lens, view, near, shapes, b, placed)
        touch(shapes, placed, b, tile, bounds, touched)
        low_row, low_column, high_row, high_column = height, width, -1, -1
        for row in range(0, height, tile):
            for column in range(0, width, tile):
                if not touched[row // tile, column // tile]:
                    continue
                rows, columns = min(tile, height - row), min(tile, width - column)
                drawn[: rows * columns] = 0.0
                for i in range(rows):
                    xs[i * columns : (i + 1) * columns] = rays[0, row + i][column : column + columns]
                    ys[i * columns : (i + 1) * columns] = rays[1, row + i][column : column + columns]
                grid = Grid(column + 0.5, row + 0.5, 1.0, 1.0, rows, columns, 0, rows, 0, columns)
                draw_shape(shapes, placed, b, near, grid, xs, ys, drawn)
                for i in range(rows):
                    line = drawn[i * columns : (i + 1) * columns]
                    layer[row + i][column : column + columns] = line
                    first, last = 0, columns - 1
                    while first < columns and line[first] == 0.0:
                        first += 1
                    if first < columns:
                        while line[last] == 0.0:
                            last -= 1
                        low_row, high_row = min(low_row, row + i), max(high_row, row + i)
                        low_column, high_column = min(low_column, column + first), max(high_column, column + last)
        if high_row < 0:
            continue
        rows, columns = high_row + 1 - low_row, high_column + 1 - low_column
        crops[b, 0], crops[b, 1], crops[b, 2], crops[b, 3] = low_row, low_column, rows, columns
        if used + rows * columns > len(pixels):
            more = np.empty(2 * (used + rows * columns), np.bool_)
            more[:used] = pixels[:used]
            pixels = more
        crops[b, 4] = used
        for i in range(low_row, high_row + 1):
            line, before = layer[i][low_column : high_column + 1], nearest[i][low_column : high_column + 1]
            seen, mask = visible[i][low_column : high_column + 1], pixels[used : used + columns]
            for j in range(len(line)):
                mask[j] = line[j] > 0.0
                nearer = line[j] > before[j] * NEARER
                before[j] = line[j] if nearer else before[j]
                seen[j] = b if nearer else seen[j]
            used += columns
        # Tiles that the next shape does not touch must hold nothing of this one.
        for i in range(low_row, high_row + 1):
            layer[i][low_column : high_column + 1] = 0.0
    return pixels[:used].copy()
