"""DOPE's NDDS JSON, read as its data's readme and NDDS' own files have it; it has no library of its own."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ars_web.datasets.readback.reader import Reader, ReadFrame, ReadLabel, Sizes
from ars_web.datasets.readback.yolo import own_reading
from ars_web.datasets.splits import SPLITS
from ars_web.datasets.writers.dope import CORNER_ORDER, UNSEEN_POINT
from ars_web.errors import BadFile
from ars_web.geometry.box import CORNER_SIGNS
from ars_web.geometry.rigid_transform import from_position_wxyz

_CM = 100.0

_PLACES = np.array([int(np.flatnonzero((CORNER_ORDER == signs).all(axis=1))[0]) for signs in CORNER_SIGNS])
"""Where in DOPE's order each of a box's corners is."""


def _read(folder: Path, sizes: Sizes) -> Iterator[ReadFrame]:
    for split in SPLITS:
        if not (folder / split).is_dir():
            continue
        settings = _document(folder / split / "_object_settings.json")
        # Poses of objects that look alike in several are not the boxes' own.
        alike = {
            entry["class"]
            for entry in settings["exported_objects"]
            if "symmetries_discrete" in entry or "symmetries_continuous" in entry
        }
        for path in sorted((folder / split).glob("*.json")):
            if path.name in ("_object_settings.json", "_camera_settings.json"):
                continue
            document = _document(path)
            camera = document["camera_data"]
            labels = tuple(_label(label, symmetric=label["class"] in alike) for label in document["objects"])
            yield ReadFrame(path.stem, split, str(path), labels, image_size=(camera["width"], camera["height"]))


def _document(path: Path) -> dict[str, Any]:
    try:
        return json.loads(path.read_bytes())
    except FileNotFoundError as error:
        raise BadFile(path, "is missing; without it this is no whole dataset") from error
    except json.JSONDecodeError as error:
        raise BadFile(path, f"is no JSON: {error.msg}", line=error.lineno) from error


def _label(label: dict[str, Any], *, symmetric: bool) -> ReadLabel:
    # y before x, and a pixel's centre at integers.
    (y0, x0), (y1, x1) = label["bounding_box"]["top_left"], label["bounding_box"]["bottom_right"]
    bbox, centre = np.array([x0, y0, x1, y1]) + 0.5, np.array(label["location"]) / _CM
    if symmetric:
        return ReadLabel(label["class"], bbox=bbox, centre_camera=centre)
    corners = np.array(label["projected_cuboid"], dtype=np.float64)[_PLACES]
    cuboid = np.array(label["cuboid"], dtype=np.float64)[_PLACES] / _CM
    x, y, z, w = label["quaternion_xyzw"]
    # Opposite corners along each axis: bit 2 of a corner's number is x, bit 1 y, bit 0 z.
    size = np.linalg.norm(cuboid[[4, 2, 1]] - cuboid[0], axis=1)
    return ReadLabel(
        label["class"],
        bbox=bbox,
        corners=np.where(corners == UNSEEN_POINT, np.nan, corners + 0.5),
        T_camera_box=from_position_wxyz(centre, np.array([w, x, y, z])),
        size=size,
    )


def _rounding(longer: int) -> float:
    # Four decimals of pixels; nine of a quaternion, which turn a corner by less.
    return 1e-3 if longer else 1e-4


READER = Reader(format="dope", library=own_reading, read=_read, rounding=_rounding)
