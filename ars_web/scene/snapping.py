"""Snapping of lengths, angles and boxes. Pure.

What was dragged and dragged back is where it was: where a drag began is a place to snap to as well.
"""

import math

import numpy as np
from jaxtyping import Float

from ars_web.errors import BadInput
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box


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


def upright(box: Box) -> Box:
    """The box turned as little as upright asks: one of its axes along the world's z, the box staying about its centre.

    The axis nearest to the vertical is put up; the size stays with its axes.
    """
    R = box.T_world_box[:3, :3]
    axis = int(np.argmax(np.abs(R[2])))
    up = math.copysign(1.0, R[2, axis]) * np.array([0.0, 0.0, 1.0])
    T = rigid_transform.from_rotation(_turn_between(R[:, axis], up) @ R, box.T_world_box[:3, 3])
    return Box(T, box.size)


def on_ground(box: Box, *, height: float = 0.0) -> Box:
    """The box moved up or down so that its lowest corner is at the ground's height, metres."""
    T = box.T_world_box.copy()
    T[2, 3] += height - float(box.corners_world[:, 2].min())
    return Box(T, box.size)


def _turn_between(a: Float[np.ndarray, "3"], b: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """The least rotation that takes unit vector a to unit vector b, which are less than 90 degrees apart."""
    # Rodrigues with the unnormalised axis a x b: R = I + [v] + [v]^2 / (1 + a . b)
    v = np.cross(a, b)
    V = np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
    return np.eye(3) + V + V @ V / (1.0 + float(a @ b))
