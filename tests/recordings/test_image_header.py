import os
import struct
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ars_web.errors import ArsError, BadFile, TooLarge
from ars_web.recordings.image_header import read_header
from ars_web.recordings.images import MAX_IMAGE_PIXELS, image_size, read_image

PIXELS = np.random.default_rng(3).integers(0, 255, (30, 50, 3), dtype=np.uint8)


def encoded(ending: str, *options: int, pixels: np.ndarray = PIXELS) -> bytes:
    return cv2.imencode(ending, pixels, list(options))[1].tobytes()


JPEG = encoded(".jpg")
PNG = encoded(".png")


def segment(marker: int, data: bytes) -> bytes:
    return struct.pack(">BBH", 0xFF, marker, len(data) + 2) + data


def exif(orientation: int, order: str = "<") -> bytes:
    head = b"II*\0" if order == "<" else b"MM\0*"
    entries = struct.pack(order + "HHHIHH", 2, 0x0100, 3, 1, 50, 0) + struct.pack(
        order + "HHIHH", 0x0112, 3, 1, orientation, 0
    )
    return head + struct.pack(order + "I", 8) + entries + struct.pack(order + "I", 0)


def chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def with_segment(marker: int, data: bytes) -> bytes:
    return JPEG[:2] + segment(marker, data) + JPEG[2:]


def with_chunk(kind: bytes, data: bytes) -> bytes:
    return PNG[:33] + chunk(kind, data) + PNG[33:]


def written(tmp_path: Path, data: bytes) -> Path:
    path = tmp_path / "image.bin"
    path.write_bytes(data)
    return path


GOOD = {
    "jpeg": JPEG,
    "progressive": encoded(".jpg", cv2.IMWRITE_JPEG_PROGRESSIVE, 1),
    "restarts": encoded(".jpg", cv2.IMWRITE_JPEG_RST_INTERVAL, 1),
    "grey": encoded(".jpg", pixels=PIXELS[:, :, 0]),
    "long segments": JPEG[:2] + segment(0xE2, b"\xff\xd9" * 30000) * 3 + JPEG[2:],
    "exif thumbnail": with_segment(0xE1, b"Exif\0\0" + exif(1) + JPEG),
    "xmp": with_segment(0xE1, b"http://ns.adobe.com/xap/1.0/\0<x/>"),
    "short app1": with_segment(0xE1, b"E"),
    "fill bytes": JPEG[:2] + b"\xff\xff" + JPEG[2:],
    "bytes after the end": JPEG + bytes(100_000),
    "png": PNG,
    "palette": encoded(".png", cv2.IMWRITE_PNG_BILEVEL, 1, pixels=PIXELS[:, :, 0]),
    "alpha": encoded(".png", pixels=np.dstack([PIXELS, PIXELS[:, :, 0]])),
    "16 bit": encoded(".png", pixels=PIXELS.astype(np.uint16) * 257),
    "png text": with_chunk(b"tEXt", b"Comment\0" + b"x" * 10_000),
    "png bytes after the end": PNG + bytes(100_000),
}


@pytest.mark.parametrize("kind", GOOD)
def test_headers_of_whole_images(tmp_path: Path, kind: str) -> None:
    path = written(tmp_path, GOOD[kind])
    header = read_header(path)
    assert (header.width, header.height, header.orientation, header.whole) == (50, 30, 1, True)
    assert image_size(path) == (50, 30)
    assert read_image(path).shape == (30, 50, 3)


def test_pixels_are_those_that_were_written(tmp_path: Path) -> None:
    np.testing.assert_array_equal(read_image(written(tmp_path, PNG)), PIXELS)


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("orientation", range(1, 9))
def test_exif_orientation_is_told_and_not_applied(tmp_path: Path, orientation: int, order: str) -> None:
    for data in (
        with_segment(0xE1, b"Exif\0\0" + exif(orientation, order)),
        with_chunk(b"eXIf", exif(orientation, order)),
    ):
        path = written(tmp_path, data)
        header = read_header(path)
        assert (header.width, header.height, header.orientation) == (50, 30, orientation)
        assert read_image(path).shape == (30, 50, 3)


@pytest.mark.parametrize("data", [b"", b"II*\0", b"II*\0\xff\xff\xff\xff", exif(9), exif(1)[:20], b"??*\0" + bytes(30)])
def test_exif_that_makes_no_sense_says_nothing(tmp_path: Path, data: bytes) -> None:
    assert read_header(written(tmp_path, with_segment(0xE1, b"Exif\0\0" + data))).orientation == 1


