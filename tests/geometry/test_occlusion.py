"""Visible fractions against rays through every pixel, and by hand."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from ars_web.errors import BadInput
from ars_web.geometry import camera as cameras
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.labels import NEAR, labels_of_boxes
from ars_web.geometry.occlusion import visible_fractions

IDENTITY = np.eye(4)
PINHOLE = Camera(640, 480, 500.0, 500.0, 319.5, 239.5)


def upright(x: float, y: float, z: float, size: tuple[float, float, float]) -> Box:
    place = np.array([x, y, z], dtype=np.float64)
    return Box(rigid_transform.from_rotation(np.eye(3), place), np.array(size, dtype=np.float64))


def fractions(camera: Camera, boxes: list[Box], *, T_world_camera: np.ndarray = IDENTITY, step: int = 8) -> np.ndarray:
    bbox = labels_of_boxes(camera, T_world_camera[None], boxes).bbox
    return visible_fractions(camera, T_world_camera[None], boxes, bbox, step=step)[0]


def brute_force(oracle, camera: Camera, T_world_camera: np.ndarray, boxes: list[Box]) -> tuple[np.ndarray, np.ndarray]:
    """The share of each box's pixels on which it is the nearest, and how many pixels it has, by a ray every half pixel.

    A box with the camera inside is met at its far side and hides nothing.
    """
    u, v = (np.arange(-0.25, side - 0.5, 0.5) for side in (camera.width, camera.height))
    rays = cameras.normalised_from_pixels(camera, np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2))
    met, hiding = [], []
    for box in boxes:
        entry, leave = oracle.depths(rays, T_world_camera, box)
        entry = np.maximum(entry, NEAR)
        hit = entry <= leave
        centre_box = rigid_transform.invert(box.T_world_box) @ T_world_camera[:, 3]
        inside = bool((np.abs(centre_box[:3]) < box.size / 2).all())
        met.append(np.where(hit, leave if inside else entry, np.nan))
        hiding.append(np.where(hit & (not inside), entry, np.inf))
    counts, shares = [], []
    for i, depth in enumerate(met):
        others = np.min([np.full(len(rays), np.inf), *(hiding[:i] + hiding[i + 1 :])], axis=0)
        counts.append(np.isfinite(depth).sum() / 4)
        shares.append((others[np.isfinite(depth)] >= depth[np.isfinite(depth)]).mean() if counts[-1] else np.nan)
    return np.array(shares), np.array(counts)


def test_fractions_follow_rays_through_every_pixel(oracle, random_scene):
    errors = []
    for seed in range(24):
        camera, T_world_camera, _ = random_scene(seed)
        random = np.random.default_rng(seed)
        T_camera_boxes = [
            rigid_transform.from_position_wxyz(random.normal(size=3) * 0.3 + [0, 0, 0.7], random.normal(size=4))
            for _ in range(6)
        ]
        boxes = [Box(T_world_camera @ T, random.uniform(0.05, 0.5, 3)) for T in T_camera_boxes]
        want, pixels = brute_force(oracle, camera, T_world_camera, boxes)
        found = fractions(camera, boxes, T_world_camera=T_world_camera)
        clear = pixels > 30
        errors += list(np.abs(found - want)[clear])
    assert len(errors) > 60
    assert np.mean(errors) < 0.01
    assert np.max(errors) < 0.12


def test_a_finer_step_is_nearer_to_the_truth(oracle, random_scene):
    camera, T_world_camera, _ = random_scene(8)
    boxes = [
        Box(
            T_world_camera @ rigid_transform.from_position_wxyz(np.array([x, 0.02, 0.8 - x]), np.array([1, x, 0.3, 0])),
            size,
        )
        for x, size in zip((-0.1, 0.0, 0.15), np.full((3, 3), 0.25), strict=True)
    ]
    want, _ = brute_force(oracle, camera, T_world_camera, boxes)
    coarse = np.abs(fractions(camera, boxes, T_world_camera=T_world_camera, step=16) - want).mean()
    fine = np.abs(fractions(camera, boxes, T_world_camera=T_world_camera, step=1) - want).mean()
    assert fine <= coarse
    assert fine < 2e-3


def test_half_a_box_is_behind_another():
    # Both are squares of 100 px; the nearer hides the right half of the farther.
    far, near = upright(0, 0, 1.0, (0.2, 0.2, 1e-6)), upright(0.05, 0, 0.5, (0.1, 0.2, 1e-6))
    assert_allclose(fractions(PINHOLE, [far, near]), [0.5, 1.0], atol=0.05)
    assert_allclose(fractions(PINHOLE, [near, far]), [1.0, 0.5], atol=0.05)


def test_the_order_of_the_boxes_does_not_matter(random_scene):
    camera, T_world_camera, _ = random_scene(4)
    random = np.random.default_rng(0)
    boxes = [
        Box(
            T_world_camera
            @ rigid_transform.from_position_wxyz(random.normal(size=3) * 0.2 + [0, 0, 0.8], random.normal(size=4)),
            random.uniform(0.1, 0.4, 3),
        )
        for _ in range(9)
    ]
    order = random.permutation(9)
    found = fractions(camera, boxes, T_world_camera=T_world_camera)
    assert_array_equal(fractions(camera, [boxes[i] for i in order], T_world_camera=T_world_camera), found[order])


def test_which_of_two_boxes_in_each_other_is_nearer_is_decided_ray_by_ray():
    # Two slabs that cross like an X seen from above: each shows one half of itself.
    turn = rigid_transform.rotation_about_z(0.0)
    lean = np.array([[np.cos(0.5), 0, np.sin(0.5)], [0, 1, 0], [-np.sin(0.5), 0, np.cos(0.5)]])
    a = Box(rigid_transform.from_rotation(lean @ turn, np.array([0, 0, 1.0])), np.array([0.4, 0.3, 0.01]))
    b = Box(rigid_transform.from_rotation(lean.T @ turn, np.array([0, 0, 1.0])), np.array([0.4, 0.3, 0.01]))
    found = fractions(PINHOLE, [a, b], step=2)
    assert found[0] == pytest.approx(found[1], abs=0.02)
    assert 0.4 < found[0] < 0.7


def test_a_box_of_five_pixels_has_a_meaningful_fraction():
    far = upright(0, 0, 10.0, (0.1, 0.1, 1e-6))
    for hidden in (0.2, 0.5, 0.8):
        near = upright(-0.05 + hidden * 0.05, 0, 5.0, (hidden * 0.05 + 0.05, 0.2, 1e-6))
        edge = (-0.05 + hidden * 0.05 + (hidden * 0.05 + 0.05) / 2) * 100 + 2.5
        assert fractions(PINHOLE, [far, near])[0] == pytest.approx(1 - np.clip(edge / 5, 0, 1), abs=0.11)


def test_a_box_round_the_camera_hides_nothing_and_is_hidden_by_what_is_in_it():
    room, thing = upright(0, 0, 0, (8, 8, 8)), upright(0, 0, 2.0, (0.4, 0.4, 0.4))
    found = fractions(PINHOLE, [room, thing])
    assert found[1] == 1.0
    side = 0.4 * 500 / 1.8
    assert found[0] == pytest.approx(1 - side**2 / (640 * 480), abs=0.01)
    outside = upright(0, 0, 9.0, (1, 1, 1))
    assert fractions(PINHOLE, [room, outside])[1] == 1.0


def test_boxes_that_are_not_in_the_image_are_nan_and_hide_nothing():
    behind, seen = upright(0, 0, -1, (0.5, 0.5, 0.5)), upright(0, 0, 1, (0.2, 0.2, 0.2))
    found = fractions(PINHOLE, [behind, seen])
    assert np.isnan(found[0])
    assert found[1] == 1.0


def test_a_wholly_hidden_box_is_not_visible():
    assert_array_equal(fractions(PINHOLE, [upright(0, 0, 2, (0.1, 0.1, 0.1)), upright(0, 0, 1, (1, 1, 0.1))]), [0, 1])


def test_equal_boxes_do_not_hide_each_other():
    box = upright(0, 0, 1, (0.2, 0.2, 0.2))
    assert_array_equal(fractions(PINHOLE, [box, box]), [1, 1])


def test_no_scene_yields_a_nan_for_a_box_with_a_label(random_scene):
    for seed in range(150):
        camera, T_world_camera, box = random_scene(seed)
        other = random_scene(seed + 1000)[2]
        boxes = [
            box,
            Box(T_world_camera @ rigid_transform.from_position_wxyz(np.array([0, 0, 0.4]), np.ones(4)), other.size),
        ]
        bbox = labels_of_boxes(camera, T_world_camera[None], boxes).bbox
        found = visible_fractions(camera, T_world_camera[None], boxes, bbox)
        assert_array_equal(np.isnan(found), np.isnan(bbox[..., 0]))
        shown = found[~np.isnan(found)]
        assert ((shown >= 0) & (shown <= 1)).all()


def test_a_step_below_one_pixel_is_refused():
    with pytest.raises(BadInput, match="at least 1 pixel, not 0"):
        fractions(PINHOLE, [upright(0, 0, 1, (0.2, 0.2, 0.2))], step=0)


def test_no_boxes_and_no_frames():
    assert visible_fractions(PINHOLE, np.zeros((0, 4, 4)), [], np.zeros((0, 0, 4))).shape == (0, 0)
    assert visible_fractions(PINHOLE, IDENTITY[None], [], np.zeros((1, 0, 4))).shape == (1, 0)
