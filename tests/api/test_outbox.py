"""What waits for one page: in order, the newest of its kind, bounded, filled by any thread."""

import asyncio
import threading

import pytest

from ars_web.api.outbox import Outbox, Overflown


async def all_of(outbox: Outbox[str], n: int) -> list[str]:
    async with asyncio.timeout(20):
        return [await outbox.take() for _ in range(n)]


def test_the_newest_under_a_key_comes_in_the_place_of_the_last() -> None:
    async def use() -> list[str]:
        outbox = Outbox[str](asyncio.get_running_loop())
        outbox.put("box 1 at a", key=1)
        outbox.put("box 2 at a", key=2)
        outbox.put("refused")
        outbox.put("refused again")
        outbox.put("box 1 at b", key=1)
        return await all_of(outbox, 4)

    assert asyncio.run(use()) == ["box 2 at a", "refused", "refused again", "box 1 at b"]


def test_threads_fill_it_while_it_is_emptied() -> None:
    async def use() -> list[str]:
        outbox = Outbox[str](asyncio.get_running_loop(), largest=4000)
        threads = [
            threading.Thread(target=lambda name=name: [outbox.put(f"{name}{i}") for i in range(1000)])
            for name in "abcd"
        ]
        for thread in threads:
            thread.start()
        taken = await all_of(outbox, 4000)
        for thread in threads:
            thread.join()
        return taken

    taken = asyncio.run(use())
    for name in "abcd":
        assert [one for one in taken if one[0] == name] == [f"{name}{i}" for i in range(1000)]


def test_more_than_there_is_place_for_ends_it() -> None:
    async def use() -> None:
        outbox = Outbox[str](asyncio.get_running_loop(), largest=2)
        for _ in range(10):
            outbox.put("newest", key=1)
        outbox.put("b")
        outbox.put("c")
        with pytest.raises(Overflown):
            await outbox.take()

    asyncio.run(use())


def test_one_that_waits_hears_of_it() -> None:
    async def use() -> None:
        outbox = Outbox[str](asyncio.get_running_loop(), largest=0)
        waiting = asyncio.create_task(outbox.take())
        await asyncio.sleep(0)
        outbox.put("a")
        with pytest.raises(Overflown):
            await asyncio.wait_for(waiting, 20)

    asyncio.run(use())


def test_once_closed_it_takes_nothing_also_when_its_loop_is_gone() -> None:
    async def use() -> Outbox[str]:
        outbox = Outbox[str](asyncio.get_running_loop())
        outbox.put("a")
        outbox.close()
        outbox.put("b")
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(outbox.take(), 0.1)
        return outbox

    with asyncio.Runner() as runner:
        closed = runner.run(use())
        loop = runner.get_loop()
    assert loop.is_closed()
    closed.put("c")  # a closed loop would refuse to be told
