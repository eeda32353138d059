"""YOLO's outlines, read as Ultralytics' own documents say."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ars_web.datasets.readback.reader import Reader, ReadFrame, ReadLabel, Sizes
from ars_web.datasets.readback.yolo import class_name, numbers, own_reading, rows_of
from ars_web.errors import BadFile


def _read(folder: Path, sizes: Sizes) -> Iterator[ReadFrame]:
    for path, split, names, rows in rows_of(folder):
        size = sizes.get(path.stem, (1, 1))
        labels = tuple(_label(path, i, words, names, size) for i, words in enumerate(rows))
        yield ReadFrame(path.stem, split, str(path), labels)


def _label(path: Path, row: int, words: list[str], names: list[str], size: tuple[int, int]) -> ReadLabel:
    shares = numbers(path, row, words)
    if len(shares) < 6 or len(shares) % 2:
        raise BadFile(path, f"{len(shares)} numbers after the class, which are no ring of points", line=row + 1)
    return ReadLabel(class_name(path, row, words, names), rings=(np.array(shares).reshape(-1, 2) * size,))


def _rounding(longer: int) -> float:
    # Half of the last of six decimals, along both axes.
    return 0.71e-6 * longer


READER = Reader(format="yolo-seg", library=own_reading, read=_read, rounding=_rounding, ring_function="outline")
