"""The original raw dataset: rows as in YOLO, lists of images for splits, no class names."""

from collections.abc import Iterator
from pathlib import Path

from ars_web.datasets.readback.dataset_json import class_names
from ars_web.datasets.readback.reader import Reader, ReadFrame, ReadLabel, Sizes
from ars_web.datasets.readback.yolo import bbox_of, class_name, numbers, own_reading, rounding


def _read(folder: Path, sizes: Sizes) -> Iterator[ReadFrame]:
    names = class_names(folder)
    for path, split, rows in rows_of(folder):
        size = sizes.get(path.stem, (1, 1))
        labels = tuple(
            ReadLabel(class_name(path, i, words, names), bbox=bbox_of(numbers(path, i, words, 4), size))
            for i, words in enumerate(rows)
        )
        yield ReadFrame(path.stem, split, str(path), labels)


def rows_of(folder: Path) -> Iterator[tuple[Path, str | None, list[list[str]]]]:
    """Every label file: its path, its split, and its rows as words."""
    splits = {
        Path(line).stem: path.stem
        for path in sorted(folder.glob("*.txt"))
        for line in path.read_text(encoding="utf-8").splitlines()
    }
    for path in sorted((folder / "labels").iterdir()):
        rows = [line.split() for line in path.read_text(encoding="utf-8").splitlines()]
        yield path, splits.get(path.stem), rows


READER = Reader(format="ars", library=own_reading, read=_read, rounding=rounding)
