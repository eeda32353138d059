"""The compiled loops over the vertices that lie on a mesh's contour, which its box in the image is of.

Frames that follow one another see a mesh from nearly one place, so most of its faces are turned to all of them or away
from all: what can be on the contour is found once for a run of frames. Within a run the frames are side by side in
memory, where the processor takes several at a time.
"""

import numpy as np

from ars_web.geometry.compiled import entry, part

Array = np.ndarray

RUN = 32
"""Frames of a run."""

AWAY, TURNED, UNSURE = 0, 1, 2
"""Whether a face is turned away from all cameras of a run, to all, or to some."""


@part
def place_run(Ts_world_camera: Array, first: int, poses: Array, centres: Array) -> None:
    """`T_camera_world` of the run that begins at a frame, its first three rows one number after the other in `poses`
    (12, RUN), and the cameras' `centres` (3, RUN). The last frame stands in for those that are not there."""
    for lane in range(RUN):
        T = Ts_world_camera[min(first + lane, len(Ts_world_camera) - 1)]
        for i in range(3):
            centres[i, lane] = T[i, 3]
            poses[4 * i + 3, lane] = 0.0
            for j in range(3):
                poses[4 * i + j, lane] = T[j, i]
                poses[4 * i + 3, lane] -= T[j, i] * T[j, 3]


@part
def turn_faces(planes: Array, centres: Array, turned: Array) -> None:
    """Whether each face is turned to the run's cameras, written to `turned` (f,)."""
    x, y, z, reach = 0.0, 0.0, 0.0, 0.0
    for lane in range(RUN):
        x, y, z = x + centres[0, lane] / RUN, y + centres[1, lane] / RUN, z + centres[2, lane] / RUN
    for lane in range(RUN):
        reach = max(reach, (centres[0, lane] - x) ** 2 + (centres[1, lane] - y) ** 2 + (centres[2, lane] - z) ** 2)
    reach = np.sqrt(reach) * (1.0 + 1e-9) + 1e-9
    for i in range(len(planes)):
        outside = planes[i, 0] * x + planes[i, 1] * y + planes[i, 2] * z + planes[i, 3]
        turned[i] = TURNED if outside > reach else (AWAY if outside < -reach else UNSURE)


@part
def faces_lane(planes: Array, face: int, turned: Array, centres: Array, facing: Array) -> None:
    """Whether a face is turned to each of the run's cameras, written to `facing` (RUN,)."""
    if turned[face] != UNSURE:
        for lane in range(RUN):
            facing[lane] = turned[face] == TURNED
        return
    a, b, c, d = planes[face, 0], planes[face, 1], planes[face, 2], planes[face, 3]
    for lane in range(RUN):
        facing[lane] = a * centres[0, lane] + b * centres[1, lane] + c * centres[2, lane] + d > 0.0


@part
def cast_vertex(poses: Array, vertex: Array, on: Array, xs: Array, ys: Array, nearest: Array, furthest: Array) -> None:
    """A vertex on the normalised planes of a run's cameras, NaN where it is not `on` the contour, written to `xs` and
    `ys` (RUN,). The least depth goes to `nearest` and the largest squared radius to `furthest` (RUN,)."""
    px, py, pz = vertex[0], vertex[1], vertex[2]
    for lane in range(RUN):
        z = poses[11, lane] + poses[8, lane] * px + poses[9, lane] * py + poses[10, lane] * pz
        x = (poses[3, lane] + poses[0, lane] * px + poses[1, lane] * py + poses[2, lane] * pz) / z
        y = (poses[7, lane] + poses[4, lane] * px + poses[5, lane] * py + poses[6, lane] * pz) / z
        r2 = x * x + y * y
        here = on[lane]
        xs[lane], ys[lane] = x if here else np.nan, y if here else np.nan
        nearest[lane] = z if here and z < nearest[lane] else nearest[lane]
        furthest[lane] = r2 if here and r2 > furthest[lane] else furthest[lane]


@part
def grown_rows(rows: Array, used: int, more: int) -> Array:
    """`rows` (n, RUN) with room for more after those used."""
    if used + more <= len(rows):
        return rows
    larger = np.empty((2 * len(rows) + more, rows.shape[1]), rows.dtype)
    for i in range(used):
        for j in range(rows.shape[1]):
            larger[i, j] = rows[i, j]
    return larger


