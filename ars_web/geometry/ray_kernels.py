"""The compiled loops behind `occlusion.py`: rays against the slabs of boxes.

Kernels call only kernels of their own file: numba's cache notices a change only in the file of the function that it
keeps.
"""

import math

import numpy as np
from numba import njit

Array = np.ndarray


@njit(error_model="numpy")
def place_boxes(T_world_camera: Array, Ts_world_box: Array, halves: Array, A: Array, o: Array, depth: Array) -> None:
    """Rotations `A` (b, 3, 3) and origins `o` (b, 3) of the camera in each box's frame, and the boxes' `depth`s
    (b, 2) along the optical axis; the first is minus infinity where the camera is inside."""
    for b in range(len(halves)):
        z, reach, inside = 0.0, 0.0, True
        for i in range(3):
            o[b, i] = 0.0
            for j in range(3):
                o[b, i] += Ts_world_box[b, j, i] * (T_world_camera[j, 3] - Ts_world_box[b, j, 3])
                A[b, i, j] = 0.0
                for k in range(3):
                    A[b, i, j] += Ts_world_box[b, k, i] * T_world_camera[k, j]
            z -= A[b, i, 2] * o[b, i]
            reach += abs(A[b, i, 2]) * halves[b, i]
            inside = inside and abs(o[b, i]) < halves[b, i]
        depth[b, 0], depth[b, 1] = -np.inf if inside else z - reach, z + reach


@njit(error_model="numpy", forceinline=True)
def through_slabs(A: Array, o: Array, halves: Array, b: int, x: float, y: float, near: float) -> tuple[float, float]:
    """Depths (entry, exit) of the ray (x, y, 1) through box b, the entry at `near` at least; a miss has
    entry > exit or a NaN."""
    entry, leave = near, np.inf
    for i in range(3):
        inverse = 1.0 / (A[b, i, 0] * x + A[b, i, 1] * y + A[b, i, 2])
        p, q = (-halves[b, i] - o[b, i]) * inverse, (halves[b, i] - o[b, i]) * inverse
        entry, leave = max(entry, min(p, q)), min(leave, max(p, q))
    return entry, leave


@njit(error_model="numpy")
def look_up_rays(rays: Array, spacing: float, u0: float, du: float, v: float, xs: Array, ys: Array, n: int) -> None:
    """The rays of n image points u0 + i du in one row, between the four nearest of `rays` (h, w, 2)."""
    row = min(max(int(v / spacing), 0), rays.shape[0] - 2)
    fy = v / spacing - row
    for i in range(n):
        place = (u0 + i * du) / spacing
        column = min(max(int(place), 0), rays.shape[1] - 2)
        fx = place - column
        a, b, c, d = (1.0 - fy) * (1.0 - fx), (1.0 - fy) * fx, fy * (1.0 - fx), fy * fx
        xs[i] = (
            a * rays[row, column, 0]
            + b * rays[row, column + 1, 0]
            + c * rays[row + 1, column, 0]
            + d * rays[row + 1, column + 1, 0]
        )
        ys[i] = (
            a * rays[row, column, 1]
            + b * rays[row, column + 1, 1]
            + c * rays[row + 1, column, 1]
            + d * rays[row + 1, column + 1, 1]
        )


@njit(cache=True, nogil=True, error_model="numpy")
def visible_shares(
    Ts_world_camera: Array,
    Ts_world_box: Array,
    halves: Array,
    near: float,
    rays: Array,
    spacing: float,
    bbox: Array,
    step: float,
    fewest: int,
    most: int,
    visible: Array,
) -> None:
    """The share of each box's rays that reach it before any other box, written to `visible` (n, b).

    `rays` (h, w, 2): points of the normalised plane at the image coordinates (column, row) * spacing. Each box has
    its own grid of rays over its `bbox`, a ray every `step` pixels, `fewest` along a side at least and `most` at most.
    """
    boxes = len(halves)
    A, o, depth = np.empty((boxes, 3, 3)), np.empty((boxes, 3)), np.empty((boxes, 2))
    others = np.empty(boxes, np.int64)
    xs, ys, own, hidden = np.empty(most), np.empty(most), np.empty(most), np.empty(most, np.bool_)
    for frame in range(len(Ts_world_camera)):
        place_boxes(Ts_world_camera[frame], Ts_world_box, halves, A, o, depth)
        for b in range(boxes):
            u0, v0, u1, v1 = bbox[frame, b, 0], bbox[frame, b, 1], bbox[frame, b, 2], bbox[frame, b, 3]
            visible[frame, b] = np.nan if math.isnan(u0) else 1.0
            n = 0
            for c in range(boxes):
                # A box round the camera hides nothing: what it stands for is no solid block where the camera is.
                if (
                    c != b
                    and depth[c, 0] < depth[b, 1]
                    and depth[c, 0] != -np.inf
                    and bbox[frame, c, 0] < u1
                    and bbox[frame, c, 2] > u0
                    and bbox[frame, c, 1] < v1
                    and bbox[frame, c, 3] > v0
                ):
                    others[n] = c
                    n += 1
            if n == 0:
                continue
            inside = depth[b, 0] == -np.inf
            for finer in (1, 4):
                columns = min(finer * max(math.ceil((u1 - u0) / step), fewest), most)
                rows = min(finer * max(math.ceil((v1 - v0) / step), fewest), most)
                du, dv = (u1 - u0) / columns, (v1 - v0) / rows
                met, free = 0, 0
                for row in range(rows):
                    v = v0 + (row + 0.5) * dv
                    look_up_rays(rays, spacing, u0 + 0.5 * du, du, v, xs, ys, columns)
                    for i in range(columns):
                        entry, leave = through_slabs(A, o, halves, b, xs[i], ys[i], near)
                        hit = entry <= leave
                        # From within a box its far side is seen, by all that lies before it.
                        own[i] = (leave if inside else entry) if hit else -np.inf
                        hidden[i] = not hit
                        met += hit
                    for k in range(n):
                        c = others[k]
                        if not bbox[frame, c, 1] <= v <= bbox[frame, c, 3]:
                            continue
                        first = max(math.floor((bbox[frame, c, 0] - u0) / du), 0)
                        last = min(math.ceil((bbox[frame, c, 2] - u0) / du), columns)
                        for i in range(first, last):
                            entry, leave = through_slabs(A, o, halves, c, xs[i], ys[i], near)
                            hidden[i] |= (entry <= leave) & (entry < own[i])
                    for i in range(columns):
                        free += not hidden[i]
                if met > 0:
                    visible[frame, b] = free / met
                    break
