"""Imports by threads: how far they are, and that nothing is left of one that does not end well."""

import shutil
import threading
import zipfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from ars_web.errors import BadInput, NotFound
from ars_web.recordings.options import ReadOptions
from ars_web.sessions import import_jobs
from ars_web.sessions.import_jobs import AT_ONCE, ImportJob, ImportJobs, ImportOrder
from ars_web.sessions.jobs import Jobs
from ars_web.sessions.store import SessionStore
from ars_web.sessions.uploads import UPLOADS, Upload, Uploads

FRAMES = 9
SECONDS = 60.0


@pytest.fixture
def uploads(store: SessionStore) -> Uploads:
    return Uploads(store.folder)


@pytest.fixture
def jobs(store: SessionStore, uploads: Uploads) -> Iterator[ImportJobs]:
    jobs = ImportJobs(store, uploads)
    yield jobs
    jobs.close()


@pytest.fixture
def scene(demo_recording) -> Path:
    return demo_recording.folder


def order(scene: Path, **changes: object) -> ImportOrder:
    return replace(ImportOrder(scene, "desk", options=ReadOptions(within=scene.parent)), **changes)


def sent(uploads: Uploads, scene: Path, *, without: str = "nothing") -> Upload:
    with uploads.receiving() as folder:
        with zipfile.ZipFile(folder / "upload.zip", "w") as archive:
            for path in sorted(scene.rglob("*")):
                if path.is_file() and path.name != without:
                    archive.write(path, f"desk/{path.relative_to(scene)}")
        return uploads.keep(folder / "upload.zip", file_name="desk.zip")


def of_upload(upload: Upload) -> ImportOrder:
    return ImportOrder(upload.recording, "desk", options=ReadOptions(within=upload.folder), upload=upload)


def remains(store: SessionStore) -> list[Path]:
    """What lies in the sessions folder, uploads and locks apart."""
    kept = (UPLOADS, ".building")
    building = [path for path in (store.folder / ".building").glob("*") if path.name != "lock"]
    return building + [path for path in store.folder.glob("*") if path.name not in kept]


class Gate:
    """Holds imports at the first step of a phase, until it is opened."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, *, at: str) -> None:
        self.reached = threading.Semaphore(0)
        self.opened = threading.Event()
        change = Jobs.change

        def hold(jobs: Jobs[ImportJob], job_id: str, **changes: object) -> None:
            change(jobs, job_id, **changes)
            if changes.get("phase") == at and changes.get("done") == 1:
                self.reached.release()
                assert self.opened.wait(SECONDS)

        monkeypatch.setattr(Jobs, "change", hold)

    def wait(self) -> None:
        assert self.reached.acquire(timeout=SECONDS)


def test_a_recording_becomes_a_session(jobs: ImportJobs, store: SessionStore, scene: Path) -> None:
    asked = jobs.start(order(scene, classes=("cube", "ball")))
    assert (asked.name, asked.done, asked.error, asked.session_id) == ("desk", 0, None, None)
    job = jobs.wait(asked.id, timeout=SECONDS)
    assert (job.state, job.phase, job.done, job.total) == ("done", "storing", FRAMES, FRAMES)
    made = store.summary(job.session_id or "")
    assert (made.name, made.frames, made.classes, made.source) == ("desk", FRAMES, 2, str(scene))
    assert jobs.list() == [job]


def test_a_job_tells_how_far_it_is(jobs: ImportJobs, scene: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    gate = Gate(monkeypatch, at="checking images")
    job_id = jobs.start(order(scene)).id
    gate.wait()
    job = jobs.get(job_id)
    assert (job.state, job.phase, job.done, job.total) == ("running", "checking images", 1, FRAMES)
    gate.opened.set()
    assert jobs.wait(job_id, timeout=SECONDS).state == "done"


@pytest.mark.parametrize("phase", ["checking images", "storing"])
def test_a_cancelled_import_leaves_nothing(
    jobs: ImportJobs, uploads: Uploads, store: SessionStore, scene: Path, monkeypatch: pytest.MonkeyPatch, phase: str
) -> None:
    gate = Gate(monkeypatch, at=phase)
    upload = sent(uploads, scene)
    job_id = jobs.start(of_upload(upload)).id
    gate.wait()
    assert jobs.cancel(job_id).state == "cancelled"
    gate.opened.set()
    job = jobs.wait(job_id, timeout=SECONDS)
    assert (job.state, job.error, job.session_id) == ("cancelled", None, None)
    assert store.list() == []
    assert remains(store) == []
    assert jobs.cancel(job_id) == job
    # It can be tried again.
    again = jobs.start(of_upload(uploads.get(upload.id)))
    assert jobs.wait(again.id, timeout=SECONDS).state == "done"


def test_what_is_about_to_appear_is_not_cancelled(
    jobs: ImportJobs, store: SessionStore, scene: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Cancelled must mean that there is no session."""
    change = Jobs.change
    answers: list[ImportJob] = []

    def cancel_at_the_end(self: Jobs[ImportJob], job_id: str, **changes: object) -> None:
        change(self, job_id, **changes)
        if changes.get("settled"):
            answers.append(self.cancel(job_id))

    monkeypatch.setattr(Jobs, "change", cancel_at_the_end)
    job = jobs.wait(jobs.start(order(scene)).id, timeout=SECONDS)
    assert [answer.state for answer in answers] == ["running"]
    assert job.state == "done"
    assert [summary.id for summary in store.list()] == [job.session_id]


