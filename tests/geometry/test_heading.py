"""Headings beside the original tool's own formula, and what symmetry and the near plane make of them."""

import cv2
import numpy as np
import pytest

from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.heading import heading_edges, headings
from ars_web.geometry.symmetry import NO_SYMMETRY, Symmetry, rotations_of

BENT = Camera(640, 480, 500.0, 510.0, 310.0, 245.0, "brown", (-0.2, 0.05, 0.001, -0.001, 0.0))
FLAT = Camera(640, 480, 500.0, 500.0, 319.5, 239.5)

QUARTERS = Symmetry("discrete", rotations=(((0.0, 0.0, 1.0), 4),))
EVERY_WAY = Symmetry("discrete", rotations=(((0.0, 0.0, 1.0), 2), ((1.0, 0.0, 0.0), 2)))
ROUND_ABOUT_X = Symmetry("continuous", axis=(1.0, 0.0, 0.0))
CYLINDER_ALONG_X = Symmetry("continuous", axis=(1.0, 0.0, 0.0), flip=True)
ROUND_ABOUT_Z = Symmetry("continuous", axis=(0.0, 0.0, 1.0))


def turned(random: np.random.Generator, n: int) -> list[Box]:
    """n boxes some metre before a camera at the origin, turned anyhow."""
    found: list[Box] = []
    for _ in range(n):
        R = rigid_transform.nearest_rotation(random.normal(size=(3, 3)))
        centre = np.array([*random.uniform(-0.3, 0.3, 2), 1.2])
        found.append(Box(rigid_transform.from_rotation(R, centre), random.uniform(0.05, 0.4, 3)))
    return found


def the_originals(camera: Camera, box: Box) -> float:
    """As the original's builder of compass datasets computes it, but of pixels that are not cut to whole numbers."""
    sx, sy, sz = box.size
    # Corners 0 and 3 of its virtual objects; the camera is at the world's origin.
    points = np.array([[sx, -sy, sz], [-sx, -sy, sz]]) / 2
    in_camera = rigid_transform.transform_points(box.T_world_box, points)
    image, _ = cv2.projectPoints(in_camera, np.zeros(3), np.zeros(3), camera.K, np.array(camera.distortion))
    direction = image[0, 0] - image[1, 0]
    angle = np.degrees(np.arctan2(direction[1], direction[0]))
    return float(angle + 360.0 if angle < 0 else angle)


def heading_of(camera: Camera, box: Box, symmetry: Symmetry = NO_SYMMETRY) -> float:
    (found,) = headings(camera, np.eye(4)[None], box, symmetry)
    assert 0.0 <= found < 2 * np.pi
    return float(found)


@pytest.mark.parametrize("camera", [BENT, FLAT])
def test_they_are_the_original_tools(camera: Camera) -> None:
    for box in turned(np.random.default_rng(1), 50):
        assert np.degrees(heading_of(camera, box)) == pytest.approx(the_originals(camera, box), abs=1e-6)


def test_they_are_counted_clockwise_from_the_right() -> None:
    ahead = np.array([0.0, 0.0, 2.0])
    for degrees in (0.0, 30.0, 90.0, 180.0, 300.0):
        # The camera's y is down, so a turn about its z from x to y is clockwise in the image.
        R = rigid_transform.rotation_about_z(np.radians(degrees))
        box = Box(rigid_transform.from_rotation(R, ahead), np.array([0.2, 0.1, 0.1]))
        assert np.degrees(heading_of(FLAT, box)) == pytest.approx(degrees, abs=1e-9)


@pytest.mark.parametrize("symmetry", [QUARTERS, EVERY_WAY, ROUND_ABOUT_X, CYLINDER_ALONG_X, ROUND_ABOUT_Z])
def test_poses_that_look_the_same_have_one_heading(symmetry: Symmetry) -> None:
    for box in turned(np.random.default_rng(2), 20):
        expected = heading_of(BENT, box, symmetry)
        for R in rotations_of(symmetry):
            same = Box(box.T_world_box @ rigid_transform.from_rotation(R, np.zeros(3)), box.size)
            assert heading_of(BENT, same, symmetry) == pytest.approx(expected, abs=1e-9)


def test_a_quarter_turn_folds_headings_seen_from_above() -> None:
    for degrees in (10.0, 100.0, 190.0, 280.0):
        R = rigid_transform.rotation_about_z(np.radians(degrees))
        box = Box(rigid_transform.from_rotation(R, np.array([0.0, 0.0, 2.0])), np.array([0.1, 0.1, 0.1]))
        assert np.degrees(heading_of(FLAT, box, QUARTERS)) == pytest.approx(10.0, abs=1e-9)


def test_what_is_round_about_its_x_axis_has_that_axis_for_a_heading_and_else_none() -> None:
    for box in turned(np.random.default_rng(3), 10):
        (edge,) = heading_edges(box, ROUND_ABOUT_X)
        np.testing.assert_allclose(edge.mean(axis=0), box.T_world_box[:3, 3], atol=1e-12)
        np.testing.assert_allclose(edge[1] - edge[0], box.T_world_box[:3, 0] * box.size[0], atol=1e-12)
        assert heading_of(FLAT, box, ROUND_ABOUT_Z) == 0.0
        assert heading_edges(box, ROUND_ABOUT_Z).shape == (0, 2, 3)
        both = [heading_of(FLAT, box, ROUND_ABOUT_X), heading_of(FLAT, box, ROUND_ABOUT_X) + np.pi]
        assert heading_of(FLAT, box, CYLINDER_ALONG_X) == pytest.approx(min(v % (2 * np.pi) for v in both), abs=1e-9)


def test_an_edge_that_runs_behind_the_camera_keeps_the_direction_of_its_part_ahead() -> None:
    # From half a metre behind the camera to 1.5 m before it, beside the axis.
    along = np.array([0.1, 0.05, 2.0])
    x = along / np.linalg.norm(along)
    y = np.cross([0.0, 0.0, 1.0], x)
    y /= np.linalg.norm(y)
    centre = np.array([0.2, 0.3, 0.5])
    R = np.column_stack([x, y, np.cross(x, y)])
    box = Box(rigid_transform.from_rotation(R, centre), np.array([np.linalg.norm(along), 0.02, 0.02]))
    ((start, end),) = heading_edges(box, NO_SYMMETRY)
    assert start[2] < 0 < end[2]
    ahead = start + np.array([0.3, 0.6, 1.0])[:, None] * (end - start)
    ahead = ahead[ahead[:, 2] > 0]
    pixels = ahead[:, :2] / ahead[:, 2:] * 500.0
    direction = pixels[-1] - pixels[0]
    expected = np.arctan2(direction[1], direction[0]) % (2 * np.pi)
    assert heading_of(FLAT, box) == pytest.approx(expected, abs=1e-9)
