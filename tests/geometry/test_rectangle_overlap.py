"""Shares of area that rectangles have in common."""

import numpy as np

from ars_web.geometry.rectangle_overlap import pairwise_iou, row_iou


def test_overlaps_worked_by_hand() -> None:
    first = np.array([[0.0, 0.0, 10.0, 10.0], [20.0, 0.0, 30.0, 10.0]])
    second = np.array([[5.0, 0.0, 15.0, 10.0], [0.0, 0.0, 10.0, 10.0], [10.0, 0.0, 20.0, 10.0]])
    assert np.allclose(pairwise_iou(first, second), [[50 / 150, 1.0, 0.0], [0.0, 0.0, 0.0]])


def test_empty_rectangles_and_empty_lists_share_nothing() -> None:
    empty = np.array([[3.0, 3.0, 3.0, 3.0]])
    assert pairwise_iou(empty, empty).tolist() == [[0.0]]
    assert pairwise_iou(np.zeros((0, 4)), empty).shape == (0, 1)


def test_rows_are_held_against_rows() -> None:
    first = np.array([[0.0, 0.0, 10.0, 10.0], [20.0, 0.0, 30.0, 10.0], [0.0, 0.0, 1.0, 1.0], [3.0, 3.0, 3.0, 3.0]])
    second = np.array([[5.0, 0.0, 15.0, 10.0], [0.0, 0.0, 10.0, 10.0], [np.nan] * 4, [3.0, 3.0, 3.0, 3.0]])
    assert row_iou(first, second)[[0, 1, 3]].tolist() == [50 / 150, 0.0, 0.0]
    assert np.isnan(row_iou(first, second)[2])
    assert row_iou(np.zeros((0, 4)), np.zeros((0, 4))).shape == (0,)
