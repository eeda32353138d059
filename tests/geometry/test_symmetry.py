"""Symmetries: their rotations are a group, and poses that are alike have one canonical rotation."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from ars_web.errors import BadInput
from ars_web.geometry.rigid_transform import rotation_from_wxyz
from ars_web.geometry.symmetry import NO_SYMMETRY, Axis, Symmetry, canonical_rotation, rotations_of, turn_about

X: Axis = (1.0, 0.0, 0.0)
Y: Axis = (0.0, 1.0, 0.0)
Z: Axis = (0.0, 0.0, 1.0)
GOLDEN = (1 + 5**0.5) / 2

GROUPS: dict[str, tuple[tuple[tuple[Axis, int], ...], int]] = {
    "half turn": (((Z, 2),), 2),
    "third of a tilted axis": ((((1.0, -2.0, 0.5), 3),), 3),
    "36 teeth": (((Z, 36), (X, 2)), 72),
    "brick": (((X, 2), (Y, 2)), 4),
    "square plate": (((Z, 4), (X, 2)), 8),
    "tetrahedron": (((Z, 2), ((1.0, 1.0, 1.0), 3)), 12),
    "cube": (((Z, 4), (X, 4)), 24),
    "icosahedron": ((((0.0, 1.0, GOLDEN), 5), ((1.0, 1.0, 1.0), 3)), 60),
    "icosahedron to six digits": ((((0.0, 0.525731, 0.850651), 5), ((0.57735, 0.57735, 0.57735), 3)), 60),
}

SYMMETRIES = [
    NO_SYMMETRY,
    # Not the one typed in: where its poses tie, its digits tell them apart.
    *(Symmetry("discrete", rotations=rotations) for name, (rotations, _) in GROUPS.items() if "digits" not in name),
    Symmetry("continuous", axis=Z),
    Symmetry("continuous", axis=Z, flip=True),
    Symmetry("continuous", axis=(0.3, -1.0, 0.2), flip=True),
]

quaternions = st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1)


@pytest.mark.parametrize("name", GROUPS)
def test_the_rotations_are_a_group(name: str):
    generators, order = GROUPS[name]
    R = rotations_of(Symmetry("discrete", rotations=generators))
    assert R.shape == (order, 3, 3)
    assert_array_equal(R[0], np.eye(3))
    tolerance = 1e-4 if "digits" in name else 1e-12
    assert_allclose(np.swapaxes(R, 1, 2) @ R, np.broadcast_to(np.eye(3), R.shape), atol=1e-12)
    assert_allclose(np.linalg.det(R), 1.0)
    products = (R[:, None] @ R[None]).reshape(-1, 1, 3, 3)
    which = np.abs(products - R).max(axis=(2, 3))
    # Closed, and each row and column of its table has every element once: so each has its inverse, too.
    assert which.min(axis=1).max() < tolerance
    table = which.argmin(axis=1).reshape(order, order)
    assert_array_equal(np.sort(table, axis=1), np.tile(np.arange(order), (order, 1)))
    assert_array_equal(np.sort(table, axis=0), np.tile(np.arange(order)[:, None], (1, order)))


def test_quarter_turns_are_exact():
    R = rotations_of(Symmetry("discrete", rotations=((Z, 4),)))
    assert_array_equal(R[1], [[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    assert set(np.unique(rotations_of(Symmetry("discrete", rotations=((Z, 4), (X, 4)))))) == {-1.0, 0.0, 1.0}


def test_what_a_continuous_symmetry_has_beside_its_turns():
    assert_array_equal(rotations_of(NO_SYMMETRY), np.eye(3)[None])
    assert_array_equal(rotations_of(Symmetry("continuous", axis=Z)), np.eye(3)[None])
    axis = np.array([0.6, 0.0, 0.8])
    one, flip = rotations_of(Symmetry("continuous", axis=(0.6, 0.0, 0.8), flip=True))
    assert_array_equal(one, np.eye(3))
    assert_allclose(flip @ axis, -axis, atol=1e-12)
    assert_allclose(flip @ flip, np.eye(3), atol=1e-12)


@pytest.mark.parametrize("symmetry", SYMMETRIES, ids=str)
@settings(max_examples=30)
@given(wxyz=quaternions, turn=st.floats(-4, 4), pick=st.integers(0, 71))
def test_poses_that_are_alike_have_one_canonical_rotation(
    symmetry: Symmetry, wxyz: tuple[float, ...], turn: float, pick: int
):
    R = rotation_from_wxyz(np.array(wxyz))
    group = rotations_of(symmetry)
    alike = group[pick % len(group)]
    if symmetry.axis is not None:
        alike = alike @ turn_about(np.array(symmetry.axis), turn)
    canonical = canonical_rotation(R, symmetry)
    assert_allclose(canonical_rotation(R @ alike, symmetry), canonical, atol=1e-6)
    assert_allclose(canonical_rotation(canonical, symmetry), canonical, atol=1e-6)
    assert np.linalg.det(canonical) == pytest.approx(1.0)
    # It is one of the equivalents, and none of them turns less.
    between = R.T @ canonical
    if symmetry.axis is None:
        assert np.abs(group - between).max(axis=(1, 2)).min() < 1e-9
    else:
        end = between @ np.array(symmetry.axis)
        assert min(np.abs(end - sign * np.array(symmetry.axis)).max() for sign in (1, -1)[: len(group)]) < 1e-6
    assert np.trace(canonical) >= np.trace(R @ alike) - 1e-6


@pytest.mark.parametrize("symmetry", SYMMETRIES, ids=str)
def test_many_rotations_at_once_are_as_one_by_one(symmetry: Symmetry):
    Rs = rotation_from_wxyz(np.random.default_rng(0).normal(size=(3, 5, 4)))
    each = [[canonical_rotation(R, symmetry) for R in row] for row in Rs]
    assert_allclose(canonical_rotation(Rs, symmetry), each, atol=1e-12)


def test_a_tie_is_settled_the_same_way_for_all_that_are_alike():
    # Turned by an eighth, a square plate is as near one way as the other.
    square = Symmetry("discrete", rotations=((Z, 4),))
    R = turn_about(np.array(Z), np.pi / 4)
    results = [canonical_rotation(R @ alike, square) for alike in rotations_of(square)]
    assert_allclose(results, np.broadcast_to(results[0], (4, 3, 3)), atol=1e-12)
    # A bottle on its head: every half turn across its axis is as near.
    bottle = Symmetry("continuous", axis=Z)
    results = [canonical_rotation(turn_about(np.array(axis), np.pi), bottle) for axis in (X, Y)]
    assert_allclose(results[0], results[1], atol=1e-12)
    # A rod that lies across: neither of its ends is nearer.
    rod = Symmetry("continuous", axis=Z, flip=True)
    results = [canonical_rotation(turn_about(np.array(X), angle), rod) for angle in (np.pi / 2, -np.pi / 2)]
    assert_allclose(results[0], results[1], atol=1e-12)


def test_an_axis_is_kept_with_unit_length_and_then_stays_as_it_is():
    first = Symmetry("continuous", axis=(1.0, 2.0, -0.0))
    assert first.axis == pytest.approx((5**-0.5, 2 * 5**-0.5, 0.0))
    assert first.axis is not None
    assert str(first.axis[2]) == "0.0"
    assert Symmetry("continuous", axis=first.axis) == first
    second = Symmetry("discrete", rotations=(((2.0, 0.0, 0.0), 2),))
    assert second == Symmetry("discrete", rotations=((X, 2),))


@pytest.mark.parametrize(
    ("symmetry", "message"),
    [
        ({"kind": "some"}, "one of none, discrete, continuous, not 'some'"),
        ({"kind": "discrete"}, "at least one rotation"),
        ({"kind": "discrete", "rotations": (), "axis": Z}, "at least one rotation"),
        ({"kind": "discrete", "rotations": ((Z, 2),), "axis": Z}, "has no single axis"),
        ({"kind": "discrete", "rotations": ((Z, 2),), "flip": True}, "only a continuous symmetry"),
        ({"kind": "none", "rotations": ((Z, 2),)}, "has no rotations of an order"),
        ({"kind": "none", "axis": Z}, "has no single axis"),
        ({"kind": "continuous"}, "needs the axis"),
        ({"kind": "continuous", "axis": (0.0, 0.0, 0.0)}, "must have a direction"),
        ({"kind": "continuous", "axis": (0.0, np.nan, 1.0)}, "three finite numbers"),
        ({"kind": "continuous", "axis": (0.0, 1.0)}, "three finite numbers"),
        ({"kind": "discrete", "rotations": ((Z, 1),)}, "whole number from 2 to 72, not 1"),
        ({"kind": "discrete", "rotations": ((Z, 2.0),)}, "whole number from 2 to 72, not 2.0"),
        ({"kind": "discrete", "rotations": ((Z, 73),)}, "not 73"),
        ({"kind": "discrete", "rotations": ((Z, 5), (X, 4))}, "more than 72: no object has them all"),
        ({"kind": "discrete", "rotations": ((Z, 2), ((1.0, 0.0, 0.3), 2))}, "more than 72"),
    ],
)
def test_what_is_no_symmetry_is_refused(symmetry: dict[str, object], message: str):
    with pytest.raises(BadInput, match=message):
        Symmetry(**symmetry)  # pyright: ignore[reportArgumentType]
