"""Jobs of a server, whatever they do: their states, their keys, and what is answered instead of a new one."""

import threading
from collections.abc import Iterator
from dataclasses import dataclass

import pytest

from ars_web.errors import BadInput
from ars_web.sessions.jobs import Job, Jobs, fresh_job_id

SECONDS = 20.0


@dataclass(frozen=True, kw_only=True)
class Errand(Job):
    of: str = ""
    left: float | None = 3.0


@pytest.fixture
def jobs() -> Iterator[Jobs[Errand]]:
    jobs = Jobs[Errand](what="the errand", at_once=1, ended={"left": None})
    yield jobs
    jobs.close()


def test_a_job_that_is_done_has_done_all_its_steps(jobs: Jobs[Errand]) -> None:
    def work(id_: str) -> None:
        jobs.change(id_, done=1, total=3)
        jobs.finish(id_, left=0.0)

    made = jobs.start(Errand(id=fresh_job_id("e")), "order", work, key=None)
    assert (made.state, made.is_going) == ("queued", True)
    ended = jobs.wait(made.id, timeout=SECONDS)
    assert (ended.state, ended.done, ended.total, ended.left, ended.is_going) == ("done", 3, 3, 0.0, False)


def test_what_it_raises_is_told_in_the_words_of_its_kind(jobs: Jobs[Errand]) -> None:
    def work(id_: str) -> None:
        raise BadInput("no shop is open")

    made = jobs.start(Errand(id="e1"), "order", work, key=None, words=lambda error: f"Sorry: {error}")
    ended = jobs.wait(made.id, timeout=SECONDS)
    assert (ended.state, ended.error, ended.left) == ("failed", "Sorry: no shop is open", None)


def test_a_job_that_does_instead_is_the_answer_while_it_goes_on(jobs: Jobs[Errand]) -> None:
    opened = threading.Event()

    def wait(id_: str) -> None:
        assert opened.wait(SECONDS)
        jobs.change(id_, done=1)  # ends the work of one that was cancelled
        jobs.finish(id_)

    def ask(of: str, key: str | None) -> Errand:
        return jobs.start(Errand(id=fresh_job_id("e"), of=of), of, wait, key=key, instead=lambda going: going.of == of)

    first = ask("bread", "k1")
    assert ask("bread", "k2").id == first.id
    other = ask("milk", None)
    assert other.id != first.id
    # A key that was answered with a job that went on already means that one for good.
    answered = jobs.answered("bread", "k2")
    assert answered is not None
    assert answered.id == first.id
    with pytest.raises(BadInput, match="used for something else"):
        jobs.answered("milk", "k2")
    assert jobs.cancel(first.id).state == "cancelled"
    assert ask("bread", None).id != first.id
    opened.set()
    assert jobs.wait(first.id, timeout=SECONDS).state == "cancelled"
    assert jobs.wait(other.id, timeout=SECONDS).state == "done"
