"""Frames worth an outline: those that see an object large and whole, from sides far apart."""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial import ConvexHull

from ars_web.geometry import rigid_transform
from ars_web.geometry.camera import image_from_pixels, pixels_from_camera_points
from ars_web.geometry.visual_hull import VisualHull
from ars_web.masks.views import Photographed

AT_ONCE = 2048
"""Frames that are looked at together."""

LEAST_SHOWN = 0.6
"""Of the rectangle round the hull in a frame, that must be inside the image."""

SMALLEST = 8.0
"""Pixels: a hull that is smaller in a frame has no outline there worth finding."""

CUT_COUNTS = 0.6
"""How much a direction counts whose frame cuts the object, beside one that shows it whole."""

POINTS = 48
"""Of the hull, that stand for it."""


@dataclass(frozen=True, eq=False)
class _Sights:
    """Of each frame: the share of the hull's rectangle that is in the image, and that rectangle's size in pixels."""

    shown: Float[np.ndarray, "n"]
    size: Float[np.ndarray, "n"]


def candidate_frames(taken: Photographed, hull: VisualHull, *, drawn: Collection[int], count: int) -> list[int]:
    """Up to `count` frames besides the drawn ones, each from a side as far as can be from those before it, weighed by
    how large and how whole the frame shows the object."""
    sights = _sights(taken, hull)
    directions = taken.frames.Ts_world_camera[:, :3, 3] - hull.centre_of_mass
    directions = directions / np.maximum(np.linalg.norm(directions, axis=1, keepdims=True), 1e-12)
    weights = np.where(sights.shown < 1.0, CUT_COUNTS, 1.0)
    usual = float(np.median(sights.size[list(drawn)]))
    weights *= np.clip(np.sqrt(sights.size / max(usual, 1.0)), 0.3, 1.0)
    weights[(sights.shown < LEAST_SHOWN) | (sights.size < SMALLEST)] = 0.0
    weights[list(drawn)] = 0.0
    apart = np.full(len(weights), np.pi)
    for frame in drawn:
        apart = np.minimum(apart, _angles(directions, frame))
    chosen: list[int] = []
    while len(chosen) < count:
        best = int(np.argmax(weights * apart))
        if weights[best] * apart[best] <= 0:
            break
        chosen.append(best)
        apart = np.minimum(apart, _angles(directions, best))
        weights[best] = 0.0
    return chosen


def _angles(directions: Float[np.ndarray, "n 3"], frame: int) -> Float[np.ndarray, "n"]:
    return np.arccos(np.clip(directions @ directions[frame], -1.0, 1.0))


def _sights(taken: Photographed, hull: VisualHull) -> _Sights:
    frames = taken.frames
    points = _outermost(hull.vertices)
    shown, size = np.zeros(len(frames)), np.zeros(len(frames))
    for id_, camera in taken.cameras.items():
        own = np.flatnonzero(frames.camera_ids == id_)
        for start in range(0, len(own), AT_ONCE):
            block = own[start : start + AT_ONCE]
            Ts_camera_world = rigid_transform.invert(frames.Ts_world_camera[block])
            seen = rigid_transform.transform_points(Ts_camera_world, points)
            image = image_from_pixels(pixels_from_camera_points(camera, seen))
            known = np.isfinite(image).all(axis=(1, 2))
            low, high = image[known].min(axis=1), image[known].max(axis=1)
            inside = np.clip(np.minimum(high, (camera.width, camera.height)) - np.maximum(low, 0), 0, None)
            area = np.maximum((high - low).prod(axis=1), 1e-9)
            shown[block[known]] = inside.prod(axis=1) / area
            size[block[known]] = np.sqrt(area)
    # A rectangle that ends a rounding error before the border is inside all the same.
    return _Sights(np.where(shown > 1 - 1e-9, 1.0, shown), size)


def _outermost(vertices: Float[np.ndarray, "v 3"]) -> Float[np.ndarray, "p 3"]:
    corners = vertices[ConvexHull(vertices, qhull_options="QJ").vertices]
    return corners[np.unique(np.linspace(0, len(corners) - 1, POINTS).astype(np.int64))]
