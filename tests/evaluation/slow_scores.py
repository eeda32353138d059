"""The slow, readable oracle: COCO's and VOC's scoring, one prediction after another."""

import numpy as np

from ars_web.evaluation.detections import Predictions, Truth


def overlap(a: np.ndarray, b: np.ndarray, *, crowd: bool = False) -> float:
    """Intersection over union of two rectangles; of a crowd, over the prediction `a` alone."""
    w = min(a[2], b[2]) - max(a[0], b[0])
    h = min(a[3], b[3]) - max(a[1], b[1])
    if w <= 0 or h <= 0:
        return 0.0
    area_a, area_b = ((r[2] - r[0]) * (r[3] - r[1]) for r in (a, b))
    return w * h / (area_a if crowd else area_a + area_b - w * h)


def coco_outcomes(truth: Truth, found: Predictions, class_: int, threshold: float) -> list[tuple[float, bool]]:
    """Score and whether it is right of each prediction that counts, image by image."""
    outcomes: list[tuple[float, bool]] = []
    for image in range(len(truth.images)):
        labels = [i for i in range(len(truth.bbox)) if truth.image[i] == image and truth.class_[i] == class_]
        free = set(labels)
        rows = [i for i in range(len(found.bbox)) if found.image[i] == image and found.class_[i] == class_]
        for row in sorted(rows, key=lambda i: -found.score[i])[:100]:
            # Labels that count come first: an ignored one is taken only where none of those is free.
            for ignored in (False, True):
                near = [
                    (overlap(found.bbox[row], truth.bbox[i], crowd=bool(truth.crowd[i])), i)
                    for i in labels
                    if truth.ignored[i] == ignored and (i in free or truth.crowd[i])
                ]
                near = [(shared, i) for shared, i in near if shared >= min(threshold, 1 - 1e-10)]
                if near:
                    free.discard(max(near)[1])
                    if not ignored:
                        outcomes.append((float(found.score[row]), True))
                    break
            else:
                outcomes.append((float(found.score[row]), False))
    return outcomes


def voc_outcomes(truth: Truth, found: Predictions, class_: int, threshold: float) -> list[tuple[float, bool]]:
    """The same by VOC's rule, through all images at once."""
    outcomes: list[tuple[float, bool]] = []
    taken: set[int] = set()
    rows = [i for i in range(len(found.bbox)) if found.class_[i] == class_]
    for row in sorted(rows, key=lambda i: -found.score[i]):
        labels = np.flatnonzero((truth.image == found.image[row]) & (truth.class_ == class_))
        shared = [overlap(found.bbox[row], truth.bbox[i]) for i in labels]
        best = labels[int(np.argmax(shared))] if shared else -1
        if best < 0 or max(shared) < threshold:
            outcomes.append((float(found.score[row]), False))
        elif not truth.ignored[best]:
            outcomes.append((float(found.score[row]), best not in taken))
            taken.add(int(best))
    return outcomes


def average_precision(outcomes: list[tuple[float, bool]], labels: int, recalls: list[float] | None) -> float:
    """The mean of the best precision at each recall or beyond; None: at every recall there is."""
    points: list[tuple[int, float]] = []
    right = 0
    for count, (_, is_right) in enumerate(sorted(outcomes, key=lambda outcome: -outcome[0]), start=1):
        right += is_right
        points.append((right, right / count))

    def best(at_least: float) -> float:
        return max((precision for found, precision in points if found / labels >= at_least), default=0.0)

    if recalls is not None:
        return sum(map(best, recalls)) / len(recalls)
    # Each label found is a step of one label's width under the curve.
    return sum(max((p for found, p in points if found >= i), default=0.0) for i in range(1, labels + 1)) / labels
