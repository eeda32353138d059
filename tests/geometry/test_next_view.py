"""Frames suggested for drawing: from another side, whole, large enough, unhidden; and worth more than others."""

import math

import numpy as np
import pytest

from ars_web.errors import BadInput
from ars_web.geometry import camera as cameras
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.next_view import SuggestedView, suggest_views
from ars_web.geometry.polygon import Polygon
from ars_web.geometry.view_guess import FrameRows, Guess, guess_of_box, guess_of_hull, guesses_of_view
from ars_web.geometry.visual_hull import View, visual_hull

CAMERA = Camera(640, 480, 600.0, 600.0, 320.0, 240.0, "brown", (-0.2, 0.05, 0.001, -0.001, 0.0))
SMALL = Camera(160, 120, 150.0, 150.0, 79.5, 59.5)
BALL = Guess(np.array([0.01, -0.02, 0.03]), 0.05)


def looking(
    azimuth: float, elevation: float, *, at: tuple[float, ...] = (0, 0, 0), distance: float = 0.6
) -> np.ndarray:
    """`T_world_camera` of a camera round the origin, degrees, that looks at a point."""
    a, e = np.radians([azimuth, elevation])
    centre = distance * np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    z = np.array(at) - centre
    z = z / np.linalg.norm(z)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    return rigid_transform.from_rotation(np.column_stack([x, np.cross(z, x), z]), centre)


def rows(Ts: list[np.ndarray], camera: Camera = CAMERA) -> FrameRows:
    return FrameRows({7: camera}, np.full(len(Ts), 7), np.array(Ts))


def ring(n: int, *, elevation: float = 25.0) -> list[np.ndarray]:
    return [looking(360 * i / n, elevation) for i in range(n)]


def drawn(frame: int, T: np.ndarray, ball: Guess = BALL) -> View:
    """The ball's outline in a frame, as a person draws it."""
    towards = T[:3, 3] - ball.centre_world
    across = np.linalg.svd((towards / np.linalg.norm(towards))[None])[2][1:]
    angles = np.linspace(0, 2 * np.pi, 60, endpoint=False)[:, None]
    points = ball.centre_world + ball.radius * (across[0] * np.cos(angles) + across[1] * np.sin(angles))
    points = rigid_transform.transform_points(rigid_transform.invert(T), points)
    image = cameras.image_from_pixels(cameras.pixels_from_camera_points(CAMERA, points))
    return View(frame, CAMERA, T, (Polygon(image),))


def degrees(a: np.ndarray, b: np.ndarray) -> float:
    """Between two cameras, seen from the ball."""
    u, v = a[:3, 3] - BALL.centre_world, b[:3, 3] - BALL.centre_world
    return math.degrees(math.acos(u @ v / np.linalg.norm(u) / np.linalg.norm(v)))


@pytest.mark.parametrize("first", [0, 5, 17])
def test_the_second_frame_sees_the_object_from_the_side(first: int):
    Ts = ring(36)
    found = suggest_views(guesses_of_view(drawn(first, Ts[first]), rows(Ts)), [first], rows(Ts))[0]
    assert 65 < degrees(Ts[first], Ts[found.frame]) < 100
    assert math.degrees(found.angle) == pytest.approx(degrees(Ts[first], Ts[found.frame]), abs=8)


def test_the_third_frame_sees_it_from_above_where_one_does():
    Ts = [*ring(36, elevation=5), looking(40, 80)]
    hull = visual_hull([drawn(0, Ts[0]), drawn(9, Ts[9])])
    found = suggest_views(guess_of_hull(hull), [0, 9], rows(Ts))[0]
    assert found.frame == 36
    # Without that one, it is one between the two, or across from that.
    found = suggest_views(guess_of_hull(hull), [0, 9], rows(Ts[:36]))[0]
    assert found.frame % 9 in (3, 4, 5, 6)


