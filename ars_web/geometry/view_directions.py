"""Where cameras stand as an object sees them: directions in its box's frame, folded by its symmetry."""

from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float

from ars_web.geometry import sphere_kernels
from ars_web.geometry.box import Box
from ars_web.geometry.sphere_bins import SphereBins
from ars_web.geometry.symmetry import NO_SYMMETRY, Symmetry, rotations_of

DENSE = 200_000
"""Directions, evenly over the sphere, that show which bins a folded one can lie in."""

_TILT = 1e-3
"""Of the direction that folding leads towards, away from z: it only says which of the turns about z is meant."""

_ASIDE = 0.04
"""Radians from +x. Directions folded by a continuous symmetry lie in a half plane; this one is within a bin."""

_NO_TIE = 1e-6
"""Radians. Cameras on a ring often stand exactly between two that are folded to; rounding must not part them."""


def view_directions(
    centres_world: Float[np.ndarray, "n 3"], box: Box, *, symmetry: Symmetry = NO_SYMMETRY
) -> Float[np.ndarray, "n 3"]:
    """Unit directions from a box's centre to camera centres, in the box's frame, folded by `symmetry`.

    NaN for a camera at the box's centre.
    """
    centres = np.ascontiguousarray(centres_world, dtype=np.float64)
    directions = np.empty_like(centres)
    sphere_kernels.directions_to(centres, np.array(box.T_world_box), directions)
    return folded(directions, symmetry)


def folded(directions: Float[np.ndarray, "n 3"], symmetry: Symmetry) -> Float[np.ndarray, "n 3"]:
    """Of the directions that an object looks the same from, one for all: the nearest to a direction that the symmetry
    gives, beside +z.

    With turns about z alone that is an azimuth in [0, 2 pi / order); with a half turn across z also theta at most
    pi / 2.
    """
    if symmetry.kind == "none":
        return directions
    towards = _towards(symmetry)
    rotations = rotations_of(symmetry)
    if symmetry.axis is not None:
        axis = np.array(symmetry.axis)
        along = directions @ axis
        if len(rotations) > 1:
            # A flip leads (along, across) to (-along, across).
            along = np.where((along < 0.0) == (towards @ axis < 0.0), along, -along)
        across = towards - (towards @ axis) * axis
        across /= np.linalg.norm(across)
        return along[:, None] * axis + np.sqrt(np.clip(1.0 - along**2, 0.0, None))[:, None] * across
    best = (directions @ (rotations.transpose(0, 2, 1) @ towards).T).argmax(axis=1)
    return np.einsum("nij,nj->ni", rotations[best], directions)


@lru_cache(maxsize=64)
def reachable(bins: SphereBins, symmetry: Symmetry) -> tuple[Bool[np.ndarray, "k"], Bool[np.ndarray, "k"]]:
    """Which bins of equal angles and which cells folded directions can lie in; all of them without symmetry."""
    found = np.ones(bins.cells, dtype=bool), np.ones(bins.cells, dtype=bool)
    if symmetry.kind != "none":
        for reached, places in zip(found, bins.of(folded(evenly_over_sphere(DENSE), symmetry)), strict=True):
            reached[:] = False
            reached[places] = True
    for reached in found:
        reached.flags.writeable = False
    return found


@lru_cache(maxsize=4)
def evenly_over_sphere(count: int) -> Float[np.ndarray, "n 3"]:
    """`count` directions evenly over the sphere, on a spiral that turns by the golden angle from one to the next."""
    z = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    phi = np.arange(count) * (np.pi * (3.0 - np.sqrt(5.0)))
    radius = np.sqrt(1.0 - z**2)
    points = np.stack([radius * np.cos(phi), radius * np.sin(phi), z], axis=-1)
    points.flags.writeable = False
    return points


def _towards(symmetry: Symmetry) -> Float[np.ndarray, "3"]:
    """What folding leads towards: beside +z, in the middle of the azimuths that turns about z leave apart."""
    azimuth = _ASIDE
    if symmetry.axis is None:
        rotations = rotations_of(symmetry)
        about_z = int((rotations[:, 2, 2] > 1.0 - 1e-6).sum())
        azimuth = np.pi / about_z - _NO_TIE
    towards = np.array([_TILT * np.cos(azimuth), _TILT * np.sin(azimuth), 1.0])
    return towards / np.linalg.norm(towards)
