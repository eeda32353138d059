"""A YOLO dataset as truth: data.yaml, images, and label files of boxes; of outlines and keypoints their rectangles.

Rows are `class cx cy w h` in shares of the image; of an outline (`class x y x y …`) the rectangle round its points is
taken, as trainers do, and of a row with keypoints the box that it begins with. Where the set has no images (exports
with `images: none`), rectangles stay shares unless the images' size is said: overlaps are the same, but nothing is
small or large.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import cast

import yaml

from ars_web.errors import BadFile
from ars_web.evaluation.detections import Truth, TruthImage
from ars_web.evaluation.image_names import ENDINGS, stem_of
from ars_web.evaluation.labels_read import LabelsRead
from ars_web.evaluation.truth_layout import SPLITS, TruthLayout, TruthOptions, chosen_split, size_of, text_lines
from ars_web.evaluation.yolo_rows import Rectangle, rectangle, rows_of

_UNSIZED = (1, 1)


@dataclass(frozen=True)
class _Yaml:
    """A data.yaml.

    Attributes:
        names: by class number.
        splits: paths as they stand, by split.
        base: what they are relative to.
        keypoints: numbers a row has after its box; 0: rows have no keypoints.
    """

    file: Path
    names: dict[int, str]
    splits: dict[str, list[str]]
    base: Path
    keypoints: int


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
    classes = sorted(told.names)
    class_of = {number: place for place, number in enumerate(classes)}
    labels = LabelsRead()
    sized = True
    for place, image in enumerate(images):
        size = size_of(image.file, options)
        sized = sized and size is not None
        labels.images.append(TruthImage(image.name, size, image.file))
        if not image.labels.is_file():
            continue  # An image without a label file shows nothing, as trainers have it.
        for line, number, numbers in rows_of(image.labels):
            if number not in class_of:
                known = ", ".join(f"{n}: {told.names[n]}" for n in classes[:8])
                raise BadFile(image.labels, f"class {number} is none of {told.file.name}'s ({known})", line=line)
            labels.add(place, class_of[number], _bounds(image.labels, line, numbers, told.keypoints, size or _UNSIZED))
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
        classes=[told.names[number] for number in classes],
        split=split,
        numbers=tuple(classes),
        category_ids=None,
        in_pixels=sized,
        warnings=warnings,
    )


def _bounds(path: Path, line: int, numbers: list[float], keypoints: int, size: tuple[int, int]) -> Rectangle:
    if len(numbers) == 4 or (keypoints and len(numbers) == 4 + keypoints):
        return rectangle(path, line, numbers[:4], size)
    if len(numbers) < 6 or len(numbers) % 2 or keypoints:
        row = "class cx cy w h" + (
            f" and {keypoints} numbers of keypoints" if keypoints else ", or class x y x y x y …"
        )
        raise BadFile(path, f"has {len(numbers)} numbers after the class; a row is {row}", line=line)
    x, y = numbers[0::2], numbers[1::2]
    x0, y0, x1, y1 = min(x), min(y), max(x), max(y)
    return rectangle(path, line, [(x0 + x1) / 2, (y0 + y1) / 2, x1 - x0, y1 - y0], size)


def _read_yaml(file: Path) -> _Yaml:
    try:
        # BaseLoader makes texts, lists and mappings, nothing else: a class may be called `no` or `1`.
        content = cast("object", yaml.load("\n".join(text_lines(file)), Loader=yaml.BaseLoader))
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        line = None if mark is None else int(mark.line) + 1
        raise BadFile(file, f"is no YAML: {getattr(error, 'problem', None) or error}", line=line) from error
    if not isinstance(content, dict):
        raise BadFile(file, "is no mapping; it needs names, train and val")
    values = cast("dict[str, object]", content)
    names = _names(file, values.get("names"))
    splits = {split: _texts(file, split, values[split]) for split in SPLITS if values.get(split)}
    if not splits:
        raise BadFile(file, "names no split; it needs train or val, the folder of images")
    base = file.parent
    root = values.get("path")
    # Sets are moved: a path that is not there any more is where the file is now.
    if isinstance(root, str) and (base / root).is_dir():
        base = base / root
    return _Yaml(file, names, splits, base, _keypoints(file, values.get("kpt_shape")))


def _names(file: Path, given: object) -> dict[int, str]:
    if isinstance(given, list):
        pairs = [(str(place), name) for place, name in enumerate(cast("list[object]", given))]
    elif isinstance(given, dict):
        pairs = list(cast("dict[str, object]", given).items())
    else:
        raise BadFile(file, "has no names; give the classes as a list, or by their numbers")
    names: dict[int, str] = {}
    for key, name in pairs:
        if not key.isdecimal() or not isinstance(name, str) or not name:
            raise BadFile(file, f"names: {key!r}: {str(name)[:40]!r} is no class; they are NUMBER: NAME")
        names[int(key)] = name
    if not names or len(set(names.values())) != len(names):
        raise BadFile(file, "names no class" if not names else "two of its names are the same; name classes apart")
    return names


def _texts(file: Path, split: str, given: object) -> list[str]:
    texts = cast("list[object]", given) if isinstance(given, list) else [given]
    found = [text for text in texts if isinstance(text, str)]
    if len(found) != len(texts):
        raise BadFile(file, f"{split} must be a path, or a list of paths")
    return found


def _keypoints(file: Path, given: object) -> int:
    if given is None:
        return 0
    texts = cast("list[object]", given) if isinstance(given, list) else []
    if len(texts) != 2 or not all(isinstance(text, str) and text.isdecimal() for text in texts):
        raise BadFile(file, f"kpt_shape must be [points, 2 or 3], not {given}")
    return int(str(texts[0])) * int(str(texts[1]))


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
