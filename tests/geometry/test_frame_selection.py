"""Choosing frames, beside a slow greedy choice that looks at every frame anew, and beside even spacing."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ars_web.geometry.even_spacing import evenly
from ars_web.geometry.frame_selection import (
    NO_TWINS,
    NOTHING,
    FrameViews,
    Nearness,
    apart,
    covered,
    covering,
    greedily,
    spread_order,
    tie_order,
    twins_of,
    worth,
)


def views_of(elements: np.ndarray, *, azimuths: np.ndarray | None = None, distances: np.ndarray | None = None):
    """Frames of one recording that show objects from the level, by default all from +x and a metre away."""
    n, b = elements.shape
    turn = np.zeros((n, b)) if azimuths is None else azimuths
    return FrameViews(
        elements=elements,
        directions=np.stack([np.cos(turn), np.sin(turn), np.zeros((n, b))], axis=-1),
        distances=np.ones((n, b)) if distances is None else distances,
        recording=np.zeros(n, dtype=np.int64),
        index=np.arange(n),
    )


def random_views(seed: int, *, n: int, b: int, cells: int) -> FrameViews:
    """A camera that wanders round: neighbours see alike, and some objects are not seen at all."""
    rng = np.random.default_rng(seed)
    turn = np.cumsum(rng.normal(0.0, 0.15, (n, b)), axis=0)
    cell = np.floor((turn % (2 * np.pi)) / (2 * np.pi) * cells).astype(np.int64)
    seen = rng.random((n, b)) < 0.7
    elements = np.where(seen, np.minimum(cell, cells - 1) + cells * np.arange(b), NOTHING)
    return views_of(elements, azimuths=turn, distances=1.0 + 0.3 * rng.random((n, b)))


def is_twin(views: FrameViews, kept: int, other: int, near: Nearness) -> bool:
    """The definition, an object at a time."""
    if views.recording[kept] != views.recording[other]:
        return False
    if near.frames and abs(int(views.index[kept]) - int(views.index[other])) <= near.frames:
        return True
    labelled = np.flatnonzero(views.elements[other] != NOTHING)
    if near.degrees == 0.0 or len(labelled) == 0:
        return False
    for k in labelled:
        angle = np.arccos(np.clip(views.directions[kept, k] @ views.directions[other, k], -1.0, 1.0))
        far, less = sorted([views.distances[kept, k], views.distances[other, k]], reverse=True)
        if views.elements[kept, k] == NOTHING or angle > np.radians(near.degrees) or less < 0.9 * far:
            return False
    return True


def dense_greedy(views: FrameViews, count: int, near: Nearness) -> list[int]:
    """Every frame is looked at for every choice, with exact fractions."""
    order = tie_order(views.elements).tolist()
    free, chosen, counts = set(order), list[int](), dict[int, int]()
    while free and len(chosen) < count:
        gains = {}
        for row in free:
            seen = [int(e) for e in views.elements[row] if e != NOTHING]
            gains[row] = sum(e not in counts for e in seen), sum(Fraction(1, counts.get(e, 0) + 1) for e in seen)
        best = max(order, key=lambda row: (row in free, gains.get(row, (0, 0))))
        chosen.append(best)
        for element in views.elements[best].tolist():
            counts[element] = counts.get(element, 0) + 1
        free = {row for row in free if row != best and not is_twin(views, best, row, near)}
    return chosen


@settings(max_examples=20, deadline=None)
@given(
    seed=st.integers(0, 10_000), near=st.sampled_from([NO_TWINS, Nearness(20.0, 0), Nearness(0.0, 2), Nearness(9.0, 1)])
)
def test_the_lazy_choice_is_the_dense_one(seed: int, near: Nearness) -> None:
    views = random_views(seed, n=24 + seed % 17, b=1 + seed % 4, cells=12)
    assert greedily(views, 9, near=near).tolist() == dense_greedy(views, 9, near)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10_000), count=st.integers(1, 70), near=st.sampled_from([NO_TWINS, Nearness(15.0, 2)]))
def test_it_is_never_below_even_spacing(seed: int, count: int, near: Nearness) -> None:
    views = random_views(seed, n=60, b=3, cells=18)
    kept = apart(views, near)
    even = kept[evenly(len(kept), count)]
    chosen = covering(views, count, near=near)
    assert len(chosen) <= count
    assert (np.diff(chosen) > 0).all()
    assert covered(views.elements[chosen]) >= covered(views.elements[even])
    assert worth(views.elements, chosen) >= worth(views.elements, even)
    if near is NO_TWINS:
        assert len(chosen) == min(count, 60)


def test_even_spacing_is_returned_where_it_is_better() -> None:
    # Greed takes the frame of four first, and then needs two more for what the other two frames show together.
    sets = [[0, 1, 4], [2, 3, 5], [0, 1, 2, 3]]
    elements = np.full((3, 4), NOTHING)
    for row, seen in enumerate(sets):
        elements[row, : len(seen)] = seen
    views = views_of(elements[[0, 2, 1]])
    # Of three frames two are evenly spaced: the first and the last.
    assert evenly(3, 2).tolist() == [0, 2]
    assert covered(views.elements[greedily(views, 2)]) == 5
    assert covering(views, 2).tolist() == [0, 2]
    assert covered(views.elements[covering(views, 2)]) == 6


def test_a_view_that_is_rare_is_kept() -> None:
    elements = np.zeros((500, 1), dtype=np.int64)
    elements[317] = 1
    assert 317 in covering(views_of(elements), 2)
    assert covered(elements[evenly(500, 2)]) == 1


def test_of_frames_that_add_as_much_the_rarest_go_first_so_that_no_twin_takes_their_place() -> None:
    elements = np.array([[0], [0], [1], [0], [2], [2], [NOTHING], [0]])
    assert tie_order(elements).tolist() == [2, 4, 5, 0, 1, 3, 7, 6]
    assert greedily(views_of(elements), 2, near=Nearness(0.0, 1)).tolist() == [2, 4]


def test_one_direction_that_nobody_saw_is_worth_more_than_many_seen_once() -> None:
    elements = np.full((3, 6), NOTHING)
    elements[0], elements[1], elements[2, 0] = range(6), range(6), 9
    assert greedily(views_of(elements), 2).tolist() == [0, 2]


@pytest.mark.parametrize("apart_by", [2.9, 3.1])
def test_twins_are_found_up_to_the_largest_angle(apart_by: float) -> None:
    """Where the coordinate that frames are sorted by changes most with the angle."""
    azimuths = np.radians(90.0 + np.array([[0.0], [apart_by], [90.0], [180.0]]))
    found = twins_of(views_of(np.zeros((4, 1), dtype=np.int64), azimuths=azimuths), np.array([0]), Nearness(3.0))
    assert found.tolist() == [False, apart_by < 3.0, False, False]


def test_frames_that_add_as_much_lie_far_apart() -> None:
    chosen = covering(views_of(np.zeros((64, 1), dtype=np.int64)), 4)
    assert chosen.tolist() == [0, 16, 32, 48]
    assert sorted(spread_order(11).tolist()) == list(range(11))
    assert spread_order(0).tolist() == []
    assert spread_order(1).tolist() == [0]


def test_frames_without_a_label_come_last() -> None:
    elements = np.full((6, 2), NOTHING)
    elements[3], elements[5, 0] = [0, 1], 0
    views = views_of(elements)
    assert greedily(views, 2).tolist() == [3, 5]
    assert sorted(greedily(views, 9).tolist()) == list(range(6))
    assert covered(elements) == 2


@pytest.mark.parametrize("near", [Nearness(12.0, 0), Nearness(0.0, 3), Nearness(12.0, 1), NO_TWINS])
def test_a_walk_keeps_what_has_no_twin_before_it(near: Nearness) -> None:
    views = random_views(5, n=80, b=3, cells=12)
    kept: list[int] = []
    for row in range(80):
        if not any(is_twin(views, one, row, near) for one in kept):
            kept.append(row)
    assert apart(views, near).tolist() == kept
    marked = [row not in kept and any(is_twin(views, one, row, near) for one in kept) for row in range(80)]
    assert twins_of(views, np.array(kept), near).tolist() == marked


@pytest.mark.parametrize("near", [Nearness(12.0, 0), Nearness(0.0, 3), Nearness(12.0, 2)])
@pytest.mark.parametrize("axes", [[0, 1, 2], [2, 0, 1], [1, 2, 0]])
def test_frames_of_two_recordings_are_no_twins_whichever_way_cameras_go_round(near: Nearness, axes: list[int]) -> None:
    views = random_views(8, n=60, b=2, cells=12)
    views = replace(
        views,
        directions=views.directions[..., axes],
        recording=np.repeat([0, 1, 2], [25, 5, 30]),
        index=np.concatenate([np.arange(25), 7 * np.arange(5), np.arange(30)]),
    )
    rows = np.array([2, 24, 25, 31, 59])
    marked = [row not in rows and any(is_twin(views, one, row, near) for one in rows) for row in range(60)]
    assert 5 < sum(marked) < 50
    assert twins_of(views, rows, near).tolist() == marked
    shuffled = np.random.default_rng(1).permutation(60)
    places = np.array([int(np.flatnonzero(shuffled == row)[0]) for row in rows])
    assert twins_of(views.of(shuffled), places, near).tolist() == np.array(marked)[shuffled].tolist()
    assert greedily(views, 20, near=near).tolist() == dense_greedy(views, 20, near)


def test_twins_show_nothing_more_from_about_the_same_place() -> None:
    elements = np.array([[0, 10], [0, NOTHING], [0, 10], [NOTHING, NOTHING], [NOTHING, NOTHING], [0, 10]])
    azimuths, distances = np.radians([[0, 0], [2, 50], [2, 3.5], [0, 0], [0, 0], [1, 1]]), np.ones((6, 2))
    distances[5] = 0.89
    views = views_of(elements, azimuths=azimuths, distances=distances)
    # The first has all of the second's one label; the third's second object is too far round, the last nearer.
    assert twins_of(views, np.array([0]), Nearness(3.0)).tolist() == [False, True, False, False, False, False]
    assert twins_of(views, np.array([1]), Nearness(90.0)).tolist() == [False] * 6
    distances[5] = 0.91
    assert twins_of(views, np.array([0]), Nearness(3.0)).tolist() == [False, True, False, False, False, True]
    two = FrameViews(elements, views.directions, distances, np.array([0, 1, 0, 0, 0, 1]), np.arange(6))
    assert twins_of(two, np.array([0]), Nearness(3.0, 9)).tolist() == [False, False, True, True, True, False]


def test_sessions_without_objects_or_frames_have_nothing_to_cover() -> None:
    none = views_of(np.zeros((5, 0), dtype=np.int64))
    assert len(covering(none, 3, near=Nearness(3.0, 0))) == 3
    assert covered(none.elements) == 0
    assert len(covering(views_of(np.zeros((0, 2), dtype=np.int64)), 3, near=Nearness(3.0, 2))) == 0
