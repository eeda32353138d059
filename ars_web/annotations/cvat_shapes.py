"""The shapes of a CVAT file: boxes, polygons and masks as outlines and rectangles; image coordinates, as CVAT's are.

Source: https://docs.cvat.ai/docs/dataset_management/formats/format-cvat/ and the XML annotation format that it names
"""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ars_web.annotations.run_masks import mask_from_rows, outline_of
from ars_web.annotations.xml_elements import XmlElement
from ars_web.errors import BadFile, BadInput
from ars_web.geometry.polygon import Polygon

SHAPES = ("box", "polygon", "mask")
"""That are read."""

OTHER_SHAPES = ("ellipse", "polyline", "points", "cuboid", "skeleton", "tag")
"""That are not."""

_LARGEST = 1e9
_QUARTER_TURN = 90.0
_TURNED = 0.05
"""Degrees that a box may be off whole quarter turns."""


def attribute(file: Path, element: XmlElement, name: str) -> str:
    """An attribute's text.

    Raises:
        BadFile: it is missing.
    """
    if name not in element.attributes:
        raise BadFile(file, f"<{element.tag}> has no {name}", line=element.line)
    return element.attributes[name]


def number(file: Path, element: XmlElement, name: str) -> float:
    """An attribute's number.

    Raises:
        BadFile: it is missing, no number, or not finite.
    """
    return _number(file, element, name, attribute(file, element, name))


def whole_number(file: Path, element: XmlElement, name: str) -> int:
    """An attribute's whole number.

    Raises:
        BadFile: it is missing, or no whole number from 0.
    """
    found = number(file, element, name)
    if not found.is_integer() or found < 0:
        raise BadFile(file, f"<{element.tag}>: {name} must be a whole number, not {found:g}", line=element.line)
    return int(found)


def box_of(file: Path, element: XmlElement) -> np.ndarray:
    """x0, y0, x1, y1, rotation (degrees, clockwise in the image) of a <box>.

    Raises:
        BadFile: a number is missing or none, or the box has no width or height.
    """
    x0, y0, x1, y1 = (number(file, element, name) for name in ("xtl", "ytl", "xbr", "ybr"))
    if x1 <= x0 or y1 <= y0:
        raise BadFile(file, f"<box>: {x0:g}, {y0:g} to {x1:g}, {y1:g} has no width or height", line=element.line)
    rotation = number(file, element, "rotation") if "rotation" in element.attributes else 0.0
    return np.array([x0, y0, x1, y1, rotation])


def upright_box(box: np.ndarray) -> np.ndarray | None:
    """x0, y0, x1, y1 of a box turned by whole quarters of a circle; None where it is turned by anything else."""
    quarters = round(float(box[4]) / _QUARTER_TURN)
    if abs(float(box[4]) - quarters * _QUARTER_TURN) > _TURNED:
        return None
    if quarters % 2 == 0:
        return box[:4]
    middle, half = (box[:2] + box[2:4]) / 2, (box[2:4] - box[:2]) / 2
    return np.concatenate([middle - half[::-1], middle + half[::-1]])


def box_between(before: np.ndarray, after: np.ndarray, share: float) -> np.ndarray:
    """CVAT's own rule between two keyframes: sides move evenly, and a box turns the shorter way round."""
    turn = (after[4] - before[4] + 180.0) % 360.0 - 180.0
    between = before + share * (after - before)
    between[4] = before[4] + share * turn
    return between


def outline(file: Path, element: XmlElement) -> tuple[Polygon, ...]:
    """The outline of a <polygon> or a <mask>; none where a mask is empty.

    Raises:
        BadFile: it is none.
    """
    read: Callable[[Path, XmlElement], tuple[Polygon, ...]] = _mask if element.tag == "mask" else _polygon
    try:
        return read(file, element)
    except BadFile:
        raise
    except BadInput as error:
        raise BadFile(file, f"<{element.tag}>: {error}", line=element.line) from error


def _polygon(file: Path, element: XmlElement) -> tuple[Polygon, ...]:
    corners: list[list[float]] = []
    for pair in attribute(file, element, "points").split(";"):
        numbers = [_number(file, element, "points", text) for text in pair.split(",")]
        if len(numbers) != 2:
            raise BadFile(file, f"<polygon>: points must be x,y;x,y;…, not {pair[:40]!r}", line=element.line)
        corners.append(numbers)
    if len(corners) < 3:
        raise BadInput(f"a polygon needs three corners at least; this one has {len(corners)}")
    return (Polygon(np.array(corners)),)


def _mask(file: Path, element: XmlElement) -> tuple[Polygon, ...]:
    left, top, width, height = (whole_number(file, element, name) for name in ("left", "top", "width", "height"))
    runs = [_number(file, element, "rle", text) for text in attribute(file, element, "rle").split(",")]
    if any(not run.is_integer() for run in runs):
        raise BadInput("the runs of a mask must be whole numbers of pixels, none negative")
    return outline_of(mask_from_rows([int(run) for run in runs], width=width, height=height), left=left, top=top)


def _number(file: Path, element: XmlElement, name: str, text: str) -> float:
    try:
        found = float(text)
    except ValueError:
        found = math.nan
    if not abs(found) <= _LARGEST:
        raise BadFile(file, f"<{element.tag}>: {name} holds {text[:40]!r}, which is no number", line=element.line)
    return found