def test_suggested_frames_make_a_smaller_hull_than_evenly_spread_ones():
    Ts = [looking(azimuth, elevation) for elevation in (15, 40, 65) for azimuth in range(0, 360, 20)]
    for n in (2, 3):
        views = [drawn(0, Ts[0])]
        guesses = guesses_of_view(views[0], rows(Ts))
        while len(views) < n:
            (found,) = suggest_views(guesses, [view.frame for view in views], rows(Ts))
            views.append(drawn(found.frame, Ts[found.frame]))
            guesses = guess_of_hull(visual_hull(views))
        even = [drawn(len(Ts) * i // n, Ts[len(Ts) * i // n]) for i in range(n)]
        assert visual_hull(views).volume < 0.8 * visual_hull(even).volume


def test_agreement_says_which_frame_is_worth_more():
    Ts = ring(36, elevation=0)
    worth = {}
    for other in (1, 3, 6, 9, 18):
        allowed = np.arange(36) == other
        (found,) = suggest_views([BALL], [0], rows(Ts), allowed=allowed)
        assert found.frame == other
        worth[other] = found.agreement
    assert worth[1] < worth[3] < worth[6] < worth[9]
    # From across, the outline is the same again.
    assert worth[18] < worth[3]
    assert all(0 < value <= 1 for value in worth.values())


def test_a_pair_is_suggested_for_an_object_that_is_drawn_nowhere_yet():
    Ts = ring(36)
    box = Box(rigid_transform.from_rotation(np.eye(3), BALL.centre_world), np.array([0.1, 0.08, 0.12]))
    first, second = suggest_views(guess_of_box(box), [], rows(Ts), count=2)
    assert math.isnan(first.angle)
    assert 65 < degrees(Ts[first.frame], Ts[second.frame]) < 115
    assert first.agreement == pytest.approx(second.agreement, abs=0.03)


def test_each_suggestion_counts_for_the_next():
    Ts = ring(36)
    found = suggest_views([BALL], [0], rows(Ts), count=4)
    frames = [0, *(view.frame for view in found)]
    assert len(set(frames)) == 5
    apart = [degrees(Ts[a], Ts[b]) for a in frames for b in frames if a < b]
    assert min(apart) > 20
    worth = [view.agreement for view in found]
    assert worth == sorted(worth)


def at_90_degrees(T: np.ndarray) -> list[SuggestedView]:
    """What is suggested after frame 0 where frame 1 is `T`, which would see the ball from the best side."""
    return suggest_views([BALL], [0], rows([looking(0, 25), T]))


def test_a_frame_is_not_suggested_that_does_not_show_the_object_well():
    assert at_90_degrees(looking(90, 25))
    turn_round = rigid_transform.from_rotation(np.diag([-1.0, 1.0, -1.0]), np.zeros(3))
    assert not at_90_degrees(looking(90, 25) @ turn_round)  # behind the camera
    assert not at_90_degrees(looking(90, 25, at=(0.3, 0, 0)))  # partly out of the image
    assert not at_90_degrees(looking(90, 25, at=(1, 0, 0)))  # wholly out of it
    assert not at_90_degrees(looking(90, 25, distance=3.0))  # 20 px wide
    assert not at_90_degrees(looking(90, 25, distance=0.08))  # within arm's length of a mouse


def test_what_other_boxes_hide_is_not_suggested():
    Ts = ring(36)
    (free,) = suggest_views([BALL], [0], rows(Ts))
    towards = Ts[free.frame][:3, 3] - BALL.centre_world
    place = BALL.centre_world + 0.4 * towards
    wall = Box(rigid_transform.from_rotation(np.eye(3), place), np.full(3, 0.15))
    (found,) = suggest_views([BALL], [0], rows(Ts), others=[wall])
    assert degrees(Ts[free.frame], Ts[found.frame]) > 20
    assert 50 < degrees(Ts[0], Ts[found.frame]) < 130


def test_cameras_of_several_kinds():
    Ts = ring(36)
    # Even frames are the small camera's, in whose images the ball is too small to be drawn well from afar.
    Ts = [looking(10 * i, 25, distance=0.75 if i % 2 == 0 else 0.6) for i in range(36)]
    both = FrameRows({1: CAMERA, 2: SMALL}, np.where(np.arange(36) % 2 == 0, 2, 1), np.array(Ts))
    found = suggest_views([BALL], [1], both, count=3)
    assert all(view.frame % 2 for view in found)


def test_a_few_of_very_many_frames_are_found():
    """The object is in 40 of 20,000 frames, which even steps all pass by."""
    away = looking(0, 25, at=(5, 5, 0))
    Ts = np.broadcast_to(away, (20_000, 4, 4)).copy()
    Ts[7_011:7_051] = [looking(90 + 9 * i, 25) for i in range(40)]
    many = FrameRows({0: CAMERA}, np.zeros(20_000, dtype=np.int64), Ts)
    (found,) = suggest_views([BALL], [7_011], many)
    assert 7_011 < found.frame < 7_051
    assert 70 < degrees(Ts[7_011], Ts[found.frame]) < 110


def test_no_frame_at_all():
    Ts = ring(6)
    assert suggest_views([BALL], list(range(6)), rows(Ts)) == []
    assert suggest_views([BALL], [0], rows(Ts), allowed=np.zeros(6, dtype=bool)) == []
    with pytest.raises(BadInput, match="at least 1 frame"):
        suggest_views([BALL], [0], rows(Ts), count=0)
    with pytest.raises(BadInput, match="must be guessed"):
        suggest_views([], [0], rows(Ts))
    away = [looking(0, 25), *(looking(a, 25, at=(5, 5, 0)) for a in (80, 90, 100))]
    with pytest.raises(BadInput, match="no other frame shows what is drawn in frame 0"):
        guesses_of_view(drawn(0, away[0]), rows([away[1]]))
