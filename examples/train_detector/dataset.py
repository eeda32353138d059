"""An exported set as its trainer reads it: the images of a split with their boxes, from a `coco` or a `yolo` folder."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from jaxtyping import Float, Int, UInt8

from ars_web.errors import BadFile, BadInput

Image = UInt8[np.ndarray, "h w 3"]
"""Red, green, blue."""


@dataclass(frozen=True, eq=False)
class Picture:
    """An image of a set.

    Attributes:
        id: by which predictions name it: COCO's number, or the file's name without its ending.
        file: where it lies.
        boxes: (k, 4) x0, y0, x1, y1 as shares of the image's width and height.
        classes: (k,) places in the set's class names.
    """

    id: int | str
    file: Path
    boxes: Float[np.ndarray, "k 4"]
    classes: Int[np.ndarray, "k"]


@dataclass(frozen=True, eq=False)
class Dataset:
    """One split of a set.

    Attributes:
        class_names: in order.
        categories: by what predictions name each class: COCO's number, or the name.
        pictures: in the set's order; those without an object, too.
    """

    class_names: tuple[str, ...]
    categories: tuple[int | str, ...]
    pictures: tuple[Picture, ...]


def read_dataset(folder: Path, *, split: str) -> Dataset:
    """A split of a dataset folder.

    Raises:
        BadInput: it is neither `coco` nor `yolo`, or the split is empty.
        BadFile: a file of it is damaged.
    """
    if (folder / "annotations").is_dir():
        read = _read_coco(folder, folder / "annotations" / f"instances_{split}.json")
    elif (folder / "data.yaml").is_file():
        read = _read_yolo(folder, split)
    else:
        raise BadInput(f"{folder}: no dataset of the formats coco or yolo; make one with ars-web export")
    if not read.pictures:
        raise BadInput(f"{folder}: the split {split} has no images; export it with a share above zero")
    return read


def load_image(file: Path, *, size: tuple[int, int]) -> Image:
    """An image, scaled to `size` (width, height) whatever its own shape is.

    Raises:
        BadFile: it cannot be read.
    """
    image = cv2.imread(str(file), cv2.IMREAD_COLOR_RGB)
    if image is None:
        raise BadFile(file, "cannot be read as an image")
    return cv2.resize(image, size, interpolation=cv2.INTER_AREA)


def _read_coco(folder: Path, file: Path) -> Dataset:
    try:
        content: dict[str, Any] = json.loads(file.read_bytes())
    except FileNotFoundError:
        raise BadInput(f"{file}: there is no such split; its file is missing") from None
    except ValueError as error:
        raise BadFile(file, f"is no JSON: {error}") from None
    try:
        categories = sorted(content["categories"], key=lambda one: one["id"])
        places = {one["id"]: place for place, one in enumerate(categories)}
        rows: dict[int, list[tuple[list[float], int]]] = {one["id"]: [] for one in content["images"]}
        for one in content["annotations"]:
            if not one["iscrowd"]:
                rows[one["image_id"]].append((one["bbox"], places[one["category_id"]]))
        pictures: list[Picture] = []
        for one in content["images"]:
            x, y, width, height = np.array([bbox for bbox, _ in rows[one["id"]]], dtype=np.float64).reshape(-1, 4).T
            boxes = np.stack([x, y, x + width, y + height], axis=1) / ([one["width"], one["height"]] * 2)
            classes = np.array([place for _, place in rows[one["id"]]], dtype=np.int64)
            pictures.append(Picture(one["id"], folder / "images" / one["file_name"], boxes, classes))
        names = tuple(one["name"] for one in categories)
    except (KeyError, TypeError, ValueError) as error:
        raise BadFile(file, f"is not COCO as ARS Web writes it: {error!r}") from None
    return Dataset(names, tuple(one["id"] for one in categories), tuple(pictures))


def _read_yolo(folder: Path, split: str) -> Dataset:
    names = _yolo_names(folder)
    images = sorted(path for path in (folder / "images" / split).glob("**/*") if path.is_file())
    pictures: list[Picture] = []
    for image in images:
        labels = folder / "labels" / image.relative_to(folder / "images").with_suffix(".txt")
        rows: list[list[float]] = []
        try:
            for number, line in enumerate(labels.read_text().splitlines(), start=1):
                row = [float(word) for word in line.split()]
                if len(row) != 5 or not 0 <= row[0] < len(names):
                    raise BadFile(labels, f"is no 'class cx cy w h' of {len(names)} classes: {line!r}", line=number)
                rows.append(row)
        except FileNotFoundError:
            raise BadFile(labels, "is missing; an image without objects has an empty one") from None
        except ValueError as error:
            raise BadFile(labels, f"holds what is no number: {error}") from None
        table = np.array(rows).reshape(-1, 5)
        middle, half = table[:, 1:3], table[:, 3:] / 2
        boxes = np.concatenate([middle - half, middle + half], axis=1)
        stem = image.relative_to(folder / "images" / split).with_suffix("").as_posix()
        pictures.append(Picture(stem, image, boxes, table[:, 0].astype(np.int64)))
    return Dataset(names, names, tuple(pictures))


def _yolo_names(folder: Path) -> tuple[str, ...]:
    file = folder / "dataset.json"
    try:
        return tuple(one["name"] for one in json.loads(file.read_bytes())["classes"])
    except (OSError, KeyError, TypeError, ValueError) as error:
        raise BadFile(file, f"does not tell the classes; export the set again: {error!r}") from None
