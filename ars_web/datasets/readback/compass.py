"""The original's compass dataset: rows as in YOLO, with a heading in the class or after the box."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ars_web.datasets.readback.ars import rows_of
from ars_web.datasets.readback.dataset_json import class_names, report_in
from ars_web.datasets.readback.reader import Reader, ReadFrame, ReadLabel, Sizes
from ars_web.datasets.readback.yolo import bbox_of, class_name, numbers, own_reading, rounding


def _read(folder: Path, sizes: Sizes) -> Iterator[ReadFrame]:
    names, bins = class_names(folder), report_in(folder).options.heading_bins
    for path, split, rows in rows_of(folder):
        size = sizes.get(path.stem, (1, 1))
        labels = tuple(_label(path, i, words, names, size, bins) for i, words in enumerate(rows))
        yield ReadFrame(path.stem, split, str(path), labels)


def _label(path: Path, row: int, words: list[str], names: list[str], size: tuple[int, int], bins: int) -> ReadLabel:
    if bins == 0:
        *shares, heading = numbers(path, row, words, 5)
        return ReadLabel(class_name(path, row, words, names), bbox=bbox_of(shares, size), heading=(heading, heading))
    # One name for each bin of each class.
    name = class_name(path, row, words, [name for name in names for _ in range(bins)])
    low = int(words[0]) % bins
    heading = low / bins * 2 * np.pi, (low + 1) / bins * 2 * np.pi
    return ReadLabel(name, bbox=bbox_of(numbers(path, row, words, 4), size), heading=heading)


READER = Reader(format="compass", library=own_reading, read=_read, rounding=rounding)
