"""Blocks of frames: in order, over as many threads as are allowed, errors passed on."""

import threading

import numba
import pytest

from ars_web.geometry.frame_blocks import over_blocks


@pytest.fixture
def threads_given_back():
    allowed = numba.get_num_threads()
    yield
    numba.set_num_threads(allowed)


def test_blocks_come_back_in_order_and_cover_all_once():
    found = over_blocks(lambda part: list(range(1000))[part], 1000, block=7)
    assert [i for block in found for i in block] == list(range(1000))
    assert max(map(len, found)) == 7


def test_nothing_is_nothing():
    assert over_blocks(lambda part: part, 0, block=5) == []


def test_a_process_that_may_have_one_thread_uses_its_own(threads_given_back):
    numba.set_num_threads(1)
    used = set(over_blocks(lambda _: threading.get_ident(), 100, block=10))
    assert used == {threading.get_ident()}


def test_an_error_in_a_block_is_the_callers():
    def work(part: slice) -> None:
        if part.start == 30:
            raise ValueError("block 30")

    with pytest.raises(ValueError, match="block 30"):
        over_blocks(work, 100, block=10)
