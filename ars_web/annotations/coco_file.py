"""COCO's instances_*.json as they stand: images, categories and annotations that are of them.

Who reads a file says what of an annotation it wants, since outlines are most of a file and truths want none.
"""

from pathlib import Path
from typing import Generic, TypeVar

from pydantic import BaseModel, ConfigDict

from ars_web.errors import BadFile
from ars_web.recordings.json_file import holds_words, parse_json
from ars_web.recordings.number_rows import file_bytes

_OF_BOP = "scene_gt"


class CocoPart(BaseModel):
    model_config = ConfigDict(extra="ignore", frozen=True)


class CocoImage(CocoPart):
    id: int
    file_name: str
    width: int | None = None
    height: int | None = None

    @property
    def size(self) -> tuple[int, int] | None:
        """Width and height; None where they are not told, for which some programs write zeros."""
        return (self.width, self.height) if self.width and self.height else None


class CocoCategory(CocoPart):
    id: int
    name: str


class CocoAnnotation(CocoPart):
    """What every reader wants of one; `id` is missing in files of some programs."""

    id: int | None = None
    image_id: int
    category_id: int
    bbox: list[float] | None = None
    iscrowd: int = 0


Annotation = TypeVar("Annotation", bound=CocoAnnotation)


class CocoFile(CocoPart, Generic[Annotation]):
    images: list[CocoImage]
    annotations: list[Annotation]
    categories: list[CocoCategory]


def find(path: Path) -> list[Path]:
    """The JSON files of instances at `path`, in the folder or in its annotations/."""
    if path.is_dir():
        files = [*sorted(path.glob("*.json")), *sorted(path.glob("annotations/*.json"))]
        # A BOP scene has its boxes as COCO, too, which say less than its poses.
        return [file for file in files if not file.name.startswith(_OF_BOP) and _is_one(file)]
    return [path] if _is_one(path) else []


def _is_one(file: Path) -> bool:
    return holds_words(file, (b'"images"', b'"annotations"', b'"categories"'))


def read_coco(file: Path, model: type[CocoFile[Annotation]]) -> CocoFile[Annotation]:
    """A file whose annotations are each of one of its images and of one of its categories.

    Raises:
        BadFile: it is damaged, or they are not; the message names the annotation by its id.
    """
    content = parse_json(file, file_bytes(file), model)
    images: set[int] = set()
    for image in content.images:
        if image.id in images:
            raise BadFile(file, f"image id {image.id} is there twice; ids tell images apart")
        images.add(image.id)
    categories = {category.id for category in content.categories}
    for row, one in enumerate(content.annotations):
        if one.image_id not in images:
            raise BadFile(file, f"{named(row, one)}: there is no image {one.image_id} among its images")
        if one.category_id not in categories:
            raise BadFile(file, f"{named(row, one)}: there is no category {one.category_id} among its categories")
    return content


def named(row: int, one: CocoAnnotation) -> str:
    """What to call an annotation in a message: by its id, or its place where it has none."""
    return f"annotation {row if one.id is None else one.id}"
