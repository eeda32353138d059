"""Detectors scored on one truth."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int

from ars_web.errors import BadInput
from ars_web.evaluation import precision_recall
from ars_web.evaluation.coco_numbers import coco_numbers
from ars_web.evaluation.confusion import confusion
from ars_web.evaluation.detections import Predictions, Truth, check_predictions, check_truth
from ars_web.evaluation.matching import Matches, coco_matches, grouped, voc_matches
from ars_web.evaluation.precision_recall import BestScore, Curve
from ars_web.evaluation.scores import Averages, ClassScore, Counts, DetectorScore, Evaluation

COCO_THRESHOLDS = np.linspace(0.5, 0.95, 10)
"""0.5:0.95, digit by digit as pycocotools has them."""

LOW = 0.3
HIGH = 0.75
USUAL = 0.5


def evaluate(truth: Truth, detectors: Sequence[Predictions], *, iou: float = USUAL, coco: bool = True) -> Evaluation:
    """Score what detectors found.

    Args:
        iou: the overlap from which on a prediction is right, of curves, counts and confusions.
        coco: whether to have COCO's twelve numbers by pycocotools, which takes ten times as long as all the rest.

    Raises:
        BadInput: the truth or a detector's predictions cannot be scored (`check_truth`, `check_predictions`), no
            detector is given, two have one name, or `iou` is not within (0, 1].
    """
    if not 0 < iou <= 1:
        raise BadInput(f"iou must be above 0 and at most 1, not {iou:g}")
    if not detectors:
        raise BadInput("there are no predictions to score")
    names = [one.name for one in detectors]
    if len(set(names)) != len(names):
        raise BadInput(f"two detectors are called {max(names, key=names.count)!r}; name them apart, as NAME=FILE")
    check_truth(truth)
    for one in detectors:
        check_predictions(one, truth)
    return Evaluation(truth, iou, tuple(_score(truth, one, iou, coco) for one in detectors))


def _score(truth: Truth, found: Predictions, iou: float, coco: bool) -> DetectorScore:
    groups = grouped(truth, found)
    thresholds = np.array([LOW, iou, *COCO_THRESHOLDS])
    by_coco = coco_matches(truth, groups, thresholds=thresholds)
    by_voc = voc_matches(truth, groups, thresholds=np.array([USUAL]))[0]
    asked = by_coco[1]
    labels = np.bincount(truth.class_[~truth.ignored], minlength=len(truth.classes))
    everything = precision_recall.curve(found.score, asked.right, asked.wrong, int(labels.sum()))
    best = precision_recall.best_score(everything)
    kept = found.score >= best.score
    is_found = np.zeros(len(truth.bbox), dtype=np.bool_)
    is_found[asked.label[kept & asked.right]] = True
    # By image, and within one by score: so pycocotools breaks ties of scores.
    rows = np.split(groups.box, np.searchsorted(found.class_[groups.box], np.arange(1, len(truth.classes))))
    classes = tuple(
        _class_score(name, rows[place], found.score, int(labels[place]), by_coco, by_voc, kept)
        for place, name in enumerate(truth.classes)
    )
    curves = [one.precision for one in classes if one.precision is not None]
    return DetectorScore(
        predictions=found,
        coco=coco_numbers(truth, found) if coco else None,
        averages=_means([one.averages for one in classes if one.labels]),
        best=best,
        counts=_counts(asked, kept, int(labels.sum())),
        classes=classes,
        precision=np.mean(curves, axis=0),
        confusion=confusion(truth, found, asked, kept=kept, iou=iou),
        matches=asked,
        kept=kept,
        is_found=is_found,
    )


def _class_score(
    name: str,
    rows: Int[np.ndarray, " k"],
    scores: Float[np.ndarray, " d"],
    labels: int,
    by_coco: Sequence[Matches],
    by_voc: Matches,
    kept: Bool[np.ndarray, " d"],
) -> ClassScore:
    asked = by_coco[1]
    counts = _counts(asked, kept, labels, rows)
    if not labels:
        undefined = Averages(None, None, None, None, None, None, None)
        return ClassScore(name, 0, len(rows), undefined, BestScore(np.inf, 0.0), counts, None, None)

    def curve(matches: Matches, rows: Int[np.ndarray, " k"] = rows) -> Curve:
        return precision_recall.curve(scores[rows], matches.right[rows], matches.wrong[rows], labels)

    low, at_iou, *of_coco = (precision_recall.coco_ap(curve(matches)) for matches in by_coco)
    # VOC sorts a file's rows by score alone, so that of one score they stay as the file has them.
    voc = curve(by_voc, np.sort(rows))
    averages = Averages(
        coco=float(np.mean(of_coco)),
        at_30=low,
        at_50=of_coco[0],
        at_75=of_coco[5],
        at_iou=at_iou,
        voc_50=precision_recall.voc_ap(voc),
        voc07_50=precision_recall.voc07_ap(voc),
    )
    precision, reached = precision_recall.precision_at(curve(asked))
    best = precision_recall.best_score(curve(asked))
    return ClassScore(name, labels, len(rows), averages, best, counts, precision, reached)


def _means(of_classes: Sequence[Averages]) -> Averages:
    """Over classes, each of which has all its averages."""

    def mean(values: Sequence[float | None]) -> float:
        return float(np.mean([value for value in values if value is not None]))

    return Averages(
        coco=mean([one.coco for one in of_classes]),
        at_30=mean([one.at_30 for one in of_classes]),
        at_50=mean([one.at_50 for one in of_classes]),
        at_75=mean([one.at_75 for one in of_classes]),
        at_iou=mean([one.at_iou for one in of_classes]),
        voc_50=mean([one.voc_50 for one in of_classes]),
        voc07_50=mean([one.voc07_50 for one in of_classes]),
    )


def _counts(
    matches: Matches, kept: Bool[np.ndarray, " d"], labels: int, rows: Int[np.ndarray, " k"] | slice = slice(None)
) -> Counts:
    right = (kept & matches.right)[rows]
    tp = int(right.sum())
    overlap = matches.overlap[rows][right]
    return Counts(tp, int((kept & matches.wrong)[rows].sum()), labels - tp, float(overlap.mean()) if tp else None)
