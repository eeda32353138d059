"""What a click in the scene meets: boxes and cameras, by its ray. All in world coordinates."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box, stack

TOLERANCE_PIXELS = 9.0
"""How far a click may miss a camera's centre on the screen."""


@dataclass(frozen=True, eq=False)
class Ray:
    """A click's ray.

    Attributes:
        origin: (3,).
        direction: (3,), unit length.
        pixel_angle: radians between neighbouring pixels in the middle of the screen.
    """

    origin: Float[np.ndarray, "3"]
    direction: Float[np.ndarray, "3"]
    pixel_angle: float


@dataclass(frozen=True)
class Hit:
    """What was met, and how far along the ray.

    Attributes:
        key: the box's id, or the camera's index.
    """

    key: int
    distance: float


def pixel_angle(field_of_view: float, height: int) -> float:
    """Radians between neighbouring pixels in the middle of a view that is `height` pixels high."""
    return 2 * math.tan(field_of_view / 2) / max(height, 1)


def box_hit(ray: Ray, boxes: Mapping[int, Box]) -> Hit | None:
    """The first box that the ray enters, or, from within a box, leaves.

    By slabs: the ray is inside of all three pairs of faces between the last entry and the first exit.
    """
    if not boxes:
        return None
    Ts_world_box, sizes = stack(list(boxes.values()))
    Ts_box_world = rigid_transform.invert(Ts_world_box)
    origins = rigid_transform.transform_points(Ts_box_world, ray.origin[None, None, :])[:, 0]
    directions = Ts_box_world[:, :3, :3] @ ray.direction
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        to_low, to_high = (-sizes / 2 - origins) / directions, (sizes / 2 - origins) / directions
    # Along a slab, 0/0 on one of its faces: within it.
    entry = np.nan_to_num(np.minimum(to_low, to_high), nan=-np.inf).max(axis=1)
    exit_ = np.nan_to_num(np.maximum(to_low, to_high), nan=np.inf).min(axis=1)
    distance = np.where(entry > 0, entry, exit_)
    distance[~((entry <= exit_) & (exit_ > 0))] = np.inf
    nearest = int(distance.argmin())
    return Hit(list(boxes)[nearest], float(distance[nearest])) if math.isfinite(distance[nearest]) else None


def camera_hit(ray: Ray, centres_world: Float[np.ndarray, "n 3"]) -> Hit | None:
    """The camera whose centre is nearest to the ray on the screen, within TOLERANCE_PIXELS; of several that are
    equally near, to a pixel, the first along the ray."""
    offsets = centres_world - ray.origin
    along = offsets @ ray.direction
    beside = np.linalg.norm(offsets - along[:, None] * ray.direction, axis=1)
    pixels = np.full(len(offsets), np.inf)
    np.divide(beside, along * ray.pixel_angle, out=pixels, where=along > 0)
    if not len(pixels) or pixels.min() > TOLERANCE_PIXELS:
        return None
    candidates = np.flatnonzero(pixels <= pixels.min() + 1.0)
    nearest = int(candidates[along[candidates].argmin()])
    return Hit(nearest, float(along[nearest]))
