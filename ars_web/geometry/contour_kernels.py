"""The compiled loops that find a mesh's contour: the border between what faces a camera and what does not.

The faces of a closed mesh that face a camera, cut at the near plane and closed there again, cover each ray into the
mesh as often as the ray enters it. The border of that cover, on the normalised plane (x/z, y/z), is the contour: its
winding number round a point is how often the point's ray enters, so the mesh's shadow is where that is not zero.
Pieces of it run counter-clockwise as seen in the image, y down, round what they enclose.
"""

import math

import numpy as np

from ars_web.geometry.compiled import entry, part

Array = np.ndarray


@part
def place_camera(T_world_camera: Array, R: Array, t: Array) -> None:
    """Rotation `R` (3, 3) and translation `t` (3,) of `T_camera_world`, written in place."""
    for i in range(3):
        t[i] = 0.0
        for j in range(3):
            R[i, j] = T_world_camera[j, i]
            t[i] -= T_world_camera[j, i] * T_world_camera[j, 3]


@part
def place_vertices(R: Array, t: Array, vertices: Array, points: Array) -> None:
    """Camera coordinates (v, 3) of vertices (v, 3), written in place."""
    for i in range(len(vertices)):
        x, y, z = vertices[i, 0], vertices[i, 1], vertices[i, 2]
        for axis in range(3):
            points[i, axis] = t[axis] + R[axis, 0] * x + R[axis, 1] * y + R[axis, 2] * z


@part
def face_camera(T_world_camera: Array, planes: Array, front: Array) -> None:
    """Whether the camera is outside each face's plane, written to `front` (f,)."""
    x, y, z = T_world_camera[0, 3], T_world_camera[1, 3], T_world_camera[2, 3]
    for i in range(len(planes)):
        front[i] = planes[i, 0] * x + planes[i, 1] * y + planes[i, 2] * z + planes[i, 3] > 0.0


@part
def near_point(points: Array, a: int, b: int, near: float) -> tuple[float, float]:
    """Where the edge between two vertices passes the near plane; the same for both directions, to the last bit."""
    if a > b:
        a, b = b, a
    s = (near - points[a, 2]) / (points[b, 2] - points[a, 2])
    x = points[a, 0] + s * (points[b, 0] - points[a, 0])
    y = points[a, 1] + s * (points[b, 1] - points[a, 1])
    return x / near, y / near


@part
def front_edges(points: Array, edges: Array, front: Array, near: float, pieces: Array, k: int) -> int:
    """Append the contour's edges, as far as they are in front of the near plane, to `pieces` after the first k."""
    for i in range(len(edges)):
        if front[edges[i, 2]] == front[edges[i, 3]]:
            continue
        a, b = (edges[i, 0], edges[i, 1]) if front[edges[i, 2]] else (edges[i, 1], edges[i, 0])
        za, zb = points[a, 2], points[b, 2]
        if za < near and zb < near:
            continue
        if za < near:
            pieces[k, 0, 0], pieces[k, 0, 1] = near_point(points, a, b, near)
        else:
            pieces[k, 0, 0], pieces[k, 0, 1] = points[a, 0] / za, points[a, 1] / za
        if zb < near:
            pieces[k, 1, 0], pieces[k, 1, 1] = near_point(points, a, b, near)
        else:
            pieces[k, 1, 0], pieces[k, 1, 1] = points[b, 0] / zb, points[b, 1] / zb
        k += 1
    return k


@part
def near_section(points: Array, faces: Array, front: Array, near: float, pieces: Array, k: int) -> int:
    """Append the border of the near plane's section through the mesh, where faces that are turned away meet it: where
    the others do, it runs along the edge of what is seen of them."""
    for i in range(len(faces)):
        if front[i]:
            continue
        leaves, enters = False, False
        for j in range(3):
            a, b = faces[i, j], faces[i, (j + 1) % 3]
            if points[a, 2] >= near and points[b, 2] < near:
                pieces[k, 1, 0], pieces[k, 1, 1] = near_point(points, a, b, near)
                leaves = True
            elif points[a, 2] < near and points[b, 2] >= near:
                pieces[k, 0, 0], pieces[k, 0, 1] = near_point(points, a, b, near)
                enters = True
        if leaves and enters:
            k += 1
    return k


@part
def within_disc(rim: float, x0: float, y0: float, x1: float, y1: float) -> tuple[float, float]:
    """The part (from, to) of a straight piece, in [0, 1], that lies in a disc round the origin; (1, 0) for none."""
    dx, dy = x1 - x0, y1 - y0
    a, b, c = dx * dx + dy * dy, x0 * dx + y0 * dy, x0 * x0 + y0 * y0 - rim * rim
    inside = b * b - a * c
    if not (a > 0.0 and inside > 0.0):
        return 1.0, 0.0
    root = math.sqrt(inside)
    low, high = max((-b - root) / a, 0.0), min((-b + root) / a, 1.0)
    return (low, high) if low < high else (1.0, 0.0)


@part
def winding(pieces: Array, x: float, y: float) -> int:
    """How often the contour runs round a point."""
    turns = 0
    for i in range(len(pieces)):
        x0, y0, x1, y1 = pieces[i, 0, 0], pieces[i, 0, 1], pieces[i, 1, 0], pieces[i, 1, 1]
        if (y0 > y) != (y1 > y) and x0 + (y - y0) / (y1 - y0) * (x1 - x0) > x:
            turns += 1 if y0 > y1 else -1
    return turns


