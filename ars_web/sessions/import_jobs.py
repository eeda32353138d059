"""Imports that take their time: read, checked and stored by threads, so that a page can show how far they are.

Jobs are in memory alone. What a job makes appears whole or not at all, as with every import, so a server that is
killed loses the job and leaves nothing of it.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Literal

from ars_web.errors import ArsError, NotFound
from ars_web.recordings.options import ReadOptions
from ars_web.recordings.registry import read_recording
from ars_web.sessions.jobs import Job, Jobs, fresh_job_id
from ars_web.sessions.names import checked_name
from ars_web.sessions.store import SessionStore
from ars_web.sessions.uploads import Upload, Uploads, as_uploaded

AT_ONCE = 2
"""Imports that run side by side; more would wait for the same disk."""

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


@dataclass(frozen=True, kw_only=True)
class ImportJob(Job):
    """An import that was asked for; its steps are images in its phase.

    Attributes:
        name: the session's.
        phase: what a running job is at; of an ended one, what it was at last.
        session_id: of a done job.
        skipped: frames that the recording lists and that were left out, of a done job.
        created: UTC.
    """

    name: str
    phase: Phase = "reading"
    session_id: str | None = None
    skipped: int = 0
    created: datetime


class ImportJobs:
    """All imports of one server."""

    def __init__(self, store: SessionStore, uploads: Uploads) -> None:
        self._store = store
        self._uploads = uploads
        self._jobs = Jobs[ImportJob](what="the import", at_once=AT_ONCE)

    def start(self, order: ImportOrder, *, key: str | None = None) -> ImportJob:
        """Ask for an import; the job, queued. A repeat with the same `key` answers the job that the first made.

        Raises:
            BadInput: the session's name or a class's cannot be, or `key` was used for another import.
        """
        checked_name(order.name, what="a session")
        for name in order.classes:
            checked_name(name, what="a class")
        job = ImportJob(id=fresh_job_id("i"), name=order.name, created=datetime.now(UTC))

        def words(error: ArsError) -> str:
            return order.options.told(str(error))

        return self._jobs.start(job, order, lambda id_: self._make(id_, order, key), key=key, words=words)

    def get(self, job_id: str) -> ImportJob:
        """The job as it is now.

        Raises:
            NotFound: there is none; the server's end forgets all.
        """
        job = self._jobs.get(job_id)
        if job is None:
            raise NotFound(
                f"there is no import {job_id[:40]!r} any more: the server was started again since; the list of sessions"
                " shows whether it was done, else import again"
            )
        return job

    def list(self) -> list[ImportJob]:
        """All jobs, the newest first."""
        return self._jobs.list()

    def cancel(self, job_id: str) -> ImportJob:
        """Stop a job: cancelled at once, its work ends soon after and leaves nothing. One that has ended, or whose
        session is about to appear, stays as it is.

        Raises:
            NotFound: there is none.
        """
        return self._jobs.cancel(self.get(job_id).id)

    def wait(self, job_id: str, *, timeout: float | None = None) -> ImportJob:
        """The job once its work has ended, or TimeoutError."""
        return self._jobs.wait(job_id, timeout=timeout)

    def close(self) -> None:
        """Stop all jobs, and wait until they have cleared up."""
        self._jobs.close()

    def _make(self, job_id: str, order: ImportOrder, key: str | None) -> None:
        checking = replace(order.options, progress=self._watch(job_id, "checking images"))
        recording = read_recording(order.path, format=order.format, options=checking)
        if order.upload is not None:
            recording = as_uploaded(recording, unpacked=order.upload.folder, file_name=order.upload.file_name)
        self._jobs.change(job_id, phase="storing", done=0, total=len(recording.frames))
        made = self._store.create(
            recording,
            name=order.name,
            class_names=order.classes,
            copy_images=order.upload is not None,
            key=key,
            progress=self._watch(job_id, "storing"),
        )
        # Before anybody is told that it is done: who then looks at what was sent finds nothing more of it.
        if order.upload is not None:
            self._uploads.discard(order.upload.id)
        # A session of an earlier server, by its key, is there without any progress: done, whoever cancels.
        self._jobs.finish(job_id, session_id=made.id, skipped=made.skipped, total=made.frames)

    def _watch(self, job_id: str, phase: Phase) -> Callable[[int, int], None]:
        def advance(done: int, total: int) -> None:
            settled = phase == "storing" and done == total
            self._jobs.change(job_id, settled=settled, phase=phase, done=done, total=total)

        return advance
