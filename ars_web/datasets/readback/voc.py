"""Pascal VOC, read by the standard library's XML reader; VOC has no library of its own."""

from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from ars_web.datasets.readback.reader import Reader, ReadFrame, ReadLabel, Sizes
from ars_web.datasets.readback.yolo import own_reading
from ars_web.errors import BadFile


def _read(folder: Path, sizes: Sizes) -> Iterator[ReadFrame]:
    splits = {
        line: split
        for split in ("train", "val", "test")
        if (path := folder / "ImageSets" / "Main" / f"{split}.txt").is_file()
        for line in path.read_text(encoding="utf-8").splitlines()
    }
    for path in sorted((folder / "Annotations").iterdir()):
        try:
            root = ElementTree.parse(path).getroot()
        except ElementTree.ParseError as error:
            raise BadFile(path, f"is no XML: {error}", line=error.position[0]) from error
        labels: list[ReadLabel] = []
        for found in root.iter("object"):
            # Counted from 1, the last pixel included.
            x0, y0, x1, y1 = (_number(path, found, f"bndbox/{side}") for side in ("xmin", "ymin", "xmax", "ymax"))
            name = found.findtext("name") or ""
            labels.append(ReadLabel(name, bbox=np.array([x0 - 1, y0 - 1, x1, y1])))
        size = round(_number(path, root, "size/width")), round(_number(path, root, "size/height"))
        yield ReadFrame(path.stem, splits.get(path.stem), str(path), tuple(labels), image_size=size)


def _number(path: Path, element: ElementTree.Element, name: str) -> float:
    text = element.findtext(name)
    try:
        return float(text or "")
    except ValueError as error:
        raise BadFile(path, f"{name} is {text!r}, which is no number") from error


def _rounding(longer: int) -> float:
    # Half a pixel; an object smaller than one is written as one.
    return 1.0 if longer else 0.5


READER = Reader(format="voc", library=own_reading, read=_read, rounding=_rounding)
