"""How good predictions are, by COCO's measure: every figure of the study comes from here."""

import contextlib
import io
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

from examples.train_detector.predict import Result

IOUS = np.round(np.linspace(0.5, 0.95, 10), 2)


@dataclass(frozen=True)
class Scores:
    """Means over classes, 0 to 1.

    Attributes:
        ap50, ap75, ap: average precision at IoU 0.5, at 0.75, and the mean from 0.5 to 0.95.
        ap50_of_class: by name, at IoU 0.5.
        precision50: at IoU 0.5, at the recalls 0, 0.01, … 1.
    """

    ap50: float
    ap75: float
    ap: float
    ap50_of_class: dict[str, float]
    precision50: tuple[float, ...]


def score(truth: Path, results: Sequence[Result]) -> Scores:
    """The scores of predictions beside a COCO file of instances."""
    # pycocotools prints what it does.
    with contextlib.redirect_stdout(io.StringIO()):
        known = COCO()
        known.dataset = json.loads(truth.read_bytes())
        known.createIndex()
        found = COCO()
        found.dataset = {**known.dataset, "annotations": _annotations(results)}
        found.createIndex()
        evaluation = COCOeval(known, found, "bbox")
        evaluation.params.iouThrs = IOUS
        evaluation.params.areaRng = [[0, 1e10]]
        evaluation.params.areaRngLbl = ["all"]
        evaluation.evaluate()
        evaluation.accumulate()
    precision = evaluation.eval["precision"][..., 0, -1]  # IoUs, recalls, classes
    if not (precision > -1).all():
        raise ValueError(f"{truth}: a class has no object that is to be found")
    names = [known.cats[id_]["name"] for id_ in evaluation.params.catIds]
    at_75 = int(np.flatnonzero(IOUS == 0.75)[0])
    return Scores(
        ap50=float(precision[0].mean()),
        ap75=float(precision[at_75].mean()),
        ap=float(precision.mean()),
        ap50_of_class=dict(zip(names, precision[0].mean(axis=0).tolist(), strict=True)),
        precision50=tuple(precision[0].mean(axis=1).tolist()),
    )


def _annotations(results: Sequence[Result]) -> list[dict[str, object]]:
    return [
        {**one.model_dump(), "bbox": list(one.bbox), "id": i + 1, "iscrowd": 0, "area": one.bbox[2] * one.bbox[3]}
        for i, one in enumerate(results)
    ]
