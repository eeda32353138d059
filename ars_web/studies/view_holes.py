"""The largest region of directions that nobody looked at an object from, said in degrees.

Regions are runs of azimuth bins by runs of polar bins, azimuths going round: what a person can read and film.
"""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from ars_web.datasets.coverage import Coverage


@dataclass(frozen=True)
class Hole:
    """Directions without a view, in the box's frame; degrees.

    Attributes:
        azimuth: from where to where, from +x towards +y; the first may be larger, where it goes round 180.
        polar: angles from +z, the smaller first.
        all_round: whether no azimuth is left at which an object with its symmetry could be seen; then `azimuth` says
            little.
        share: of all directions that the object looks different from, by area.
    """

    azimuth: tuple[float, float]
    polar: tuple[float, float]
    all_round: bool
    share: float

    @property
    def words(self) -> str:
        """Such as "none from azimuth 90 to 180 degrees at 30 to 60 degrees from +z"; what goes round 180 says so."""
        low, high = self.polar
        tilt = f"{low:g} to {high:g} degrees from +z"
        if self.all_round and (low, high) == (0.0, 180.0):
            return "none at all"
        if self.all_round:
            return f"none at {tilt}, at any azimuth"
        start, end = self.azimuth
        azimuths = f"{start:g} {'to' if start < end else 'over 180 to'} {end:g} degrees"
        if (low, high) == (0.0, 180.0):
            return f"none from azimuth {azimuths}, at any height"
        return f"none from azimuth {azimuths} at {tilt}"


def holes_of(coverage: Coverage) -> tuple[Hole, ...]:
    """The largest hole among directions on the side of the box's +z, and the largest on the side of -z, as far as there
    are any: where objects stand on something, the second is all of what is below."""
    middle = coverage.bins.polar // 2
    found = [biggest_hole(coverage, first=0, last=middle), biggest_hole(coverage, first=middle, last=None)]
    return tuple(hole for hole in found if hole is not None)


def biggest_hole(coverage: Coverage, *, first: int = 0, last: int | None = None) -> Hole | None:
    """The largest run of azimuth bins by a run of polar bins, among those from `first` up to `last`, without a view.

    Largest by area on the sphere; directions that symmetry folds elsewhere count nothing. None: every bin has a view.
    """
    areas = _areas(coverage)
    whole = float(areas.sum())
    end = areas.shape[1] if last is None else last
    best: tuple[float, int, int, int, int] | None = None
    for height in range(1, end - first + 1):
        for low in range(first, end - height + 1):
            column_areas = areas[:, low : low + height].sum(axis=1)
            start, length, area = _longest_run(coverage.counts[:, low : low + height].sum(axis=1) == 0, column_areas)
            if area > (best[0] * (1 + 1e-9) if best else 0.0):
                best = area, start, length, low, height
    if best is None:
        return None
    area, start, length, low, height = best
    there = areas[:, low : low + height].sum(axis=1) > 0
    inside = np.zeros(len(there), dtype=bool)
    inside[(start + np.arange(length)) % len(there)] = True
    step_azimuth, step_polar = 360.0 / coverage.bins.azimuth, 180.0 / coverage.bins.polar
    return Hole(
        azimuth=(-180.0 + start * step_azimuth, _wrapped(-180.0 + (start + length) * step_azimuth)),
        polar=(low * step_polar, (low + height) * step_polar),
        all_round=bool(inside[there].all()),
        share=area / whole,
    )


def unseen_azimuths(coverage: Coverage) -> float:
    """Degrees of the widest run of azimuths from which there is no view at any height."""
    there = np.asarray(coverage.reachable.any(axis=1), dtype=np.float64)
    _, _, columns = _longest_run(coverage.counts.sum(axis=1) == 0, there)
    return columns * 360.0 / coverage.bins.azimuth


def _areas(coverage: Coverage) -> Float[np.ndarray, "a p"]:
    """Of each bin in steradians; 0 of those that symmetry folds elsewhere."""
    heights = -np.diff(np.cos(coverage.bins.polar_edges))
    return coverage.reachable * (heights * (2.0 * math.pi / coverage.bins.azimuth))


def _longest_run(empty: Bool[np.ndarray, "a"], weights: Float[np.ndarray, "a"]) -> tuple[int, int, float]:
    """Where the heaviest run of empty columns starts, going round, how many there are, and their weight; without weight
    none is longer than it must be."""
    count = len(empty)
    solid = empty & (weights > 0)
    if not solid.any():
        return 0, 0, 0.0
    if empty.all():
        # All the way round: from where the first one with weight is.
        places: Int[np.ndarray, " m"] = np.flatnonzero(solid)
        return int(places[0]), int(places[-1] - places[0] + 1), float(weights.sum())
    best, at = (0, 0, 0.0), int(np.flatnonzero(~empty)[0])
    start, length, weight = -1, 0, 0.0
    for step in range(1, count + 1):
        column = (at + step) % count
        if not empty[column]:
            start, weight = -1, 0.0
            continue
        if weights[column] > 0:
            start = step if start < 0 else start
            weight += float(weights[column])
            length = step - start + 1
            if weight > best[2] * (1 + 1e-9):
                best = (at + start) % count, length, weight
    return best


def _wrapped(degrees: float) -> float:
    return degrees - 360.0 if degrees > 180.0 else degrees
