"""Where a detector goes wrong: image by image, and by the size of what it misses."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from ars_web.evaluation.detections import Truth
from ars_web.evaluation.scores import DetectorScore


@dataclass(frozen=True)
class ImageMistakes:
    """What is right and wrong in one image, of the predictions that are kept.

    Attributes:
        image: its place in the truth's.
        tp, fp, fn: right predictions, wrong ones, labels that none found.
    """

    image: int
    tp: int
    fp: int
    fn: int


@dataclass(frozen=True, eq=False)
class Sizes:
    """How many labels of each size were found and missed.

    Attributes:
        edges: (b + 1,) of the root of their area, pixels: each sqrt(2) times the last.
        found, missed: (b,).
    """

    edges: Float[np.ndarray, " b1"]
    found: Int[np.ndarray, " b"]
    missed: Int[np.ndarray, " b"]


def images_by_mistakes(truth: Truth, detector: DetectorScore) -> list[ImageMistakes]:
    """All images, those with the most mistakes first, then those with the least right, then in their order."""
    count = len(truth.images)

    def each(image: np.ndarray, counted: np.ndarray) -> np.ndarray:
        return np.bincount(image[counted], minlength=count)

    found = detector.predictions
    tp = each(found.image, detector.kept & detector.matches.right)
    fp = each(found.image, detector.kept & detector.matches.wrong)
    fn = each(truth.image, ~truth.ignored & ~detector.is_found)
    order = np.lexsort((tp, -(fp + fn)))
    return [ImageMistakes(i, int(tp[i]), int(fp[i]), int(fn[i])) for i in order.tolist()]


def sizes(truth: Truth, detector: DetectorScore) -> Sizes:
    """Labels by the root of the area of their rectangle."""
    counted = ~truth.ignored
    side = np.sqrt((truth.bbox[:, 2:] - truth.bbox[:, :2]).prod(axis=1))[counted]
    steps = np.floor(2 * np.log2(np.maximum(side, 1.0))).astype(np.int64)
    first, last = int(steps.min()), int(steps.max())
    is_found = detector.is_found[counted]

    def each(rows: np.ndarray) -> np.ndarray:
        return np.bincount(steps[rows] - first, minlength=last - first + 1)

    return Sizes(2.0 ** (np.arange(first, last + 2) / 2), each(is_found), each(~is_found))
