"""A box's freedom to be fitted: boxes round a start as a few numbers, upright or turned anyhow."""

import math
from dataclasses import dataclass
from itertools import permutations, product
from typing import Literal

import numpy as np
from jaxtyping import Float

from ars_web.geometry import rigid_transform
from ars_web.geometry.box import FARTHEST, LARGEST_SIZE, Box

Orientation = Literal["upright", "free"]

PARAMETERS: dict[Orientation, int] = {"upright": 7, "free": 9}
"""How many numbers each has."""

STEP = 2e-3
"""Of the differences that slopes are taken from: parameters count in half diagonals, radians and shares of a size, so
that a label moves by some tenths of a pixel, many times what it may be off."""

SMALLEST_SIZE = 1e-6
"""Metres, of a fitted box along any of its axes."""

LARGEST_CHANGE = math.log(50)
"""Of a size, up or down, as a logarithm."""


@dataclass(frozen=True, eq=False)
class BoxParameters:
    """Boxes round a start as 7 or 9 numbers that are all 0 there: metres over the start's half diagonal, radians, and
    logarithms of the change in size."""

    start: Box
    orientation: Orientation

    @property
    def count(self) -> int:
        """How many numbers there are."""
        return PARAMETERS[self.orientation]

    def placed(self, xs: Float[np.ndarray, "k p"]) -> tuple[Float[np.ndarray, "k 4 4"], Float[np.ndarray, "k 3"]]:
        """`Ts_world_box` (k, 4, 4) and `sizes` (k, 3) of k rows of numbers."""
        T = self.start.T_world_box
        places = T[:3, 3] + xs[:, :3] * (float(np.linalg.norm(self.start.size)) / 2)
        turns = np.zeros((len(xs), 3))
        turns[:, 2 if self.orientation == "upright" else slice(3)] = (
            xs[:, 3] if self.orientation == "upright" else xs[:, 3:6]
        )
        half = np.linalg.norm(turns, axis=1, keepdims=True) / 2
        # sin(half) / half, which np.sinc knows at 0, too
        wxyz = np.concatenate([np.cos(half), turns / 2 * np.sinc(half / math.pi)], axis=1)
        R = rigid_transform.rotation_from_wxyz(wxyz)
        R = R @ T[:3, :3] if self.orientation == "upright" else T[:3, :3] @ R
        sizes = self.start.size * np.exp(np.clip(xs[:, -3:], -LARGEST_CHANGE, LARGEST_CHANGE))
        # A search may go anywhere; what it finds is a box all the same.
        places, sizes = np.clip(places, -FARTHEST, FARTHEST), np.clip(sizes, SMALLEST_SIZE, LARGEST_SIZE)
        return rigid_transform.from_rotation(R, places), sizes

    def box(self, x: Float[np.ndarray, "p"]) -> Box:
        """The box of the numbers."""
        Ts_world_box, sizes = self.placed(x[None])
        return Box(Ts_world_box[0], sizes[0])

    def turned(self, angles: Float[np.ndarray, "3"]) -> Box:
        """The start turned by a rotation vector along its axes; upright: about the vertical by its last number."""
        x = np.zeros(self.count)
        x[3 : self.count - 3] = angles[2:] if self.orientation == "upright" else angles
        return self.box(x)

    def around(self, x: Float[np.ndarray, "p"]) -> tuple[Float[np.ndarray, "p+1 4 4"], Float[np.ndarray, "p+1 3"]]:
        """The box itself, then a step along each number, as `placed` gives them."""
        return self.placed(x + np.concatenate([np.zeros((1, self.count)), STEP * np.eye(self.count)]))


def upright_box(box: Box) -> Box:
    """The box turned by as little as makes its steepest axis vertical."""
    R = box.T_world_box[:3, :3]
    axis = R[:, int(np.argmax(np.abs(R[2])))]
    up = np.array([0.0, 0.0, math.copysign(1.0, axis[2])])
    # Half way between the two, turned about by half a turn, twice: the shortest way from one to the other.
    middle = (axis + up) / np.linalg.norm(axis + up)
    turn = (2 * np.outer(middle, middle) - np.eye(3)) @ (2 * np.outer(axis, axis) - np.eye(3))
    return Box(rigid_transform.from_rotation(turn @ R, box.T_world_box[:3, 3]), box.size)


def with_nearest_axes(box: Box, like: Box) -> Box:
    """The same box with its axes called as those of `like` that they are nearest to."""
    R, size = box.T_world_box[:3, :3], box.size
    turns = [
        np.eye(3)[:, list(order)] * signs
        for order in permutations(range(3))
        for signs in product((-1.0, 1.0), repeat=3)
    ]
    best = max(
        (turn for turn in turns if np.linalg.det(turn) > 0),
        key=lambda turn: float(np.trace(like.T_world_box[:3, :3].T @ R @ turn)),
    )
    return Box(rigid_transform.from_rotation(R @ best, box.T_world_box[:3, 3]), np.abs(best).T @ size)
