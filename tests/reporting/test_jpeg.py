"""Pictures of reports: small enough, and as high as wide as they were."""

import cv2
import numpy as np
import pytest

from ars_web.reporting.jpeg import jpeg


@pytest.mark.parametrize(
    ("shape", "expected"),
    [((480, 640), (480, 640)), ((1200, 1600), (720, 960)), ((1600, 800), (960, 480)), ((4, 5000), (1, 960))],
)
def test_the_longer_side_is_at_most_what_is_asked(shape: tuple[int, int], expected: tuple[int, int]) -> None:
    picture = np.zeros((*shape, 3), dtype=np.uint8)
    picture[:, : shape[1] // 2] = 200, 100, 50
    read = cv2.imdecode(np.frombuffer(jpeg(picture, longest=960), dtype=np.uint8), cv2.IMREAD_COLOR)
    assert read is not None
    assert read.shape == (*expected, 3)
    assert np.abs(read[expected[0] // 2, expected[1] // 4].astype(int) - [200, 100, 50]).max() < 8
