"""The largest regions without a view, on histograms drawn by hand."""

import itertools
import math

import numpy as np
import pytest

from ars_web.datasets.coverage import Coverage
from ars_web.geometry.sphere_bins import SphereBins
from ars_web.studies.view_holes import biggest_hole, holes_of, unseen_azimuths

BINS = SphereBins(12, 6)
"""Of 30 x 30 degrees."""


def seen(places: list[tuple[int, int]], *, reachable: np.ndarray | None = None, bins: SphereBins = BINS) -> Coverage:
    """A view in each of these bins."""
    counts = np.zeros((bins.azimuth, bins.polar), dtype=np.int64)
    for place in places:
        counts[place] += 1
    there = np.ones(counts.shape, dtype=bool) if reachable is None else reachable
    cells = np.zeros(bins.cells, dtype=np.int64)
    return Coverage(bins, counts, there, cells, np.ones(bins.cells, dtype=bool), len(places), len(places))


def everywhere_but(azimuths: range, polars: range) -> list[tuple[int, int]]:
    free = {(a % 12, p) for a in azimuths for p in polars}
    return [(a, p) for a in range(12) for p in range(6) if (a, p) not in free]


@pytest.mark.parametrize(
    ("azimuths", "polars", "words"),
    [
        (range(9, 12), range(1, 2), "none from azimuth 90 to 180 degrees at 30 to 60 degrees from +z"),
        (range(11, 14), range(1, 3), "none from azimuth 150 over 180 to -120 degrees at 30 to 90 degrees from +z"),
        (range(12), range(3, 6), "none at 90 to 180 degrees from +z, at any azimuth"),
        (range(2, 8), range(6), "none from azimuth -120 to 60 degrees, at any height"),
        (range(12), range(6), "none at all"),
    ],
)
def test_a_hole_is_found_and_said(azimuths: range, polars: range, words: str) -> None:
    coverage = seen(everywhere_but(azimuths, polars))
    hole = biggest_hole(coverage)
    assert hole is not None
    assert hole.words == words
    z = np.cos(np.radians(hole.polar))
    assert hole.share == pytest.approx(len(azimuths) / 12 * (z[0] - z[1]) / 2)
    assert unseen_azimuths(coverage) == (30.0 * len(azimuths) if polars == range(6) else 0.0)


def test_nothing_is_missing_where_every_bin_has_a_view() -> None:
    assert biggest_hole(seen(everywhere_but(range(0), range(0)))) is None
    assert holes_of(seen(everywhere_but(range(0), range(0)))) == ()


def test_above_and_below_have_holes_of_their_own() -> None:
    coverage = seen([(a, 1) for a in range(12)])
    assert [hole.words for hole in holes_of(coverage)] == [
        "none at 60 to 90 degrees from +z, at any azimuth",
        "none at 90 to 180 degrees from +z, at any azimuth",
    ]


def test_what_symmetry_folds_elsewhere_is_no_hole() -> None:
    reachable = np.zeros((12, 6), dtype=bool)
    reachable[6:9] = True  # a quarter turn changes nothing: azimuths from 0 to 90 stand for all
    coverage = seen([(6, p) for p in range(6)] + [(8, p) for p in range(3)], reachable=reachable)
    hole = biggest_hole(coverage)
    assert hole is not None
    assert hole.words == "none from azimuth 30 to 90 degrees at 90 to 180 degrees from +z"
    assert hole.share == pytest.approx(2 / 3 / 2)
    assert unseen_azimuths(coverage) == 30.0
    assert unseen_azimuths(seen([(6, 2)], reachable=reachable)) == 60.0
    turned = np.zeros((12, 6), dtype=bool)
    turned[6] = True  # any turn about z
    below = biggest_hole(seen([(6, p) for p in range(4)], reachable=turned))
    assert below is not None
    assert below.words == "none at 120 to 180 degrees from +z, at any azimuth"


def slow_share(coverage: Coverage) -> float:
    """The largest region without a view among all there are, as a share, by looking at every one."""
    bins = coverage.bins
    z = np.cos(bins.polar_edges)
    area = {
        (a, p): (z[p] - z[p + 1]) if coverage.reachable[a, p] else 0.0
        for a in range(bins.azimuth)
        for p in range(bins.polar)
    }
    best = 0.0
    for start, length, low in itertools.product(range(bins.azimuth), range(1, bins.azimuth + 1), range(bins.polar)):
        for high in range(low + 1, bins.polar + 1):
            region = [((start + i) % bins.azimuth, p) for i in range(length) for p in range(low, high)]
            if not any(coverage.counts[place] for place in region):
                best = max(best, sum(area[place] for place in region))
    return best / sum(area.values())


@pytest.mark.parametrize("seed", range(6))
def test_no_region_is_larger(seed: int) -> None:
    random, bins = np.random.default_rng(seed), SphereBins(8, 4)
    reachable = np.ones((8, 4), dtype=bool) if seed % 2 else np.repeat(np.arange(8) < 5, 4).reshape(8, 4)
    places = [(int(a), int(p)) for a, p in zip(random.integers(0, 5, 6), random.integers(0, 4, 6), strict=True)]
    coverage = seen(places, reachable=reachable, bins=bins)
    hole = biggest_hole(coverage)
    assert hole is not None
    assert math.isclose(hole.share, slow_share(coverage))


def test_of_holes_of_one_area_the_first_is_told_however_areas_are_rounded() -> None:
    """Two runs of one azimuth each, all heights: their bins' areas add up to the same but for rounding."""
    coverage = seen([(a, p) for a in range(12) if a not in (3, 8) for p in range(6)])
    hole = biggest_hole(coverage)
    assert hole is not None
    assert hole.azimuth == (-90.0, -60.0)
