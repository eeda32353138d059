"""Where a photo hangs in the scene so that it and the boxes before it coincide, and how wide the view must be. Pure.

Seen from the frame's pose, a plane at depth d across the optical axis that spans the image's rays shows every pixel
where `cv2.projectPoints` puts it, whatever the window's shape: all that the view's own field of view and centre change
is how large and where on the screen both are drawn.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ars_web.errors import BadInput
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.rigid_transform import Transform

NEAREST_PLANE = 100.0
"""The photo hangs at least as far off, in metres; what is near does not matter, since it only has to lie behind."""


@dataclass(frozen=True, eq=False)
class PhotoPlane:
    """A rectangle that shows a photo.

    Attributes:
        width, height: metres.
        T_world_plane: (4, 4), origin at the rectangle's centre, x and y along the image's.
    """

    width: float
    height: float
    T_world_plane: Transform


def photo_plane(flat: Camera, T_world_camera: Transform, *, depth: float) -> PhotoPlane:
    """The plane that shows the photo of a pinhole camera, `depth` metres before it."""
    _refuse_bent(flat)
    centre = np.array([((flat.width - 1) / 2 - flat.cx) / flat.fx, ((flat.height - 1) / 2 - flat.cy) / flat.fy, 1.0])
    T_camera_plane = rigid_transform.from_rotation(np.eye(3), centre * depth)
    return PhotoPlane(flat.width / flat.fx * depth, flat.height / flat.fy * depth, T_world_camera @ T_camera_plane)


def fitting_fov(flat: Camera, *, aspect: float) -> float:
    """The least vertical field of view, radians, of a window of this width over height that shows the whole photo.

    The view's centre is the optical axis, so an off-centre principal point leaves a margin on one side.
    """
    _refuse_bent(flat)
    across = max(flat.cx + 0.5, flat.width - 0.5 - flat.cx) / flat.fx
    down = max(flat.cy + 0.5, flat.height - 0.5 - flat.cy) / flat.fy
    return 2.0 * math.atan(max(down, across / aspect))


def plane_depth(boxes: Iterable[Box], T_world_camera: Transform) -> float:
    """A depth in metres well behind all the boxes, as this camera sees them."""
    axis = T_world_camera[:3, 2]
    depths = [float(((box.corners_world - T_world_camera[:3, 3]) @ axis).max()) for box in boxes]
    return max(NEAREST_PLANE, 4.0 * max(depths, default=0.0))


def _refuse_bent(flat: Camera) -> None:
    if flat.model != "pinhole":
        raise BadInput(f"a plane shows the photo of a pinhole camera, not of a {flat.model} one: rectify it first")
