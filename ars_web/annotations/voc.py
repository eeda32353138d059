"""Pascal VOC's XML files, one an image: rectangles in whole pixels, counted from 1, the last pixel included.

Programs that count from 0 write the same files; their rectangles come out one pixel too far left and up at the first
sides, which nothing in a file tells. `pose`, `truncated` and `occluded` play no part, and `difficult` only where
detectors are judged; parts of objects (`part`) are no objects.

Source: http://host.robots.ox.ac.uk/pascal/VOC/voc2012/htmldoc/index.html, "Annotation guidelines" and 4.4
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ars_web.annotations.foreign import ForeignImage, ForeignLabels, ForeignRectangle
from ars_web.annotations.xml_elements import XmlElement, elements_of
from ars_web.errors import BadFile
from ars_web.recordings.options import ReadOptions

TITLE = "Pascal VOC"
NEEDS = "an XML file for each image, in the folder or its Annotations/"

_FOLDER = "Annotations"
_HEAD = 1 << 10
_SIDES = ("xmin", "ymin", "xmax", "ymax")
_LARGEST = 1e9


def find(path: Path) -> list[Path]:
    """The XML files of images at `path`, in the folder or its Annotations/.

    Where one in a folder called Annotations is of an image all there are: one that is not is damaged, and reading it
    says so.
    """
    if not path.is_dir():
        return [path] if path.suffix == ".xml" and _is_one(path) else []
    found: list[Path] = []
    for place in (path, path / _FOLDER):
        files = sorted(place.glob("*.xml"))
        everything = place.name == _FOLDER and any(map(_is_one, files))
        found.extend(files if everything else filter(_is_one, files))
    return found


def are_parts(files: Sequence[Path]) -> bool:
    """Whether files are parts of one set: each is one image, and a folder holds a set."""
    return len({file.parent for file in files}) == 1


def _is_one(file: Path) -> bool:
    if not file.is_file():
        return False
    with file.open("rb") as data:
        head = data.read(_HEAD)
    return b"<annotation>" in head or b"<annotation " in head


@dataclass(frozen=True, eq=False)
class VocObject:
    """One object.

    Attributes:
        bbox: (4,) x0, y0, x1, y1, image coordinates.
        is_difficult: marked as one that nobody need find.
        line: on which it begins.
    """

    class_name: str
    bbox: Float[np.ndarray, "4"]
    is_difficult: bool
    line: int


@dataclass(frozen=True, eq=False)
class VocImage:
    """One image's file.

    Attributes:
        name: of the image's file; None: it is not told.
        size: width and height in pixels; None: it is not told.
    """

    name: str | None
    size: tuple[int, int] | None
    objects: tuple[VocObject, ...]


def read_image(file: Path) -> VocImage:
    """Read one image's file.

    Raises:
        BadFile: it is damaged; the message names the line.
    """
    name, size = None, None
    objects: list[VocObject] = []
    for element in elements_of(file, root="annotation"):
        if element.tag == "filename" and element.text.strip():
            name = element.text.strip()
        elif element.tag == "size":
            size = _size(file, element)
        elif element.tag == "object":
            difficult = element.child("difficult")
            is_difficult = difficult is not None and difficult.text.strip() not in ("", "0")
            bbox = _bbox(file, element)
            objects.append(VocObject(_text(file, element, "name"), bbox, is_difficult, element.line))
    return VocImage(name, size, tuple(objects))


def read(file: Path, options: ReadOptions) -> ForeignLabels:
    """Read one image's file.

    Raises:
        BadFile: it is damaged; the message names the line.
    """
    image = read_image(file)
    rectangles = [
        ForeignRectangle(0, one.class_name, None, one.bbox, f"object {place}, line {one.line}")
        for place, one in enumerate(image.objects)
    ]
    shown = ForeignImage(name=image.name or file.name, size=image.size)
    return ForeignLabels("voc", file, (shown,), rectangles=tuple(rectangles))


def _size(file: Path, element: XmlElement) -> tuple[int, int] | None:
    """Width and height; None where they are not told, for which some programs write zeros."""
    sides = [_number(file, element, side) for side in ("width", "height")]
    if any(not side.is_integer() or side < 0 for side in sides):
        raise BadFile(file, "<size> must hold width and height in whole pixels", line=element.line)
    width, height = (int(side) for side in sides)
    return (width, height) if width and height else None


def _bbox(file: Path, element: XmlElement) -> np.ndarray:
    """x0, y0, x1, y1 in image coordinates."""
    box = element.child("bndbox")
    if box is None:
        raise BadFile(file, "<object> has no <bndbox>", line=element.line)
    x0, y0, x1, y1 = (_number(file, box, side) for side in _SIDES)
    if x1 < x0 or y1 < y0:
        said = f"<bndbox>: {x0:g}, {y0:g} to {x1:g}, {y1:g} ends before it begins"
        raise BadFile(file, said, line=box.line)
    return np.array([x0 - 1, y0 - 1, x1, y1])


def _number(file: Path, element: XmlElement, tag: str) -> float:
    text = _text(file, element, tag)
    try:
        number = float(text)
    except ValueError:
        number = np.nan
    if "_" in text or not abs(number) <= _LARGEST:
        raise BadFile(file, f"<{tag}> holds {text[:40]!r}, which is no number", line=_line(element, tag))
    return number


def _text(file: Path, element: XmlElement, tag: str) -> str:
    child = element.child(tag)
    if child is None or not child.text.strip():
        raise BadFile(file, f"<{element.tag}> has no {tag}", line=_line(element, tag))
    return child.text.strip()


def _line(element: XmlElement, tag: str) -> int:
    child = element.child(tag)
    return element.line if child is None else child.line
