"""The dataset's images: linked, copied, undistorted, or encoded anew where the format or a viewer needs it.

Every source is looked at before it is used: it must be there, whole, unchanged since the export was planned, and of
its camera's size.
"""

import errno
import os
import shutil
from functools import lru_cache
from pathlib import Path
from typing import Literal

import cv2
import numpy as np
from jaxtyping import UInt8

from ars_web.datasets.image_stamps import source_stamp, stored_stamp
from ars_web.errors import BadFile
from ars_web.geometry.camera import (
    Camera,
    distorted_from_normalised,
    normalised_from_pixels,
    rectified,
)
from ars_web.recordings.image_header import read_header
from ars_web.recordings.images import read_image
from ars_web.recordings.stores import is_address, split_address

JPEG_QUALITY = 95

_CHANGED = "the image changed since the export was planned; start the export again"

_JPEG_SUFFIXES = (".jpg", ".jpeg")

_NO_LINK = frozenset({errno.EXDEV, errno.EPERM, errno.EACCES, errno.EMLINK, errno.ENOTSUP, errno.ENOSYS})
"""Another file system, a protected file, too many links, a file system without links: a copy is made instead."""


def image_name(stem: str, source: str, *, only_jpeg: bool, only_png: bool = False) -> str:
    """The file name of an image in the dataset: JPEG and PNG keep their extension, in lower case."""
    suffix = _suffix(source)
    if only_png:
        return stem + ".png"
    if suffix in _JPEG_SUFFIXES:
        return stem + (".jpg" if only_jpeg else suffix)
    return stem + (".jpg" if only_jpeg else ".png")


def place_image(source: str, target: str, *, camera: Camera, stamp: tuple[int, int], images: str) -> None:
    """Put the image `source` at `target` as the export option `images` says (not for `none`).

    `stamp` is the size in bytes and the time of change in ns that the source had when the export was planned. An
    image is encoded anew, as its target's extension says, where it is rectified, where the format wants another
    encoding, and where its Exif asks viewers to turn it: the labels are for the pixels as they are stored.

    Raises:
        BadFile: the source is missing, damaged, changed, a link, or not of its camera's size.
        OSError: the target cannot be written.
    """
    if is_address(source):
        _place_stored(source, target, camera=camera, stamp=stamp, images=images)
        return
    _check_unchanged(source, stamp)
    _place(source, target, camera=camera, images=images)


def _place_stored(source: str, target: str, *, camera: Camera, stamp: tuple[int, int], images: str) -> None:
    """The same for an image on a store, which is fetched first."""
    fetched = f"{target}.fetched{_suffix(source)}"
    folder, name = split_address(source)
    if stored_stamp(source) != stamp:
        raise BadFile(source, _CHANGED)
    try:
        content = folder.read(name)
    except OSError as error:
        raise BadFile(source, f"the image cannot be exported: {error.strerror or error}") from error
    Path(fetched).write_bytes(content)
    try:
        # What was fetched is ours alone: it need not be copied once more.
        _place(fetched, target, camera=camera, images="link" if images == "copy" else images)
    except BadFile as error:
        raise BadFile(source, str(error).removeprefix(f"{fetched}: ")) from error
    finally:
        Path(fetched).unlink()


def _place(source: str, target: str, *, camera: Camera, images: str) -> None:
    header = read_header(Path(source))
    if not header.whole:
        raise BadFile(source, "the image ends before its data does (truncated)")
    if (header.width, header.height) != (camera.width, camera.height):
        raise BadFile(
            source,
            f"the image is {header.width} x {header.height} pixels, but its camera's are"
            f" {camera.width} x {camera.height}; labels would not fit it",
        )
    how = "encoded" if header.orientation != 1 else placement(source, target, camera=camera, images=images)
    if how == "encoded":
        image = read_image(Path(source))
        _encode(rectify(image, camera) if images == "rectify" and camera.model != "pinhole" else image, target)
    elif how == "linked":
        _link(source, target)
    else:
        shutil.copyfile(source, target)


def placement(source: str, target: str, *, camera: Camera, images: str) -> Literal["linked", "copied", "encoded"]:
    """How `place_image` makes `target`, where the image's Exif asks for no turning and links can be made."""
    if (images == "rectify" and camera.model != "pinhole") or not _same_encoding(source, target):
        return "encoded"
    return "linked" if images == "link" else "copied"


def rectify(image: UInt8[np.ndarray, "h w 3"], camera: Camera) -> UInt8[np.ndarray, "h w 3"]:
    """The image as `camera.rectified(camera)` would have taken it."""
    whole, fraction = _rectifying_maps(camera)
    return cv2.remap(image, whole, fraction, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)


@lru_cache(maxsize=4)
def _rectifying_maps(camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """OpenCV's fixed-point maps (CV_16SC2) from the rectified image's pixels to the original's."""
    flat = rectified(camera)
    columns, rows = np.meshgrid(np.arange(flat.width, dtype=np.float64), np.arange(flat.height, dtype=np.float64))
    rays = normalised_from_pixels(flat, np.stack([columns, rows], axis=-1))
    pixels = distorted_from_normalised(camera, rays) * [camera.fx, camera.fy] + [camera.cx, camera.cy]
    # Within `rectified` every ray has a pixel but for rounding at the border, which is replicated.
    maps = np.nan_to_num(pixels, nan=-1.0).astype(np.float32)
    whole, fraction = cv2.convertMaps(maps, np.zeros(0, dtype=np.float32), cv2.CV_16SC2)
    return whole, fraction


def _check_unchanged(source: str, stamp: tuple[int, int]) -> None:
    if source_stamp(source) != stamp:
        raise BadFile(source, _CHANGED)


def _same_encoding(source: str, target: str) -> bool:
    a, b = _suffix(source), _suffix(target)
    return a == b or (a in _JPEG_SUFFIXES and b in _JPEG_SUFFIXES)


def _suffix(path: str) -> str:
    return os.path.splitext(path)[1].lower()  # noqa: PTH122 - paths are strings here, this runs once an image


def _link(source: str, target: str) -> None:
    try:
        os.link(source, target)
    except OSError as error:
        if error.errno not in _NO_LINK:
            raise
        shutil.copyfile(source, target)


def _encode(image: UInt8[np.ndarray, "h w 3"], target: str) -> None:
    quality = [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY] if _suffix(target) in _JPEG_SUFFIXES else []
    ok, content = cv2.imencode(_suffix(target), image, quality)
    assert ok, f"OpenCV cannot encode {target}"
    Path(target).write_bytes(content.data)
