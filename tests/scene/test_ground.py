"""The ground's grid."""

import numpy as np
import pytest

from ars_web.scene.ground import grid_cell, grid_lines


@pytest.mark.parametrize(("radius", "cell"), [(0.07, 0.01), (0.7, 0.1), (0.71, 0.2), (1.0, 0.2), (3.0, 0.5), (100, 20)])
def test_cells_are_round_lengths(radius: float, cell: float) -> None:
    assert grid_cell(radius) == pytest.approx(cell)


@pytest.mark.parametrize("radius", np.geomspace(1e-3, 1e4, 57).tolist())
def test_about_twenty_cells_go_across(radius: float) -> None:
    across = 2 * 1.6 * radius / grid_cell(radius)
    assert 8 < across <= 23


def test_lines_run_both_ways() -> None:
    lines = grid_lines(np.array([-1.0, 0.0, 2.0]), half=3.0)
    assert lines.shape == (6, 2, 3)
    np.testing.assert_array_equal(lines[2], [[2, -3, 0], [2, 3, 0]])
    np.testing.assert_array_equal(lines[5], [[-3, 2, 0], [3, 2, 0]])
    assert not lines[..., 2].any()
