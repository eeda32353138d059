"""The picture of a coverage: the paper's histogram as a map of the sphere, empty directions marked."""

from typing import TYPE_CHECKING

import numpy as np

from ars_web.datasets.coverage import Coverage
from ars_web.reporting.plot import new_figure, png

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap

BEYOND = "#e4e9ee"
"""Of directions that the symmetry folds elsewhere."""

HOLE = "#d55e00"
"""Of the dot in a bin without a view."""


def coverage_png(coverage: Coverage, *, title: str) -> bytes:
    """The histograms of equal angles and of equal area above one another, as PNG.

    White with a dot: no view; grey: directions that the symmetry folds elsewhere.
    """
    figure = new_figure(9.0, 9.6)
    above, below = figure.subplots(2, 1)
    bins = coverage.bins
    colours = _colours()
    angles = np.where(coverage.reachable, coverage.counts, np.nan)
    most = max(1, int(coverage.counts.max()))
    azimuth, polar = np.degrees(bins.azimuth_edges), np.degrees(bins.polar_edges)
    shown = above.pcolormesh(azimuth, polar, angles.T, cmap=colours, vmin=0, vmax=most)
    middles = (azimuth[:-1] + azimuth[1:]) / 2, (polar[:-1] + polar[1:]) / 2
    holes = np.argwhere(coverage.reachable & (coverage.counts == 0))
    above.plot(middles[0][holes[:, 0]], middles[1][holes[:, 1]], ".", color=HOLE, markersize=2.5)
    above.set_title(
        f"{title}\n{coverage.views} views in {coverage.frames} frames; {coverage.empty_fraction:.0%} of the"
        f" {bins.azimuth} x {bins.polar} bins are empty",
        fontsize=11,
        loc="left",
    )
    figure.colorbar(shown, ax=above, label="views in a bin", pad=0.01)

    # Cells are as wide as their band has them: one strip of the map for each.
    cells = np.where(coverage.cells_reachable, coverage.cell_counts, np.nan).astype(float)
    band_edges = np.degrees(np.arccos(np.clip(bins.band_edges, -1.0, 1.0)))
    most = max(1, int(coverage.cell_counts.max()))
    for band, count in enumerate(bins.bands.tolist()):
        first = int(bins.cell_starts[band])
        edges = np.linspace(-180.0, 180.0, count + 1)
        strip = cells[None, first : first + count]
        shown = below.pcolormesh(edges, band_edges[band : band + 2], strip, cmap=colours, vmin=0, vmax=most)
        holes = (edges[:-1] + np.diff(edges) / 2)[strip[0] == 0]
        below.plot(holes, np.full(len(holes), band_edges[band : band + 2].mean()), ".", color=HOLE, markersize=2.5)
    below.set_title(
        f"{bins.cells} cells of equal area; {coverage.empty_area:.0%} of all directions have no view",
        fontsize=11,
        loc="left",
    )
    figure.colorbar(shown, ax=below, label="views in a cell", pad=0.01)
    for axes in (above, below):
        _frame(axes)
    return png(figure)


def _colours() -> "Colormap":
    """From dark to light as views get more; white where there are none."""
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    seen = colormaps["viridis"](np.linspace(0.12, 1.0, 256))
    seen[0] = (1.0, 1.0, 1.0, 1.0)
    return ListedColormap(seen).with_extremes(bad=BEYOND)


def _frame(axes: "Axes") -> None:
    axes.set_xlim(-180.0, 180.0)
    axes.set_ylim(180.0, 0.0)
    axes.set_xticks(range(-180, 181, 45))
    axes.set_yticks(range(0, 181, 45))
    axes.set_xlabel("azimuth, degrees: 0 along the box's x, 90 along its y", fontsize=9)
    axes.set_ylabel("angle from the box's z, degrees", fontsize=9)
    axes.tick_params(labelsize=8)
