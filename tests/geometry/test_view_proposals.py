"""Proposed views: each shows what it is credited with, and together they fill what can be filled."""

import math

import numpy as np
import pytest

from ars_web.geometry import view_proposals
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.labels import labels_of_boxes
from ars_web.geometry.occlusion import visible_fractions
from ars_web.geometry.sphere_bins import SphereBins
from ars_web.geometry.symmetry import NO_SYMMETRY, Symmetry
from ars_web.geometry.view_directions import reachable, view_directions
from ars_web.geometry.view_limits import ViewLimits
from ars_web.geometry.view_proposals import Look, Proposals, Shown, WantedObject, propose_views

CAMERA = Camera(160, 120, 150.0, 150.0, 82.0, 57.0, "brown", (-0.2, 0.05, 0.001, -0.001, 0.0))
BINS = SphereBins(12, 6)
ANYWHERE = ViewLimits((0.3, 0.8), (-2.0, 2.0), (-math.pi / 2, math.pi / 2))
QUARTER = Symmetry("discrete", (((0.0, 0.0, 1.0), 4),))
TIN = Symmetry("continuous", axis=(0.0, 0.0, 1.0), flip=True)


def cuboid(x: float = 0.0, y: float = 0.0, z: float = 0.0, *, size: tuple[float, ...] = (0.1, 0.1, 0.1)) -> Box:
    T = np.eye(4)
    T[:3, 3] = x, y, z
    return Box(T, np.array(size))


def look_at(boxes: list[Box]) -> Look:
    def look(Ts: np.ndarray) -> Shown:
        labels = labels_of_boxes(CAMERA, Ts, boxes)
        visible = visible_fractions(CAMERA, Ts, boxes, labels.bbox)
        return Shown(labels.bbox_amodal, ~np.isnan(labels.bbox[..., 0]), visible)

    return look


def wanted(boxes: list[Box], place: int = 0, *, symmetry: Symmetry = NO_SYMMETRY, **changes: object) -> WantedObject:
    _, cells = reachable(BINS, symmetry)
    given = {"counts": np.zeros(BINS.cells, dtype=int), "wanted": cells, "distances": (0.5, 0.8, 0.3), **changes}
    return WantedObject(place=place, box=boxes[place], symmetry=symmetry, **given)  # pyright: ignore[reportArgumentType]


def proposed(
    boxes: list[Box], objects: list[WantedObject], limits: ViewLimits = ANYWHERE, count: int | None = None
) -> Proposals:
    return propose_views(objects, BINS, limits, camera=CAMERA, obstacles=boxes, look=look_at(boxes), count=count)


def credited(found: Proposals) -> list[tuple[int, int]]:
    return [pair for view in found.views for pair in view.fills]


def test_each_view_shows_what_it_is_credited_with() -> None:
    boxes = [cuboid(), cuboid(0.25), cuboid(0.1, 0.3, size=(0.05, 0.2, 0.1))]
    symmetries = [NO_SYMMETRY, QUARTER, NO_SYMMETRY]
    objects = [wanted(boxes, place, symmetry=symmetries[place]) for place in (0, 1)]
    found = proposed(boxes, objects)
    pairs = credited(found)
    assert len(set(pairs)) == len(pairs) > 72
    left = {(place, cell) for place, cell, _ in found.left}
    assert left.isdisjoint(pairs)
    assert left | set(pairs) == {(row, cell) for row in (0, 1) for cell in np.flatnonzero(objects[row].wanted)}
    # Looked at one by one, with no more than the labels and the directions.
    for view in found.views:
        T, centre = view.T_world_camera, view.T_world_camera[None, :3, 3]
        labels = labels_of_boxes(CAMERA, T[None], boxes)
        visible = visible_fractions(CAMERA, T[None], boxes, labels.bbox)[0]
        assert set(view.labelled) == set(np.flatnonzero(~np.isnan(labels.bbox[0, :, 0])).tolist())
        for place, cell in view.fills:
            assert labels.truncated[0, place] == 0.0
            assert visible[place] >= 0.5
            x0, y0, x1, y1 = labels.bbox[0, place]
            assert min(x0, y0, 160 - x1, 120 - y1) >= 0.02 * 120 - 0.1
            assert max(x1 - x0, y1 - y0) >= 0.05 * 120
            direction = view_directions(centre, boxes[place], symmetry=symmetries[place])
            assert BINS.of(direction)[1][0] == cell
        for box in boxes:
            aside = np.maximum(np.abs(centre[0] - box.T_world_box[:3, 3]) - box.size / 2, 0.0)
            assert np.linalg.norm(aside) >= ANYWHERE.clearance


