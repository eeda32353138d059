"""Neighbours across the split: how near frames that validate are to frames that train.

A detector that is measured on pictures it has all but seen is measured too well. Two frames are twins here where the
camera moved less than `TWIN_MOVE` of its distance to the nearest object that is labelled, and turned by less than
`TWIN_TURN`: then everything in the image stays where it was, but for some percent of the image's width.
"""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from ars_web.geometry import rigid_transform

TWIN_MOVE = 0.05
"""Of the distance to the nearest labelled object. The camera then sees it from at most 3 degrees beside."""

TWIN_TURN = math.radians(5.0)
"""Radians, about any axis."""

ASKED_FRAMES = 1_000
"""Frames of a split whose neighbours are looked for, spread evenly over it: each is held against every frame that
trains, and the share of twins among this many is known to about two percent."""

_PAIRS_AT_ONCE = 250_000


@dataclass(frozen=True, eq=False)
class Neighbours:
    """The nearest frame that trains, of each frame asked; nearest is where the larger of move / TWIN_MOVE and
    turn / TWIN_TURN is smallest.

    Attributes:
        rows: (k,) of the frames asked, ascending.
        nearest: (k,) rows of the frames that train.
        move: (k,) how far the camera is from there, as a share of its distance to the nearest labelled object.
        turn: (k,) by how much it is turned, radians.
    """

    rows: Int[np.ndarray, "k"]
    nearest: Int[np.ndarray, "k"]
    move: Float[np.ndarray, "k"]
    turn: Float[np.ndarray, "k"]

    @property
    def twins(self) -> Bool[np.ndarray, "k"]:
        """(k,) which of them have a twin that trains."""
        return (self.move < TWIN_MOVE) & (self.turn < TWIN_TURN)


def neighbours(
    Ts_world_camera: Float[np.ndarray, "n 4 4"],
    distances: Float[np.ndarray, "n"],
    asked: Int[np.ndarray, "k"],
    training: Int[np.ndarray, "t"],
) -> Neighbours:
    """The nearest of the rows `training`, at least one, to each of the rows `asked`.

    `distances` are metres from each camera to what is looked at; those of asked rows are finite.
    """
    # Near the origin, so that map coordinates leave digits for centimetres.
    centres = Ts_world_camera[:, :3, 3] - Ts_world_camera[training, :3, 3].mean(axis=0)
    wxyz = rigid_transform.wxyz_from_rotation(Ts_world_camera[:, :3, :3])
    nearest, move, turn = np.empty(len(asked), dtype=np.int64), np.empty(len(asked)), np.empty(len(asked))
    step = max(1, _PAIRS_AT_ONCE // len(training))
    squared = (centres[training] ** 2).sum(axis=1)
    for first in range(0, len(asked), step):
        part = slice(first, first + step)
        rows = asked[part]
        apart = squared[None, :] + (centres[rows] ** 2).sum(axis=1)[:, None] - 2.0 * centres[rows] @ centres[training].T
        moves = np.sqrt(np.maximum(apart, 0.0)) / np.maximum(distances[rows], 1e-9)[:, None]
        turns = 2.0 * np.arccos(np.minimum(np.abs(wxyz[rows] @ wxyz[training].T), 1.0))
        best = np.maximum(moves / TWIN_MOVE, turns / TWIN_TURN).argmin(axis=1)
        place = np.arange(len(rows)), best
        nearest[part], move[part], turn[part] = training[best], moves[place], turns[place]
    return Neighbours(asked, nearest, move, turn)
