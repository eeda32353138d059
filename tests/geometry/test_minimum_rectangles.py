"""Smallest rectangles against every side tried in turn, and against OpenCV's."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial import ConvexHull

from ars_web.geometry.minimum_rectangles import minimum_rectangles


def by_trying(ring: np.ndarray) -> float:
    """The least area of the boxes of a ring turned so that each of its sides lies along an axis."""
    areas = []
    for side in np.roll(ring, -1, axis=0) - ring:
        if np.hypot(*side) > 0:
            x, y = side / np.hypot(*side)
            areas.append(np.prod(np.ptp(ring @ [[x, -y], [y, x]], axis=0)))
    return min(areas)


def rectangle(ring: np.ndarray) -> np.ndarray:
    return minimum_rectangles(ring, np.array([0, len(ring)]))[0]


def check(found: np.ndarray, ring: np.ndarray) -> None:
    """Rectangular, clockwise as seen from the top left corner, round the ring, and as small as can be."""
    size = np.abs(ring).max() + 1
    down, right = found[3] - found[0], found[1] - found[0]
    assert_allclose(found[2] - found[1], down, atol=1e-9 * size)
    assert abs(right @ down) < 1e-9 * size**2
    area = right[0] * down[1] - right[1] * down[0]  # positive clockwise, y down
    assert area == pytest.approx(by_trying(ring), rel=1e-9, abs=1e-9 * size)
    assert found.sum(axis=1).argmin() == 0 or np.ptp(np.sort(found.sum(axis=1))[:2]) < 1e-8
    for corner, (dx, dy) in zip(found, np.roll(found, -1, axis=0) - found, strict=True):
        if np.hypot(dx, dy) > 1e-6 * size:
            left = (ring - corner) @ np.array([-dy, dx]) / np.hypot(dx, dy)
            assert left.min() > -1e-9 * size


@given(st.integers(0, 2**32 - 1), st.integers(3, 60), st.floats(1e-3, 1))
def test_it_is_the_smallest_of_those_along_each_side(seed: int, n: int, squeeze: float):
    random = np.random.default_rng(seed)
    points = random.normal(size=(n, 2)) * [100, 100 * squeeze] @ np.linalg.qr(random.normal(size=(2, 2)))[0]
    points += random.uniform(0, 1000, 2)
    ring = points[ConvexHull(points).vertices][::-1]
    found = rectangle(ring)
    check(found, ring)
    (_, (width, height), _) = cv2.minAreaRect(points.astype(np.float32))
    sides = sorted([np.hypot(*(found[1] - found[0])), np.hypot(*(found[2] - found[1]))])
    # OpenCV reckons in single precision, and may take another rectangle that is as small.
    assert np.prod(sides) == pytest.approx(width * height, rel=2e-3, abs=0.05)


def test_corners_are_in_the_order_that_dota_has_them():
    upright = np.array([[10.0, 20], [10, 50], [30, 50], [30, 20]])
    for start in range(4):
        assert_allclose(rectangle(np.roll(upright, start, axis=0)), [[10, 20], [30, 20], [30, 50], [10, 50]])
    # Two corners of a diamond are as near to the top left: the upper one is first.
    diamond = np.array([[0.0, 10], [10, 20], [20, 10], [10, 0]])
    assert_allclose(rectangle(diamond), [[10, 0], [20, 10], [10, 20], [0, 10]], atol=1e-9)


@pytest.mark.parametrize(
    ("ring", "want"),
    [
        ([[5.0, 7]], [[5, 7]] * 4),
        ([[5.0, 7], [5, 7], [5, 7]], [[5, 7]] * 4),
        ([[1.0, 1], [4, 5]], [[1, 1], [1, 1], [4, 5], [4, 5]]),
        ([[1.0, 1], [2.5, 3], [4, 5], [2.5, 3]], [[1, 1], [1, 1], [4, 5], [4, 5]]),
    ],
)
def test_points_and_lines_have_rectangles_without_area(ring: list[list[float]], want: list[list[float]]):
    found = rectangle(np.array(ring))
    assert_allclose(sorted(found.tolist()), sorted(want), atol=1e-12)
    assert_allclose(found[2] - found[1], found[3] - found[0], atol=1e-12)


def test_repeated_corners_and_corners_in_a_row_do_not_stop_it():
    angles = -np.linspace(0, 2 * np.pi, 12, endpoint=False)
    ring = np.column_stack([30 * np.cos(angles), 10 * np.sin(angles)])
    middles = (ring + np.roll(ring, -1, axis=0)) / 2
    crowded = np.repeat(np.stack([ring, middles], axis=1).reshape(-1, 2), 3, axis=0)
    assert_allclose(rectangle(crowded), rectangle(ring), atol=1e-9)


def test_many_rings_are_each_as_if_alone_and_empty_ones_are_nan():
    random = np.random.default_rng(0)
    lengths = random.integers(3, 12, 40_000) * (random.random(40_000) > 0.2)
    offsets = np.concatenate([[0], np.cumsum(lengths)])
    owner = np.repeat(np.arange(len(lengths)), lengths)
    angles = -2 * np.pi * (np.arange(len(owner)) - offsets[owner]) / lengths[owner]
    points = np.column_stack([np.cos(angles) * 50, np.sin(angles) * 20]) + random.normal(size=(len(lengths), 2))[owner]
    found = minimum_rectangles(points, offsets)
    assert_array_equal(np.isnan(found).all(axis=(1, 2)), lengths == 0)
    for i in (*range(0, 40_000, 999), 16_383, 16_384):
        if lengths[i]:
            ring = points[offsets[i] : offsets[i + 1]]
            assert_array_equal(found[i], rectangle(ring))
            check(found[i], ring)


def test_no_rings_have_no_rectangles():
    assert minimum_rectangles(np.zeros((0, 2)), np.array([0])).shape == (0, 4, 2)
