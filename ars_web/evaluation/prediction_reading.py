"""The predictions at a path, in whatever format they are: found by looking, read whole, and checked."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ars_web.errors import BadFile, BadInput
from ars_web.evaluation import coco_results, csv_results, yolo_results
from ars_web.evaluation.detections import Predictions, Truth
from ars_web.evaluation.predictions_read import PredictionsRead


@dataclass(frozen=True)
class PredictionFormat:
    """One format.

    Attributes:
        format: its key.
        title: what it looks like.
        is_one: whether a path that exists looks like it.
        read: reads it, whole and sound, or raises.
    """

    format: str
    title: str
    is_one: Callable[[Path], bool]
    read: Callable[[Path, PredictionsRead], None]


FORMATS: dict[str, PredictionFormat] = {
    one.format: one
    for one in (
        PredictionFormat("coco", "COCO results, a JSON list", coco_results.is_one, coco_results.read),
        PredictionFormat("csv", f"CSV with {','.join(csv_results.COLUMNS)}", csv_results.is_one, csv_results.read),
        PredictionFormat(
            "yolo", "a folder of YOLO text files with confidences", yolo_results.is_one, yolo_results.read
        ),
    )
}


def read_predictions(
    path: Path,
    truth: Truth,
    *,
    name: str | None = None,
    format: str = "auto",  # noqa: A002 - the contract's name
    class_names: Sequence[str] | None = None,
) -> Predictions:
    """Read what a detector found in the truth's images.

    Args:
        name: what the detector is called; None: as the file or folder.
        class_names: what the detector's class numbers mean, from 0; None: what the truth's do.

    Raises:
        BadInput: no format is known, or a class name is none of the truth's.
        BadFile: a file is damaged, or of an image or a class that the truth does not have; the message names file and
            line.
    """
    if format != "auto" and format not in FORMATS:
        raise BadInput(f"predictions of the format {format!r} are not read; read are auto, {', '.join(FORMATS)}")
    if not path.exists():
        raise BadFile(path, "is missing")
    try:
        reader = _found(path) if format == "auto" else FORMATS[format]
        into = PredictionsRead(truth, class_names)
        reader.read(path, into)
    except OSError as error:
        raise BadFile(error.filename or path, f"cannot be read: {error.strerror}") from error
    return into.predictions(name or (path.stem if path.is_file() else path.resolve().name), path, reader.format)


def _found(path: Path) -> PredictionFormat:
    if path.is_file() and path.stat().st_size == 0:
        raise BadFile(path, "is empty; what a detector wrote that found nothing is [], or a header of CSV")
    for one in FORMATS.values():
        if one.is_one(path):
            return one
    known = "; ".join(f"{one.format}: {one.title}" for one in FORMATS.values())
    raise BadInput(f"{path} holds no predictions that are known. Known are {known}")
