"""Outlines as JSON: masks with many pieces, and what of a request makes which options."""

import base64

import cv2
import numpy as np
import pytest

from ars_web.errors import BadInput
from ars_web.geometry.camera import Camera
from ars_web.masks.masks_json import BoxFromMasksJson, OutlineJson
from ars_web.sessions.model import HullOptions

CAMERA = Camera(200, 100, 150.0, 150.0, 99.5, 49.5)


def outline_of(mask: np.ndarray):
    text = base64.b64encode(cv2.imencode(".png", mask.astype(np.uint8))[1].tobytes()).decode()
    return OutlineJson(mask_png=text).outline(CAMERA)


def test_pieces_and_holes_of_a_mask_are_kept() -> None:
    mask = np.zeros((100, 200), bool)
    mask[10:40, 10:60] = mask[50:90, 100:190] = True
    mask[20:30, 20:40] = False
    large, small = outline_of(mask)
    assert np.ptp(large.outer, axis=0) == pytest.approx([90, 40], abs=1)
    assert len(small.holes) == 1


def test_an_empty_mask_is_no_outline() -> None:
    with pytest.raises(BadInput, match="every pixel is 0"):
        outline_of(np.zeros((100, 200), bool))


@pytest.mark.parametrize("inverted", [False, True])
def test_a_speckled_mask_is_refused_before_it_is_traced(inverted: bool) -> None:
    mask = np.zeros((100, 200), bool)
    mask[2::4, 2::4] = True
    with pytest.raises(BadInput, match="clear its specks"):
        outline_of(mask != inverted)


def test_what_touches_the_border_is_one_piece_without_a_hole() -> None:
    (whole,) = outline_of(np.ones((100, 200), bool))
    assert whole.holes == ()
    assert np.ptp(whole.outer, axis=0) == pytest.approx([200, 100])


def test_options_are_those_of_the_request() -> None:
    triangle = [{"outer": [[0, 0], [9, 0], [5, 9]]}]
    body = {"class_id": 2, "views": [{"frame": frame, "polygons": triangle} for frame in (0, 1)]}
    plain = BoxFromMasksJson.model_validate(body)
    assert plain.asked == {"class_id": 2, "options": HullOptions(), "name": None, "box_id": None}
    more = {"orientation": "free", "position": "mass", "widen_px": 2, "ground": -0.5, "name": "it", "box_id": 4}
    asked = BoxFromMasksJson.model_validate({**body, **more}).asked
    assert asked == {"class_id": 2, "options": HullOptions("free", "mass", 2.0, -0.5), "name": "it", "box_id": 4}
