"""Bins of the sphere: beside a readable oracle, and cells that have one area."""

import numpy as np
import pytest

from ars_web.errors import BadInput
from ars_web.geometry.sphere_bins import NOWHERE, SphereBins
from ars_web.geometry.view_directions import evenly_over_sphere


def oracle(direction: np.ndarray, bins: SphereBins) -> tuple[int, int]:
    """The same as SphereBins.of, of one direction, by looking through all edges."""
    x, y, z = direction / np.linalg.norm(direction)
    phi, theta = np.arctan2(y, x), np.arccos(np.clip(z, -1.0, 1.0))
    azimuth = max(i for i in range(bins.azimuth) if phi >= bins.azimuth_edges[i])
    polar = max(i for i in range(bins.polar) if theta >= bins.polar_edges[i])
    band = max(i for i in range(len(bins.bands)) if z <= bins.band_edges[i])
    width = 2 * np.pi / bins.bands[band]
    place = min(int((phi + np.pi) / width), bins.bands[band] - 1)
    return azimuth * bins.polar + polar, int(bins.cell_starts[band] + place)


@pytest.mark.parametrize(
    "bins", [SphereBins(), SphereBins(1, 1), SphereBins(1, 2), SphereBins(7, 5), SphereBins(360, 1)]
)
def test_bins_are_the_oracle_s(bins: SphereBins) -> None:
    directions = np.random.default_rng(3).normal(size=(500, 3))
    angles, cells = bins.of(directions)
    assert list(zip(angles.tolist(), cells.tolist(), strict=True)) == [oracle(one, bins) for one in directions]


@pytest.mark.parametrize("count", [(36, 18), (1, 3), (5, 4), (20, 20)])
def test_cells_have_one_area_and_hold_their_middles(count: tuple[int, int]) -> None:
    bins = SphereBins(*count)
    assert bins.bands.sum() == bins.cells
    assert (bins.bands > 0).all()
    hits = np.bincount(bins.of(evenly_over_sphere(400 * bins.cells))[1], minlength=bins.cells)
    assert np.abs(hits - 400).max() < 40
    assert bins.of(bins.cell_directions)[1].tolist() == list(range(bins.cells))
    assert np.allclose(np.linalg.norm(bins.cell_directions, axis=1), 1.0)


def test_cells_are_nearly_as_wide_as_high() -> None:
    bins = SphereBins()
    edges = np.arccos(bins.band_edges[1:-1])
    heights, middles = np.diff(edges), (edges[:-1] + edges[1:]) / 2
    widths = 2 * np.pi * np.sin(middles) / bins.bands[1:-1]
    assert 0.5 < (widths / heights).min()
    assert (widths / heights).max() < 2.0


def test_poles_and_axes_fall_where_they_should() -> None:
    bins = SphereBins()
    angles, cells = bins.of(np.array([[0.0, 0.0, 5.0], [0.0, 0.0, -2.0], [1.0, 0.0, 0.0], [-1.0, 1e-12, 0.0]]))
    assert cells.tolist()[:2] == [0, bins.cells - 1]
    assert (angles % bins.polar).tolist() == [0, 17, 9, 9]
    assert (angles // bins.polar).tolist()[2:] == [18, 35]


def test_on_an_edge_the_bin_after_it_begins() -> None:
    assert SphereBins(1, 2).of(np.array([[1.0, 0.0, 0.0], [1.0, 0.0, 1e-9]]))[1].tolist() == [1, 0]
    # Azimuth 0 begins the second of two, and pi is the end of the last.
    angles, cells = SphereBins(2, 1).of(np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]))
    assert angles.tolist() == [1, 1]
    bins = SphereBins()
    _, cells = bins.of(np.array([[-1.0, 0.0, 0.0], [-1.0, -1e-9, 0.0]]))
    band = int(np.searchsorted(-bins.band_edges, 0.0, side="right")) - 1
    assert cells.tolist() == [bins.cell_starts[band + 1] - 1, bins.cell_starts[band]]


def test_the_middle_of_a_cap_is_its_pole_and_of_a_cell_as_far_from_both_its_sides() -> None:
    bins = SphereBins()
    assert bins.cell_directions[[0, -1]].tolist() == pytest.approx(np.array([[0, 0, 1], [0, 0, -1]]), abs=1e-15)
    for band in range(1, len(bins.bands) - 1):
        first = bins.cell_directions[bins.cell_starts[band]]
        width = 2 * np.pi / bins.bands[band]
        assert np.arctan2(first[1], first[0]) == pytest.approx(-np.pi + width / 2)
        above, below = np.arccos(bins.band_edges[band : band + 2])
        assert np.arccos(first[2]) == pytest.approx((above + below) / 2)


def test_what_is_no_direction_has_no_bin() -> None:
    angles, cells = SphereBins().of(np.array([[0.0, 0.0, 0.0], [np.nan, 0.0, 1.0], [np.inf, 0.0, 0.0]]))
    assert angles.tolist() == cells.tolist() == [NOWHERE] * 3


@pytest.mark.parametrize("count", [(0, 18), (36, 0), (361, 18), (-1, 5)])
def test_numbers_of_bins_that_are_none_are_refused(count: tuple[int, int]) -> None:
    with pytest.raises(BadInput, match=r"bins must be from 1 to 360, not"):
        SphereBins(*count)
