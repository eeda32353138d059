"""How good predictions are, by COCO's measure, as `ars-web evaluate` has it: all of the study's figures."""

from dataclasses import dataclass
from pathlib import Path

from ars_web.errors import BadInput
from ars_web.evaluation.prediction_reading import read_predictions
from ars_web.evaluation.scoring import evaluate
from ars_web.evaluation.truth_reading import read_truth


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


def score(truth: Path, predictions: Path) -> Scores:
    """The scores of COCO results beside a set that has every class.

    Raises:
        BadInput: a file cannot be used, or a class has no object that is to be found.
    """
    labels = read_truth(truth)
    (scored,) = evaluate(labels, [read_predictions(predictions, labels)], coco=False).detectors
    of_class = {one.name: _known(one.averages.at_50, truth, one.name) for one in scored.classes}
    averages = scored.averages
    return Scores(
        ap50=_known(averages.at_50, truth, "any class"),
        ap75=_known(averages.at_75, truth, "any class"),
        ap=_known(averages.coco, truth, "any class"),
        ap50_of_class=of_class,
        precision50=tuple(scored.precision.tolist()),
    )


def _known(value: float | None, truth: Path, what: str) -> float:
    if value is None:
        raise BadInput(f"{truth}: no image shows {what}, so that no precision of it is known; film more test images")
    return value
