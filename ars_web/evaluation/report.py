"""An evaluation as a page, with its plots and pictures inside."""

from dataclasses import dataclass
from pathlib import Path

from ars_web.evaluation import plots
from ars_web.evaluation.pictures import COLOURS, Picture, worst_pictures
from ars_web.evaluation.scores import DetectorScore, Evaluation
from ars_web.evaluation.tables import classes_table, coco_table, counts_table, means_table, shown
from ars_web.reporting.page import data_uri, report_page, write_page

PAGE = "report.html"

MOST_CLASSES = 24
"""Classes that have a confusion matrix; of more the largest confusions are listed."""

_LISTED = 30
_NOTHING = "nothing"
_MISSED = "missed"


@dataclass(frozen=True)
class _Cell:
    """A number of a confusion matrix; `share` of its row tints it."""

    count: int
    share: float
    right: bool


@dataclass(frozen=True)
class _Part:
    """What the page says of one detector."""

    name: str
    classes: object
    matrix: tuple[tuple[str, tuple[_Cell, ...]], ...]
    confusions: tuple[tuple[str, str, str], ...]
    pictures: tuple[tuple[Picture, str | None], ...]


def write_report(evaluation: Evaluation, out: Path) -> dict[Path, str]:
    """Write the page to `out`, a `.html` file or a folder, which gets the plots beside it, too.

    Answers the files that were written, each with what it holds.

    Raises:
        OSError: one cannot be written.
    """
    drawn = {
        "pr.png": plots.curves(evaluation),
        "pr-classes.png": plots.class_curves(evaluation),
        "classes.png": plots.class_bars(evaluation),
    }
    if evaluation.truth.in_pixels:
        drawn["sizes.png"] = plots.missed_sizes(evaluation)
    page = _page(evaluation, drawn)
    if out.suffix.lower() == ".html":
        write_page(page, out)
        return {out: "the report"}
    write_page(page, out / PAGE)
    for name, content in drawn.items():
        (out / name).write_bytes(content)
    return {out / PAGE: "the report", **{out / name: "a plot" for name in drawn}}


def _page(evaluation: Evaluation, drawn: dict[str, bytes]) -> str:
    truth = evaluation.truth
    first = evaluation.detectors[0]
    labels = int((~truth.ignored).sum())
    best = max(evaluation.detectors, key=lambda one: one.averages.at_iou or 0.0)
    return report_page(
        "evaluation.html",
        truth=truth,
        iou=f"{evaluation.iou:g}",
        names=[one.name for one in evaluation.detectors],
        tiles=[
            (str(len(truth.images)), "images"),
            (str(labels), "labels"),
            (str(sum(one.labels > 0 for one in first.classes)), "classes labelled"),
            (shown(best.averages.at_iou), f"mAP at IoU {evaluation.iou:g}" + _of(evaluation, best)),
            (shown(best.averages.coco), "mAP at 0.5:0.95" + _of(evaluation, best)),
            (shown(best.counts.mean_iou), "mean IoU of right predictions" + _of(evaluation, best)),
        ],
        warnings=evaluation.warnings,
        tables=[
            table for table in (means_table(evaluation), counts_table(evaluation), coco_table(evaluation)) if table
        ],
        plots={name.removesuffix(".png"): data_uri(content, media_type="image/png") for name, content in drawn.items()},
        panels=plots.MOST_PANELS,
        classes=truth.classes,
        colours=COLOURS,
        parts=[_part(evaluation, one) for one in evaluation.detectors],
        missed=_MISSED,
    )


def _of(evaluation: Evaluation, best: DetectorScore) -> str:
    return f", {best.name}" if len(evaluation.detectors) > 1 else ""


def _part(evaluation: Evaluation, detector: DetectorScore) -> _Part:
    classes = evaluation.truth.classes
    few = len(classes) <= MOST_CLASSES
    return _Part(
        detector.name,
        classes_table(evaluation, detector),
        _matrix(detector, classes) if few else (),
        _largest(detector, classes),
        tuple(
            (picture, None if picture.jpeg is None else data_uri(picture.jpeg, media_type="image/jpeg"))
            for picture in worst_pictures(evaluation, detector)
        ),
    )


def _matrix(detector: DetectorScore, classes: tuple[str, ...]) -> tuple[tuple[str, tuple[_Cell, ...]], ...]:
    rows: list[tuple[str, tuple[_Cell, ...]]] = []
    for i, (name, row) in enumerate(zip((*classes, _NOTHING), detector.confusion.tolist(), strict=True)):
        total = max(sum(row), 1)
        rows.append((name, tuple(_Cell(count, round(count / total, 3), i == j) for j, count in enumerate(row))))
    return tuple(rows)


def _largest(detector: DetectorScore, classes: tuple[str, ...]) -> tuple[tuple[str, str, str], ...]:
    """Labels of one class that were taken for another, the most frequent first."""
    pairs = [
        (count, classes[i], classes[j])
        for i, row in enumerate(detector.confusion.tolist()[:-1])
        for j, count in enumerate(row[:-1])
        if i != j and count
    ]
    pairs.sort(key=lambda pair: -pair[0])
    return tuple((label, taken, str(count)) for count, label, taken in pairs[:_LISTED])
