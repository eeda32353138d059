"""Jobs of one server: work that takes its time, done by threads, so that a page can show how far it is and stop it.

Jobs are in memory alone: a server that is killed loses them, so what a job makes must appear whole or not at all.
"""

import logging
import secrets
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any, Generic, Literal, TypeVar

from ars_web.errors import ArsError, BadInput, Cancelled
from ars_web.sessions.names import checked_key

_log = logging.getLogger(__name__)

REMEMBERED = 200
"""Jobs that are told about after they have ended."""

State = Literal["queued", "running", "done", "failed", "cancelled"]


@dataclass(frozen=True, kw_only=True)
class Job:
    """Something that was asked for.

    Attributes:
        done, total: steps; total is 0 until that is known.
        error: one clear line, of a failed job.
    """

    id: str
    state: State = "queued"
    done: int = 0
    total: int = 0
    error: str | None = None

    @property
    def is_going(self) -> bool:
        """Whether it has not ended."""
        return self.state in ("queued", "running")


J = TypeVar("J", bound=Job)


def fresh_job_id(letter: str) -> str:
    """A fresh one; `letter` says of which kind."""
    return f"{letter}{secrets.token_hex(6)}"


class Jobs(Generic[J]):
    """All jobs of one kind. Thread-safe."""

    def __init__(self, *, what: str, at_once: int, ended: Mapping[str, Any] | None = None) -> None:
        """`what` they do, in words; `at_once`: jobs that run side by side; `ended`: what else is then true of a job
        that failed or was cancelled."""
        self._what = what
        self._ended = dict(ended or {})
        self._lock = threading.Lock()
        self._closing = threading.Event()
        self._runner = ThreadPoolExecutor(max_workers=at_once, thread_name_prefix=what)
        self._jobs: dict[str, J] = {}
        self._futures: dict[str, Future[None]] = {}
        self._keys: dict[str, tuple[object, str]] = {}
        # Jobs whose result is about to appear: too late to cancel.
        self._settled: set[str] = set()

    def answered(self, order: object, key: str | None) -> J | None:
        """The job that was begun with the same idempotency `key`; None where there is none.

        Raises:
            BadInput: that was another order.
        """
        with self._lock:
            return self._answered(order, key)

    def start(
        self,
        job: J,
        order: object,
        work: Callable[[str], None],
        *,
        key: str | None,
        words: Callable[[ArsError], str] = str,
        instead: Callable[[J], bool] = lambda _: False,
    ) -> J:
        """Have `work(job.id)` done by a thread.

        What it raises ends the job: Cancelled as cancelled, another ArsError as failed, with `words` of it. Whoever
        repeats the order with the same idempotency `key` is answered the first one's job, and a job that is going on
        is the answer where it does `instead`.

        Raises:
            BadInput: `key` was used for another order.
        """
        with self._lock:
            answered = self._answered(order, key)
            if answered is not None:
                return answered
            for going in self._jobs.values():
                if going.is_going and instead(going):
                    if key is not None:
                        self._keys[key] = (order, going.id)
                    return going
            self._forget_oldest()
            self._jobs[job.id] = job
            if key is not None:
                self._keys[key] = (order, job.id)
            self._futures[job.id] = self._runner.submit(self._run, job.id, work, words)
        return job

    def get(self, id_: str) -> J | None:
        """The job as it is now; None where nobody remembers it."""
        with self._lock:
            return self._jobs.get(id_)

    def list(self) -> list[J]:
        """All jobs, the newest first."""
        with self._lock:
            return list(reversed(self._jobs.values()))

    def cancel(self, id_: str) -> J:
        """Stop a job that is there: cancelled at once, its work ends soon after and leaves nothing. One that has ended,
        or whose result is about to appear, stays as it is."""
        with self._lock:
            job = self._jobs[id_]
            if job.is_going and id_ not in self._settled:
                job = self._jobs[id_] = replace(job, state="cancelled", **self._ended)
            return job

    def wait(self, id_: str, *, timeout: float | None = None) -> J:
        """The job once its work has ended, or TimeoutError."""
        self._futures[id_].result(timeout)
        with self._lock:
            return self._jobs[id_]

    def close(self) -> None:
        """Stop all jobs, and wait until they have cleared up."""
        self._closing.set()
        self._runner.shutdown(wait=True, cancel_futures=True)

    def change(self, id_: str, *, settled: bool = False, **changes: Any) -> None:
        """Say how far a job is; `settled`: from now on it is too late to cancel it.

        Raises:
            Cancelled: it is not to go on.
        """
        with self._lock:
            if self._closing.is_set() or self._jobs[id_].state == "cancelled":
                raise Cancelled(f"{self._what} was cancelled")
            self._jobs[id_] = replace(self._jobs[id_], **changes)
            if settled:
                self._settled.add(id_)

    def finish(self, id_: str, **changes: Any) -> None:
        """A job is done, all its steps, whoever cancelled it meanwhile: its result is there."""
        with self._lock:
            job = replace(self._jobs[id_], state="done", **changes)
            self._jobs[id_] = replace(job, done=job.total)

    def _answered(self, order: object, key: str | None) -> J | None:
        if key is None or checked_key(key) not in self._keys:
            return None
        first, id_ = self._keys[key]
        if first != order:
            raise BadInput(f"Idempotency-Key {key!r} was used for something else; use a new one")
        return self._jobs[id_]

    def _forget_oldest(self) -> None:
        ended = [job.id for job in self._jobs.values() if not job.is_going]
        for id_ in ended[: max(0, len(self._jobs) - REMEMBERED + 1)]:
            del self._jobs[id_], self._futures[id_]
            self._settled.discard(id_)
            self._keys = {key: made for key, made in self._keys.items() if made[1] != id_}

    def _run(self, id_: str, work: Callable[[str], None], words: Callable[[ArsError], str]) -> None:
        """The whole life of a job, in one of the runner's threads."""
        try:
            self.change(id_, state="running")
            work(id_)
        except Cancelled:
            self._end(id_, state="cancelled")
        except ArsError as error:
            self._end(id_, state="failed", error=words(error))
        except BaseException:
            # A fault of this program: its trace goes on to whoever waits, and the job does not run for ever.
            self._end(id_, state="failed", error=f"{self._what} ended by a fault in the program; see its log")
            _log.exception("%s %s", self._what, id_)
            raise

    def _end(self, id_: str, **changes: Any) -> None:
        """A job ends without a result, unless it was cancelled before."""
        with self._lock:
            if self._jobs[id_].state != "cancelled":
                self._jobs[id_] = replace(self._jobs[id_], **self._ended, **changes)
