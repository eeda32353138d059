"""Masks as PNG files of 8 bits, 0 and 255: small parts of large images, most of whose rows are blank.

Blank rows are packed once for all images: what is packed apart, up to a full flush, can be put together.
"""

import struct
import zlib
from functools import lru_cache

import numpy as np
from jaxtyping import Bool

_SIGNATURE = b"\x89PNG\r\n\x1a\n"

_LEVEL = 1
"""Of zlib's packing: masks are small at the fastest."""

_BASE = 65521
"""Of Adler's checksum (RFC 1950)."""


def mask_png(mask: Bool[np.ndarray, "k l"], *, row: int, column: int, width: int, height: int) -> bytes:
    """A PNG image of so many pixels that is white where `mask`, whose first pixel is at `row` and `column`, is true.

    The mask must lie within the image. Source: PNG specification, third edition; RFC 1950 and 1951.
    """
    # Each row begins with the number of its filter, 0 for none.
    middle = np.zeros((mask.shape[0], width + 1), dtype=np.uint8)
    middle[:, 1 + column : 1 + column + mask.shape[1]] = mask * np.uint8(255)
    above, below = row, height - row - mask.shape[0]
    packer = zlib.compressobj(_LEVEL, zlib.DEFLATED, -zlib.MAX_WBITS)
    packed = packer.compress(middle.data) + packer.flush(zlib.Z_FULL_FLUSH)
    checksum = _after_blanks(zlib.adler32(middle.data, _after_blanks(1, above * (width + 1))), below * (width + 1))
    end = zlib.compressobj(_LEVEL, zlib.DEFLATED, -zlib.MAX_WBITS).flush(zlib.Z_FINISH)
    stream = b"\x78\x01" + _blanks(above, width) + packed + _blanks(below, width) + end + struct.pack(">I", checksum)
    # 8 bits of grey, deflated, filtered row by row, not interlaced.
    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return _SIGNATURE + _chunk(b"IHDR", header) + _chunk(b"IDAT", stream) + _chunk(b"IEND", b"")


@lru_cache(maxsize=4096)
def _blanks(rows: int, width: int) -> bytes:
    packer = zlib.compressobj(_LEVEL, zlib.DEFLATED, -zlib.MAX_WBITS)
    return packer.compress(bytes(rows * (width + 1))) + packer.flush(zlib.Z_FULL_FLUSH)


def _after_blanks(checksum: int, count: int) -> int:
    """Adler's checksum after so many zeros: its low half stays, and is added to the high half each time."""
    low, high = checksum & 0xFFFF, checksum >> 16
    return ((high + count * low) % _BASE) << 16 | low


def _chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
