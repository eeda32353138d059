"""An evaluation's plots: curves of precision over recall, classes side by side, sizes of what is missed."""

from typing import TYPE_CHECKING

import numpy as np

from ars_web.evaluation.mistakes import Sizes, sizes
from ars_web.evaluation.precision_recall import RECALLS
from ars_web.evaluation.scores import ClassScore, DetectorScore, Evaluation
from ars_web.evaluation.tables import shown
from ars_web.reporting.plot import COLOURS, new_figure, plain_axes, png

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_PANELS = 12
"""Classes that have a curve of their own: those with the most labels."""

MOST_BARS = 40
"""Classes that have a bar: those with the most labels."""

_FOUND, _MISSED = COLOURS[2], COLOURS[1]
_SMALL = 8
_LONGEST = 28


def curves(evaluation: Evaluation) -> bytes:
    """The mean curve of each detector, as PNG."""
    figure = new_figure(5.6, 4.4)
    axes = figure.add_subplot()
    for one, colour in _coloured(evaluation):
        label = f"{_short(one.name)}, mAP {shown(one.averages.at_iou)}"
        axes.plot(RECALLS, one.precision, color=colour, linewidth=2, label=label)
    _precision_over_recall(axes)
    axes.legend(loc="lower left", fontsize=_SMALL, framealpha=0.9)
    return png(figure)


def class_curves(evaluation: Evaluation) -> bytes:
    """The curves of the classes with the most labels, a panel a class, all detectors in it, as PNG."""
    places = _shown_classes(evaluation, MOST_PANELS)
    across = min(4, len(places))
    down = -(-len(places) // across)
    figure = new_figure(max(2.9 * across, 4.0), 2.5 * down + 0.4)
    for panel, place in enumerate(places):
        axes = figure.add_subplot(down, across, panel + 1)
        for one, colour in _coloured(evaluation):
            found = one.classes[place]
            if found.precision is not None:
                label = shown(found.averages.at_iou)
                axes.plot(RECALLS, found.precision, color=colour, linewidth=1.6, label=label)
        _precision_over_recall(axes)
        axes.set_title(_short(evaluation.truth.classes[place]), fontsize=9, parse_math=False)
        axes.legend(loc="lower left", fontsize=7, framealpha=0.9, title="AP", title_fontsize=7)
        if panel < len(places) - across:
            axes.set_xlabel("")
        if panel % across:
            axes.set_ylabel("")
    return png(figure)


def class_bars(evaluation: Evaluation) -> bytes:
    """The average precision of each class, detectors side by side, as PNG."""
    places = _shown_classes(evaluation, MOST_BARS)
    detectors = _coloured(evaluation)
    figure = new_figure(7.2, 1.1 + len(places) * (0.14 + 0.16 * len(detectors)))
    axes = figure.add_subplot()
    height = 0.8 / len(detectors)
    rows = np.arange(len(places))
    for i, (one, colour) in enumerate(detectors):
        values = [_value(one.classes[place]) for place in places]
        at = rows + (i - (len(detectors) - 1) / 2) * height
        axes.barh(at, values, height=height * 0.92, color=colour, label=_short(one.name))
        for y, value in zip(at, values, strict=True):
            axes.text(value + 0.008, y, f"{value:.2f}", va="center", fontsize=7, color="#56636f")
    plain_axes(axes)
    axes.grid(visible=False, axis="y")
    axes.set_yticks(rows, [_short(evaluation.truth.classes[place]) for place in places], fontsize=_SMALL)
    for label in axes.get_yticklabels():
        label.set_parse_math(False)
    axes.invert_yaxis()
    axes.set_xlim(0, 1.08)
    axes.set_xlabel(f"AP at IoU {evaluation.iou:g}", fontsize=_SMALL)
    if len(detectors) > 1:
        axes.legend(loc="lower right", fontsize=_SMALL, framealpha=0.9)
    return png(figure)


def missed_sizes(evaluation: Evaluation) -> bytes:
    """How many labels of each size were found and missed, a panel a detector, as PNG."""
    figure = new_figure(7.2, 0.4 + 2.5 * len(evaluation.detectors))
    for i, one in enumerate(evaluation.detectors):
        axes = figure.add_subplot(len(evaluation.detectors), 1, i + 1)
        _size_bars(axes, sizes(evaluation.truth, one))
        axes.set_title(_short(one.name), fontsize=9, parse_math=False)
        if i == len(evaluation.detectors) - 1:
            axes.set_xlabel("root of the label's area, pixels", fontsize=_SMALL)
    return png(figure)


def _size_bars(axes: "Axes", counted: Sizes) -> None:
    places = np.arange(len(counted.found))
    axes.bar(places, counted.found, width=0.9, color=_FOUND, label="found")
    axes.bar(places, counted.missed, width=0.9, bottom=counted.found, color=_MISSED, label="missed")
    total = counted.found + counted.missed
    for x, (found, both) in enumerate(zip(counted.found.tolist(), total.tolist(), strict=True)):
        if both:
            axes.text(x, both, f"{100 * found / both:.0f} %", ha="center", va="bottom", fontsize=7, color="#56636f")
    plain_axes(axes)
    axes.grid(visible=False, axis="x")
    axes.set_ylim(0, 1.15 * max(int(total.max()), 1))
    axes.set_xticks(np.arange(len(counted.edges)) - 0.5, [f"{edge:.0f}" for edge in counted.edges], fontsize=_SMALL)
    axes.set_ylabel("labels; found, %", fontsize=_SMALL)
    axes.legend(loc="upper right", fontsize=_SMALL, framealpha=0.9)


def _precision_over_recall(axes: "Axes") -> None:
    plain_axes(axes)
    axes.set_xlim(0, 1)
    axes.set_ylim(0, 1.02)
    axes.set_xlabel("recall", fontsize=_SMALL)
    axes.set_ylabel("precision", fontsize=_SMALL)


def _coloured(evaluation: Evaluation) -> list[tuple[DetectorScore, str]]:
    return [(one, COLOURS[i % len(COLOURS)]) for i, one in enumerate(evaluation.detectors)]


def _shown_classes(evaluation: Evaluation, most: int) -> list[int]:
    """Places of the classes with the most labels, in the truth's order; those without a label are left out."""
    labels = [one.labels for one in evaluation.detectors[0].classes]
    first = sorted(range(len(labels)), key=lambda place: -labels[place])[:most]
    return sorted(place for place in first if labels[place])


def _value(one: ClassScore) -> float:
    return one.averages.at_iou or 0.0


def _short(name: str) -> str:
    return name if len(name) <= _LONGEST else name[: _LONGEST - 1] + "…"
