"""The compiled loops behind `occlusion.py`: rays against the slabs of boxes."""

import math

import numpy as np

from ars_web.geometry.compiled import entry, part

Array = np.ndarray


@part
def place_boxes(
    T_world_camera: Array, Ts_world_box: Array, halves: Array, near: float, planes: Array, depth: Array, sides: Array
) -> None:
    """Each box's faces as a camera sees them, written to `planes` (b, 9, 3); the boxes' `depth`s (b, 2) along the
    optical axis, of which the first is minus infinity where the camera is inside; and beyond which of a box's six
    faces the camera is, as the bits of `sides` (b,): bit 2 i for the face at +half of axis i, bit 2 i + 1 at -half.

    With A the camera's rotation in the box's frame and o its place there, the ray t (x, y, 1) crosses a face at
    p = +-half of axis i where t A_i . (x, y, 1) = p - o_i: its inverse depth 1 / t is linear in x and y. Rows 0 to 2
    of `planes` are the faces of the three axes through which rays enter, no nearer than `near`; rows 3 to 8 those
    through which they leave.
    """
    a = np.empty(3)
    for b in range(len(halves)):
        z, reach, inside = 0.0, 0.0, True
        sides[b] = 0
        for i in range(3):
            o = 0.0
            for j in range(3):
                o += Ts_world_box[b, j, i] * (T_world_camera[j, 3] - Ts_world_box[b, j, 3])
                a[j] = 0.0
                for k in range(3):
                    a[j] += Ts_world_box[b, k, i] * T_world_camera[k, j]
            z -= a[2] * o
            reach += abs(a[2]) * halves[b, i]
            within = abs(o) < halves[b, i]
            inside = inside and within
            sides[b] |= (o > halves[b, i]) << (2 * i) | (o < -halves[b, i]) << (2 * i + 1)
            # The face on the camera's side, and the far one.
            side = 1.0 if o >= 0.0 else -1.0
            to_face = side * max(abs(halves[b, i] - abs(o)), 1e-12) * (1.0 if within else -1.0)
            to_far_face = -side * (halves[b, i] + abs(o))
            for j in range(3):
                planes[b, i, j] = (1.0 / near if j == 2 else 0.0) if within else a[j] / to_face
                planes[b, 3 + i, j] = a[j] / to_far_face
                planes[b, 6 + i, j] = a[j] / (to_face if within else to_far_face)
        depth[b, 0], depth[b, 1] = -np.inf if inside else z - reach, z + reach


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
        for j in range(end - start):
            line_x[j] = rays[0, row, start + j] + down * (rays[0, row + 1, start + j] - rays[0, row, start + j])
            line_y[j] = rays[1, row, start + j] + down * (rays[1, row + 1, start + j] - rays[1, row, start + j])
        for j in range(columns):
            k = left[j]
            xs[i * columns + j] = line_x[k] + right[j] * (line_x[k + 1] - line_x[k])
            ys[i * columns + j] = line_y[k] + right[j] * (line_y[k + 1] - line_y[k])


@part
def inverse_depths(
    planes: Array, xs: Array, ys: Array, start: int, end: int, near: float, entries: Array, exits: Array
) -> None:
    """Inverse depths at which rays (x, y, 1) enter and leave a box; both are 0 where they miss it."""
    # All in locals, in one flat row, and no branch on a ray: only then does the processor follow several at a time.
    x0, y0, z0 = planes[0, 0], planes[0, 1], planes[0, 2]
    x1, y1, z1 = planes[1, 0], planes[1, 1], planes[1, 2]
    x2, y2, z2 = planes[2, 0], planes[2, 1], planes[2, 2]
    x3, y3, z3 = planes[3, 0], planes[3, 1], planes[3, 2]
    x4, y4, z4 = planes[4, 0], planes[4, 1], planes[4, 2]
    x5, y5, z5 = planes[5, 0], planes[5, 1], planes[5, 2]
    x6, y6, z6 = planes[6, 0], planes[6, 1], planes[6, 2]
    x7, y7, z7 = planes[7, 0], planes[7, 1], planes[7, 2]
    x8, y8, z8 = planes[8, 0], planes[8, 1], planes[8, 2]
    nearest = 1.0 / near
    for i in range(start, end):
        x, y = xs[i], ys[i]
        entry = min(min(nearest, x0 * x + y0 * y + z0), min(x1 * x + y1 * y + z1, x2 * x + y2 * y + z2))
        leave = max(max(x3 * x + y3 * y + z3, x4 * x + y4 * y + z4), x5 * x + y5 * y + z5)
        leave = max(max(max(x6 * x + y6 * y + z6, x7 * x + y7 * y + z7), x8 * x + y8 * y + z8), leave)
        hit = (entry >= leave) & (entry > 0.0)
        entries[i] = entry if hit else 0.0
        exits[i] = leave if hit else 0.0


