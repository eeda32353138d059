"""Curves of precision over recall, and the area under them as COCO, VOC and VOC2007 have it."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

RECALLS = np.linspace(0.0, 1.0, 101)
"""At which COCO looks at a curve."""

VOC07_RECALLS = np.arange(11) / 10
"""At which VOC2007 does: the doubles next to 0, 0.1, … 1, so that 3 of 10 labels found are a recall of 0.3."""


@dataclass(frozen=True, eq=False)
class Curve:
    """Recall and precision after each prediction that counts, by falling score.

    Attributes:
        labels: that can be found.
        score: (k,) falling.
        right: (k,) whether each is right.
        recall, precision: (k,) of those up to it.
    """

    labels: int
    score: Float[np.ndarray, " k"]
    right: Bool[np.ndarray, " k"]
    recall: Float[np.ndarray, " k"]
    precision: Float[np.ndarray, " k"]


@dataclass(frozen=True)
class BestScore:
    """The score from which on predictions are kept, so that F1 is highest; of several the highest.

    Attributes:
        score: at least which a prediction is kept; infinite where none is right.
        f1: 2 TP / (2 TP + FP + FN).
    """

    score: float
    f1: float


def curve(
    score: Float[np.ndarray, " d"], right: Bool[np.ndarray, " d"], wrong: Bool[np.ndarray, " d"], labels: int
) -> Curve:
    """The curve of predictions, those that are neither right nor wrong left out; there must be a label to find."""
    counted = np.flatnonzero(right | wrong)
    order = counted[np.argsort(-score[counted], kind="stable")]
    is_right = right[order]
    tp = np.cumsum(is_right).astype(np.float64)
    fp = np.cumsum(~is_right).astype(np.float64)
    return Curve(labels, score[order], is_right, tp / labels, tp / (tp + fp))


def precision_at(
    given: Curve, recalls: Float[np.ndarray, " r"] = RECALLS
) -> tuple[Float[np.ndarray, " r"], Float[np.ndarray, " r"]]:
    """The highest precision at each recall or beyond, and the score that reaches the recall; 0 where none does."""
    highest = np.append(np.maximum.accumulate(given.precision[::-1])[::-1], 0.0)
    places = np.searchsorted(given.recall, recalls, side="left")
    return highest[places], np.append(given.score, 0.0)[places]


def coco_ap(given: Curve) -> float:
    """The mean of the precision at 101 recalls (COCOeval.accumulate of pycocotools)."""
    return float(precision_at(given)[0].mean())


def voc_ap(given: Curve) -> float:
    """The area under the curve made falling, as VOC has it since 2010 (VOCap.m of the development kit)."""
    recall = np.concatenate([[0.0], given.recall, [1.0]])
    precision = np.concatenate([given.precision, [0.0]])
    highest = np.maximum.accumulate(precision[::-1])[::-1]
    return float((np.diff(recall) * highest).sum())


def voc07_ap(given: Curve) -> float:
    """The mean of the precision at recalls 0, 0.1, … 1, as VOC had it up to 2009.

    Source: Everingham et al., The Pascal Visual Object Classes Challenge, IJCV 2010, section 4.2.
    """
    return float(precision_at(given, VOC07_RECALLS)[0].mean())


def best_score(given: Curve) -> BestScore:
    """Where F1 is highest; predictions of one score are kept or dropped together."""
    if not given.right.any():
        return BestScore(np.inf, 0.0)
    ends = np.append(np.diff(given.score) != 0, True)
    tp = np.cumsum(given.right)[ends]
    kept = np.arange(1, len(given.score) + 1)[ends]
    f1 = 2 * tp / (kept + given.labels)
    best = int(np.argmax(f1))
    return BestScore(float(given.score[ends][best]), float(f1[best]))
