"""How far a point's pixel moves when the point does: the derivative of the projection."""

import numpy as np
from jaxtyping import Float

from ars_web.geometry import camera as cameras
from ars_web.geometry.camera import Camera


def pixels_with_jacobian(
    camera: Camera, points_camera: Float[np.ndarray, "*n 3"]
) -> tuple[Float[np.ndarray, "*n 2"], Float[np.ndarray, "*n 2 3"]]:
    """Pixels (..., 2) of points (..., 3) in camera coordinates, metres, and their derivative (..., 2, 3), pixels per
    metre; both NaN behind the camera or beyond the valid radius."""
    points = points_camera.reshape(-1, 3)
    z = np.where(points[:, 2] > 0, points[:, 2], np.nan)
    normalised = points[:, :2] / z[:, None]
    beyond = ~((normalised * normalised).sum(axis=-1) <= camera.valid_radius**2)
    distorted, bent = cameras.distorted_with_jacobian(camera, normalised)
    focal = np.array([camera.fx, camera.fy])
    pixels = distorted * focal + [camera.cx, camera.cy]
    # d (x/z, y/z) / d (x, y, z) = [I | -(x/z, y/z)] / z
    across = bent * (focal[:, None] / z[:, None, None])
    away = -np.einsum("nij,nj->ni", across, normalised)
    jacobian = np.concatenate([across, away[:, :, None]], axis=-1)
    pixels[beyond], jacobian[beyond] = np.nan, np.nan
    return pixels.reshape(*points_camera.shape[:-1], 2), jacobian.reshape(*points_camera.shape[:-1], 2, 3)
