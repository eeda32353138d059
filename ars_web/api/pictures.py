"""A frame's image as the page wants it: as it is stored, smaller, or rectified."""

import hashlib
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import UInt8

from ars_web.datasets.images import rectify
from ars_web.errors import BadFile, NotFound, RefusedPath
from ars_web.geometry.camera import Camera
from ars_web.recordings.image_header import read_header
from ars_web.recordings.images import read_image

JPEG_QUALITY = 88

FORM = 1
"""Part of every ETag: one more when the same request is to give other bytes than before."""

_REDUCED = {
    2: cv2.IMREAD_REDUCED_COLOR_2,
    4: cv2.IMREAD_REDUCED_COLOR_4,
    8: cv2.IMREAD_REDUCED_COLOR_8,
}


@dataclass(frozen=True)
class PictureRequest:
    """Which picture of an image is wanted.

    Attributes:
        path: the image, checked by `recorded_image`.
        camera: that took it.
        width: pixels; None, or more than the image has: as wide as the image.
        rectified: as the pinhole camera `geometry.camera.rectified` sees it.
    """

    path: Path
    camera: Camera
    width: int | None
    rectified: bool

    def etag(self) -> str:
        """A strong ETag: equal where the picture's bytes are."""
        status = self.path.stat()
        told = (FORM, status.st_size, status.st_mtime_ns, status.st_ino, self.camera, self.width, self.rectified)
        return f'"{hashlib.sha256(repr(told).encode()).hexdigest()[:24]}"'


def recorded_image(path: Path, *, own: Path) -> Path:
    """`path`, where it still is what was recorded: sessions keep paths without links.

    Args:
        own: the session's own folder, which may itself be reached by a link.

    Raises:
        NotFound: the image is gone.
        RefusedPath: it, or a folder on the way to it, has become a link.
    """
    try:
        target = path.resolve(strict=True)
        unmoved = target.is_relative_to(own.resolve()) if path.is_relative_to(own) else target == path
    except (OSError, RuntimeError) as error:
        raise NotFound(f"{path}: the image is not there any more") from error
    if not unmoved:
        raise RefusedPath(f"{path}: has become a link since it was imported; import the recording again from {target}")
    return target


def picture(request: PictureRequest) -> tuple[bytes, str]:
    """The picture and its media type. What is asked for as it is comes as it is, without decoding.

    Raises:
        BadFile, TooLarge: the image cannot be used (see `recordings.images`).
    """
    width = request.width if request.width is not None and request.width < request.camera.width else None
    header = read_header(request.path)
    if width is None and not request.rectified and header.orientation == 1:
        data = request.path.read_bytes()
        return data, "image/png" if data.startswith(b"\x89PNG") else "image/jpeg"
    if not header.whole:
        raise BadFile(request.path, "the image ends before its data does (truncated)")
    if request.rectified:
        image = rectify(read_image(request.path), request.camera)
    elif width is None:
        image = read_image(request.path)
    else:
        image = _reduced(request.path, stored_width=header.width, width=width)
    if width is not None and width < image.shape[1]:
        height = max(1, round(image.shape[0] * width / image.shape[1]))
        image = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)
    _, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return data.tobytes(), "image/jpeg"


def _reduced(path: Path, *, stored_width: int, width: int) -> UInt8[np.ndarray, "h w 3"]:
    """The image no smaller than `width`, decoded at a half, a quarter or an eighth where that is enough."""
    factor = next((factor for factor in (8, 4, 2) if stored_width >= factor * width), None)
    if factor is None:
        return read_image(path)
    try:
        data = np.fromfile(path, dtype=np.uint8)
        image = cv2.imdecode(data, _REDUCED[factor] | cv2.IMREAD_IGNORE_ORIENTATION)
    except (OSError, cv2.error) as error:
        raise BadFile(path, f"the image cannot be decoded: {error}") from error
    if image is None:
        raise BadFile(path, "the image cannot be decoded (damaged)")
    return image
