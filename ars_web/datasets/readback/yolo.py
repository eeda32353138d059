"""YOLO datasets, read as Ultralytics' own documents say: no library of it may be shipped or asked for here."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ars_web.datasets.readback.reader import Reader, ReadFrame, ReadLabel, Sizes
from ars_web.errors import BadFile


def names_of(folder: Path) -> tuple[list[str], list[str]]:
    """The class names and the splits of a `data.yaml`."""
    path = folder / "data.yaml"
    names: list[str] = []
    splits: list[str] = []
    block = ""
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
        key, _, value = line.partition(": ")
        if not line.startswith("  "):
            block = key.rstrip(":")
        elif block == "names" and key.strip().isdigit():
            if int(key) != len(names):
                raise BadFile(path, f"class {key.strip()} comes after class {len(names) - 1}", line=number)
            names.append(unquoted(value))
        if key in ("train", "val", "test"):
            splits.append(key)
    return names, splits


def unquoted(text: str) -> str:
    """A double-quoted YAML scalar, as the writer quotes it."""
    return text.strip()[1:-1].encode("ascii", "backslashreplace").decode("unicode_escape")


def rows_of(folder: Path) -> Iterator[tuple[Path, str, list[str], list[list[str]]]]:
    """Every label file: its path, its split, the class names, and its rows as words."""
    names, splits = names_of(folder)
    for split in splits:
        for path in sorted((folder / "labels" / split).iterdir()):
            yield path, split, names, [line.split() for line in path.read_text(encoding="utf-8").splitlines()]


def numbers(path: Path, row: int, words: list[str], count: int | None = None) -> list[float]:
    """A row's numbers after its class; BadFile where there are not so many, or one is none."""
    try:
        found = [float(word) for word in words[1:]]
    except ValueError as error:
        raise BadFile(path, str(error), line=row + 1) from error
    if count is not None and len(found) != count:
        raise BadFile(path, f"{len(found)} numbers after the class, not {count}", line=row + 1)
    return found


def class_name(path: Path, row: int, words: list[str], names: list[str]) -> str:
    """A row's class; BadFile where there is no such class."""
    if not words or not words[0].isdigit() or int(words[0]) >= len(names):
        raise BadFile(path, f"{' '.join(words[:1])!r} is no class; there are {len(names)}", line=row + 1)
    return names[int(words[0])]


def bbox_of(shares: list[float], size: tuple[int, int]) -> Float[np.ndarray, "4"]:
    """(x0, y0, x1, y1) in pixels of `cx cy w h` in shares of the image."""
    cx, cy, w, h = shares
    return np.array([cx - w / 2, cy - h / 2, cx + w / 2, cy + h / 2]) * [*size, *size]


def rounding(longer: int) -> float:
    """Of six decimals: half of the last of them, twice, since an edge is a centre and half a width."""
    return 1e-6 * longer


def own_reading() -> str:
    """Who reads a format that has no library here."""
    return "this program's own reading of the files"


def _read(folder: Path, sizes: Sizes) -> Iterator[ReadFrame]:
    for path, split, names, rows in rows_of(folder):
        size = sizes.get(path.stem, (1, 1))
        labels = tuple(
            ReadLabel(class_name(path, i, words, names), bbox=bbox_of(numbers(path, i, words, 4), size))
            for i, words in enumerate(rows)
        )
        yield ReadFrame(path.stem, split, str(path), labels)


READER = Reader(format="yolo", library=own_reading, read=_read, rounding=rounding)
