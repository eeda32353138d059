"""CVAT's XML, 1.1, for images and for video.

for images  <image name width height> with shapes; which of them are one object in several images is said by an
            attribute called track_id, instance_id or object_id, where people gave labels one
for video   <track label> with a shape for each frame, which are one object; outside="1": it is not there. A track
            ends where it says so, or with its last shape. Between the shapes that are listed boxes move evenly, as
            in CVAT; polygons and masks are taken from the frames that are listed. Frames have numbers, no names.
            Those in which no track is are images, too, that show nothing: the head of the file says how many there
            are (`cvat_frames`)
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ars_web.annotations import cvat_frames, cvat_shapes
from ars_web.annotations.cvat_shapes import OTHER_SHAPES, SHAPES, attribute, whole_number
from ars_web.annotations.foreign import (
    INSTANCE_NAMES,
    ForeignImage,
    ForeignLabels,
    ForeignOutline,
    ForeignRectangle,
    LeftOut,
)
from ars_web.annotations.xml_elements import XmlElement, elements_of
from ars_web.errors import BadFile
from ars_web.recordings.options import ReadOptions

TITLE = "CVAT"
NEEDS = "its XML, 1.1, for images or for video, such as annotations.xml"

MOST_BETWEEN = 1_000_000
"""Boxes between those that a file lists; a line of it can ask for any number."""

_HEAD = 1 << 12
_TURNED = "it is a box that is turned in the image: neither an outline nor a label's sides; draw it as a polygon"
_EMPTY = "its mask is empty"


def find(path: Path) -> list[Path]:
    """The XML files of annotations at `path` or in the folder."""
    if path.is_dir():
        return [file for file in sorted(path.glob("*.xml")) if _is_one(file)]
    return [path] if path.is_file() and _is_one(path) else []


def are_parts(files: Sequence[Path]) -> bool:
    """Whether files are parts of one set: CVAT numbers tracks and frames anew in each."""
    return len(files) == 1


def _is_one(file: Path) -> bool:
    with file.open("rb") as data:
        head = data.read(_HEAD)
    return b"<annotations" in head


@dataclass
class _Found:
    """What has been read so far."""

    images: list[ForeignImage] = field(default_factory=list[ForeignImage])
    outlines: list[ForeignOutline] = field(default_factory=list[ForeignOutline])
    rectangles: list[ForeignRectangle] = field(default_factory=list[ForeignRectangle])
    left_out: list[LeftOut] = field(default_factory=list[LeftOut])
    frames: dict[int, int] = field(default_factory=dict[int, int])
    tasks: list[XmlElement] = field(default_factory=list[XmlElement])
    task_frames: range | None = None
    listed: set[int] = field(default_factory=set[int])
    size: tuple[int, int] | None = None
    between: int = 0

    def place_of(self, frame: int) -> int:
        """A video's frame among the images."""
        if frame not in self.frames:
            self.frames[frame] = len(self.images)
            self.images.append(ForeignImage(number=frame, is_index=True, size=self.size))
        return self.frames[frame]

    def take_box(self, image: int, label: str, instance: str | None, box: np.ndarray, where: str) -> None:
        upright = cvat_shapes.upright_box(box)
        if upright is None:
            self.left_out.append(LeftOut(_TURNED, where))
        else:
            self.rectangles.append(ForeignRectangle(image, label, instance, upright, where))

    def take_outline(
        self, file: Path, shape: XmlElement, image: int, label: str, instance: str | None, where: str
    ) -> None:
        polygons = cvat_shapes.outline(file, shape)
        if polygons:
            self.outlines.append(ForeignOutline(image, label, instance, polygons, where))
        else:
            self.left_out.append(LeftOut(_EMPTY, where))


def read(file: Path, options: ReadOptions) -> ForeignLabels:
    """Read a file of annotations.

    Raises:
        BadFile: it is damaged; the message names line and image or track.
    """
    found = _Found()
    for element in elements_of(file, root="annotations"):
        if element.tag == "meta":
            found.size = _original_size(file, element)
            found.tasks = cvat_frames.tasks_of(element)
            if len(found.tasks) == 1:
                found.task_frames = cvat_frames.frame_numbers(file, found.tasks[0])
        elif element.tag == "image":
            _take_image(file, element, found)
        elif element.tag == "track":
            _take_track(file, element, found)
    _take_empty_frames(found)
    if not found.images and not found.left_out:
        raise BadFile(file, "holds no <image> and no <track>")
    return ForeignLabels(
        "cvat",
        file,
        tuple(found.images),
        outlines=tuple(found.outlines),
        rectangles=tuple(found.rectangles),
        left_out=tuple(found.left_out),
    )