@part
def hide(seen: Array, others: Array, start: int, end: int) -> None:
    """Make 0 those inverse depths that lie behind others."""
    for i in range(start, end):
        seen[i] = 0.0 if others[i] > seen[i] else seen[i]


@part
def count(inverse: Array, n: int) -> int:
    """How many of the first n inverse depths are not 0."""
    found = 0
    for i in range(n):
        found += 1 if inverse[i] > 0.0 else 0
    return found


@entry
def visible_shares(
    Ts_world_camera: Array,
    Ts_world_box: Array,
    halves: Array,
    beyond: Array,
    near: float,
    rays: Array,
    spacing: float,
    bbox: Array,
    step: float,
    fewest: int,
    visible: Array,
) -> None:
    """The share of each box's rays that reach it before any other box, written to `visible` (n, b).

    `beyond` (b, b): for box i and j, beyond which of i's six faces all of j lies, as bits in the order of `sides`.

    `rays` (2, h, w): points of the normalised plane at the image coordinates (column, row) * spacing. Each box has
    its own grid of rays over its `bbox` (n, b, 4), a ray every `step` pixels and `fewest` along a side at least.
    """
    boxes = len(halves)
    planes, depth, sides = np.empty((boxes, 9, 3)), np.empty((boxes, 2)), np.empty(boxes, np.int64)
    others = np.empty(boxes, np.int64)
    xs, ys, seen, other, exits = np.empty(0), np.empty(0), np.empty(0), np.empty(0), np.empty(0)
    for frame in range(len(Ts_world_camera)):
        place_boxes(Ts_world_camera[frame], Ts_world_box, halves, near, planes, depth, sides)
        for b in range(boxes):
            u0, v0, u1, v1 = bbox[frame, b, 0], bbox[frame, b, 1], bbox[frame, b, 2], bbox[frame, b, 3]
            visible[frame, b] = np.nan if math.isnan(u0) else 1.0
            n = 0
            for c in range(boxes):
                # A box round the camera hides nothing: what it stands for is no solid block where the camera is.
                # And a plane that parts two boxes tells which of them cannot be before the other.
                if (
                    c != b
                    and depth[c, 0] < depth[b, 1]
                    and depth[c, 0] != -np.inf
                    and beyond[b, c] & ~sides[b] == 0
                    and beyond[c, b] & sides[c] == 0
                    and bbox[frame, c, 0] < u1
                    and bbox[frame, c, 2] > u0
                    and bbox[frame, c, 1] < v1
                    and bbox[frame, c, 3] > v0
                ):
                    others[n] = c
                    n += 1
            if n == 0:
                continue
            for finer in (1, 4):
                rows = max(math.ceil((v1 - v0) * finer / step), fewest)
                columns = max(math.ceil((u1 - u0) * finer / step), fewest)
                du, dv, size = (u1 - u0) / columns, (v1 - v0) / rows, rows * columns
                if size > len(seen):
                    xs, ys = np.empty(size), np.empty(size)
                    seen, other, exits = np.empty(size), np.empty(size), np.empty(size)
                cast_grid(rays, spacing, u0, v0, du, dv, rows, columns, xs, ys)
                inverse_depths(planes[b], xs, ys, 0, size, near, seen, other)
                met = count(seen, size)
                if depth[b, 0] == -np.inf:
                    # From within a box its far side is seen, by all that lies before it.
                    seen, other = other, seen
                for c in others[:n]:
                    start = max(math.floor((bbox[frame, c, 1] - v0) / dv), 0) * columns
                    end = min(math.ceil((bbox[frame, c, 3] - v0) / dv), rows) * columns
                    inverse_depths(planes[c], xs, ys, start, end, near, other, exits)
                    hide(seen, other, start, end)
                if met > 0:
                    visible[frame, b] = count(seen, size) / met
                    break
