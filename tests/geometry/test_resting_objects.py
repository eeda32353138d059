"""Where objects rest, from poses that are noisy, wrong, or alike under a symmetry."""

import numpy as np
import pytest

from ars_web.geometry import rigid_transform
from ars_web.geometry.resting_objects import resting_objects
from ars_web.geometry.symmetry import Symmetry, rotations_of

SIZE = np.array([0.06, 0.04, 0.08])


def turn(angle: float, axis: int = 2) -> np.ndarray:
    R = rigid_transform.rotation_about_z(angle)
    order = np.roll(np.arange(3), axis - 2)
    return R[np.ix_(np.argsort(order), np.argsort(order))]


def placed(x: float, R: np.ndarray, y: float = 0.0) -> np.ndarray:
    return rigid_transform.from_rotation(R, np.array([x, y, 0.1]))


def angle_between(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.arccos(np.clip((np.trace(a.T @ b) - 1) / 2, -1, 1)))


def test_two_of_a_kind_are_told_apart_by_where_they_are() -> None:
    """Also where they are listed in another order, and where one is out of sight for a while."""
    images = np.array([0, 0, 1, 1, 2, 3, 3])
    xs = [0.0, 0.3, 0.3, 0.0, 0.3, 0.0, 0.3]
    Ts = np.array([placed(x, turn(0.3)) for x in xs])
    first, second = resting_objects(images, Ts, size=SIZE)
    assert (first.rows.tolist(), second.rows.tolist()) == ([0, 3, 5], [1, 2, 4, 6])
    np.testing.assert_allclose(second.T_world_box, placed(0.3, turn(0.3)), atol=1e-12)
    assert (first.problem, second.problem) == (None, None)


def test_neighbours_do_not_trade_places() -> None:
    """Side by side with a gap of a millimetre, and 5 mm of noise."""
    random = np.random.default_rng(1)
    images = np.repeat(np.arange(30), 2)
    Ts = np.array([placed(0.061 * (i % 2), np.eye(3)) for i in range(60)])
    Ts[:, :3, 3] += random.normal(0, 0.003, (60, 3))
    found = resting_objects(images, Ts, size=SIZE)
    assert [one.rows.tolist() for one in found] == [list(range(0, 60, 2)), list(range(1, 60, 2))]


def test_a_wrong_pose_does_not_move_an_object() -> None:
    images = np.arange(9)
    Ts = np.array([placed(0.0, np.eye(3)) for _ in images])
    Ts[4] = placed(0.03, turn(1.0))
    (one,) = resting_objects(images, Ts, size=SIZE)
    np.testing.assert_allclose(one.T_world_box, placed(0.0, np.eye(3)), atol=1e-9)
    assert one.problem is None


def test_a_pose_far_away_is_no_object() -> None:
    images = np.arange(9)
    Ts = np.array([placed(2.0 if i == 4 else 0.0, np.eye(3)) for i in images])
    one, astray = resting_objects(images, Ts, size=SIZE)
    assert one.problem is None
    assert len(one.rows) == 8
    assert "seen at its place in one image only" in astray.problem


def test_one_image_is_enough_where_there_is_no_more() -> None:
    Ts = np.array([placed(0.0, turn(0.2)), placed(0.5, turn(0.2))])
    found = resting_objects(np.array([0, 0]), Ts, size=SIZE)
    assert [one.problem for one in found] == [None, None]
    assert resting_objects(np.zeros(0, np.int64), np.zeros((0, 4, 4)), size=SIZE) == []


@pytest.mark.parametrize(("step", "said"), [(0.02, "it does not rest"), (0.5, "in one image only")])
def test_what_moves_does_not_rest(step: float, said: str) -> None:
    images = np.arange(10)
    Ts = np.array([placed(step * i, np.eye(3)) for i in images])
    found = resting_objects(images, Ts, size=SIZE)
    assert all(said in one.problem for one in found)


def test_what_turns_does_not_rest_unless_it_looks_the_same() -> None:
    images = np.arange(10)
    Ts = np.array([placed(0.0, turn(0.2) @ turn(0.9 * i)) for i in images])
    (one,) = resting_objects(images, Ts, size=SIZE)
    assert "it does not rest" in one.problem
    (round_,) = resting_objects(images, Ts, size=SIZE, symmetry=Symmetry("continuous", axis=(0.0, 0.0, 1.0)))
    assert round_.problem is None
    np.testing.assert_allclose(round_.T_world_box[:3, 2], [0, 0, 1], atol=1e-12)


def test_alike_poses_have_one_mean() -> None:
    """Half a turn about z, half one about x, and 1 degree of noise."""
    random = np.random.default_rng(2)
    symmetry = Symmetry("discrete", (((0.0, 0.0, 1.0), 2), ((1.0, 0.0, 0.0), 2)))
    rotations = rotations_of(symmetry)
    R = turn(0.7) @ turn(0.4, 0)
    noise = rigid_transform.rotation_from_wxyz(np.column_stack([np.ones(40), random.normal(0, 0.005, (40, 3))]))
    Ts = np.array([placed(0.0, R @ noise[i] @ rotations[i % 4]) for i in range(40)])
    (one,) = resting_objects(np.arange(40), Ts, size=SIZE, symmetry=symmetry)
    assert one.problem is None
    assert min(angle_between(one.T_world_box[:3, :3], R @ S) for S in rotations) < np.radians(0.5)
    assert one.turned < np.radians(1.5)


def test_a_rod_may_lie_either_way_round() -> None:
    """Any turn about its axis, and its ends alike."""
    random = np.random.default_rng(3)
    flip, R = turn(np.pi, 0), turn(0.3) @ turn(1.2, 0)
    Ts = np.array([placed(0.0, R @ turn(random.uniform(0, 6)) @ (flip if i % 2 else np.eye(3))) for i in range(20)])
    symmetry = Symmetry("continuous", axis=(0.0, 0.0, 1.0), flip=True)
    (one,) = resting_objects(np.arange(20), Ts, size=SIZE, symmetry=symmetry)
    assert one.problem is None
    assert abs(one.T_world_box[:3, 2] @ R[:, 2]) == pytest.approx(1.0)
