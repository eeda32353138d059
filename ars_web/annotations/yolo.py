"""YOLO's text files: one an image, a row an object, in shares of the image's width and height (`yolo_rows.py`).

The four corners of a turned rectangle are an outline, too; keypoints are left alone. Names of classes are in data.yaml,
classes.txt or obj.names (`yolo_names.py`). An empty file is an image that shows nothing. An image that has no file is
not listed: whether somebody looked at it is not known.

The files say nothing of the images' sizes. They have the names of the images, with another ending.

Source: https://docs.ultralytics.com/datasets/detect/ and segment/, obb/, pose/ beside it
"""

from collections.abc import Sequence
from pathlib import Path

from ars_web.annotations.foreign import ForeignImage, ForeignLabels, ForeignOutline, ForeignRectangle
from ars_web.annotations.yolo_names import read_names
from ars_web.annotations.yolo_rows import box_of, ring_of, rows_of
from ars_web.errors import BadFile
from ars_web.geometry.polygon import Polygon
from ars_web.recordings.options import ReadOptions, real

TITLE = "YOLO"
NEEDS = "text files of rows class cx cy w h, and data.yaml, classes.txt or obj.names with the classes' names"

_YAML = ("data.yaml", "data.yml", "dataset.yaml")
_LISTS = ("classes.txt", "obj.names")
_NO_LABELS = ("classes.txt", "labelmap.txt", "train.txt", "valid.txt", "val.txt", "test.txt", "trainval.txt")
_LABELS = "labels"
_PARENTS = 2
"""How far above labels/train its data.yaml may be."""

_HEAD = 1 << 18


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
    told = read_names(options.allowed(listed))
    images: list[ForeignImage] = []
    outlines: list[ForeignOutline] = []
    rectangles: list[ForeignRectangle] = []
    for path in _label_files(folder):
        place, name = len(images), path.relative_to(folder).as_posix()
        images.append(ForeignImage(name=name))
        for row in rows_of(options.allowed(path)):
            class_name, where = told.name_of(path, row), f"{name}, line {row.line}"
            ring = ring_of(path, row, keypoints=told.keypoints)
            if ring is not None:
                outlines.append(ForeignOutline(place, class_name, None, (Polygon(ring),), where))
                continue
            bbox = box_of(path, row)
            if (bbox[2:] <= bbox[:2]).any():
                width, height = row.values[2:4]
                said = f"a rectangle of width {width:g} and height {height:g} holds nothing; take it out"
                raise BadFile(path, said, line=row.line)
            rectangles.append(ForeignRectangle(place, class_name, None, bbox, where))
    if not images:
        raise BadFile(folder, "holds no label files: a text file for each image that was labelled, empty for none")
    return ForeignLabels(
        "yolo", folder, tuple(images), outlines=tuple(outlines), rectangles=tuple(rectangles), in_shares=True
    )


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
        return b"names" in data.read(_HEAD)
