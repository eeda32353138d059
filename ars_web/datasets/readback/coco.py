"""COCO, read by pycocotools where it is installed."""

import importlib.util
import json
from collections.abc import Iterator
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from ars_web.datasets.readback.reader import Reader, ReadFrame, ReadLabel, Sizes
from ars_web.errors import BadFile


def _library() -> str:
    return "pycocotools" if _has_pycocotools() else "this program's own reading; pycocotools is not installed"


def _has_pycocotools() -> bool:
    return importlib.util.find_spec("pycocotools") is not None


def _read(folder: Path, sizes: Sizes) -> Iterator[ReadFrame]:
    for path in sorted((folder / "annotations").glob("instances_*.json")):
        images, names, of_image = _index(path)
        for image in images:
            labels = tuple(_label(names, annotation) for annotation in of_image.get(image["id"], ()))
            yield ReadFrame(
                Path(image["file_name"]).stem,
                path.stem.removeprefix("instances_"),
                f"{path}, image {image['id']}",
                labels,
                image_size=(image["width"], image["height"]),
            )


def _index(path: Path) -> tuple[list[dict[str, Any]], dict[int, str], dict[int, list[dict[str, Any]]]]:
    """The images of a file, its categories' names, and its annotations by image."""
    if _has_pycocotools():
        from pycocotools.coco import COCO

        # It prints how long it took.
        with redirect_stdout(StringIO()):
            coco: Any = COCO(path)
        names = {i: category["name"] for i, category in coco.cats.items()}
        return list(coco.imgs.values()), names, {i: list(found) for i, found in coco.imgToAnns.items()}
    try:
        document = json.loads(path.read_bytes())
    except json.JSONDecodeError as error:
        raise BadFile(path, f"is no JSON: {error.msg}", line=error.lineno) from error
    of_image: dict[int, list[dict[str, Any]]] = {}
    for annotation in document["annotations"]:
        of_image.setdefault(annotation["image_id"], []).append(annotation)
    return document["images"], {c["id"]: c["name"] for c in document["categories"]}, of_image


def _label(names: dict[int, str], annotation: dict[str, Any]) -> ReadLabel:
    x, y, w, h = annotation["bbox"]
    ax, ay, aw, ah = annotation["amodal_bbox"]
    keypoints = np.array(annotation["keypoints"], dtype=np.float64).reshape(-1, 3)
    states = keypoints[:, 2].astype(np.int64)
    return ReadLabel(
        names[annotation["category_id"]],
        bbox=np.array([x, y, x + w, y + h]),
        bbox_amodal=np.array([ax, ay, ax + aw, ay + ah]),
        rings=tuple(np.array(ring).reshape(-1, 2) for ring in annotation["segmentation"]),
        # Keypoints are indices of pixels, whose centres are half a pixel further.
        points=np.where((states > 0)[:, None], keypoints[:, :2] + 0.5, np.nan),
        states=states,
        visible=annotation["visible"],
        truncated=annotation["truncated"],
    )


def _rounding(longer: int) -> float:
    # Two decimals, of which a corner of a ring has two.
    return 0.0071


READER = Reader(format="coco", library=_library, read=_read, rounding=_rounding, ring_function="outline")
