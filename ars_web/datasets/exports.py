"""Export jobs that survive the server: what was asked for, how far it is, and what became of it.

A job is a folder `<sessions>/.exports/<job id>/` with `job.json`, replaced whole at every change of state, and, once
done, the dataset in `dataset/`. Jobs run one after the other, each with all workers.
"""

import json
import logging
import os
import secrets
import shutil
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor, wait
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

from pydantic import TypeAdapter, ValidationError

from ars_web.datasets.assembly import DOCUMENT
from ars_web.datasets.cluster import Cluster
from ars_web.datasets.forecast import Forecast, forecast
from ars_web.datasets.jobs import partial_folder, run_export
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.plan import check_merged, plan_export
from ars_web.datasets.plan_files import read_digest, read_plan
from ars_web.datasets.planned import ExportPlan
from ars_web.datasets.registry import writer_of
from ars_web.datasets.shapes import check_shape
from ars_web.errors import ArsError, BadInput, Cancelled, Conflict, NotFound, StoreError
from ars_web.recordings.recording import StoredImage
from ars_web.sessions.model import SessionSnapshot

_log = logging.getLogger(__name__)

State = Literal["queued", "running", "done", "failed", "cancelled"]


@dataclass(frozen=True)
class ExportJob:
    """An export that was asked for.

    Attributes:
        session_id: the first session; those merged with it are in the options.
        done, total: frames; total is 0 until the export is planned.
        error: one clear line, of a failed job.
        report: what `dataset.json` says, of a done job.
        key: the Idempotency-Key it was asked for with.
        created, ended: UTC; ended is None until the job is done, failed or cancelled.
        bytes: of all files of a done job's dataset, linked images included.
    """

    id: str
    session_id: str
    format: str
    options: ExportOptions
    state: State
    done: int
    total: int
    error: str | None
    report: dict[str, Any] | None
    key: str | None
    created: datetime
    # Jobs from before these were kept do not say.
    ended: datetime | None = None
    bytes: int | None = None


_JSON = TypeAdapter(ExportJob)


_DELETED = ".deleted"
"""What follows a deleted job's id in the name of its folder, until that is gone."""

_STOPPING_SECONDS = 5.0
"""How long the deletion of a job waits for workers that were told to stop."""


class _Closing(Exception):
    """The server is going down: stop, but keep what is done."""


