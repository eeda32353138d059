"""YOLO predictions: a folder of text files, one an image, with rows `class cx cy w h confidence`, shares of the image.

A file is of the image of its name; an image without a file has no predictions. Classes have numbers. Folders called
labels, in which detectors put the files beside pictures, are in no image's name.
"""

from pathlib import Path

import numpy as np

from ars_web.annotations.yolo_rows import box_of, rows_of
from ars_web.errors import BadFile, BadInput
from ars_web.evaluation.predictions_read import PredictionsRead

LISTS = ("classes.txt", "labels.txt", "names.txt", "notes.txt")
"""Files that programs lay beside label files."""


FOLDER = "labels"

BESIDE = 9.0
"""How far beyond the image a prediction may lie, in its widths and heights: further than a label, as networks err."""


def is_one(path: Path) -> bool:
    """Whether a folder holds text files."""
    return path.is_dir() and bool(_files(path))


def read(path: Path, into: PredictionsRead) -> None:
    """Read them.

    Raises:
        BadFile: there is no such file, one is of no image, or a row cannot be; the message names file and line.
    """
    files = _files(path) if path.is_dir() else [path]
    if not files:
        raise BadFile(path, "holds no text file; YOLO predictions are one file an image, `class cx cy w h confidence`")
    file_of: dict[int, Path] = {}
    for file in files:
        parts = file.relative_to(path).with_suffix("").parts if path.is_dir() else (file.stem,)
        try:
            image = into.image_named("/".join((*(part for part in parts[:-1] if part != FOLDER), parts[-1])))
        except BadInput as error:
            raise BadFile(file, str(error)) from error
        if (other := file_of.setdefault(image, file)) is not file:
            raise BadFile(file, f"is of the same image as {other}; give the folder of one detector's one run")
        size = into.truth.images[image].size if into.truth.in_pixels else (1, 1)
        for row in rows_of(file):
            if len(row.values) != 5:
                said = f"has {len(row.values)} numbers after the class; a row is class cx cy w h confidence"
                remedy = "; have the detector save confidences, too (save_conf)" if len(row.values) == 4 else ""
                raise BadFile(file, said + remedy, line=row.line)
            if size is None:
                raise BadFile(
                    file, "the truth has no size for this image, so shares of it are nowhere; say --image-size"
                )
            x0, y0, x1, y1 = (box_of(file, row, beside=BESIDE) * np.tile(size, 2)).tolist()
            try:
                into.add(image, into.class_numbered(row.number), (x0, y0, x1, y1), row.values[4])
            except BadInput as error:
                raise BadFile(file, str(error), line=row.line) from error


def _files(path: Path) -> list[Path]:
    return [
        file for file in sorted(path.rglob("*.txt")) if file.name not in LISTS and not file.name.startswith("README")
    ]
