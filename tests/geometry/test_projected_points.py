"""Projected points against OpenCV's, and where there are none."""

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from ars_web.geometry import camera as cameras
from ars_web.geometry import rigid_transform
from ars_web.geometry.camera import Camera
from ars_web.geometry.labels import NEAR
from ars_web.geometry.projected_points import project_points

PINHOLE = Camera(640, 480, 500.0, 500.0, 319.5, 239.5)
BROWN = Camera(640, 480, 500.0, 505.0, 300.0, 250.0, "brown", (-0.28, 0.09, 0.0011, -0.0009, -0.01))
FISHEYE = Camera(640, 480, 320.0, 322.0, 330.0, 235.0, "fisheye", (0.02, -0.01, 0.003, -0.0005))
LENSES = pytest.mark.parametrize("camera", [PINHOLE, BROWN, FISHEYE], ids=lambda camera: camera.model)
IDENTITY = np.eye(4)


def by_opencv(camera: Camera, T_world_camera: np.ndarray, points_world: np.ndarray) -> np.ndarray:
    T_camera_world = np.linalg.inv(T_world_camera)
    turn, shift = cv2.Rodrigues(T_camera_world[:3, :3])[0], T_camera_world[:3, 3].copy()
    distortion = np.array(camera.distortion)
    if camera.model == "fisheye":
        pixels, _ = cv2.fisheye.projectPoints(points_world[None], turn, shift, camera.K, distortion)
        return pixels[0] + 0.5
    pixels, _ = cv2.projectPoints(points_world, turn, shift, camera.K, distortion)
    return pixels[:, 0] + 0.5


@LENSES
def test_points_lie_where_opencv_sees_them(camera: Camera):
    random = np.random.default_rng(1)
    Ts = np.array(
        [
            rigid_transform.from_rotation(rigid_transform.rotation_about_z(angle), random.normal(size=3) * 0.2)
            for angle in np.linspace(0, 3, 40)
        ]
    )
    points_world = random.uniform([-0.5, -0.4, 1.0], [0.5, 0.4, 2.0], (5, 9, 3))
    found = project_points(camera, Ts, points_world)
    assert found.shape == (40, 5, 9, 2)
    for i in range(40):
        want = by_opencv(camera, Ts[i], points_world.reshape(-1, 3))
        assert_allclose(found[i].reshape(-1, 2), want, atol=1e-6)


@LENSES
def test_points_that_no_camera_sees_are_nan_and_others_are_not_cut(camera: Camera):
    widest = 0.999 * camera.valid_radius
    points = np.array(
        [
            [0.0, 0, NEAR * 1.01],
            [0.0, 0, NEAR * 0.99],
            [0.0, 0, 0],
            [0.1, 0, -1],
            [widest, 0, 1],
            [0, widest * 1.01, 1],
        ]
    )
    found = project_points(camera, IDENTITY[None], points[None])[0, 0]
    assert_array_equal(np.isnan(found).any(axis=1), [False, True, True, True, False, True])
    assert_array_equal(np.isnan(found).all(axis=1), np.isnan(found).any(axis=1))
    assert_allclose(found[[0]], cameras.image_from_pixels(np.array([[camera.cx, camera.cy]])))
    assert_allclose(found[4], by_opencv(camera, IDENTITY, points[4:5])[0], rtol=1e-9)
    assert not 0 <= found[4, 0] <= camera.width


def test_many_frames_are_projected_as_each_alone():
    random = np.random.default_rng(2)
    turns = random.normal(size=(3000, 4))
    Ts = np.array([rigid_transform.from_rotation(rigid_transform.rotation_from_wxyz(q), q[:3]) for q in turns])
    points_world = random.normal(size=(4, 9, 3))
    found = project_points(BROWN, Ts, points_world)
    assert 0.1 < np.isnan(found).mean() < 0.9
    for i in range(0, 3000, 113):
        assert_allclose(found[i], project_points(BROWN, Ts[i : i + 1], points_world)[0], rtol=1e-12)


def test_no_points_and_no_frames_give_none():
    assert project_points(PINHOLE, IDENTITY[None], np.zeros((0, 9, 3))).shape == (1, 0, 9, 2)
    assert project_points(PINHOLE, IDENTITY[None], np.zeros((3, 0, 3))).shape == (1, 3, 0, 2)
    assert project_points(PINHOLE, np.zeros((0, 4, 4)), np.zeros((2, 9, 3))).shape == (0, 2, 9, 2)
