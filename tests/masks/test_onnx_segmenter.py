"""A segmenter of the user's own: tiny networks, as ONNX's format has them."""

from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from ars_web.errors import BadFile, BadInput
from ars_web.masks.onnx_segmenter import DEVIATION, MEAN, OnnxSegmenter
from ars_web.masks.segmenter import SegmentPrompt, Stroke


@pytest.fixture
def redness(tmp_path: Path, tiny_network: ModuleType) -> Path:
    """A network that finds what is more than half red: RGB 0 to 1, put right for ImageNet's mean and deviation."""
    return tiny_network.redness(tmp_path / "red.onnx")


def photograph() -> tuple[np.ndarray, np.ndarray]:
    """A red disc on blue; blue green red."""
    image = np.full((240, 300, 3), (200, 90, 40), dtype=np.uint8)
    ys, xs = np.mgrid[:240, :300]
    truth = np.hypot(xs + 0.5 - 150, ys + 0.5 - 100) < 40
    image[truth] = (40, 60, 220)
    return image, truth


RECTANGLE = (105.0, 55.0, 195.0, 145.0)


def test_the_network_tells_which_pixels_are_the_object(redness):
    image, truth = photograph()
    found = OnnxSegmenter(redness).segment(image, SegmentPrompt(rectangle=RECTANGLE))
    assert found.shape == truth.shape
    assert (found & truth).sum() / (found | truth).sum() > 0.97


def test_nothing_outside_the_rectangle_is_found(redness):
    image, _ = photograph()
    found = OnnxSegmenter(redness).segment(image, SegmentPrompt(rectangle=(105.0, 55.0, 150.0, 145.0)))
    assert found.any()
    assert not found[:, 151:].any()


def test_strokes_are_kept_to(redness):
    image, truth = photograph()
    beside = Stroke(np.array([[150.0, 70], [150.0, 100]]), 8)
    on = Stroke(np.array([[112.0, 140], [120.0, 140]]), 6)
    found = OnnxSegmenter(redness).segment(image, SegmentPrompt(RECTANGLE, (on,), (beside,)))
    assert not found[72:98, 149:152].any()
    assert found[140, 113:119].all()
    assert (found & truth).sum() > 0.8 * truth.sum()


def test_nothing_found_is_told_with_the_remedy(redness):
    image, _ = photograph()
    with pytest.raises(BadInput, match="no object was found there: draw the rectangle"):
        OnnxSegmenter(redness).segment(image, SegmentPrompt(rectangle=(10.0, 170.0, 90.0, 235.0)))


def test_a_rectangle_outside_the_image_is_refused(redness):
    with pytest.raises(BadInput, match="lies outside the image"):
        OnnxSegmenter(redness).segment(photograph()[0], SegmentPrompt(rectangle=(900.0, 0.0, 950.0, 50.0)))


def test_a_file_that_is_missing_is_refused(tmp_path):
    with pytest.raises(BadFile, match="there is no such file"):
        OnnxSegmenter(tmp_path / "none.onnx")


def test_a_file_that_is_no_network_is_refused(tmp_path):
    path = tmp_path / "words.onnx"
    path.write_text("weights")
    with pytest.raises(BadFile, match="cannot read it as an ONNX network"):
        OnnxSegmenter(path)


def test_a_network_that_takes_other_channels_is_refused(tmp_path, tiny_network):
    path = tiny_network.write(tmp_path / "four.onnx", weights=np.ones((1, 4, 1, 1)), bias=np.zeros(1), channels=4)
    with pytest.raises(BadFile, match="does not take a 1 x 3 x 320 x 320 input"):
        OnnxSegmenter(path)


def test_a_network_that_answers_more_than_one_mask_is_refused(tmp_path, tiny_network):
    path = tiny_network.write(tmp_path / "two.onnx", weights=np.ones((2, 3, 1, 1)), bias=np.zeros(2))
    with pytest.raises(BadFile, match=r"must be 1 x 1 x h x w, not \[1, 2, 320, 320\]"):
        OnnxSegmenter(path)


def test_a_coarser_answer_is_brought_to_the_photographs_size(tmp_path, tiny_network):
    """The mean over eleven by eleven pixels, so ten rows and columns fewer."""
    weights = np.zeros((1, 3, 11, 11))
    weights[0, 0] = DEVIATION[0] * 50 / 121
    path = tiny_network.write(tmp_path / "mean.onnx", weights=weights, bias=np.array([50 * (MEAN[0] - 0.5)]))
    image, truth = photograph()
    found = OnnxSegmenter(path).segment(image, SegmentPrompt(rectangle=RECTANGLE))
    assert (found & truth).sum() / (found | truth).sum() > 0.9
