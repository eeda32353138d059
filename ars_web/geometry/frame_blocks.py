"""Long rows of frames in blocks over a few threads.

The compiled loops hold no lock of the interpreter's while they run, so plain threads do. numba's own parallel loops
would need a threading library that bears calls from several threads and processes that fork; plain threads need none.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import numba

T = TypeVar("T")


def over_blocks(work: Callable[[slice], T], n: int, *, block: int) -> list[T]:
    """What `work` returns for each block of at most `block` of n frames, in order.

    As many threads as `numba.get_num_threads()` says: all cores, or what `numba.set_num_threads` allowed the calling
    thread, which is how each process of a pool keeps to its one.
    """
    blocks = [slice(start, min(start + block, n)) for start in range(0, n, block)]
    threads = min(numba.get_num_threads(), len(blocks))
    if threads < 2:
        return [work(part) for part in blocks]
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(work, blocks))
