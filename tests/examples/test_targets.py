"""Boxes to planes and back: what a network that says exactly what it is to say would be read as."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from examples.train_detector.targets import STRIDE, decode, encode, overlaps

SIZE = (64, 48)


def read_back(boxes: np.ndarray, classes: np.ndarray) -> list[tuple[int, list[float]]]:
    targets = encode(boxes, classes, count=3, size=SIZE)
    found = decode(targets.heat, targets.sides, least=0.99)
    assert (found.scores == 1).all()
    return sorted((int(class_), box.round(4).tolist()) for class_, box in zip(found.classes, found.boxes, strict=True))


@given(st.integers(0, 2), st.floats(0, 60), st.floats(0, 44), st.floats(0.5, 60), st.floats(0.5, 44))
def test_a_box_comes_back(class_: int, x: float, y: float, width: float, height: float) -> None:
    box = np.array([x, y, min(x + width, SIZE[0]), min(y + height, SIZE[1])])
    assert read_back(box[None], np.array([class_])) == [(class_, pytest.approx(box.tolist(), abs=1e-4))]


def test_boxes_apart_and_of_two_classes_come_back() -> None:
    boxes = np.array([[2.0, 3.0, 20.5, 30.0], [30.25, 5.0, 44.0, 19.0], [8.0, 34.0, 60.0, 47.5]])
    assert read_back(boxes, np.array([0, 2, 0])) == [
        (0, [2.0, 3.0, 20.5, 30.0]),
        (0, [8.0, 34.0, 60.0, 47.5]),
        (2, [30.25, 5.0, 44.0, 19.0]),
    ]


def test_no_box_gives_cold_planes_and_nothing_back() -> None:
    targets = encode(np.zeros((0, 4)), np.zeros(0, dtype=np.int64), count=2, size=SIZE)
    assert targets.heat.shape == (2, SIZE[1] // STRIDE, SIZE[0] // STRIDE)
    assert not targets.heat.any()
    assert not targets.weights.any()
    assert len(decode(targets.heat, targets.sides, least=0.01).boxes) == 0


def test_sides_count_only_in_cells_within_the_box_and_the_smaller_box_has_them() -> None:
    outer, inner = [0.0, 0.0, 64.0, 48.0], [30.0, 22.0, 35.0, 27.0]
    targets = encode(np.array([inner, outer]), np.array([1, 0]), count=2, size=SIZE)
    row, column = 24 // STRIDE, 32 // STRIDE
    x, y = (column + 0.5) * STRIDE, (row + 0.5) * STRIDE
    assert targets.sides[:, row, column].tolist() == [x - 30.0, y - 22.0, 35.0 - x, 27.0 - y]
    assert targets.weights[row, column] == 1
    assert (targets.weights > 0).sum() == 9  # the outer box's neighbours of its middle, which is the inner one's
    assert targets.sides[:, row - 1, column].tolist() == [x, y - STRIDE, 64.0 - x, 48.0 - y + STRIDE]


def test_a_fainter_twin_of_one_class_is_dropped_and_another_class_is_not() -> None:
    heat = np.zeros((2, 12, 16))
    heat[0, 5, 5], heat[0, 5, 7], heat[1, 5, 7] = 0.9, 0.5, 0.6
    sides = np.full((4, 12, 16), 12.0)
    found = decode(heat, sides, least=0.1)
    assert found.scores.tolist() == [0.9, 0.6]
    assert found.classes.tolist() == [0, 1]
    assert found.boxes[0].tolist() == [10.0, 10.0, 34.0, 34.0]


def test_overlaps_by_hand() -> None:
    others = np.array([[0.0, 0.0, 2.0, 2.0], [1.0, 0.0, 3.0, 2.0], [5.0, 5.0, 6.0, 6.0]])
    assert overlaps(others[0], others) == pytest.approx([1.0, 1 / 3, 0.0])