def test_a_lone_box_can_be_seen_from_everywhere() -> None:
    boxes = [cuboid(1.0, 2.0, 0.3)]
    found = proposed(boxes, [wanted(boxes)])
    assert found.left == ()
    assert len(found.views) == BINS.cells
    assert all(view.distance == pytest.approx(0.5) for view in found.views)


def test_views_keep_to_height_and_tilt() -> None:
    boxes = [cuboid()]
    limits = ViewLimits((0.3, 0.8), (0.1, 0.35), (0.2, 0.7))
    found = proposed(boxes, [wanted(boxes)], limits)
    for view in found.views:
        assert 0.1 <= view.height == view.T_world_camera[2, 3] <= 0.35
        assert 0.2 <= view.tilt <= 0.7
        assert math.sin(view.tilt) * view.distance == pytest.approx(view.height)
    reasons = {cell: reason for _, cell, reason in found.left}
    assert reasons[71] == "height"
    # Near enough it is within the height, and looked down at too steeply.
    middles = np.arcsin(BINS.cell_directions[:, 2])
    assert {reasons[cell] for cell in np.flatnonzero((middles > 0.8) & (0.3 * np.sin(middles) < 0.34))} == {"tilt"}


def test_what_stands_in_the_way_is_told() -> None:
    # A wall beside the box, which is seen from its other side alone.
    boxes = [cuboid(), cuboid(0.1, size=(0.02, 1.0, 1.0))]
    found = proposed(boxes, [wanted(boxes)])
    reasons = {cell: reason for _, cell, reason in found.left}
    behind = np.flatnonzero(BINS.cell_directions[:, 0] > 0.75)
    assert len(behind) > 5
    assert {reasons[cell] for cell in behind.tolist()} == {"hidden"}
    before = np.flatnonzero(BINS.cell_directions[:, 0] < -0.3)
    assert set(before.tolist()).isdisjoint(reasons)


def test_a_box_in_every_place_for_the_camera_is_near() -> None:
    boxes = [cuboid(), cuboid(z=0.5, size=(0.4, 0.4, 0.1))]
    found = proposed(boxes, [wanted(boxes, distances=(0.5,))])
    assert (0, 0, "near") in found.left


@pytest.mark.parametrize(("distance", "reason"), [(0.15, "large"), (9.0, "small")])
def test_a_distance_that_does_not_fit_the_image_is_told(distance: float, reason: str) -> None:
    boxes = [cuboid()]
    limits = ViewLimits((0.1, 9.0), (-9.0, 9.0), (-math.pi / 2, math.pi / 2))
    found = proposed(boxes, [wanted(boxes, distances=(distance,))], limits)
    assert found.views == ()
    assert {why for _, _, why in found.left} == {reason}


def test_the_first_views_are_the_most_useful_and_stay_the_same() -> None:
    boxes = [cuboid(), cuboid(0.22), cuboid(0.0, 0.22)]
    objects = [wanted(boxes, place) for place in range(3)]
    everything = proposed(boxes, objects)
    fills = [len(view.fills) for view in everything.views]
    assert fills == sorted(fills, reverse=True)
    assert fills[0] == 3
    few = proposed(boxes, objects, count=4)
    assert [view.fills for view in few.views] == [view.fills for view in everything.views[:4]]
    assert {why for _, _, why in few.left} >= {"later"}
    assert len(few.left) == sum(int(one.wanted.sum()) for one in objects) - len(credited(few))


def test_the_middle_of_a_hole_is_filled_first() -> None:
    boxes = [cuboid()]
    aside = BINS.cell_directions @ np.array([1.0, 0.0, 0.0])
    empty = aside > 0.3
    one = wanted(boxes, counts=np.where(empty, 0, 4), wanted=empty)
    (view,) = proposed(boxes, [one], count=1).views
    ((_, cell),) = view.fills
    assert aside[cell] > 0.9


def test_a_tin_has_few_cells_which_any_side_fills() -> None:
    boxes = [cuboid(), cuboid(0.2, size=(0.02, 1.0, 1.0))]
    found = proposed(boxes, [wanted(boxes, symmetry=TIN)])
    assert found.left == ()
    assert len(found.views) < 10
    assert all(view.T_world_camera[0, 3] < 0.2 for view in found.views)


def test_nothing_wanted_is_nothing_proposed() -> None:
    boxes = [cuboid()]
    full = wanted(boxes, counts=np.ones(BINS.cells, dtype=int), wanted=np.zeros(BINS.cells, dtype=bool))
    found = proposed(boxes, [full])
    assert (found.views, found.left) == ((), ())


