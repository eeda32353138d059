"""Running an export's missing shards through executors, whoever keeps them and wherever they are run.

Only the standard `concurrent.futures.Executor` interface is used.
"""

import logging
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from dataclasses import dataclass
from typing import Protocol

from ars_web.datasets.plan import ExportPlan
from ars_web.errors import ArsError, Cancelled

_log = logging.getLogger(__name__)

MOST_DEATHS = 3
"""A shard that kills its worker this often is given up."""

_LOOK_EVERY = 0.1
"""Seconds between looks whether the caller wants to stop."""


class ShardKeeper(Protocol):
    """Where the shards of one export are until they are joined."""

    def finished(self) -> list[int]:
        """Numbers of the shards that are whole."""
        ...

    def tries(self, number: int) -> int:
        """How many tries at a shard have begun and not ended well."""
        ...

    def begin_round(self, numbers: Sequence[int]) -> None:
        """Forget the tries at these shards, and that anyone was asked to stop."""
        ...

    def submit(self, executor: Executor, number: int) -> Future[int]:
        """Have a shard made; the future's result is its count of frames."""
        ...

    def ask_to_stop(self) -> None:
        """Ask the workers to stop."""
        ...


@dataclass(frozen=True)
class Workplace:
    """Where shards are run.

    Attributes:
        executor: makes an executor.
        killed: what a future raises whose worker was killed.
        cancelled: whether the caller wants to stop; raises OSError where the place is gone.
    """

    executor: Callable[[], Executor]
    killed: tuple[type[Exception], ...] = (BrokenExecutor,)
    cancelled: Callable[[], bool] = lambda: False


def run_shards(
    plan: ExportPlan, keeper: ShardKeeper, place: Workplace, on_progress: Callable[[int, int], None]
) -> None:
    """Run every missing shard; a pool that a killed worker broke is replaced, and the rest goes on.

    A broken pool does not say who broke it, and a cluster also blames shards that only waited for the worker. The
    shards that were begun are suspects and are run one at a time from then on, so that the second death tells.

    Raises:
        ArsError: a shard killed its worker MOST_DEATHS times; the message names it.
        Cancelled: the caller wants to stop.
    """
    deaths: Counter[int] = Counter()
    idle_deaths = 0
    while missing := sorted(set(range(len(plan.shards))) - set(keeper.finished())):
        keeper.begin_round(missing)
        batch = [number for number in missing if not deaths[number]] or missing[:1]
        try:
            _run_batch(plan, keeper, batch, place, on_progress)
        except place.killed as error:
            # A cluster tries several times before it gives up.
            tries = {number: keeper.tries(number) for number in batch}
            begun = [number for number in batch if tries[number]]
            _log.warning("a worker was killed; shards %s are run again", begun or batch)
            deaths.update(tries)
            idle_deaths = 0 if begun else idle_deaths + 1
            if len(begun) == 1 and deaths[begun[0]] >= MOST_DEATHS:
                raise ArsError(_given_up(plan, begun[0])) from error
            if idle_deaths >= MOST_DEATHS:
                raise ArsError(
                    f"workers were killed {MOST_DEATHS} times before they began a shard; is memory short, or does the"
                    " script that exports lack its `if __name__ == '__main__':`?"
                ) from error


def _given_up(plan: ExportPlan, number: int) -> str:
    start, stop = plan.shards[number]
    session = plan.sessions[int(plan.frames.session[start])]
    return (
        f"shard {number:05d} killed its worker {MOST_DEATHS} times: frames {plan.frames.index[start]} to"
        f" {plan.frames.index[stop - 1]} of session {session.id}; is memory short, or one of their images at fault?"
    )


def _run_batch(
    plan: ExportPlan,
    keeper: ShardKeeper,
    numbers: Sequence[int],
    place: Workplace,
    on_progress: Callable[[int, int], None],
) -> None:
    """Run these shards in one executor. Whatever ends this early, no worker is left writing.

    A killed worker is told of at the end: where the executor goes on without it, the other shards get done.
    """
    total = len(plan.frames)
    done = sum(plan.shards[n][1] - plan.shards[n][0] for n in keeper.finished())
    death: Exception | None = None
    with place.executor() as executor:
        try:
            on_progress(done, total)
            running: set[Future[int]] = {keeper.submit(executor, number) for number in numbers}
            while running:
                if place.cancelled():
                    raise Cancelled("the export was cancelled")
                ended, running = wait(running, timeout=_LOOK_EVERY, return_when=FIRST_COMPLETED)
                for future in ended:
                    try:
                        done += future.result()
                    except place.killed as error:
                        death = error
                    except CancelledError as error:
                        raise ConnectionError("the executor was shut down by someone else, or is gone") from error
                    on_progress(done, total)
        except BaseException:
            keeper.ask_to_stop()
            executor.shutdown(wait=True, cancel_futures=True)
            raise
    if death is not None:
        raise death
