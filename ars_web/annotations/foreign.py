"""What a file of labels holds, whatever its format: converted to metres and image coordinates, and checked."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ars_web.geometry.polygon import Polygon
from ars_web.geometry.rigid_transform import Transform
from ars_web.geometry.symmetry import NO_SYMMETRY, Symmetry

INSTANCE_NAMES = ("track_id", "instance_id", "object_id")
"""What programs call the number that an object has in all images."""


@dataclass(frozen=True)
class ForeignImage:
    """An image as the file tells of it.

    Attributes:
        name: its path or file name; None: it has a number only.
        number: that stands for it where it has no name.
        is_index: whether the number counts the images from 0 in their order, rather than being in the image's name.
        size: width and height, pixels; None: the file does not say.
        K: fx, fy, cx, cy, OpenCV's pixels; None: the file does not say.
    """

    name: str | None = None
    number: int | None = None
    is_index: bool = False
    size: tuple[int, int] | None = None
    K: tuple[float, float, float, float] | None = None

    @property
    def called(self) -> str:
        """What to call it in a message."""
        return f"image {self.number}" if self.name is None else self.name


@dataclass(frozen=True, eq=False)
class ForeignModel:
    """A kind of posed object.

    Attributes:
        class_name: of its class.
        size: (3,) metres, along its box's own axes.
        T_object_box: the box's centre and axes in the frame that poses are of.
        symmetry: in the box's frame.
    """

    class_name: str
    size: Float[np.ndarray, "3"]
    T_object_box: Transform
    symmetry: Symmetry = NO_SYMMETRY


@dataclass(frozen=True, eq=False)
class ForeignPose:
    """Where an object is as an image's camera sees it.

    Attributes:
        image: place in the file's images.
        model: key into its models.
        T_camera_object: OpenCV's camera axes, metres.
        where: what the file calls it.
    """

    image: int
    model: str
    T_camera_object: Transform
    where: str


@dataclass(frozen=True, eq=False)
class ForeignOutline:
    """An object's outline in an image.

    Attributes:
        image: place in the file's images.
        instance: the same for one object in all images; None: the file does not say which object it is.
        polygons: image coordinates; what is inside is told by the even-odd rule over all their rings together.
        where: what the file calls it.
    """

    image: int
    class_name: str
    instance: str | None
    polygons: tuple[Polygon, ...]
    where: str


@dataclass(frozen=True, eq=False)
class ForeignRectangle:
    """A rectangle round an object in an image, where there is no outline.

    Attributes:
        image, instance, where: as of an outline.
        bbox: (4,) x0, y0, x1, y1, image coordinates.
    """

    image: int
    class_name: str
    instance: str | None
    bbox: Float[np.ndarray, "4"]
    where: str


@dataclass(frozen=True)
class LeftOut:
    """Something that the file holds and that does not come in.

    Attributes:
        reason: why, in the same words for all that are left out for it, and what to do.
        where: what the file calls it.
    """

    reason: str
    where: str


@dataclass(frozen=True, eq=False)
class ForeignLabels:
    """What a reader returns: all that the file holds, sound, or the reader raised.

    Attributes:
        format: the reader's key in `registry.READERS`.
        source: the file that was read.
        images: that it lists.
        models: kinds of posed objects.
        left_out: what the format holds and nothing here has a place for.
        in_shares: whether outlines and rectangles are in shares of their image's width and height, not yet in image
            coordinates, because the file does not know them; `sessions.label_matching` makes pixels of them.
    """

    format: str
    source: Path
    images: tuple[ForeignImage, ...]
    models: Mapping[str, ForeignModel] = field(default_factory=dict[str, ForeignModel])
    poses: tuple[ForeignPose, ...] = ()
    outlines: tuple[ForeignOutline, ...] = ()
    rectangles: tuple[ForeignRectangle, ...] = ()
    left_out: tuple[LeftOut, ...] = ()
    in_shares: bool = False


def joined(source: Path, parts: Sequence[ForeignLabels]) -> ForeignLabels:
    """The parts of one set, one or more, which was divided by images; objects and classes are the same in all.

    Args:
        source: what the whole set was read from.
    """
    if len(parts) == 1:
        return parts[0]
    images: list[ForeignImage] = []
    outlines: list[ForeignOutline] = []
    rectangles: list[ForeignRectangle] = []
    poses: list[ForeignPose] = []
    left_out: list[LeftOut] = []
    for part in parts:
        first, name = len(images), part.source.name
        images.extend(part.images)
        poses.extend(replace(p, image=first + p.image, where=f"{name}, {p.where}") for p in part.poses)
        outlines.extend(replace(o, image=first + o.image, where=f"{name}, {o.where}") for o in part.outlines)
        rectangles.extend(replace(r, image=first + r.image, where=f"{name}, {r.where}") for r in part.rectangles)
        left_out.extend(replace(one, where=f"{name}, {one.where}") for one in part.left_out)
    models = {key: model for part in parts for key, model in part.models.items()}
    return ForeignLabels(
        parts[0].format,
        source,
        tuple(images),
        models,
        tuple(poses),
        tuple(outlines),
        tuple(rectangles),
        tuple(left_out),
        parts[0].in_shares,
    )
