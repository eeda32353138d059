"""COCO's instances_*.json as truth: rectangles as they stand, crowds ignored, areas by which sizes are told.

Files are found and read by `annotations/coco_file.py`. Of an annotation a truth wants its rectangle alone, of no size
perhaps, which then counts as missed; labels of a session come of outlines, and need a rectangle that holds something.
"""

import re
from pathlib import Path

from ars_web.annotations import coco_file
from ars_web.annotations.coco_file import CocoAnnotation, CocoFile, CocoImage, named, read_coco
from ars_web.errors import BadFile
from ars_web.evaluation.detections import Truth, TruthImage
from ars_web.evaluation.labels_read import LabelsRead
from ars_web.evaluation.truth_layout import SPLITS, TruthLayout, TruthOptions, chosen_split

# COCO's own files carry the year: instances_val2017.json.
_SPLIT = re.compile(r"instances_(train|val|test)\d*\.json")


class _Annotation(CocoAnnotation):
    area: float | None = None
    ignore: int = 0


def _is_one(path: Path) -> bool:
    return bool(coco_file.find(path))


def _read(path: Path, options: TruthOptions) -> Truth:
    found = coco_file.find(path) or [path]
    by_split = {match[1]: file for file in found if (match := _SPLIT.fullmatch(file.name))}
    if path.is_file() or not by_split:
        if len(found) > 1:
            named = ", ".join(file.name for file in found)
            raise BadFile(path, f"holds several files of instances: {named}; give the one that is meant")
        chosen_split(path, (), options.split)
        return _joined(path, found, options, None)
    split = chosen_split(path, [name for name in SPLITS if name in by_split], options.split)
    files = [by_split[name] for name in SPLITS if name in by_split and split in (None, name)]
    return _joined(path, files, options, split)


def _joined(path: Path, files: list[Path], options: TruthOptions, split: str | None) -> Truth:
    labels = LabelsRead()
    names: dict[int, str] = {}
    contents = [read_coco(file, CocoFile[_Annotation]) for file in files]
    for file, content in zip(files, contents, strict=True):
        for category in content.categories:
            if names.setdefault(category.id, category.name) != category.name:
                raise BadFile(
                    file, f"category {category.id} is {category.name!r} here and {names[category.id]!r} before"
                )
    ids = sorted(names)
    if len(set(names.values())) != len(ids):
        raise BadFile(files[0], "two of its categories have one name; name them apart")
    class_of = {id_: place for place, id_ in enumerate(ids)}
    found: dict[int, TruthImage] = {}
    for file, content in zip(files, contents, strict=True):
        root, part = _root(path), file.stem.removeprefix("instances_")
        # COCO's own images of instances_val2017.json are in val2017/.
        roots = [root, root / "images", root / part, root / "images" / part]
        for image in content.images:
            if image.id in found:
                raise BadFile(file, f"image id {image.id} is that of another image in the files before; give one file")
            found[image.id] = _image(image, roots, options)
    # By their ids, as pycocotools goes through them: of predictions of one score the earlier image's come first.
    labels.images.extend(found[id_] for id_ in sorted(found))
    places = {id_: place for place, id_ in enumerate(sorted(found))}
    for file, content in zip(files, contents, strict=True):
        _take_annotations(file, content, labels, places, class_of)
    sized = all(image.size is not None for image in labels.images)
    return labels.truth(
        path,
        "coco",
        classes=[names[id_] for id_ in ids],
        split=split,
        # Programs that number classes from 0 take COCO's categories in the order of their ids.
        numbers=tuple(range(len(ids))),
        category_ids=tuple(ids),
        warnings=() if sized else ("some images have no width and height: YOLO predictions of those cannot be read",),
    )


def _take_annotations(
    file: Path, content: CocoFile[_Annotation], labels: LabelsRead, places: dict[int, int], class_of: dict[int, int]
) -> None:
    for row, one in enumerate(content.annotations):
        where = named(row, one)
        if one.bbox is None or len(one.bbox) != 4:
            raise BadFile(file, f"{where}: bbox must be x, y, width and height, not {one.bbox}")
        x, y, width, height = one.bbox
        if not all(abs(value) <= 1e9 for value in one.bbox) or width < 0 or height < 0:
            raise BadFile(file, f"{where}: bbox {one.bbox} must be finite, with no negative width or height")
        if one.area is not None and not 0 <= one.area <= 1e18:
            raise BadFile(file, f"{where}: area {one.area:g} must be finite and not negative")
        crowd = bool(one.iscrowd)
        labels.add(
            places[one.image_id],
            class_of[one.category_id],
            (x, y, x + width, y + height),
            # COCO itself lets iscrowd alone decide; files of others mark what is to be ignored by `ignore`.
            ignored=crowd or bool(one.ignore),
            crowd=crowd,
            area=one.area,
        )


def _root(path: Path) -> Path:
    folder = path.parent if path.is_file() else path
    return folder.parent if folder.name == "annotations" else folder


def _image(image: CocoImage, roots: list[Path], options: TruthOptions) -> TruthImage:
    size = image.size or options.image_size
    file = next((found for root in roots if (found := root / image.file_name).is_file()), None)
    return TruthImage(image.file_name, size, file, image.id)


LAYOUT = TruthLayout("coco", "a COCO file, or a folder with annotations/instances_*.json", _is_one, _read)
