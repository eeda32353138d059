"""Bins and cells as they are drawn: patches that hold their directions, and meshes seen from outside."""

import math

import numpy as np
import pytest

from ars_web.geometry.sphere_bins import SphereBins
from ars_web.geometry.sphere_tiles import (
    Tiles,
    bin_patches,
    cell_patches,
    dots,
    outlines,
    patch_middles,
    stand_ins,
    tiles,
)
from ars_web.geometry.symmetry import Symmetry
from ars_web.geometry.view_directions import evenly_over_sphere, folded

MANY = [SphereBins(18, 9), SphereBins(1, 1), SphereBins(1, 2), SphereBins(7, 5)]


def outward(mesh: Tiles) -> np.ndarray:
    """(f,) twice the area of each face, positive where it is counter-clockwise from outside."""
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    normals = np.cross(b - a, c - a)
    return np.linalg.norm(normals, axis=1) * np.sign((normals * (a + b + c)).sum(axis=1))


@pytest.mark.parametrize("bins", MANY)
def test_a_direction_lies_within_the_patch_of_its_bin_and_of_its_cell(bins: SphereBins) -> None:
    directions = evenly_over_sphere(500)
    phi, theta = np.arctan2(directions[:, 1], directions[:, 0]), np.arccos(directions[:, 2])
    for patches, found in zip((bin_patches(bins), cell_patches(bins)), bins.of(directions), strict=True):
        left, right, top, bottom = patches[found].T
        assert ((left <= phi) & (phi <= right) & (top <= theta) & (theta <= bottom)).all()
    assert bins.of(patch_middles(bin_patches(bins)))[0].tolist() == list(range(bins.cells))


@pytest.mark.parametrize("bins", MANY)
def test_tiles_cover_the_sphere_but_for_the_gaps_between_them(bins: SphereBins) -> None:
    whole = tiles(cell_patches(bins), gap=0.0)
    areas = outward(whole)
    assert (areas > -1e-12).all()
    assert areas.sum() / 2 == pytest.approx(4 * np.pi, rel=0.02)
    assert set(whole.owners.tolist()) == set(range(bins.cells))
    assert len({frozenset(whole.owners[face]) for face in whole.faces}) == bins.cells  # no face is of two
    apart = tiles(cell_patches(bins), gap=np.radians(1.0))
    inside = apart.vertices[np.abs(apart.vertices[:, 2]) < 1.0 - 1e-9]
    owners = apart.owners[np.abs(apart.vertices[:, 2]) < 1.0 - 1e-9]
    assert bins.of(inside)[1].tolist() == owners.tolist() or bins.cells == 1
    assert outward(apart).sum() <= areas.sum()


def test_the_gap_between_tiles_is_as_wide_near_a_pole_as_at_the_equator() -> None:
    bins, gap = SphereBins(18, 9), math.radians(0.5)
    mesh = tiles(cell_patches(bins), gap=gap)
    for band in range(1, len(bins.bands) - 1):
        x, y, _ = mesh.vertices[mesh.owners == bins.cell_starts[band] + bins.bands[band] // 2].T
        apart = 2 * np.pi / bins.bands[band] - np.ptp(np.arctan2(y, x))
        assert apart * np.hypot(x, y).max() == pytest.approx(2 * gap, rel=0.01)


def test_caps_reach_their_pole_and_close_all_round() -> None:
    bins = SphereBins(18, 9)
    mesh = tiles(cell_patches(bins), gap=math.radians(1.0))
    for cell, pole in ((0, 1.0), (bins.cells - 1, -1.0)):
        cap = mesh.vertices[mesh.owners == cell]
        assert np.abs(cap[:, 2]).max() == 1.0
        assert np.sign(cap[0, 2]) == pole
        rim = cap[np.isclose(np.abs(cap[:, 2]), np.abs(cap[:, 2]).min())]
        assert np.allclose(rim[0], rim[-1]), "its first and its last meridian are one"


def test_dots_are_round_spots_seen_from_outside() -> None:
    directions = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.6, 0.8, 0.0]])
    found = dots(directions, radius=0.1)
    assert (outward(found) > 0).all()
    away = np.arccos(np.clip((found.vertices * directions[found.owners]).sum(axis=1), -1.0, 1.0))
    assert np.allclose(away.reshape(3, -1), [0.0] + 8 * [0.1])
    assert len(dots(np.zeros((0, 3)), radius=0.1).faces) == 0


def test_outlines_run_along_the_sides_and_not_through_a_pole() -> None:
    bins = SphereBins(18, 9)
    cap = outlines([cell_patches(bins)[0]])
    assert np.allclose(cap[..., 2], bins.band_edges[1])
    assert np.allclose(cap[0, 0], cap[-1, 1])
    sides = outlines([bin_patches(bins)[4]])  # azimuth from -180 to -160 degrees, about the equator
    phi, theta = np.arctan2(sides[..., 1], sides[..., 0]), np.arccos(sides[..., 2])
    assert np.degrees([theta.min(), theta.max()]) == pytest.approx([80.0, 100.0])
    assert set(np.degrees(phi).round().ravel().tolist()) <= {-180.0, 180.0, *range(-180, -159)}
    assert len(outlines([])) == 0


def test_what_several_patches_outline_together_has_no_lines_within() -> None:
    bins = SphereBins(18, 9)
    ring = bin_patches(bins)[2::9]
    assert len(ring) == 18
    heights = np.degrees(np.arccos(outlines(ring)[..., 2]))
    assert np.allclose(heights[:, 0], heights[:, 1])
    assert set(heights.round().ravel().tolist()) == {40.0, 60.0}
    pair = outlines(bin_patches(bins)[[4, 13]])
    assert len(pair) == 2 * len(outlines(bin_patches(bins)[[4]])) - 2 * len(shared_side(pair, bins))


def shared_side(outline: np.ndarray, bins: SphereBins) -> np.ndarray:
    """The segments of the side between the first two bins of the equator; none of them may be in an outline of both."""
    left = outlines(bin_patches(bins)[[4]])
    side = left[np.isclose(np.degrees(np.arctan2(left[..., 1], left[..., 0])), -160.0).all(axis=1)]
    assert len(side) > 0
    assert not any(np.allclose(segment, one) for segment in outline for one in side)
    return side


def test_a_bin_that_is_folded_shows_the_one_that_it_is_folded_to() -> None:
    bins = SphereBins(18, 9)
    for found in stand_ins(bins):
        assert found.tolist() == list(range(bins.cells))
    half_turn = Symmetry("discrete", rotations=(((0.0, 0.0, 1.0), 2),))
    angles, cells = stand_ins(bins, half_turn)
    middles = patch_middles(bin_patches(bins))
    assert angles.tolist() == bins.of(folded(middles, half_turn))[0].tolist()
    opposite = bins.of(middles * [-1.0, -1.0, 1.0])[0]
    assert angles.tolist() == angles[opposite].tolist()
    assert len(set(cells.tolist())) < bins.cells
