"""Tours of poses: nearly the shortest, never longer than the nearest neighbour's."""

import math
from itertools import permutations

import numpy as np
import pytest

from ars_web.geometry import rigid_transform
from ars_web.geometry.symmetry import turn_about
from ars_web.geometry.view_tour import (
    RADIAN,
    nearest_neighbour_path,
    path_length,
    pose_distances,
    short_path,
    tour,
)

Z = np.array([0.0, 0.0, 1.0])


def random_poses(n: int, seed: int) -> np.ndarray:
    random = np.random.default_rng(seed)
    return rigid_transform.from_position_wxyz(random.uniform(-1, 1, (n, 3)), random.normal(size=(n, 4)))


def shortest(distances: np.ndarray) -> float:
    """Of all paths from place 0: each of them is tried."""
    paths = np.array([(0, *rest) for rest in permutations(range(1, len(distances)))])
    return float(distances[paths[:, :-1], paths[:, 1:]].sum(axis=1).min())


@pytest.mark.parametrize("n", [1, 2, 3, 5, 7, 8])
def test_short_tours_are_nearly_the_shortest(n: int) -> None:
    for seed in range(4):
        distances = pose_distances(random_poses(n + 1, seed))
        path = short_path(distances)
        assert path[0] == 0
        assert sorted(path.tolist()) == list(range(n + 1))
        assert path_length(distances, path) <= 1.05 * shortest(distances)


@pytest.mark.parametrize("n", [20, 70])
def test_tours_are_shorter_than_the_nearest_neighbour_s(n: int) -> None:
    for seed in range(3):
        distances = pose_distances(random_poses(n, seed))
        path = short_path(distances)
        assert sorted(path.tolist()) == list(range(n))
        assert path_length(distances, path) < path_length(distances, nearest_neighbour_path(distances))


def test_the_nearest_neighbour_goes_to_the_nearest() -> None:
    places = np.array([0.0, 1.0, -1.5, 4.0])
    distances = np.abs(places[:, None] - places[None])
    assert nearest_neighbour_path(distances).tolist() == [0, 1, 2, 3]
    assert nearest_neighbour_path(distances, first=2).tolist() == [0, 2, 1, 3]
    assert short_path(distances).tolist() == [0, 2, 1, 3]


def test_turning_counts_as_metres() -> None:
    still = np.eye(4)
    turned = rigid_transform.from_rotation(turn_about(Z, 0.7), np.zeros(3))
    moved = rigid_transform.from_rotation(turn_about(Z, math.pi), np.array([3.0, 4.0, 0.0]))
    distances = pose_distances(np.array([still, turned, moved]))
    assert distances[0, 1] == pytest.approx(0.7 * RADIAN)
    assert distances[0, 2] == pytest.approx(5.0 + math.pi * RADIAN)
    assert (distances == distances.T).all()
    assert (np.diag(distances) == 0.0).all()


def test_no_detour_is_shorter() -> None:
    distances = pose_distances(random_poses(20, 5))
    through = (distances[:, :, None] + distances[None]).min(axis=1)
    assert (through >= distances - 1e-12).all()


def test_a_tour_begins_at_the_start_which_is_none_of_its_poses() -> None:
    line = rigid_transform.from_rotation(np.eye(3), np.array([[3.0, 0, 0], [1.0, 0, 0], [2.0, 0, 0]]))
    assert tour(np.eye(4), line).tolist() == [1, 2, 0]
    assert tour(line[0], line[1:]).tolist() == [1, 0]
    assert tour(np.eye(4), np.zeros((0, 4, 4))).tolist() == []
