"""The sphere of directions in bins: equal angles as in the paper, and cells of equal area.

Directions are in polar coordinates: theta the angle from +z in [0, pi], phi the azimuth from +x in (-pi, pi]. Bins of
equal angles have areas that differ many times between equator and pole. The cells do not: the sphere is cut into
two caps and bands between them, each band into as many cells as its area holds, nearly as wide as high (Leopardi,
"A partition of the unit sphere into regions of equal area and small diameter", 2006).
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from ars_web.errors import BadInput
from ars_web.geometry import sphere_kernels
from ars_web.geometry.frame_blocks import over_blocks

MOST_BINS = 360
"""Along either angle: a degree and half a degree wide. Finer ones would be empty nearly everywhere."""

NOWHERE = -1
"""The bin of a direction that is none."""

BLOCK = 65_536
"""Directions that a thread takes at once."""


@dataclass(frozen=True)
class SphereBins:
    """Bins of directions: `azimuth` x `polar` of equal angles, and as many cells of equal area."""

    azimuth: int = 36
    polar: int = 18

    def __post_init__(self) -> None:
        """Raises BadInput for numbers of bins that are none, or too many."""
        for name, count in (("azimuth", self.azimuth), ("polar", self.polar)):
            if not 1 <= count <= MOST_BINS:
                raise BadInput(f"the number of {name} bins must be from 1 to {MOST_BINS}, not {count}")

    @cached_property
    def azimuth_edges(self) -> Float[np.ndarray, "edges"]:
        """(azimuth + 1,) radians, from -pi to pi."""
        return np.linspace(-np.pi, np.pi, self.azimuth + 1)

    @cached_property
    def polar_edges(self) -> Float[np.ndarray, "edges"]:
        """(polar + 1,) radians, from 0 at +z to pi."""
        return np.linspace(0.0, np.pi, self.polar + 1)

    @property
    def cells(self) -> int:
        """How many cells of equal area there are."""
        return self.azimuth * self.polar

    @cached_property
    def bands(self) -> Int[np.ndarray, "m"]:
        """Cells of each band from +z downward, the caps included."""
        count = self.cells
        if count < 3:
            return np.ones(count, dtype=np.int64)
        cap = 2.0 * math.asin(math.sqrt(1.0 / count))
        wanted = max(1, round((math.pi - 2.0 * cap) / math.sqrt(4.0 * math.pi / count)))
        # From how many cells lie above each edge, were the bands equally high: rounded, they add up by themselves.
        edges = np.linspace(cap, math.pi - cap, wanted + 1)
        above = np.round(count * (1.0 - np.cos(edges)) / 2.0).astype(np.int64)
        return np.array([1, *np.diff(above).tolist(), 1])

    @cached_property
    def cell_starts(self) -> Int[np.ndarray, "edges"]:
        """(m + 1,) the first cell of each band, and after the last how many there are."""
        return np.concatenate([[0], np.cumsum(self.bands)])

    @cached_property
    def band_edges(self) -> Float[np.ndarray, "edges"]:
        """(m + 1,) z of the bands' edges, from 1 down to -1: what lies between two has the area of its cells."""
        return 1.0 - 2.0 * self.cell_starts / self.cells

    @cached_property
    def cell_directions(self) -> Float[np.ndarray, "k 3"]:
        """The middle of each cell, of unit length; of a cap its pole."""
        polar = np.arccos(np.clip(self.band_edges, -1.0, 1.0))
        middles = (polar[:-1] + polar[1:]) / 2.0
        if self.cells > 1:
            middles[0], middles[-1] = 0.0, np.pi
        band = np.repeat(np.arange(len(self.bands)), self.bands)
        place = np.arange(self.cells) - self.cell_starts[band]
        phi = -np.pi + (place + 0.5) * 2.0 * np.pi / self.bands[band]
        theta = middles[band]
        return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)

    def of(self, directions: Float[np.ndarray, "n 3"]) -> tuple[Int[np.ndarray, "n"], Int[np.ndarray, "n"]]:
        """The bin of equal angles, azimuth * polar bins + polar, and the cell of each direction, of any length > 0.

        NOWHERE for a direction that is zero or not finite. A direction on an edge belongs to the bin after it, on
        the last edge of all to the bin before.
        """
        n = len(directions)
        angles, cells = np.empty(n, dtype=np.int32), np.empty(n, dtype=np.int32)
        given = np.ascontiguousarray(directions, dtype=np.float64)
        polar_z, starts = np.cos(self.polar_edges), self.cell_starts.astype(np.int64)
        first_polar, first_band = _first_bands(polar_z), _first_bands(self.band_edges)

        def look(rows: slice) -> None:
            # NumPy's arctan2 takes several at a time, which the compiled loop's does not.
            phi = np.arctan2(given[rows, 1], given[rows, 0])
            sphere_kernels.bins_of_directions(
                given[rows],
                phi,
                self.azimuth,
                polar_z,
                first_polar,
                self.band_edges,
                first_band,
                starts,
                angles[rows],
                cells[rows],
            )

        over_blocks(look, n, block=BLOCK)
        return angles, cells


def _first_bands(edges: Float[np.ndarray, "edges"]) -> Int[np.ndarray, "s"]:
    """For each of many equal slices of z from 1 downward, the band at its upper end: where a search begins."""
    bands = len(edges) - 1
    z = 1.0 - 2.0 * np.arange(8 * bands) / (8 * bands)
    return np.clip(np.searchsorted(-edges, -z, side="left") - 1, 0, bands - 1).astype(np.int64)
