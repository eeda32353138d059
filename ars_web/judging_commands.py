"""The commands of `ars-web` that judge labels: a session's beside a person's, a detector's beside true ones.

They stand beside the commands of `cli.py`, in no group.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ars_web import arguments as take
from ars_web.terminal import note, print_json, print_table, write_json

if TYPE_CHECKING:
    from ars_web.evaluation.scores import Evaluation

app = typer.Typer(rich_markup_mode=None)


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
