import errno
import os
import struct
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from ars_web.datasets.images import image_name, place_image, rectify
from ars_web.errors import BadFile
from ars_web.geometry import camera as cameras
from ars_web.geometry.camera import Camera

BENT = Camera(320, 240, 220.0, 221.0, 158.0, 121.0, "brown", (-0.25, 0.08, 0.001, -0.0008, 0.0))
FISHEYE = Camera(320, 240, 150.0, 150.0, 160.0, 119.0, "fisheye", (-0.02, 0.004, 0.0, 0.0))
FLAT = Camera(320, 240, 220.0, 220.0, 159.5, 119.5)


def picture(camera: Camera) -> np.ndarray:
    random = np.random.default_rng(0)
    small = random.integers(0, 255, (12, 16, 3), dtype=np.uint8)
    return cv2.resize(small, (camera.width, camera.height), interpolation=cv2.INTER_CUBIC)


def source(path: Path, image: np.ndarray) -> str:
    assert cv2.imwrite(str(path), image)
    return str(path)


def stamp(path: str) -> tuple[int, int]:
    status = Path(path).stat()
    return status.st_size, status.st_mtime_ns


def place(path: str, target: Path, *, camera: Camera = FLAT, images: str = "link") -> Path:
    place_image(path, str(target), camera=camera, stamp=stamp(path), images=images)
    return target


def test_names_keep_what_they_are() -> None:
    assert image_name("a", "/x/A.JPG", only_jpeg=False) == "a.jpg"
    assert image_name("a", "/x/a.jpeg", only_jpeg=False) == "a.jpeg"
    assert image_name("a", "/x/a.png", only_jpeg=False) == "a.png"
    assert image_name("a", "/x/a.jpeg", only_jpeg=True) == "a.jpg"
    assert image_name("a", "/x/a.PNG", only_jpeg=True) == "a.jpg"
    assert image_name("a", "/x/a", only_jpeg=False) == "a.png"
    assert image_name("a", "/x/a.JPG", only_jpeg=False, only_png=True) == "a.png"


def test_links_share_the_file_and_copies_do_not(tmp_path: Path) -> None:
    path = source(tmp_path / "a.jpg", picture(FLAT))
    link = place(path, tmp_path / "link.jpg")
    copy = place(path, tmp_path / "copy.jpg", images="copy")
    assert link.samefile(path)
    assert not copy.samefile(path)
    assert copy.read_bytes() == link.read_bytes()


@pytest.mark.parametrize("number", [errno.EXDEV, errno.EPERM, errno.EMLINK])
def test_where_no_link_can_be_made_a_copy_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int) -> None:
    def refused(*args: object) -> None:
        raise OSError(number, os.strerror(number))

    path = source(tmp_path / "a.jpg", picture(FLAT))
    monkeypatch.setattr(os, "link", refused)
    copy = place(path, tmp_path / "b.jpg")
    assert not copy.samefile(path)
    assert copy.read_bytes() == Path(path).read_bytes()


def test_a_full_disk_is_not_taken_for_a_missing_link(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*args: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    path = source(tmp_path / "a.jpg", picture(FLAT))
    monkeypatch.setattr(os, "link", full)
    with pytest.raises(OSError, match="No space left"):
        place(path, tmp_path / "b.jpg")


@pytest.mark.parametrize("images", ["link", "copy", "rectify"])
def test_a_link_that_took_the_place_of_an_image_is_refused(tmp_path: Path, images: str) -> None:
    secret = source(tmp_path / "secret.jpg", picture(FLAT))
    (tmp_path / "a.jpg").symlink_to("secret.jpg")
    with pytest.raises(BadFile, match=r"a\.jpg: the image has become a link since it was imported"):
        place_image(str(tmp_path / "a.jpg"), str(tmp_path / "b.jpg"), camera=FLAT, stamp=stamp(secret), images=images)
    assert not (tmp_path / "b.jpg").exists()


def test_a_png_becomes_a_jpeg_where_the_format_has_no_other(tmp_path: Path) -> None:
    path = source(tmp_path / "a.png", picture(FLAT))
    found = place(path, tmp_path / "b.jpg")
    assert found.read_bytes().startswith(b"\xff\xd8\xff")
    assert np.abs(cv2.imread(str(found)).astype(int) - picture(FLAT)).mean() < 3


def test_an_image_that_viewers_would_turn_is_written_as_it_is_stored(tmp_path: Path) -> None:
    path = source(tmp_path / "a.jpg", picture(FLAT))
    plain = Path(path).read_bytes()
    tiff = b"II*\x00" + struct.pack("<IHHHII", 8, 1, 0x0112, 3, 1, 6) + struct.pack("<I", 0)
    exif = b"Exif\x00\x00" + tiff
    Path(path).write_bytes(plain[:2] + b"\xff\xe1" + struct.pack(">H", len(exif) + 2) + exif + plain[2:])
    assert cv2.imread(path).shape == (320, 240, 3)  # what a training tool would see
    found = place(path, tmp_path / "b.jpg")
    assert cv2.imread(str(found)).shape == (240, 320, 3)
    assert np.abs(cv2.imread(str(found)).astype(int) - picture(FLAT)).mean() < 3


@pytest.mark.parametrize("camera", [BENT, FISHEYE])
def test_a_rectified_pixel_is_what_the_lens_put_elsewhere(camera: Camera) -> None:
    image = picture(camera)
    straight = rectify(image, camera)
    flat = cameras.rectified(camera)
    random = np.random.default_rng(1)
    pixels = random.integers([0, 0], [camera.width, camera.height], (300, 2))
    rays = cameras.normalised_from_pixels(flat, pixels.astype(float))
    u, v = cameras.pixels_from_normalised(camera, rays).T
    inside = (u > 1) & (v > 1) & (u < camera.width - 2) & (v < camera.height - 2)
    assert inside.sum() > 250
    sampled = cv2.remap(image, u.astype(np.float32)[None], v.astype(np.float32)[None], cv2.INTER_LINEAR)[0]
    written = straight[pixels[:, 1], pixels[:, 0]]
    assert np.abs(written.astype(int) - sampled)[inside].max() <= 6


def test_rectifying_a_flat_camera_copies_its_bytes(tmp_path: Path) -> None:
    path = source(tmp_path / "a.jpg", picture(FLAT))
    found = place(path, tmp_path / "b.jpg", images="rectify")
    assert found.read_bytes() == Path(path).read_bytes()
    assert not found.samefile(path)


def test_a_rectified_image_keeps_its_encoding(tmp_path: Path) -> None:
    jpeg = place(source(tmp_path / "a.jpg", picture(BENT)), tmp_path / "b.jpg", camera=BENT, images="rectify")
    png = place(source(tmp_path / "a.png", picture(BENT)), tmp_path / "b.png", camera=BENT, images="rectify")
    assert jpeg.read_bytes().startswith(b"\xff\xd8\xff")
    assert np.array_equal(cv2.imread(str(png)), rectify(picture(BENT), BENT))


def test_a_source_that_is_no_image_is_named(tmp_path: Path) -> None:
    path = tmp_path / "a.jpg"
    path.write_bytes(b"not an image at all")
    with pytest.raises(BadFile, match=r"a\.jpg"):
        place(str(path), tmp_path / "b.jpg")
    assert not (tmp_path / "b.jpg").exists()


def test_a_source_of_another_size_is_refused(tmp_path: Path) -> None:
    path = source(tmp_path / "a.jpg", picture(FLAT))
    with pytest.raises(BadFile, match="320 x 240 pixels, but its camera's are 321 x 240"):
        place(path, tmp_path / "b.jpg", camera=replace(FLAT, width=321))
