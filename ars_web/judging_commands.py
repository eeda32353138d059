"""The commands of `ars-web` that judge labels: a session's beside a person's, a detector's beside true ones.

They stand beside the commands of `cli.py`, in no group.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ars_web import arguments as take
from ars_web.terminal import note, print_json, print_table, progress, write_json

if TYPE_CHECKING:
    from ars_web.evaluation.scores import Evaluation
    from ars_web.studies.compared_frames import ComparedFrame

LABEL_FORMATS = ("auto", "coco", "cvat", "voc", "yolo")
"""That hold what people draw in images."""

app = typer.Typer(rich_markup_mode=None)


@app.command()
def compare(
    session: take.Session,
    labels: Annotated[
        Path, typer.Option("--labels", metavar="DIR", help="Labels made by hand: a folder, or a COCO or CVAT file.")
    ],
    kind: Annotated[
        str, typer.Option("--format", metavar="FORMAT", help="Of the labels: auto, coco, cvat, voc or yolo.")
    ] = "auto",
    iou: Annotated[float, typer.Option("--iou", metavar="SHARE", help="From here on two labels may be a pair.")] = 0.3,
    classes: Annotated[
        str | None,
        typer.Option("--classes", metavar="MANUAL=SESSION,…", help="Classes that have another name in the session."),
    ] = None,
    shape: take.Shape = None,
    min_visible: take.MinVisible = None,
    max_truncated: take.MaxTruncated = None,
    min_area_px: take.MinArea = None,
    worst: Annotated[int, typer.Option("--worst", metavar="N", min=0, help="Frames that agree least, to show.")] = 12,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE.html", help="A report with pictures, in one file.")
    ] = None,
    sessions: take.Sessions = take.SESSIONS,
    as_json: take.Json = False,
) -> None:
    """Compare the session's labels with those that people made: the annotation study.

    Only frames that were labelled by hand are compared. Precision is the share of the session's labels that match one
    made by hand, recall the share of those made by hand that are matched, and mean IoU is over the matches. The
    session's labels are taken three times: round the whole object within the image, beyond its border, and round what
    is seen of it, since people do not draw what is hidden.
    """
    from ars_web.annotations.registry import read_labels
    from ars_web.reporting.page import write_page
    from ars_web.sessions.store import SessionStore
    from ars_web.studies import comparison_report as report
    from ars_web.studies.comparison import compare as compare_labels

    if kind not in LABEL_FORMATS:
        raise typer.BadParameter(f"{kind!r} is none of {', '.join(LABEL_FORMATS)}", param_hint="--format")
    names = _class_names(classes)
    given = {"shape": shape, "min_visible": min_visible, "max_truncated": max_truncated, "min_area_px": min_area_px}
    options = take.export_options(given)
    with SessionStore(sessions) as store:
        sid = store.find(session)
        snapshot, name = store.snapshot(sid), store.summary(sid).name
    by_hand = read_labels(labels, format=kind)
    with progress("Comparing") as advance:
        found = compare_labels(
            snapshot, by_hand, options=options, iou=iou, classes=names, worst=worst, progress=advance
        )
    if out is not None:
        write_page(report.comparison_page(found, snapshot, name=name), out)
    if as_json:
        print_json(found)
        return
    in_image = found.rectangles["in_image"]
    print_table(report.AGREEMENT_COLUMNS, [*report.agreement_rows(found), report.PAPER])
    print("\nround the whole object, in the image, by class:")
    print_table(report.AGREEMENT_COLUMNS, report.class_rows(in_image))
    if rows := report.confusion_rows(in_image):
        print("\nwithout a partner of their class:")
        print_table(report.CONFUSION_COLUMNS, rows)
    if rows := report.offset_rows(found):
        print("\nautomatic minus manual, median, px:")
        print_table(report.OFFSET_COLUMNS, rows)
    if found.worst:
        print("\nframes that agree least:")
        columns = ("frame", "name", "manual", "automatic", "matched", "mean IoU", "agreement")
        print_table(columns, [_frame_row(one.frame) for one in found.worst])
    if found.left_out:
        print("\nmanual labels left out:")
        rows = [(one.count, one.reason, "; ".join(one.examples)) for one in found.left_out]
        print_table(("count", "reason", "such as"), rows)
    for line in (*found.notes, *found.warnings):
        note(f"ars-web: {line}")
    if out is not None:
        print(out)


def _class_names(text: str | None) -> dict[str, str]:
    """What the session calls classes, from `MANUAL=SESSION` items."""
    names: dict[str, str] = {}
    for item in take.comma_separated(text, "--classes"):
        manual, _, session = (part.strip() for part in item.partition("="))
        if not manual or not session:
            raise typer.BadParameter(f"{item!r} is not MANUAL=SESSION", param_hint="--classes")
        if manual in names:
            raise typer.BadParameter(f"{manual!r} is told twice", param_hint="--classes")
        names[manual] = session
    return names


def _frame_row(frame: "ComparedFrame") -> tuple[object, ...]:
    from ars_web.studies.comparison_report import number

    counts = (frame.manual, frame.automatic, frame.matched)
    return frame.index, frame.name, *counts, number(frame.mean_iou), f"{frame.agreement:.2f}"


# evaluate
Truth = Annotated[
    Path, typer.Option("--truth", metavar="PATH", help="Labelled images: an exported dataset, or a foreign one.")
]
PredictionFiles = Annotated[
    list[str],
    typer.Option(
        "--predictions",
        metavar="[NAME=]FILE",
        help="What a detector found: COCO results, CSV, or a folder of YOLO files; repeatable, side by side.",
    ),
]
Threshold = Annotated[
    float, typer.Option("--iou", metavar="SHARE", help="Overlap from which on a prediction is right; default 0.5.")
]
TruthSplit = Annotated[
    str | None, typer.Option("--split", metavar="train|val|test|all", help="Default: val where there is one, else all.")
]
PredictionFormat = Annotated[
    str, typer.Option("--format", metavar="FORMAT", help="Of the predictions: auto, coco, csv or yolo.")
]
TruthFormat = Annotated[
    str, typer.Option("--truth-format", metavar="FORMAT", help="Of the truth: auto, coco, yolo, voc, cvat or ars.")
]
NumberedClasses = Annotated[
    str | None,
    typer.Option(
        "--classes",
        metavar="A,B,C",
        help="What the predictions' class numbers 0, 1, … mean, - for none; default: the truth's.",
    ),
]
ImageSize = Annotated[
    str | None, typer.Option("--image-size", metavar="WxH", help="Of images that are not there to look at.")
]
WithCoco = Annotated[
    bool, typer.Option("--coco/--no-coco", help="COCO's twelve numbers by pycocotools, which takes the longest.")
]
ReportOut = Annotated[
    Path | None,
    typer.Option("--out", metavar="DIR|FILE.html", help="Write a report; into a folder with its plots and its JSON."),
]


SLOW_FOR_COCO = 30_000
"""Predictions beyond which one waits for pycocotools."""


@app.command()
def evaluate(
    truth: Truth,
    predictions: PredictionFiles,
    iou: Threshold = 0.5,
    split: TruthSplit = None,
    kind: PredictionFormat = "auto",
    truth_kind: TruthFormat = "auto",
    classes: NumberedClasses = None,
    image_size: ImageSize = None,
    coco: WithCoco = True,
    out: ReportOut = None,
    as_json: take.Json = False,
) -> None:
    """How good detectors are: PR curves, AP per class, mAP, mean IoU, what is taken for what, worst images.

    Predictions are read as COCO results (a JSON list), as CSV with the header image,class,x0,y0,x1,y1,score, or as a
    folder of YOLO text files with confidences.
    """
    from ars_web.evaluation.evaluation_json import evaluation_record
    from ars_web.evaluation.prediction_reading import read_predictions
    from ars_web.evaluation.scoring import evaluate as score
    from ars_web.evaluation.truth_reading import read_truth

    labels = read_truth(truth, format=truth_kind, split=split, image_size=_width_and_height(image_size))
    names = take.comma_separated(classes, "--classes") or None
    detectors = [
        read_predictions(file, labels, name=name, format=kind, class_names=names)
        for name, file in map(_named_file, predictions)
    ]
    if coco and sum(len(one.bbox) for one in detectors) > SLOW_FOR_COCO:
        note("ars-web: COCO's numbers by pycocotools take a while; --no-coco leaves them out")
    evaluation = score(labels, detectors, iou=iou, coco=coco)
    for line in evaluation.warnings:
        note(f"ars-web: {line}")
    record = evaluation_record(evaluation)
    if out is not None:
        from ars_web.evaluation.report import write_report

        for file, content in write_report(evaluation, out).items():
            note(f"ars-web: {content} in {file}")
        if out.suffix.lower() != ".html":
            write_json(out / "evaluation.json", record)
    if as_json:
        print_json(record)
        return
    _print_evaluation(evaluation)


def _named_file(text: str) -> tuple[str | None, Path]:
    """A detector's name, where one is given, and its file."""
    name, equals, path = text.partition("=")
    # A path that is there may hold an equals sign.
    return (name, Path(path)) if equals and name and not Path(text).exists() else (None, Path(text))


def _width_and_height(text: str | None) -> tuple[int, int] | None:
    if text is None:
        return None
    width, _, height = text.lower().partition("x")
    if not (width.isdecimal() and height.isdecimal() and int(width) and int(height)):
        raise typer.BadParameter(f"{text!r} is not WIDTHxHEIGHT, such as 1280x720", param_hint="--image-size")
    return int(width), int(height)


def _print_evaluation(evaluation: "Evaluation") -> None:
    from ars_web.evaluation.tables import tables_of

    truth = evaluation.truth
    labels = int((~truth.ignored).sum())
    print(
        f"{truth.source}: {len(truth.images)} images, {labels} labels of {len(truth.classes)} classes ({truth.format})"
    )
    for table in tables_of(evaluation):
        print(f"\n{table.title}")
        print_table(table.columns, table.rows)
