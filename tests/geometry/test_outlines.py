"""Outlines and wireframes: within the image, round the label, and along the box's true edges."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from shapely.geometry import LineString, MultiLineString, Polygon

from ars_web.geometry import camera as cameras
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import EDGES, Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.labels import NEAR, labels_of_boxes, outline, outlines, wireframe

IDENTITY = np.eye(4)
PINHOLE = Camera(640, 480, 500.0, 500.0, 319.5, 239.5)
SEEDS = range(150)


def clockwise_area(ring: np.ndarray) -> float:
    """Positive where a ring runs clockwise as seen in the image, y down."""
    x, y = ring.T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) / 2)


def upright(x: float, y: float, z: float, size: tuple[float, float, float]) -> Box:
    return Box(rigid_transform.from_rotation(np.eye(3), np.array([x, y, z])), np.array(size))


def test_outlines_lie_round_their_labels(random_scene):
    shown = 0
    for seed in SEEDS:
        camera, T_world_camera, box = random_scene(seed)
        found = labels_of_boxes(camera, T_world_camera[None], [box], tolerance=0.05)
        bbox, truncated = found.bbox[0, 0], found.truncated[0, 0]
        ring = outline(camera, T_world_camera, box, tolerance=0.05)
        assert (len(ring) == 0) == bool(np.isnan(bbox[0])), seed
        if len(ring) == 0:
            continue
        shown += 1
        assert len(ring) >= 3
        assert_allclose([*ring.min(axis=0), *ring.max(axis=0)], bbox, atol=0.06, err_msg=f"scene {seed}")
        assert clockwise_area(ring) < 0, f"scene {seed} runs clockwise"
        # The ring's area is what truncation left of the amodal outline's.
        if truncated == 0:
            assert_array_equal(bbox, found.bbox_amodal[0, 0])
        assert (np.hypot(*(ring - np.roll(ring, 1, axis=0)).T) > 0).all(), f"scene {seed} repeats a point"
    assert shown > 50


def test_an_outline_holds_the_pixels_whose_rays_meet_the_box(oracle, random_scene):
    for seed in SEEDS[::5]:
        camera, T_world_camera, box = random_scene(seed)
        ring = outline(camera, T_world_camera, box)
        u, v = np.meshgrid(np.arange(0, camera.width, 0.5), np.arange(0, camera.height, 0.5))
        pixels = np.stack([u, v], axis=-1)
        met = oracle.rays_meet(cameras.normalised_from_pixels(camera, pixels), T_world_camera, box, near=NEAR)
        area = abs(clockwise_area(ring)) if len(ring) else 0.0
        perimeter = float(np.hypot(*(ring - np.roll(ring, 1, axis=0)).T).sum()) if len(ring) else 0.0
        assert area == pytest.approx(met.sum() / 4, abs=0.25 * perimeter + 1), f"scene {seed}"


def test_wireframes_lie_in_the_image_and_on_the_outline(random_scene):
    for seed in SEEDS:
        camera, T_world_camera, box = random_scene(seed)
        lines = wireframe(camera, T_world_camera, box, tolerance=0.05)
        ring = outline(camera, T_world_camera, box, tolerance=0.05)
        if len(ring) == 0:
            assert lines == []
            continue
        around = Polygon(ring).buffer(0.15)
        for line in lines:
            assert len(line) >= 2
            assert ((line >= 0) & (line <= [camera.width, camera.height])).all()
            assert around.covers(LineString(line)), f"scene {seed}"


def test_wireframes_follow_every_edge_and_nothing_else(random_scene):
    """Points along the true edges, projected one by one, against the polylines; and back."""
    for seed in SEEDS[::2]:
        camera, T_world_camera, box = random_scene(seed)
        lines = wireframe(camera, T_world_camera, box, tolerance=0.05)
        corners = rigid_transform.transform_points(rigid_transform.invert(T_world_camera), box.corners_world)
        t = np.linspace(0, 1, 3001)[:, None]
        points = np.concatenate([(1 - t) * corners[i] + t * corners[j] for i, j in EDGES])
        image = cameras.image_from_pixels(cameras.pixels_from_camera_points(camera, points[points[:, 2] >= NEAR]))
        seen = image[((image >= 0) & (image <= [camera.width, camera.height])).all(axis=1)]
        if not lines:
            assert len(seen) == 0, f"scene {seed}"
            continue
        drawn = MultiLineString(lines)
        worst = max((drawn.distance(LineString([p, p + 1e-9])) for p in seen[::37]), default=0.0)
        assert worst < 0.1, f"scene {seed}"
        vertices = np.concatenate(lines)
        gaps = np.hypot(*(vertices[:, None] - seen[None, ::3]).transpose(2, 0, 1)).min(axis=1) if len(seen) else [0.0]
        spacing = np.hypot(*np.diff(seen, axis=0).T) if len(seen) > 1 else np.zeros(1)
        assert np.median(gaps) <= 3 * np.median(spacing) + 0.1, f"scene {seed}"


def test_a_box_before_a_pinhole_is_drawn_as_twelve_straight_lines():
    lines = wireframe(PINHOLE, IDENTITY, upright(0, 0, 1.1, (0.2, 0.2, 0.2)))
    assert [len(line) for line in lines] == [2] * 12
    ends = {tuple(point) for line in lines for point in line.round(6).tolist()}
    assert (270.0, 190.0) in ends
    assert len(ends) == 8


def test_a_ring_is_counter_clockwise_as_seen():
    ring = outline(PINHOLE, IDENTITY, upright(0, 0, 1.1, (0.2, 0.2, 0.2)))
    assert_allclose(
        np.roll(ring, -np.argmin(ring.sum(axis=1)), axis=0), [[270, 190], [270, 290], [370, 290], [370, 190]]
    )


def test_a_box_over_a_corner_of_the_image_has_that_corner():
    # The front face spans -80 to 20 and 430 to 530 px.
    ring = outline(PINHOLE, IDENTITY, upright((-30 - 320) / 500, (480 - 240) / 500, 1.0, (0.2, 0.2, 1e-8)))
    assert_allclose(sorted(ring.round(4).tolist()), [[0, 430], [0, 480], [20, 430], [20, 480]])


def test_all_outlines_at_once_are_the_single_ones(random_scene):
    camera, T_world_camera, _ = random_scene(3)
    boxes = []
    for seed in range(40):
        _, T_world_other, box = random_scene(seed)
        T_world_box = T_world_camera @ rigid_transform.invert(T_world_other) @ box.T_world_box
        boxes.append(Box(T_world_box, box.size))
    turns = np.array([rigid_transform.rotation_about_z(angle) for angle in np.linspace(0, 6, 230)])
    Ts = T_world_camera @ rigid_transform.from_rotation(turns, np.zeros((230, 3)))
    wanted = ~np.isnan(labels_of_boxes(camera, Ts, boxes).bbox[..., 0])
    wanted[::7] = False
    points, offsets = outlines(camera, Ts, boxes, wanted)
    assert offsets.shape == (230 * 40 + 1,)
    assert offsets[-1] == len(points)
    assert wanted.any(axis=0).sum() > 10
    for i in range(0, 230, 19):
        for j, box in enumerate(boxes):
            ring = points[offsets[i * 40 + j] : offsets[i * 40 + j + 1]]
            assert_array_equal(ring, outline(camera, Ts[i], box) if wanted[i, j] else np.zeros((0, 2)))
    assert (np.diff(offsets)[~wanted.ravel()] == 0).all()


def test_a_box_that_the_lens_bends_out_of_the_image_and_back_keeps_both_its_parts():
    # A long thin bar just above a barrel image: its middle is bent out of sight, its ends are not.
    camera = Camera(400, 300, 260.0, 260.0, 199.5, 149.5, "brown", (-0.3, 0.05, 0.0, 0.0, 0.0))
    bar = upright(0, -0.75, 1.0, (2.0, 0.06, 0.002))
    bbox = labels_of_boxes(camera, IDENTITY[None], [bar]).bbox[0, 0]
    middle = cameras.image_from_pixels(cameras.pixels_from_camera_points(camera, np.array([[0.0, -0.72, 1.0]])))[0]
    assert middle[1] < 0 < bbox[3]
    ring = outline(camera, IDENTITY, bar)
    assert_allclose([*ring.min(axis=0), *ring.max(axis=0)], bbox, atol=0.11)
    lines = [line for line in wireframe(camera, IDENTITY, bar) if np.ptp(line[:, 0]) > 5]
    left, right = [line for line in lines if line[0, 0] < 200], [line for line in lines if line[0, 0] >= 200]
    assert left
    assert right
