"""Where the objects truly are in an image: their surfaces' points projected, and the pixels that see them."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from ars_web.demo import shapes
from ars_web.demo.rendering import Sight
from ars_web.demo.scene import Part, Thing
from ars_web.geometry import rigid_transform
from ars_web.geometry.camera import Camera, image_from_pixels, pixels_from_camera_points
from ars_web.geometry.rigid_transform import Transform

NEAR = 0.01
"""Metres. A surface that reaches nearer the camera's plane than this has no box in the image."""

SAMPLES = {
    # (surfaces, points along u, points along v). Ends of cylinders lie within the rims that their sides have; a
    # straight side still bends in the lens. 257 points round a circle miss at most 8e-5 of its radius.
    shapes.BOX: (range(6), 33, 33),
    shapes.BALL: (range(1), 257, 129),
    shapes.CYLINDER: (range(1), 257, 9),
    shapes.TUBE: (range(1), 257, 9),
    shapes.HANDLE: (range(1), 257, 65),
}


def surface_points_world(thing: Thing) -> Float[np.ndarray, "n 3"]:
    """Points of an object's surface, dense enough that their box in an image is the surface's."""
    T = thing.T_world_build
    return np.concatenate([rigid_transform.transform_points(T, _points(part)) for part in thing.parts])


def _points(part: Part) -> Float[np.ndarray, "n 3"]:
    surfaces, along_u, along_v = SAMPLES[part.kind]
    a, b, c, *_ = (*part.size, 0.0, 0.0)
    points = np.array(
        [
            shapes.surface_point(part.kind, (a, b, c), surface, float(u), float(v))[0]
            for surface in surfaces
            for u in np.linspace(0, 1, along_u)
            for v in np.linspace(0, 1, along_v)
        ]
    )
    if part.kind == shapes.HANDLE:
        points = points[points[:, 0] >= part.size[2]]
    return points @ part.rolled.T + part.middle


def amodal_box(
    camera: Camera, T_world_camera: Transform, points_world: Float[np.ndarray, "n 3"]
) -> Float[np.ndarray, "4"]:
    """The box round a surface's points in the image, unclipped, image coordinates; NaN where one is behind."""
    points = rigid_transform.transform_points(rigid_transform.invert(T_world_camera), points_world)
    if points[:, 2].min() < NEAR:
        return np.full(4, np.nan)
    image = image_from_pixels(pixels_from_camera_points(camera, points))
    return np.concatenate([np.nanmin(image, axis=0), np.nanmax(image, axis=0)])


@dataclass(frozen=True, eq=False)
class Counts:
    """Pixels of b objects in one image.

    Attributes:
        in_image: (b,) whose centre would see the object if there were nothing else.
        visible: (b,) whose centre sees it.
        bbox_visible: (b, 4) round those, image coordinates; NaN where there are none.
    """

    in_image: Int[np.ndarray, "b"]
    visible: Int[np.ndarray, "b"]
    bbox_visible: Float[np.ndarray, "b 4"]


def pixel_counts(sight: Sight) -> Counts:
    """How many pixels see each object, and where they are."""
    seen = [sight.objects == b for b in range(len(sight.alone))]
    return Counts(
        in_image=np.array([np.count_nonzero(alone) for alone in sight.alone]),
        visible=np.array([np.count_nonzero(mask) for mask in seen]),
        bbox_visible=np.array([box_of_pixels(mask) if mask.any() else np.full(4, np.nan) for mask in seen]),
    )


def box_of_pixels(mask: Bool[np.ndarray, "h w"]) -> Float[np.ndarray, "4"]:
    """The box round the true pixels of a mask that has some: their outer edges, image coordinates."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    return np.array([columns[0], rows[0], columns[-1] + 1, rows[-1] + 1], dtype=np.float64)
