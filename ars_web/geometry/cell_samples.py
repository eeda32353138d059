"""Directions within the cells of equal area, and all those that an object looks the same from."""

from functools import lru_cache

import numpy as np
from jaxtyping import Float

from ars_web.geometry.sphere_bins import SphereBins
from ars_web.geometry.symmetry import NO_SYMMETRY, Symmetry, rotations_of, turn_about
from ars_web.geometry.view_directions import DENSE, evenly_over_sphere, folded

SAMPLES = 2_600
"""Directions over all cells together: few in each of many cells, more in each of few, which are wide."""

FEWEST, MOST = 3, 64
"""Directions in one cell."""

INNER = 0.7
"""Share of a cell, from its middle, that directions are taken from: a camera is never exactly where it should be."""

TURNS = 36
"""That stand for all turns about the axis of a continuous symmetry."""


@lru_cache(maxsize=16)
def cell_samples(bins: SphereBins, symmetry: Symmetry) -> Float[np.ndarray, "k s 3"]:
    """s folded unit directions in each cell, the most central first; NaN in cells that none can lie in.

    A cell that the symmetry's border cuts has its middle in what is left of it.
    """
    count = int(np.clip(round(SAMPLES / bins.cells), FEWEST, MOST))
    directions = folded(evenly_over_sphere(DENSE), symmetry)
    _, cells = bins.of(directions)
    held = np.bincount(cells, minlength=bins.cells)
    sums = np.stack([np.bincount(cells, weights=column, minlength=bins.cells) for column in directions.T], axis=-1)
    middles = sums / np.maximum(held, 1)[:, None]
    if symmetry == NO_SYMMETRY:
        middles = bins.cell_directions
    aside = np.linalg.norm(directions - middles[cells], axis=1)
    order = np.lexsort((aside, cells))
    firsts = np.cumsum(held) - held
    places = firsts[:, None] + (INNER * held[:, None] * np.arange(count) / count).astype(np.int64)
    found = np.full((bins.cells, count, 3), np.nan)
    reached = held > 0
    found[reached] = directions[order[places[reached]]]
    found.flags.writeable = False
    return found


def alike(directions: Float[np.ndarray, "m 3"], symmetry: Symmetry) -> Float[np.ndarray, "m g 3"]:
    """All directions that an object looks the same from as from each one, itself first.

    Of a continuous symmetry TURNS stand for all.
    """
    rotations = rotations_of(symmetry)
    if symmetry.axis is not None:
        axis = np.array(symmetry.axis)
        turns = np.stack([turn_about(axis, 2.0 * np.pi * k / TURNS) for k in range(TURNS)])
        rotations = (rotations[:, None] @ turns[None]).reshape(-1, 3, 3)
    return np.einsum("gij,mj->mgi", rotations, directions)
