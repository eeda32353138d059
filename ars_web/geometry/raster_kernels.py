"""The compiled loops behind `shape_occlusion.py` and `instance_masks.py`: triangles on grids of rays.

Shapes are placed by `raster_placing.py` and drawn by `raster_drawing.py`.
"""

import math

import numpy as np

from ars_web.geometry.compiled import entry
from ars_web.geometry.lens_kernels import Lens
from ars_web.geometry.raster_drawing import cast_grid, draw_shape, touch
from ars_web.geometry.raster_placing import (
    contour,
    cover,
    find_sides,
    may_hide,
    place_bounds,
    place_images,
    place_shape,
    room,
)
from ars_web.geometry.raster_records import NEARER, OUTSIDE, ROUND, Array, Grid, Shapes, View

PARTS = {
    "raster_records": "a651c71c63e2f5f62762c0bf7bba78c0252398deaba551a336b7953c4663a5b6",
    "raster_placing": "275392f9452a90b1af7d2c6951b96be2277014e6dcd97eb1e2b8efe2d839ed1e",
    "raster_drawing": "9a60c4febd4a63906686e8e9426f545c4c6ad291b045e9a444585ca74e294d06",
}
"""The SHA-256 of each file that the loops here are made of. numba keeps them until this file changes: who changes one
of those writes down its digest, which a test holds to it, and has the loops compiled anew."""


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