def _original_size(file: Path, meta: XmlElement) -> tuple[int, int] | None:
    """The size of a video's frames."""
    elements = [meta]
    for element in elements:  # which grows meanwhile
        if element.tag == "original_size":
            sides = [side for side in (element.child("width"), element.child("height")) if side is not None]
            if len(sides) == 2 and all(side.text.strip().isdecimal() for side in sides):
                return int(sides[0].text), int(sides[1].text)
            raise BadFile(file, "<original_size> must hold width and height", line=element.line)
        elements.extend(element.children)
    return None


def _take_image(file: Path, image: XmlElement, found: _Found) -> None:
    name = attribute(file, image, "name")
    place = len(found.images)
    size = (whole_number(file, image, "width"), whole_number(file, image, "height"))
    found.images.append(ForeignImage(name=name, size=size))
    for i, shape in enumerate(image.children):
        where = f"{name}, <{shape.tag}> {i}, line {shape.line}"
        if shape.tag in OTHER_SHAPES:
            found.left_out.append(LeftOut(_other(shape.tag), where))
        if shape.tag not in SHAPES:
            continue
        label = attribute(file, shape, "label")
        instance = _instance(shape)
        if shape.tag == "box":
            found.take_box(place, label, instance, cvat_shapes.box_of(file, shape), where)
        else:
            found.take_outline(file, shape, place, label, instance, where)


def _instance(shape: XmlElement) -> str | None:
    given = {child.attributes.get("name"): child.text.strip() for child in shape.children if child.tag == "attribute"}
    return next((f"{name} {given[name]}" for name in INSTANCE_NAMES if given.get(name)), None)


def _take_track(file: Path, track: XmlElement, found: _Found) -> None:
    label, instance = attribute(file, track, "label"), f"track {attribute(file, track, 'id')}"
    if len(found.tasks) > 1:
        said = f"{instance}: the file holds {len(found.tasks)} tasks, and the frames of each are numbered from its own"
        raise BadFile(file, f"{said} first; export each task by itself", line=track.line)
    shapes: dict[int, XmlElement] = {}
    for shape in track.children:
        if shape.tag not in (*SHAPES, *OTHER_SHAPES):
            continue
        frame = whole_number(file, shape, "frame")
        if frame in shapes:
            raise BadFile(file, f"{instance} has two shapes in frame {frame}", line=shape.line)
        shapes[frame] = shape
    listed = sorted(shapes.items())
    found.listed.update(shapes)
    for (frame, shape), after in zip(listed, [*listed[1:], None], strict=True):
        if shape.attributes.get("outside") == "1":
            continue
        where = f"{instance}, frame {frame}, line {shape.line}"
        if shape.tag in OTHER_SHAPES:
            found.left_out.append(LeftOut(_other(shape.tag), where))
        elif shape.tag == "box":
            step = found.task_frames.step if found.task_frames is not None else 1
            if after is not None:
                found.between += after[0] - frame - 1
            if found.between > MOST_BETWEEN:
                said = f"its tracks leave over {MOST_BETWEEN} boxes between those that it lists; divide it"
                raise BadFile(file, said, line=shape.line)
            for between, box in _boxes_until(file, frame, shape, after, step):
                where = f"{instance}, frame {between}, line {shape.line}"
                found.take_box(found.place_of(between), label, instance, box, where)
        else:
            found.take_outline(file, shape, found.place_of(frame), label, instance, where)


def _boxes_until(
    file: Path, frame: int, shape: XmlElement, after: tuple[int, XmlElement] | None, step: int
) -> Iterator[tuple[int, np.ndarray]]:
    """A track's box in its frame, and in every `step`th up to the next that is listed."""
    box = cvat_shapes.box_of(file, shape)
    yield frame, box
    if after is None or after[1].tag != "box":
        return
    until, next_shape = after
    # A track that leaves stays where it was until then: CVAT writes its last place into the frame outside, too.
    next_box = cvat_shapes.box_of(file, next_shape)
    # What is listed off the step tells that the head means something else.
    for between in range(frame, until, step if (until - frame) % step == 0 else 1)[1:]:
        yield between, cvat_shapes.box_between(box, next_box, (between - frame) / (until - frame))


def _take_empty_frames(found: _Found) -> None:
    """The frames of a video in which no track is: somebody looked at them, and they show nothing."""
    numbers = found.task_frames
    if found.listed and numbers is not None and cvat_frames.are_all_of(numbers, found.listed):
        for frame in numbers:
            found.place_of(frame)


def _other(tag: str) -> str:
    return f"it is a {tag}: boxes, polygons and masks come in"