@part
def grown(pieces: Array, k: int, more: int) -> Array:
    """`pieces` with room for more after the first k."""
    if k + more <= len(pieces):
        return pieces
    larger = np.empty((2 * len(pieces) + more, 2, 2))
    for i in range(k):
        for end in range(2):
            larger[i, end, 0], larger[i, end, 1] = pieces[i, end, 0], pieces[i, end, 1]
    return larger


@part
def falling_order(keys: Array, n: int) -> Array:
    """The numbers of the first n keys, the largest first. There are few."""
    order = np.arange(n)
    for i in range(1, n):
        j, one = i, order[i]
        while j > 0 and keys[order[j - 1]] < keys[one]:
            order[j] = order[j - 1]
            j -= 1
        order[j] = one
    return order


@part
def cut_at_rim(pieces: Array, first: int, k: int, rim: float, quarter: int) -> tuple[Array, int]:
    """Cut the pieces from the first to the k-th to a disc, in place, and append its border, `quarter` chords on each
    quarter, as often as the contour runs round it there."""
    whole = pieces[first:k].copy()
    angles, turns = np.empty(2 * len(whole)), np.empty(2 * len(whole), np.int64)
    ends = np.empty((2 * len(whole), 2))
    n, k = 0, first
    for i in range(len(whole)):
        x0, y0, x1, y1 = whole[i, 0, 0], whole[i, 0, 1], whole[i, 1, 0], whole[i, 1, 1]
        low, high = within_disc(rim, x0, y0, x1, y1)
        if low > high:
            continue
        for end in range(2):
            s = low if end == 0 else high
            x, y = (x0, y0) if end == 0 else (x1, y1)
            if 0.0 < s < 1.0:
                x, y = x0 + s * (x1 - x0), y0 + s * (y1 - y0)
                ends[n, 0], ends[n, 1] = x, y
                angles[n], turns[n] = math.atan2(y, x), 2 * end - 1
                n += 1
            pieces[k, end, 0], pieces[k, end, 1] = x, y
        k += 1
    step = 0.5 * math.pi / quarter
    if n == 0:
        for _ in range(winding(whole, rim, 0.0)):
            pieces = grown(pieces, k, 4 * quarter)
            for j in range(4 * quarter):
                for end in range(2):
                    # The last point is the first to the last bit, so that the ring is seen to be closed.
                    angle = (j + end) % (4 * quarter) * step
                    pieces[k, end, 0], pieces[k, end, 1] = rim * math.cos(angle), -rim * math.sin(angle)
                k += 1
        return pieces, k
    # Angles grow clockwise, y being down: the border runs towards smaller ones.
    order = falling_order(angles, n)
    widest, at = -1.0, 0
    for i in range(n):
        gap = angles[order[i]] - angles[order[(i + 1) % n]] + (2.0 * math.pi if i == n - 1 else 0.0)
        if gap > widest:
            widest, at = gap, i
    middle = angles[order[at]] - 0.5 * widest
    level = winding(whole, rim * math.cos(middle), rim * math.sin(middle))
    for i in range(n):
        here, there = order[(at + i) % n], order[(at + i + 1) % n]
        if i > 0:
            level += turns[here]
        start, end = angles[here], angles[there]
        if (at + i) % n == n - 1:
            end -= 2.0 * math.pi
        for _ in range(level):
            pieces = grown(pieces, k, 4 * quarter + 2)
            pieces[k, 0, 0], pieces[k, 0, 1] = ends[here, 0], ends[here, 1]
            place = math.ceil(start / step - 1e-9) - 1
            while place * step > end + 1e-9 * step:
                x, y = rim * math.cos(place * step), rim * math.sin(place * step)
                pieces[k, 1, 0], pieces[k, 1, 1] = x, y
                pieces[k + 1, 0, 0], pieces[k + 1, 0, 1] = x, y
                k += 1
                place -= 1
            pieces[k, 1, 0], pieces[k, 1, 1] = ends[there, 0], ends[there, 1]
            k += 1
    return pieces, k


@entry
def contours(
    Ts_world_camera: Array,
    vertices: Array,
    faces: Array,
    edges: Array,
    planes: Array,
    wanted: Array,
    near: float,
    rim: float,
    quarter: int,
) -> tuple[Array, Array]:
    """The contours of a mesh in those of n frames that are `wanted` (n,), cut to a disc of the radius `rim`: all pieces
    (k, 2, 2), and (n,) how many each frame has; none where nothing is in front."""
    # Copies, because threads that count the users of one array stand in each other's way.
    vertices, faces, edges, planes = vertices.copy(), faces.copy(), edges.copy(), planes.copy()
    R, t = np.empty((3, 3)), np.empty(3)
    points, front = np.empty_like(vertices), np.empty(len(faces), np.bool_)
    most = len(edges) + len(faces)
    pieces, counts = np.empty((2 * most, 2, 2)), np.zeros(len(Ts_world_camera), np.int64)
    k = 0
    for frame in range(len(Ts_world_camera)):
        if not wanted[frame]:
            continue
        first = k
        pieces = grown(pieces, k, most)
        place_camera(Ts_world_camera[frame], R, t)
        place_vertices(R, t, vertices, points)
        face_camera(Ts_world_camera[frame], planes, front)
        k = front_edges(points, edges, front, near, pieces, k)
        k = near_section(points, faces, front, near, pieces, k)
        furthest = 0.0
        for i in range(first, k):
            furthest = max(furthest, pieces[i, 0, 0] ** 2 + pieces[i, 0, 1] ** 2)
        if furthest >= rim * rim:
            pieces, k = cut_at_rim(pieces, first, k, rim, quarter)
        counts[frame] = k - first
    return pieces[:k].copy(), counts
