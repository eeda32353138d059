"""Plots of a comparison, as PNG."""

import numpy as np

from ars_web.reporting.plot import COLOURS, new_figure, plain_axes, png
from ars_web.studies.agreement import BINS
from ars_web.studies.automatic_labels import RECTANGLES, RectangleKind
from ars_web.studies.comparison import Comparison

NAMES: dict[RectangleKind, str] = {
    "in_image": "whole, in the image",
    "amodal": "whole, beyond the border",
    "visible": "what is seen",
}
"""What automatic rectangles are drawn round, for people."""


def iou_histogram(comparison: Comparison) -> bytes:
    """How many pairs have which IoU, by what automatic labels are drawn round, and where their means are."""
    figure = new_figure(5.6, 3.3)
    axes = figure.subplots()
    plain_axes(axes)
    edges = np.linspace(0, 1, BINS + 1)
    for kind, colour, style in zip(RECTANGLES, COLOURS, ("-", ":", "-"), strict=False):
        agreement = comparison.rectangles[kind]
        mean = agreement.total.mean_iou
        label = NAMES[kind] if mean is None else f"{NAMES[kind]} (mean {mean:.2f})"
        axes.stairs(agreement.histogram, edges, color=colour, linestyle=style, linewidth=1.8, label=label)
        if mean is not None and kind != "amodal":
            axes.axvline(mean, color=colour, linewidth=0.9, linestyle="--")
    axes.axvline(comparison.iou, color="#8b98a9", linewidth=0.9)
    axes.set_xlim(0, 1)
    axes.set_xlabel("IoU of a manual and an automatic label", fontsize=9, color="#1b232d")
    axes.set_ylabel("pairs", fontsize=9, color="#1b232d")
    axes.legend(fontsize=8, frameon=False, loc="upper left")
    return png(figure)


def iou_by_visibility(comparison: Comparison) -> bytes:
    """Mean IoU of pairs by how much nearer objects hide, with whole rectangles and with those round what is seen."""
    figure = new_figure(5.6, 3.3)
    axes = figure.subplots()
    plain_axes(axes)
    bands = comparison.bands
    places = np.arange(len(bands))
    for offset, kind, colour in ((-0.19, "in_image", COLOURS[0]), (0.19, "visible", COLOURS[2])):
        values = [band.in_image if kind == "in_image" else band.visible for band in bands]
        heights = [0.0 if value is None else value for value in values]
        bars = axes.bar(
            places + offset, heights, 0.36, color=colour, label=NAMES["in_image" if offset < 0 else "visible"]
        )
        axes.bar_label(bars, ["" if value is None else f"{value:.2f}" for value in values], fontsize=8, padding=2)
    axes.set_xticks(places, [f"{_share(band.lowest, band.highest)}\n{band.matched} pairs" for band in bands])
    axes.set_ylim(0, 1.12)
    axes.set_yticks(np.linspace(0, 1, 6))
    axes.set_xlabel("visible share of the object", fontsize=9, color="#1b232d")
    axes.set_ylabel("mean IoU", fontsize=9, color="#1b232d")
    # Above the axes: bars of 1.00 have their numbers where a legend within would be.
    axes.legend(fontsize=8, frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    return png(figure)


def _share(lowest: float, highest: float) -> str:
    return f"{lowest:.0%} to {highest:.0%}"
