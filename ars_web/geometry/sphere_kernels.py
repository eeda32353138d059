"""The compiled loops that find from where cameras look, and the bins of directions."""

import numpy as np

from ars_web.geometry.compiled import entry, part

Array = np.ndarray


@entry
def directions_to(centres: Array, T_world_box: Array, directions: Array) -> None:
    """Unit directions from a box's centre to `centres` (n, 3) in its frame, written to `directions` (n, 3); NaN where
    there is none."""
    for i in range(len(centres)):
        x, y, z = (
            centres[i, 0] - T_world_box[0, 3],
            centres[i, 1] - T_world_box[1, 3],
            centres[i, 2] - T_world_box[2, 3],
        )
        length = np.sqrt(x * x + y * y + z * z)
        for j in range(3):
            directions[i, j] = (x * T_world_box[0, j] + y * T_world_box[1, j] + z * T_world_box[2, j]) / length


@part
def band_at(z: float, edges: Array, first_band: Array) -> int:
    """The band whose upper edge is at or above z and whose lower edge is below; the last one for -1.

    `edges` go down from 1; `first_band` is the band at the upper end of each of equal slices of z, downward.
    """
    slice_ = min(max(int((1.0 - z) / 2.0 * len(first_band)), 0), len(first_band) - 1)
    band = first_band[slice_]
    while band < len(edges) - 2 and z <= edges[band + 1]:
        band += 1
    return band


@entry
def bins_of_directions(
    directions: Array,
    phi: Array,
    azimuth: int,
    polar_z: Array,
    first_polar: Array,
    band_z: Array,
    first_band: Array,
    starts: Array,
    angles: Array,
    cells: Array,
) -> None:
    """The equal-angle bin and the equal-area cell of each direction (n, 3), written to `angles` and `cells` (n,).

    `phi` (n,) are their azimuths; `polar_z` and `band_z` the edges in z of polar bins and of bands of cells, with where
    to begin to look as `band_at` has it; `starts` the first cell of each band, and their number.
    """
    polar = len(polar_z) - 1
    for i in range(len(directions)):
        x, y, z = directions[i, 0], directions[i, 1], directions[i, 2]
        length = np.sqrt(x * x + y * y + z * z)
        if not (length > 0.0 and length < np.inf):
            angles[i] = -1
            cells[i] = -1
            continue
        z /= length
        turn = (phi[i] + np.pi) / (2.0 * np.pi)
        angles[i] = min(int(turn * azimuth), azimuth - 1) * polar + band_at(z, polar_z, first_polar)
        band = band_at(z, band_z, first_band)
        wide = starts[band + 1] - starts[band]
        cells[i] = starts[band] + min(int(turn * wide), wide - 1)