def test_however_many_poses_are_looked_at_together_the_views_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    boxes = [cuboid(), cuboid(0.22), cuboid(0.1, 0.3, size=(0.05, 0.2, 0.1))]
    objects = [wanted(boxes, 0), wanted(boxes, 1, symmetry=QUARTER)]
    expected = proposed(boxes, objects)
    monkeypatch.setattr(view_proposals, "LOOKED_AT_ONCE", 20)
    found = proposed(boxes, objects)
    assert [view.fills for view in found.views] == [view.fills for view in expected.views]
    assert [view.labelled for view in found.views] == [view.labelled for view in expected.views]
    assert found.left == expected.left


def test_of_poses_that_add_as_much_the_same_one_is_chosen_whatever_is_rounded(monkeypatch: pytest.MonkeyPatch) -> None:
    boxes, exact = [cuboid()], view_proposals._gaps
    expected = credited(proposed(boxes, [wanted(boxes)]))
    random = np.random.default_rng(0)

    def rounded(bins: SphereBins, seen: np.ndarray) -> np.ndarray:
        return exact(bins, seen) + random.normal(0.0, 1e-15, bins.cells)

    monkeypatch.setattr(view_proposals, "_gaps", rounded)
    assert credited(proposed(boxes, [wanted(boxes)])) == expected


def test_each_view_is_as_far_as_can_be_from_those_before_it() -> None:
    boxes = [cuboid()]
    cells = [cell for _, cell in credited(proposed(boxes, [wanted(boxes)], count=3))]
    first, second, third = BINS.cell_directions[cells]
    assert first @ second == pytest.approx(-1.0)
    assert abs(first @ third) < 0.3


def test_an_object_that_no_export_would_label_is_not_seen() -> None:
    boxes = [cuboid()]

    def unlabelled(Ts: np.ndarray) -> Shown:
        shown = look_at(boxes)(Ts)
        return Shown(shown.bbox_amodal, np.zeros_like(shown.labelled), shown.visible)

    found = propose_views([wanted(boxes)], BINS, ANYWHERE, camera=CAMERA, obstacles=boxes, look=unlabelled, count=None)
    assert found.views == ()
    assert {why for _, _, why in found.left} == {"hidden"}


def test_where_the_middle_of_a_cell_will_not_do_another_place_in_it_may() -> None:
    boxes, elevations = [cuboid()], np.unique(np.arcsin(BINS.cell_directions[:, 2]).round(6))
    between = (elevations[-2] + elevations[-3]) / 2
    tilt = between - math.radians(3), between + math.radians(3)
    assert not ((elevations >= tilt[0]) & (elevations <= tilt[1])).any()
    found = proposed(boxes, [wanted(boxes)], ViewLimits((0.3, 0.8), (-2.0, 2.0), tilt))
    assert len(found.views) > 5
    assert all(tilt[0] <= view.tilt <= tilt[1] for view in found.views)


def chosen_in_order(objects: list[WantedObject], cells: list[list[int]]) -> list[int]:
    """The numbers of made-up poses, each of which sees objects from these cells, in the order in which they are
    chosen."""
    m = len(cells)
    Ts = np.tile(np.eye(4), (m, 1, 1))
    Ts[:, 0, 3] = np.arange(m)
    tried = view_proposals._Tried(
        Ts,
        np.zeros(m, dtype=int),
        np.ones((m, len(objects)), dtype=bool),
        np.array(cells),
        np.zeros((len(objects), BINS.cells), dtype=int),
    )
    return [int(view.T_world_camera[0, 3]) for view in view_proposals._chosen(tried, objects, BINS, None)]


def test_of_views_that_fill_as_much_those_go_first_that_see_others_where_they_are_thinly_seen() -> None:
    boxes = [cuboid(x) for x in (0.0, 1.0, 2.0, 3.0)]
    counts = np.ones(BINS.cells, dtype=int)
    counts[5] = 9
    full = wanted(boxes, 3, counts=counts, wanted=np.zeros(BINS.cells, dtype=bool))
    objects = [*(wanted(boxes, place) for place in range(3)), full]
    assert chosen_in_order(objects, [[7, -1, -1, 5], [-1, 7, -1, 6]]) == [1, 0]
    # Once seen from cell 6 it is less worth to see it from there again than from cell 8.
    assert chosen_in_order(objects, [[7, -1, -1, 6], [-1, 7, -1, 6], [-1, -1, 7, 8]]) == [0, 2, 1]
