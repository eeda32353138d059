"""Which rectangle of one list is which of another: one to one, by how far they share their area."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.optimize import linear_sum_assignment

from ars_web.geometry.rectangle_overlap import pairwise_iou


@dataclass(frozen=True, eq=False)
class Rectangles:
    """Rectangles in frames.

    Attributes:
        frame: (n,) the frame of each.
        kind: (n,) a number for its class.
        bbox: (n, 4) x0, y0, x1, y1, image coordinates.
    """

    frame: Int[np.ndarray, "n"]
    kind: Int[np.ndarray, "n"]
    bbox: Float[np.ndarray, "n 4"]

    def __len__(self) -> int:
        return len(self.frame)


@dataclass(frozen=True, eq=False)
class Pairs:
    """m pairs, no rectangle in two of them.

    Attributes:
        first, second: (m,) rows of the two lists, ascending in the first.
        iou: (m,) intersection over union.
    """

    first: Int[np.ndarray, "m"]
    second: Int[np.ndarray, "m"]
    iou: Float[np.ndarray, "m"]


def matched_pairs(first: Rectangles, second: Rectangles, *, iou: float) -> Pairs:
    """Pairs of one frame and one class: those whose IoU is `iou` or more and whose IoUs have the largest sum.

    It is the optimal assignment (Hungarian method), so no pair depends on the order of the lists, and a rectangle may
    go to its second best where that leaves its best for another that has no second.
    """
    return _assigned(first, second, _common(_keys(first.frame, first.kind), _keys(second.frame, second.kind)), iou=iou)


def pairs_of_any_class(
    first: Rectangles,
    second: Rectangles,
    *,
    iou: float,
    among_first: Bool[np.ndarray, "n"],
    among_second: Bool[np.ndarray, "m"],
) -> Pairs:
    """The same of one frame whatever the classes, among some of the rectangles: one object, perhaps, by two names."""
    frames = first.frame.astype(np.int64), second.frame.astype(np.int64)
    keys = np.where(among_first, frames[0], -1), np.where(among_second, frames[1], -2)
    return _assigned(first, second, _common(*keys), iou=iou)


def _keys(frame: Int[np.ndarray, "n"], kind: Int[np.ndarray, "n"]) -> Int[np.ndarray, "n"]:
    return frame.astype(np.int64) << 32 | kind.astype(np.int64)


def _common(
    first: Int[np.ndarray, "n"], second: Int[np.ndarray, "m"]
) -> Iterator[tuple[Int[np.ndarray, "k"], Int[np.ndarray, "l"]]]:
    """For each key that both lists have, its rows in either."""
    groups = _rows_by_key(second)
    for key, rows in _rows_by_key(first).items():
        if key in groups:
            yield rows, groups[key]


def _rows_by_key(keys: Int[np.ndarray, "n"]) -> dict[int, Int[np.ndarray, "k"]]:
    order = np.argsort(keys, kind="stable")
    found, starts = np.unique(keys[order], return_index=True)
    return dict(zip(found.tolist(), np.split(order, starts[1:]), strict=True)) if len(keys) else {}


def _assigned(
    first: Rectangles,
    second: Rectangles,
    groups: Iterator[tuple[Int[np.ndarray, "k"], Int[np.ndarray, "l"]]],
    *,
    iou: float,
) -> Pairs:
    pairs: list[tuple[int, int, float]] = []
    for ours, theirs in groups:
        overlaps = pairwise_iou(first.bbox[ours], second.bbox[theirs])
        # A pair below the threshold is worth nothing, so that it keeps no other from its partner.
        worth = np.where(overlaps >= iou, overlaps, 0.0)
        for i, j in zip(*(side.tolist() for side in linear_sum_assignment(worth, maximize=True)), strict=True):
            if worth[i, j] > 0:
                pairs.append((int(ours[i]), int(theirs[j]), float(worth[i, j])))
    pairs.sort()
    columns = np.array(pairs, dtype=np.float64).reshape(-1, 3)
    return Pairs(columns[:, 0].astype(np.int64), columns[:, 1].astype(np.int64), columns[:, 2])
