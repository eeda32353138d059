"""Symmetries from the turns that files list."""

import numpy as np
import pytest

from ars_web.errors import BadInput
from ars_web.geometry.symmetry import NO_SYMMETRY, Symmetry, rotations_of, turn_about
from ars_web.geometry.symmetry_of_turns import symmetry_of_turns

Z, X = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)
TILTED = (0.48, 0.6, 0.64)


@pytest.mark.parametrize(
    "symmetry",
    [
        NO_SYMMETRY,
        Symmetry("discrete", ((Z, 2),)),
        Symmetry("discrete", ((Z, 5),)),
        Symmetry("discrete", ((TILTED, 6),)),
        Symmetry("discrete", ((Z, 4), (X, 2))),
        Symmetry("discrete", ((Z, 2), (X, 2))),
        Symmetry("discrete", ((Z, 36), (X, 2))),
        Symmetry("discrete", ((Z, 4), (X, 4))),
    ],
)
def test_all_turns_of_a_group_give_it_back(symmetry: Symmetry) -> None:
    turns = rotations_of(symmetry)
    found = rotations_of(symmetry_of_turns(turns))
    assert len(found) == len(turns)
    for R in found:
        assert np.abs(turns - R).max(axis=(1, 2)).min() < 1e-6


def test_a_turn_by_two_fifths_is_of_order_five() -> None:
    assert symmetry_of_turns(turn_about(np.array(Z), 0.8 * np.pi)[None]) == Symmetry("discrete", ((Z, 5),))


def test_a_half_turn_may_be_a_degree_off() -> None:
    found = symmetry_of_turns(turn_about(np.array(TILTED), np.radians(178.6))[None])
    assert found.rotations[0][1] == 2
    np.testing.assert_allclose(found.rotations[0][0], TILTED, atol=1e-6)


@pytest.mark.parametrize("flip", [False, True])
def test_any_turn_about_an_axis_with_ends_alike_or_not(flip: bool) -> None:
    turns = np.array([np.eye(3), turn_about(np.array(X), np.pi)] if flip else [np.eye(3)])
    assert symmetry_of_turns(turns, axis=np.array(Z)) == Symmetry("continuous", axis=Z, flip=flip)


def test_a_turn_that_is_no_part_of_a_circle_is_refused() -> None:
    with pytest.raises(BadInput, match=r"a turn by 100\.30 degrees is no whole part of a circle"):
        symmetry_of_turns(turn_about(np.array(Z), np.radians(100.3))[None])
