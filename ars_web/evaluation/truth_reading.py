"""The truth at a path, in whatever layout it is: found by looking, read whole, and checked."""

from pathlib import Path

from ars_web.errors import BadFile, BadInput
from ars_web.evaluation import coco_truth, other_truth, unread_truth, voc_truth, yolo_truth
from ars_web.evaluation.detections import Truth, check_truth
from ars_web.evaluation.truth_layout import SPLITS, WHOLE, TruthLayout, TruthOptions

LAYOUTS: dict[str, TruthLayout] = {
    layout.format: layout
    for layout in (coco_truth.LAYOUT, yolo_truth.LAYOUT, voc_truth.LAYOUT, other_truth.CVAT, other_truth.ARS)
}


def read_truth(
    path: Path,
    *,
    format: str = "auto",  # noqa: A002 - the contract's name
    split: str | None = None,
    image_size: tuple[int, int] | None = None,
) -> Truth:
    """Read the labels of a dataset, of this program or of another.

    Args:
        split: train, val, test or all; None: val where there is one, else the whole.
        image_size: of images that are not there; without it their labels are shares of them.

    Raises:
        BadInput: no layout is known, the split is not there or is empty, or nothing in it is labelled.
        BadFile: a file of it is damaged; the message names file and line.
    """
    if format != "auto" and format not in LAYOUTS:
        raise BadInput(
            f"truth of the format {format!r} is not read; read are auto, {', '.join(LAYOUTS)}. Export the same as coco,"
            " or convert it, and give that"
        )
    if split not in (None, WHOLE, *SPLITS):
        raise BadInput(f"split {split!r} is none of {', '.join((*SPLITS, WHOLE))}")
    if not path.exists():
        raise BadFile(path, "is missing")
    layout = _found(path) if format == "auto" else LAYOUTS[format]
    try:
        truth = layout.read(path, TruthOptions(split, image_size))
    except OSError as error:
        raise BadFile(error.filename or path, f"cannot be read: {error.strerror}") from error
    check_truth(truth)
    return truth


def _found(path: Path) -> TruthLayout:
    if unread := unread_truth.own_unread(path):
        raise BadInput(unread)
    for layout in LAYOUTS.values():
        if layout.is_one(path):
            return layout
    if unread := unread_truth.foreign_unread(path):
        raise BadInput(unread)
    known = "; ".join(f"{layout.format}: {layout.title}" for layout in LAYOUTS.values())
    raise BadInput(f"{path} holds no labels that are known. Known are {known}")
