"""COCO's run lengths beside pycocotools' own."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from pycocotools import mask as coco

from ars_web.errors import BadInput
from ars_web.geometry.run_lengths import RunLengths, compressed, from_compressed, mask_of, rle_of


def masks() -> list[np.ndarray]:
    random = np.random.default_rng(0)
    found = [np.zeros((5, 7), bool), np.ones((5, 7), bool), np.eye(6, dtype=bool), np.ones((1, 1), bool)]
    for share in (0.02, 0.5, 0.98):
        found.append(random.uniform(size=(37, 53)) < share)
    disc = np.hypot(*np.mgrid[-200:200, -300:300]) < 150
    return [*found, disc, ~disc]


@pytest.mark.filterwarnings("ignore:__array__ implementation doesn't accept a copy:DeprecationWarning")  # pycocotools'
@pytest.mark.parametrize("mask", masks(), ids=lambda mask: f"{mask.shape}-{mask.sum()}")
def test_run_lengths_are_those_of_pycocotools(mask: np.ndarray):
    rle = rle_of(mask)
    want = coco.encode(np.asfortranarray(mask.astype(np.uint8)))
    assert compressed(rle) == want["counts"].decode()
    assert rle.area == coco.area(want)
    assert_array_equal(mask_of(rle), mask)
    read = from_compressed(want["counts"].decode(), mask.shape)
    assert_array_equal(read.counts, rle.counts)
    of_counts = coco.frPyObjects({"size": list(mask.shape), "counts": rle.counts.tolist()}, *mask.shape)
    assert_array_equal(coco.decode(of_counts).astype(bool), mask)


def test_runs_go_down_the_columns_and_begin_outside():
    mask = np.array([[1, 0, 0], [1, 0, 1]], dtype=bool)
    assert_array_equal(rle_of(mask).counts, [0, 2, 3, 1])


def test_a_part_of_an_image_is_told_as_the_image():
    random = np.random.default_rng(1)
    for _ in range(60):
        height, width = random.integers(1, 12, 2)
        row, column = random.integers(0, height), random.integers(0, width)
        rows, columns = random.integers(0, height - row + 1), random.integers(0, width - column + 1)
        part = random.uniform(size=(rows, columns)) < 0.7
        whole = np.zeros((height, width), bool)
        whole[row : row + rows, column : column + columns] = part
        found = rle_of(part, row=int(row), column=int(column), size=(int(height), int(width)))
        assert_array_equal(found.counts, rle_of(whole).counts)
        assert_array_equal(mask_of(found), whole)


def test_wrong_input_is_refused():
    with pytest.raises(BadInput, match="add up to 6"):
        RunLengths((2, 3), np.array([1, 2]))
    with pytest.raises(BadInput, match="none be negative"):
        RunLengths((2, 3), np.array([8, -2]))
    with pytest.raises(BadInput, match="not within an image of 3 x 2"):
        rle_of(np.ones((2, 2), bool), row=1, size=(2, 3))
    with pytest.raises(BadInput, match="from '0' to 'o'"):
        from_compressed("00é", (2, 3))
    with pytest.raises(BadInput, match="in the middle of a number"):
        from_compressed("6o", (2, 3))
