from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ars_web.datasets.options import SplitChoice
from ars_web.datasets.splits import BLOCKS, apportion, assign, places_in_splits
from ars_web.errors import BadInput


def runs(splits: np.ndarray) -> int:
    return int((np.diff(splits) != 0).sum()) + 1


def test_blocks_are_contiguous_runs_that_meet_the_shares() -> None:
    splits = assign([3000], SplitChoice(train=0.7, val=0.2, test=0.1))
    assert np.bincount(splits).tolist() == [2100, 600, 300]
    assert runs(splits) <= BLOCKS
    edges = np.flatnonzero(np.diff(splits)) + 1
    assert (edges % (3000 // BLOCKS) == 0).all()


@pytest.mark.parametrize(("frames", "longest"), [(60, 6), (99, 9), (300, 20), (590, 20), (600, 20), (36000, 1200)])
def test_blocks_of_short_recordings_keep_neighbours_together(frames: int, longest: int) -> None:
    splits = assign([frames], SplitChoice())
    assert splits.sum() == pytest.approx(0.2 * frames, abs=longest)
    edges = np.flatnonzero(np.diff(splits)) + 1
    lengths = np.diff(np.concatenate([[0], edges, [frames]]))
    assert lengths.min() >= longest


def test_frames_are_dealt_one_by_one() -> None:
    splits = assign([1000], SplitChoice(by="frame"))
    assert np.bincount(splits).tolist() == [800, 200]
    assert runs(splits) > 200


def test_sessions_are_dealt_whole() -> None:
    splits = assign([10, 20, 30, 40, 50], SplitChoice(by="session"))
    starts = np.cumsum([0, 10, 20, 30, 40, 50])
    of_session = [set(splits[a:b].tolist()) for a, b in pairwise(starts.tolist())]
    assert all(len(found) == 1 for found in of_session)
    assert sorted(min(found) for found in of_session) == [0, 0, 0, 0, 1]


def test_too_few_sessions_for_the_splits_are_refused() -> None:
    with pytest.raises(BadInput, match=r"each of train, val.*this export has 1"):
        assign([100], SplitChoice(by="session"))


def test_the_seed_decides_and_nothing_else() -> None:
    one, two = SplitChoice(seed=1), SplitChoice(seed=2)
    assert (assign([500], one) == assign([500], one)).all()
    assert (assign([500], one) != assign([500], two)).any()


def test_the_choice_is_the_same_on_every_machine() -> None:
    assert np.flatnonzero(assign([10], SplitChoice(by="frame"))).tolist() == [3, 9]


@pytest.mark.parametrize("by", ["block", "frame"])
def test_a_share_of_zero_gets_nothing_and_a_single_frame_trains(by: str) -> None:
    assert not assign([97], SplitChoice.model_validate({"train": 1.0, "val": 0.0, "by": by})).any()
    assert assign([1], SplitChoice.model_validate({"by": by})).tolist() == [0]
    assert assign([0], SplitChoice.model_validate({"by": by})).tolist() == []
    assert (assign([7], SplitChoice.model_validate({"train": 0.0, "val": 1.0, "by": by})) == 1).all()


def test_every_merged_session_is_divided_by_itself() -> None:
    splits = assign([100, 50], SplitChoice())
    assert splits[:100].sum() == 20
    assert splits[100:].sum() == 10


@given(units=st.integers(0, 500), cuts=st.tuples(st.integers(0, 100), st.integers(0, 100)))
def test_apportioning_gives_every_unit_away_once(units: int, cuts: tuple[int, int]) -> None:
    low, high = sorted(cuts)
    shares = [low / 100, (high - low) / 100, (100 - high) / 100]
    counts = apportion(units, shares)
    positive = sum(share > 0 for share in shares)
    assert sum(counts) == units
    assert min(counts) >= 0
    for count, share in zip(counts, shares, strict=True):
        assert (count == 0) if share == 0 else abs(count - share * units) <= positive
        if share > 0 and units >= positive:
            assert count >= 1


def test_places_count_within_each_split() -> None:
    assert places_in_splits(np.array([0, 0, 1, 0, 2, 1, 0])).tolist() == [0, 1, 0, 2, 0, 1, 3]
    assert places_in_splits(np.zeros(0, dtype=np.int64)).tolist() == []


def by_sector(azimuths: list[float], **changes: object) -> list[int]:
    choice = SplitChoice.model_validate({"train": 0.5, "val": 0.25, "test": 0.25, "by": "sector", **changes})
    return assign([len(azimuths)], choice, azimuths=[np.array(azimuths)]).tolist()


@pytest.mark.parametrize("seed", range(8))
def test_held_out_sectors_are_runs_that_cross_no_gap(seed: int) -> None:
    # From 340 over 0 to 55 degrees: the widest gap lies between 55 and 340.
    order = [340.0, 350.0, 0.0, 10.0, 20.0, 30.0, 40.0, 55.0]
    found = by_sector(order, seed=seed)
    val, test = (np.flatnonzero(np.array(found) == number) for number in (1, 2))
    assert np.diff(val).tolist() == np.diff(test).tolist() == [1]
    assert val[1] + 1 == test[0]
    shuffled = [7, 2, 5, 0, 3, 6, 1, 4]
    assert by_sector([order[i] for i in shuffled], seed=seed) == [found[i] for i in shuffled]


def test_sectors_of_few_frames() -> None:
    assert by_sector([]) == []
    assert by_sector([10.0]) == [0]
    assert sorted(by_sector([10.0, 200.0, float("nan")])) == [0, 1, 2]
    assert by_sector([5.0, 6.0], train=0.0, val=1.0, test=0.0) == [1, 1]


def test_a_held_out_run_may_be_at_either_end_of_the_order() -> None:
    azimuths = [0.0, 10.0, 20.0, 30.0]
    runs_begin = {by_sector(azimuths, seed=seed).index(1) for seed in range(40)}
    assert runs_begin == {0, 1, 2}, "of val and test, a frame each, val begins at any of three places"


def test_a_share_that_means_a_whole_number_gets_it_and_ties_go_to_the_first() -> None:
    # 0.29 * 100 is 28.999999999999996.
    assert apportion(100, [0.71, 0.29]) == [71, 29]
    assert apportion(10, [0.7, 0.1, 0.2]) == [7, 1, 2]
    assert apportion(5, [0.5, 0.5]) == [3, 2]
    assert apportion(5, [0.1, 0.45, 0.45]) == [1, 2, 2]
