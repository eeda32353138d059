"""Export jobs: asked for, followed, cancelled, failed, and gone on with by the next server."""

import json
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from ars_web.datasets.exports import ExportJobs
from ars_web.datasets.jobs import partial_folder, plan_export, run_export
from ars_web.datasets.options import ExportOptions
from ars_web.errors import BadInput, Cancelled, Conflict, NotFound, StoreError
from ars_web.sessions.model import SessionSnapshot

Make = Callable[..., SessionSnapshot]
Tree = Callable[[Path], dict[str, str]]

PLAIN = ExportOptions.model_validate({})


class Gate:
    """An executor factory whose executors wait at a gate: a job stays running for as long as a test needs."""

    def __init__(self) -> None:
        self.open = threading.Event()
        self.reached = threading.Event()

    def __call__(self) -> Executor:
        gate = self

        class Waiting(ThreadPoolExecutor):
            def submit(self, fn, /, *args, **kwargs):
                def work():
                    gate.reached.set()
                    assert gate.open.wait(30)
                    return fn(*args, **kwargs)

                return super().submit(work)

        return Waiting(1)


@contextmanager
def jobs_of(folder: Path, *snapshots: SessionSnapshot, factory: Callable[[], Executor] | None = None) -> Iterator:
    known = {snapshot.id: snapshot for snapshot in snapshots}

    def snapshot_of(sid: str) -> SessionSnapshot:
        if sid not in known:
            raise NotFound(f"there is no session {sid!r}")
        return known[sid]

    jobs = ExportJobs(folder, snapshot_of, executor_factory=factory)
    try:
        yield jobs
    finally:
        if isinstance(factory, Gate):
            factory.open.set()
        jobs.close()


def wait_until(condition: Callable[[], bool]) -> None:
    deadline, moment = time.monotonic() + 30, threading.Event()
    while not condition():
        assert time.monotonic() < deadline
        moment.wait(0.01)


def test_a_job_runs_to_its_dataset(make_snapshot: Make, tree: Tree, tmp_path: Path) -> None:
    snapshot = make_snapshot(12)
    with jobs_of(tmp_path / "sessions", snapshot) as jobs:
        job = jobs.start("s1", format="coco", options=PLAIN)
        assert (job.session_id, job.state, job.error, job.report) == ("s1", "queued", None, None)
        done = jobs.wait(job.id, timeout=60)
        assert (done.state, done.done, done.total) == ("done", 12, 12)
        assert job.ended is None
        assert done.created <= done.ended
        files = [path for path in jobs.dataset_folder(job.id).rglob("*") if path.is_file()]
        assert done.bytes == sum(path.stat().st_size for path in files) > 0
        assert done.report["format"] == "coco"
        run_export(plan_export([snapshot], format="coco", options=PLAIN, out=tmp_path / "d"))
        assert tree(jobs.dataset_folder(job.id)) == tree(tmp_path / "d")
    with jobs_of(tmp_path / "sessions", snapshot) as again:
        assert again.get(job.id) == done


def test_what_cannot_be_is_refused_before_there_is_a_job(make_snapshot: Make, tmp_path: Path) -> None:
    with jobs_of(tmp_path, make_snapshot(2)) as jobs:
        with pytest.raises(NotFound, match="s9"):
            jobs.start("s9", format="yolo", options=PLAIN)
        with pytest.raises(NotFound, match="s9"):
            jobs.start("s1", format="yolo", options=ExportOptions(sessions=("s9",)))
        with pytest.raises(BadInput, match="nope"):
            jobs.start("s1", format="nope", options=PLAIN)
        with pytest.raises(BadInput, match="mesh"):
            jobs.start("s1", format="yolo", options=ExportOptions(shape="mesh"))
        with pytest.raises(BadInput, match="twice"):
            jobs.start("s1", format="yolo", options=ExportOptions(sessions=("s1",)))
        assert jobs.list() == []
        with pytest.raises(NotFound, match="x0"):
            jobs.get("x0")
        with pytest.raises(NotFound, match="x0"):
            jobs.cancel("x0")


