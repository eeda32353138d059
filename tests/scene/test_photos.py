"""Photos for the scene: as they are where that will do, rectified where it will not, and made once."""

import os
from pathlib import Path

import cv2
import numpy as np
import pytest

from ars_web.datasets.images import rectify
from ars_web.errors import BadFile, NotFound
from ars_web.geometry.camera import Camera, rectified
from ars_web.scene.photos import Photos, make_photo
from ars_web.sessions.model import FrameTable

PLAIN = Camera(160, 120, 150.0, 150.0, 79.5, 59.5)
BENT = Camera(160, 120, 150.0, 152.0, 83.0, 55.0, "brown", (-0.2, 0.03, 1e-3, -1e-3, 0.0))


def picture(path: Path, seed: int = 0) -> np.ndarray:
    """A smooth image, which JPEG keeps nearly as it is."""
    noise = np.random.default_rng(seed).integers(0, 255, (120, 160, 3), dtype=np.uint8)
    image = cv2.GaussianBlur(noise, (0, 0), 6)
    assert cv2.imwrite(str(path), image, [cv2.IMWRITE_JPEG_QUALITY, 95])
    return image


def table(*paths: Path, cameras: tuple[int, ...]) -> FrameTable:
    Ts = np.tile(np.eye(4), (len(paths), 1, 1))
    return FrameTable(tuple(path.name for path in paths), paths, np.array(cameras), Ts)


def decoded(content: bytes) -> np.ndarray:
    return cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_COLOR)


def test_a_jpeg_without_distortion_is_passed_on_as_it_is(tmp_path: Path) -> None:
    picture(tmp_path / "0.jpg")
    photo = make_photo(3, tmp_path / "0.jpg", PLAIN)
    assert (photo.content, photo.format) == ((tmp_path / "0.jpg").read_bytes(), "jpeg")
    assert (photo.frame, photo.flat) == (3, PLAIN)


@pytest.mark.parametrize(("name", "camera"), [("0.jpg", BENT), ("0.png", BENT), ("0.png", PLAIN)])
def test_other_images_are_rectified_and_encoded(tmp_path: Path, name: str, camera: Camera) -> None:
    picture(tmp_path / name)
    photo = make_photo(0, tmp_path / name, camera)
    stored = cv2.imread(str(tmp_path / name))
    wanted = stored if camera is PLAIN else rectify(stored, camera)
    assert photo.format == "jpeg"
    assert photo.flat == rectified(camera)
    assert np.abs(decoded(photo.content).astype(int) - wanted).mean() < 2


def test_a_photo_is_kept_until_its_image_changes(tmp_path: Path) -> None:
    path = tmp_path / "0.png"
    picture(path)
    photos = Photos({0: PLAIN}, table(path, cameras=(0,)))
    first = photos.get(0).result(20)
    assert photos.get(0).result(20) is first
    picture(path, seed=1)
    os.utime(path, ns=(1, 1))
    assert photos.get(0).result(20).content != first.content
    photos.close()


def test_neighbours_are_made_before_they_are_asked_for(tmp_path: Path) -> None:
    paths = [tmp_path / f"{i}.png" for i in range(2)]
    for path in paths:
        picture(path)
    photos = Photos({0: PLAIN}, table(*paths, cameras=(0, 0)))
    photos.prefetch((-1, 1, 2))
    ready = photos.get(1).result(20)
    assert photos.get(1).result(0) is ready
    photos.close()
    assert photos.get(0).cancelled()
    photos.prefetch((0,))


def test_an_image_that_cannot_be_shown_says_why(tmp_path: Path) -> None:
    picture(tmp_path / "good.jpg")
    (tmp_path / "cut.jpg").write_bytes((tmp_path / "good.jpg").read_bytes()[:900])
    (tmp_path / "linked.jpg").symlink_to(tmp_path / "good.jpg")
    paths = [tmp_path / name for name in ("cut.jpg", "linked.jpg", "gone.jpg", "good.jpg")]
    wide = Camera(320, 240, 150.0, 150.0, 79.5, 59.5)
    photos = Photos({0: PLAIN, 1: wide}, table(*paths, cameras=(0, 0, 0, 1)))
    for frame, why in enumerate(("truncated", "has become a link", "No such file", "160 x 120 pixels, its camera")):
        with pytest.raises(BadFile, match=why) as failure:
            photos.get(frame).result(20)
        assert failure.value.path == paths[frame]
    with pytest.raises(NotFound, match="no frame 4"):
        photos.get(4)
    photos.close()
