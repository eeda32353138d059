"""Neighbours across a split, beside a slow search of all pairs."""

import math

import cv2
import numpy as np
import pytest

from ars_web.geometry import rigid_transform
from ars_web.studies import split_neighbours
from ars_web.studies.split_neighbours import TWIN_MOVE, TWIN_TURN, Neighbours, neighbours


def poses(n: int, *, seed: int = 0, at: float = 0.0) -> np.ndarray:
    random = np.random.default_rng(seed)
    rotations = np.stack([cv2.Rodrigues(v)[0] for v in random.normal(0, 0.3, (n, 3))])
    return rigid_transform.from_rotation(rotations, random.normal(0, 0.3, (n, 3)) + at)


def turned(T: np.ndarray, degrees: float, *, by: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> np.ndarray:
    found = T.copy()
    found[:3, :3] = T[:3, :3] @ cv2.Rodrigues(np.array([0.0, 0.0, math.radians(degrees)]))[0]
    found[:3, 3] += by
    return found


@pytest.mark.parametrize("at", [0.0, 4e6])
def test_the_nearest_is_the_nearest(at: float, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(split_neighbours, "_PAIRS_AT_ONCE", 50)
    Ts, distances = poses(60, at=at), np.linspace(0.5, 2.0, 60)
    asked, training = np.arange(0, 60, 4), np.setdiff1d(np.arange(60), np.arange(0, 60, 4))
    found = neighbours(Ts, distances, asked, training)
    for place, i in enumerate(asked):
        moves = np.linalg.norm(Ts[training, :3, 3] - Ts[i, :3, 3], axis=1) / distances[i]
        turns = np.array([np.linalg.norm(cv2.Rodrigues(Ts[i, :3, :3].T @ Ts[j, :3, :3])[0]) for j in training])
        best = int(np.argmin(np.maximum(moves / TWIN_MOVE, turns / TWIN_TURN)))
        assert found.nearest[place] == training[best]
        assert found.move[place] == pytest.approx(moves[best], abs=1e-6)
        assert found.turn[place] == pytest.approx(turns[best], abs=1e-6)


def test_a_twin_is_near_and_looks_the_same_way() -> None:
    T = poses(1)[0]
    asked = [
        turned(T, 4.0),
        turned(T, 6.0),
        turned(T, 0.0, by=(0.09, 0.0, 0.0)),
        turned(T, 0.0, by=(0.11, 0.0, 0.0)),
        turned(T, 180.0),
    ]
    Ts = np.stack([T, *asked])
    # Two metres from the nearest object: 5 % are ten centimetres.
    found = neighbours(Ts, np.full(6, 2.0), np.arange(1, 6), np.array([0]))
    assert found.twins.tolist() == [True, False, True, False, False]
    assert np.degrees(found.turn).round(6).tolist() == [4.0, 6.0, 0.0, 0.0, 180.0]
    assert found.move.round(6).tolist() == [0.0, 0.0, 0.045, 0.055, 0.0]


def test_a_turn_past_half_a_turn_is_the_shorter_way_round() -> None:
    T = np.eye(4)
    # Quaternions of 179 and 181 degrees point nearly opposite ways.
    Ts = np.stack([turned(T, 181.0), turned(T, 179.0), turned(T, 0.0)])
    found = neighbours(Ts, np.full(3, 1.0), np.array([0]), np.array([1, 2]))
    assert found.nearest.tolist() == [1]
    assert np.degrees(found.turn) == pytest.approx([2.0], abs=1e-6)
    assert found.twins.tolist() == [True]


def test_at_the_limits_frames_are_no_twins() -> None:
    rows, none = np.arange(3), np.zeros(3, dtype=np.int64)
    move, turn = np.array([TWIN_MOVE, 0.9 * TWIN_MOVE, 0.0]), np.array([0.0, TWIN_TURN, 0.9 * TWIN_TURN])
    assert Neighbours(rows, none, move, turn).twins.tolist() == [False, False, True]
