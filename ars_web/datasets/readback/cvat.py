"""CVAT's XML, both for images and for video, read by the standard library's XML reader, element by element."""

from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from ars_web.datasets.readback.reader import Reader, ReadFrame, ReadLabel, Sizes
from ars_web.datasets.readback.yolo import own_reading
from ars_web.errors import BadFile

Element = ElementTree.Element


def _elements(path: Path, *tags: str) -> Iterator[Element]:
    """Whole elements of these names, each forgotten once the next is asked for."""
    parents: list[Element] = []
    try:
        for event, element in ElementTree.iterparse(path, events=("start", "end")):
            if event == "start":
                parents.append(element)
                continue
            parents.pop()
            if element.tag in tags:
                yield element
                parents[-1].remove(element)
    except ElementTree.ParseError as error:
        raise BadFile(path, f"is no XML: {error}", line=error.position[0]) from error


def _value(path: Path, element: Element, name: str) -> str:
    value = element.get(name)
    if value is None:
        raise BadFile(path, f"<{element.tag}> has no {name}")
    return value


def _number(path: Path, text: str | None, name: str) -> float:
    try:
        return float(text or "")
    except ValueError as error:
        raise BadFile(path, f"{name} is {text!r}, which is no number") from error


def _label(path: Path, element: Element, label: str) -> ReadLabel:
    shares = {_value(path, a, "name"): a.text for a in element.iter("attribute")}
    visible, truncated = (_number(path, shares.get(name), name) for name in ("visible", "truncated"))
    if element.tag == "polygon":
        points = [pair.split(",") for pair in _value(path, element, "points").split(";")]
        ring = np.array([[_number(path, c, "points") for c in point] for point in points])
        return ReadLabel(label, rings=(ring,), visible=visible, truncated=truncated)
    sides = [_number(path, element.get(side), side) for side in ("xtl", "ytl", "xbr", "ybr")]
    return ReadLabel(label, bbox=np.array(sides), visible=visible, truncated=truncated)


def _read_images(folder: Path, sizes: Sizes) -> Iterator[ReadFrame]:
    path = folder / "annotations.xml"
    for image in _elements(path, "image"):
        labels = tuple(_label(path, e, _value(path, e, "label")) for e in image if e.tag in ("box", "polygon"))
        size = (
            round(_number(path, image.get("width"), "width")),
            round(_number(path, image.get("height"), "height")),
        )
        name = _value(path, image, "name")
        yield ReadFrame(
            Path(name).stem,
            _value(path, image, "subset"),
            f"{path}, image {_value(path, image, 'id')}",
            labels,
            image_size=size,
        )


def _read_tracks(folder: Path, sizes: Sizes) -> Iterator[ReadFrame]:
    path = folder / "annotations.xml"
    splits = {
        Path(line).stem: listed.stem
        for listed in sorted(folder.glob("*.txt"))
        for line in listed.read_text(encoding="utf-8").splitlines()
    }
    count = 0
    of_frame: dict[int, list[ReadLabel]] = {}
    for element in _elements(path, "meta", "track"):
        if element.tag == "meta":
            count = round(_number(path, element.findtext("task/size"), "size"))
            continue
        for box in element.iter("box"):
            if box.get("outside") == "0":
                frame = round(_number(path, box.get("frame"), "frame"))
                of_frame.setdefault(frame, []).append(_label(path, box, _value(path, element, "label")))
    for frame in range(max([count, *(number + 1 for number in of_frame)])):
        stem = f"{frame:05d}"
        yield ReadFrame(stem, splits.get(stem), f"{path}, frame {frame}", tuple(of_frame.get(frame, ())))


def _rounding(longer: int) -> float:
    # Two decimals, of which a corner of a ring has two.
    return 0.0071


READER = Reader(format="cvat", library=own_reading, read=_read_images, rounding=_rounding)
POLYGONS = Reader(
    format="cvat-polygons", library=own_reading, read=_read_images, rounding=_rounding, ring_function="outline"
)
TRACKS = Reader(format="cvat-video", library=own_reading, read=_read_tracks, rounding=_rounding)
