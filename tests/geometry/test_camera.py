"""Cameras against OpenCV, there and back, and nothing beyond where a lens is one-to-one."""

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from ars_web.errors import BadInput
from ars_web.geometry import camera as cameras
from ars_web.geometry.camera import Camera

PINHOLE = Camera(640, 480, 500.0, 510.0, 300.0, 250.0)
BROWN = Camera(960, 720, 938.8, 932.2, 505.9, 379.4, "brown", (-0.21, 0.07, 0.0011, -0.0009, 0.01))
FISHEYE = Camera(640, 480, 220.0, 222.0, 330.0, 235.0, "fisheye", (0.02, -0.01, 0.003, -0.0005))
EVERY = pytest.mark.parametrize("camera", [PINHOLE, BROWN, FISHEYE], ids=lambda camera: camera.model)


def points_before(camera: Camera, *, n: int = 500) -> np.ndarray:
    """Points (n, 3) in camera coordinates within the valid radius."""
    random = np.random.default_rng(0)
    r = min(0.95 * camera.valid_radius, 3.0) * np.sqrt(random.uniform(size=n))
    angle, z = random.uniform(0, 2 * np.pi, n), random.uniform(0.1, 5, n)
    return np.column_stack([r * np.cos(angle), r * np.sin(angle), np.ones(n)]) * z[:, None]


def test_pinhole_and_brown_project_as_opencv_does():
    for camera in (PINHOLE, BROWN):
        points = points_before(camera)
        distortion = np.array(camera.distortion or [0.0] * 5)
        want = cv2.projectPoints(points, np.zeros(3), np.zeros(3), camera.K, distortion)[0][:, 0]
        assert_allclose(cameras.pixels_from_camera_points(camera, points), want, atol=1e-9)


def test_fisheye_projects_as_opencv_does():
    points = points_before(FISHEYE)
    distortion = np.array(FISHEYE.distortion)
    want = cv2.fisheye.projectPoints(points[:, None], np.zeros(3), np.zeros(3), FISHEYE.K, distortion)[0][:, 0]
    assert_allclose(cameras.pixels_from_camera_points(FISHEYE, points), want, atol=1e-9)


@EVERY
def test_pixels_there_and_back(camera: Camera):
    normalised = points_before(camera)
    normalised = normalised[:, :2] / normalised[:, 2:]
    pixels = cameras.pixels_from_normalised(camera, normalised)
    assert_allclose(cameras.normalised_from_pixels(camera, pixels), normalised, atol=1e-7)


def test_pixels_there_and_back_for_cameras_of_every_kind(random_scene):
    for seed in range(100):
        camera = random_scene(seed)[0]
        u, v = np.meshgrid(np.linspace(-0.5, camera.width - 0.5, 40), np.linspace(-0.5, camera.height - 0.5, 30))
        pixels = np.stack([u, v], axis=-1)
        rays = cameras.normalised_from_pixels(camera, pixels)
        found = np.isfinite(rays).all(axis=-1)
        assert found.mean() > 0.1
        assert_array_equal(found, np.isfinite(rays).any(axis=-1))
        assert_allclose(cameras.pixels_from_normalised(camera, rays)[found], pixels[found], atol=1e-5)
        assert (np.linalg.norm(rays[found], axis=-1) <= camera.valid_radius).all()


def test_undistorting_agrees_with_opencv():
    pixels = cameras.image_border_pixels(BROWN)
    criteria = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 200, 1e-14)
    distortion = np.array(BROWN.distortion)
    want = cv2.undistortPointsIter(pixels[:, None], BROWN.K, distortion, np.eye(3), np.eye(3), criteria)[:, 0]
    assert_allclose(cameras.normalised_from_pixels(BROWN, pixels), want, atol=1e-8)


