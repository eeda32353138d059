"""Keypoints: the default ones are the centre and the corners, and all move, turn and scale with their box."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from ars_web.errors import BadInput
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.keypoints import DEFAULT_KEYPOINTS, Keypoint, checked_keypoints, keypoints_world

TURNED = rigid_transform.from_rotation(rigid_transform.rotation_about_z(np.pi / 2), np.array([1.0, 2.0, 3.0]))
BOX = Box(TURNED, np.array([0.2, 0.4, 0.6]))


def test_the_default_ones_are_the_centre_and_the_corners():
    assert [keypoint.name for keypoint in DEFAULT_KEYPOINTS] == ["centre", *(f"corner {i}" for i in range(8))]
    assert_allclose(keypoints_world(BOX, DEFAULT_KEYPOINTS), [[1.0, 2.0, 3.0], *BOX.corners_world])


def test_a_place_is_in_units_of_the_boxs_sizes_along_its_axes():
    # The box's x is the world's y.
    handle = Keypoint("handle", (0.5, 0.0, -0.25))
    assert_allclose(keypoints_world(BOX, [handle]), [[1.0, 2.1, 2.85]])
    assert keypoints_world(BOX, []).shape == (0, 3)


def test_two_of_one_name_or_too_many_are_refused():
    kept = tuple(Keypoint(f"k{i}", (0.0, 0.0, 0.0)) for i in range(64))
    assert checked_keypoints(kept) == kept
    with pytest.raises(BadInput, match="at most 64 keypoints, not 65"):
        checked_keypoints((*kept, Keypoint("one more", (0.0, 0.0, 0.0))))
    with pytest.raises(BadInput, match="two keypoints called 'k3'"):
        checked_keypoints((*kept[:4], kept[3]))


@pytest.mark.parametrize(
    ("name", "place", "message"),
    [
        ("", (0.0, 0.0, 0.0), "1 to 60 characters"),
        (" tip", (0.0, 0.0, 0.0), "no space at its ends"),
        ("t" * 61, (0.0, 0.0, 0.0), "1 to 60 characters"),
        ("a,b", (0.0, 0.0, 0.0), "without a comma"),
        ("a\nb", (0.0, 0.0, 0.0), "printable"),
        ("tip", (0.0, 0.0, 2.1), r"'tip' must be three numbers from -2 to 2 .*not \[0.0, 0.0, 2.1\]"),
        ("tip", (0.0, np.nan, 0.0), "three numbers"),
        ("tip", (0.0, 0.0), "three numbers"),
    ],
)
def test_what_is_no_keypoint_is_refused(name: str, place: tuple[float, ...], message: str):
    with pytest.raises(BadInput, match=message):
        Keypoint(name, place)  # pyright: ignore[reportArgumentType]
