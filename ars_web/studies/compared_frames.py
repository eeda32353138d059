"""How far manual and automatic labels agree frame by frame, and what is in the frames that agree least."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float

from ars_web.studies.agreement import Matches
from ars_web.studies.rectangle_matching import Rectangles


@dataclass(frozen=True)
class ComparedFrame:
    """One frame, by the rectangles in the image.

    Attributes:
        index, name: of the frame.
        manual, automatic, matched: labels of the compared classes, and pairs.
        mean_iou: of the pairs; None where there is none.
        agreement: sum of the pairs' IoUs over pairs and labels without a partner, 0 to 1; 1 where there are no labels.
    """

    index: int
    name: str
    manual: int
    automatic: int
    matched: int
    mean_iou: float | None
    agreement: float


@dataclass(frozen=True)
class ComparedLabel:
    """One label of a frame that is shown.

    Attributes:
        by: who made it.
        class_name: of its class, as the session calls it.
        bbox: x0, y0, x1, y1, image coordinates; of an automatic label in the image.
        visible_bbox: of an automatic label round what is seen; None where nothing is, and of manual ones.
        iou: with its partner; None: it has none.
        other_class: of a label without a partner: of one of another class that lies where it does; None: none does.
        counts: whether its class is one that is compared.
    """

    by: Literal["hand", "program"]
    class_name: str
    bbox: tuple[float, float, float, float]
    visible_bbox: tuple[float, float, float, float] | None
    iou: float | None
    other_class: str | None
    counts: bool


@dataclass(frozen=True)
class WorstFrame:
    """A frame with its labels."""

    frame: ComparedFrame
    labels: tuple[ComparedLabel, ...]


@dataclass(frozen=True, eq=False)
class Sides:
    """Both sides' labels and what was matched.

    Attributes:
        manual, automatic: the labels; of automatic ones the rectangles in the image.
        visible: (m, 4) of the automatic ones round what is seen; NaN where nothing is.
        found: of them, first manual, second automatic.
        manual_counts, automatic_counts: which labels are of a compared class.
        names: of the classes, by `kind`.
    """

    manual: Rectangles
    automatic: Rectangles
    visible: Float[np.ndarray, "m 4"]
    found: Matches
    manual_counts: Bool[np.ndarray, "n"]
    automatic_counts: Bool[np.ndarray, "m"]
    names: tuple[str, ...]


def compared_frames(sides: Sides, indices: Sequence[int], frame_names: Sequence[str]) -> list[ComparedFrame]:
    """The frames at `indices` (ascending), whose names are among `frame_names` by index."""
    rows, pairs = np.asarray(indices, dtype=np.int64), sides.found.pairs

    def of(frames: np.ndarray, weights: np.ndarray | None = None) -> np.ndarray:
        return np.bincount(np.searchsorted(rows, frames), weights, minlength=len(indices))

    manual = of(sides.manual.frame[sides.manual_counts])
    automatic = of(sides.automatic.frame[sides.automatic_counts])
    matched = of(sides.manual.frame[pairs.first])
    overlap = of(sides.manual.frame[pairs.first], pairs.iou)
    labels = manual + automatic - matched
    return [
        ComparedFrame(
            index=index,
            name=frame_names[index],
            manual=int(manual[i]),
            automatic=int(automatic[i]),
            matched=int(matched[i]),
            mean_iou=float(overlap[i] / matched[i]) if matched[i] else None,
            agreement=float(overlap[i] / labels[i]) if labels[i] else 1.0,
        )
        for i, index in enumerate(indices)
    ]


def worst_frames(sides: Sides, frames: Sequence[ComparedFrame], *, count: int) -> tuple[WorstFrame, ...]:
    """Those of the frames that agree least, the worst first; none that agrees wholly."""
    chosen = sorted((frame for frame in frames if frame.agreement < 1), key=lambda one: (one.agreement, one.index))
    return tuple(WorstFrame(frame, tuple(_labels(sides, frame.index))) for frame in chosen[:count])


def _labels(sides: Sides, index: int) -> list[ComparedLabel]:
    pairs, confused = sides.found.pairs, sides.found.confused
    iou = dict(zip(pairs.first.tolist(), pairs.iou.tolist(), strict=True))
    other = dict(zip(confused.first.tolist(), sides.automatic.kind[confused.second].tolist(), strict=True))
    labels: list[ComparedLabel] = []
    for row in np.flatnonzero(sides.manual.frame == index).tolist():
        labels.append(
            ComparedLabel(
                by="hand",
                class_name=sides.names[sides.manual.kind[row]],
                bbox=_four(sides.manual.bbox[row]),
                visible_bbox=None,
                iou=iou.get(row),
                other_class=sides.names[other[row]] if row in other else None,
                counts=bool(sides.manual_counts[row]),
            )
        )
    iou = dict(zip(pairs.second.tolist(), pairs.iou.tolist(), strict=True))
    other = dict(zip(confused.second.tolist(), sides.manual.kind[confused.first].tolist(), strict=True))
    for row in np.flatnonzero(sides.automatic.frame == index).tolist():
        seen = sides.visible[row]
        labels.append(
            ComparedLabel(
                by="program",
                class_name=sides.names[sides.automatic.kind[row]],
                bbox=_four(sides.automatic.bbox[row]),
                visible_bbox=None if np.isnan(seen[0]) else _four(seen),
                iou=iou.get(row),
                other_class=sides.names[other[row]] if row in other else None,
                counts=bool(sides.automatic_counts[row]),
            )
        )
    return labels


def _four(bbox: Float[np.ndarray, "4"]) -> tuple[float, float, float, float]:
    x0, y0, x1, y1 = bbox.tolist()
    return x0, y0, x1, y1