def test_the_valid_radius_is_the_first_root():
    camera = Camera(640, 480, 500.0, 500.0, 320.0, 240.0, "brown", (-0.28, 0.09, 0.0, 0.0, -0.012))
    r = camera.valid_radius
    assert 1 + 3 * -0.28 * r**2 + 5 * 0.09 * r**4 + 7 * -0.012 * r**6 == pytest.approx(0, abs=1e-12)
    inner = np.linspace(0, r, 1000)
    assert (np.diff(inner * (1 - 0.28 * inner**2 + 0.09 * inner**4 - 0.012 * inner**6)) > 0).all()
    fisheye = Camera(640, 480, 300.0, 300.0, 320.0, 240.0, "fisheye", (0.1, -0.2, 0.05, -0.01))
    theta = np.arctan(fisheye.valid_radius)
    assert theta < cameras.WIDEST_ANGLE
    assert 1 + 0.3 * theta**2 - 1.0 * theta**4 + 0.35 * theta**6 - 0.09 * theta**8 == pytest.approx(0, abs=1e-12)


@EVERY
def test_where_nothing_folds_the_widest_angle_is_the_limit(camera: Camera):
    straight = Camera(640, 480, 500.0, 500.0, 320.0, 240.0, camera.model, (0.0,) * len(camera.distortion))
    assert np.arctan(straight.valid_radius) == pytest.approx(cameras.WIDEST_ANGLE)


@pytest.mark.parametrize(("p1", "p2"), [(0.05, 0.0), (0.0, -0.05), (0.04, 0.03), (-0.2, 0.1)])
@pytest.mark.parametrize("k", [(-0.3, 0.1, 0.0), (-0.1, 0.0, -0.01), (0.2, 0.1, 0.05)])
def test_within_the_valid_radius_no_two_points_meet_also_with_strong_tangential_terms(p1, p2, k):
    camera = Camera(640, 480, 500.0, 500.0, 320.0, 240.0, "brown", (k[0], k[1], p1, p2, k[2]))
    radius = min(camera.valid_radius, 3.0)
    angle, r = np.meshgrid(np.linspace(0, 2 * np.pi, 181), np.linspace(0.001, 0.999, 200) * radius)
    points = np.stack([r * np.cos(angle), r * np.sin(angle)], axis=-1)
    h = 1e-7
    there = cameras.distorted_from_normalised(camera, points)
    across = (cameras.distorted_from_normalised(camera, points + np.array([h, 0.0])) - there) / h
    down = (cameras.distorted_from_normalised(camera, points + np.array([0.0, h])) - there) / h
    turned = across[..., 0] * down[..., 1] - across[..., 1] * down[..., 0]
    assert np.nanmin(turned) > -1e-6
    assert np.nanmin(across[..., 0]) > -1e-6


@EVERY
def test_points_beyond_the_valid_radius_or_behind_are_not_projected(camera: Camera):
    r = camera.valid_radius
    points = np.array([[1.001 * r, 0, 1], [0, -1.001 * r, 1], [0.1, 0.1, -1], [0, 0, 0], [0.1, 0.1, 1]])
    found = cameras.pixels_from_camera_points(camera, points)
    assert_array_equal(np.isnan(found).all(axis=1), [True, True, True, True, False])
    assert_array_equal(np.isnan(cameras.distorted_from_normalised(camera, np.array([1.001 * r, 0.0]))), [True, True])


def test_pixels_that_no_ray_reaches_are_nan():
    # The lens folds back at a distorted radius of 0.61: the image's corners lie outside.
    camera = Camera(800, 800, 408.0, 408.0, 399.5, 399.5, "brown", (-0.4, 0.0, 0.001, 0.0, 0.0))
    found = cameras.normalised_from_pixels(camera, np.array([[-0.5, -0.5], [799.5, 799.5], [399.5, 399.5]]))
    assert_array_equal(np.isnan(found).all(axis=1), [True, True, False])
    assert np.isnan(cameras.normalised_from_pixels(camera, np.array([[-0.5, -0.5]]))).all()


