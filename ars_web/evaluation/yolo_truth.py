"""A YOLO dataset as truth: data.yaml, images, and label files of boxes; of outlines and keypoints their rectangles.

Rows are `class cx cy w h` in shares of the image; of an outline (`class x y x y x y …`) the rectangle round its points
is taken, as trainers do, and of a row with keypoints the box that it begins with. Where the set has no images (exports
with `images: none`), rectangles stay shares unless the images' size is said: overlaps are the same, but nothing is
small or large.

Rows and names are read by `annotations/yolo_rows.py` and `yolo_names.py`. Which files there are is told otherwise than
for a session's labels: by the splits of data.yaml, images without a label file among them. A rectangle of no size
counts as missed; labels of a session need one that holds something.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import cast

import numpy as np
from jaxtyping import Float

from ars_web.annotations.yolo_names import YoloNames, read_names
from ars_web.annotations.yolo_rows import YoloRow, box_of, ring_of, rows_of
from ars_web.errors import BadFile
from ars_web.evaluation.detections import Truth, TruthImage
from ars_web.evaluation.image_names import ENDINGS, stem_of
from ars_web.evaluation.labels_read import LabelsRead
from ars_web.evaluation.truth_layout import SPLITS, TruthLayout, TruthOptions, chosen_split, size_of, text_lines

_UNSIZED = (1, 1)


@dataclass(frozen=True)
class _Yaml:
    """A data.yaml.

    Attributes:
        classes: their names, and how many numbers of keypoints rows have.
        splits: paths as they stand, by split.
        base: what they are relative to.
    """

    file: Path
    classes: YoloNames
    splits: dict[str, list[str]]
    base: Path


@dataclass(frozen=True)
class _Labelled:
    """An image by its name, its file where there is one, and where its labels are or would be."""

    name: str
    file: Path | None
    labels: Path


def _yaml_of(path: Path) -> Path | None:
    if path.is_file():
        return path if path.suffix.lower() in (".yaml", ".yml") else None
    found = [*sorted(path.glob("*.yaml")), *sorted(path.glob("*.yml"))]
    named = [file for file in found if file.stem == "data"]
    return named[0] if named else found[0] if len(found) == 1 else None


def _is_one(path: Path) -> bool:
    return _yaml_of(path) is not None


def _read(path: Path, options: TruthOptions) -> Truth:
    file = _yaml_of(path)
    if file is None:
        raise BadFile(path, "holds no data.yaml; a YOLO dataset has one, with names, train and val")
    told = _read_yaml(file)
    split = chosen_split(path, [name for name in SPLITS if name in told.splits], options.split)
    images: list[_Labelled] = []
    for name, entries in told.splits.items():
        if split in (None, name):
            found = [image for entry in entries for image in _images_of(told, name, entry)]
            if not found and split is not None:
                raise BadFile(file, f"split {name} is empty: {', '.join(entries)} holds no image and no label file")
            images.extend(found)
    without = sum(image.file is None for image in images)
    if 0 < without < len(images) and options.image_size is None:
        missing = next(image.name for image in images if image.file is None)
        raise BadFile(
            path, f"{without} of its {len(images)} images are missing, {missing} first; their sizes are needed"
        )
    return _truth(path, told, split, images, options)


def _truth(path: Path, told: _Yaml, split: str | None, images: Sequence[_Labelled], options: TruthOptions) -> Truth:
    classes = sorted(told.classes.names)
    class_of = {number: place for place, number in enumerate(classes)}
    labels = LabelsRead()
    sized = True
    for place, image in enumerate(images):
        size = size_of(image.file, options)
        sized = sized and size is not None
        labels.images.append(TruthImage(image.name, size, image.file))
        if not image.labels.is_file():
            continue  # An image without a label file shows nothing, as trainers have it.
        scale = np.tile(size or _UNSIZED, 2)
        for row in rows_of(image.labels):
            told.classes.name_of(image.labels, row)
            x0, y0, x1, y1 = (_bounds(image.labels, row, told.classes.keypoints) * scale).tolist()
            labels.add(place, class_of[row.number], (x0, y0, x1, y1))
    warnings = (
        ()
        if sized
        else (
            f"{path}: there are no images, so no sizes: overlaps are right, small and large are not told apart; say"
            " --image-size WxH where all images have one size",
        )
    )
    return labels.truth(
        path,
        "yolo",
        classes=[told.classes.names[number] for number in classes],
        split=split,
        numbers=tuple(classes),
        category_ids=None,
        in_pixels=sized,
        warnings=warnings,
    )


def _bounds(path: Path, row: YoloRow, keypoints: int) -> Float[np.ndarray, "4"]:
    ring = ring_of(path, row, keypoints=keypoints)
    return box_of(path, row) if ring is None else np.concatenate([ring.min(axis=0), ring.max(axis=0)])


def _read_yaml(file: Path) -> _Yaml:
    told = read_names(file)
    if len(set(told.names.values())) != len(told.names):
        raise BadFile(file, "two of its names are the same; name classes apart")
    splits = {split: _texts(file, split, told.values[split]) for split in SPLITS if told.values.get(split)}
    if not splits:
        raise BadFile(file, "names no split; it needs train or val, the folder of images")
    base = file.parent
    root = told.values.get("path")
    # Sets are moved: a path that is not there any more is where the file is now.
    if isinstance(root, str) and (base / root).is_dir():
        base = base / root
    return _Yaml(file, told, splits, base)


def _texts(file: Path, split: str, given: object) -> list[str]:
    texts = cast("list[object]", given) if isinstance(given, list) else [given]
    found = [text for text in texts if isinstance(text, str)]
    if len(found) != len(texts):
        raise BadFile(file, f"{split} must be a path, or a list of paths")
    return found


def _images_of(told: _Yaml, split: str, entry: str) -> list[_Labelled]:
    """The images of one path of a split: a folder, or a list of images in a text file."""
    # Some exports name `../train/images` beside the file itself.
    places = [told.base / entry, told.file.parent / entry, told.file.parent / entry.removeprefix("../")]
    for place in places:
        if place.is_file() and place.suffix == ".txt":
            return [_listed(told, place, line.strip()) for line in text_lines(place) if line.strip()]
        images = sorted(file for file in place.rglob("*") if file.suffix.lower() in ENDINGS) if place.is_dir() else []
        labels = _labels_beside(place)
        if images:
            return [_Labelled(_named(told, file), file, _labels_of(file)) for file in images]
        if labels.is_dir() and labels != place:
            files = sorted(labels.rglob("*.txt"))
            return [
                _Labelled(_named(told, place / file.relative_to(labels).with_suffix("")), None, file) for file in files
            ]
    if places[0].is_dir():
        return []
    raise BadFile(told.file, f"{split}: {entry} is not there, neither images nor labels; mend the path")


def _listed(told: _Yaml, listing: Path, line: str) -> _Labelled:
    places = [listing.parent / line, told.base / line]
    file = next((place for place in places if place.is_file()), None)
    place = file or next((place for place in places if _labels_of(place).is_file()), None)
    if place is None:
        raise BadFile(listing, f"lists {line}, of which there is neither an image nor a label file")
    return _Labelled(_named(told, place) if file else stem_of(_named(told, place)), file, _labels_of(place))


def _named(told: _Yaml, file: Path) -> str:
    file = file.resolve()
    base = told.base.resolve()
    return file.relative_to(base).as_posix() if file.is_relative_to(base) else file.as_posix()


def _labels_of(image: Path) -> Path:
    return _labels_beside(image.parent) / f"{stem_of(image.name)}.txt"


def _labels_beside(images: Path) -> Path:
    """The folder of labels for one of images: its last part called images becomes labels, as trainers have it."""
    parts = list(PurePosixPath(images.as_posix()).parts)
    for place in range(len(parts) - 1, -1, -1):
        if parts[place] == "images":
            parts[place] = "labels"
            break
    return Path(*parts)


LAYOUT = TruthLayout("yolo", "a folder with data.yaml (names, train, val), or that file", _is_one, _read)
