"""CVAT's XML, and the original program's raw dataset, as truth."""

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ars_web.annotations import cvat
from ars_web.annotations.foreign import ForeignImage
from ars_web.annotations.yolo_rows import YoloRow, box_of, rows_of
from ars_web.errors import BadFile
from ars_web.evaluation.detections import Truth, TruthImage
from ars_web.evaluation.image_names import ENDINGS, stem_of
from ars_web.evaluation.labels_read import LabelsRead
from ars_web.evaluation.truth_layout import (
    SPLITS,
    TruthLayout,
    TruthOptions,
    chosen_split,
    own_classes,
    size_of,
    text_lines,
)
from ars_web.recordings.options import NOTHING_SAID

_NUMBER = re.compile(r"\d{1,18}$")


def _is_cvat(path: Path) -> bool:
    return bool(cvat.find(path))


def _read_cvat(path: Path, options: TruthOptions) -> Truth:
    """Boxes as they stand, of polygons and masks the rectangles round them. Which split an image is of is not read."""
    files = cvat.find(path) or [path]
    if len(files) > 1:
        raise BadFile(path, f"holds several XML files: {', '.join(file.name for file in files)}; give one")
    chosen_split(path, (), options.split)
    read = cvat.read(files[0], NOTHING_SAID)
    bounds = [(one.image, one.class_name, one.bbox) for one in read.rectangles]
    for outline in read.outlines:
        points = np.concatenate([polygon.outer for polygon in outline.polygons])
        bounds.append((outline.image, outline.class_name, np.concatenate([points.min(axis=0), points.max(axis=0)])))
    bounds.sort(key=lambda one: one[0])
    own = own_classes(files[0].parent)
    classes = list(own or sorted({name for _, name, _ in bounds}))
    pictures = _numbered_pictures(files[0]) if any(one.name is None for one in read.images) else {}
    labels = LabelsRead(images=[_cvat_image(files[0], one, pictures, options) for one in read.images])
    for image, name, bbox in bounds:
        if name not in classes:
            raise BadFile(files[0].parent / "dataset.json", f"names no class {name!r}, which {files[0].name} has")
        x0, y0, x1, y1 = bbox.tolist()
        labels.add(image, classes.index(name), (x0, y0, x1, y1))
    warnings: list[str] = []
    if read.left_out:
        warnings.append(f"{files[0]}: {len(read.left_out)} shapes are no labels here: {read.left_out[0].reason}")
    if own is not None:
        warnings.append(
            f"{files[0]}: splits are not read from CVAT's files, so images of training count, too; to score one"
            " split, export the same as coco and give that"
        )
    return labels.truth(
        path,
        "cvat",
        classes=classes,
        split=None,
        numbers=None if own is None else tuple(range(len(classes))),
        warnings=warnings,
    )


def _cvat_image(file: Path, image: ForeignImage, pictures: Mapping[int, Path], options: TruthOptions) -> TruthImage:
    """A video's frames have numbers alone: they are called as CVAT calls their pictures, or as those are called."""
    size = image.size or options.image_size
    if image.name is not None:
        places = (file.parent / image.name, file.parent / "images" / image.name)
        return TruthImage(image.name, size, next((place for place in places if place.is_file()), None))
    number = image.number or 0
    picture = pictures.get(number)
    name = f"frame_{number:06d}" if picture is None else picture.relative_to(file.parent).as_posix()
    return TruthImage(name, size, picture, number)


def _numbered_pictures(file: Path) -> dict[int, Path]:
    """The pictures in images/ beside a file by the numbers that their names end with."""
    found: dict[int, Path] = {}
    for picture in sorted((file.parent / "images").rglob("*")):
        match = _NUMBER.search(stem_of(picture.name))
        if picture.suffix.lower() in ENDINGS and match is not None:
            found.setdefault(int(match[0]), picture)
    return found


def _is_ars(path: Path) -> bool:
    return (path / "labels").is_dir() and (path / "ids").is_dir()


def _read_ars(path: Path, options: TruthOptions) -> Truth:
    """`images/00000.jpg labels/00000.txt ids/00000.txt`, with lists of images for splits; classes have numbers only,
    unless this program wrote the set."""
    lists = {split: file for split in SPLITS if (file := path / f"{split}.txt").is_file()}
    split = chosen_split(path, list(lists), options.split)
    everything = {file.stem: file for file in sorted((path / "labels").glob("*.txt"))}
    stems = list(everything)
    if split is not None:
        stems = [Path(line.strip()).stem for line in text_lines(lists[split]) if line.strip()]
        if not stems:
            raise BadFile(lists[split], "is empty: the split has no image; choose another by --split")
    labels = LabelsRead()
    rows: list[tuple[int, YoloRow]] = []
    for place, stem in enumerate(stems):
        if stem not in everything:
            raise BadFile(path, f"labels/{stem}.txt is missing, which {split}.txt lists")
        file = next((found for found in sorted((path / "images").glob(f"{stem}.*"))), None)
        labels.images.append(
            TruthImage(f"images/{stem}" if file is None else f"images/{file.name}", size_of(file, options), file)
        )
        rows.extend((place, row) for row in rows_of(everything[stem]))
    own = own_classes(path)
    count = max((row.number for _, row in rows), default=-1) + 1
    classes = list(own or map(str, range(count)))
    sized = all(image.size is not None for image in labels.images)
    sizes = [(image.size if sized else None) or (1, 1) for image in labels.images]
    for place, row in rows:
        file = everything[stems[place]]
        if row.number >= len(classes) or len(row.values) != 4:
            raise BadFile(file, f"a row is class cx cy w h, with one of {len(classes)} classes from 0", line=row.line)
        x0, y0, x1, y1 = (box_of(file, row) * np.tile(sizes[place], 2)).tolist()
        labels.add(place, row.number, (x0, y0, x1, y1))
    return labels.truth(path, "ars", classes=classes, split=split, numbers=tuple(range(len(classes))), in_pixels=sized)


CVAT = TruthLayout("cvat", "CVAT's XML for images or for video", _is_cvat, _read_cvat)
ARS = TruthLayout("ars", "the original raw dataset: images, labels and ids", _is_ars, _read_ars)
