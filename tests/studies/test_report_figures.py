"""The numbers of a report's drawings, worked by hand."""

import math
import re

import numpy as np
import pytest

from ars_web.datasets.coverage import Coverage
from ars_web.geometry.sphere_bins import SphereBins
from ars_web.studies.report_facts import Histogram, SizeFacts
from ars_web.studies.report_figures import LEVELS, Bar, course, neighbour_dots, share_bars, size_bars, view_map
from ars_web.studies.session_report import SIZE_EDGES
from ars_web.studies.split_neighbours import TWIN_MOVE, TWIN_TURN, Neighbours
from ars_web.studies.view_holes import Hole

BINS = SphereBins(12, 6)


def coverage(counts: np.ndarray, *, reachable: np.ndarray | None = None) -> Coverage:
    there = np.ones(counts.shape, dtype=bool) if reachable is None else reachable
    cells = np.zeros(BINS.cells, dtype=np.int64)
    return Coverage(BINS, counts, there, cells, np.ones(BINS.cells, dtype=bool), 9, int(counts.sum()))


def pieces(path: str) -> list[tuple[float, ...]]:
    """x, y, width and height of each rectangle of a path."""
    found = re.findall(r"M([\d.]+) ([\d.]+)h([\d.]+)v([\d.]+)h-([\d.]+)z", path)
    assert "".join(f"M{x} {y}h{w}v{h}h-{b}z" for x, y, w, h, b in found) == path
    assert all(width == back for *_, width, _, back in found)
    return [tuple(map(float, one[:4])) for one in found]


def sizes(counts: dict[float, int]) -> SizeFacts:
    """`counts` by the lower edge of a bar."""
    of_bars = [counts.get(edge, 0) for edge in SIZE_EDGES[:-1]]
    histogram = Histogram(edges=list(SIZE_EDGES), counts=of_bars)
    return SizeFacts(median_px=1, tiny=0, small=0, medium=0, large=0, histogram=histogram)


def kinds(bars: tuple[Bar, ...]) -> list[tuple[str, str]]:
    return [(bar.says, bar.kind) for bar in bars if bar.place.height]


def test_a_map_has_the_bins_where_they_are_the_fuller_the_darker() -> None:
    counts = np.zeros((12, 6), dtype=np.int64)
    counts[3, 1], counts[4, 1], counts[11, 5] = 1, 1, 1000
    reachable = np.ones((12, 6), dtype=bool)
    reachable[:, 0] = False
    found = view_map(coverage(counts, reachable=reachable), [])
    assert found.most == 1000
    few, many = found.shades
    # Bins of 30 x 30 degrees; neighbours are one piece.
    assert pieces(few.path) == [(90, 30, 60, 30)]
    assert pieces(many.path) == [(330, 150, 30, 30)]
    assert few.opacity == pytest.approx(0.22)
    assert many.opacity == 1.0
    assert pieces(found.beyond) == [(0, 0, 360, 30)]
    assert len(view_map(coverage(2 ** np.arange(72).reshape(12, 6) % 1000), []).shades) == LEVELS
    nothing = view_map(coverage(np.zeros((12, 6), dtype=np.int64)), [])
    assert (nothing.shades, nothing.most, nothing.beyond) == ((), 1, "")


def test_a_hole_that_goes_round_comes_in_two_pieces() -> None:
    def outlined(azimuth: tuple[float, float]) -> list[tuple[float, ...]]:
        hole = Hole(azimuth=azimuth, polar=(30.0, 90.0), all_round=False, share=0.1)
        places = view_map(coverage(np.zeros((12, 6), dtype=np.int64)), [hole]).holes
        return [(one.x, one.y, one.width, one.height) for one in places]

    assert outlined((-90.0, 60.0)) == [(91, 31, 148, 58)]
    assert outlined((150.0, -120.0)) == [(331, 31, 28, 58), (1, 31, 58, 58)]
    assert outlined((150.0, 180.0)) == [(331, 31, 28, 58)]
    # All the way round from where it begins, be it in the middle.
    assert outlined((60.0, 60.0)) == [(241, 31, 118, 58), (1, 31, 238, 58)]
    assert outlined((-180.0, -180.0)) == [(1, 31, 358, 58)]