@entry
def cast_clouds(
    Ts_world_camera: Array, vertices: Array, edges: Array, planes: Array
) -> tuple[Array, Array, Array, Array, Array, Array, Array, Array]:
    """The vertices on a mesh's contour on the normalised planes of n frames, wherever they are to the camera.

    Returns x and y (rows, RUN), a row a vertex and a run, NaN where a frame has it not on its contour; the edges
    on the contour as (k, 3) their numbers, the row of their start and that of their end, and (k, RUN) the frames they
    are on it in; (runs + 1,) where each run's rows begin, and (runs + 1,) its edges; the least depth of a vertex on the
    contour and the largest squared radius of one, both (runs * RUN,).
    """
    # Copies, because threads that count the users of one array stand in each other's way.
    vertices, edges, planes = vertices.copy(), edges.copy(), planes.copy()
    runs = (len(Ts_world_camera) + RUN - 1) // RUN
    xs, ys = np.empty((len(vertices), RUN)), np.empty((len(vertices), RUN))
    ends, on_edges = np.empty((len(edges), 3), np.int64), np.empty((len(edges), RUN), np.bool_)
    first_row, first_edge = np.zeros(runs + 1, np.int64), np.zeros(runs + 1, np.int64)
    nearest, furthest = np.full(runs * RUN, np.inf), np.zeros(runs * RUN)
    poses, centres, turned = np.empty((12, RUN)), np.empty((3, RUN)), np.empty(len(planes), np.int64)
    row_of, vertex_of = np.full(len(vertices), -1), np.empty(len(vertices), np.int64)
    on = np.empty((len(vertices), RUN), np.bool_)
    there, back = np.empty(RUN, np.bool_), np.empty(RUN, np.bool_)
    for run in range(runs):
        place_run(Ts_world_camera, run * RUN, poses, centres)
        turn_faces(planes, centres, turned)
        start, k, rows = first_row[run], first_edge[run], 0
        ends, on_edges = grown_rows(ends, k, len(edges)), grown_rows(on_edges, k, len(edges))
        for edge in range(len(edges)):
            f, g = edges[edge, 2], edges[edge, 3]
            if turned[f] == turned[g] and turned[f] != UNSURE:
                continue
            faces_lane(planes, f, turned, centres, there)
            faces_lane(planes, g, turned, centres, back)
            ends[k, 0] = edge
            for end in range(2):
                vertex = edges[edge, end]
                if row_of[vertex] < 0:
                    row_of[vertex], vertex_of[rows] = rows, vertex
                    for lane in range(RUN):
                        on[rows, lane] = False
                    rows += 1
                ends[k, 1 + end] = start + row_of[vertex]
            from_row, to_row = row_of[edges[edge, 0]], row_of[edges[edge, 1]]
            for lane in range(RUN):
                differ = there[lane] != back[lane]
                on_edges[k, lane] = differ
                on[from_row, lane] |= differ
                on[to_row, lane] |= differ
            k += 1
        xs, ys = grown_rows(xs, start, rows), grown_rows(ys, start, rows)
        least, most = nearest[run * RUN : (run + 1) * RUN], furthest[run * RUN : (run + 1) * RUN]
        for row in range(rows):
            vertex = vertex_of[row]
            cast_vertex(poses, vertices[vertex], on[row], xs[start + row], ys[start + row], least, most)
            row_of[vertex] = -1
        first_row[run + 1], first_edge[run + 1] = start + rows, k
    used, k = first_row[runs], first_edge[runs]
    return xs[:used], ys[:used], ends[:k], on_edges[:k], first_row, first_edge, nearest, furthest


