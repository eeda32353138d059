"""Boxes: corners and edges, overlap against a count of random points, and the box through four points."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from ars_web.errors import BadInput
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import EDGES, LARGEST_SIZE, Box, beside, from_four_points, iou, resting_on_ground, stack


def random_box(random: np.random.Generator, *, spread: float = 0.4) -> Box:
    T = rigid_transform.from_position_wxyz(random.normal(size=3) * spread, random.normal(size=4))
    return Box(T, random.uniform(0.3, 1.5, 3))


def upright(x: float, y: float, z: float, size: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> Box:
    return Box(
        rigid_transform.from_rotation(np.eye(3), np.array([x, y, z], dtype=np.float64)),
        np.array(size, dtype=np.float64),
    )


def holds(box: Box, points_world: np.ndarray) -> np.ndarray:
    points_box = rigid_transform.transform_points(rigid_transform.invert(box.T_world_box), points_world)
    return (np.abs(points_box) <= box.size / 2).all(axis=-1)


def test_corners_and_edges_are_the_boxs_own():
    box = Box(
        rigid_transform.from_rotation(rigid_transform.rotation_about_z(0.4), np.ones(3)), np.array([1.0, 2.0, 3.0])
    )
    assert_allclose(box.corners_world.mean(axis=0), [1, 1, 1])
    lengths = np.linalg.norm(box.corners_world[EDGES[:, 0]] - box.corners_world[EDGES[:, 1]], axis=1)
    assert_allclose(sorted(lengths), [1] * 4 + [2] * 4 + [3] * 4)
    assert box.volume == pytest.approx(6)


def test_a_box_cannot_be_changed():
    T, size = np.eye(4), np.ones(3)
    box = Box(T, size)
    T[0, 3], size[0] = 5.0, 5.0
    assert_array_equal(box.T_world_box, np.eye(4))
    assert_array_equal(box.size, [1, 1, 1])
    with pytest.raises(ValueError, match="read-only"):
        box.size[0] = 2
    with pytest.raises(ValueError, match="read-only"):
        box.T_world_box[0, 3] = 2


@pytest.mark.parametrize("size", [[0, 1, 1], [1, -1, 1], [1, 1, np.nan], [np.inf, 1, 1], [1, 1, 2 * LARGEST_SIZE]])
def test_sizes_that_no_object_has_are_refused(size: list[float]):
    with pytest.raises(BadInput, match="three lengths in metres"):
        Box(np.eye(4), np.array(size, dtype=np.float64))


def test_a_transform_that_scales_is_refused():
    with pytest.raises(BadInput, match="scale"):
        Box(np.diag([2.0, 2.0, 2.0, 1.0]), np.ones(3))


def test_stacks_of_boxes_also_of_none():
    Ts, sizes = stack([upright(1, 2, 3), upright(0, 0, 0, (1, 2, 3))])
    assert_array_equal(Ts[0, :3, 3], [1, 2, 3])
    assert_array_equal(sizes, [[1, 1, 1], [1, 2, 3]])
    Ts, sizes = stack([])
    assert (Ts.shape, sizes.shape) == ((0, 4, 4), (0, 3))


# Overlap


@pytest.mark.parametrize("seed", range(20))
def test_iou_is_the_share_of_random_points_in_both(seed: int):
    random = np.random.default_rng(seed)
    a, b = random_box(random), random_box(random)
    corners = np.concatenate([a.corners_world, b.corners_world])
    points = random.uniform(corners.min(axis=0), corners.max(axis=0), (200_000, 3))
    in_a, in_b = holds(a, points), holds(b, points)
    assert iou(a, b) == pytest.approx((in_a & in_b).sum() / (in_a | in_b).sum(), abs=0.01)


@pytest.mark.parametrize("seed", range(10))
def test_iou_is_symmetric_and_moves_with_the_world(seed: int):
    random = np.random.default_rng(seed)
    a, b, T = random_box(random), random_box(random), random_box(random).T_world_box
    assert iou(a, b) == pytest.approx(iou(b, a), abs=1e-9)
    moved = [Box(T @ box.T_world_box, box.size) for box in (a, b)]
    assert iou(*moved) == pytest.approx(iou(a, b), abs=1e-9)
    assert iou(a, a) == pytest.approx(1)


@pytest.mark.parametrize(
    ("a", "b", "want"),
    [
        (upright(0, 0, 0), upright(0.5, 0, 0), 1 / 3),
        (upright(0, 0, 0), upright(0, 0, 0, (0.5, 0.5, 0.5)), 1 / 8),
        (upright(0, 0, 0), upright(1, 0, 0), 0),
        (upright(0, 0, 0), upright(5, 0, 0), 0),
        (upright(0, 0, 0), upright(1 - 1e-6, 0, 0), 1e-6 / (2 - 1e-6)),
        (upright(0, 0, 0, (1, 1, 1e-6)), upright(0.5, 0, 0, (1, 1, 1e-6)), 1 / 3),
        (upright(9e3, 9e3, 0, (0.1, 0.1, 0.1)), upright(9e3 + 0.05, 9e3, 0, (0.1, 0.1, 0.1)), 1 / 3),
        (upright(0, 0, 0, (LARGEST_SIZE,) * 3), upright(0, 0, 0, (LARGEST_SIZE,) * 3), 1),
    ],
    ids=["half", "within", "touching", "apart", "sliver", "sheets", "far out", "huge"],
)
def test_iou_by_hand(a: Box, b: Box, want: float):
    assert iou(a, b) == pytest.approx(want, rel=1e-6, abs=1e-9)
    assert 0 <= iou(a, b) <= 1


# The box through four points


def four_points(box: Box, *, y_side: float = 1.0) -> np.ndarray:
    """p0 to p3 along z, x and y of a box; `y_side` -1 goes the other way round."""
    signs = np.array([[-1, -y_side, -1], [-1, -y_side, 1], [1, -y_side, 1], [1, y_side, 1.0]])
    return rigid_transform.transform_points(box.T_world_box, signs * box.size / 2)


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("y_side", [1.0, -1.0], ids=["right-handed", "left-handed"])
def test_four_exact_points_give_the_box(seed: int, y_side: float):
    box = random_box(np.random.default_rng(seed))
    found, residual = from_four_points(four_points(box, y_side=y_side))
    assert_allclose(found.T_world_box, box.T_world_box, atol=1e-9)
    assert_allclose(found.size, box.size, atol=1e-12)
    assert residual == pytest.approx(0, abs=1e-6)


@pytest.mark.parametrize("seed", range(10))
def test_points_drawn_by_hand_give_nearly_the_box_and_say_how_crooked_they_are(seed: int):
    random = np.random.default_rng(seed)
    box = random_box(random)
    points = four_points(box) + random.normal(size=(4, 3)) * 0.01
    found, residual = from_four_points(points)
    assert iou(found, box) > 0.7
    assert 0 < residual < 0.2
    # The residual is the largest turn between an edge as drawn and the box's axis.
    edges = np.diff(points, axis=0)[[1, 2, 0]]
    directions = edges / np.linalg.norm(edges, axis=1, keepdims=True)
    angles = np.arccos(np.clip(np.abs((directions * found.T_world_box[:3, :3].T).sum(axis=1)), 0, 1))
    assert residual == pytest.approx(angles.max(), abs=1e-6)


def test_a_bent_corner_is_shared_among_the_edges():
    # x leans towards y by 0.1 rad: the nearest rotation gives each of the two half of it.
    lean = np.array([np.cos(0.1), np.sin(0.1), 0])
    points = np.cumsum([[0, 0, 0], [0, 0, 1], lean, [0, 1, 0]], axis=0)
    _, residual = from_four_points(np.array(points, dtype=np.float64))
    assert residual == pytest.approx(0.05, abs=1e-6)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([[0, 0, 0], [0, 0, 0], [1, 0, 0], [1, 1, 0]], "p0 and p1 coincide"),
        ([[0, 0, 0], [0, 0, 1], [0, 0, 1], [1, 1, 0]], "p1 and p2 coincide"),
        ([[0, 0, 0], [0, 0, 1], [1, 0, 1], [1, 0, 1]], "p2 and p3 coincide"),
        ([[0, 0, 0], [0, 0, 1], [1, 0, 1], [2, 0, 3]], "nearly parallel"),
        ([[0, 0, 0], [0, 0, 1], [0, 0, 2], [0, 0, 3]], "nearly parallel"),
        ([[0, 0, np.nan], [0, 0, 1], [1, 0, 1], [1, 1, 1]], "finite"),
        ([[0, 0, 0], [0, 0, 3e4], [1, 0, 3e4], [1, 1, 3e4]], "lengths in metres"),
    ],
)
def test_points_that_make_no_box_are_refused(points: list[list[float]], message: str):
    with pytest.raises(BadInput, match=message):
        from_four_points(np.array(points, dtype=np.float64))


def test_a_box_beside_another_is_like_it_and_touches_nothing():
    random = np.random.default_rng(5)
    for _ in range(20):
        box = random_box(random)
        other = beside(box, gap=0.02)
        assert_array_equal(other.size, box.size)
        assert_array_equal(other.T_world_box[:3, :3], box.T_world_box[:3, :3])
        there = rigid_transform.transform_points(
            rigid_transform.invert(box.T_world_box), other.T_world_box[None, :3, 3]
        )
        assert_allclose(there[0], [box.size[0] + 0.02, 0, 0], atol=1e-12)
        assert iou(box, other) == 0


def test_a_box_rests_on_its_lowest_corner_and_keeps_its_orientation():
    random = np.random.default_rng(6)
    for _ in range(20):
        box = random_box(random, spread=3.0)
        resting = resting_on_ground(box)
        assert resting.corners_world[:, 2].min() == pytest.approx(0, abs=1e-12)
        assert_array_equal(resting.T_world_box[:3, :3], box.T_world_box[:3, :3])
        assert_array_equal(resting.T_world_box[:2, 3], box.T_world_box[:2, 3])
        assert_allclose(resting_on_ground(resting).T_world_box, resting.T_world_box, atol=1e-12)
