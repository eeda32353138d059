"""Which classes are taken for which."""

import numpy as np
from jaxtyping import Bool, Int

from ars_web.evaluation.detections import Predictions, Truth
from ars_web.evaluation.matching import Matches
from ars_web.geometry.rectangle_overlap import pairwise_iou


def confusion(
    truth: Truth, found: Predictions, matches: Matches, *, kept: Bool[np.ndarray, " d"], iou: float
) -> Int[np.ndarray, "c1 c1"]:
    """Counts by the label's class (rows, the last: no label) and the prediction's (columns, the last: no prediction).

    What is right by its class stays so. Of what is left over, labels and predictions of an image that overlap by `iou`
    at least are pairs, the largest overlap first; what then remains is a miss, or a prediction of nothing.
    """
    classes = len(truth.classes)
    counts = np.zeros((classes + 1, classes + 1), dtype=np.int64)
    right = kept & matches.right
    np.add.at(counts, (found.class_[right], found.class_[right]), 1)
    free = ~truth.ignored
    free[matches.label[right]] = False
    lonely = kept & matches.wrong
    labels_of = _by_image(truth.image, np.flatnonzero(free))
    boxes_of = _by_image(found.image, np.flatnonzero(lonely))
    for image in sorted(labels_of.keys() & boxes_of.keys()):
        labels, boxes = labels_of[image], boxes_of[image]
        overlaps = pairwise_iou(truth.bbox[labels], found.bbox[boxes])
        # A label and a prediction of one class that overlap, but are not each other's, are a miss and a wrong one.
        overlaps[truth.class_[labels][:, None] == found.class_[boxes][None, :]] = 0
        while overlaps.size and overlaps.max() >= iou:
            i, j = np.unravel_index(int(overlaps.argmax()), overlaps.shape)
            counts[truth.class_[labels[i]], found.class_[boxes[j]]] += 1
            overlaps[i, :] = overlaps[:, j] = -1
            free[labels[i]] = lonely[boxes[j]] = False
    counts[classes, :classes] = np.bincount(found.class_[lonely], minlength=classes)
    counts[:classes, classes] = np.bincount(truth.class_[free], minlength=classes)
    return counts


def _by_image(image: Int[np.ndarray, " n"], rows: Int[np.ndarray, " k"]) -> dict[int, Int[np.ndarray, " j"]]:
    order = rows[np.argsort(image[rows], kind="stable")]
    images, starts = np.unique(image[order], return_index=True)
    return dict(zip(images.tolist(), np.split(order, starts[1:]), strict=True)) if len(order) else {}
