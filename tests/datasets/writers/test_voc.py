import numpy as np
import pytest

from ars_web.datasets.writers.voc import inclusive


@pytest.mark.parametrize(
    ("bbox", "expected"),
    [
        ((0.0, 0.0, 64.0, 48.0), [1, 1, 64, 48]),
        ((10.4, 10.6, 20.4, 20.6), [11, 12, 20, 21]),
        ((63.8, 47.8, 64.0, 48.0), [64, 48, 64, 48]),
        ((0.0, 0.0, 0.2, 0.2), [1, 1, 1, 1]),
        ((5.5, 5.5, 5.6, 5.6), [7, 7, 7, 7]),
    ],
)
def test_boxes_are_whole_pixels_counted_from_1(bbox: tuple[float, ...], expected: list[int]) -> None:
    found = inclusive(np.array(bbox).reshape(1, 1, 4), np.array([[64, 48]]))
    assert found[0, 0].tolist() == expected


def test_boxes_stay_in_the_image_and_within_half_a_pixel() -> None:
    random = np.random.default_rng(0)
    corners = np.sort(random.random((200, 5, 2, 2)), axis=2) * [640, 480]
    bbox = corners.reshape(200, 5, 4)
    x0, y0, x1, y1 = np.moveaxis(inclusive(bbox, np.tile([640, 480], (200, 1))), -1, 0)
    assert ((x0 >= 1) & (y0 >= 1) & (x1 >= x0) & (y1 >= y0) & (x1 <= 640) & (y1 <= 480)).all()
    edges = np.stack([x0 - 1, y0 - 1, x1, y1], axis=-1)
    wide = ((corners[..., 1, :] - corners[..., 0, :]) >= 1).all(axis=-1)
    assert np.abs(edges - bbox)[wide].max() <= 0.5
