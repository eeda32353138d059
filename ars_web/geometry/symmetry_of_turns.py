"""The symmetry that turns belong to, as files list them: each a rotation that leaves an object looking the same."""

import math

import numpy as np
from jaxtyping import Float

from ars_web.errors import BadInput
from ars_web.geometry.rigid_transform import wxyz_from_rotation
from ars_web.geometry.symmetry import MOST_ROTATIONS, NO_SYMMETRY, Axis, Symmetry, rotations_of

OFF = math.radians(12.0)
"""Over the square of its order: how far a turn may be from a whole part of a circle. Turns that people fitted to a scan
are a degree off a half; parts of a circle of orders m and n are at least 360 / (m n) degrees apart."""

_SAME = 0.05
"""Entries of two rotations that are one, for turns as far off as that."""


def symmetry_of_turns(turns: Float[np.ndarray, "m 3 3"], *, axis: Float[np.ndarray, "3"] | None = None) -> Symmetry:
    """The symmetry of an object, from the turns about its box's centre that change nothing, in the box's frame.

    Args:
        axis: of unit length, about which any turn changes nothing; None: there is none.

    Raises:
        BadInput: a turn is no whole part of a circle, or they lead to too many.
    """
    if axis is not None:
        return Symmetry("continuous", axis=_axis(axis), flip=any(float(axis @ R @ axis) < -0.9 for R in turns))
    symmetry = NO_SYMMETRY
    for R in turns:
        known = rotations_of(symmetry)
        if np.abs(known - R).max(axis=(1, 2)).min() > _SAME:
            symmetry = Symmetry("discrete", (*symmetry.rotations, _generator(R)))
    return symmetry


def _generator(R: Float[np.ndarray, "3 3"]) -> tuple[Axis, int]:
    """The axis and the order of the group that a rotation's powers are."""
    wxyz = wxyz_from_rotation(R)
    sine = float(np.linalg.norm(wxyz[1:]))
    angle = 2 * math.atan2(sine, float(wxyz[0]))
    for order in range(2, MOST_ROTATIONS + 1):
        part = 2 * math.pi / order
        if abs(angle - round(angle / part) * part) <= OFF / order**2:
            return _axis(wxyz[1:] / sine), order
    raise BadInput(
        f"a turn by {math.degrees(angle):.2f} degrees is no whole part of a circle, up to 1/{MOST_ROTATIONS}, so"
        " nothing looks the same after it"
    )


def _axis(direction: Float[np.ndarray, "3"]) -> Axis:
    """A direction, rounded as files are; the first of its numbers that is not zero is positive."""
    rounded = np.round(direction, 9) + 0.0
    first = rounded[np.flatnonzero(rounded)[0]]
    x, y, z = (rounded if first > 0 else -rounded + 0.0).tolist()
    return x, y, z
