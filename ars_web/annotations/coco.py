"""COCO's instances_*.json: outlines as polygons or runs of pixels, and rectangles where there is no outline.

Polygons and rectangles are image coordinates. The polygons of an annotation are pieces of one object, joined where they
overlap. COCO itself does not say which annotations are one object in several images: `track_id`, `instance_id` or
`object_id` do where a program wrote them, in the annotation or its `attributes`; in a dataset of this program the
annotation's id does. A crowd is several objects in one outline; with such a number it is one.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import cast

import numpy as np
import shapely
from pydantic import Field

from ars_web.annotations.coco_file import CocoAnnotation, CocoFile, CocoImage, CocoPart, find, named, read_coco
from ars_web.annotations.foreign import (
    INSTANCE_NAMES,
    ForeignImage,
    ForeignLabels,
    ForeignOutline,
    ForeignRectangle,
    LeftOut,
)
from ars_web.annotations.run_masks import mask_from_columns, outline_of
from ars_web.errors import BadFile, BadInput
from ars_web.geometry.mask_regions import polygons_of, region
from ars_web.geometry.polygon import Polygon
from ars_web.recordings.options import ReadOptions

TITLE = "COCO instances"
NEEDS = "a JSON file with images, annotations and categories"

__all__ = ["NEEDS", "TITLE", "are_parts", "find", "read"]

_PARTS = "instances_"

_CROWD = (
    "it is marked as a crowd (iscrowd), which is several objects in one outline; where it is one, set iscrowd to 0 or"
    " give it a track_id"
)
_NOTHING = "it has neither an outline nor a rectangle"
_EMPTY = "its mask is empty"

_LARGEST = 1e9
"""Of any number of pixels."""


class _Annotation(CocoAnnotation):
    segmentation: object = None
    attributes: dict[str, object] = Field(default_factory=dict[str, object])
    track_id: int | str | None = None
    instance_id: int | str | None = None
    object_id: int | str | None = None

    @property
    def instance(self) -> str | None:
        """Which object it is, where the file says."""
        for name in INSTANCE_NAMES:
            for value in (getattr(self, name), self.attributes.get(name)):
                if isinstance(value, int | str) and not isinstance(value, bool) and str(value).strip():
                    return f"{name} {value}"
        return None


class _Dataset(CocoPart):
    """Of this program's dataset.json what says whose dataset it is."""

    program: str
    format: str


def are_parts(files: Sequence[Path]) -> bool:
    """Whether files are the splits of one set: instances_train.json, instances_val.json."""
    return all(file.name.startswith(_PARTS) for file in files)


def read(file: Path, options: ReadOptions) -> ForeignLabels:
    """Read a file of instances.

    Raises:
        BadFile: it is damaged; the message names the annotation by its id.
    """
    content = read_coco(file, CocoFile[_Annotation])
    names = {category.id: category.name for category in content.categories}
    places = {image.id: place for place, image in enumerate(content.images)}
    own = _own_instances(file, content, options)
    outlines: list[ForeignOutline] = []
    rectangles: list[ForeignRectangle] = []
    left_out: list[LeftOut] = []
    for row, one in enumerate(content.annotations):
        where = named(row, one)
        place, name = places[one.image_id], names[one.category_id]
        instance = one.instance or own.get(row)
        try:
            polygons = _polygons(one.segmentation, content.images[place])
            if one.iscrowd and instance is None:
                left_out.append(LeftOut(_CROWD, where))
                continue
            if polygons is None and one.bbox is not None:
                rectangles.append(ForeignRectangle(place, name, instance, _bbox(one.bbox), where))
                continue
        except BadInput as error:
            raise BadFile(file, f"{where} in {content.images[place].file_name}: {error}") from error
        if not polygons:
            left_out.append(LeftOut(_NOTHING if polygons is None else _EMPTY, where))
        else:
            outlines.append(ForeignOutline(place, name, instance, polygons, where))
    images = tuple(ForeignImage(name=image.file_name, size=image.size) for image in content.images)
    return ForeignLabels(
        "coco", file, images, outlines=tuple(outlines), rectangles=tuple(rectangles), left_out=tuple(left_out)
    )


