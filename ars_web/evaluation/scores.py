"""How well detectors did, as records; a number that is not defined is None."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from ars_web.evaluation.coco_numbers import CocoNumbers
from ars_web.evaluation.detections import Predictions, Truth
from ars_web.evaluation.matching import Matches
from ars_web.evaluation.precision_recall import BestScore


@dataclass(frozen=True)
class Averages:
    """Average precision: of a class, or the mean over the classes that are labelled.

    Attributes:
        coco: at 0.5:0.95, COCO's.
        at_30, at_50, at_75, at_iou: at 0.3, 0.5, 0.75 and at the asked threshold, COCO's.
        voc_50, voc07_50: at 0.5, VOC's since 2010 and of 2007.
    """

    coco: float | None
    at_30: float | None
    at_50: float | None
    at_75: float | None
    at_iou: float | None
    voc_50: float | None
    voc07_50: float | None


@dataclass(frozen=True)
class Counts:
    """What is right and wrong among the predictions that are kept, at the asked threshold.

    Attributes:
        tp, fp, fn: right predictions, wrong ones, labels that none found.
        mean_iou: of right predictions with what they found; None: none is right.
    """

    tp: int
    fp: int
    fn: int
    mean_iou: float | None

    @property
    def precision(self) -> float | None:
        """TP / (TP + FP); None where nothing is kept."""
        return self.tp / (self.tp + self.fp) if self.tp + self.fp else None

    @property
    def recall(self) -> float | None:
        """TP / (TP + FN); None where nothing is labelled."""
        return self.tp / (self.tp + self.fn) if self.tp + self.fn else None

    @property
    def f1(self) -> float | None:
        """2 TP / (2 TP + FP + FN); None where there is nothing at all."""
        total = 2 * self.tp + self.fp + self.fn
        return 2 * self.tp / total if total else None


@dataclass(frozen=True, eq=False)
class ClassScore:
    """How well one class was found.

    Attributes:
        name: the class's.
        labels: that can be found; 0: never labelled, and no average is defined.
        predictions: of any score.
        averages: its average precisions.
        best: the score that is best for this class alone.
        counts: at the detector's score, which is one for all classes.
        precision: (101,) at recalls 0, 0.01, … 1, at the asked threshold, COCO's; None where nothing is labelled.
        scores: (101,) that reach those recalls, 0 where none does; None likewise.
    """

    name: str
    labels: int
    predictions: int
    averages: Averages
    best: BestScore
    counts: Counts
    precision: Float[np.ndarray, "101"] | None
    scores: Float[np.ndarray, "101"] | None


@dataclass(frozen=True, eq=False)
class DetectorScore:
    """How well one detector did.

    Attributes:
        predictions: what was scored.
        coco: by pycocotools; None: not asked for.
        averages: means over the classes that are labelled.
        best: the score from which on predictions are kept, best for all classes together.
        counts: at that score, of all classes.
        classes: as the truth's.
        precision: (101,) the mean of the classes' curves.
        confusion: (c + 1, c + 1) kept predictions by the class of what they overlap (rows, the last: nothing) and their
            own (columns, the last: labels that nothing found). The diagonal holds what is right.
        matches: at the asked threshold, of all predictions.
        kept: (d,) predictions of that score or above.
        is_found: (n,) labels that a kept prediction of their class finds.
    """

    predictions: Predictions
    coco: CocoNumbers | None
    averages: Averages
    best: BestScore
    counts: Counts
    classes: tuple[ClassScore, ...]
    precision: Float[np.ndarray, "101"]
    confusion: Int[np.ndarray, "c1 c1"]
    matches: Matches
    kept: Bool[np.ndarray, " d"]
    is_found: Bool[np.ndarray, " n"]

    @property
    def name(self) -> str:
        return self.predictions.name


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Detectors side by side on one truth.

    Attributes:
        iou: the asked threshold.
    """

    truth: Truth
    iou: float
    detectors: tuple[DetectorScore, ...]

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is odd in what was scored."""
        never = [one.name for one in self.detectors[0].classes if one.labels == 0]
        said = (
            f"{self.truth.source}: no image shows {', '.join(never)}; AP is not defined there, and in no mean"
            if never
            else ""
        )
        return (
            *self.truth.warnings,
            *filter(None, [said]),
            *(w for one in self.detectors for w in one.predictions.warnings),
        )
