"""The figures of a report as the numbers of vector drawings: small ones, many of them, that follow the page's colours.

All are in pixels of their drawing, x to the right and y down; the templates draw them.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from ars_web.datasets.coverage import Coverage
from ars_web.datasets.splits import SPLITS
from ars_web.studies.report_facts import LARGE_PX, SMALL_PX, Histogram, SizeFacts
from ars_web.studies.split_neighbours import TWIN_MOVE, TWIN_TURN, Neighbours
from ars_web.studies.view_holes import Hole

LEVELS = 6
"""Shades of a map, from few views to the most, by the logarithm of their number."""

COLUMNS = 240
"""Of a recording's course: as many as can be told apart."""

_PALEST = 0.22


@dataclass(frozen=True)
class Shade:
    """Cells of a map that look alike: how opaque they are, and their outlines as a path."""

    opacity: float
    path: str


@dataclass(frozen=True)
class Place:
    """A rectangle."""

    x: float
    y: float
    width: float
    height: float


@dataclass(frozen=True)
class ViewMap:
    """A map of directions, 360 x 180: azimuth from -180 on the left, the box's +z at the top; a unit is a degree.

    Attributes:
        shades: of the bins with views.
        beyond: path of the bins that symmetry folds elsewhere.
        holes: to be outlined; one that goes round 180 comes in two.
        most: views in the fullest bin.
    """

    shades: tuple[Shade, ...]
    beyond: str
    holes: tuple[Place, ...]
    most: int


@dataclass(frozen=True)
class Bar:
    """One bar of a histogram: its place, a name for its colour, and what it says."""

    place: Place
    kind: str
    says: str


@dataclass(frozen=True)
class Tick:
    """A mark of an axis."""

    at: float
    says: str


@dataclass(frozen=True)
class Bars:
    """A histogram, `width` x `height`, its axis along the bottom edge."""

    width: float
    height: float
    bars: tuple[Bar, ...]
    ticks: tuple[Tick, ...]


@dataclass(frozen=True)
class Course:
    """The frames from the first to the last, `COLUMNS` x 1 or fewer columns: which split, and how many labels.

    Attributes:
        runs: split, first column and columns of each run.
        labels: path of steps, 1 high at most and standing on y = 1: the mean number of labels in a column's frames.
        most: labels in the fullest column.
    """

    width: int
    runs: tuple[tuple[str, float, float], ...]
    labels: str
    most: float


@dataclass(frozen=True)
class Dots:
    """Nearest frames across a split: how far the camera moved, and how much it turned; logarithmic, `width` x `height`.

    Attributes:
        path: of all dots, drawn with round ends.
        twins: where twins are.
    """

    width: float
    height: float
    path: str
    twins: Place
    across: tuple[Tick, ...]
    up: tuple[Tick, ...]


def view_map(coverage: Coverage, holes: Iterable[Hole]) -> ViewMap:
    """The histogram of equal angles as a map."""
    counts, bins = coverage.counts, coverage.bins
    most = max(1, int(counts.max()))
    levels = np.ceil(LEVELS * np.log1p(counts) / math.log1p(most)).astype(np.int64)
    wide, high = 360.0 / bins.azimuth, 180.0 / bins.polar
    shades = tuple(
        Shade(round(_PALEST + (1.0 - _PALEST) * (level - 1) / (LEVELS - 1), 3), _cells(levels == level, wide, high))
        for level in range(1, LEVELS + 1)
        if (levels == level).any()
    )
    places = tuple(place for hole in holes for place in _hole(hole))
    return ViewMap(shades, _cells(~coverage.reachable, wide, high), places, most)


def size_bars(sizes: SizeFacts, *, width: float = 240.0, height: float = 96.0) -> Bars:
    """Labels by size, as far up as there are any; the bars of small, medium and large ones have their own colours."""
    edges, counts = sizes.histogram.edges, sizes.histogram.counts
    used = [place for place, count in enumerate(counts) if count]
    first, last = min(used[0], edges.index(SMALL_PX) - 1), max(used[-1], edges.index(LARGE_PX))

    def kind(edge: float) -> str:
        return "small" if edge < SMALL_PX else "medium" if edge < LARGE_PX else "large"

    shown = range(first, last + 1)
    says = [f"{counts[i]} labels of {edges[i]:g} to {edges[i + 1]:g} px" for i in shown]
    bars = _bars([counts[i] for i in shown], [kind(edges[i]) for i in shown], says, width, height)
    step = width / len(shown)
    named = (SMALL_PX, LARGE_PX, edges[first], edges[last + 1] if last + 2 < len(edges) else edges[last])
    ticks = tuple(Tick(round((edges.index(edge) - first) * step, 2), f"{edge:g}") for edge in sorted(set(named)))
    return Bars(width, height, bars, ticks)


