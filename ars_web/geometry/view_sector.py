"""From which side cameras stand round something: azimuths about the z axis of a frame, and sectors of them."""

import numpy as np
from jaxtyping import Bool, Float

TURN = 360.0

_DIGITS = 9
"""Of an azimuth in degrees. Cameras that stand exactly on a sector's edge are on the same side of it everywhere."""


def azimuths_round(
    centres_world: Float[np.ndarray, "n 3"], T_world_about: Float[np.ndarray, "4 4"]
) -> Float[np.ndarray, "n"]:
    """Degrees in [0, 360) from the x axis of the frame `about` to each camera, seen from its positive z.

    NaN for a camera exactly on its z axis.
    """
    x, y = ((centres_world - T_world_about[:3, 3]) @ T_world_about[:3, :2]).T
    degrees = np.round(np.degrees(np.arctan2(y, x)), _DIGITS) % TURN
    return np.where((x == 0.0) & (y == 0.0), np.nan, degrees)


def in_sector(azimuths: Float[np.ndarray, "n"], *, start: float, stop: float) -> Bool[np.ndarray, "n"]:
    """Whether each azimuth lies from `start` on up to, not including, `stop`, going on over 360; all in degrees.

    What has no azimuth lies in a whole turn alone.
    """
    width = (stop - start) % TURN
    if width == 0.0:
        return np.full(len(azimuths), stop != start)
    return np.round((azimuths - start) % TURN, _DIGITS) % TURN < width
