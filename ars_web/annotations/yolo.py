"""YOLO's text files: one an image, a row an object, in shares of the image's width and height.

`class cx cy w h` is a rectangle. `class x y x y x y …`, three points or more, is an outline; the four corners of a
turned rectangle are one, too. Where data.yaml has `kpt_shape`, keypoints follow the rectangle, and are left alone.
Classes are numbers from 0; their names are in data.yaml, classes.txt or obj.names. An empty file is an image that shows
nothing. An image that has no file is not listed: whether somebody looked at it is not known.

The files say nothing of the images' sizes. They have the names of the images, with another ending.

Source: https://docs.ultralytics.com/datasets/detect/ and segment/, obb/, pose/ beside it
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import cast

import numpy as np
import yaml

from ars_web.annotations.foreign import ForeignImage, ForeignLabels, ForeignOutline, ForeignRectangle
from ars_web.errors import BadFile
from ars_web.geometry.polygon import Polygon
from ars_web.recordings.number_rows import file_bytes
from ars_web.recordings.options import ReadOptions, real

TITLE = "YOLO"
NEEDS = "text files of rows class cx cy w h, and data.yaml, classes.txt or obj.names with the classes' names"

_YAML = ("data.yaml", "data.yml", "dataset.yaml")
_LISTS = ("classes.txt", "obj.names")
_NO_LABELS = ("classes.txt", "labelmap.txt", "train.txt", "valid.txt", "val.txt", "test.txt", "trainval.txt")
_LABELS = "labels"
_PARENTS = 2
"""How far above labels/train its data.yaml may be."""

_LARGEST_YAML = 1 << 18
_LARGEST_FILE = 1 << 26
_BESIDE = 1.0
"""How far beyond the image a corner may lie, in its widths and heights."""

_BOX = 4


def find(path: Path) -> list[Path]:
    """The folder at `path` where it holds names of classes, or text files of which a folder above does; a file of
    names stands for its folder."""
    if path.is_dir():
        own = _names_file(path) is not None
        return [path] if own or (_names_above(path) is not None and _label_files(path)) else []
    return [path] if path.name in (*_YAML, *_LISTS) and _has_names(path) else []


def are_parts(files: Sequence[Path]) -> bool:
    """Whether files are parts of one set: a folder is whole."""
    return len(files) == 1


@dataclass
class _Found:
    """What has been read so far."""

    images: list[ForeignImage] = field(default_factory=list[ForeignImage])
    outlines: list[ForeignOutline] = field(default_factory=list[ForeignOutline])
    rectangles: list[ForeignRectangle] = field(default_factory=list[ForeignRectangle])


def read(file: Path, options: ReadOptions) -> ForeignLabels:
    """Read a folder of text files, or the one in which `file`, a list of names, is.

    Raises:
        BadFile: there is no list of names or no text file, or one is damaged; the message names the line.
        RefusedPath: one of them lies outside `options.within`.
    """
    folder = file if file.is_dir() else file.parent
    listed = _names_above(folder, options.within) if file.is_dir() else file
    if listed is None:
        raise BadFile(folder, f"has no {', '.join((*_YAML, *_LISTS))}; put the classes' names there, one a line")
    names, has_keypoints = _names(options.allowed(listed))
    found = _Found()
    for path in _label_files(folder):
        found.images.append(ForeignImage(name=path.relative_to(folder).as_posix()))
        if options.allowed(path).stat().st_size > _LARGEST_FILE:
            raise BadFile(path, f"is over {_LARGEST_FILE >> 20} MiB, which labels of one image do not take")
        for number, line in enumerate(file_bytes(path).decode(errors="replace").splitlines(), start=1):
            if line.strip():
                _take_row(path, number, line.split(), names, found, has_keypoints=has_keypoints)
    if not found.images:
        raise BadFile(folder, "holds no label files: a text file for each image that was labelled, empty for none")
    return ForeignLabels(
        "yolo",
        folder,
        tuple(found.images),
        outlines=tuple(found.outlines),
        rectangles=tuple(found.rectangles),
        in_shares=True,
    )


def _take_row(
    path: Path, line: int, words: Sequence[str], names: Sequence[str], found: _Found, *, has_keypoints: bool
) -> None:
    word, shares = words[0], [_share(path, line, word) for word in words[1:]]
    if not (word.isascii() and word.isdecimal() and int(word) < len(names)):
        known = f"0 to {len(names) - 1}" if names else "none"
        raise BadFile(path, f"{word[:40]!r} is no class; known are {known}", line=line)
    image, name = len(found.images) - 1, names[int(word)]
    where = f"{found.images[-1].name}, line {line}"
    if len(shares) == _BOX or (has_keypoints and len(shares) > _BOX):
        found.rectangles.append(ForeignRectangle(image, name, None, _bbox(path, line, shares[:_BOX]), where))
    elif len(shares) >= 6 and len(shares) % 2 == 0:
        ring = np.array(shares).reshape(-1, 2)
        found.outlines.append(ForeignOutline(image, name, None, (Polygon(ring),), where))
    else:
        more = "; a fifth is a detector's confidence: leave it out" if len(shares) == _BOX + 1 else ""
        message = (
            f"{len(shares)} numbers follow the class: a rectangle has four (cx cy w h), an outline x and y of three"
        )
        raise BadFile(path, f"{message} points at least{more}", line=line)


def _share(path: Path, line: int, word: str) -> float:
    try:
        share = float(word)
    except ValueError:
        share = np.nan
    if "_" in word or not np.isfinite(share):
        raise BadFile(path, f"{word[:40]!r} is no number", line=line)
    if not -_BESIDE <= share <= 1 + _BESIDE:
        said = f"{word[:40]} is no share of the image's width or height, 0 to 1; divide pixels by them"
        raise BadFile(path, said, line=line)
    return share


def _bbox(path: Path, line: int, shares: Sequence[float]) -> np.ndarray:
    cx, cy, w, h = shares
    if w <= 0 or h <= 0:
        raise BadFile(path, f"a rectangle of width {w:g} and height {h:g} holds nothing; take it out", line=line)
    return np.array([cx - w / 2, cy - h / 2, cx + w / 2, cy + h / 2])


def _label_files(folder: Path) -> list[Path]:
    """The text files that hold labels; where there are folders called labels, those in them alone."""
    files = [
        file
        for file in sorted(folder.rglob("*.txt"))
        if file.name not in _NO_LABELS and not file.name.startswith("README") and file.is_file()
    ]
    inside = [file for file in files if _LABELS in file.relative_to(folder).parts[:-1]]
    return inside or files


def _names_above(folder: Path, within: Path | None = None) -> Path | None:
    """The file of names in the folder, or the nearest above that is `within` what may be read."""
    for place in (folder, *folder.absolute().parents[:_PARENTS]):
        found = _names_file(place) if within is None or real(place).is_relative_to(real(within)) else None
        if found is not None:
            return found
    return None


def _names_file(folder: Path) -> Path | None:
    places = [*(folder / name for name in (*_YAML, *_LISTS)), folder / _LABELS / "classes.txt"]
    return next((place for place in places if place.is_file() and _has_names(place)), None)


def _has_names(file: Path) -> bool:
    if file.name not in _YAML:
        return True
    with file.open("rb") as data:
        return b"names" in data.read(_LARGEST_YAML)


def _names(file: Path) -> tuple[list[str], bool]:
    """The classes' names in their order, and whether rows hold keypoints."""
    if file.name not in _YAML:
        lines = file_bytes(file).decode(errors="replace").splitlines()
        while lines and not lines[-1].strip():
            lines.pop()
        names = [line.strip() for line in lines]
        if "" in names:
            raise BadFile(
                file, "a class without a name; a line is a class, and none may be empty", line=names.index("") + 1
            )
        return names, False
    data = file_bytes(file)
    if len(data) > _LARGEST_YAML:
        raise BadFile(file, f"is over {_LARGEST_YAML >> 10} KiB, which names of classes do not take")
    try:
        # All texts as they are: YAML would make a truth value of a class called `no`.
        content = cast("object", yaml.load(data, Loader=yaml.BaseLoader))
    except RecursionError as error:
        raise BadFile(file, "is nested too deeply for names of classes") from error
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        raise BadFile(file, "is no YAML", line=None if mark is None else mark.line + 1) from error
    entries = cast("dict[str, object]", content) if isinstance(content, dict) else {}
    return _listed_names(file, entries.get("names")), "kpt_shape" in entries


def _listed_names(file: Path, given: object) -> list[str]:
    """The names of a list, or of numbers from 0 with their names."""
    if isinstance(given, dict):
        numbered = cast("dict[object, object]", given)
        found = [numbered.get(str(number)) for number in range(len(numbered))]
    elif isinstance(given, list):
        found = cast("list[object]", given)
    else:
        found = [None]
    names = [name.strip() for name in found if isinstance(name, str) and name.strip()]
    if len(names) != len(found):
        raise BadFile(file, "`names` must be a list of the classes' names, or their numbers from 0 with their names")
    return names
