"""Masks as PNG images: one byte a pixel, non-zero inside."""

import base64
import binascii
import struct

import cv2
import numpy as np
from jaxtyping import Bool

from ars_web.errors import BadInput

LONGEST_BASE64 = 8 * 2**20
"""Characters. A mask of a few regions in the largest image takes a hundredth of it."""

_MARK = b"\x89PNG\r\n\x1a\n"
_KINDS = {
    2: "is in colour",
    3: "is of a palette",
    4: "is grey with transparency",
    6: "is in colour with transparency",
}


def mask_from_base64(text: str, *, width: int, height: int) -> Bool[np.ndarray, "h w"]:
    """The mask that a PNG image in base64 holds; see `mask_from_png`.

    Raises:
        BadInput: it is longer than LONGEST_BASE64, no base64, or the image is no such mask.
    """
    if len(text) > LONGEST_BASE64:
        raise BadInput(f"the mask's PNG has {len(text)} characters of base64; at most {LONGEST_BASE64} are read")
    try:
        data = base64.b64decode(text, validate=True)
    except (binascii.Error, ValueError) as error:
        raise BadInput(
            f"the mask's PNG is not base64 ({error}); a data: URL's part before the comma is none"
        ) from error
    return mask_from_png(data, width=width, height=height)


def mask_from_png(data: bytes, *, width: int, height: int) -> Bool[np.ndarray, "h w"]:
    """Which pixels of an 8-bit greyscale PNG image are not zero.

    The image's header is looked at first: what it says is too large, or is no such mask, is never decoded.

    Raises:
        BadInput: it is no PNG image, not 8-bit greyscale, not of that size, or damaged.
    """
    # Signature, then the IHDR chunk: its length, name and 13 bytes (ISO/IEC 15948, sections 5.2 and 11.2.2).
    if not data.startswith(_MARK) or len(data) < 33 or data[8:16] != b"\x00\x00\x00\x0dIHDR":
        raise BadInput("the mask is not a PNG image")
    wide, high, bits, kind = struct.unpack(">IIBB", data[16:26])
    if (wide, high) != (width, height):
        raise BadInput(
            f"the mask has {wide} x {high} pixels, and the frame's image {width} x {height}; they must agree"
        )
    if kind != 0:
        what = _KINDS.get(kind, f"has the unknown colour type {kind}")
        raise BadInput(f"the mask {what}: save it as 8-bit greyscale, 0 outside the object and 255 inside")
    if bits != 8:
        raise BadInput(f"the mask has {bits} bits a pixel: save it as 8-bit greyscale, 0 outside the object")
    pixels = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_GRAYSCALE)
    if pixels is None or pixels.shape != (height, width):
        raise BadInput("the mask's PNG is damaged or cut short; save it again")
    return pixels != 0
