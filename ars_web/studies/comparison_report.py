"""The annotation study as an HTML page of one file."""

from collections.abc import Sequence

from ars_web.reporting.page import data_uri, report_page
from ars_web.sessions.model import SessionSnapshot
from ars_web.studies.agreement import Agreement, RectangleAgreement
from ars_web.studies.automatic_labels import RECTANGLES
from ars_web.studies.comparison import Comparison
from ars_web.studies.comparison_pictures import AUTOMATIC, LONELY, MANUAL, picture_or_reason
from ars_web.studies.comparison_plots import NAMES, iou_by_visibility, iou_histogram

NOTHING = "-"
"""In a table where there is no number."""

NO_LABEL = "(nothing)"

PAPER = ("The paper, all classes", "", "", "", "98.49 %", "95.02 %", "0.70", "")
"""De Gregorio et al., Semi-Automatic Labeling for Deep Learning in Robotics: manual against automatic at IoU 0.3."""

AGREEMENT_COLUMNS = ("", "manual", "automatic", "matched", "precision", "recall", "mean IoU", "median IoU")
OFFSET_COLUMNS = ("automatic rectangle", "left", "top", "right", "bottom")
CONFUSION_COLUMNS = ("by hand", "by program", "labels")


def comparison_page(comparison: Comparison, snapshot: SessionSnapshot, *, name: str) -> str:
    """The page, with pictures of the worst frames, from the session whose labels were compared and its name."""
    total = comparison.rectangles["in_image"].total
    pictures: list[tuple[str, str, str]] = []
    for one in comparison.worst:
        drawn, frame = picture_or_reason(snapshot, one), one.frame
        source = data_uri(drawn, media_type="image/jpeg") if isinstance(drawn, bytes) else ""
        said = (
            f"Frame {frame.index}, {frame.name}: {frame.manual} by hand, {frame.automatic} by the program,"
            f" {frame.matched} matched, mean IoU {number(frame.mean_iou)}, agreement {frame.agreement:.2f}"
        )
        pictures.append((source, said, drawn if isinstance(drawn, str) else ""))
    has_pairs = total.matched > 0
    return report_page(
        "comparison.html",
        comparison=comparison,
        name=name,
        total=total,
        share=share,
        number=number,
        agreement_columns=AGREEMENT_COLUMNS,
        agreements=[*agreement_rows(comparison), PAPER],
        classes=class_rows(comparison.rectangles["in_image"]),
        classes_visible=class_rows(comparison.rectangles["visible"]),
        offset_columns=OFFSET_COLUMNS,
        offsets=offset_rows(comparison),
        confusion_columns=CONFUSION_COLUMNS,
        confusion=confusion_rows(comparison.rectangles["in_image"]),
        histogram=data_uri(iou_histogram(comparison), media_type="image/png") if has_pairs else "",
        by_visibility=data_uri(iou_by_visibility(comparison), media_type="image/png") if has_pairs else "",
        left_out=[(one.reason, "; ".join(one.examples), str(one.count)) for one in comparison.left_out],
        pictures=pictures,
        colours=((MANUAL, "by hand"), (AUTOMATIC, "by the program, dashed round what is seen"), (LONELY, "no partner")),
    )


def agreement_rows(comparison: Comparison) -> list[tuple[str, ...]]:
    """A row for each kind of automatic rectangle, all compared classes together."""
    return [agreement_row(NAMES[kind], comparison.rectangles[kind].total) for kind in RECTANGLES]


def class_rows(agreement: RectangleAgreement) -> list[tuple[str, ...]]:
    """A row a class."""
    return [agreement_row(one.class_name, one.agreement) for one in agreement.classes]


def agreement_row(name: str, one: Agreement) -> tuple[str, ...]:
    """Under AGREEMENT_COLUMNS."""
    counts = (str(one.manual), str(one.automatic), str(one.matched))
    return (name, *counts, share(one.precision), share(one.recall), number(one.mean_iou), number(one.median_iou))


def offset_rows(comparison: Comparison) -> list[tuple[str, ...]]:
    """A row for each kind of automatic rectangle that has pairs."""
    rows: list[tuple[str, ...]] = []
    for kind in RECTANGLES:
        found = comparison.rectangles[kind].offsets
        if found is not None:
            sides = (found.left, found.top, found.right, found.bottom)
            rows.append((NAMES[kind], *(f"{side:+z.2f}" for side in sides)))
    return rows


def confusion_rows(agreement: RectangleAgreement) -> Sequence[tuple[str, str, str]]:
    """Combinations of two classes, or of one and nothing; those that agree are left out."""
    return [
        (one.manual or NO_LABEL, one.automatic or NO_LABEL, str(one.count))
        for one in sorted(agreement.confusion, key=lambda one: -one.count)
        if one.manual != one.automatic
    ]


def share(value: float | None) -> str:
    """As the paper writes it."""
    return NOTHING if value is None else f"{100 * value:.2f} %"


def number(value: float | None) -> str:
    """Two decimals."""
    return NOTHING if value is None else f"{value:.2f}"
