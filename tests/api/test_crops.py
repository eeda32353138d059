"""Rectangles of images: from text, and round boxes."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ars_web.api.crops import Crop, crop_from_text, crop_round
from ars_web.errors import BadInput


def test_a_crop_is_read_as_it_is_written():
    assert crop_from_text("0,8,320,240", width=320, height=240) == Crop(0, 8, 320, 240)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "'' must be four whole numbers"),
        ("1,2,3", "'1,2,3' must be four whole numbers"),
        ("1,2,3,4,5", "four whole numbers"),
        ("0,0,10.5,10", "'0,0,10.5,10' must be four whole numbers"),
        ("-1,0,10,10", "'-1,0,10,10' must be four whole numbers"),
        ("0,0,٣,10", "four whole numbers"),
        ("0,0,1e2,10", "four whole numbers"),
        ("0,0,10,10\n", "four whole numbers"),
        ("0,0,99999999999999999999,10", "four whole numbers"),
        ("10,0,10,10", "10,0,10,10 is empty"),
        ("0,12,10,10", "0,12,10,10 is empty"),
        ("0,0,321,240", "0,0,321,240 reaches beyond the image, which is 320 x 240"),
        ("0,0,320,241", "reaches beyond the image"),
    ],
)
def test_what_is_no_crop_of_the_image_is_refused(text: str, words: str):
    with pytest.raises(BadInput, match=words):
        crop_from_text(text, width=320, height=240)


sides = st.integers(64, 4000)


@given(width=sides, height=sides, shares=st.tuples(*[st.floats(0, 1)] * 4))
def test_a_crop_round_a_box_holds_it_and_is_in_the_image(width: int, height: int, shares):
    x0, x1 = sorted(share * width for share in shares[:2])
    y0, y1 = sorted(share * height for share in shares[2:])
    crop = crop_round((x0, y0, x1, y1), width=width, height=height)
    assert 0 <= crop.x0 < crop.x1 <= width
    assert 0 <= crop.y0 < crop.y1 <= height
    assert crop.x0 <= x0
    assert crop.y0 <= y0
    assert crop.x1 >= x1
    assert crop.y1 >= y1
    whole_width, whole_height = crop.x1 == width and crop.x0 == 0, crop.y1 == height and crop.y0 == 0
    if not whole_width and not whole_height:
        assert 3 * crop.width == 4 * (crop.y1 - crop.y0)
        # A margin, wherever the image has one.
        assert x0 - crop.x0 >= 4 or crop.x0 == 0
        assert crop.x1 - x1 >= 4 or crop.x1 == width


def test_a_small_box_is_shown_with_what_is_round_it():
    assert crop_round((300, 200, 310, 208), width=640, height=480) == Crop(256, 168, 352, 240)


def test_a_crop_is_of_blocks_where_the_image_lets_it():
    assert crop_round((301, 203, 411, 300), width=640, height=480).is_of_blocks(8)
    assert not Crop(0, 0, 16, 12).is_of_blocks(8)
    assert Crop(0, 4, 16, 12).is_of_blocks(4)
