"""The sizes of PNG and JPEG images from their headers, without decoding a pixel.

Sources: PNG (ISO/IEC 15948), section 5; JPEG (ITU-T T.81), annex B; Exif 2.32, section 4.6.
"""

import os
import stat
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from ars_web.errors import BadFile, TooLarge

MAX_IMAGE_PIXELS = 100_000_000
"""Images beyond this are refused before a byte of them is decoded."""

_HEAD = 4096
_TAIL = 1 << 16
_PNG_MARK = b"\x89PNG\r\n\x1a\n"
_PNG_END = b"\x00\x00\x00\x00IEND\xaeB`\x82"
_JPEG_MARK = b"\xff\xd8\xff"
_JPEG_END = b"\xff\xd9"
_EXIF_MARK = b"Exif\x00\x00"
# Frame headers: C4 (Huffman tables), C8 (reserved) and CC (arithmetic tables) lie in the same range and are none.
_JPEG_FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
_JPEG_ALONE = frozenset({0x01, *range(0xD0, 0xD8)})
_EXIF_ORDERS: dict[bytes, Literal["little", "big"]] = {b"II*\x00": "little", b"MM\x00*": "big"}
_ORIENTATION = 0x0112


@dataclass(frozen=True)
class ImageHeader:
    """What an image file says of itself.

    Attributes:
        width, height: in pixels as they are stored, before any rotation.
        orientation: Exif's, 1 (as stored) to 8; 1 where none is given.
        whole: whether the file reaches the end of its image.
    """

    width: int
    height: int
    orientation: int
    whole: bool


class _Short(Exception):
    """The bytes end before the header does."""


class _Reader:
    """Bytes of an open file by place; the head is read once, the rest only where asked for."""

    def __init__(self, descriptor: int, size: int) -> None:
        self._descriptor = descriptor
        self._head = os.pread(descriptor, _HEAD, 0)
        self.size = size

    def at(self, place: int, count: int) -> bytes:
        # A damaged length may be gigabytes: nothing beyond the file's end is asked for.
        if place + count > self.size:
            raise _Short
        if place + count <= len(self._head):
            return self._head[place : place + count]
        found = os.pread(self._descriptor, count, place)
        if len(found) < count:
            raise _Short
        return found

    def has_after(self, place: int, mark: bytes) -> bool:
        """Whether `mark` occurs at or after `place`; its last occurrence is looked for from the file's end."""
        end = self.size
        while end > place:
            start = max(place, end - _TAIL)
            # Pieces overlap by the mark's length, so that a mark across a seam is found.
            if mark in os.pread(self._descriptor, end - start + len(mark) - 1, start):
                return True
            end = start
        return False


def read_header(path: Path) -> ImageHeader:
    """The header of the PNG or JPEG image at `path`.

    Raises:
        BadFile: it is missing, not to be read, neither PNG nor JPEG, or its header is damaged.
        TooLarge: it has more than MAX_IMAGE_PIXELS.
    """
    try:
        # Opening a pipe would wait for ever: only regular files are opened.
        status = os.stat(path)  # noqa: PTH116 - a third of the cost, and this runs once an image
        if not stat.S_ISREG(status.st_mode):
            raise BadFile(path, "is not a file")
        descriptor = os.open(path, os.O_RDONLY)
    except FileNotFoundError as error:
        raise BadFile(path, "the image is missing") from error
    except (OSError, ValueError) as error:
        raise BadFile(path, f"the image cannot be read: {error}") from error
    try:
        header = _header(_Reader(descriptor, status.st_size), path)
    except _Short as error:
        raise BadFile(path, "the image ends within its header (truncated)") from error
    except OSError as error:
        raise BadFile(path, f"the image cannot be read: {error.strerror}") from error
    finally:
        os.close(descriptor)
    if header.width < 1 or header.height < 1:
        raise BadFile(path, f"the image says it has {header.width} x {header.height} pixels")
    if header.width * header.height > MAX_IMAGE_PIXELS:
        raise TooLarge(
            f"{path}: the image has {header.width} x {header.height} pixels; more than {MAX_IMAGE_PIXELS} are not read"
        )
    return header


def _header(reader: _Reader, path: Path) -> ImageHeader:
    if reader.size == 0:
        raise BadFile(path, "the image file is empty")
    mark = reader.at(0, min(8, reader.size))
    if mark == _PNG_MARK:
        return _png(reader, path)
    if mark.startswith(_JPEG_MARK):
        return _jpeg(reader, path)
    raise BadFile(path, "is neither a PNG nor a JPEG image; convert it to one of them")


def _png(reader: _Reader, path: Path) -> ImageHeader:
    first = reader.at(8, 16)
    if first[4:8] != b"IHDR" or first[:4] != b"\x00\x00\x00\x0d":
        raise BadFile(path, "the PNG image does not begin with its header (damaged)")
    width, height = int.from_bytes(first[8:12], "big"), int.from_bytes(first[12:16], "big")
    orientation = 1
    place = 33
    while True:
        chunk = reader.at(place, 8)
        length, kind = int.from_bytes(chunk[:4], "big"), chunk[4:]
        if kind == b"IDAT":
            break
        if kind == b"eXIf":
            orientation = _exif_orientation(reader.at(place + 8, length))
        place += 12 + length
    whole = reader.at(reader.size - 12, 12) == _PNG_END or reader.has_after(place, _PNG_END)
    return ImageHeader(width, height, orientation, whole)


def _jpeg(reader: _Reader, path: Path) -> ImageHeader:
    orientation = 1
    place = 2
    while True:
        marker = reader.at(place, 2)
        if marker[0] != 0xFF:
            raise BadFile(path, f"the JPEG image has no segment at byte {place} (damaged)")
        if marker[1] == 0xFF:  # any number of fill bytes may precede a marker
            place += 1
            continue
        if marker[1] in _JPEG_ALONE:
            place += 2
            continue
        if marker[1] in (0xD9, 0xDA):
            raise BadFile(path, "the JPEG image has no frame header before its data (damaged)")
        length = int.from_bytes(reader.at(place + 2, 2), "big")
        if length < 2:
            raise BadFile(path, f"the JPEG image has a segment of length {length} at byte {place} (damaged)")
        if marker[1] in _JPEG_FRAMES:
            size = reader.at(place + 5, 4)
            height, width = int.from_bytes(size[:2], "big"), int.from_bytes(size[2:], "big")
            break
        if marker[1] == 0xE1 and length >= 8 and reader.at(place + 4, 6) == _EXIF_MARK:
            orientation = _exif_orientation(reader.at(place + 10, length - 8))
        place += 2 + length
    # A thumbnail's end lies within a segment, before the frame header: what follows it is the image's own.
    whole = reader.at(reader.size - 2, 2) == _JPEG_END or reader.has_after(place, _JPEG_END)
    return ImageHeader(width, height, orientation, whole)


def _exif_orientation(tiff: bytes) -> int:
    """The orientation in an Exif block, 1 where it gives none or cannot be understood."""
    order = _EXIF_ORDERS.get(tiff[:4])
    if order is None:
        return 1

    def number(place: int, count: int) -> int:
        return int.from_bytes(tiff[place : place + count], order)

    directory = number(4, 4)
    for entry in range(number(directory, 2)):
        place = directory + 2 + 12 * entry
        if place + 12 > len(tiff):
            return 1
        if number(place, 2) == _ORIENTATION:
            value = number(place + 8, 2)
            return value if 1 <= value <= 8 else 1
    return 1
