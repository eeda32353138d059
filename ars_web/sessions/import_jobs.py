"""Imports that take their time: read, checked and stored by threads, so that a page can show how far they are.

Jobs are in memory alone. What a job makes appears whole or not at all, as with every import, so a server that is
killed loses the job and leaves nothing of it.
"""

import logging
import secrets
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

from ars_web.errors import ArsError, BadInput, Cancelled, NotFound
from ars_web.recordings.options import ReadOptions
from ars_web.recordings.registry import read_recording
from ars_web.sessions.names import checked_key, checked_name
from ars_web.sessions.store import SessionStore
from ars_web.sessions.uploads import Upload, Uploads, as_uploaded

_log = logging.getLogger(__name__)

AT_ONCE = 2
"""Imports that run side by side; more would wait for the same disk."""

REMEMBERED = 200
"""Jobs that are told about after they have ended."""

State = Literal["queued", "running", "done", "failed", "cancelled"]
Phase = Literal["reading", "checking images", "storing"]


@dataclass(frozen=True)
class ImportOrder:
    """What is to be imported.

    Attributes:
        path: the recording, a file or a folder.
        options: what is known of it; its `within` is what the words of errors are told from.
        upload: that it lies in, where it was sent: its images are then copied, and it goes when all is done.
    """

    path: Path
    name: str
    format: str = "auto"
    classes: tuple[str, ...] = ()
    options: ReadOptions = field(default_factory=ReadOptions)
    upload: Upload | None = None


@dataclass(frozen=True)
class ImportJob:
    """An import that was asked for.

    Attributes:
        name: the session's.
        phase: what a running job is at; of an ended one, what it was at last.
        done, total: images in this phase; total is 0 until that is known.
        error: one clear line, of a failed job.
        session_id: of a done job.
        skipped: frames that the recording lists and that were left out, of a done job.
        created: UTC.
    """

    id: str
    name: str
    state: State
    phase: Phase
    done: int
    total: int
    error: str | None
    session_id: str | None
    skipped: int
    created: datetime


