"""An evaluation as a record for JSON: all its numbers, curves at 101 recalls, per image what was wrong."""

from dataclasses import asdict

import numpy as np

from ars_web.evaluation.mistakes import images_by_mistakes
from ars_web.evaluation.precision_recall import BestScore
from ars_web.evaluation.scores import Counts, DetectorScore, Evaluation


def evaluation_record(evaluation: Evaluation) -> dict[str, object]:
    """The whole of it; numbers that are not defined are null."""
    truth = evaluation.truth
    return {
        "truth": {
            "source": truth.source,
            "format": truth.format,
            "split": truth.split,
            "images": len(truth.images),
            "labels": int((~truth.ignored).sum()),
            "ignored": int(truth.ignored.sum()),
            "classes": list(truth.classes),
            "in_pixels": truth.in_pixels,
        },
        "iou": evaluation.iou,
        "recalls": [place / 100 for place in range(101)],
        "detectors": [_detector(evaluation, one) for one in evaluation.detectors],
        "warnings": list(evaluation.warnings),
    }


def _detector(evaluation: Evaluation, one: DetectorScore) -> dict[str, object]:
    found = one.predictions
    return {
        "name": found.name,
        "source": found.source,
        "format": found.format,
        "predictions": len(found.bbox),
        "average_precision": asdict(one.averages),
        "coco": None if one.coco is None else asdict(one.coco),
        "best": _best(one.best),
        "counts": _counts(one.counts),
        "precision": _rounded(one.precision),
        "classes": [
            {
                "name": class_.name,
                "labels": class_.labels,
                "predictions": class_.predictions,
                "average_precision": asdict(class_.averages),
                "best": _best(class_.best),
                "counts": _counts(class_.counts),
                "precision": _rounded(class_.precision),
                "scores": _rounded(class_.scores),
            }
            for class_ in one.classes
        ],
        "confusion": one.confusion.tolist(),
        "images": [
            {"name": evaluation.truth.images[image.image].name, "tp": image.tp, "fp": image.fp, "fn": image.fn}
            for image in images_by_mistakes(evaluation.truth, one)
        ],
    }


def _best(best: BestScore) -> dict[str, float | None]:
    return {"score": best.score if np.isfinite(best.score) else None, "f1": best.f1}


def _counts(counts: Counts) -> dict[str, float | None]:
    return {
        **asdict(counts),
        "precision": counts.precision,
        "recall": counts.recall,
        "f1": counts.f1,
    }


def _rounded(values: np.ndarray | None) -> list[float] | None:
    return None if values is None else [round(float(value), 6) for value in values]
