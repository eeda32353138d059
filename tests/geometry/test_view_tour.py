"""Tours of poses: nearly the shortest, never longer than the nearest neighbour's."""

import math
from itertools import permutations

import numpy as np
import pytest

from ars_web.geometry import rigid_transform, view_tour
from ars_web.geometry.symmetry import turn_about
from ars_web.geometry.view_tour import (
    RADIAN,
    camera_turns,
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


def lattice(spacing: float) -> np.ndarray:
    """Poses of which many are as far apart as many others."""
    places = np.stack(np.meshgrid(*[np.arange(6.0)] * 2, [0.0]), axis=-1).reshape(-1, 3)
    return rigid_transform.from_rotation(np.eye(3), places * spacing)


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


@pytest.mark.parametrize("seed", range(3))
def test_no_stretch_turned_round_and_none_of_three_moved_shortens_a_tour(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The best of many first poses may be as good by chance.
    monkeypatch.setattr(view_tour, "STARTS", 1)
    distances = pose_distances(random_poses(24, seed))
    path = short_path(distances).tolist()
    shortest_of_all = path_length(distances, np.array(path)) - 1e-9
    for i in range(1, 24):
        for j in range(i + 1, 25):
            stretch, rest = path[i:j], path[:i] + path[j:]
            others = [[*path[:i], *stretch[::-1], *path[j:]]]
            if len(stretch) <= 3:
                others += [
                    [*rest[:at], *way, *rest[at:]] for at in range(1, len(rest) + 1) for way in (stretch, stretch[::-1])
                ]
            assert min(path_length(distances, np.array(other)) for other in others) >= shortest_of_all


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


def test_the_turns_of_a_camera_are_those_from_each_pose_to_the_next() -> None:
    Ts = rigid_transform.from_rotation(
        np.stack([turn_about(Z, angle) for angle in (0.0, 0.7, 0.7, 0.7 + math.pi, 0.1)]), np.arange(15.0).reshape(5, 3)
    )
    assert camera_turns(Ts) == pytest.approx([0.7, 0.0, math.pi, math.pi - 0.6], abs=1e-7)
    assert camera_turns(Ts[:1]).tolist() == []


@pytest.mark.parametrize("spacing", [1.0, 1e3 / 3, 1e5 / 3, 1e7 / 3])
def test_shortening_ends_however_far_poses_are(spacing: float, monkeypatch: pytest.MonkeyPatch) -> None:
    turned, looks = view_tour._turned, [0]

    def counted(*given: object, **more: object) -> object:
        looks[0] += 1
        assert looks[0] < 20_000, "rounding is taken for a shorter path, without end"
        return turned(*given, **more)  # pyright: ignore[reportArgumentType]

    monkeypatch.setattr(view_tour, "_turned", counted)
    distances = pose_distances(lattice(spacing))
    assert path_length(distances, short_path(distances)) < 1.02 * 35 * spacing


def test_poses_that_are_as_far_as_others_are_visited_in_one_order_whatever_is_rounded() -> None:
    Ts = lattice(0.1)
    expected = tour(Ts[0], Ts[1:]).tolist()
    for seed in range(5):
        moved = Ts.copy()
        moved[:, :3, 3] += np.random.default_rng(seed).normal(0.0, 1e-14, (len(Ts), 3))
        assert tour(moved[0], moved[1:]).tolist() == expected


def test_other_first_poses_than_the_nearest_are_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    every = [pose_distances(random_poses(25, seed)) for seed in range(6)]
    many = [path_length(one, short_path(one)) for one in every]
    monkeypatch.setattr(view_tour, "STARTS", 1)
    single = [path_length(one, short_path(one)) for one in every]
    assert all(a <= b + 1e-9 for a, b in zip(many, single, strict=True))
    assert sum(many) < sum(single) - 0.1


def test_no_detour_is_shorter() -> None:
    distances = pose_distances(random_poses(20, 5))
    through = (distances[:, :, None] + distances[None]).min(axis=1)
    assert (through >= distances - 1e-12).all()


def test_a_tour_begins_at_the_start_which_is_none_of_its_poses() -> None:
    line = rigid_transform.from_rotation(np.eye(3), np.array([[3.0, 0, 0], [1.0, 0, 0], [2.0, 0, 0]]))
    assert tour(np.eye(4), line).tolist() == [1, 2, 0]
    assert tour(line[0], line[1:]).tolist() == [1, 0]
    assert tour(np.eye(4), np.zeros((0, 4, 4))).tolist() == []
