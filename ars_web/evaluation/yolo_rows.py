"""Rows of YOLO's label files: a class number, then shares of the image's width and height."""

from collections.abc import Iterator
from pathlib import Path

from ars_web.errors import BadFile, BadInput
from ars_web.evaluation.labels_read import number
from ars_web.evaluation.truth_layout import text_lines

Rectangle = tuple[float, float, float, float]


def rows_of(path: Path) -> Iterator[tuple[int, int, list[float]]]:
    """Each row's line, from 1, class number, and numbers after it; blank lines are left out.

    Raises:
        BadFile: a word is no finite number, or the class is no whole one.
    """
    for line, text in enumerate(text_lines(path), start=1):
        words = text.split()
        if not words:
            continue
        try:
            numbers = [number(word) for word in words]
        except BadInput as error:
            raise BadFile(path, str(error), line=line) from error
        if numbers[0] < 0 or not numbers[0].is_integer():
            raise BadFile(path, f"{words[0]!r} is no class number; they are whole, from 0", line=line)
        yield line, int(numbers[0]), numbers[1:]


def rectangle(path: Path, line: int, shares: list[float], size: tuple[int, int]) -> Rectangle:
    """x0, y0, x1, y1 of `cx cy w h`, in units of `size`'s.

    Raises:
        BadFile: a width or height is negative, or the numbers are pixels.
    """
    cx, cy, w, h = shares
    if w < 0 or h < 0:
        raise BadFile(path, f"width {w:g} and height {h:g} must not be negative", line=line)
    # A label may reach beyond its image, but not by many of them.
    if max(abs(cx), abs(cy), w, h) > 10:
        shown = " ".join(f"{share:g}" for share in shares)
        raise BadFile(path, f"{shown} are no shares of the image; divide pixels by its width and height", line=line)
    width, height = size
    return (cx - w / 2) * width, (cy - h / 2) * height, (cx + w / 2) * width, (cy + h / 2) * height
