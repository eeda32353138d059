"""Upright cameras, and limits on where they are."""

import math

import numpy as np
import pytest

from ars_web.errors import BadInput
from ars_web.geometry.box import Box
from ars_web.geometry.rigid_transform import checked
from ars_web.geometry.symmetry import turn_about
from ars_web.geometry.view_limits import ViewLimits, check_room, lean_of_world, looking_at, tilts_of


def cube_at(z: float) -> Box:
    T = np.eye(4)
    T[2, 3] = z
    return Box(T, np.full(3, 0.1))


def limits(**changes: object) -> ViewLimits:
    given = {"distance": (0.3, 0.6), "height": (0.1, 0.8), "tilt": (0.2, 1.2), **changes}
    return ViewLimits(**given)  # pyright: ignore[reportArgumentType]


def test_cameras_are_upright_and_see_their_targets_in_the_middle() -> None:
    random = np.random.default_rng(0)
    eyes, targets = random.normal(size=(2, 50, 3))
    Ts = looking_at(eyes, targets)
    for T, eye, target in zip(Ts, eyes, targets, strict=True):
        assert checked(T) == pytest.approx(T)
        x, y, z = np.linalg.inv(T) @ [*target, 1.0] @ np.eye(4)[:, :3]
        assert (x, y) == pytest.approx((0.0, 0.0), abs=1e-12)
        assert z == pytest.approx(np.linalg.norm(target - eye))
        assert T[2, 0] == 0.0, "the image's x is horizontal"
        assert T[2, 1] <= 0.0, "up in the world is up in the image"
    down = np.arctan2(eyes[:, 2] - targets[:, 2], np.linalg.norm((eyes - targets)[:, :2], axis=1))
    assert tilts_of(Ts) == pytest.approx(down)


def test_straight_down_and_up_the_image_s_x_is_the_world_s() -> None:
    eyes, targets = np.array([[1.0, 2.0, 3.0], [1.0, 2.0, -3.0]]), np.array([[1.0, 2.0, 0.0]] * 2)
    Ts = looking_at(eyes, targets)
    assert Ts[0, :3, :3].T.tolist() == [[1, 0, 0], [0, -1, 0], [0, 0, -1]]
    assert Ts[1, :3, :3].T.tolist() == [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    assert tilts_of(Ts) == pytest.approx([math.pi / 2, -math.pi / 2])


def test_rounding_turns_no_camera_that_looks_straight_down() -> None:
    aside = 1e-13 * np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, -1.0, 0.0]])
    Ts = looking_at(np.array([0.0, 0.0, 2.0]) + aside, np.zeros((3, 3)))
    assert Ts[:, :3, :3] == pytest.approx(np.tile(np.diag([1.0, -1.0, -1.0]), (3, 1, 1)))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"distance": (0.6, 0.3)}, "the limits of distance are the wrong way round: 0.6 is more than 0.3"),
        ({"height": (0.6, 0.3)}, "the limits of height are the wrong way round"),
        ({"tilt": (0.6, 0.3)}, "the limits of tilt are the wrong way round: 34.3775 is more than 17.1887 degrees"),
        ({"distance": (math.nan, 0.3)}, "the limits of distance must be finite numbers of metres, not nan and 0.3"),
        ({"height": (0.0, math.inf)}, "the limits of height must be finite numbers of metres"),
        ({"distance": (0.3, 1e300)}, "the limits of distance must be within 1e\\+07 metres"),
        ({"distance": (-0.1, 0.3)}, "a distance must be more than 0 m, not -0.1 to 0.3"),
        ({"distance": (0.0, 0.0)}, "a distance must be more than 0 m"),
        ({"tilt": (0.0, 2.0)}, "a tilt lies between -90 degrees, straight up, and 90, straight down, not 0 to 114.592"),
        ({"tilt": (-2.0, 0.0)}, "straight up, and 90, straight down, not -114.592 to 0"),
        ({"min_visible": 1.5}, "from 0 to 1, not 1.5"),
        ({"min_visible": math.nan}, "from 0 to 1, not nan"),
        ({"clearance": -0.1}, "the clearance must be 0 m or more, not -0.1"),
        ({"clearance": math.inf}, "the clearance must be 0 m or more, not inf"),
    ],
)
def test_limits_that_cannot_be(changes: dict[str, object], said: str) -> None:
    with pytest.raises(BadInput, match=said):
        limits(**changes)


def test_limits_that_leave_no_room_are_named() -> None:
    check_room(limits(), [cube_at(0.1)])
    check_room(limits(height=(2.5, 3.0)), [cube_at(0.1), cube_at(2.3)])
    # From near the camera is low enough, from far it is not; looking up it may be below.
    check_room(limits(height=(0.1, 0.3), distance=(0.3, 3.0), tilt=(0.5, 0.6)), [cube_at(0.0)])
    check_room(limits(height=(-1.0, -0.5), distance=(0.3, 3.0), tilt=(-0.5, 0.6)), [cube_at(0.0)])
    with pytest.raises(BadInput, match=r"no camera is 2\.5 to 3 m high and within 0\.6 m of an object"):
        check_room(limits(height=(2.5, 3.0)), [cube_at(0.1)])
    with pytest.raises(
        BadInput, match=r"tilts of 0 to 5\.73 degrees at distances of 0\.3 to 0\.6 m put the camera 0\.1"
    ):
        check_room(limits(height=(0.5, 3.0), tilt=(0.0, 0.1)), [cube_at(0.1)])


def ring_of(degrees: float) -> np.ndarray:
    """Level cameras round the origin, through so many degrees, looking down at it a little."""
    angles = np.radians(np.linspace(0.0, degrees, 40, endpoint=False))
    eyes = np.stack([np.cos(angles), np.sin(angles), np.full(40, 0.6)], axis=-1)
    return looking_at(eyes, np.zeros((40, 3)))


def turned(Ts: np.ndarray, axis: tuple[float, float, float], angle: float) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = turn_about(np.array(axis), angle)
    return T @ Ts


@pytest.mark.parametrize("degrees", [90.0, 360.0])
@pytest.mark.parametrize("angle", [0.0, 0.3, math.pi / 2])
def test_a_world_whose_z_is_not_up_shows_in_level_cameras(degrees: float, angle: float) -> None:
    assert lean_of_world(turned(ring_of(degrees), (1.0, 0.0, 0.0), angle)) == pytest.approx(angle, abs=1e-6)


def test_cameras_that_say_nothing_of_what_is_up_speak_against_no_z() -> None:
    on_side = turned(ring_of(360.0), (1.0, 0.0, 0.0), math.pi / 2)
    assert lean_of_world(on_side[:1]) == 0.0, "one frame"
    assert lean_of_world(turned(ring_of(10.0), (1.0, 0.0, 0.0), math.pi / 2)) == 0.0, "nearly one way"
    rolled = ring_of(360.0)
    rolled[:, :3, :2] = np.stack([rolled[:, :3, 1], -rolled[:, :3, 0]], axis=-1)
    assert lean_of_world(rolled) == 0.0, "images a quarter turn about their axes"
    down = looking_at(np.random.default_rng(0).normal(size=(20, 3)) * [1, 1, 0] + [0, 0, 3], np.zeros((20, 3)))
    assert lean_of_world(down) == pytest.approx(0.0, abs=1e-6), "from above"