def test_a_job_that_fails_says_why_and_leaves_no_data(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(4)
    snapshot.frames.images[2].unlink()
    with jobs_of(tmp_path / "sessions", snapshot) as jobs:
        job = jobs.wait(jobs.start("s1", format="yolo", options=PLAIN).id, timeout=60)
        assert job.state == "failed"
        assert "0002.jpg: the image cannot be exported" in job.error
        with pytest.raises(NotFound, match="it is failed"):
            jobs.dataset_folder(job.id)
        assert [p.name for p in (tmp_path / "sessions" / ".exports" / job.id).iterdir()] == ["job.json"]


def test_a_fault_of_the_program_ends_the_job_too(make_snapshot: Make, tmp_path: Path) -> None:
    def broken() -> Executor:
        raise ZeroDivisionError

    with jobs_of(tmp_path / "sessions", make_snapshot(2), factory=broken) as jobs:
        job = jobs.start("s1", format="yolo", options=PLAIN)
        with pytest.raises(ZeroDivisionError):
            jobs.wait(job.id, timeout=60)
        assert jobs.get(job.id).state == "failed"


def test_a_key_answers_the_same_job_again(make_snapshot: Make, tmp_path: Path) -> None:
    with jobs_of(tmp_path / "sessions", make_snapshot(2)) as jobs:
        first = jobs.start("s1", format="yolo", options=PLAIN, key="k")
        assert jobs.start("s1", format="yolo", options=PLAIN, key="k").id == first.id
        assert jobs.start("s1", format="yolo", options=PLAIN).id != first.id
        with pytest.raises(BadInput, match="'k' was used for another export"):
            jobs.start("s1", format="coco", options=PLAIN, key="k")


def test_a_running_job_is_cancelled_and_its_data_goes(make_snapshot: Make, tmp_path: Path) -> None:
    gate = Gate()
    with jobs_of(tmp_path / "sessions", make_snapshot(4), factory=gate) as jobs:
        running = jobs.start("s1", format="yolo", options=PLAIN)
        queued = jobs.start("s1", format="coco", options=PLAIN)
        assert gate.reached.wait(30)
        assert jobs.get(running.id).state == "running"
        assert jobs.cancel(running.id).state == "cancelled"
        assert jobs.cancel(queued.id).state == "cancelled"
        gate.open.set()
        for job in (running, queued):
            assert jobs.wait(job.id, timeout=60).state == "cancelled"
            assert [p.name for p in (tmp_path / "sessions" / ".exports" / job.id).iterdir()] == ["job.json"]
        assert jobs.cancel(running.id).state == "cancelled"


def test_a_done_job_stays_done_when_cancelled(make_snapshot: Make, tmp_path: Path) -> None:
    with jobs_of(tmp_path / "sessions", make_snapshot(2)) as jobs:
        job = jobs.wait(jobs.start("s1", format="yolo", options=PLAIN).id, timeout=60)
        assert jobs.cancel(job.id) == job
        assert jobs.dataset_folder(job.id).is_dir()


def test_jobs_are_listed_newest_first(make_snapshot: Make, tmp_path: Path) -> None:
    snapshots = make_snapshot(2), make_snapshot(2, sid="s2")
    with jobs_of(tmp_path / "sessions", *snapshots) as jobs:
        ids = [jobs.start(sid, format="yolo", options=PLAIN).id for sid in ("s1", "s2", "s1")]
        assert [job.id for job in jobs.list()] == ids[::-1]
        assert [job.id for job in jobs.list("s2")] == [ids[1]]


@pytest.mark.parametrize("planned", [True, False])
def test_the_next_server_goes_on_with_the_sessions_as_they_were_planned(
    make_snapshot: Make, tree: Tree, tmp_path: Path, planned: bool
) -> None:
    """The first server is closed, as by a stop, while a job runs and another waits; the session is edited before
    the second server starts. A job that was planned keeps to its plan; one that was not sees the edit."""
    before = make_snapshot(6)
    after = replace(before, state=replace(before.state, revision=4, boxes={1: before.state.boxes[1]}))
    gate = Gate()
    with jobs_of(tmp_path / "sessions", before, factory=gate) as jobs:
        running = jobs.start("s1", format="yolo", options=PLAIN)
        waiting = jobs.start("s1", format="yolo", options=PLAIN)
        assert gate.reached.wait(30)
        partial = partial_folder(tmp_path / "sessions" / ".exports" / running.id / "dataset")
        closing = threading.Thread(target=jobs.close)
        closing.start()
        # The workers have been asked to stop: nothing more is begun when the gate opens.
        wait_until((partial / "cancel").exists)
        gate.open.set()
        closing.join(30)
    assert partial.is_dir()
    job = running if planned else waiting
    with jobs_of(tmp_path / "sessions", after) as jobs:
        assert jobs.get(running.id).state == "running"
        assert jobs.get(waiting.id).state == "queued"
        jobs.resume_unfinished()
        jobs.resume_unfinished()
        done = jobs.wait(job.id, timeout=60)
        assert (done.state, done.report["sessions"][0]["revision"]) == ("done", 3 if planned else 4)
        expected = before if planned else after
        run_export(plan_export([expected], format="yolo", options=PLAIN, out=tmp_path / "d"))
        assert tree(jobs.dataset_folder(job.id)) == tree(tmp_path / "d")


def test_a_job_whose_server_died_after_publishing_is_done(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(3)
    with jobs_of(tmp_path / "sessions", snapshot) as jobs:
        job = jobs.wait(jobs.start("s1", format="yolo", options=PLAIN).id, timeout=60)
    path = tmp_path / "sessions" / ".exports" / job.id / "job.json"
    path.write_text(path.read_text().replace('"state":"done"', '"state":"running"'))
    with jobs_of(tmp_path / "sessions", snapshot) as jobs:
        jobs.resume_unfinished()
        again = jobs.wait(job.id, timeout=60)
        assert replace(again, ended=job.ended) == job


def test_a_key_answers_its_job_when_the_session_is_gone(make_snapshot: Make, tmp_path: Path) -> None:
    with jobs_of(tmp_path / "sessions", make_snapshot(2)) as jobs:
        first = jobs.start("s1", format="yolo", options=PLAIN, key="k")
        jobs.wait(first.id, timeout=60)
    with jobs_of(tmp_path / "sessions") as jobs:
        assert jobs.start("s1", format="yolo", options=PLAIN, key="k").id == first.id
        with pytest.raises(NotFound):
            jobs.start("s1", format="yolo", options=PLAIN, key="another")


@pytest.mark.parametrize("damage", [b"", b"{", b'{"id": "x1"}', b"\xff"])
def test_a_damaged_job_keeps_no_other_from_being_there(make_snapshot: Make, tmp_path: Path, damage: bytes) -> None:
    folder = tmp_path / "sessions"
    with jobs_of(folder, make_snapshot(2)) as jobs:
        sound, damaged = (jobs.start("s1", format=kind, options=PLAIN) for kind in ("yolo", "voc"))
        jobs.wait(damaged.id, timeout=60)
    (folder / ".exports" / damaged.id / "job.json").write_bytes(damage)
    with jobs_of(folder) as jobs:
        assert [job.id for job in jobs.list()] == [sound.id]


def test_a_job_that_cannot_be_kept_is_not_made(make_snapshot: Make, tmp_path: Path) -> None:
    (tmp_path / "sessions").mkdir()
    (tmp_path / "sessions" / ".exports").write_text("in the way")
    with jobs_of(tmp_path / "sessions", make_snapshot(2)) as jobs:
        with pytest.raises(StoreError, match="the export cannot be kept"):
            jobs.start("s1", format="yolo", options=PLAIN)
        assert jobs.list() == []


def test_a_job_of_a_program_that_kept_no_sizes_is_there(make_snapshot: Make, tmp_path: Path) -> None:
    folder = tmp_path / "sessions"
    with jobs_of(folder, make_snapshot(2)) as jobs:
        job = jobs.wait(jobs.start("s1", format="yolo", options=PLAIN).id, timeout=60)
    path = folder / ".exports" / job.id / "job.json"
    kept = json.loads(path.read_bytes())
    del kept["ended"], kept["bytes"]
    path.write_text(json.dumps(kept))
    with jobs_of(folder) as jobs:
        assert jobs.get(job.id) == replace(job, ended=None, bytes=None)


def test_an_export_that_has_ended_can_be_deleted(make_snapshot: Make, tmp_path: Path) -> None:
    folder = tmp_path / "sessions"
    with jobs_of(folder, make_snapshot(4)) as jobs:
        job, other = (jobs.start("s1", format=kind, options=PLAIN) for kind in ("yolo", "coco"))
        jobs.wait(other.id, timeout=60)
        jobs.delete(job.id)
        assert [job.id for job in jobs.list()] == [other.id]
        assert [path.name for path in (folder / ".exports").iterdir()] == [other.id]
        for gone in (job.id, "x0"):
            with pytest.raises(NotFound, match=gone):
                jobs.delete(gone)
    with jobs_of(folder) as jobs:
        assert [job.id for job in jobs.list()] == [other.id]


def test_an_export_that_runs_or_waits_is_deleted_once_it_is_cancelled(make_snapshot: Make, tmp_path: Path) -> None:
    gate = Gate()
    folder = tmp_path / "sessions"
    with jobs_of(folder, make_snapshot(4), factory=gate) as jobs:
        running, waiting = (jobs.start("s1", format="yolo", options=PLAIN) for _ in range(2))
        assert gate.reached.wait(30)
        for job in (running, waiting):
            with pytest.raises(Conflict, match="cancel it before"):
                jobs.delete(job.id)
            assert jobs.cancel(job.id).ended is not None
        jobs.delete(waiting.id)
        opening = threading.Timer(0.2, gate.open.set)
        opening.start()
        jobs.delete(running.id)
        opening.join()
        assert jobs.list() == []
        assert list((folder / ".exports").iterdir()) == []
        # What comes after them is not held up.
        again = jobs.start("s1", format="yolo", options=PLAIN)
        assert jobs.wait(again.id, timeout=60).state == "done"


def test_what_a_killed_server_left_of_a_deletion_is_removed(make_snapshot: Make, tmp_path: Path) -> None:
    folder = tmp_path / "sessions"
    with jobs_of(folder, make_snapshot(2)) as jobs:
        job = jobs.wait(jobs.start("s1", format="yolo", options=PLAIN).id, timeout=60)
    (folder / ".exports" / job.id).rename(folder / ".exports" / f"{job.id}.deleted")
    with jobs_of(folder) as jobs:
        assert jobs.list() == []
    assert list((folder / ".exports").iterdir()) == []


def test_a_forecast_is_of_the_session_as_it_is_and_writes_nothing(make_snapshot: Make, tmp_path: Path) -> None:
    folder = tmp_path / "sessions"
    with jobs_of(folder, make_snapshot(4), make_snapshot(3, sid="s2")) as jobs:
        merged = ExportOptions(sessions=("s2",))
        found = jobs.forecast("s1", format="coco", options=merged)
        assert (found.frames, [used.id for used in found.sessions]) == (7, ["s1", "s2"])
        assert not (folder / ".exports").exists()
        report = jobs.wait(jobs.start("s1", format="coco", options=merged).id, timeout=60).report
        assert found.model_dump(mode="json")["splits"] == report["splits"]
        assert found.dropped == report["dropped"]
        with pytest.raises(NotFound, match="s9"):
            jobs.forecast("s9", format="yolo", options=PLAIN)
        with pytest.raises(BadInput, match="nope"):
            jobs.forecast("s1", format="nope", options=PLAIN)
        with pytest.raises(Cancelled):
            jobs.forecast("s1", format="yolo", options=PLAIN, cancelled=lambda: True)
        jobs.close()
        with pytest.raises(Cancelled):
            jobs.forecast("s1", format="yolo", options=PLAIN)
