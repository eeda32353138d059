"""Directions in cells, and those that an object looks the same from."""

import numpy as np
import pytest

from ars_web.geometry.cell_samples import TURNS, alike, cell_samples
from ars_web.geometry.sphere_bins import SphereBins
from ars_web.geometry.symmetry import NO_SYMMETRY, Symmetry, rotations_of
from ars_web.geometry.view_directions import evenly_over_sphere, folded, reachable

CUBE = Symmetry("discrete", (((0.0, 0.0, 1.0), 4), ((1.0, 0.0, 0.0), 4)))
QUARTER = Symmetry("discrete", (((0.0, 0.0, 1.0), 4),))
BOTTLE = Symmetry("continuous", axis=(0.0, 0.0, 1.0))
LYING = Symmetry("continuous", axis=(0.6, 0.8, 0.0), flip=True)

ALL = (NO_SYMMETRY, CUBE, QUARTER, BOTTLE, LYING)


@pytest.mark.parametrize("symmetry", ALL)
@pytest.mark.parametrize("bins", [SphereBins(), SphereBins(6, 3), SphereBins(1, 1)])
def test_samples_lie_in_their_cells_and_are_folded(bins: SphereBins, symmetry: Symmetry) -> None:
    samples = cell_samples(bins, symmetry)
    _, cells = reachable(bins, symmetry)
    assert (np.isfinite(samples).all(axis=(1, 2)) == cells).all()
    found = samples[cells]
    assert np.linalg.norm(found, axis=-1) == pytest.approx(1.0)
    flat = found.reshape(-1, 3)
    _, held = bins.of(flat)
    assert (held.reshape(found.shape[:2]) == np.flatnonzero(cells)[:, None]).all()
    assert folded(flat, symmetry) == pytest.approx(flat, abs=1e-6)


@pytest.mark.parametrize("bins", [SphereBins(), SphereBins(1, 3)])
def test_the_first_sample_is_in_the_middle(bins: SphereBins) -> None:
    aside = np.linalg.norm(cell_samples(bins, NO_SYMMETRY)[:, 0] - bins.cell_directions, axis=1)
    assert aside.max() < 0.02


@pytest.mark.parametrize("symmetry", [NO_SYMMETRY, QUARTER])
def test_samples_go_outward_and_stay_off_the_cell_s_border(symmetry: Symmetry) -> None:
    bins = SphereBins(12, 6)
    _, cells = reachable(bins, symmetry)
    directions = folded(evenly_over_sphere(20_000), symmetry)
    _, held = bins.of(directions)
    for cell in np.flatnonzero(cells).tolist():
        samples = cell_samples(bins, symmetry)[cell]
        middle = bins.cell_directions[cell] if symmetry == NO_SYMMETRY else directions[held == cell].mean(axis=0)
        aside = np.linalg.norm(samples - middle, axis=1)
        assert (np.diff(aside) > -0.01).all()
        inside = np.linalg.norm(directions[held == cell] - middle, axis=1)
        assert 0.55 < (inside < aside[-1]).mean() < 0.75


@pytest.mark.parametrize("symmetry", ALL)
def test_directions_that_are_alike_are_folded_to_one(symmetry: Symmetry) -> None:
    directions = evenly_over_sphere(500)[3::50]
    found = alike(directions, symmetry)
    assert found.shape[1] == len(rotations_of(symmetry)) * (TURNS if symmetry.axis is not None else 1)
    assert found[:, 0] == pytest.approx(directions, abs=1e-12)
    one_for_all = np.repeat(folded(directions, symmetry)[:, None], found.shape[1], axis=1)
    assert folded(found.reshape(-1, 3), symmetry) == pytest.approx(one_for_all.reshape(-1, 3), abs=1e-6)
