"""BOP scenes, read as docs/bop_datasets_format.md of the BOP toolkit says; the toolkit is no package that installs
from an index."""

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from jaxtyping import Float

from ars_web.datasets.readback.reader import Reader, ReadFrame, ReadLabel, ReadMask, Sizes
from ars_web.datasets.readback.yolo import own_reading
from ars_web.datasets.splits import SPLITS
from ars_web.errors import BadFile
from ars_web.geometry import rigid_transform

_MM = 1000.0


def _read(folder: Path, sizes: Sizes) -> Iterator[ReadFrame]:
    objects = _document(folder / "objects.json")
    names = {i: entry["class"] for i, entry in objects.items()}
    extents = {i: np.array(entry["size_mm"], dtype=np.float64) / _MM for i, entry in objects.items()}
    for split in SPLITS:
        for scene in sorted((folder / split).glob("*")):
            path = scene / "scene_gt.json"
            for image, labels in _document(path).items():
                stem = f"{int(image):06d}"
                found = (_label(path, image, label, names, extents) for label in labels)
                masked = tuple(_with_masks(scene, f"{stem}_{i:06d}.png", label) for i, label in enumerate(found))
                yield ReadFrame(stem, split, f"{path}, image {image}", masked)


def _with_masks(scene: Path, name: str, label: ReadLabel) -> ReadLabel:
    """The label with its masks, where the dataset has some."""
    if not (scene / "mask").is_dir():
        return label
    return replace(label, mask=_mask(scene / "mask" / name), visible_mask=_mask(scene / "mask_visib" / name))


def _mask(path: Path) -> ReadMask:
    pixels = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    if pixels is None:
        raise BadFile(path, "is missing, or no PNG")
    return ReadMask(0, 0, pixels > 0)


def _document(path: Path) -> dict[str, Any]:
    try:
        return json.loads(path.read_bytes())
    except FileNotFoundError as error:
        raise BadFile(path, "is missing; without it this is no whole dataset") from error
    except json.JSONDecodeError as error:
        raise BadFile(path, f"is no JSON: {error.msg}", line=error.lineno) from error


def _label(
    path: Path,
    image: str,
    label: dict[str, Any],
    names: dict[str, str],
    extents: dict[str, Float[np.ndarray, "3"]],
) -> ReadLabel:
    number = str(label["obj_id"])
    if number not in names:
        raise BadFile(path, f"image {image} has object {number}, which objects.json has not")
    R = np.array(label["cam_R_m2c"], dtype=np.float64).reshape(3, 3)
    T_camera_box = rigid_transform.from_rotation(R, np.array(label["cam_t_m2c"], dtype=np.float64) / _MM)
    return ReadLabel(names[number], T_camera_box=T_camera_box, size=extents[number])


def _rounding(longer: int) -> float:
    # The sizes of one object's boxes differ by a tenth of a millimetre at most: so much half a metre away.
    return 2e-4 * longer


READER = Reader(format="bop", library=own_reading, read=_read, rounding=_rounding)
