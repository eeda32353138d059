"""In which frame to draw an object next: where its outline would do most for the labels of all frames.

What the object looks like is not known yet, so a ball stands for it. The outlines that are there, and the one that a
frame would add, are cones round that ball; what all of them leave of space has an extent along the axes of each image,
and the nearer that is to the ball's own, the better the labels are. Frames that see the object from the sides that are
drawn, or from opposite them, add little, and so come last by themselves.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float, Float32, Int

from ars_web.errors import BadInput
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.labels import labels_of_boxes
from ars_web.geometry.occlusion import visible_fractions
from ars_web.geometry.view_guess import FrameRows, Guess, by_camera, evenly, shows

DIRECTIONS = 384
"""From the object's middle, in which it is asked how far the cones reach."""

FARTHEST_REACH = 4.0
"""Radii. Where the cones leave a direction open, it counts as this much."""

JUDGES = 36
"""Frames, evenly spread over those that show the object, whose labels are looked at."""

LOOKED_AT = 240
"""Frames times guesses, evenly spread, that are tried at first; then LOOKED_NEAR about the best of them."""

LOOKED_NEAR = 32

DRAWN_TO = 1.0
"""Pixels that an outline is off."""

SEARCHED = 4_000
"""Frames times guesses, evenly spread, that are asked whether they show the object; all where none of them does."""

PAIRED = 32
"""Frames, evenly spread, of which the first is chosen, each with each other as the second."""

LIKELY = 0.5
"""A frame is suggested only if it shows the object with more than this probability, as the guesses have it."""

LIGHTEST = 0.1
"""Guesses that are less likely than this share of the likeliest are left out."""

BALL_IN_BOX = 0.8
"""Of a ball's diameter: a box with the volume of the ball."""


@dataclass(frozen=True, eq=False)
class SuggestedView:
    """A frame to draw the object in.

    Attributes:
        frame: its index.
        angle: radians to the nearest side that is drawn already; NaN where none is.
        agreement: expected mean share that a label has in common with the one of the hull, if the frame is drawn;
            a model's number, to compare frames by.
    """

    frame: int
    angle: float
    agreement: float


def suggest_views(
    guesses: Sequence[Guess],
    drawn: Sequence[int],
    frames: FrameRows,
    *,
    count: int = 1,
    allowed: Bool[np.ndarray, "n"] | None = None,
    others: Sequence[Box] = (),
) -> list[SuggestedView]:
    """At most `count` frames to draw an object in after those that are `drawn`, the best first, each chosen as if those
    before it were drawn by then; fewer where fewer show it whole and large enough.

    Of many frames, some are looked at, evenly spread, and then those near the best. `allowed`: the only ones that may
    be suggested. `others`: boxes that may hide the object.

    Raises:
        BadInput: `count` is below 1, or there is no guess.
    """
    if count < 1:
        raise BadInput(f"at least 1 frame must be asked for, not {count}")
    if not guesses:
        raise BadInput("where the object may be must be guessed, to suggest frames")
    free = np.ones(len(frames), dtype=bool) if allowed is None else allowed.copy()
    free[list(drawn)] = False
    search = _Search(guesses, frames, others)
    before, chosen = list(drawn), list[SuggestedView]()
    while len(chosen) < count:
        found = search.best(free, before)
        if found is None:
            break
        chosen.append(found)
        before.append(found.frame)
        free[found.frame] = False
    return chosen


