"""The photo hangs where OpenCV projects what it shows."""

import math

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ars_web.errors import BadInput
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.scene.photo_plane import NEAREST_PLANE, fitting_fov, photo_plane, plane_depth

CAMERA = Camera(640, 480, 531.0, 487.0, 350.5, 210.25)


def pose() -> np.ndarray:
    R, _ = cv2.Rodrigues(np.array([-1.9, 0.4, 0.7]))
    return rigid_transform.from_rotation(R, np.array([3.1, -4.56, 1.7]))


@given(st.floats(0.2, 2000))
def test_a_point_of_the_plane_is_the_pixel_that_it_shows(depth: float) -> None:
    plane = photo_plane(CAMERA, pose(), depth=depth)
    # Image coordinates of the corners and of a point within, as shares of the image's width and height.
    shares = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.3, 0.8]])
    on_plane = np.column_stack([(shares - 0.5) * [plane.width, plane.height], np.zeros(5)])
    T_camera_world = rigid_transform.invert(pose())
    rotation, _ = cv2.Rodrigues(T_camera_world[:3, :3])
    world = rigid_transform.transform_points(plane.T_world_plane, on_plane)
    pixels = cv2.projectPoints(world, rotation, T_camera_world[:3, 3], CAMERA.K, None)[0][:, 0]
    assert np.abs(pixels + 0.5 - shares * [640, 480]).max() < 1e-6


@given(st.floats(0.3, 4.0))
def test_the_view_just_shows_the_whole_photo(aspect: float) -> None:
    tangent = math.tan(fitting_fov(CAMERA, aspect=aspect) / 2)
    left, right = (CAMERA.cx + 0.5) / CAMERA.fx, (639.5 - CAMERA.cx) / CAMERA.fx
    top, bottom = (CAMERA.cy + 0.5) / CAMERA.fy, (479.5 - CAMERA.cy) / CAMERA.fy
    used = max(left, right) / (tangent * aspect), max(top, bottom) / tangent
    assert max(used) == pytest.approx(1.0)


def test_the_plane_is_behind_all_boxes() -> None:
    T = pose()
    far = Box(rigid_transform.from_rotation(np.eye(3), T[:3, 3] + 300 * T[:3, 2]), np.array([20.0, 20.0, 20.0]))
    near = Box(rigid_transform.from_rotation(np.eye(3), T[:3, 3] + 2 * T[:3, 2]), np.array([0.1, 0.1, 0.1]))
    assert plane_depth([], T) == plane_depth([near], T) == NEAREST_PLANE
    assert plane_depth([near, far], T) > 310 * 2


def test_a_distorted_photo_is_refused() -> None:
    bent = Camera(640, 480, 531.0, 487.0, 350.5, 210.25, "brown", (-0.2, 0.1, 0.0, 0.0, 0.0))
    with pytest.raises(BadInput, match="rectify"):
        photo_plane(bent, pose(), depth=1.0)
