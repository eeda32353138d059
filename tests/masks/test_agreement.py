"""Outlines held against each other: the wrong ones are found out, on the ball of the painted recording."""

from dataclasses import dataclass

import cv2
import numpy as np
import pytest
import shapely

from ars_web.geometry.polygon import Polygon
from ars_web.geometry.visual_hull import visual_hull
from ars_web.masks.agreement import CUTS_NOTHING, Bench
from ars_web.masks.close_up import CloseUp, close_up

DRAWN = (0, 4)
OTHERS = (1, 2, 3, 6, 8, 9, 10, 11)
SPACING = 0.003


@dataclass(frozen=True)
class Case:
    """A bench, and the true outline in each of its close-ups."""

    bench: Bench
    truths: dict[int, np.ndarray]


@pytest.fixture(scope="module")
def case(painted) -> Case:
    hull = visual_hull([painted.view(frame) for frame in DRAWN])
    low, high = hull.vertices.min(axis=0), hull.vertices.max(axis=0)
    axes = [np.arange(a, b, SPACING) for a, b in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)

    def shot(frame: int) -> CloseUp:
        return close_up(
            painted.read(frame),
            frame=frame,
            camera=painted.taken.cameras[0],
            T_world_camera=painted.taken.frames.Ts_world_camera[frame],
            region=shapely.Polygon(painted.ring.outline(frame)).buffer(20),
            points=points,
        )

    def truth(one: CloseUp) -> np.ndarray:
        return one.raster([Polygon(painted.ring.outline(one.frame))])

    drawn = {frame: shot(frame) for frame in DRAWN}
    inside = np.all([one.within(truth(one)) for one in drawn.values()], axis=0)
    points = points[inside]
    shots = {frame: shot(frame) for frame in OTHERS}
    known = {frame: (one, truth(one)) for frame, one in ((frame, shot(frame)) for frame in DRAWN)}
    bench = Bench(shots, points, SPACING, known)
    return Case(bench, {frame: truth(one) for frame, one in shots.items()})


def all_trusted(found: dict[int, np.ndarray]) -> dict[int, float]:
    return dict.fromkeys(found, 1.0)


def without_left(mask: np.ndarray, share: float) -> np.ndarray:
    """A mask without so much of its width."""
    columns = np.flatnonzero(mask.any(axis=0))
    half = mask.copy()
    half[:, : columns[0] + round(share * len(columns))] = False
    return half


def test_true_outlines_all_agree(case):
    agreement = case.bench.agreement(case.truths, trust=all_trusted(case.truths))
    assert set(agreement.accepted) == set(OTHERS)
    assert not agreement.cuts
    volume = agreement.kept.sum() * SPACING**3
    assert volume == pytest.approx(4 / 3 * np.pi * 0.04**3, rel=0.2)


@pytest.mark.parametrize("frame", OTHERS)
@pytest.mark.parametrize("share", [0.25, 0.5])
def test_one_that_lacks_a_part_is_found_out(case, frame, share):
    found = {**case.truths, frame: without_left(case.truths[frame], share)}
    agreement = case.bench.agreement(found, trust=all_trusted(found))
    assert set(agreement.accepted) == set(OTHERS) - {frame}
    lost, other = agreement.cuts[frame]
    assert lost > CUTS_NOTHING
    assert other in (*DRAWN, *OTHERS)


def test_one_that_is_too_large_does_not_refuse_those_that_are_right(case):
    grown = cv2.dilate(case.truths[3].astype(np.uint8), np.ones((31, 31), np.uint8)) > 0
    found = {**case.truths, 3: grown}
    agreement = case.bench.agreement(found, trust=all_trusted(found))
    assert set(agreement.accepted) == set(OTHERS) - {3}
    assert case.bench.seen_by_others(agreement, 3, grown) < 0.8


def test_of_two_sets_that_contradict_each_other_the_trusted_one_is_kept(case):
    """Three of eight lack the same half of the object, and are trusted less."""
    wrong = (1, 2, 3)
    found = {**case.truths, **{frame: without_left(case.truths[frame], 0.5) for frame in wrong}}
    agreement = case.bench.agreement(found, trust={frame: 0.3 if frame in wrong else 1.0 for frame in found})
    assert set(agreement.accepted) == set(OTHERS) - set(wrong)


def test_an_outline_that_leaves_nothing_is_not_accepted(case):
    nothing = np.zeros_like(case.truths[6])
    nothing[:2, :2] = True
    found = {**case.truths, 6: nothing}
    assert 6 not in case.bench.agreement(found, trust=all_trusted(found)).accepted


def test_no_outlines_leave_all_points(case):
    agreement = case.bench.agreement({}, trust={})
    assert agreement.accepted == ()
    assert agreement.kept.all()
    assert case.bench.left_by_others(agreement, 1).all()