class _Search:
    """Where an object may be, which frames show it there, and how its labels are judged."""

    def __init__(self, guesses: Sequence[Guess], frames: FrameRows, others: Sequence[Box]) -> None:
        likely = sorted(guesses, key=lambda guess: -guess.weight)
        self._guesses = [guess for guess in likely if guess.weight >= LIGHTEST * likely[0].weight]
        weights = np.array([guess.weight for guess in self._guesses])
        self._weights = weights / weights.sum()
        self._frames = frames
        self._others = others
        self._rows, self._shown = self._showing(evenly(np.arange(len(frames)), SEARCHED // len(self._guesses)))
        if not len(self._rows):
            self._rows, self._shown = self._showing(np.arange(len(frames)))
        judges = [self._rows[shown] for shown in self._shown]
        self._models = [_Model.of(*pair, frames) for pair in zip(self._guesses, judges, strict=True)]

    def best(self, free: Bool[np.ndarray, "n"], before: Sequence[int]) -> SuggestedView | None:
        """The best of the free frames; None where none shows the object. With nothing drawn before, the one that a
        second frame would do most for."""
        among = free[self._rows]
        some, shown = self._rows[among], self._shown[:, among]
        if not len(some):
            some, shown = self._showing(np.flatnonzero(free))
        if not len(some):
            return None
        if not len(before):
            return self._first(some, shown)
        tried = evenly(np.arange(len(some)), LOOKED_AT // len(self._guesses))
        frames, worth = some[tried], self._worth(some[tried], shown[:, tried], before)
        best = int(np.argmax(worth))
        low, high = frames[max(best - 1, 0)], frames[min(best + 1, len(frames) - 1)]
        near = evenly(np.arange(low, high + 1)[free[low : high + 1]], LOOKED_NEAR)
        near, shown = self._showing(np.setdiff1d(near, frames))
        frames, worth = np.append(frames, near), np.append(worth, self._worth(near, shown, before))
        best = int(np.argmax(worth))
        angle = _nearest_side(self._guesses[0], before, int(frames[best]), self._frames)
        return SuggestedView(int(frames[best]), angle, float(worth[best]))

    def _first(self, rows: Int[np.ndarray, "k"], shown: Bool[np.ndarray, "g k"]) -> SuggestedView:
        few = evenly(np.arange(len(rows)), PAIRED)
        rows, shown = rows[few], shown[:, few]
        best = [float(self._worth(rows, shown, [row]).max()) for row in rows.tolist()]
        worth = np.array(best) * _unhidden(self._frames, rows, self._guesses[0], self._others)
        return SuggestedView(int(rows[int(np.argmax(worth))]), math.nan, float(worth.max()))

    def _showing(self, rows: Int[np.ndarray, "n"]) -> tuple[Int[np.ndarray, "k"], Bool[np.ndarray, "g k"]]:
        """Those of the rows that likely show the object, and whether they do for each guess."""
        shown = np.array([shows(self._frames, rows, guess) for guess in self._guesses])
        likely = self._weights @ shown >= LIKELY
        return rows[likely], shown[:, likely]

    def _worth(
        self, rows: Int[np.ndarray, "k"], shown: Bool[np.ndarray, "g k"], before: Sequence[int]
    ) -> Float[np.ndarray, "k"]:
        """How much labels would agree if each row was drawn, less where something hides the object there."""
        each = [model.agreements(self._frames, before, rows, shown[i]) for i, model in enumerate(self._models)]
        return self._weights @ np.array(each) * _unhidden(self._frames, rows, self._guesses[0], self._others)


def _unhidden(
    frames: FrameRows, rows: Int[np.ndarray, "k"], guess: Guess, others: Sequence[Box]
) -> Float[np.ndarray, "k"]:
    """The share of a ball's box that no other box hides, where it is shown."""
    seen = np.ones(len(rows))
    if not others:
        return seen
    side = 2 * guess.radius * BALL_IN_BOX
    box = Box(rigid_transform.from_rotation(np.eye(3), guess.centre_world), np.full(3, side))
    for camera_id, these in by_camera(frames, rows):
        camera, Ts = frames.by_id[camera_id], frames.Ts_world_camera[rows[these]]
        boxes = [box, *others]
        shares = visible_fractions(camera, Ts, boxes, labels_of_boxes(camera, Ts, boxes).bbox)[:, 0]
        seen[these] = np.where(np.isnan(shares), 1.0, shares)
    return seen


def _nearest_side(guess: Guess, drawn: Sequence[int], frame: int, frames: FrameRows) -> float:
    """Radians between the side from which a frame sees the ball and the nearest of those that are drawn."""
    if not drawn:
        return math.nan
    towards = frames.Ts_world_camera[[frame, *drawn], :3, 3] - guess.centre_world
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    return float(np.arccos(np.clip(towards[1:] @ towards[0], -1.0, 1.0)).min())


@dataclass(frozen=True, eq=False)
class _Model:
    """A ball and how its labels are judged.

    Attributes:
        along: (2 e, d) how far each of d directions leads along the two image axes of each of e frames.
        ball: (2 e,) how wide the ball is along them, as far as the directions tell.
    """

    guess: Guess
    along: Float32[np.ndarray, "a d"]
    ball: Float[np.ndarray, "a"]

    @classmethod
    def of(cls, guess: Guess, shown: Int[np.ndarray, "k"], frames: FrameRows) -> "_Model":
        """Judged by some of the frames that show the ball; by some of all where none does."""
        judges = shown if len(shown) else np.arange(len(frames))
        Ts = frames.Ts_world_camera[evenly(judges, JUDGES)]
        z = guess.centre_world - Ts[:, :3, 3]
        z /= np.linalg.norm(z, axis=1, keepdims=True)
        y = np.cross(z, Ts[:, :3, 0])
        y /= np.linalg.norm(y, axis=1, keepdims=True)
        along = np.concatenate([np.cross(y, z), y]) @ _directions().T
        return cls(guess, along.astype(np.float32), np.ptp(along, axis=1))

    def agreements(
        self, frames: FrameRows, drawn: Sequence[int], rows: Int[np.ndarray, "k"], shown: Bool[np.ndarray, "k"]
    ) -> Float[np.ndarray, "k"]:
        """How much labels would agree if one more frame were drawn; for those that do not show the ball: as it is."""
        left = np.min(self._reach(frames, np.array(drawn, dtype=np.int64)), axis=0, initial=FARTHEST_REACH)
        more = np.where(shown[:, None], self._reach(frames, rows), FARTHEST_REACH)
        left = np.minimum(left, more)
        # (k, 2 e): how wide what is left is in each judge's image, along x and along y
        widths = np.array([np.ptp(self.along * reach, axis=1) for reach in left.astype(np.float32)])
        widths = widths.reshape(-1, len(self.ball))
        shares = self.ball / widths
        half = shares.shape[1] // 2
        return (shares[:, :half] * shares[:, half:]).mean(axis=1)

    def _reach(self, frames: FrameRows, rows: Int[np.ndarray, "k"]) -> Float[np.ndarray, "k d"]:
        """How far from the ball's middle, in radii, the cone round it leads in each direction, from each camera.

        The cone touches a ball that is wider by what an outline is off. With the ball's radius 1 and the camera at q, a
        ray t d from the middle leaves the cone where ((t d - q) . q)^2 = |t d - q|^2 (|q|^2 - 1), the smaller t > 0.
        """
        Ts = frames.Ts_world_camera[rows]
        towards = Ts[:, :3, 3] - self.guess.centre_world
        focal = np.array([frames.by_id[i].fx for i in frames.camera_ids[rows].tolist()])
        wide = self.guess.radius + np.linalg.norm(towards, axis=1) * DRAWN_TO / focal
        q = towards / wide[:, None]
        q2 = (q * q).sum(axis=1, keepdims=True)
        qd = q @ _directions().T
        nearer = qd + np.sqrt(np.maximum(q2 - 1, 0.0) * np.maximum(q2 - qd * qd, 0.0))
        leaves = (q2 > 1) & (nearer > 0)
        reach = np.where(leaves, q2 / np.where(leaves, nearer, 1.0), np.inf)
        return reach * (wide / self.guess.radius)[:, None]


@lru_cache(maxsize=1)
def _directions() -> Float[np.ndarray, "d 3"]:
    """Evenly spread over the sphere, on Fibonacci's spiral."""
    i = np.arange(DIRECTIONS) + 0.5
    z = 1 - 2 * i / DIRECTIONS
    angle = math.pi * (1 + math.sqrt(5)) * i
    flat = np.sqrt(1 - z * z)
    return np.column_stack([flat * np.cos(angle), flat * np.sin(angle), z])
