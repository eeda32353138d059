"""COCO's twelve numbers, by pycocotools."""

from contextlib import redirect_stdout
from dataclasses import dataclass
from io import StringIO
from typing import Any

import numpy as np

from ars_web.evaluation.detections import Predictions, Truth

BEYOND_ALL = 1e11
"""An area that pycocotools has no range for: a label of it is ignored without being a crowd."""


@dataclass(frozen=True)
class CocoNumbers:
    """What COCOeval.summarize prints; None where it prints -1: no label is of that size, or no size is known.

    Attributes:
        ap, ap_50, ap_75: average precision at 0.5:0.95, at 0.5, at 0.75.
        ap_small, ap_medium, ap_large: of labels below 32 x 32 pixels, up to 96 x 96, beyond.
        ar_1, ar_10, ar_100: average recall with so many predictions an image.
        ar_small, ar_medium, ar_large: with 100.
    """

    ap: float | None
    ap_50: float | None
    ap_75: float | None
    ap_small: float | None
    ap_medium: float | None
    ap_large: float | None
    ar_1: float | None
    ar_10: float | None
    ar_100: float | None
    ar_small: float | None
    ar_medium: float | None
    ar_large: float | None


def coco_numbers(truth: Truth, found: Predictions) -> CocoNumbers:
    """What pycocotools makes of labels and predictions.

    Crowds are crowds to it; of other ignored labels each excuses one prediction.
    """
    from pycocotools.cocoeval import COCOeval

    # It prints how long it took, and the table.
    with redirect_stdout(StringIO()):
        evaluation: Any = COCOeval(_as_coco(truth, _labels(truth)), _as_coco(truth, _found(found)), "bbox")
        evaluation.evaluate()
        evaluation.accumulate()
        evaluation.summarize()
    numbers = [None if value < 0 else float(value) for value in evaluation.stats]
    if not truth.in_pixels:
        numbers[3:6] = numbers[9:12] = [None] * 3
    return CocoNumbers(*numbers)


def _as_coco(truth: Truth, annotations: list[dict[str, object]]) -> Any:
    from pycocotools.coco import COCO

    made: Any = COCO()
    made.dataset = {
        "images": [{"id": place} for place in range(len(truth.images))],
        "categories": [{"id": place, "name": name} for place, name in enumerate(truth.classes)],
        "annotations": annotations,
    }
    made.createIndex()
    return made


def _labels(truth: Truth) -> list[dict[str, object]]:
    area = np.where(truth.ignored & ~truth.crowd, BEYOND_ALL, truth.area)
    rows = zip(
        _with_sides(truth.bbox),
        truth.image.tolist(),
        truth.class_.tolist(),
        area.tolist(),
        truth.crowd.tolist(),
        strict=True,
    )
    # Ids begin at 1: 0 is what pycocotools calls no match.
    return [
        {"id": i, "image_id": image, "category_id": class_, "bbox": bbox, "area": size, "iscrowd": int(crowd)}
        for i, (bbox, image, class_, size, crowd) in enumerate(rows, start=1)
    ]


def _found(found: Predictions) -> list[dict[str, object]]:
    boxes = _with_sides(found.bbox)
    rows = zip(boxes, found.image.tolist(), found.class_.tolist(), found.score.tolist(), strict=True)
    return [
        {
            "id": i,
            "image_id": image,
            "category_id": class_,
            "bbox": bbox,
            "area": bbox[2] * bbox[3],
            "iscrowd": 0,
            "score": score,
        }
        for i, (bbox, image, class_, score) in enumerate(rows, start=1)
    ]


def _with_sides(bbox: np.ndarray) -> list[list[float]]:
    return np.concatenate([bbox[:, :2], bbox[:, 2:] - bbox[:, :2]], axis=1).tolist()
