"""From which side cameras stand round something: azimuths about the z axis of a frame, and sectors of them."""

import numpy as np
from jaxtyping import Bool, Float

TURN = 360.0

_DIGITS = 9
"""Of an azimuth in degrees. Cameras that stand exactly on a sector's edge are on the same side of it everywhere."""

_ON_AXIS = 1e-9
"""Of the distance to the origin, aside from the z axis: what is left of none by rounding has no azimuth."""


def azimuths_round(
    centres_world: Float[np.ndarray, "n 3"], T_world_about: Float[np.ndarray, "4 4"]
) -> Float[np.ndarray, "n"]:
    """Degrees in [0, 360) from the x axis of the frame `about` to each camera, seen from its positive z.

    NaN for a camera on its z axis.
    """
    offsets = centres_world - T_world_about[:3, 3]
    x, y = (offsets @ T_world_about[:3, :2]).T
    degrees = np.round(np.degrees(np.arctan2(y, x)), _DIGITS) % TURN
    on_axis = np.hypot(x, y) <= _ON_AXIS * np.linalg.norm(offsets, axis=1)
    return np.where(on_axis, np.nan, degrees)


def in_sector(azimuths: Float[np.ndarray, "n"], *, start: float, stop: float) -> Bool[np.ndarray, "n"]:
    """Whether each azimuth lies from `start` on up to, not including, `stop`, going on over 360; all in degrees.

    What has no azimuth lies in a whole turn alone.
    """
    # 0.4 - 0.1 is more than 0.3, and 512.2 - 152.2 more than 360: both sides are rounded, or an edge is in two sectors.
    whole = round(stop - start, _DIGITS)
    width = round(whole % TURN, _DIGITS)
    if width == 0.0:
        return np.full(len(azimuths), whole != 0.0)
    return np.round((azimuths - start) % TURN, _DIGITS) % TURN < width
