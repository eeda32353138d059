"""Where a new box goes, and how large it is: where the view looks, on the ground if it looks at that. Pure."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera, rectified
from ars_web.geometry.rigid_transform import Transform
from ars_web.scene.extent import Extent
from ars_web.sessions.model import ObjectClass, VirtualBox
from ars_web.workspace import Refused

USUAL_SIZE = 0.1
"""Metres, of a side where nothing is known of the class, in a recording of about a table's size."""

NOT_CONNECTED = Refused("the 3D scene is not connected yet; add the box once it shows")
"""There is no view that looks anywhere."""

FARTHEST_GROUND = 3.0
"""The ground is looked at only where it is nearer than this many times what else would be: not at the horizon."""


@dataclass(frozen=True, eq=False)
class Sight:
    """What a view looks along.

    Attributes:
        eye: (3,) in the world.
        direction: (3,), unit length.
        distance: metres along it to what is looked at, if it is not the ground.
    """

    eye: Float[np.ndarray, "3"]
    direction: Float[np.ndarray, "3"]
    distance: float


def free_sight(eye: Float[np.ndarray, "3"], look_at: Float[np.ndarray, "3"]) -> Sight:
    """The sight of the free camera, which turns about `look_at`."""
    forward = look_at - eye
    distance = float(np.linalg.norm(forward))
    return Sight(eye, forward / distance, distance)


def frame_sight(camera: Camera, T_world_camera: Transform, *, boxes: Iterable[Box], extent: Extent) -> Sight:
    """The sight along the ray through the middle of a frame's photo.

    As far as the boxes that the camera sees before it usually are; without one, to where the ray comes nearest to
    what all cameras look at.
    """
    flat = rectified(camera)
    ray = np.array([((flat.width - 1) / 2 - flat.cx) / flat.fx, ((flat.height - 1) / 2 - flat.cy) / flat.fy, 1.0])
    direction = T_world_camera[:3, :3] @ (ray / np.linalg.norm(ray))
    eye = T_world_camera[:3, 3]
    depths = [float((box.T_world_box[:3, 3] - eye) @ direction) for box in boxes]
    ahead = [depth for depth in depths if depth > 0]
    distance = float(np.median(ahead)) if ahead else float((extent.focus - eye) @ direction)
    return Sight(eye, direction, distance if distance > 0 else extent.radius)


def placed(sight: Sight, *, size: Float[np.ndarray, "3"], ground: float) -> Box:
    """An upright box of this size where the sight ends: standing on the ground, or with its centre there.

    Args:
        ground: z of the ground's plane.
    """
    down = -float(sight.direction[2])
    above = float(sight.eye[2]) - ground
    to_ground = above / down if above > 0 and down > 0 else np.inf
    on_ground = to_ground <= FARTHEST_GROUND * sight.distance
    centre = sight.eye + sight.direction * (to_ground if on_ground else sight.distance)
    if on_ground:
        centre[2] = ground + size[2] / 2
    return Box(rigid_transform.from_rotation(np.eye(3), centre), size)


def usual_size(object_class: ObjectClass, boxes: Iterable[VirtualBox], *, extent: Extent) -> Float[np.ndarray, "3"]:
    """A new box's size: as the class says, else as its boxes usually are, else what fits the recording."""
    if object_class.default_size is not None:
        return np.array(object_class.default_size)
    sizes = [box.box.size for box in boxes if box.class_id == object_class.id]
    if sizes:
        return np.median(sizes, axis=0)
    # Recordings without a scale are any number of units wide.
    fits = 0.03 * extent.radius <= USUAL_SIZE <= 0.5 * extent.radius
    return np.full(3, USUAL_SIZE if fits else 0.15 * extent.radius)
