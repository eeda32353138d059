"""What a dataset says of its frames, in terms that all formats have in common."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int

from ars_web.geometry.rigid_transform import Transform


@dataclass(frozen=True, eq=False)
class ReadMask:
    """Pixels of an image, the top left one at `column`, `row`; what is outside `pixels` is not in it."""

    column: int
    row: int
    pixels: Bool[np.ndarray, "h w"]


@dataclass(frozen=True, eq=False)
class ReadLabel:
    """One label; what its format does not hold is None. Image coordinates, (0, 0) the image's top left corner.

    Attributes:
        bbox, bbox_amodal: (x0, y0, x1, y1).
        rings: of the format's label function, see `Reader.ring_function`.
        points: (k, 2) keypoints, NaN where it holds none.
        states: (k,) of the keypoints, as `label_functions.UNSEEN` and its neighbours number them.
        heading: from and to, radians, as `geometry/heading.py` has it: a bin, or twice the same.
        T_camera_box: place of the box's centre and its axes before the camera, OpenCV's.
        size: (3,) metres.
        corners: (8, 2) of the box in the order of `box.CORNER_SIGNS`, NaN where it holds none.
        centre_camera: (3,) place of the box's centre alone, of formats that hold no more of its pose.
        mask, visible_mask: of all of the object in the image, and of what is seen of it.
        visible, truncated: shares.
    """

    class_name: str
    bbox: Float[np.ndarray, "4"] | None = None
    bbox_amodal: Float[np.ndarray, "4"] | None = None
    rings: tuple[Float[np.ndarray, "k 2"], ...] | None = None
    points: Float[np.ndarray, "k 2"] | None = None
    states: Int[np.ndarray, "k"] | None = None
    heading: tuple[float, float] | None = None
    T_camera_box: Transform | None = None
    size: Float[np.ndarray, "3"] | None = None
    corners: Float[np.ndarray, "8 2"] | None = None
    centre_camera: Float[np.ndarray, "3"] | None = None
    mask: ReadMask | None = None
    visible_mask: ReadMask | None = None
    visible: float | None = None
    truncated: float | None = None


@dataclass(frozen=True, eq=False)
class ReadFrame:
    """One frame of a dataset, with its labels in the order in which they were written.

    Attributes:
        stem: of its image's file.
        split: None where the format does not say.
        place: where it was read, for messages: a file, and what in it.
        image_size: width and height as the format, or the image itself, says; None: neither does.
    """

    stem: str
    split: str | None
    place: str
    labels: tuple[ReadLabel, ...]
    image_size: tuple[int, int] | None = None


Sizes = Mapping[str, tuple[int, int]]
"""Width and height of each image of a dataset, by its file's stem: formats of shares do not say them."""


@dataclass(frozen=True)
class Reader:
    """How a format is read back.

    Attributes:
        format: its key in the registry.
        library: whose reader it is, for people: `pycocotools`, or `this program's own reading`.
        read: all frames of a dataset's folder, in any order, one at a time, given the images' sizes; raises BadFile.
        rounding: pixels that the format's digits may cost, for an image of so many pixels along its longer side.
        ring_function: the label function whose rings it gives; None: it gives none.
    """

    format: str
    library: Callable[[], str]
    read: Callable[[Path, Sizes], Iterator[ReadFrame]]
    rounding: Callable[[int], float]
    ring_function: str | None = None
