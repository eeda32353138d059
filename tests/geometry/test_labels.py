"""Labels against the slow oracle, by hand where a hand can, and by what must hold in any scene."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ars_web.errors import BadInput
from ars_web.geometry import camera as cameras
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.labels import NEAR, labels_of_boxes, outline, outlines, wireframe

PINHOLE = Camera(640, 480, 500.0, 500.0, 319.5, 239.5)
BROWN = Camera(640, 480, 500.0, 505.0, 300.0, 250.0, "brown", (-0.28, 0.09, 0.0011, -0.0009, -0.01))
FISHEYE = Camera(640, 480, 320.0, 322.0, 330.0, 235.0, "fisheye", (0.02, -0.01, 0.003, -0.0005))
IDENTITY = np.eye(4)


def box_at(x: float, y: float, z: float, size: tuple[float, float, float] = (0.2, 0.2, 0.2)) -> Box:
    return Box(
        rigid_transform.from_rotation(np.eye(3), np.array([x, y, z], dtype=np.float64)),
        np.array(size, dtype=np.float64),
    )


def label(camera: Camera, box: Box, T_world_camera: np.ndarray = IDENTITY) -> tuple[np.ndarray, np.ndarray, float]:
    found = labels_of_boxes(camera, T_world_camera[None], [box])
    return found.bbox[0, 0], found.bbox_amodal[0, 0], float(found.truncated[0, 0])


def far_tolerance(amodal: np.ndarray) -> float:
    """What a box that reaches far beyond the image may be off (labels.labels_of_boxes), twice."""
    distance = np.abs(np.nan_to_num(amodal)).max()
    return 2 * distance * min(2e-5 * (1 + 1e-4 * distance), 1e-3)


# Against the oracle


@pytest.mark.parametrize("first", range(0, 120, 10))
def test_labels_equal_the_oracle(first: int, oracle, random_scene):
    for seed in range(first, first + 10):
        camera, T_world_camera, box = random_scene(seed)
        bbox, amodal, truncated = label(camera, box, T_world_camera)
        want = oracle.label(camera, T_world_camera, box, near=NEAR)
        far = far_tolerance(want.bbox_amodal)
        np.testing.assert_allclose(bbox, want.bbox, atol=0.1, rtol=0, err_msg=f"bbox of scene {seed}")
        np.testing.assert_allclose(amodal, want.bbox_amodal, atol=0.1 + far, rtol=0, err_msg=f"amodal, scene {seed}")
        assert truncated == pytest.approx(want.truncated, abs=0.01), f"truncation of scene {seed}"


def test_the_oracles_scenes_are_of_every_kind(oracle, random_scene):
    kinds = set()
    for seed in range(120):
        camera, T_world_camera, box = random_scene(seed)
        _, amodal, truncated = label(camera, box, T_world_camera)
        corners = rigid_transform.transform_points(rigid_transform.invert(T_world_camera), box.corners_world)
        straddles = bool((corners[:, 2] < NEAR).any() and (corners[:, 2] > NEAR).any())
        place = (
            "nowhere"
            if np.isnan(amodal[0])
            else ("whole", "cut", "outside")[int(np.ceil(truncated)) + (truncated == 1)]
        )
        kinds.add((camera.model, place, straddles))
    assert {(model, place, False) for model in ("pinhole", "brown", "fisheye") for place in ("whole", "cut")} <= kinds
    assert {(model, "cut", True) for model in ("pinhole", "brown", "fisheye")} <= kinds


@pytest.mark.parametrize("camera", [PINHOLE, BROWN, FISHEYE], ids=lambda camera: camera.model)
def test_many_boxes_in_many_frames_are_each_labelled_as_if_alone(camera: Camera):
    random = np.random.default_rng(5)
    boxes = [box_at(*random.uniform([-0.5, -0.4, -0.2], [0.5, 0.4, 1.5])) for _ in range(7)]
    turns = [rigid_transform.rotation_about_z(angle) for angle in np.linspace(0, 3, 2500)]
    Ts = rigid_transform.from_rotation(np.array(turns), random.normal(size=(2500, 3)) * 0.2)
    found = labels_of_boxes(camera, Ts, boxes)
    for i in (0, 1, 584, 585, 586, 1777, 2499):
        for j, box in enumerate(boxes):
            bbox, amodal, truncated = label(camera, box, Ts[i])
            np.testing.assert_array_equal(found.bbox[i, j], bbox)
            np.testing.assert_array_equal(found.bbox_amodal[i, j], amodal)
            assert found.truncated[i, j] == truncated


# By hand


@pytest.mark.parametrize("camera", [BROWN, FISHEYE])
def test_a_border_that_cuts_a_box_aslant_does_not_make_its_label_worse(camera: Camera):
    # A curve that is off by a twentieth of a pixel meets a border that it nearly runs along pixels away from where
    # it should: among 20,000 boxes there are some of those.
    random = np.random.default_rng(5)
    turns = np.linalg.qr(random.normal(size=(400, 3, 3)))[0]
    turns *= np.sign(np.linalg.det(turns))[:, None, None]
    poses = rigid_transform.from_rotation(turns, random.uniform(-0.6, 0.6, (400, 3)))
    boxes = [box_at(*random.uniform(-1, 1, 3), size=tuple(random.uniform(0.1, 0.5, 3))) for _ in range(50)]
    usual, fine = labels_of_boxes(camera, poses, boxes), labels_of_boxes(camera, poses, boxes, tolerance=1e-3)
    cut = (fine.truncated > 0) & ~np.isnan(fine.bbox[..., 0])
    assert cut.sum() > 2000
    assert np.abs(usual.bbox - fine.bbox)[cut].max() < 0.1


def test_a_box_before_a_pinhole_is_its_front_face():
    bbox, amodal, truncated = label(PINHOLE, box_at(0, 0, 1.1))
    # The front face is 0.2 m wide at 1 m: 100 px round the centre of the image.
    np.testing.assert_allclose(bbox, [270, 190, 370, 290], atol=1e-9)
    np.testing.assert_array_equal(bbox, amodal)
    assert truncated == 0


def test_truncated_is_the_share_of_the_area_outside():
    # The front face spans 100 px from -30 to 70 and is flat enough to hide the rest of the box.
    box = box_at((20 - 320) / 500, 0.0, 1.0, (0.2, 0.2, 1e-8))
    bbox, amodal, truncated = label(PINHOLE, box)
    np.testing.assert_allclose(amodal, [-30, 190, 70, 290], atol=1e-6)
    np.testing.assert_allclose(bbox, [0, 190, 70, 290], atol=1e-6)
    assert truncated == pytest.approx(0.3, abs=1e-3)


@pytest.mark.parametrize("camera", [PINHOLE, BROWN, FISHEYE], ids=lambda camera: camera.model)
def test_a_box_behind_the_camera_has_no_label(camera: Camera):
    bbox, amodal, truncated = label(camera, box_at(0.05, 0.02, -1.0))
    assert np.isnan(bbox).all()
    assert np.isnan(amodal).all()
    assert truncated == 1
    assert outline(camera, IDENTITY, box_at(0.05, 0.02, -1.0)).shape == (0, 2)
    assert wireframe(camera, IDENTITY, box_at(0.05, 0.02, -1.0)) == []


@pytest.mark.parametrize("camera", [PINHOLE, BROWN], ids=lambda camera: camera.model)
def test_a_box_that_fills_the_image_is_the_image(camera: Camera):
    bbox, amodal, truncated = label(camera, box_at(0, 0, 1.0, (50, 50, 0.1)))
    np.testing.assert_allclose(bbox, [0, 0, 640, 480])
    assert (amodal[:2] < 0).all()
    assert (amodal[2:] > [640, 480]).all()
    assert 0 < truncated < 1
    ring = outline(camera, IDENTITY, box_at(0, 0, 1.0, (50, 50, 0.1)))
    assert sorted(map(tuple, ring.tolist())) == [(0, 0), (0, 480), (640, 0), (640, 480)]


@pytest.mark.parametrize("camera", [PINHOLE, BROWN, FISHEYE], ids=lambda camera: camera.model)
def test_from_inside_a_box_it_is_all_that_the_camera_sees(camera: Camera):
    bbox, _, truncated = label(camera, box_at(0.1, 0, 0, (3, 3, 3)))
    seen = cameras.image_from_pixels(cameras.image_border_pixels(camera, samples=400))
    rays = cameras.normalised_from_pixels(camera, cameras.image_border_pixels(camera, samples=400))
    assert np.isfinite(rays).all()
    np.testing.assert_allclose(bbox, [*seen.min(axis=0), *seen.max(axis=0)], atol=1e-9)
    assert 0 <= truncated < 1


def test_where_the_lens_ends_within_the_image_the_box_ends_there():
    # The radial polynomial turns at r = 1 / sqrt(3 * 0.4), which is 248 px here: nothing is seen outside that circle.
    camera = Camera(800, 800, 408.0, 408.0, 399.5, 399.5, "brown", (-0.4, 0.0, 0.0, 0.0, 0.0))
    rim = 408.0 * camera.valid_radius * (1 - 0.4 * camera.valid_radius**2)
    bbox, amodal, truncated = label(camera, box_at(0, 0, 1.0, (50, 50, 0.1)))
    np.testing.assert_allclose(bbox, [400 - rim, 400 - rim, 400 + rim, 400 + rim], atol=0.05)
    np.testing.assert_allclose(amodal, bbox)
    assert truncated == pytest.approx(0, abs=1e-9)
    ring = outline(camera, IDENTITY, box_at(0, 0, 1.0, (50, 50, 0.1)))
    np.testing.assert_allclose(np.linalg.norm(ring - 400, axis=1), rim, atol=1e-6)
    # A box that the lens cannot see, though the polynomial would fold it back into the image.
    x, z = 0.8, 0.5
    r = x / z
    assert 0 < 408.0 * r * (1 - 0.4 * r**2) + 400 < 800
    assert np.isnan(label(camera, box_at(x, 0, z, (0.05, 0.05, 0.05)))[1]).all()


def test_a_box_one_metre_behind_and_one_before_do_not_become_one_label():
    # A long box through the camera: its corners behind would be mirrored if they were projected.
    bbox, _, _ = label(PINHOLE, box_at(0.3, 0, 0.2, (0.1, 0.1, 2.4)))
    assert bbox[0] == pytest.approx(320 + 500 * 0.25 / 1.4, abs=1e-6)
    assert bbox[2] == 640


def test_no_boxes_and_no_frames_give_empty_labels():
    assert labels_of_boxes(PINHOLE, np.zeros((0, 4, 4)), [box_at(0, 0, 1)]).bbox.shape == (0, 1, 4)
    assert labels_of_boxes(PINHOLE, IDENTITY[None], []).truncated.shape == (1, 0)
    points, offsets = outlines(PINHOLE, np.zeros((0, 4, 4)), [], np.zeros((0, 0), dtype=bool))
    assert points.shape == (0, 2)
    assert offsets.tolist() == [0]


@pytest.mark.parametrize("tolerance", [0.0, -1.0, 1e-9, float("nan")])
def test_a_tolerance_that_cannot_be_held_is_refused(tolerance: float):
    with pytest.raises(BadInput, match=r"at least 0\.001"):
        labels_of_boxes(PINHOLE, IDENTITY[None], [box_at(0, 0, 1)], tolerance=tolerance)
    with pytest.raises(BadInput, match=r"at least 0\.001"):
        outline(PINHOLE, IDENTITY, box_at(0, 0, 1), tolerance=tolerance)
    with pytest.raises(BadInput, match=r"at least 0\.001"):
        wireframe(PINHOLE, IDENTITY, box_at(0, 0, 1), tolerance=tolerance)


def test_arrays_that_may_only_be_read_or_lie_otherwise_are_labelled_alike():
    boxes = [box_at(0.1, 0, 1)]
    Ts = np.asfortranarray(np.tile(IDENTITY, (3, 1, 1)))
    Ts.flags.writeable = False
    found = labels_of_boxes(BROWN, Ts, boxes)
    np.testing.assert_array_equal(found.bbox[1], labels_of_boxes(BROWN, IDENTITY[None], boxes).bbox[0])


def test_several_threads_may_ask_at_once(random_scene):
    scenes = [random_scene(seed) for seed in range(8)]
    Ts = [np.repeat(T[None], 900, axis=0) for _, T, _ in scenes]
    alone = [labels_of_boxes(scene[0], T, [scene[2]] * 10).bbox for scene, T in zip(scenes, Ts, strict=True)]
    with ThreadPoolExecutor(8) as pool:
        asked = [
            pool.submit(labels_of_boxes, scene[0], T, [scene[2]] * 10) for scene, T in zip(scenes, Ts, strict=True)
        ]
        for want, found in zip(alone, asked, strict=True):
            np.testing.assert_array_equal(found.result().bbox, want)


# What holds in any scene

finite = st.floats(-30, 30, allow_subnormal=False)
quaternions = st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: sum(v * v for v in q) > 1e-3)
transforms = st.builds(
    lambda position, q: rigid_transform.from_position_wxyz(np.array(position), np.array(q)),
    st.tuples(finite, finite, finite),
    quaternions,
)
boxes = st.builds(lambda T, size: Box(T, np.array(size)), transforms, st.tuples(*[st.floats(1e-4, 60)] * 3))
coefficient = st.floats(-0.5, 0.5, allow_subnormal=False)
small = st.floats(-0.02, 0.02, allow_subnormal=False)
numbers = st.tuples(
    st.integers(1, 2000), st.integers(1, 2000), st.floats(20, 3000), st.floats(20, 3000), finite, finite
).map(lambda n: (n[0], n[1], n[2], n[3], n[0] / 2 + n[4], n[1] / 2 + n[5]))
# Not cameras but what they are made of: the run-time checks draw random numbers, which a strategy must not.
any_camera = st.one_of(
    numbers,
    st.tuples(numbers, st.just("brown"), st.tuples(coefficient, coefficient, small, small, coefficient)),
    st.tuples(numbers, st.just("fisheye"), st.tuples(*[coefficient] * 4)),
).map(lambda made_of: made_of if len(made_of) == 6 else (*made_of[0], *made_of[1:]))


@given(made_of=any_camera, T_world_camera=transforms, box=boxes)
def test_no_scene_yields_a_label_outside_the_image_or_a_nan(made_of: tuple, T_world_camera: np.ndarray, box: Box):
    camera = Camera(*made_of)
    bbox, amodal, truncated = label(camera, box, T_world_camera)
    assert 0 <= truncated <= 1
    assert np.isnan(amodal).all() or np.isfinite(amodal).all()
    if np.isnan(bbox).any():
        assert np.isnan(bbox).all()
        assert truncated == 1
        return
    assert np.isfinite(amodal).all()
    assert 0 <= bbox[0] < bbox[2] <= camera.width
    assert 0 <= bbox[1] < bbox[3] <= camera.height
    # Both are sampled along one ring, or are one.
    assert (amodal[:2] <= bbox[:2] + 0.1).all()
    assert (amodal[2:] >= bbox[2:] - 0.1).all()
    ring = outline(camera, T_world_camera, box)
    assert np.isfinite(ring).all()
    assert ((ring >= 0) & (ring <= [camera.width, camera.height])).all()
    for line in wireframe(camera, T_world_camera, box):
        assert len(line) >= 2
        assert ((line >= 0) & (line <= [camera.width, camera.height])).all()


@given(made_of=any_camera, T_world_camera=transforms, box=boxes)
def test_no_scene_yields_a_label_for_a_box_behind_the_camera(made_of: tuple, T_world_camera: np.ndarray, box: Box):
    corners = rigid_transform.transform_points(rigid_transform.invert(T_world_camera), box.corners_world)
    # The same box, as far behind the camera as it is long.
    back = T_world_camera[:3, 2] * (corners[:, 2].max() + 1e-6)
    T_behind = rigid_transform.from_rotation(box.T_world_box[:3, :3], box.T_world_box[:3, 3] - back)
    behind = Box(T_behind, box.size)
    bbox, amodal, truncated = label(Camera(*made_of), behind, T_world_camera)
    assert np.isnan(bbox).all()
    assert np.isnan(amodal).all()
    assert truncated == 1


@given(made_of=any_camera, T_world_camera=transforms, box=boxes, T_moved_world=transforms)
def test_labels_do_not_change_under_a_rigid_motion_of_the_world(made_of, T_world_camera, box, T_moved_world):
    camera = Camera(*made_of)
    bbox, amodal, truncated = label(camera, box, T_world_camera)
    moved = label(camera, Box(T_moved_world @ box.T_world_box, box.size), T_moved_world @ T_world_camera)
    far = far_tolerance(amodal)
    np.testing.assert_allclose(moved[1], amodal, atol=0.12 + far, rtol=0)
    # A box that reaches into the image by less than rounding may be in it once and not the other time.
    width = 0.0 if np.isnan(bbox[0]) else min(bbox[2] - bbox[0], bbox[3] - bbox[1])
    if np.isnan(bbox[0]) != np.isnan(moved[0][0]):
        other = bbox if np.isnan(moved[0][0]) else moved[0]
        assert min(other[2] - other[0], other[3] - other[1]) < 0.12
    elif width > 0.12:
        np.testing.assert_allclose(moved[0], bbox, atol=0.12, rtol=0)
        assert moved[2] == pytest.approx(truncated, abs=0.02)
