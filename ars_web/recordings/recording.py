"""A tracked recording: cameras, frames with their poses, and where the images lie. Images are never loaded here."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera


@dataclass(frozen=True)
class StoredImage:
    """An image on a store, by its address (`s3://BUCKET/FOLDER/NAME`)."""

    address: str

    def __str__(self) -> str:
        return self.address


@dataclass(frozen=True, eq=False)
class Frame:
    """One image with its camera's pose.

    Attributes:
        name: the image's path relative to the recording's image folder, with `/`; unique in the recording.
        image: where the image lies: absolute, or on a store.
        camera_id: key into the recording's cameras.
        T_world_camera: (4, 4), OpenCV camera axes, metres.
    """

    name: str
    image: Path | StoredImage
    camera_id: int
    T_world_camera: Float[np.ndarray, "4 4"]


@dataclass(frozen=True)
class SkippedFrame:
    """A frame (or, in a manifest, a box) that the recording lists but that cannot be used.

    Attributes:
        name: the image's name, or what the file calls the frame or the box.
        reason: why, in words.
        where: `FILE:LINE`, `FILE` where lines mean nothing.
    """

    name: str
    reason: str
    where: str


@dataclass(frozen=True, eq=False)
class RecordedBox:
    """A box that came with the recording (a `.roars` manifest holds them).

    Attributes:
        class_name: one of the recording's class names.
        box: origin at the box's centre, whatever the file's convention was.
    """

    class_name: str
    box: Box


@dataclass(frozen=True, eq=False)
class Recording:
    """What a reader returns: whole and sound, or the reader raised.

    Attributes:
        format: the reader's key in `registry.READERS`.
        source: the file or folder that was read, absolute.
        cameras: by id, in the file's order; ids start at 0.
        frames: in the recording's order; a frame's place in the tuple is its index everywhere.
        skipped: what was listed and left out, in the file's order.
        class_names: classes that came with it, in order.
        boxes: boxes that came with it.
    """

    format: str
    source: Path
    cameras: dict[int, Camera]
    frames: tuple[Frame, ...]
    skipped: tuple[SkippedFrame, ...] = ()
    class_names: tuple[str, ...] = ()
    boxes: tuple[RecordedBox, ...] = field(default=())

    @property
    def Ts_world_camera(self) -> Float[np.ndarray, "n 4 4"]:
        """All poses, (n, 4, 4)."""
        return np.array([frame.T_world_camera for frame in self.frames]).reshape(-1, 4, 4)
