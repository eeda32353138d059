"""Snapping of lengths and angles. Pure.

What was dragged and dragged back is where it was: where a drag began is a place to snap to as well.
"""

import math

import numpy as np
from jaxtyping import Float

from ars_web.errors import BadInput


def snapped(value: float, *, step: float) -> float:
    """The multiple of `step` nearest to a value; the value itself for step 0.

    Raises:
        BadInput: the step is negative or not finite.
    """
    if not math.isfinite(step) or step < 0:
        raise BadInput(f"a snap must be a length or an angle of 0 or more, not {step}")
    if step == 0:
        return value
    # Division by a step such as 0.001 rounds; through its inverse, 85 mm are 0.085 and not 0.08500000000000001.
    inverse = 1.0 / step
    whole = round(inverse)
    count = round(value / step)
    return count / whole if whole > 0 and abs(inverse - whole) < 1e-9 * inverse else count * step


def snapped_change(change: Float[np.ndarray, "n"], *, step: float) -> Float[np.ndarray, "n"]:
    """A change, entry by entry in multiples of `step`."""
    return np.array([snapped(float(entry), step=step) for entry in change])


def snapped_size(size: float, *, start: float, step: float, least: float) -> float:
    """A side's length on the multiples of `step`, or at where it started where that is nearer; at least `least` > 0."""
    to = snapped(size, step=step)
    if step > 0 and abs(size - start) <= abs(size - to):
        to = start
    if to >= least:
        return to
    return step * math.ceil(least / step - 1e-9) if step > 0 else least
