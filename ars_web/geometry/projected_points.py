"""Points of objects in images, each where it would be seen if nothing hid it: keypoints of labels."""

import numpy as np
from jaxtyping import Float

from ars_web.geometry import lens_kernels
from ars_web.geometry.camera import Camera
from ars_web.geometry.frame_blocks import over_blocks
from ars_web.geometry.labels import NEAR
from ars_web.geometry.lens import lens_tables

BLOCK_POINTS = 65_536
"""Points times frames that are worked on at once."""


def project_points(
    camera: Camera, Ts_world_camera: Float[np.ndarray, "n 4 4"], points_world: Float[np.ndarray, "b k 3"]
) -> Float[np.ndarray, "n b k 2"]:
    """Image coordinates of each object's points in every frame, not cut to the image.

    NaN where a point is nearer than NEAR before the camera, behind it, or beyond the lens's valid radius.
    """
    lens = lens_tables(camera).lens
    b, k, _ = points_world.shape
    n, points = len(Ts_world_camera), points_world.reshape(-1, 3)
    image = np.empty((n, b * k, 2))

    def project(frames: slice) -> None:
        Ts = Ts_world_camera[frames]
        points_camera = (points - Ts[:, None, :3, 3]) @ Ts[:, :3, :3]
        depth = points_camera[..., 2]
        ahead = depth >= NEAR
        x, y = (points_camera[..., axis] / np.where(ahead, depth, 1.0) for axis in range(2))
        x[~(ahead & (x * x + y * y <= lens.rim**2))] = np.nan
        y[np.isnan(x)] = np.nan
        u, v = np.empty_like(x), np.empty_like(x)
        lens_kernels.bend_points(lens, x, y, u, v)
        image[frames, :, 0], image[frames, :, 1] = u, v

    over_blocks(project, n, block=max(BLOCK_POINTS // max(b * k, 1), 1))
    return image.reshape(n, b, k, 2)
