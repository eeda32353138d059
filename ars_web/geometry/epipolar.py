"""Where in one frame a point must be that is seen in another: the epipolar curve."""

import numpy as np
from jaxtyping import Float

from ars_web.errors import BadInput
from ars_web.geometry import cut_kernels, lens_kernels, rigid_transform
from ars_web.geometry.camera import Camera
from ars_web.geometry.labels import NEAR
from ars_web.geometry.lens import lens_tables
from ars_web.geometry.rigid_transform import Transform
from ars_web.geometry.triangulation import CLOSEST_PLACES, Observation, ray_of_observation

TOLERANCE = 0.05
"""Pixels that the curve's chords may be off."""

FAR_OUT = 1e4
"""In the normalised plane: far beyond every lens's rim, and near enough for float64 to tell places within it apart."""


def epipolar_curve(
    observation: Observation, camera: Camera, T_world_camera: Transform
) -> list[Float[np.ndarray, "k 2"]]:
    """The observation's ray, from NEAR before its camera to infinity, as another frame shows it: polylines within that
    frame's image, in its image coordinates; none where it does not show the ray.

    The lens may bend the curve out of the image and back in, so there may be more than one. The one that is nearer to
    the observation's camera comes first, and each runs away from it.

    Raises:
        BadInput: the observation has no ray, or both frames were taken at one place.
    """
    start_world, direction_world = ray_of_observation(observation)
    if float(np.linalg.norm(start_world - T_world_camera[:3, 3])) < CLOSEST_PLACES:
        raise BadInput(
            f"frame {observation.frame} was taken at the same place, so that it says nothing about how far the point"
            " is; choose a frame from another side"
        )
    T_camera_world = rigid_transform.invert(T_world_camera)
    direction = T_camera_world[:3, :3] @ direction_world
    along_axis = float(direction_world @ observation.T_world_camera[:3, 2])
    start = T_camera_world[:3, :3] @ (start_world + direction_world * (NEAR / along_axis)) + T_camera_world[:3, 3]
    piece = _on_normalised_plane(start, direction)
    if piece is None:
        return []
    tables = lens_tables(camera)
    curves = lens_kernels.curves_of_edges(tables.lens, tables.bends, piece[None], TOLERANCE)
    points, lengths = cut_kernels.cut_curves(tables.lens.width, tables.lens.height, *curves)
    return np.split(points, np.cumsum(lengths)[:-1]) if len(lengths) else []


def _on_normalised_plane(
    start: Float[np.ndarray, "3"], direction: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "2 2"] | None:
    """The two ends on the normalised plane of what of a ray, in camera coordinates, is beyond the near plane; None
    where nothing is."""
    if start[2] < NEAR:
        if direction[2] <= 0:
            return None
        start = start + direction * ((NEAR - start[2]) / direction[2])
    near_end = start[:2] / start[2]
    # After t metres it is at near_end + t heading / (start_z + t direction_z).
    heading = direction[:2] - near_end * direction[2]
    speed, falls = float(np.linalg.norm(heading)), float(direction[2])
    farthest = FAR_OUT + 2 * float(np.linalg.norm(near_end))
    if falls > 0:
        length = speed / falls
    elif falls < 0:
        length = speed * (start[2] / NEAR - 1) / -falls
    else:
        length = farthest
    if speed == 0.0:
        return None
    return np.stack([near_end, near_end + heading / speed * min(length, farthest)])