def share_bars(histogram: Histogram, *, what: str, width: float = 180.0, height: float = 96.0) -> Bars:
    """Labels by a share from 0 to 1, whose tenths the histogram counts."""
    edges = histogram.edges
    says = [
        f"{count} labels {100 * low:.0f} to {100 * high:.0f} % {what}"
        for count, low, high in zip(histogram.counts, edges[:-1], edges[1:], strict=True)
    ]
    bars = _bars(histogram.counts, ["share"] * len(says), says, width, height)
    return Bars(width, height, bars, tuple(Tick(width * at / 100.0, f"{at} %") for at in (0, 50, 100)))


def course(split: Int[np.ndarray, "n"], labels: Int[np.ndarray, "n"]) -> Course:
    """How a recording goes: the split and the number of labels of each frame, in their order."""
    n = len(split)
    width = min(n, COLUMNS)
    edges = np.flatnonzero(np.diff(split)) + 1
    starts, ends = [0, *edges.tolist()], [*edges.tolist(), n]
    runs = tuple(
        (SPLITS[split[first]], round(first * width / n, 3), round((last - first) * width / n, 3))
        for first, last in zip(starts, ends, strict=True)
    )
    borders = np.arange(width + 1) * n // width
    means = np.add.reduceat(labels, borders[:-1]) / np.diff(borders)
    most = float(means.max())
    steps = "".join(f"V{_short(1.0 - mean / max(most, 1e-9))}h1" for mean in means.tolist())
    return Course(width, runs, f"M0 1{steps}V1z", most)


def neighbour_dots(near: Neighbours, *, width: float = 420.0, height: float = 200.0) -> Dots:
    """Where the nearest frames that train are: the share moved from 0.1 to 1000 percent, the turn from 0.1 to 180
    degrees; what is less or more lies on the border."""

    def x(move: Float[np.ndarray, "k"]) -> Float[np.ndarray, "k"]:
        return width * np.clip((np.log10(np.maximum(100.0 * move, 1e-6)) + 1.0) / 4.0, 0.0, 1.0)

    def y(turn: Float[np.ndarray, "k"]) -> Float[np.ndarray, "k"]:
        most = math.log10(180.0) + 1.0
        return height * (1.0 - np.clip((np.log10(np.maximum(np.degrees(turn), 1e-6)) + 1.0) / most, 0.0, 1.0))

    dots = zip(x(near.move).round(1).tolist(), y(near.turn).round(1).tolist(), strict=True)
    edge_x, edge_y = float(x(np.array([TWIN_MOVE]))[0]), float(y(np.array([TWIN_TURN]))[0])
    moves, turns = [0.1, 1.0, 5.0, 100.0, 1000.0], [0.1, 1.0, 5.0, 180.0]
    return Dots(
        width=width,
        height=height,
        path="".join(f"M{_short(at)} {_short(up)}h0" for at, up in sorted(set(dots))),
        twins=Place(0.0, round(edge_y, 2), round(edge_x, 2), round(height - edge_y, 2)),
        across=tuple(Tick(round(float(x(np.array([at / 100.0]))[0]), 2), f"{at:g} %") for at in moves),
        up=tuple(Tick(round(float(y(np.radians([at]))[0]), 2), f"{at:g}°") for at in turns),
    )


def _bars(
    counts: Sequence[int], kinds: Sequence[str], says: Sequence[str], width: float, height: float
) -> tuple[Bar, ...]:
    step, most = width / len(counts), max(1, *counts)
    found: list[Bar] = []
    for place, (count, kind, text) in enumerate(zip(counts, kinds, says, strict=True)):
        # One label among thousands is still seen.
        high = max(1.0, height * count / most) if count else 0.0
        where = Place(round(place * step + 0.75, 2), round(height - high, 2), round(step - 1.5, 2), round(high, 2))
        found.append(Bar(where, kind, text))
    return tuple(found)


def _cells(chosen: np.ndarray, wide: float, high: float) -> str:
    """A path round the bins (a, p) that are chosen, runs of neighbours in one piece."""
    pieces: list[str] = []
    for polar, row in enumerate(chosen.T):
        edges = np.flatnonzero(np.diff(np.concatenate([[False], row, [False]]).astype(np.int8)))
        for first, last in edges.reshape(-1, 2).tolist():
            length = _short((last - first) * wide)
            pieces.append(f"M{_short(first * wide)} {_short(polar * high)}h{length}v{_short(high)}h-{length}z")
    return "".join(pieces)


def _hole(hole: Hole) -> list[Place]:
    low, high = hole.polar
    start, end = hole.azimuth[0] + 180.0, hole.azimuth[1] + 180.0
    if end <= start:
        pieces = [(start, 360.0), (0.0, end)]
    else:
        pieces = [(start, end)]
    # A little within its bins, so that two beside one another do not become one.
    return [
        Place(left + 1.0, low + 1.0, right - left - 2.0, high - low - 2.0) for left, right in pieces if right > left
    ]


def _short(value: float) -> str:
    return f"{value:.2f}".rstrip("0").rstrip(".")