class ImportJobs:
    """All imports of one server."""

    def __init__(self, store: SessionStore, uploads: Uploads) -> None:
        self._store = store
        self._uploads = uploads
        self._lock = threading.Lock()
        self._closing = threading.Event()
        self._runner = ThreadPoolExecutor(max_workers=AT_ONCE, thread_name_prefix="import")
        self._jobs: dict[str, ImportJob] = {}
        self._futures: dict[str, Future[None]] = {}
        self._keys: dict[str, tuple[ImportOrder, str]] = {}
        # Jobs whose session is about to appear: too late to cancel.
        self._settled: set[str] = set()

    def start(self, order: ImportOrder, *, key: str | None = None) -> ImportJob:
        """Ask for an import; the job, queued. A repeat with the same `key` answers the job that the first made.

        Raises:
            BadInput: the session's name or a class's cannot be, or `key` was used for another import.
        """
        checked_name(order.name, what="a session")
        for name in order.classes:
            checked_name(name, what="a class")
        job = ImportJob(
            id=f"i{secrets.token_hex(6)}",
            name=order.name,
            state="queued",
            phase="reading",
            done=0,
            total=0,
            error=None,
            session_id=None,
            skipped=0,
            created=datetime.now(UTC),
        )
        with self._lock:
            if key is not None and checked_key(key) in self._keys:
                first, id_ = self._keys[key]
                if first != order:
                    raise BadInput(f"Idempotency-Key {key!r} was used for another import; use a new one")
                return self._jobs[id_]
            self._forget_oldest()
            self._jobs[job.id] = job
            if key is not None:
                self._keys[key] = (order, job.id)
            self._futures[job.id] = self._runner.submit(self._run, job.id, order, key)
        return job

    def get(self, job_id: str) -> ImportJob:
        """The job as it is now.

        Raises:
            NotFound: there is none; the server's end forgets all.
        """
        with self._lock:
            return self._known(job_id)

    def list(self) -> list[ImportJob]:
        """All jobs, the newest first."""
        with self._lock:
            return list(reversed(self._jobs.values()))

    def cancel(self, job_id: str) -> ImportJob:
        """Stop a job: cancelled at once, its work ends soon after and leaves nothing. One that has ended, or whose
        session is about to appear, stays as it is.

        Raises:
            NotFound: there is none.
        """
        with self._lock:
            job = self._known(job_id)
            if job.state in ("queued", "running") and job_id not in self._settled:
                job = self._jobs[job_id] = replace(job, state="cancelled")
            return job

    def wait(self, job_id: str, *, timeout: float | None = None) -> ImportJob:
        """The job once its work has ended, or TimeoutError."""
        self._futures[job_id].result(timeout)
        return self.get(job_id)

    def close(self) -> None:
        """Stop all jobs, and wait until they have cleared up."""
        self._closing.set()
        self._runner.shutdown(wait=True, cancel_futures=True)

    def _known(self, job_id: str) -> ImportJob:
        if job_id not in self._jobs:
            raise NotFound(
                f"there is no import {job_id[:40]!r} any more: the server was started again since; the list of sessions"
                " shows whether it was done, else import again"
            )
        return self._jobs[job_id]

    def _forget_oldest(self) -> None:
        ended = [job.id for job in self._jobs.values() if job.state not in ("queued", "running")]
        for id_ in ended[: max(0, len(self._jobs) - REMEMBERED + 1)]:
            del self._jobs[id_], self._futures[id_]
            self._settled.discard(id_)
            self._keys = {key: made for key, made in self._keys.items() if made[1] != id_}

    def _run(self, job_id: str, order: ImportOrder, key: str | None) -> None:
        """The whole life of a job, in one of the runner's threads."""
        try:
            self._change(job_id, state="running")
            self._make(job_id, order, key)
        except Cancelled:
            self._change_unless_cancelled(job_id, state="cancelled")
        except ArsError as error:
            self._change_unless_cancelled(job_id, state="failed", error=order.options.told(str(error)))
        except BaseException:
            # A fault of this program: its trace goes on to whoever waits, and the job does not run for ever.
            fault = "the import ended by a fault in the program; see its log"
            self._change_unless_cancelled(job_id, state="failed", error=fault)
            _log.exception("import %s", job_id)
            raise

    def _make(self, job_id: str, order: ImportOrder, key: str | None) -> None:
        checking = replace(order.options, progress=self._watch(job_id, "checking images"))
        recording = read_recording(order.path, format=order.format, options=checking)
        if order.upload is not None:
            recording = as_uploaded(recording, unpacked=order.upload.folder, file_name=order.upload.file_name)
        self._change(job_id, phase="storing", done=0, total=len(recording.frames))
        made = self._store.create(
            recording,
            name=order.name,
            class_names=order.classes,
            copy_images=order.upload is not None,
            key=key,
            progress=self._watch(job_id, "storing"),
        )
        with self._lock:
            # A session of an earlier server, by its key, is there without any progress: done, whoever cancels.
            ended = replace(self._jobs[job_id], state="done", session_id=made.id, skipped=made.skipped)
            self._jobs[job_id] = replace(ended, done=made.frames, total=made.frames)
        if order.upload is not None:
            self._uploads.discard(order.upload.id)

    def _watch(self, job_id: str, phase: Phase) -> Callable[[int, int], None]:
        def advance(done: int, total: int) -> None:
            self._change(job_id, settled=phase == "storing" and done == total, phase=phase, done=done, total=total)

        return advance

    def _change(self, job_id: str, *, settled: bool = False, **changes: Any) -> None:
        """Change a job, or raise Cancelled where it is not to go on."""
        with self._lock:
            if self._closing.is_set() or self._jobs[job_id].state == "cancelled":
                raise Cancelled("the import was cancelled")
            self._jobs[job_id] = replace(self._jobs[job_id], **changes)
            if settled:
                self._settled.add(job_id)

    def _change_unless_cancelled(self, job_id: str, **changes: Any) -> None:
        with self._lock:
            if self._jobs[job_id].state != "cancelled":
                self._jobs[job_id] = replace(self._jobs[job_id], **changes)
