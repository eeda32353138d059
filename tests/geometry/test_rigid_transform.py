"""The group's axioms, quaternions both ways, and what is refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from ars_web.errors import BadInput
from ars_web.geometry import rigid_transform as rt

lengths = st.floats(-100, 100, allow_subnormal=False)
positions = st.tuples(lengths, lengths, lengths).map(np.array)
quaternions = st.tuples(*[st.floats(-1, 1)] * 4).map(np.array).filter(lambda q: np.linalg.norm(q) > 1e-3)
transforms = st.builds(rt.from_position_wxyz, positions, quaternions)


@given(transforms, transforms, transforms)
def test_composition_is_associative(a, b, c):
    assert_allclose((a @ b) @ c, a @ (b @ c), atol=1e-10)


@given(transforms)
def test_the_inverse_undoes(T):
    assert_allclose(rt.invert(T) @ T, np.eye(4), atol=1e-10)
    assert_allclose(T @ rt.invert(T), np.eye(4), atol=1e-10)
    assert_allclose(rt.invert(rt.invert(T)), T, atol=1e-10)


@given(transforms, transforms)
def test_the_inverse_of_a_product_is_the_product_of_inverses_turned_round(a, b):
    assert_allclose(rt.invert(a @ b), rt.invert(b) @ rt.invert(a), atol=1e-9)


@given(transforms, transforms, st.lists(positions, min_size=1, max_size=5))
def test_points_go_through_one_transform_after_the_other(a, b, points):
    points = np.array(points)
    assert_allclose(
        rt.transform_points(a @ b, points), rt.transform_points(a, rt.transform_points(b, points)), atol=1e-9
    )
    moved = rt.transform_points(a, points)
    assert_allclose(np.linalg.norm(moved - moved[0], axis=1), np.linalg.norm(points - points[0], axis=1), atol=1e-9)


@given(transforms)
def test_a_product_of_transforms_is_one(T):
    assert_array_equal(T[3], [0, 0, 0, 1])
    assert_allclose(T[:3, :3].T @ T[:3, :3], np.eye(3), atol=1e-12)
    assert np.linalg.det(T[:3, :3]) == pytest.approx(1)


@given(quaternions)
def test_quaternions_survive_the_way_there_and_back(q):
    found = rt.wxyz_from_rotation(rt.rotation_from_wxyz(q))
    unit = q / np.linalg.norm(q)
    assert found[0] >= 0
    assert np.linalg.norm(found) == pytest.approx(1)
    assert_allclose(found * np.sign(found @ unit), unit, atol=1e-9)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("angle", [np.pi, np.pi - 1e-9, 1e-9, 0.0, -np.pi / 2])
def test_half_turns_and_tiny_turns_have_exact_quaternions(axis: int, angle: float):
    q = np.zeros(4)
    q[0], q[1 + axis] = np.cos(angle / 2), np.sin(angle / 2)
    assert_allclose(np.abs(rt.wxyz_from_rotation(rt.rotation_from_wxyz(q)) @ q), 1, atol=1e-15)


def test_quaternions_are_w_first():
    turn = rt.rotation_from_wxyz(np.array([np.cos(0.3), 0, 0, np.sin(0.3)]))
    assert_allclose(turn, rt.rotation_about_z(0.6), atol=1e-15)


def test_batches_are_as_if_one_by_one():
    random = np.random.default_rng(0)
    q, p = random.normal(size=(5, 3, 4)), random.normal(size=(5, 3, 3))
    T = rt.from_position_wxyz(p, q)
    assert T.shape == (5, 3, 4, 4)
    points = random.normal(size=(7, 3))
    for i in range(5):
        for j in range(3):
            assert_array_equal(T[i, j], rt.from_position_wxyz(p[i, j], q[i, j]))
            assert_array_equal(rt.invert(T)[i, j], rt.invert(T[i, j]))
            assert_allclose(rt.transform_points(T, points)[i, j], rt.transform_points(T[i, j], points), atol=1e-15)


@given(transforms, st.floats(0, 1e-3))
def test_the_nearest_rotation_is_one_and_near(T, noise):
    off = T[:3, :3] + noise * np.array([[1, -2, 1], [0.5, 1, -1], [2, 0, 1.0]])
    found = rt.nearest_rotation(off)
    assert_allclose(found.T @ found, np.eye(3), atol=1e-12)
    assert np.linalg.det(found) == pytest.approx(1)
    assert_allclose(found, T[:3, :3], atol=5 * noise + 1e-12)


def test_the_nearest_rotation_to_a_reflection_is_no_reflection():
    assert np.linalg.det(rt.nearest_rotation(np.diag([1.0, 1.0, -1.0]))) == pytest.approx(1)


@given(transforms)
def test_checking_leaves_an_exact_transform_bit_by_bit(T):
    once = rt.checked(T)
    assert_array_equal(rt.checked(once), once)


def test_a_rotation_of_six_digits_is_made_exact():
    T = rt.from_rotation(np.round(rt.rotation_about_z(0.7), 6), np.array([1.0, 2.0, 3.0]))
    found = rt.checked(T)
    assert_allclose(found, T, atol=1e-6)
    assert_allclose(found[:3, :3].T @ found[:3, :3], np.eye(3), atol=1e-15)


def entry(row: int, column: int, value: float) -> np.ndarray:
    T = np.eye(4)
    T[row, column] = value
    return T


@pytest.mark.parametrize(
    ("T", "message"),
    [
        (entry(0, 3, np.nan), "not finite"),
        (entry(1, 1, np.inf), "not finite"),
        (entry(3, 0, 0.1), "last row must be 0 0 0 1"),
        (entry(3, 3, 2.0), "last row must be 0 0 0 1"),
        (np.diag([2.0, 2.0, 2.0, 1.0]), "is there a scale in it"),
        (entry(0, 1, 0.2), "not a rotation"),
        (np.diag([1.0, 1.0, -1.0, 1.0]), "reflection"),
        (np.diag([0.0, 0.0, 0.0, 1.0]), "not a rotation"),
    ],
)
def test_what_is_no_rigid_transform_is_refused(T: np.ndarray, message: str):
    with pytest.raises(BadInput, match=message):
        rt.checked(T)


@pytest.mark.parametrize("q", [[0.0, 0, 0, 0], [1e-12, 0, 0, 0], [np.nan, 0, 0, 1], [np.inf, 0, 0, 1]])
def test_quaternions_without_a_direction_are_refused(q: list[float]):
    with pytest.raises(BadInput, match="w x y z"):
        rt.rotation_from_wxyz(np.array(q))


def test_positions_that_are_not_finite_are_refused():
    with pytest.raises(BadInput, match="position is not finite"):
        rt.from_position_wxyz(np.array([0.0, np.nan, 0.0]), np.array([1.0, 0, 0, 0]))
