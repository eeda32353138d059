"""YOLO's turned boxes, read as Ultralytics' own documents say."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ars_web.datasets.readback.reader import Reader, ReadFrame, ReadLabel, Sizes
from ars_web.datasets.readback.yolo import class_name, numbers, own_reading, rows_of


def _read(folder: Path, sizes: Sizes) -> Iterator[ReadFrame]:
    for path, split, names, rows in rows_of(folder):
        size = sizes.get(path.stem, (1, 1))
        labels = tuple(
            ReadLabel(
                class_name(path, i, words, names),
                rings=(np.array(numbers(path, i, words, 8)).reshape(4, 2) * size,),
            )
            for i, words in enumerate(rows)
        )
        yield ReadFrame(path.stem, split, str(path), labels)


def _rounding(longer: int) -> float:
    # Half of the last of six decimals, along both axes.
    return 0.71e-6 * longer


READER = Reader(format="yolo-obb", library=own_reading, read=_read, rounding=_rounding, ring_function="rectangle")
