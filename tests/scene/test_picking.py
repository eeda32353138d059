"""What a click's ray meets."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.scene.picking import TOLERANCE_PIXELS, Hit, Ray, box_hit, camera_hit, pixel_angle

PIXEL = pixel_angle(0.9, 720)


def ray(origin: list[float], towards: list[float]) -> Ray:
    direction = np.subtract(towards, origin)
    return Ray(np.array(origin, dtype=float), direction / np.linalg.norm(direction), PIXEL)


def box(position: list[float], size: list[float], turn: float = 0.0) -> Box:
    return Box(
        rigid_transform.from_rotation(rigid_transform.rotation_about_z(turn), np.array(position, dtype=float)),
        np.array(size, dtype=float),
    )


def test_a_pixel_is_as_wide_as_the_camera_draws_it() -> None:
    assert 720 * pixel_angle(math.radians(90), 720) == pytest.approx(2.0)
    assert pixel_angle(0.9, 0) > 0  # a window that is not laid out yet


def test_the_nearer_of_two_boxes_is_met() -> None:
    boxes = {7: box([0, 5, 0], [1, 1, 1]), 3: box([0, 2, 0], [1, 1, 1])}
    assert box_hit(ray([0, 0, 0], [0, 1, 0]), boxes) == Hit(3, pytest.approx(1.5))
    assert box_hit(ray([0, 3.2, 0], [0, 4, 0]), boxes) == Hit(7, pytest.approx(1.3))


def test_what_is_beside_or_behind_is_not_met() -> None:
    boxes = {1: box([0, 2, 0], [1, 1, 1])}
    assert box_hit(ray([0, 0, 0], [0.4, 1, 0]), boxes) is None
    assert box_hit(ray([0, 0, 0], [0, -1, 0]), boxes) is None
    assert box_hit(ray([0, 0, 0], [0, 1, 0]), {}) is None


def test_a_turned_box_is_met_where_it_is() -> None:
    boxes = {1: box([0, 2, 0], [1, 1, 1], turn=math.radians(45))}
    assert box_hit(ray([0, 0, 0], [0, 1, 0]), boxes) == Hit(1, pytest.approx(2 - math.sqrt(0.5)))
    assert box_hit(ray([0.6, 0, 0], [0.6, 1, 0]), boxes) is not None
    assert box_hit(ray([0.8, 0, 0], [0.8, 1, 0]), boxes) is None


def test_from_within_a_box_it_is_met_where_it_is_left() -> None:
    boxes = {1: box([0, 0, 0], [4, 4, 4]), 2: box([0, 1, 0], [0.5, 0.5, 0.5])}
    assert box_hit(ray([0, 0, 0], [0, 1, 0]), boxes) == Hit(2, pytest.approx(0.75))
    assert box_hit(ray([0, 0, 0], [1, 0, 0]), boxes) == Hit(1, pytest.approx(2.0))


def test_a_ray_along_a_face_does_not_divide_by_zero() -> None:
    boxes = {1: box([0, 2, 0], [1, 1, 1])}
    assert box_hit(ray([0.5, 0, 0], [0.5, 1, 0]), boxes) == Hit(1, pytest.approx(1.5))
    assert box_hit(ray([0.5 + 1e-9, 0, 0], [0.5 + 1e-9, 1, 0]), boxes) is None


coordinate = st.floats(-3, 3, allow_nan=False)


@given(
    origin=st.tuples(coordinate, coordinate, coordinate),
    towards=st.tuples(coordinate, coordinate, coordinate),
    turn=st.floats(-3, 3),
)
def test_a_box_is_met_where_points_along_the_ray_get_into_it(
    origin: tuple[float, float, float], towards: tuple[float, float, float], turn: float
) -> None:
    """Against trying points all along the ray, the slow way."""
    if np.linalg.norm(np.subtract(towards, origin)) < 0.1:
        return
    one, one_ray = box([0.3, -0.2, 0.1], [1.0, 0.7, 1.4], turn), ray([*origin], [*towards])
    steps = np.linspace(0, 12, 6001)
    points = one_ray.origin + steps[:, None] * one_ray.direction
    local = np.abs(rigid_transform.transform_points(rigid_transform.invert(one.T_world_box), points))
    inside = (local <= one.size / 2).all(axis=1)
    hit = box_hit(one_ray, {1: one})
    if inside.sum() > 1:
        assert hit is not None
        edge = steps[inside][-1] if inside[0] else steps[inside][0]
        assert hit.distance == pytest.approx(edge, abs=0.005)
    elif hit is not None:  # a corner that is cut more finely than the points are apart
        assert not inside.any() or inside.sum() == 1


def test_the_camera_nearest_on_the_screen_is_met() -> None:
    centres = np.array([[0.05, 5, 0], [0.01, 5, 0], [0, -5, 0]])
    assert camera_hit(ray([0, 0, 0], [0, 1, 0]), centres) == Hit(1, pytest.approx(5.0))


def test_a_click_may_miss_a_camera_by_some_pixels_however_far_it_is() -> None:
    for distance in (0.1, 10.0, 1000.0):
        for pixels, met in ((TOLERANCE_PIXELS - 1, True), (TOLERANCE_PIXELS + 1, False)):
            centre = np.array([[pixels * PIXEL * distance, distance, 0.0]])
            assert (camera_hit(ray([0, 0, 0], [0, 1, 0]), centre) is not None) is met


def test_of_cameras_behind_one_another_the_first_is_met() -> None:
    centres = np.array([[0.0, 9, 0], [0.5 * PIXEL * 3, 3, 0], [0.0, 6, 0]])
    assert camera_hit(ray([0, 0, 0], [0, 1, 0]), centres) == Hit(1, pytest.approx(3.0))


def test_without_cameras_none_is_met() -> None:
    assert camera_hit(ray([0, 0, 0], [0, 1, 0]), np.zeros((0, 3))) is None
    assert camera_hit(ray([0, 0, 0], [0, 1, 0]), np.zeros((1, 3))) is None  # where the viewer stands
