"""Pixels as they are stored, and smaller."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from ars_web.errors import BadFile
from ars_web.recordings.images import REDUCTIONS, read_image, read_reduced, read_smaller


@pytest.fixture(scope="module")
def image(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A smooth picture whose sides are no multiples of eight."""
    x, y = np.meshgrid(np.linspace(0, 255, 325), np.linspace(0, 255, 243))
    path = tmp_path_factory.mktemp("images") / "image.jpg"
    cv2.imwrite(str(path), np.stack([x, y, (x + y) / 2], axis=-1).astype(np.uint8), [cv2.IMWRITE_JPEG_QUALITY, 97])
    return path


@pytest.mark.parametrize("factor", REDUCTIONS)
def test_each_smaller_pixel_is_the_mean_of_its_square(image: Path, factor: int):
    small = read_smaller(image, factor=factor)
    assert small.shape == (-(-243 // factor), -(-325 // factor), 3)
    whole = read_image(image)[: 243 // factor * factor, : 325 // factor * factor].astype(float)
    means = whole.reshape(243 // factor, factor, 325 // factor, factor, 3).mean(axis=(1, 3))
    assert np.abs(small[: 243 // factor, : 325 // factor] - means).max() < 6


@pytest.mark.parametrize(
    ("width", "size"), [(400, (325, 243)), (325, (325, 243)), (160, (160, 120)), (40, (40, 30)), (1, (1, 1))]
)
def test_an_image_is_read_as_small_as_it_is_shown(image: Path, width: int, size: tuple[int, int]):
    assert read_reduced(image, width=width).shape[1::-1] == size


@pytest.mark.parametrize("width", [1000, 100, 10])
def test_an_image_that_is_cut_short_is_not_read_smaller(image: Path, tmp_path: Path, width: int):
    short = tmp_path / "short.jpg"
    short.write_bytes(image.read_bytes()[:-500])
    with pytest.raises(BadFile, match="truncated"):
        read_reduced(short, width=width)