@pytest.mark.parametrize("kind", ["jpeg", "progressive", "restarts", "exif thumbnail", "png", "16 bit"])
@pytest.mark.parametrize("share", [0.6, 0.9, 0.999])
def test_truncated_data_is_noticed(tmp_path: Path, kind: str, share: float) -> None:
    data = GOOD[kind]
    keep = min(int(len(data) * share), len(data) - 1)
    path = written(tmp_path, data[:keep])
    assert not read_header(path).whole
    with pytest.raises(BadFile, match=r"image\.bin: the image ends before its data does \(truncated\)"):
        read_image(path)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "the image file is empty"),
        (b"\xff", "is neither a PNG nor a JPEG image"),
        (b"GIF89a........", "is neither a PNG nor a JPEG image; convert it"),
        (b"\xff\xd8\xff", r"ends within its header \(truncated\)"),
        (JPEG[:100], r"ends within its header \(truncated\)"),
        (PNG[:20], r"ends within its header \(truncated\)"),
        (PNG[:8] + chunk(b"IDAT", bytes(13)), "does not begin with its header"),
        (b"\xff\xd8\xff\xd9", "no frame header before its data"),
        (JPEG[:2] + b"\xff\xe0\0\0" + JPEG[2:], "segment of length 0 at byte 2"),
        (JPEG[:2] + segment(0xE0, b"x") + b"x" + JPEG[2:], "no segment at byte 7"),
        (PNG[:16] + struct.pack(">II", 0, 5) + PNG[24:], "says it has 0 x 5 pixels"),
    ],
)
def test_damaged_headers_are_named(tmp_path: Path, data: bytes, message: str) -> None:
    path = written(tmp_path, data)
    for read in (image_size, read_image):
        with pytest.raises(BadFile, match=message):
            read(path)


def test_a_huge_image_is_refused_before_decoding(tmp_path: Path) -> None:
    head = struct.pack(">IIBBBBB", 100_000, 100_000, 8, 2, 0, 0, 0)
    path = written(tmp_path, PNG[:8] + chunk(b"IHDR", head) + PNG[33:])
    for read in (image_size, read_image):
        with pytest.raises(TooLarge, match=f"100000 x 100000 pixels; more than {MAX_IMAGE_PIXELS} are not read"):
            read(path)


def test_damaged_pixels_are_named(tmp_path: Path) -> None:
    data = PNG[:41] + bytes(len(PNG) - 41 - 12) + PNG[-12:]
    with pytest.raises(BadFile, match=r"image\.bin: the image (cannot be decoded|ends)"):
        read_image(written(tmp_path, data))


def test_things_that_are_no_files(tmp_path: Path) -> None:
    with pytest.raises(BadFile, match="the image is missing"):
        read_header(tmp_path / "none.png")
    with pytest.raises(BadFile, match="is not a file"):
        read_header(tmp_path)
    with pytest.raises(BadFile, match="the image cannot be read"):
        read_header(tmp_path / ("x" * 300))
    with pytest.raises(BadFile, match="the image cannot be read"):
        read_header(tmp_path / "a\0b")


@given(data=st.binary(max_size=200), head=st.sampled_from([b"", b"\xff\xd8\xff", PNG[:8], PNG[:33], JPEG[:160]]))
def test_no_bytes_do_more_than_be_refused(tmp_path_factory: pytest.TempPathFactory, data: bytes, head: bytes) -> None:
    path = written(tmp_path_factory.getbasetemp(), head + data)
    try:
        header = read_header(path)
    except ArsError:
        return
    assert 0 < header.width * header.height <= MAX_IMAGE_PIXELS


def test_a_damaged_length_asks_for_no_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = written(tmp_path, PNG[:33] + struct.pack(">I", 0xFFFFFFF0) + b"eXIf" + PNG[33:])
    asked: list[int] = []
    pread = os.pread

    def counted(descriptor: int, count: int, place: int) -> bytes:
        asked.append(count)
        return pread(descriptor, min(count, 1 << 20), place)

    monkeypatch.setattr(os, "pread", counted)
    with pytest.raises(BadFile, match="ends within its header"):
        read_header(path)
    assert max(asked) <= 1 << 16
