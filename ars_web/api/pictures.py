"""A frame's image as the page wants it: as it is stored, smaller, rectified, or a part of it."""

import hashlib
import threading
from dataclasses import dataclass
from pathlib import Path

import cv2
from cachetools import LRUCache, cached

from ars_web.api.crops import Crop
from ars_web.datasets.images import rectify
from ars_web.errors import BadFile, NotFound, RefusedPath
from ars_web.geometry.camera import Camera
from ars_web.recordings.image_header import read_header
from ars_web.recordings.images import REDUCTIONS, read_smaller

JPEG_QUALITY = 88

SMALL = 400
"""Pixels. Pictures that are asked for no wider are kept in memory: film strips show the same ones again and again."""

KEPT_BYTES = 64 * 2**20
"""Of small pictures, some ten thousand; those not looked at for longest go first."""

FORM = 1
"""Part of every ETag: one more when the same request is to give other bytes than before."""


@dataclass(frozen=True)
class PictureRequest:
    """Which picture of an image is wanted.

    Attributes:
        path: the image, checked by `recorded_image`.
        camera: that took it.
        width: pixels; None, or more than the image has: as wide as the image.
        rectified: as the pinhole camera `geometry.camera.rectified` sees it.
        crop: the part of the image, or of the rectified one, that is wanted; `width` is then that part's.
    """

    path: Path
    camera: Camera
    width: int | None
    rectified: bool
    crop: Crop | None = None

    def etag(self) -> str:
        """A strong ETag: equal where the picture's bytes are."""
        status = self.path.stat()
        told = (FORM, status.st_size, status.st_mtime_ns, status.st_ino, self.camera, self.width, self.rectified)
        if self.crop is not None:
            told = (*told, self.crop)
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


class Pictures:
    """Pictures of images; the small ones are made once, however many ask for them at once, and kept for a while."""

    def __init__(self, *, kept_bytes: int = KEPT_BYTES) -> None:
        kept: LRUCache[str, tuple[bytes, str]] = LRUCache(kept_bytes, getsizeof=_size)
        # With a condition, who asks for what another thread is making waits for that.
        self._small = cached(kept, key=_etag, condition=threading.Condition())(_picture)

    def get(self, request: PictureRequest, etag: str) -> tuple[bytes, str]:
        """The picture and its media type; `etag` is the request's.

        Raises:
            BadFile, TooLarge: the image cannot be used (see `recordings.images`).
        """
        return (self._small if request.width is not None and request.width <= SMALL else _picture)(request, etag)


def _size(kept: tuple[bytes, str]) -> int:
    return len(kept[0])


def _etag(request: PictureRequest, etag: str) -> str:
    return etag


def _picture(request: PictureRequest, etag: str) -> tuple[bytes, str]:
    return picture(request)


def picture(request: PictureRequest) -> tuple[bytes, str]:
    """The picture and its media type. What is asked for as it is comes as it is, without decoding.

    Raises:
        BadFile, TooLarge: the image cannot be used (see `recordings.images`).
    """
    camera, crop = request.camera, request.crop
    part = camera.width if crop is None else crop.width
    width = request.width if request.width is not None and request.width < part else None
    header = read_header(request.path)
    if width is None and crop is None and not request.rectified and header.orientation == 1:
        data = request.path.read_bytes()
        return data, "image/png" if data.startswith(b"\x89PNG") else "image/jpeg"
    if not header.whole:
        raise BadFile(request.path, "the image ends before its data does (truncated)")
    if crop is not None and (header.width, header.height) != (camera.width, camera.height):
        raise BadFile(
            request.path,
            f"the image is {header.width} x {header.height} pixels, but its camera's are {camera.width} x"
            f" {camera.height}; import the recording again",
        )
    factor = 1 if request.rectified or width is None else _reduction(width, header.width, crop)
    image = read_smaller(request.path, factor=factor)
    if request.rectified:
        image = rectify(image, camera)
    if crop is not None:
        image = image[crop.y0 // factor : crop.y1 // factor, crop.x0 // factor : crop.x1 // factor]
    if width is not None and width < image.shape[1]:
        height = max(1, round(image.shape[0] * width / image.shape[1]))
        image = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)
    _, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return data.tobytes(), "image/jpeg"


def _reduction(width: int, stored_width: int, crop: Crop | None) -> int:
    """How much smaller the image may be decoded for a picture of a width: 8, 4, 2 or 1. A crop must not begin or end
    within one of the smaller pixels, or the picture would be shifted by a part of one."""
    if crop is None:
        return next((factor for factor in REDUCTIONS if stored_width >= factor * width), 1)
    return next((f for f in REDUCTIONS if crop.width >= f * width and crop.is_of_blocks(f)), 1)
