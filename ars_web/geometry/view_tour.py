"""The order in which to visit camera poses: a short open path from where the camera is.

How far two poses are apart is the metres between them plus RADIAN for each radian that the camera turns on the way, so
the triangle inequality holds. What stands in the way is not looked at: a pose is a place to be, not how to get there.

The path begins as the nearest neighbour's, is shortened by turning stretches of it round (2-opt; Croes, 1958) and by
moving short stretches elsewhere (Or-opt; Or, 1976) until neither helps, and again from other first poses.
"""

import numpy as np
from jaxtyping import Float, Int

from ars_web.geometry.rigid_transform import Transform

RADIAN = 0.3
"""Metres that turning the camera by one radian counts as."""

STARTS = 12
"""First poses that are tried, the nearest ones; fewer where more than STARTED are to be visited in all."""

STARTED = 600

LONGEST_MOVED = 3
"""Poses of a stretch that Or-opt moves."""

_LESS = 1e-12
"""Of the largest distance between two places. What shortens a path by less is rounding, which would have no end."""

_DIGITS = 9
"""Of distances in metres. Poses that are as far as others are so on every machine."""


def camera_turns(Ts: Float[np.ndarray, "n 4 4"]) -> Float[np.ndarray, "k"]:
    """By how much a camera turns from each pose to the next, radians; one fewer than there are poses."""
    along = (Ts[:-1, :3, :3] * Ts[1:, :3, :3]).sum(axis=(1, 2))
    return np.arccos(np.clip((along - 1.0) / 2.0, -1.0, 1.0))


def pose_distances(Ts: Float[np.ndarray, "n 4 4"]) -> Float[np.ndarray, "n n"]:
    """How far each pose is from each: metres, and RADIAN for a radian between them."""
    centres = Ts[:, :3, 3]
    apart = np.linalg.norm(centres[:, None] - centres[None], axis=-1)
    axes = Ts[:, :3, :3].reshape(len(Ts), 9)
    # The trace of R_a^T R_b is the sum of the products of their entries: 1 + 2 cos(angle).
    angles = np.arccos(np.clip((axes @ axes.T - 1.0) / 2.0, -1.0, 1.0))
    np.fill_diagonal(angles, 0.0)
    return apart + RADIAN * angles


def tour(start: Transform, Ts: Float[np.ndarray, "n 4 4"]) -> Int[np.ndarray, "n"]:
    """The order of the poses on a short path from `start`, which is none of them."""
    if not len(Ts):
        return np.zeros(0, dtype=np.int64)
    return short_path(np.round(pose_distances(np.concatenate([start[None], Ts])), _DIGITS))[1:] - 1


def path_length(distances: Float[np.ndarray, "n n"], path: Int[np.ndarray, "n"]) -> float:
    """The sum of the distances along a path."""
    return float(distances[path[:-1], path[1:]].sum())


def short_path(distances: Float[np.ndarray, "n n"]) -> Int[np.ndarray, "n"]:
    """A short path from place 0 through all others, never longer than the nearest neighbour's."""
    less = _LESS * float(distances.max(initial=0.0))
    nearest = np.argsort(distances[0, 1:], kind="stable") + 1
    best, length = np.zeros(1, dtype=np.int64), np.inf
    starts = int(np.clip(STARTED // max(len(nearest), 1), 1, STARTS))
    for first in nearest[:starts].tolist():
        path = _shortened(distances, nearest_neighbour_path(distances, first=first), less=less)
        found = path_length(distances, path)
        if found < length - less:
            best, length = path, found
    return best


def nearest_neighbour_path(distances: Float[np.ndarray, "n n"], *, first: int | None = None) -> Int[np.ndarray, "n"]:
    """The path from place 0, by `first` if given, that goes to the nearest place not yet visited, again and again."""
    free = np.ones(len(distances), dtype=bool)
    path = [0] if first is None else [0, first]
    free[path] = False
    while len(path) < len(distances):
        path.append(int(np.argmin(np.where(free, distances[path[-1]], np.inf))))
        free[path[-1]] = False
    return np.array(path)


def _shortened(distances: Float[np.ndarray, "n n"], path: Int[np.ndarray, "n"], *, less: float) -> Int[np.ndarray, "n"]:
    """The path with stretches turned round and moved until that makes it shorter by no more than `less`."""
    n, improved = len(path), True
    while improved:
        improved = False
        for i in range(1, n):
            turned = _turned(distances, path, i, less=less)
            if turned is not None:
                path, improved = turned, True
            for length in range(1, min(LONGEST_MOVED, n - i) + 1):
                moved = _moved(distances, path, i, length, less=less)
                if moved is not None:
                    path, improved = moved, True
    return path


def _turned(
    distances: Float[np.ndarray, "n n"], path: Int[np.ndarray, "n"], i: int, *, less: float
) -> Int[np.ndarray, "n"] | None:
    """The path with its best stretch from i on turned round; None where that shortens it by no more than `less`."""
    before, first, lasts = path[i - 1], path[i], path[i:]
    gained = distances[before, first] - distances[before, lasts]
    # The path is open: nothing follows its last place.
    gained[:-1] += distances[lasts[:-1], lasts[1:]] - distances[first, lasts[1:]]
    best = int(np.argmax(gained))
    if gained[best] <= less:
        return None
    return np.concatenate([path[:i], path[i : i + best + 1][::-1], path[i + best + 1 :]])


def _moved(
    distances: Float[np.ndarray, "n n"], path: Int[np.ndarray, "n"], i: int, length: int, *, less: float
) -> Int[np.ndarray, "n"] | None:
    """The path with the stretch of `length` places from i on put where it is best, either way round; None where it is
    best as it is."""
    stretch, rest = path[i : i + length], np.concatenate([path[:i], path[i + length :]])
    before, first, last = path[i - 1], stretch[0], stretch[-1]
    saved = distances[before, first]
    if i + length < len(path):
        after = path[i + length]
        saved = saved + distances[last, after] - distances[before, after]
    costs = np.stack([distances[rest, first], distances[rest, last]])
    costs[:, :-1] += np.stack([distances[last, rest[1:]], distances[first, rest[1:]]]) - distances[rest[:-1], rest[1:]]
    way, place = np.unravel_index(int(np.argmin(costs)), costs.shape)
    if saved - costs[way, place] <= less:
        return None
    return np.concatenate([rest[: place + 1], stretch[::-1] if way else stretch, rest[place + 1 :]])