@entry
def boxes_of_clouds(
    x: Array,
    y: Array,
    u: Array,
    v: Array,
    ends: Array,
    on_edges: Array,
    first_row: Array,
    first_edge: Array,
    lengths: Array,
    nearest: Array,
    furthest: Array,
    bends: Array,
    tolerance: float,
    bbox: Array,
) -> tuple[Array, Array]:
    """The boxes of contours' vertices in n frames, written to `bbox` (n, 4).

    The vertices are given on the normalised plane (x, y) and in the image (u, v), the rest as `cast_clouds` returns it.
    `lengths` (e,) are the edges', the longest first; `bends` (n,) bound the second derivative of their images.

    Returns those edges that may go beyond their ends, and by more than the tolerance beyond the box, on the normalised
    plane (k, 2, 2), and the frame of each (k,).
    """
    pieces, frames, k = np.empty((64, 4)), np.empty(64, np.int64), 0
    least_u, least_v, most_u, most_v = np.empty(RUN), np.empty(RUN), np.empty(RUN), np.empty(RUN)
    for run in range(len(first_row) - 1):
        for lane in range(RUN):
            least_u[lane], least_v[lane], most_u[lane], most_v[lane] = np.inf, np.inf, -np.inf, -np.inf
        for row in range(first_row[run], first_row[run + 1]):
            # NaN is neither less nor more.
            for lane in range(RUN):
                a, b = u[row, lane], v[row, lane]
                least_u[lane] = a if a < least_u[lane] else least_u[lane]
                most_u[lane] = a if a > most_u[lane] else most_u[lane]
                least_v[lane] = b if b < least_v[lane] else least_v[lane]
                most_v[lane] = b if b > most_v[lane] else most_v[lane]
        for lane in range(min(RUN, len(bbox) - run * RUN)):
            frame = run * RUN + lane
            bbox[frame, 0], bbox[frame, 1] = least_u[lane], least_v[lane]
            bbox[frame, 2], bbox[frame, 3] = most_u[lane], most_v[lane]
            # An edge of length L at the depth z or more and within the radius r is at most L sqrt(1 + r^2) / z long.
            stretch = bends[frame] * (1.0 + furthest[frame]) / (8.0 * nearest[frame] * nearest[frame])
            for i in range(first_edge[run], first_edge[run + 1]):
                if not lengths[ends[i, 0]] ** 2 * stretch > tolerance:
                    break
                a, b = ends[i, 1], ends[i, 2]
                if on_edges[i, lane] and may_extend(
                    x[a, lane],
                    y[a, lane],
                    x[b, lane],
                    y[b, lane],
                    u[a, lane],
                    v[a, lane],
                    u[b, lane],
                    v[b, lane],
                    bends[frame],
                    tolerance,
                    bbox[frame],
                ):
                    if k == len(pieces):
                        more_pieces, more_frames = np.empty((2 * k, 4)), np.empty(2 * k, np.int64)
                        for j in range(k):
                            more_frames[j] = frames[j]
                            for axis in range(4):
                                more_pieces[j, axis] = pieces[j, axis]
                        pieces, frames = more_pieces, more_frames
                    pieces[k, 0], pieces[k, 1] = x[a, lane], y[a, lane]
                    pieces[k, 2], pieces[k, 3] = x[b, lane], y[b, lane]
                    frames[k] = frame
                    k += 1
    return pieces[:k].copy().reshape((k, 2, 2)), frames[:k].copy()


@part
def may_extend(
    x0: float,
    y0: float,
    x1: float,
    y1: float,
    u0: float,
    v0: float,
    u1: float,
    v1: float,
    bend: float,
    tolerance: float,
    bbox: Array,
) -> bool:
    """Whether an edge's image may reach further beyond a box than the tolerance: with ends du apart and a sagitta s, it
    goes beyond its ends by at most s (1 - |du| / 4s)^2, and not at all where |du| >= 4 s."""
    sagitta = bend * ((x1 - x0) ** 2 + (y1 - y0) ** 2) / 8.0
    if not sagitta > tolerance:
        return False
    beyond_u = sagitta * max(1.0 - abs(u1 - u0) / (4.0 * sagitta), 0.0) ** 2 - tolerance
    beyond_v = sagitta * max(1.0 - abs(v1 - v0) / (4.0 * sagitta), 0.0) ** 2 - tolerance
    return (
        min(u0, u1) - beyond_u < bbox[0]
        or max(u0, u1) + beyond_u > bbox[2]
        or min(v0, v1) - beyond_v < bbox[1]
        or max(v0, v1) + beyond_v > bbox[3]
    )


@entry
def grow_boxes(points: Array, lengths: Array, frames: Array, bbox: Array) -> None:
    """Make the boxes (n, 4) of frames hold curves, those one after the other in `points` (k, 2)."""
    at = 0
    for i in range(len(lengths)):
        box = bbox[frames[i]]
        for j in range(at, at + lengths[i]):
            box[0], box[1] = min(box[0], points[j, 0]), min(box[1], points[j, 1])
            box[2], box[3] = max(box[2], points[j, 0]), max(box[3], points[j, 1])
        at += lengths[i]