def test_only_two_run_at_once_and_one_that_waits_is_cancelled_too(
    jobs: ImportJobs, store: SessionStore, scene: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    gate = Gate(monkeypatch, at="checking images")
    first = [jobs.start(order(scene, name=f"{i}")).id for i in range(AT_ONCE)]
    waiting = [jobs.start(order(scene, name=f"waiting {i}")).id for i in range(2)]
    for _ in first:
        gate.wait()
    assert [jobs.get(id_).state for id_ in (*first, *waiting)] == ["running", "running", "queued", "queued"]
    assert jobs.cancel(waiting[0]).state == "cancelled"
    gate.opened.set()
    assert [jobs.wait(id_, timeout=SECONDS).state for id_ in (*first, *waiting)] == [
        "done",
        "done",
        "cancelled",
        "done",
    ]
    assert sorted(summary.name for summary in store.list()) == ["0", "1", "waiting 1"]


def test_a_failed_import_says_why_and_leaves_nothing(
    jobs: ImportJobs, store: SessionStore, scene: Path, tmp_path: Path
) -> None:
    damaged = Path(shutil.copytree(scene, tmp_path / "scenes" / "damaged"))
    (damaged / "robot_poses.txt").write_text("0 0 0 0 0 0 1\nnot a pose\n")
    job = jobs.wait(jobs.start(order(damaged)).id, timeout=SECONDS)
    assert (job.state, job.session_id) == ("failed", None)
    # File and line, and not where the root lies.
    assert (job.error or "").startswith("damaged/robot_poses.txt:2: ")
    assert store.list() == []
    assert remains(store) == []


def test_an_upload_is_imported_with_its_images_and_goes(
    jobs: ImportJobs, uploads: Uploads, store: SessionStore, scene: Path
) -> None:
    upload = sent(uploads, scene)
    job = jobs.wait(jobs.start(of_upload(upload)).id, timeout=SECONDS)
    sid = job.session_id or ""
    assert store.summary(sid).source == "desk.zip"
    assert list((store.folder / UPLOADS).iterdir()) == []
    images = store.frames(sid).images
    assert all(image.is_relative_to(store.folder / sid) for image in images)
    assert images[3].read_bytes() == (scene / "images" / images[3].name).read_bytes()


def test_an_upload_stays_where_its_import_fails(
    jobs: ImportJobs, uploads: Uploads, store: SessionStore, scene: Path
) -> None:
    upload = sent(uploads, scene, without="camera_intrinsics.txt")
    job = jobs.wait(jobs.start(of_upload(upload)).id, timeout=SECONDS)
    assert job.error == "desk/camera_intrinsics.txt: is missing"
    assert uploads.get(upload.id) == upload
    assert remains(store) == []


def test_a_repeat_with_the_same_key_is_the_same_job(jobs: ImportJobs, store: SessionStore, scene: Path) -> None:
    first, again = (jobs.start(order(scene), key="import 1") for _ in range(2))
    assert first.id == again.id
    done = jobs.wait(first.id, timeout=SECONDS)
    assert jobs.start(order(scene), key="import 1") == done
    with pytest.raises(BadInput, match="something else"):
        jobs.start(order(scene, name="other"), key="import 1")
    assert len(store.list()) == 1


def test_a_repeat_at_the_next_server_makes_no_second_session(
    store: SessionStore, uploads: Uploads, scene: Path
) -> None:
    made = set()
    for _ in range(2):
        jobs = ImportJobs(store, uploads)
        made.add(jobs.wait(jobs.start(order(scene), key="import 1").id, timeout=SECONDS).session_id)
        jobs.close()
    assert made == {summary.id for summary in store.list()}
    assert len(made) == 1


@pytest.mark.parametrize("changes", [{"name": ""}, {"name": "n" * 101}, {"classes": ("cube", " ")}])
def test_what_can_never_be_is_refused_at_once(jobs: ImportJobs, scene: Path, changes: dict[str, object]) -> None:
    with pytest.raises(BadInput):
        jobs.start(order(scene, **changes))
    assert jobs.list() == []


def test_an_unknown_job_is_said_so_in_words(jobs: ImportJobs) -> None:
    for ask in (jobs.get, jobs.cancel):
        with pytest.raises(NotFound, match="was started again since"):
            ask("inothing")


def test_a_server_that_ends_stops_its_imports(
    store: SessionStore, uploads: Uploads, scene: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    gate = Gate(monkeypatch, at="checking images")
    jobs = ImportJobs(store, uploads)
    running = jobs.start(order(scene)).id
    gate.wait()
    closing = threading.Thread(target=jobs.close)
    closing.start()
    assert jobs._jobs._closing.wait(SECONDS)
    gate.opened.set()
    closing.join(SECONDS)
    assert not closing.is_alive()
    assert jobs.get(running).state == "cancelled"
    assert store.list() == []
    assert remains(store) == []


def test_a_fault_of_the_program_ends_the_job(
    jobs: ImportJobs, scene: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def fault(*_: object, **__: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(import_jobs, "read_recording", fault)
    job_id = jobs.start(order(scene)).id
    with pytest.raises(ZeroDivisionError):
        jobs.wait(job_id, timeout=SECONDS)
    job = jobs.get(job_id)
    assert (job.state, job.error) == ("failed", "the import ended by a fault in the program; see its log")
    assert "ZeroDivisionError" in caplog.text


def test_old_jobs_are_forgotten(jobs: ImportJobs, scene: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ars_web.sessions.jobs.REMEMBERED", 3)
    ids = []
    for i in range(5):
        ids.append(jobs.start(order(scene / "nothing", name=f"{i}"), key=f"{i}").id)
        jobs.wait(ids[-1], timeout=SECONDS)
    assert [job.id for job in jobs.list()] == ids[:1:-1]
    assert jobs.start(order(scene / "nothing", name="0"), key="0").id not in ids


def test_what_was_sent_is_gone_before_an_import_is_told_to_be_done(
    jobs: ImportJobs, uploads: Uploads, scene: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    states: list[str] = []
    discard = Uploads.discard

    def watched(self: Uploads, id_: str) -> None:
        discard(self, id_)
        states.extend(job.state for job in jobs.list())

    monkeypatch.setattr(Uploads, "discard", watched)
    job = jobs.wait(jobs.start(of_upload(sent(uploads, scene))).id, timeout=SECONDS)
    assert (job.state, states) == ("done", ["running"])
