"""Proposed outlines of one object held against each other: none may cut away what another one shows.

The hull of the drawn outlines is filled with points. An outline that is too small, because something hides a part of
the object or because colours misled it, takes points off behind which other outlines show the object; then no point is
left in front of some of their pixels. What is lost there tells it from one that is right, which takes off only points
beside the object.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float

from ars_web.masks.close_up import Cells, CloseUp

CUTS_NOTHING = 0.02
"""The share of another outline that one may cut away: what two careful outlines differ by."""

MOST_SETS = 6
"""Of outlines that agree, that are looked for."""


Outline = tuple[Cells, Bool[np.ndarray, "r c"]]
"""A close-up in squares, and those inside an outline."""


@dataclass(frozen=True, eq=False)
class Agreement:
    """How proposals stand to each other.

    Attributes:
        accepted: frames.
        kept: (n,) points that all accepted outlines leave.
        left: of each accepted frame, (n,) points that its outline leaves.
        cuts: of each other frame, the share of another outline that its own would cut away at least, and that frame.
    """

    accepted: tuple[int, ...]
    kept: Bool[np.ndarray, "n"]
    left: Mapping[int, Bool[np.ndarray, "n"]]
    cuts: Mapping[int, tuple[float, int]]


class Bench:
    """Proposals beside each other."""

    def __init__(
        self,
        shots: Mapping[int, CloseUp],
        points: Float[np.ndarray, "n 3"],
        spacing: float,
        drawn: Mapping[int, tuple[CloseUp, Bool[np.ndarray, "h w"]]],
    ) -> None:
        self.shots = shots
        self.points = points
        self.cells: dict[int, Cells] = {frame: shot.cells(spacing) for frame, shot in shots.items()}
        self.drawn_cells: dict[int, Outline] = {}
        for frame, (shot, mask) in drawn.items():
            cells = shot.cells(spacing)
            self.drawn_cells[frame] = (cells, cells.of_mask(mask))

    def left_by_others(self, agreement: Agreement, frame: int) -> Bool[np.ndarray, "n"]:
        """Points that all accepted outlines but a frame's own leave."""
        if frame not in agreement.left:
            return agreement.kept
        kept = np.ones(len(self.points), dtype=np.bool_)
        for other, left in agreement.left.items():
            if other != frame:
                kept &= left
        return kept

    def agreement(self, found: Mapping[int, Bool[np.ndarray, "h w"]], *, trust: Mapping[int, float]) -> Agreement:
        """Which proposals contradict neither the drawn outlines nor each other: of the sets that can be taken
        together, the one that is trusted most.

        An outline that is too small cuts most of the others, and one that is too large is cut by most of them: a set
        with either in it stays small. Sets are begun with each proposal that none of those before has in it.
        """
        left = {frame: self.shots[frame].within(_grown(mask)) for frame, mask in found.items()}
        masks = {frame: (self.cells[frame], self.cells[frame].of_mask(mask)) for frame, mask in found.items()}
        everything = np.ones(len(self.points), dtype=np.bool_)
        drawn_cut = {frame: self._cut(self.drawn_cells, everything, left[frame])[0] for frame in found}
        sound = sorted((f for f in found if drawn_cut[f] <= CUTS_NOTHING), key=lambda f: (-trust[f], drawn_cut[f], f))
        best = self._together(sound, masks, left)
        tried = set(best.accepted)
        for _ in range(MOST_SETS - 1):
            first = next((frame for frame in sound if frame not in tried), None)
            if first is None:
                break
            tried.add(first)
            other = self._together([first, *(frame for frame in sound if frame != first)], masks, left)
            tried.update(other.accepted)
            if sum(trust[frame] for frame in other.accepted) > sum(trust[frame] for frame in best.accepted):
                best = other
        return best

    def _together(
        self,
        sound: Sequence[int],
        masks: Mapping[int, Outline],
        left: Mapping[int, Bool[np.ndarray, "n"]],
    ) -> Agreement:
        """Take outlines in one by one, as long as they cut nothing of the drawn ones and of those taken in before."""
        kept = np.ones(len(self.points), dtype=np.bool_)
        shown = dict(self.drawn_cells)
        accepted: list[int] = []
        for frame in sound:
            after = kept & left[frame]
            own = {frame: masks[frame]}
            if max(self._cut(shown, kept, after)[0], self._cut(own, left[frame], after)[0]) <= CUTS_NOTHING:
                accepted.append(frame)
                kept = after
                shown[frame] = masks[frame]
        cuts = {frame: self._cut(shown, kept, kept & left[frame]) for frame in left if frame not in accepted}
        return Agreement(tuple(accepted), kept, {frame: left[frame] for frame in accepted}, cuts)

    def _cut(
        self,
        shown: Mapping[int, Outline],
        before: Bool[np.ndarray, "n"],
        after: Bool[np.ndarray, "n"],
    ) -> tuple[float, int]:
        """The largest share of an outline that would be lost, and its frame."""
        worst = (0.0, -1)
        gone = before & ~after
        for frame, (cells, mask) in shown.items():
            lost = cells.of_points(gone) & ~cells.of_points(after) & mask
            share = float(np.count_nonzero(lost) / max(1, np.count_nonzero(mask)))
            worst = max(worst, (share, frame))
        return worst

    def seen_by_others(self, agreement: Agreement, frame: int, mask: Bool[np.ndarray, "h w"]) -> float:
        """The share of a frame's outline that all other accepted outlines leave."""
        cells = self.cells[frame]
        own = cells.of_mask(mask)
        others = cells.of_points(self.left_by_others(agreement, frame))
        return float(np.count_nonzero(own & others) / max(1, np.count_nonzero(own)))


def _grown(mask: Bool[np.ndarray, "h w"]) -> Bool[np.ndarray, "h w"]:
    return cv2.dilate(mask.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
