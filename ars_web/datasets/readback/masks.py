"""Sets of masks, read by OpenCV's PNG reader."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from ars_web.datasets.readback.reader import Reader, ReadFrame, ReadLabel, ReadMask, Sizes
from ars_web.errors import BadFile


def _library() -> str:
    return "OpenCV's PNG reader"


def _read(folder: Path, sizes: Sizes) -> Iterator[ReadFrame]:
    names = {a_class["value"]: a_class["name"] for a_class in _document(folder / "classes.json")}
    for path in sorted((folder / "masks").glob("*.json")):
        for image in _document(path):
            yield _frame(folder / "masks", path.stem, image, names)


def _document(path: Path) -> list[dict[str, Any]]:
    try:
        return json.loads(path.read_bytes())
    except json.JSONDecodeError as error:
        raise BadFile(path, f"is no JSON: {error.msg}", line=error.lineno) from error


def _frame(masks: Path, split: str, image: dict[str, Any], names: dict[int, str]) -> ReadFrame:
    file = masks / "instances" / image["masks"]
    instances, classes = _values(file, np.uint16), _values(masks / "classes" / image["masks"], np.uint8)
    labels: list[ReadLabel] = []
    for an_object in image["objects"]:
        seen = instances == an_object["id"]
        if int(seen.sum()) != an_object["pixels"]:
            raise BadFile(file, f"box {an_object['id']} has {seen.sum()} pixels, not {an_object['pixels']}")
        if an_object["class"] not in names:
            raise BadFile(file, f"{an_object['class']} is no class; those are {sorted(names)}")
        labels.append(ReadLabel(names[an_object["class"]], visible_mask=ReadMask(0, 0, seen)))
    class_of = {0: 0} | {an_object["id"]: an_object["class"] for an_object in image["objects"]}
    for value in np.unique(instances).tolist():
        if value not in class_of:
            raise BadFile(file, f"has pixels of box {value}, which is none of the image's objects")
        found = np.unique(classes[instances == value]).tolist()
        if found != [class_of[value]]:
            raise BadFile(file, f"the pixels of box {value} are of class {found}, not {class_of[value]}")
    height, width = instances.shape
    return ReadFrame(Path(image["image"]).stem, split, str(file), tuple(labels), image_size=(width, height))


def _values(path: Path, kind: type[np.unsignedinteger[Any]]) -> np.ndarray:
    values = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if values is None or values.dtype != kind or values.ndim != 2:
        raise BadFile(path, f"is no PNG of grey values of {8 * np.dtype(kind).itemsize} bits")
    return values


def _rounding(longer: int) -> float:
    # Pixels are counted, not measured.
    return 0.0


READER = Reader(format="masks", library=_library, read=_read, rounding=_rounding)
