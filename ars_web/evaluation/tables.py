"""An evaluation's numbers as tables of texts, the same in a terminal and in a report."""

from dataclasses import dataclass

from ars_web.evaluation.scores import Averages, Counts, DetectorScore, Evaluation

UNDEFINED = "-"


@dataclass(frozen=True)
class Table:
    """Rows of texts under the names of their columns.

    Attributes:
        texts: columns from the left that hold no numbers.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    texts: int = 1


def tables_of(evaluation: Evaluation) -> tuple[Table, ...]:
    """The means, the counts, COCO's numbers where there are any, and for each detector its classes."""
    coco = coco_table(evaluation)
    return (
        means_table(evaluation),
        counts_table(evaluation),
        *(() if coco is None else (coco,)),
        *(classes_table(evaluation, one) for one in evaluation.detectors),
    )


def means_table(evaluation: Evaluation) -> Table:
    """Mean average precision of each detector."""
    rows = tuple((one.name, *_averages(one.averages, evaluation.iou)) for one in evaluation.detectors)
    return Table("Mean average precision", ("detector", *_average_columns(evaluation.iou)), rows)


def counts_table(evaluation: Evaluation) -> Table:
    """What is right and wrong at each detector's score."""
    rows = tuple((one.name, shown(one.best.score), *_counts(one.counts)) for one in evaluation.detectors)
    title = f"At the score where F1 is highest, IoU {evaluation.iou:g}"
    return Table(title, ("detector", "score", *_COUNT_COLUMNS), rows)


def coco_table(evaluation: Evaluation) -> Table | None:
    """COCO's twelve numbers; None where none were asked for."""
    rows = [(one.name, *map(shown, vars(one.coco).values())) for one in evaluation.detectors if one.coco is not None]
    columns = (
        "detector",
        *(f"AP{of}" for of in ("", " 0.5", " 0.75", " small", " medium", " large")),
        *(f"AR{of}" for of in (" 1", " 10", " 100", " small", " medium", " large")),
    )
    return Table("COCO's numbers, by pycocotools", columns, tuple(rows)) if rows else None


def classes_table(evaluation: Evaluation, detector: DetectorScore) -> Table:
    """A detector's classes."""
    rows = tuple(
        (
            one.name,
            str(one.labels),
            str(one.predictions),
            *_averages(one.averages, evaluation.iou),
            *_counts(one.counts),
            shown(one.best.score) if one.labels else UNDEFINED,
        )
        for one in detector.classes
    )
    columns = ("class", "labels", "found", *_average_columns(evaluation.iou), *_COUNT_COLUMNS, "best score")
    title = f"{detector.name}: classes; counts at score {shown(detector.best.score)} and IoU {evaluation.iou:g}"
    return Table(title, columns, rows)


_COUNT_COLUMNS = ("precision", "recall", "F1", "TP", "FP", "FN", "mean IoU")


def shown(value: float | None) -> str:
    """A number of three digits; what is not defined as a dash."""
    return UNDEFINED if value is None or value == float("inf") else f"{value:.3f}"


def _average_columns(iou: float) -> tuple[str, ...]:
    own = () if iou in (0.3, 0.5, 0.75) else (f"AP {iou:g}",)
    return ("AP 0.5:0.95", "AP 0.3", "AP 0.5", "AP 0.75", *own, "VOC 0.5", "VOC07 0.5")


def _averages(averages: Averages, iou: float) -> tuple[str, ...]:
    own = () if iou in (0.3, 0.5, 0.75) else (averages.at_iou,)
    values = (averages.coco, averages.at_30, averages.at_50, averages.at_75, *own, averages.voc_50, averages.voc07_50)
    return tuple(map(shown, values))


def _counts(counts: Counts) -> tuple[str, ...]:
    shares = map(shown, (counts.precision, counts.recall, counts.f1))
    return (*shares, str(counts.tp), str(counts.fp), str(counts.fn), shown(counts.mean_iou))
