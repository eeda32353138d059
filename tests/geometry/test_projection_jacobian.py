"""The derivative of the projection, against differences."""

import numpy as np
import pytest

from ars_web.geometry import camera as cameras
from ars_web.geometry.camera import Camera
from ars_web.geometry.projection_jacobian import pixels_with_jacobian


@pytest.mark.parametrize("seed", range(40))
def test_the_derivative_is_the_limit_of_differences(seed: int, random_scene):
    camera = random_scene(seed)[0]
    random = np.random.default_rng(seed)
    r = 0.9 * min(camera.valid_radius, 3.0) * np.sqrt(random.uniform(size=30))
    angle, z = random.uniform(0, 2 * np.pi, 30), random.uniform(0.2, 3, 30)
    points = np.column_stack([r * np.cos(angle), r * np.sin(angle), np.ones(30)]) * z[:, None]
    pixels, jacobian = pixels_with_jacobian(camera, points)
    np.testing.assert_allclose(pixels, cameras.pixels_from_camera_points(camera, points), atol=1e-9)
    h = 1e-6
    for axis in range(3):
        ahead, back = (
            cameras.pixels_from_camera_points(camera, points + sign * h * np.eye(3)[axis]) for sign in (1, -1)
        )
        slope = (ahead - back) / (2 * h)
        np.testing.assert_allclose(jacobian[..., axis], slope, rtol=1e-4, atol=1e-3 * np.abs(slope).max())


@pytest.mark.parametrize("model", ["pinhole", "brown", "fisheye"])
def test_on_the_axis_the_derivative_is_the_focal_length(model: cameras.Model):
    n = len(cameras.DISTORTION_NAMES[model])
    camera = Camera(640, 480, 500.0, 510.0, 320.0, 240.0, model, (0.1, -0.05, 0.0, 0.0, 0.02)[:n])
    _, jacobian = pixels_with_jacobian(camera, np.array([0.0, 0.0, 2.0]))
    np.testing.assert_allclose(jacobian, [[250.0, 0.0, 0.0], [0.0, 255.0, 0.0]], atol=1e-12)


def test_behind_the_camera_and_beyond_the_lens_there_is_none():
    camera = Camera(640, 480, 500.0, 500.0, 320.0, 240.0, "brown", (-0.28, 0.09, 0.0, 0.0, -0.012))
    beyond = camera.valid_radius + 0.01
    pixels, jacobian = pixels_with_jacobian(camera, np.array([[0.0, 0.0, -1.0], [0.1, 0.0, 0.0], [beyond, 0.0, 1.0]]))
    assert np.isnan(pixels).all()
    assert np.isnan(jacobian).all()