class ExportJobs:
    """All export jobs of a sessions folder."""

    def __init__(
        self,
        folder: Path,
        snapshot_of: Callable[[str], SessionSnapshot],
        *,
        executor_factory: Callable[[], Executor] | None = None,
        workers: int | None = None,
        cluster: Cluster | None = None,
    ) -> None:
        """`folder` is the sessions folder; `snapshot_of` raises NotFound for an unknown session id."""
        self._folder = folder / ".exports"
        self._snapshot_of = snapshot_of
        self._executor_factory = executor_factory
        self._workers = workers
        self._cluster = cluster
        self._lock = threading.Lock()
        self._closing = threading.Event()
        self._runner = ThreadPoolExecutor(max_workers=1, thread_name_prefix="export")
        self._futures: dict[str, Future[None]] = {}
        self._jobs: dict[str, ExportJob] = {}
        for remains in self._folder.glob(f"*{_DELETED}"):
            shutil.rmtree(remains, ignore_errors=True)
        for path in sorted(self._folder.glob("*/job.json")):
            try:
                job = _JSON.validate_json(path.read_bytes())
            except (OSError, ValidationError) as error:
                # One job that cannot be read must not keep the server from starting.
                _log.warning("%s is left out of the exports: %s", path, error)
                continue
            self._jobs[job.id] = job

    def start(
        self,
        sid: str,
        *,
        format: str,  # noqa: A002 - the contract's name
        options: ExportOptions,
        key: str | None = None,
    ) -> ExportJob:
        """Ask for an export of a session as it is now; the job, queued.

        A repeat with the same `key` answers the job that the first made, whatever became of its sessions since.

        Raises:
            NotFound: the session, or one merged with it, is not there.
            BadInput: the format or an option cannot be, or `key` was used for another export.
            StoreError: the job cannot be kept.
        """
        writer_of(format)
        with self._lock:
            before = self._made_with(key, sid, format, options)
        if before is not None:
            return before
        snapshots = self._snapshots(sid, options)
        check_shape(options.shape, snapshots)
        job = ExportJob(
            id=f"x{secrets.token_hex(6)}",
            session_id=sid,
            format=format,
            options=options,
            state="queued",
            done=0,
            total=0,
            error=None,
            report=None,
            key=key,
            created=datetime.now(UTC),
        )
        with self._lock:
            before = self._made_with(key, sid, format, options)
            if before is not None:
                return before
            self._keep(job)
            self._jobs[job.id] = job
            self._futures[job.id] = self._runner.submit(self._run, job.id, snapshots)
        return job

    def _made_with(self, key: str | None, sid: str, kind: str, options: ExportOptions) -> ExportJob | None:
        """The job that `key` made; None where it made none. The caller holds the lock."""
        first = next((job for job in self._jobs.values() if key is not None and job.key == key), None)
        if first is not None and (first.session_id, first.format, first.options) != (sid, kind, options):
            raise BadInput(f"Idempotency-Key {key!r} was used for another export; use a new one")
        return first

    def get(self, job_id: str) -> ExportJob:
        """The job as it is now; NotFound."""
        with self._lock:
            if job_id not in self._jobs:
                raise NotFound(f"there is no export {job_id!r}")
            return self._jobs[job_id]

    def list(self, sid: str | None = None) -> list[ExportJob]:
        """All jobs, or a session's, the newest first."""
        with self._lock:
            jobs = [job for job in self._jobs.values() if sid in (None, job.session_id)]
        return sorted(jobs, key=lambda job: (job.created, job.id), reverse=True)

    def cancel(self, job_id: str) -> ExportJob:
        """Stop a job; it is cancelled at once, its workers stop and its data goes soon after. A job that has ended
        stays as it is."""
        with self._lock:
            if job_id not in self._jobs:
                raise NotFound(f"there is no export {job_id!r}")
            job = self._jobs[job_id]
            if job.state in ("queued", "running"):
                job = replace(job, state="cancelled", ended=datetime.now(UTC))
                self._jobs[job_id] = job
                self._keep(job)
            return job

    def delete(self, job_id: str) -> None:
        """Remove a job that has ended, and its dataset.

        Raises:
            NotFound: there is no such job, or no more.
            Conflict: it is queued or running, or its workers do not stop.
            StoreError: its folder cannot be removed.
        """
        job = self.get(job_id)
        if job.state in ("queued", "running"):
            raise Conflict(f"export {job_id} is {job.state}; cancel it before it can be deleted")
        future = self._futures.get(job_id)
        # One that was cancelled while it waited has no work to stop; another may need a moment.
        if future is not None and not future.cancel() and not wait([future], timeout=_STOPPING_SECONDS).done:
            raise Conflict(f"export {job_id} is still being stopped; try again in a moment")
        folder = self._folder / job_id
        remains = folder.with_name(f"{job_id}{_DELETED}")
        with self._lock:
            if self._jobs.pop(job_id, None) is None:
                raise NotFound(f"there is no export {job_id!r}")
            self._futures.pop(job_id, None)
            try:
                # Gone by one step: a server that ends meanwhile leaves no half job, and the next one tidies up.
                folder.rename(remains)
            except OSError as error:
                self._jobs[job_id] = job
                raise StoreError(f"{folder}: the export cannot be deleted: {error.strerror}") from error
        try:
            shutil.rmtree(remains)
        except OSError as error:
            raise StoreError(f"{error.filename or remains}: cannot be deleted: {error.strerror}") from error

    def forecast(
        self,
        sid: str,
        *,
        format: str,  # noqa: A002 - the contract's name
        options: ExportOptions,
        cancelled: Callable[[], bool] | None = None,
    ) -> Forecast:
        """What an export would write of a session as it is now; raises as `start` does, and as the job would.

        Raises:
            Cancelled: `cancelled`, asked a few times a second, answered yes, or the server is going down.
        """
        plan = plan_export(self._snapshots(sid, options), format=format, options=options, out=self._folder / "forecast")
        return forecast(plan, cancelled=lambda: self._closing.is_set() or (cancelled is not None and cancelled()))

    def resume_unfinished(self) -> None:
        """Go on with the jobs that a server left queued or running when it ended."""
        with self._lock:
            waiting = [job for job in self._jobs.values() if job.state in ("queued", "running")]
        for job in sorted(waiting, key=lambda job: (job.created, job.id)):
            if job.id not in self._futures:
                self._futures[job.id] = self._runner.submit(self._run, job.id, None)

    def dataset_folder(self, job_id: str) -> Path:
        """Where a done job's dataset is; NotFound where there is none."""
        job = self.get(job_id)
        if job.state != "done":
            raise NotFound(f"export {job_id} has no dataset: it is {job.state}")
        return self._out(job_id)

    def wait(self, job_id: str, *, timeout: float | None = None) -> ExportJob:
        """The job once its work has ended, or TimeoutError."""
        future = self._futures.get(job_id)
        if future is not None:
            future.result(timeout)
        return self.get(job_id)

    def close(self) -> None:
        """Stop; unfinished jobs keep what is done and go on with `resume_unfinished` of the next server."""
        self._closing.set()
        self._runner.shutdown(wait=True, cancel_futures=True)

    def _run(self, job_id: str, snapshots: Sequence[SessionSnapshot] | None) -> None:
        """The whole life of a job, in the runner's thread."""
        if self._closing.is_set() or not self._change(job_id, state="running"):
            return
        try:
            report = self._finished_report(job_id)
            if report is None:
                plan = self._plan(self.get(job_id), snapshots)
                run_export(
                    plan,
                    executor_factory=self._executor_factory,
                    workers=self._workers,
                    cluster=self._cluster,
                    on_progress=lambda done, total: self._progress(job_id, done, total),
                    cancelled=lambda: self._stopped(job_id),
                )
                report = self._finished_report(job_id)
            self._change(job_id, state="done", report=report, bytes=_bytes_below(self._out(job_id)))
        except _Closing:
            return
        except Cancelled:
            pass
        except ArsError as error:
            self._change(job_id, state="failed", error=str(error))
        except BaseException:
            # A fault of this program: its trace goes on to whoever waits, and the job does not run for ever.
            self._change(job_id, state="failed", error="the export ended by a fault in the program; see its log")
            _log.exception("export %s", job_id)
            raise
        if self.get(job_id).state != "done":
            self._remove_dataset(job_id)

    def _plan(self, job: ExportJob, snapshots: Sequence[SessionSnapshot] | None) -> ExportPlan:
        """The plan: the one that a killed server left, else one of the sessions as they are."""
        out = self._out(job.id)
        partial = partial_folder(out)
        if snapshots is None and read_digest(partial) is not None:
            return read_plan(partial, out=out)
        return plan_export(
            snapshots or self._snapshots(job.session_id, job.options), format=job.format, options=job.options, out=out
        )

    def _snapshots(self, sid: str, options: ExportOptions) -> Sequence[SessionSnapshot]:
        snapshots = [self._snapshot_of(i) for i in (sid, *options.sessions)]
        check_merged(snapshots)
        if options.images != "none":
            _refuse_stored(snapshots)
        return snapshots

    def _finished_report(self, job_id: str) -> dict[str, Any] | None:
        """The dataset's own report, once it is published."""
        path = self._out(job_id) / DOCUMENT
        return json.loads(path.read_bytes()) if path.is_file() else None

    def _stopped(self, job_id: str) -> bool:
        if self._closing.is_set():
            raise _Closing
        return self.get(job_id).state == "cancelled"

    def _progress(self, job_id: str, done: int, total: int) -> None:
        with self._lock:
            self._jobs[job_id] = replace(self._jobs[job_id], done=done, total=total)

    def _change(self, job_id: str, **changes: Any) -> bool:
        """Change and keep a job, unless it was cancelled meanwhile."""
        with self._lock:
            job = self._jobs[job_id]
            if job.state == "cancelled":
                return False
            if changes["state"] != "running":
                changes["ended"] = datetime.now(UTC)
            if changes["state"] == "done":
                changes["done"] = changes["total"] = sum(s["images"] for s in changes["report"]["splits"].values())
            # In memory first: a full disk must not hide that the job failed.
            self._jobs[job_id] = replace(job, **changes)
            self._keep(self._jobs[job_id])
            return True

    def _keep(self, job: ExportJob) -> None:
        """Put a job on the disk, whole; StoreError where that cannot be. The caller holds the lock."""
        folder = self._folder / job.id
        try:
            folder.mkdir(parents=True, exist_ok=True)
            beside = folder / "job.json.new"
            with beside.open("wb") as file:
                file.write(_JSON.dump_json(job))
                file.flush()
                os.fsync(file.fileno())
            beside.replace(folder / "job.json")
        except OSError as error:
            raise StoreError(f"{error.filename or folder}: the export cannot be kept: {error.strerror}") from error

    def _out(self, job_id: str) -> Path:
        return self._folder / job_id / "dataset"

    def _remove_dataset(self, job_id: str) -> None:
        """Remove what a failed job left, and what was published in the moment of a cancellation."""
        for folder in (self._out(job_id), partial_folder(self._out(job_id))):
            with suppress(FileNotFoundError):
                shutil.rmtree(folder)


def _refuse_stored(snapshots: Sequence[SessionSnapshot]) -> None:
    """Raises BadInput where images lie on a store: a server fetches nothing from anywhere."""
    for snapshot in snapshots:
        stored = next((image for image in snapshot.frames.images if isinstance(image, StoredImage)), None)
        if stored is not None:
            raise BadInput(
                f"the images of session {snapshot.id} lie on a store ({stored}), from which a server does not read:"
                " export it with the command line's `ars-web export`, or here with `images` `none`"
            )


def _bytes_below(folder: Path) -> int:
    """The bytes of all files below a folder."""
    total = 0
    with os.scandir(folder) as entries:
        for entry in entries:
            total += _bytes_below(Path(entry)) if entry.is_dir() else entry.stat().st_size
    return total
