"""KITTI, read as the readme of its development kit says; it has no library of its own."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ars_web.datasets.readback.dataset_json import class_names
from ars_web.datasets.readback.reader import Reader, ReadFrame, ReadLabel, Sizes
from ars_web.datasets.readback.yolo import numbers, own_reading
from ars_web.datasets.splits import SPLITS
from ars_web.datasets.writers.kitti import kitti_names
from ars_web.errors import BadFile


def _read(folder: Path, sizes: Sizes) -> Iterator[ReadFrame]:
    lists = {split: folder / "ImageSets" / f"{split}.txt" for split in SPLITS}
    splits = {line: s for s, path in lists.items() if path.is_file() for line in path.read_text().splitlines()}
    names = class_names(folder)
    written = dict(zip(kitti_names(names), names, strict=True))
    for path in sorted((folder / "training" / "label_2").iterdir()):
        rows = [line.split() for line in path.read_text(encoding="utf-8").splitlines()]
        labels = tuple(_label(path, row, words, written) for row, words in enumerate(rows))
        yield ReadFrame(path.stem, splits.get(path.stem), str(path), labels)


def _label(path: Path, row: int, words: list[str], names: dict[str, str]) -> ReadLabel:
    values = numbers(path, row, words, 14)
    if words[0] not in names:
        raise BadFile(path, f"{words[0]!r} is none of the dataset's classes", line=row + 1)
    height, (x, y, z) = values[7], values[10:13]
    # Indices of pixels; the bottom's centre. What of the turn and size KITTI can hold is not the box's own.
    return ReadLabel(names[words[0]], bbox=np.array(values[3:7]) + 0.5, centre_camera=np.array([x, y - height / 2, z]))


def _rounding(longer: int) -> float:
    # Of two decimals, and of the last index, half a pixel before the border.
    return 0.5051 if longer else 0.5


READER = Reader(format="kitti", library=own_reading, read=_read, rounding=_rounding)
