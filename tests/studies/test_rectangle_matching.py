"""The optimal pairs, against all that there are."""

from itertools import permutations

import numpy as np
import pytest

from ars_web.geometry.rectangle_overlap import pairwise_iou
from ars_web.studies.rectangle_matching import Pairs, Rectangles, matched_pairs, pairs_of_any_class


def rectangles(frames: list[int], kinds: list[int], boxes: list[list[float]]) -> Rectangles:
    return Rectangles(np.array(frames), np.array(kinds), np.array(boxes, dtype=np.float64).reshape(-1, 4))


def told(pairs: Pairs) -> list[tuple[int, int, float]]:
    columns = (pairs.first.tolist(), pairs.second.tolist(), pairs.iou.round(4).tolist())
    return list(zip(*columns, strict=True))


def best_sum(overlaps: np.ndarray, iou: float) -> float:
    """The largest sum of overlaps from `iou` on over all one-to-one pairings, one by one."""
    wide = overlaps if overlaps.shape[0] <= overlaps.shape[1] else overlaps.T
    worth = np.where(wide >= iou, wide, 0.0)
    return max(sum(worth[i, j] for i, j in enumerate(order)) for order in permutations(range(wide.shape[1]), len(wide)))


@pytest.mark.parametrize("seed", range(30))
def test_no_pairing_has_a_larger_sum(seed: int) -> None:
    random = np.random.default_rng(seed)
    lists: list[Rectangles] = []
    for count in random.integers(1, 6, size=2):
        corners = random.uniform(0, 10, (count, 2))
        boxes = np.hstack([corners, corners + random.uniform(4, 12, (count, 2))])
        lists.append(Rectangles(np.zeros(count, dtype=np.int64), np.zeros(count, dtype=np.int64), boxes))
    overlaps = pairwise_iou(lists[0].bbox, lists[1].bbox)
    for iou in (0.1, 0.3, 0.6):
        pairs = matched_pairs(*lists, iou=iou)
        assert pairs.iou.sum() == pytest.approx(best_sum(overlaps, iou))
        assert (pairs.iou >= iou).all()
        np.testing.assert_array_equal(pairs.iou, overlaps[pairs.first, pairs.second])
        assert len(set(pairs.first.tolist())) == len(set(pairs.second.tolist())) == len(pairs.iou)


def test_frames_and_classes_are_apart() -> None:
    box = [0, 0, 10, 10]
    first = rectangles([0, 0, 1, 7], [0, 1, 0, 0], [box] * 4)
    second = rectangles([1, 0, 0], [0, 1, 2], [box] * 3)
    assert told(matched_pairs(first, second, iou=0.3)) == [(1, 1, 1.0), (2, 0, 1.0)]
    every, some = np.ones(4, dtype=bool), np.array([False, False, True])
    # Of the two of frame 0 either will do; one has a partner.
    pairs = pairs_of_any_class(first, second, iou=0.3, among_first=every, among_second=some)
    assert (pairs.second.tolist(), pairs.iou.tolist()) == ([2], [1.0])
    assert pairs.first[0] in (0, 1)


def test_the_best_partner_goes_to_whom_it_serves() -> None:
    # IoU of 0..10 with 1..11 is 9/11 and with 3..13 is 7/13; of 4..14 with 1..11 it is 7/13, with 3..13 it is 9/11; of
    # 2..12 alone 9/11 with either.
    first = rectangles([0, 0], [0, 0], [[0, 0, 10, 10], [2, 0, 12, 10]])
    second = rectangles([0, 0], [0, 0], [[1, 0, 11, 10], [-6, 0, 4, 10]])
    # 0..10 with -6..4 is 4/16: alone it would take 1..11, but 2..12 has no other.
    assert told(matched_pairs(first, second, iou=0.2)) == [(0, 1, 0.25), (1, 0, 0.8182)]
    assert told(matched_pairs(first, second, iou=0.3)) in ([(0, 0, 0.8182)], [(1, 0, 0.8182)])


def test_nothing_has_no_partner() -> None:
    none = rectangles([], [], [])
    some = rectangles([0], [0], [[0, 0, 1, 1]])
    for pair in ((none, none), (none, some), (some, none)):
        assert told(matched_pairs(*pair, iou=0.3)) == []


def test_an_overlap_of_just_the_threshold_is_a_pair() -> None:
    first, second = (rectangles([0], [0], [box]) for box in ([0, 0, 10, 10], [0, 0, 10, 5]))
    assert told(matched_pairs(first, second, iou=0.5)) == [(0, 0, 0.5)]
    assert told(matched_pairs(first, second, iou=0.501)) == []
