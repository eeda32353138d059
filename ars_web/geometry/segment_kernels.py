"""The compiled loops behind `hidden_points.py`: segments against trees of triangles."""

import math
from typing import NamedTuple

import numpy as np

from ars_web.geometry.compiled import entry, part

Array = np.ndarray


class Trees(NamedTuple):
    """The triangles of b shapes, each in a tree of boxes along the world's axes.

    Attributes:
        triangles: (f, 3, 3) corners.
        bounds: (m, 6) the least x, y, z, and the largest, of each node.
        links: (m, 3) the node to go on with where a node is not entered, and the triangles of a leaf, from and to; a
            node that is no leaf has none, and its first child follows it.
        first_node: (b + 1,) where each shape's nodes begin.
    """

    triangles: Array
    bounds: Array
    links: Array
    first_node: Array


@part
def passes(bounds: Array, node: int, origin: Array, inverse: Array) -> bool:
    """Whether the segment origin + t direction, t from 0 to 1, meets a node's box; `inverse` is 1 / direction."""
    enter, leave = 0.0, 1.0
    for i in range(3):
        a, b = (bounds[node, i] - origin[i]) * inverse[i], (bounds[node, 3 + i] - origin[i]) * inverse[i]
        # Along a side a segment that lies in it is 0 times infinity, which says nothing.
        if a == a and b == b:
            enter, leave = max(enter, min(a, b)), min(leave, max(a, b))
    return enter <= leave * (1.0 + 1e-12) + 1e-300


@part
def crosses(triangle: Array, origin: Array, direction: Array) -> int:
    """1 where the segment enters through a triangle, -1 where it leaves through it, 0 where it does not meet it
    (Moeller and Trumbore, Fast, Minimum Storage Ray/Triangle Intersection, 1997)."""
    ux, uy, uz = (
        triangle[1, 0] - triangle[0, 0],
        triangle[1, 1] - triangle[0, 1],
        triangle[1, 2] - triangle[0, 2],
    )
    vx, vy, vz = (
        triangle[2, 0] - triangle[0, 0],
        triangle[2, 1] - triangle[0, 1],
        triangle[2, 2] - triangle[0, 2],
    )
    dx, dy, dz = direction[0], direction[1], direction[2]
    px, py, pz = dy * vz - dz * vy, dz * vx - dx * vz, dx * vy - dy * vx
    det = ux * px + uy * py + uz * pz
    if det == 0.0:
        return 0
    sx, sy, sz = origin[0] - triangle[0, 0], origin[1] - triangle[0, 1], origin[2] - triangle[0, 2]
    a = (sx * px + sy * py + sz * pz) / det
    qx, qy, qz = sy * uz - sz * uy, sz * ux - sx * uz, sx * uy - sy * ux
    b = (dx * qx + dy * qy + dz * qz) / det
    t = (vx * qx + vy * qy + vz * qz) / det
    if a < 0.0 or b < 0.0 or a + b > 1.0 or t < 0.0 or t > 1.0:
        return 0
    return 1 if det > 0.0 else -1


@part
def is_cut(trees: Trees, shape: int, origin: Array, direction: Array, inverse: Array) -> bool:
    """Whether a segment enters a shape; its origin must be outside it."""
    node, end = trees.first_node[shape], trees.first_node[shape + 1]
    while node < end:
        if not passes(trees.bounds, node, origin, inverse):
            node = trees.links[node, 0]
            continue
        for k in range(trees.links[node, 1], trees.links[node, 2]):
            if crosses(trees.triangles[k], origin, direction) > 0:
                return True
        node += 1
    return False


@part
def surrounds(trees: Trees, shape: int, point: Array) -> bool:
    """Whether a point is inside a shape: whether its triangles fill the whole sphere of directions, or several (van
    Oosterom and Strackee, The Solid Angle of a Plane Triangle, 1983)."""
    root = trees.first_node[shape]
    for i in range(3):
        if not trees.bounds[root, i] < point[i] < trees.bounds[root, 3 + i]:
            return False
    angle, first, last = 0.0, -1, 0
    for node in range(root, trees.first_node[shape + 1]):
        if trees.links[node, 2] > trees.links[node, 1]:
            first = trees.links[node, 1] if first < 0 else first
            last = trees.links[node, 2]
    corner, length = np.empty((3, 3)), np.empty(3)
    for k in range(first, last):
        for i in range(3):
            length[i] = 0.0
            for j in range(3):
                corner[i, j] = trees.triangles[k, i, j] - point[j]
                length[i] += corner[i, j] ** 2
            length[i] = math.sqrt(length[i])
        a, b, c = corner[0], corner[1], corner[2]
        volume = a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2])
        volume += a[2] * (b[0] * c[1] - b[1] * c[0])
        below = length[0] * length[1] * length[2]
        for i in range(3):
            j, m = (i + 1) % 3, (i + 2) % 3
            along = corner[i, 0] * corner[j, 0] + corner[i, 1] * corner[j, 1] + corner[i, 2] * corner[j, 2]
            below += along * length[m]
        angle += math.atan2(volume, below)
    return abs(angle) > math.pi


@entry
def hidden(centres: Array, points: Array, clearances: Array, trees: Trees, found: Array) -> None:
    """Whether a shape lies between each camera's centre (n, 3) and each point (b, k, 3), up to `clearances` (b,) before
    it, written to `found` (n, b, k)."""
    shapes = len(trees.first_node) - 1
    direction, inverse = np.empty(3), np.empty(3)
    solid, spheres = np.empty(shapes, np.bool_), np.empty((shapes, 4))
    for s in range(shapes):
        root, spheres[s, 3] = trees.first_node[s], 0.0
        for i in range(3):
            spheres[s, i] = 0.5 * (trees.bounds[root, i] + trees.bounds[root, 3 + i])
            spheres[s, 3] += (0.5 * (trees.bounds[root, 3 + i] - trees.bounds[root, i])) ** 2
    for n in range(len(centres)):
        origin = centres[n]
        for s in range(shapes):
            # A shape round the camera hides nothing: what it stands for is no solid block where the camera is.
            solid[s] = not surrounds(trees, s, origin)
        for b in range(points.shape[0]):
            for k in range(points.shape[1]):
                length = 0.0
                for i in range(3):
                    direction[i] = points[b, k, i] - origin[i]
                    length += direction[i] ** 2
                length = math.sqrt(length)
                share = max(1.0 - clearances[b] / length, 0.0) if length > 0.0 else 0.0
                square = 0.0
                for i in range(3):
                    direction[i] *= share
                    inverse[i] = 1.0 / direction[i]
                    square += direction[i] ** 2
                found[n, b, k] = False
                if square == 0.0:
                    continue
                for s in range(shapes):
                    if not solid[s]:
                        continue
                    along, away = 0.0, 0.0
                    for i in range(3):
                        along += (spheres[s, i] - origin[i]) * direction[i]
                    along = min(max(along / square, 0.0), 1.0)
                    for i in range(3):
                        away += (origin[i] + along * direction[i] - spheres[s, i]) ** 2
                    if away <= spheres[s, 3] * (1.0 + 1e-9) and is_cut(trees, s, origin, direction, inverse):
                        found[n, b, k] = True
                        break
