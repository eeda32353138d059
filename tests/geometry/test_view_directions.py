"""Directions of views: in the box's frame, and one for all that the object looks the same from."""

import numpy as np
import pytest

from ars_web.geometry.box import Box
from ars_web.geometry.rigid_transform import rotation_from_wxyz
from ars_web.geometry.sphere_bins import SphereBins
from ars_web.geometry.symmetry import Symmetry, rotations_of, turn_about
from ars_web.geometry.view_directions import evenly_over_sphere, folded, reachable, view_directions

CUBE = Symmetry("discrete", (((0.0, 0.0, 1.0), 4), ((1.0, 0.0, 0.0), 4)))
QUARTER = Symmetry("discrete", (((0.0, 0.0, 1.0), 4),))
BRICK = Symmetry("discrete", (((0.0, 0.0, 1.0), 2), ((1.0, 0.0, 0.0), 2)))
FLIPPED = Symmetry("discrete", (((0.0, 1.0, 0.0), 2),))
BOTTLE = Symmetry("continuous", axis=(0.0, 0.0, 1.0))
TIN = Symmetry("continuous", axis=(0.0, 0.0, 1.0), flip=True)
LYING = Symmetry("continuous", axis=(0.6, 0.8, 0.0), flip=True)

ALL = (CUBE, QUARTER, BRICK, FLIPPED, BOTTLE, TIN, LYING)


def box_at(centre: tuple[float, float, float], wxyz: tuple[float, float, float, float] = (1, 0, 0, 0)) -> Box:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation_from_wxyz(np.array(wxyz, dtype=float)), centre
    return Box(T, np.array([0.1, 0.2, 0.3]))


def turns(symmetry: Symmetry) -> list[np.ndarray]:
    """Rotations of the symmetry; some of those of a continuous one."""
    if symmetry.axis is None:
        return list(rotations_of(symmetry))
    about = [turn_about(np.array(symmetry.axis), angle) for angle in np.linspace(0, 2 * np.pi, 7)]
    return [R @ S for R in about for S in rotations_of(symmetry)]


def test_directions_are_of_the_box_s_frame() -> None:
    # A quarter turn about z: the box's x axis points along the world's y.
    box = box_at((1.0, 2.0, 3.0), (np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)))
    centres = np.array([[1.0, 7.0, 3.0], [3.0, 2.0, 3.0], [1.0, 2.0, 3.5], [1.0, 2.0, 3.0]])
    found = view_directions(centres, box)
    assert np.allclose(found[:3], [[1, 0, 0], [0, -1, 0], [0, 0, 1]])
    assert np.isnan(found[3]).all()


@pytest.mark.parametrize("symmetry", ALL)
def test_directions_that_look_alike_fold_to_one(symmetry: Symmetry) -> None:
    directions = evenly_over_sphere(301)
    expected = folded(directions, symmetry)
    assert np.allclose(np.linalg.norm(expected, axis=1), 1.0)
    for R in turns(symmetry):
        assert np.allclose(folded(directions @ R.T, symmetry), expected, atol=1e-6)
    # What it leads to looks like what it came from.
    near = np.min([np.linalg.norm(directions @ R.T - expected, axis=1) for R in turns(symmetry)], axis=0)
    assert near.max() < (1e-9 if symmetry.axis is None else 1.1)


def test_turns_about_z_leave_an_azimuth_between_edges_of_bins() -> None:
    found = folded(evenly_over_sphere(5000), QUARTER)
    azimuths = np.arctan2(found[:, 1], found[:, 0])
    assert azimuths.min() > -1e-9
    assert azimuths.max() < np.pi / 2 + 1e-9
    assert (folded(evenly_over_sphere(5000), BRICK)[:, 2] > -1e-9).all()
    bottle = folded(evenly_over_sphere(500), BOTTLE)
    aside = np.arctan2(bottle[:, 1], bottle[:, 0])[np.abs(bottle[:, 2]) < 0.999]
    assert 0.01 < aside.min() <= aside.max() < np.radians(5.0), "off the edge at 0 degrees, in narrow bins too"
    assert (folded(evenly_over_sphere(5000), TIN)[:, 2] > -1e-9).all()


def test_reachable_bins_are_the_share_that_the_symmetry_leaves() -> None:
    bins = SphereBins()
    for symmetry, order in ((QUARTER, 4), (BRICK, 4), (CUBE, 24)):
        angles, cells = reachable(bins, symmetry)
        assert angles.mean() == pytest.approx(1 / order, abs=0.05)
        assert cells.mean() == pytest.approx(1 / order, abs=0.05)
    assert reachable(bins, BOTTLE)[0].sum() == 18
    assert reachable(bins, TIN)[0].sum() == 9
    assert reachable(bins, Symmetry())[0].all()
