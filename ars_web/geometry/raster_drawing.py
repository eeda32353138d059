"""The compiled loops that draw triangles on grids of rays for `raster_kernels.py`.

With a, b and c a triangle's corners in camera coordinates, the ray d = (x, y, 1) passes them on the sides that the
signs of (a x b) . d, (b x c) . d and (c x a) . d tell, and meets the triangle's plane at the inverse depth that is
their sum over a . (b x c): all linear in x and y, whatever of the triangle is behind the camera (Olano and Greer,
Triangle Scan Conversion using 2D Homogeneous Coordinates, 1997). A lens changes only which rays there are.
"""

import math

import numpy as np

from ars_web.geometry.compiled import part
from ars_web.geometry.raster_records import CUT, FEW, NEARER, ROUND, Array, Grid, Placed, Shapes


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