@EVERY
def test_a_rectified_camera_sees_no_unseen_pixel_and_as_much_as_it_can(camera: Camera):
    flat = cameras.rectified(camera)
    assert (flat.model, flat.width, flat.height) == ("pinhole", camera.width, camera.height)
    rays = cameras.normalised_from_pixels(flat, cameras.image_border_pixels(flat, samples=777))
    seen = cameras.image_from_pixels(cameras.pixels_from_normalised(camera, rays))
    assert (seen > -0.01).all()
    assert (seen < [camera.width + 0.01, camera.height + 0.01]).all()
    # Each side touches the image's border, or the widest angle.
    for side in np.split(rays, 4):
        there = cameras.image_from_pixels(cameras.pixels_from_normalised(camera, side))
        gap = np.minimum(there, [camera.width, camera.height] - there).min()
        widest = np.abs(side).max(axis=0).max() >= 0.99 * np.tan(cameras.WIDEST_RECTIFIED_ANGLE)
        assert gap < 0.01 or widest


def test_rectified_cameras_of_every_kind_see_no_unseen_pixel(random_scene):
    for seed in range(200):
        camera = random_scene(seed)[0]
        flat = cameras.rectified(camera)
        rays = cameras.normalised_from_pixels(flat, cameras.image_border_pixels(flat, samples=333))
        seen = cameras.image_from_pixels(cameras.pixels_from_normalised(camera, rays))
        assert (seen > -0.01).all(), seed
        assert (seen < [camera.width + 0.01, camera.height + 0.01]).all(), seed


def test_a_camera_out_of_which_nothing_can_be_cut_is_refused():
    camera = Camera(640, 480, 100.0, 100.0, -5000.0, 240.0, "fisheye", (0.0, 0.0, 0.0, 0.0))
    with pytest.raises(BadInput, match="no rectified image"):
        cameras.rectified(camera)


def test_image_coordinates_are_half_a_pixel_on():
    assert_array_equal(cameras.image_from_pixels(np.array([-0.5, 0.0])), [0.0, 0.5])
    assert_array_equal(cameras.pixels_from_image(np.array([0.0, 640.0])), [-0.5, 639.5])
    border = cameras.image_from_pixels(cameras.image_border_pixels(PINHOLE))
    assert_array_equal(border.min(axis=0), [0, 0])
    assert_array_equal(border.max(axis=0), [640, 480])
    assert cameras.in_image(PINHOLE, cameras.image_border_pixels(PINHOLE)).all()
    outside = np.array([[-0.51, 0], [0, -0.51], [639.51, 0], [0, 479.51], [np.nan, 0]])
    assert not cameras.in_image(PINHOLE, outside).any()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"model": "ocam"}, "'ocam' is unknown"),
        ({"width": 0}, "at least 1 x 1"),
        ({"height": -5}, "at least 1 x 1"),
        ({"fx": 0.0}, "focal lengths must be positive"),
        ({"fy": -500.0}, "focal lengths must be positive"),
        ({"cx": float("nan")}, "finite"),
        ({"model": "brown", "distortion": (0.1, 0.2, 0.3, float("inf"), 0.0)}, "finite"),
        ({"model": "brown", "distortion": (0.1, 0.2)}, "5 distortion coefficients"),
        ({"distortion": (0.1,)}, r"0 distortion coefficients \(none\)"),
        ({"model": "fisheye", "distortion": (0.0,) * 5}, "4 distortion coefficients"),
    ],
)
def test_numbers_that_are_no_cameras_are_refused(changes: dict, message: str):
    numbers = {"width": 640, "height": 480, "fx": 500.0, "fy": 500.0, "cx": 320.0, "cy": 240.0}
    if changes.get("model") == "ocam":
        # The run-time type check would refuse it before the camera can say which models it knows.
        with pytest.raises(BadInput, match=message):
            unchecked(**{**numbers, **changes}).__post_init__()
        return
    with pytest.raises(BadInput, match=message):
        Camera(**{**numbers, **changes})


def unchecked(**values: object) -> Camera:
    """A camera of any values, not yet looked at."""
    camera = object.__new__(Camera)
    for name, value in {"distortion": (), **values}.items():
        object.__setattr__(camera, name, value)
    return camera
