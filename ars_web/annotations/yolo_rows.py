"""Rows of YOLO's label files: a class number, then shares of the image's width and height.

`class cx cy w h` is a rectangle. `class x y x y x y …`, three points or more, is an outline. Where data.yaml has
`kpt_shape`, keypoints may follow the rectangle.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ars_web.errors import BadFile
from ars_web.recordings.number_rows import file_bytes

BESIDE = 1.0
"""How far beyond the image a label's numbers may lie, in its widths and heights; pixels lie further."""

_LARGEST_FILE = 1 << 26
_BOX = 4


@dataclass(frozen=True)
class YoloRow:
    """One row.

    Attributes:
        line: in the file, from 1.
        number: of the class.
        values: all that follows; finite.
    """

    line: int
    number: int
    values: tuple[float, ...]


def rows_of(path: Path) -> Iterator[YoloRow]:
    """The rows of a file; blank lines are left out.

    Raises:
        BadFile: it cannot be read or is far too large, a word is no finite number, or a class no whole one.
    """
    data = file_bytes(path)
    if len(data) > _LARGEST_FILE:
        raise BadFile(path, f"is over {_LARGEST_FILE >> 20} MiB, which labels of one image do not take")
    # What is no UTF-8 is no number, and is told with its line.
    for line, text in enumerate(data.decode(errors="replace").splitlines(), start=1):
        words = text.split()
        if not words:
            continue
        number = _number(words[0])
        if not number.is_integer() or number < 0:
            raise BadFile(path, f"{words[0][:40]!r} is no class number; they are whole, from 0", line=line)
        values = tuple(map(_number, words[1:]))
        if not np.isfinite(values).all():
            word = next(word for word in words[1:] if not np.isfinite(_number(word)))
            raise BadFile(path, f"{word[:40]!r} is no number", line=line)
        yield YoloRow(line, int(number), values)


def ring_of(path: Path, row: YoloRow, *, keypoints: int = 0) -> Float[np.ndarray, "n 2"] | None:
    """The outline's points, in shares; None where the row is a rectangle.

    Args:
        keypoints: how many numbers may follow a rectangle; 0: none, and rows may be outlines.

    Raises:
        BadFile: the row is neither, or its numbers are pixels.
    """
    count = len(row.values)
    if count == _BOX or (keypoints and count == _BOX + keypoints):
        return None
    if keypoints or count < 6 or count % 2:
        outline = f"and {keypoints} of keypoints" if keypoints else "an outline x and y of three points at least"
        confidence = "; a fifth is a detector's confidence: leave it out" if count == _BOX + 1 else ""
        said = f"{count} numbers follow the class: a rectangle has four (cx cy w h), {outline}{confidence}"
        raise BadFile(path, said, line=row.line)
    return np.array(_shares(path, row, row.values, BESIDE)).reshape(-1, 2)


def box_of(path: Path, row: YoloRow, *, beside: float = BESIDE) -> Float[np.ndarray, "4"]:
    """x0, y0, x1, y1 of the `cx cy w h` that a row begins with, in shares; width and height may be 0.

    Raises:
        BadFile: a width or height is negative, or a number is over 1 + `beside` or below -`beside`.
    """
    cx, cy, w, h = _shares(path, row, row.values[:_BOX], beside)
    if w < 0 or h < 0:
        raise BadFile(path, f"width {w:g} and height {h:g} must not be negative", line=row.line)
    return np.array([cx - w / 2, cy - h / 2, cx + w / 2, cy + h / 2])


def _shares(path: Path, row: YoloRow, values: tuple[float, ...], beside: float) -> tuple[float, ...]:
    for value in values:
        if not -beside <= value <= 1 + beside:
            said = f"{value:g} is no share of the image's width or height, 0 to 1; divide pixels by them"
            raise BadFile(path, said, line=row.line)
    return values


def _number(word: str) -> float:
    try:
        # Python reads 1_000, and no label file means it.
        return np.nan if "_" in word else float(word)
    except ValueError:
        return np.nan
