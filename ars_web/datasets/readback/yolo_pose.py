"""YOLO's keypoints, read as Ultralytics' own documents say."""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ars_web.datasets.label_functions import HIDDEN, SEEN, UNSEEN
from ars_web.datasets.readback.reader import Reader, ReadFrame, ReadLabel, Sizes
from ars_web.datasets.readback.yolo import bbox_of, class_name, numbers, own_reading, rounding, rows_of
from ars_web.errors import BadFile


def _read(folder: Path, sizes: Sizes) -> Iterator[ReadFrame]:
    count = _points_a_row(folder / "data.yaml")
    for path, split, names, rows in rows_of(folder):
        size = sizes.get(path.stem, (1, 1))
        labels = tuple(_label(path, i, words, names, size, count) for i, words in enumerate(rows))
        yield ReadFrame(path.stem, split, str(path), labels)


def _points_a_row(path: Path) -> int:
    found = re.search(r"^kpt_shape: \[(\d+), 3\]$", path.read_text(encoding="utf-8"), flags=re.MULTILINE)
    if found is None:
        raise BadFile(path, "has no kpt_shape of points with x, y and v")
    return int(found[1])


def _label(path: Path, row: int, words: list[str], names: list[str], size: tuple[int, int], count: int) -> ReadLabel:
    shares = np.array(numbers(path, row, words, 4 + 3 * count))
    points = shares[4:].reshape(-1, 3)
    if not np.isin(points[:, 2], (UNSEEN, HIDDEN, SEEN)).all():
        raise BadFile(path, f"a point's v must be 0, 1 or 2, not {points[:, 2].tolist()}", line=row + 1)
    states = points[:, 2].astype(np.int64)
    return ReadLabel(
        class_name(path, row, words, names),
        bbox=bbox_of(shares[:4].tolist(), size),
        points=np.where((states > 0)[:, None], points[:, :2] * size, np.nan),
        states=states,
    )


READER = Reader(format="yolo-pose", library=own_reading, read=_read, rounding=rounding)
