"""Predictions as CSV: a header `image,class,x0,y0,x1,y1,score`, in any order, then a row for each.

`image` is a file name, with folders or without, or a stem; `class` a class's name, or its number where it was said what
numbers mean; x0, y0, x1, y1 are image coordinates in pixels. Further columns are let be. Semicolons or tabs may stand
for the commas, as spreadsheets write them; a decimal point is a point.
"""

import csv
from pathlib import Path

from ars_web.errors import BadFile, BadInput
from ars_web.evaluation.labels_read import number
from ars_web.evaluation.predictions_read import PredictionsRead
from ars_web.recordings.number_rows import file_bytes

COLUMNS = ("image", "class", "x0", "y0", "x1", "y1", "score")


def is_one(path: Path) -> bool:
    """Whether a file is called CSV, or begins with the header."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        head = file.read(1 << 12).split(b"\n", 1)[0]
    return path.suffix.lower() == ".csv" or all(name.encode() in head for name in COLUMNS)


def read(path: Path, into: PredictionsRead) -> None:
    """Read them.

    Raises:
        BadFile: the header lacks a column, or a row cannot be; the message names the line.
    """
    try:
        text = file_bytes(path).decode()
    except UnicodeDecodeError as error:
        raise BadFile(path, "is not UTF-8; save it as UTF-8") from error
    lines = text.splitlines()
    delimiter = _delimiter(lines[0] if lines else "")
    # Not strictly: of a file that is something else it says what a header is.
    header = [_column(name) for name in next(csv.reader(lines[:1], delimiter=delimiter), [])]
    missing = [name for name in COLUMNS if name not in header]
    if missing:
        raise BadFile(path, f"the header has no {', '.join(missing)}; it is {','.join(COLUMNS)}", line=1)
    twice = [name for name in COLUMNS if header.count(name) > 1]
    if twice:
        raise BadFile(path, f"the header has {twice[0]} twice; take one of them out", line=1)
    places = [header.index(name) for name in COLUMNS]
    rows = csv.reader(lines[1:], delimiter=delimiter, strict=True, skipinitialspace=True)
    try:
        into.refuse_without_pixels()
        for words in rows:
            if not any(word.strip() for word in words):
                continue  # Spreadsheets leave such rows at the end.
            if len(words) != len(header):
                raise BadInput(f"has {len(words)} values; the header has {len(header)}")
            image, class_, *numbers = (words[place].strip() for place in places)
            x0, y0, x1, y1, score = map(number, numbers)
            into.add(into.image_named(image), into.class_said(class_), (x0, y0, x1, y1), score)
    except BadFile:
        raise
    except (BadInput, csv.Error) as error:
        raise BadFile(path, str(error), line=rows.line_num + 1) from error


def _delimiter(header: str) -> str:
    """What parts the columns: that by which the header has the most of COLUMNS."""

    def known(delimiter: str) -> int:
        return len({_column(name) for name in header.split(delimiter)}.intersection(COLUMNS))

    return max(",;\t", key=known)


def _column(name: str) -> str:
    return name.strip().strip('"').lower()
