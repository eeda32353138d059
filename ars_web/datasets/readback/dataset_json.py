"""`dataset.json`, for formats that do not say a thing themselves."""

from pathlib import Path

from pydantic import ValidationError

from ars_web.datasets.report import ExportReport
from ars_web.errors import BadFile


def report_in(folder: Path) -> ExportReport:
    """The report of the dataset in a folder; BadFile where there is none, or it cannot be read."""
    path = folder / "dataset.json"
    try:
        return ExportReport.model_validate_json(path.read_bytes())
    except FileNotFoundError as error:
        raise BadFile(path, "is missing; without it this is no whole dataset") from error
    except ValidationError as error:
        raise BadFile(path, f"cannot be read: {error.errors()[0]['msg']}") from error


def class_names(folder: Path) -> list[str]:
    """The names of the dataset's classes; a class's id is its place."""
    return [a_class.name for a_class in report_in(folder).classes]
