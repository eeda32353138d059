"""A sphere's bins and cells as they are drawn: patches, each between two azimuths and two polar angles."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float, Int

from ars_web.geometry.sphere_bins import SphereBins
from ars_web.geometry.symmetry import NO_SYMMETRY, Symmetry
from ars_web.geometry.view_directions import folded

STEP = np.radians(7.5)
"""Of the lines that a patch's sides and its surface are drawn by: off a circle by a thousandth of its radius."""


@dataclass(frozen=True, eq=False)
class Tiles:
    """k tiles as one mesh on the unit sphere, its faces counter-clockwise seen from outside.

    Attributes:
        owners: (v,) which tile each vertex is of.
    """

    vertices: Float[np.ndarray, "v 3"]
    faces: Int[np.ndarray, "f 3"]
    owners: Int[np.ndarray, "v"]


def bin_patches(bins: SphereBins) -> Float[np.ndarray, "k 4"]:
    """Azimuth from and to, polar angle from and to, of each bin of equal angles, azimuth * polar bins + polar."""
    azimuth, polar = np.divmod(np.arange(bins.cells), bins.polar)
    around, down = bins.azimuth_edges, bins.polar_edges
    return np.stack([around[azimuth], around[azimuth + 1], down[polar], down[polar + 1]], axis=-1)


def cell_patches(bins: SphereBins) -> Float[np.ndarray, "k 4"]:
    """Azimuth from and to, polar angle from and to, of each cell of equal area."""
    band = np.repeat(np.arange(len(bins.bands)), bins.bands)
    place = np.arange(bins.cells) - bins.cell_starts[band]
    width = 2.0 * np.pi / bins.bands[band]
    polar = np.arccos(np.clip(bins.band_edges, -1.0, 1.0))
    start = -np.pi + place * width
    return np.stack([start, start + width, polar[band], polar[band + 1]], axis=-1)


def patch_middles(patches: Float[np.ndarray, "k 4"]) -> Float[np.ndarray, "k 3"]:
    """The direction in the middle of each patch's angles."""
    return _on_sphere(patches[:, :2].mean(axis=1), patches[:, 2:].mean(axis=1))


@lru_cache(maxsize=32)
def stand_ins(bins: SphereBins, symmetry: Symmetry = NO_SYMMETRY) -> tuple[Int[np.ndarray, "k"], Int[np.ndarray, "k"]]:
    """For each bin of equal angles (k,) and each cell (k,) the one that its middle is folded into by the symmetry:
    whose views are views from there, too."""
    middles = patch_middles(bin_patches(bins)), bins.cell_directions
    found = bins.of(folded(middles[0], symmetry))[0], bins.of(folded(middles[1], symmetry))[1]
    for one in found:
        one.flags.writeable = False
    return found


def tiles(patches: Float[np.ndarray, "k 4"], *, gap: float) -> Tiles:
    """Patches as a mesh, each `gap` radians smaller on every side than it is; a quarter smaller at most."""
    vertices: list[np.ndarray] = []
    faces: list[np.ndarray] = []
    owners: list[np.ndarray] = []
    count = 0
    for owner, (left, right, top, bottom) in enumerate(patches):
        high = min(gap, (bottom - top) / 4)
        # A pole is no side: the patch there ends in a point.
        top, bottom = top + high * (top > 0.0), bottom - high * (bottom < np.pi)
        widest = max(np.sin(top), np.sin(bottom), np.sin(np.pi / 2) if top < np.pi / 2 < bottom else 0.0)
        # All round there is no side either.
        wide = 0.0 if right - left > 2 * np.pi - 1e-9 else min(gap / widest, (right - left) / 4)
        across = np.linspace(left + wide, right - wide, 1 + max(1, int(np.ceil((right - left) * widest / STEP))))
        down = np.linspace(top, bottom, 1 + max(1, int(np.ceil((bottom - top) / STEP))))
        grid = _on_sphere(*np.meshgrid(across, down)).reshape(-1, 3)
        columns = len(across)
        corner = (np.arange(len(down) - 1)[:, None] * columns + np.arange(columns - 1)).ravel() + count
        below = corner + columns
        faces += [
            np.stack([corner, below, below + 1], axis=-1),
            np.stack([corner, below + 1, corner + 1], axis=-1),
        ]
        vertices.append(grid)
        owners.append(np.full(len(grid), owner))
        count += len(grid)
    return Tiles(np.concatenate(vertices), np.concatenate(faces), np.concatenate(owners))


def dots(directions: Float[np.ndarray, "n 3"], *, radius: float, sides: int = 8) -> Tiles:
    """Round spots of `radius` radians about unit directions, as tiles."""
    n = len(directions)
    aside = np.cross(directions, np.where(np.abs(directions[:, 2:]) < 0.9, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]))
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    other = np.cross(directions, aside)
    turns = np.arange(sides) * 2.0 * np.pi / sides
    rim = (
        np.cos(radius) * directions[:, None]
        + np.sin(radius) * np.cos(turns)[:, None] * aside[:, None]
        + np.sin(radius) * np.sin(turns)[:, None] * other[:, None]
    )
    vertices = np.concatenate([directions[:, None], rim], axis=1).reshape(-1, 3)
    spoke = np.arange(sides)
    fan = np.stack([np.zeros(sides, dtype=np.int64), 1 + spoke, 1 + (spoke + 1) % sides], axis=-1)
    faces = (np.arange(n)[:, None, None] * (sides + 1) + fan).reshape(-1, 3)
    return Tiles(vertices, faces, np.repeat(np.arange(n), sides + 1))


def outlines(patches: Iterable[Float[np.ndarray, "4"]]) -> Float[np.ndarray, "m 2 3"]:
    """The sides of patches, as segments between points of the unit sphere; without those that two of them share, such
    as between the bins of a ring that a symmetry makes one."""
    segments = [np.zeros((0, 2, 3))]
    for left, right, top, bottom in patches:
        sides = [(phi, phi, top, bottom) for phi in (left, right) if right - left < 2 * np.pi - 1e-9]
        sides += [(left, right, theta, theta) for theta in (top, bottom) if 0.0 < theta < np.pi]
        for phi0, phi1, theta0, theta1 in sides:
            steps = 1 + max(1, int(np.ceil(max(phi1 - phi0, theta1 - theta0) / (STEP / 2))))
            line = _on_sphere(np.linspace(phi0, phi1, steps), np.linspace(theta0, theta1, steps))
            segments.append(np.stack([line[:-1], line[1:]], axis=1))
    found = np.concatenate(segments)
    # By their middles, since those that are shared run either way, and differ by rounding where the way round closes.
    middles = (1e6 * found.mean(axis=1)).round().astype(int)
    _, which, times = np.unique(middles, axis=0, return_inverse=True, return_counts=True)
    return found[times[which.ravel()] == 1]


def _on_sphere(phi: np.ndarray, theta: np.ndarray) -> np.ndarray:
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
