"""PNG images as masks: what is one, and what to do with what is none."""

import base64
import struct
import zlib

import cv2
import numpy as np
import pytest

from ars_web.errors import BadInput
from ars_web.masks.mask_png import LONGEST_BASE64, mask_from_base64, mask_from_png

MASK = np.zeros((30, 40), bool)
MASK[5:12, 7:31] = True


def png(pixels: np.ndarray) -> bytes:
    return cv2.imencode(".png", pixels)[1].tobytes()


def chunk(name: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


def header(width: int, height: int, *, bits: int = 8, kind: int = 0) -> bytes:
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, bits, kind, 0, 0, 0))


@pytest.mark.parametrize("inside", [1, 128, 255])
def test_what_is_not_zero_is_inside(inside: int) -> None:
    pixels = np.where(MASK, inside, 0).astype(np.uint8)
    assert np.array_equal(mask_from_png(png(pixels), width=40, height=30), MASK)
    text = base64.b64encode(png(pixels)).decode()
    assert np.array_equal(mask_from_base64(text, width=40, height=30), MASK)


def test_gamma_and_transparency_leave_it_as_it_is() -> None:
    plain = png(MASK.astype(np.uint8))
    for extra in (chunk(b"gAMA", struct.pack(">I", 22000)), chunk(b"tRNS", b"\x00\x01")):
        assert np.array_equal(mask_from_png(plain[:33] + extra + plain[33:], width=40, height=30), MASK)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "not a PNG image"),
        (b"\xff\xd8\xff" + bytes(100), "not a PNG image"),
        (header(40, 30)[:-5], "not a PNG image"),
        (png(np.zeros((30, 41), np.uint8)), "41 x 30 pixels, and the frame's image 40 x 30"),
        (header(2**31 - 1, 2**31 - 1), "2147483647 x 2147483647 pixels"),
        (png(np.zeros((30, 40, 3), np.uint8)), "is in colour: save it as 8-bit greyscale"),
        (png(np.zeros((30, 40, 4), np.uint8)), "in colour with transparency"),
        (header(40, 30, kind=3), "of a palette"),
        (header(40, 30, kind=9), "unknown colour type 9"),
        (png(np.zeros((30, 40), np.uint16)), "16 bits a pixel"),
        (header(40, 30, bits=1), "1 bits a pixel"),
        (png(MASK.astype(np.uint8))[:-20], "damaged or cut short"),
        (header(40, 30) + chunk(b"IDAT", zlib.compress(bytes(10))) + chunk(b"IEND", b""), "damaged or cut short"),
        # A bomb: megabytes in a few bytes, for an image that has a few pixels.
        (header(40, 30) + chunk(b"IDAT", zlib.compress(bytes(10**8))) + chunk(b"IEND", b"")[:-1], "damaged"),
    ],
)
def test_what_is_no_such_mask_is_refused(data: bytes, words: str) -> None:
    with pytest.raises(BadInput, match=words):
        mask_from_png(data, width=40, height=30)


@pytest.mark.parametrize("text", ["*", "AAA", "data:image/png;base64,AAAA", "AA AA", "ÄÖÜß"])
def test_what_is_no_base64_is_refused(text: str) -> None:
    with pytest.raises(BadInput, match="is not base64"):
        mask_from_base64(text, width=40, height=30)


def test_more_than_any_mask_has_is_not_looked_at() -> None:
    with pytest.raises(BadInput, match="at most"):
        mask_from_base64("A" * (LONGEST_BASE64 + 4), width=40, height=30)
