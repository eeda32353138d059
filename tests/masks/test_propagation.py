"""Outlining the rest: the outlines found are right, hidden ones are found out, and the hull comes nearer the truth."""

import math
from dataclasses import replace

import numpy as np
import pytest

from ars_web.errors import BadFile, BadInput, Cancelled, ViewsDisagree
from ars_web.geometry.mask_regions import iou, mask_from_polygons
from ars_web.geometry.visual_hull import visual_hull
from ars_web.masks.propagation import Propagation, propagate

BALL = 4 / 3 * math.pi * 0.04**3
DRAWN = (0, 4)
"""A third of a turn apart."""


@pytest.fixture(scope="module")
def found(painted) -> Propagation:
    return propagate([painted.view(frame) for frame in DRAWN], painted.taken, read=painted.read)


def test_accepted_outlines_are_the_objects_own(painted, found):
    assert len(found.accepted) >= 4
    for view in found.accepted:
        assert view.frame not in DRAWN
        assert iou(view.polygons, painted.view(view.frame).polygons) > 0.92


def test_the_hull_comes_nearer_the_truth(painted, found):
    two = visual_hull([painted.view(frame) for frame in DRAWN])
    assert abs(found.hull.volume / BALL - 1) < 0.25 * (two.volume / BALL - 1)
    assert np.linalg.norm(found.hull.centre_of_mass - painted.ring.CENTRE) < 0.002


def test_the_hull_is_that_of_the_drawn_and_the_accepted_outlines(painted, found):
    again = visual_hull([*(painted.view(frame) for frame in DRAWN), *found.accepted])
    assert again.volume == pytest.approx(found.hull.volume, rel=1e-9)


def test_an_outline_that_something_hides_is_not_accepted_and_the_reason_said(painted, painted_ring, found):
    accepted = {view.frame for view in found.accepted}
    reasons = {dropped.frame: dropped.reason for dropped in (*found.dropped, *found.doubts)}
    assert not accepted & set(painted_ring.HIDDEN)
    for frame in painted_ring.HIDDEN:
        assert "would cut away" in reasons[frame]


def test_every_frame_looked_at_is_told_of_once(painted, found):
    told = [view.frame for view in found.accepted] + [d.frame for d in (*found.doubts, *found.dropped)]
    assert len(told) == len(set(told)) == len(painted.taken.frames) - len(DRAWN)
    assert [view.frame for view in found.doubtful] == [doubt.frame for doubt in found.doubts]


def test_outlines_lie_on_the_photograph_and_are_simple(painted, found):
    camera = painted.taken.cameras[0]
    for view in found.accepted:
        corners = np.concatenate([ring for polygon in view.polygons for ring in polygon.rings])
        assert (corners >= 0).all()
        assert (corners <= (camera.width, camera.height)).all()
        assert len(corners) < 100


def test_the_same_again_gives_the_same(painted, found):
    again = propagate([painted.view(frame) for frame in DRAWN], painted.taken, read=painted.read)
    assert [view.frame for view in again.accepted] == [view.frame for view in found.accepted]
    for one, other in zip(again.accepted, found.accepted, strict=True):
        for a, b in zip(one.polygons, other.polygons, strict=True):
            np.testing.assert_array_equal(a.outer, b.outer)


def test_no_more_outlines_than_asked_for(painted):
    found = propagate([painted.view(frame) for frame in DRAWN], painted.taken, read=painted.read, frames_most=2)
    assert len(found.accepted) <= 2


def test_progress_is_told_and_can_end_the_work(painted):
    told: list[tuple[int, int]] = []

    def progress(done: int, total: int) -> None:
        told.append((done, total))
        if done == 5:
            raise Cancelled("enough")

    with pytest.raises(Cancelled):
        propagate([painted.view(frame) for frame in DRAWN], painted.taken, read=painted.read, progress=progress)
    assert [done for done, _ in told] == [0, 1, 2, 3, 4, 5]
    assert len({total for _, total in told}) == 1


def test_a_photograph_that_cannot_be_read_is_left_out(painted):
    def read(frame: int) -> np.ndarray:
        if frame == 8:
            raise BadFile("8.jpg", "the image ends before its data does")
        return painted.read(frame)

    found = propagate([painted.view(frame) for frame in DRAWN], painted.taken, read=read)
    assert {dropped.frame: dropped.reason for dropped in found.dropped}[8].startswith("its photograph cannot be read")
    assert found.accepted


def test_a_support_plane_is_kept_to(painted):
    found = propagate(
        [painted.view(frame) for frame in DRAWN], painted.taken, read=painted.read, ground=0.05, frames_most=3
    )
    assert found.hull.vertices[:, 2].min() >= 0.05 - 1e-9
    assert iou(found.accepted[0].polygons, painted.view(found.accepted[0].frame).polygons) > 0.4


def test_a_drawn_outline_that_is_wrong_does_not_fool_it_into_an_empty_hull(painted):
    """Half the ball only is outlined in one of the two: what is found never cuts that half."""
    whole, half = painted.view(0), painted.view(4)
    ring = half.polygons[0].outer
    left = ring[ring[:, 0] <= ring[:, 0].mean()]
    drawn = [whole, replace(half, polygons=(replace(half.polygons[0], outer=left),))]
    found = propagate(drawn, painted.taken, read=painted.read, frames_most=3)
    camera = painted.taken.cameras[0]
    seen = mask_from_polygons(drawn[1].polygons, camera.width, camera.height)
    assert seen.any()
    assert found.hull.volume > 0.3 * BALL


@pytest.mark.parametrize("frames_most", [0, -3])
def test_fewer_than_one_frame_is_refused(painted, frames_most):
    with pytest.raises(BadInput, match="at least 1 frame"):
        propagate([painted.view(frame) for frame in DRAWN], painted.taken, read=painted.read, frames_most=frames_most)


def test_drawn_outlines_that_do_not_meet_are_refused(painted):
    """The upper edge of one image, and the lower edge of another one from as high up."""
    drawn = [painted.view(0), painted.view(4)]
    flat = [
        replace(view, polygons=tuple(replace(p, outer=p.outer * (1, 0.2) + (0, y)) for p in view.polygons))
        for view, y in zip(drawn, (0, 190), strict=True)
    ]
    with pytest.raises(ViewsDisagree):
        propagate(flat, painted.taken, read=painted.read)


def test_outlines_that_leave_hardly_anything_are_refused_with_the_remedy(painted):
    """Two strips a hundredth of a pixel wide meet in a thread that lies across the axes of the world."""
    drawn = [painted.view(0), painted.view(4)]
    thin = [
        replace(view, polygons=tuple(replace(p, outer=(p.outer - middle) * (1, 1e-4) + middle) for p in view.polygons))
        for view, middle in ((view, view.polygons[0].outer.mean(axis=0)) for view in drawn)
    ]
    with pytest.raises(BadInput, match="hardly anything that they both show: widen the masks"):
        propagate(thin, painted.taken, read=painted.read)


def test_no_other_frame_is_told_with_the_remedy(painted):
    frames = painted.taken.frames
    only = replace(
        frames,
        names=tuple(frames.names[i] for i in DRAWN),
        images=tuple(frames.images[i] for i in DRAWN),
        camera_ids=frames.camera_ids[list(DRAWN)],
        Ts_world_camera=frames.Ts_world_camera[list(DRAWN)],
    )
    drawn = [replace(painted.view(frame), frame=i) for i, frame in enumerate(DRAWN)]
    with pytest.raises(BadInput, match="outline it by hand"):
        propagate(drawn, replace(painted.taken, frames=only), read=painted.read)