def _polygons(segmentation: object, image: CocoImage) -> tuple[Polygon, ...] | None:
    """The outline; None where there is none, and no polygon where its mask is empty."""
    if segmentation is None or segmentation == []:
        return None
    if isinstance(segmentation, Mapping):
        runs = cast("Mapping[str, object]", segmentation)
        size = _whole(runs.get("size"), "the size of a mask, height and width,")
        if len(size) != 2:
            raise BadInput(f"the size of a mask is its height and width, not {size}")
        height, width = size
        if (image.width or width, image.height or height) != (width, height):
            raise BadInput(
                f"its mask has {width} x {height} pixels, its image {image.width} x {image.height}: the size of a"
                " mask is [height, width]"
            )
        counts = runs.get("counts")
        if not isinstance(counts, str):
            counts = _whole(counts, "the counts of a mask")
        return outline_of(mask_from_columns(counts, width=width, height=height))
    if not isinstance(segmentation, list):
        raise BadInput("a segmentation must be a list of polygons, or a mask with size and counts")
    pieces = [_polygon(piece) for piece in cast("list[object]", segmentation)]
    if len(pieces) == 1:
        return (pieces[0],)
    return polygons_of(shapely.union_all([region([piece]) for piece in pieces]))


def _polygon(piece: object) -> Polygon:
    numbers = _numbers(piece, "a polygon")
    if len(numbers) % 2 or len(numbers) < 6:
        raise BadInput(f"a polygon needs three corners at least, x and y of each; this one has {len(numbers)} numbers")
    return Polygon(np.array(numbers).reshape(-1, 2))


def _numbers(given: object, what: str) -> list[float]:
    numbers = cast("list[object]", given) if isinstance(given, list) else []
    found = [
        float(value)
        for value in numbers
        if isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= _LARGEST
    ]
    if not found or len(found) != len(numbers):
        raise BadInput(f"{what} must be a list of numbers up to {_LARGEST:g}, not {str(given)[:60]}")
    return found


def _whole(given: object, what: str) -> list[int]:
    numbers = _numbers(given, what)
    if any(not number.is_integer() for number in numbers):
        raise BadInput(f"{what} must be whole numbers, not {str(given)[:60]}")
    return [int(number) for number in numbers]


def _bbox(given: Sequence[float]) -> np.ndarray:
    if len(given) != 4 or not np.isfinite(given).all() or given[2] <= 0 or given[3] <= 0:
        raise BadInput(f"a bbox is x, y, width and height, the last two above zero, not {list(given)}")
    x, y, width, height = given
    return np.array([x, y, x + width, y + height], dtype=np.float64)


def _own_instances(file: Path, content: CocoFile[_Annotation], options: ReadOptions) -> dict[int, str]:
    """Which box each annotation is of, by its row, in a dataset that this program wrote; none in any other.

    Its ids are (image id - 1) * m + box + 1, where m, which is in no file, is the most boxes that a session has: the
    largest number for which every box is among m. Of several objects of a class the wrong m would make others.
    """
    dataset = file.parent.parent / "dataset.json"
    if options.within is not None and not dataset.resolve().is_relative_to(options.within.resolve()):
        return {}
    try:
        told = _Dataset.model_validate_json(dataset.read_bytes())
    except (OSError, ValueError):
        return {}  # There is none, or it is somebody else's.
    rows = [(row, one.id, one.image_id, one.category_id) for row, one in enumerate(content.annotations)]
    numbered = [(row, id_ - 1, image_id - 1, category) for row, id_, image_id, category in rows if id_ is not None]
    if told.program != "ars-web" or told.format != "coco" or len(numbered) != len(rows) or not rows:
        return {}
    later = [id_ // place for _, id_, place, _ in numbered if place > 0]
    most = min(later) if later else max(id_ for _, id_, _, _ in numbered) + 1
    boxes = {row: id_ - place * most for row, id_, place, _ in numbered}
    classes: dict[int, int] = {}
    for row, _, _, category in numbered:
        if not 0 <= boxes[row] < most or classes.setdefault(boxes[row], category) != category:
            return {}
    return {row: f"box {box}" for row, box in boxes.items()}
