"""The commands of `ars-web` that judge labels: a session's beside a person's, a detector's beside true ones.

They stand beside the commands of `cli.py`, in no group.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ars_web import arguments as take
from ars_web.errors import BadInput
from ars_web.terminal import note, print_json, print_table, progress

if TYPE_CHECKING:
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
        page = report.comparison_page(found, snapshot, name=name)
        try:
            write_page(page, out)
        except OSError as error:
            raise BadInput(f"{out} cannot be written: {error.strerror}; choose another place") from error
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
