"""Images: their size without decoding, and their pixels exactly as they are stored."""

from pathlib import Path

import cv2
import numpy as np
from jaxtyping import UInt8

from ars_web.errors import BadFile
from ars_web.recordings.image_header import MAX_IMAGE_PIXELS, ImageHeader, read_header

__all__ = ["MAX_IMAGE_PIXELS", "REDUCTIONS", "image_size", "read_image", "read_reduced", "read_smaller"]

_REDUCED = {
    2: cv2.IMREAD_REDUCED_COLOR_2,
    4: cv2.IMREAD_REDUCED_COLOR_4,
    8: cv2.IMREAD_REDUCED_COLOR_8,
}

REDUCTIONS = (8, 4, 2, 1)
"""By which images can be decoded smaller, the quickest first."""


def image_size(path: Path) -> tuple[int, int]:
    """Width and height in pixels as stored, from the header alone; Exif's rotation is not applied.

    Raises:
        BadFile: it is missing, not to be read, neither PNG nor JPEG, or its header is damaged.
        TooLarge: it has more than MAX_IMAGE_PIXELS.
    """
    header = read_header(path)
    return header.width, header.height


def read_image(path: Path) -> UInt8[np.ndarray, "h w 3"]:
    """The pixels (h, w, 3) in BGR, as stored: Exif's rotation is not applied, since calibrations do not know it.

    Raises:
        BadFile: it is missing, not to be read, neither PNG nor JPEG, truncated or damaged.
        TooLarge: it has more than MAX_IMAGE_PIXELS.
    """
    header = _whole_header(path)
    image = _decoded(path, cv2.IMREAD_COLOR)
    if image.shape[:2] != (header.height, header.width):
        raise BadFile(
            path, f"the image decodes to {image.shape[1]} x {image.shape[0]} pixels, not to its header's size"
        )
    return image


def read_reduced(path: Path, *, width: int) -> UInt8[np.ndarray, "h w 3"]:
    """The pixels as `read_image` gives them, but smaller, to be shown `width` pixels wide or less.

    What is decoded is a half, a quarter or an eighth of the image where that is wide enough, which costs a fraction
    of decoding all of it. An image that is no wider than `width` comes as it is.
    """
    header = _whole_header(path)
    image = read_smaller(path, factor=next((f for f in REDUCTIONS if header.width >= f * width), 1))
    if width < image.shape[1]:
        height = max(1, round(header.height * width / header.width))
        image = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)
    return image


def read_smaller(path: Path, *, factor: int) -> UInt8[np.ndarray, "h w 3"]:
    """The pixels as `read_image` gives them, each for a square of `factor` (one of REDUCTIONS) pixels of the image.

    Squares are counted from the image's top left corner; those that its right and lower border cut are rounded up.
    """
    if factor == 1:
        return read_image(path)
    _whole_header(path)
    return _decoded(path, _REDUCED[factor])


def _whole_header(path: Path) -> ImageHeader:
    header = read_header(path)
    if not header.whole:
        raise BadFile(path, "the image ends before its data does (truncated)")
    return header


def _decoded(path: Path, flags: int) -> UInt8[np.ndarray, "h w 3"]:
    try:
        data = np.fromfile(path, dtype=np.uint8)
        image = cv2.imdecode(data, flags | cv2.IMREAD_IGNORE_ORIENTATION)
    except (OSError, cv2.error) as error:
        raise BadFile(path, f"the image cannot be decoded: {error}") from error
    if image is None:
        raise BadFile(path, "the image cannot be decoded (damaged)")
    return image