def test_sizes_have_bars_as_far_as_there_are_labels_and_both_limits() -> None:
    found = size_bars(sizes({48: 10, 96: 5}))
    assert kinds(found.bars) == [("10 labels of 48 to 64 px", "medium"), ("5 labels of 96 to 128 px", "large")]
    # From the bar below 32 up to the one above 96: five of them.
    assert [tick.says for tick in found.ticks] == ["24", "32", "96", "128"]
    assert [tick.at for tick in found.ticks] == [0.0, 48.0, 192.0, 240.0]
    wide = size_bars(sizes({0: 1, 1024: 1}))
    assert kinds(wide.bars) == [("1 labels of 0 to 4 px", "small"), ("1 labels of 1024 to 65536 px", "large")]
    # The last bar has no end that says anything.
    assert [tick.says for tick in wide.ticks] == ["0", "32", "96", "1024"]


def test_one_label_among_thousands_is_seen_and_none_is_not() -> None:
    edges = [i / 10 for i in range(11)]
    found = share_bars(Histogram(edges=edges, counts=[10_000, 1, *[0] * 8]), what="visible")
    heights = [bar.place.height for bar in found.bars]
    assert heights == [96.0, 1.0, *[0.0] * 8]
    assert all(bar.place.y + bar.place.height == 96.0 for bar in found.bars)
    assert found.bars[1].says == "1 labels 10 to 20 % visible"
    assert [bar.place.x for bar in found.bars] == [0.75 + 18 * i for i in range(10)]
    assert [(tick.at, tick.says) for tick in found.ticks] == [(0.0, "0 %"), (90.0, "50 %"), (180.0, "100 %")]


def test_a_course_has_each_run_of_a_split_and_the_mean_of_labels() -> None:
    found = course(np.array([0, 0, 0, 1, 0, 2]), np.array([0, 1, 2, 4, 0, 0]))
    assert found.runs == (("train", 0, 3), ("val", 3, 1), ("train", 4, 1), ("test", 5, 1))
    assert (found.width, found.most) == (6, 4.0)
    assert found.labels == "M0 1V1h1V0.75h1V0.5h1V0h1V1h1V1h1V1z"
    long = course(np.zeros(480, dtype=np.int64), np.repeat([0, 3], 240))
    assert (long.width, long.runs, long.most) == (240, (("train", 0, 240),), 3.0)
    assert long.labels.count("h1") == 240
    one = course(np.array([1]), np.array([0]))
    assert (one.width, one.runs, one.most, one.labels) == (1, (("val", 0, 1),), 0.0, "M0 1V1h1V1z")


def test_neighbours_are_dots_by_the_logarithm_of_what_moved_and_turned() -> None:
    near = Neighbours(
        rows=np.arange(5),
        nearest=np.zeros(5, dtype=np.int64),
        move=np.array([0.0, 0.001, 1.0, 99.0, 1.0]),
        turn=np.radians([0.0, 0.1, 180.0, 180.0, 180.0]),
    )
    found = neighbour_dots(near, width=400.0, height=100.0)
    # From 0.1 to 1000 percent are four tens of 100 each; what is the same is one dot.
    dots = sorted(tuple(map(float, one)) for one in re.findall(r"M([\d.]+) ([\d.]+)h0", found.path))
    assert dots == [(0.0, 100.0), (300.0, 0.0), (400.0, 0.0)]
    edge_x = 100.0 * (math.log10(100 * TWIN_MOVE) + 1)
    edge_y = 100.0 * (1 - (math.log10(math.degrees(TWIN_TURN)) + 1) / (math.log10(180) + 1))
    assert (found.twins.x, found.twins.width) == (0.0, pytest.approx(edge_x, abs=0.01))
    assert (found.twins.y, found.twins.height) == (
        pytest.approx(edge_y, abs=0.01),
        pytest.approx(100.0 - edge_y, abs=0.01),
    )
    assert [(tick.says, tick.at) for tick in found.across][::4] == [("0.1 %", 0.0), ("1000 %", 400.0)]
    assert [tick.at for tick in found.up][::3] == [100.0, 0.0]
