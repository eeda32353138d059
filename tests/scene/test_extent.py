"""How large a recording is, what its cameras look at, and from where all of it is seen."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from ars_web.geometry import rigid_transform
from ars_web.scene.extent import FIELD_OF_VIEW, Viewpoint, behind_camera, close_up, overview, recording_extent

TARGET = np.array([0.3, -0.2, 0.1])


def orbit(look_at: Callable, *, radius: float = 1.0, arc: float = 2 * np.pi, frames: int = 60) -> np.ndarray:
    angles = np.linspace(0, arc, frames, endpoint=False)
    centres = TARGET + radius * np.stack([np.cos(angles), np.sin(angles), np.full(frames, 0.7)], axis=1)
    return np.array([look_at(centre, TARGET) for centre in centres])


@pytest.mark.parametrize("arc", [2 * np.pi, 0.5, 0.05])
def test_cameras_round_a_thing_look_at_it(look_at: Callable, arc: float) -> None:
    extent = recording_extent(orbit(look_at, arc=arc))
    np.testing.assert_allclose(extent.focus, TARGET, atol=1e-6)
    assert extent.radius == pytest.approx(math.hypot(1, 0.7), rel=1e-6)
    assert extent.ground == 0.0


def test_one_frame_looks_at_the_ground_before_it(look_at: Callable) -> None:
    extent = recording_extent(look_at(np.array([0.0, 0.0, 1.0]), np.array([2.0, 0.0, 0.0]))[None])
    assert 0 < extent.focus[0] < 3
    assert extent.radius > 0.3


def test_cameras_that_look_every_way_have_no_focus_but_their_middle() -> None:
    turn = [
        rigid_transform.rotation_about_z(a) @ np.array([[0, 0, 1.0], [-1, 0, 0], [0, -1, 0]])
        for a in np.arange(40.0).tolist()
    ]
    centres = np.stack([np.arange(40) * 0.5, np.zeros(40), np.full(40, 1.5)], axis=1)
    extent = recording_extent(rigid_transform.from_rotation(np.array(turn), centres))
    np.testing.assert_allclose(extent.focus, [10, 0, 1.5], atol=2.0)
    assert extent.radius > 8


def test_the_ground_is_below_the_lowest_camera(look_at: Callable) -> None:
    poses = orbit(look_at)
    poses[:, 2, 3] -= 2.0
    assert recording_extent(poses).ground == pytest.approx(-1.2)


@pytest.mark.parametrize("shift", [0.0, 5e5])
@pytest.mark.parametrize("scale", [0.01, 1.0, 300.0])
def test_the_extent_goes_with_the_recording(look_at: Callable, scale: float, shift: float) -> None:
    plain, poses = recording_extent(orbit(look_at)), orbit(look_at)
    poses[:, :3, 3] = poses[:, :3, 3] * scale + [shift, -shift, 0.0]
    extent = recording_extent(poses)
    np.testing.assert_allclose(extent.focus, TARGET * scale + [shift, -shift, 0.0], atol=1e-6 * scale + 1e-6)
    assert extent.radius == pytest.approx(scale * plain.radius, rel=1e-4)
    assert extent.frustum_depth == pytest.approx(0.08 * extent.radius)


def pixels(viewpoint: Viewpoint, points: np.ndarray, *, look_at: Callable, width: int, height: int) -> np.ndarray:
    """Where points (n, 3) are drawn; all must be before the viewer."""
    T = rigid_transform.invert(look_at(viewpoint.position, viewpoint.look_at))
    seen = rigid_transform.transform_points(T, points)
    assert (seen[:, 2] > 0).all()
    return seen[:, :2] / seen[:, 2:] * (height / 2 / math.tan(FIELD_OF_VIEW / 2)) + [width / 2, height / 2]


@pytest.mark.parametrize(("width", "height"), [(1280, 720), (900, 690), (2400, 700)])
@pytest.mark.parametrize("arc", [2 * np.pi, 1.5, 0.1])
def test_the_overview_shows_all_cameras_and_boxes(look_at: Callable, arc: float, width: int, height: int) -> None:
    poses = orbit(look_at, arc=arc)
    corners = TARGET + np.random.default_rng(0).uniform(-0.3, 0.3, (80, 3))
    extent = recording_extent(poses)
    viewpoint = overview(extent, poses[:, :3, 3], corners)
    drawn = pixels(viewpoint, np.concatenate([poses[:, :3, 3], corners]), look_at=look_at, width=width, height=height)
    assert (drawn >= 0).all()
    assert (drawn <= [width, height]).all()
    assert np.ptp(drawn, axis=0).max() > 0.5 * height  # nor from farther than needed
    assert viewpoint.position[2] > viewpoint.look_at[2]


def test_a_box_far_away_by_mistake_does_not_make_the_rest_a_dot(look_at: Callable) -> None:
    poses = orbit(look_at)
    extent = recording_extent(poses)
    near = overview(extent, poses[:, :3, 3], np.zeros((0, 3)))
    far = overview(extent, poses[:, :3, 3], np.full((8, 3), 1e6))
    np.testing.assert_allclose(far.position, near.position, rtol=0.2)


def test_a_close_up_shows_one_thing_large(look_at: Callable) -> None:
    extent = recording_extent(orbit(look_at))
    corners = TARGET + np.random.default_rng(1).uniform(-0.05, 0.05, (8, 3))
    drawn = pixels(close_up(extent, corners), corners, look_at=look_at, width=1280, height=720)
    assert (drawn >= 0).all()
    assert (drawn <= [1280, 720]).all()
    assert np.ptp(drawn, axis=0).max() > 100


def test_from_behind_a_camera_it_and_what_it_sees_are_seen(look_at: Callable) -> None:
    poses = orbit(look_at)
    extent = recording_extent(poses)
    points = np.array([poses[7, :3, 3], TARGET])
    drawn = pixels(behind_camera(extent, poses[7]), points, look_at=look_at, width=1280, height=720)
    assert (drawn >= 0).all()
    assert (drawn <= [1280, 720]).all()
