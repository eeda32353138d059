"""The photographs themselves."""

import numpy as np
from jaxtyping import UInt8

from ars_web.errors import BadFile
from ars_web.masks.views import Photographed, camera_of
from ars_web.recordings.images import read_image
from ars_web.recordings.stored_images import local


def photograph(taken: Photographed, frame: int) -> UInt8[np.ndarray, "h w 3"]:
    """A frame's photograph, blue green red, of its camera's size.

    Raises:
        BadInput: there is no such frame.
        BadFile, TooLarge: its image cannot be read, or has another size.
    """
    camera, path = camera_of(taken, frame), local(taken.frames.images[frame])
    image = read_image(path)
    if image.shape[:2] != (camera.height, camera.width):
        raise BadFile(
            path, f"the image is {image.shape[1]} x {image.shape[0]}, not its camera's {camera.width} x {camera.height}"
        )
    return image
