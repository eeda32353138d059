"""Running a planned export: shards through an executor, resumed from what is missing, published whole or not at all.

Only the standard `concurrent.futures.Executor` interface is used, so any executor whose workers see the partial
folder will do. The partial folder `.NAME.partial` lies beside the dataset's, in the same file system; a lock on it
keeps two exports from sharing it.
"""

import errno
import fcntl
import logging
import os
import shutil
from collections import Counter
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path

from ars_web.datasets.assembly import assemble, finished_shards, is_published, publish
from ars_web.datasets.plan import plan_export, usable_out
from ars_web.datasets.plan_files import digest_of, read_digest, write_plan
from ars_web.datasets.planned import ExportPlan
from ars_web.datasets.report import ExportReport
from ars_web.datasets.worker import CANCEL, begun_folders, export_shard, start_worker
from ars_web.errors import ArsError, BadInput, Cancelled, StoreError

__all__ = ["partial_folder", "plan_export", "run_export"]

_log = logging.getLogger(__name__)

POOL_FROM_SECONDS = 3.0
"""Exports of less work than this run in a thread: a pool of two processes takes a second to start, so that is where
it begins to pay."""

MOST_DEATHS = 3
"""A shard that kills its worker this often is given up."""

_BOOT = "boot"

_LOOK_EVERY = 0.1
"""Seconds between looks whether the caller wants to stop."""


def partial_folder(out: Path) -> Path:
    """Where the work of an export to `out` lies until it is published."""
    return out.parent / f".{out.name}.partial"


def run_export(
    plan: ExportPlan,
    *,
    executor_factory: Callable[[], Executor] | None = None,
    workers: int | None = None,
    on_progress: Callable[[int, int], None] | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> ExportReport:
    """Do a planned export; where a partial folder of the same plan is found, only what is missing in it.

    `executor_factory` makes an executor each time one is needed (None: a thread for a small export, else a pool of
    `workers` processes). `on_progress(done, total)` counts frames. `cancelled` is asked some ten times a second;
    when it answers yes the workers stop, everything written is removed, and Cancelled is raised. An exception out
    of either callback, Ctrl-C included, stops the workers too, but what is written stays and can be resumed.

    Raises:
        BadFile: a source image is missing, damaged or changed; nothing is published and nothing stays.
        BadInput: another export writes to the same folder.
        Cancelled: as asked.
        StoreError: the disk is full or not to be written; what is written stays and can be resumed.
        ArsError: a shard killed its worker MOST_DEATHS times; the message names it.
    """
    usable_out(plan.out)
    partial = partial_folder(plan.out)
    make = executor_factory or (lambda: _default_executor(plan, workers))
    try:
        partial.mkdir(parents=True, exist_ok=True)
        with _locked(partial):
            try:
                _prepare(plan, partial)
                _run_shards(plan, partial, make, on_progress or _no_progress, cancelled or _never)
                report = assemble(plan, partial)
                if cancelled and cancelled():
                    raise Cancelled("the export was cancelled")
                publish(plan, partial)
            except ArsError:
                # Nothing can come of it any more: cancelled, or a fault in the inputs, which would make another plan.
                shutil.rmtree(partial, ignore_errors=True)
                raise
    except OSError as error:
        kept = f"; what is done stays in {partial}, and the same export goes on from there"
        raise StoreError(
            f"{error.filename or partial}: {error.strerror or error}{kept if partial.exists() else ''}"
        ) from error
    return report


@contextmanager
def _locked(partial: Path) -> Generator[None]:
    """Hold the partial folder for this process; the lock goes with the process, however that ends."""
    descriptor = os.open(partial, os.O_RDONLY | os.O_DIRECTORY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if not os.path.samestat(os.fstat(descriptor), partial.stat()):
            raise BlockingIOError
        yield
    except BlockingIOError as error:
        raise BadInput(f"another export is writing to {partial}; wait for it, or choose another folder") from error
    finally:
        os.close(descriptor)


def _prepare(plan: ExportPlan, partial: Path) -> None:
    """Leave in the partial folder this plan and its finished shards, and nothing else."""
    digest, boot = digest_of(plan), _boot()
    of_this_plan = read_digest(partial) == digest and not is_published(partial)
    # A shard's rename can outlive a power cut that its files' bytes did not, and syncing each shard costs more than
    # the rare loss: what was written before this machine started is written again.
    if of_this_plan and (partial / _BOOT).is_file() and (partial / _BOOT).read_text() == boot:
        done = finished_shards(plan, partial)
        _log.info("%s: %d of %d shards are done already", partial, len(done), len(plan.shards))
        return
    if any(partial.iterdir()):
        _log.info("%s holds the beginning of another export, which is discarded", partial)
    for entry in partial.iterdir():
        _remove(entry)
    (partial / "shards").mkdir()
    write_plan(plan, partial)
    (partial / _BOOT).write_text(boot)


def _boot() -> str:
    """What tells one start of this machine from another; the same always where the system does not say."""
    path = Path("/proc/sys/kernel/random/boot_id")
    return path.read_text() if path.is_file() else "unknown"


def _remove(entry: Path) -> None:
    if entry.is_dir() and not entry.is_symlink():
        shutil.rmtree(entry)
    else:
        entry.unlink()


def _default_executor(plan: ExportPlan, workers: int | None) -> Executor:
    if plan.seconds < POOL_FROM_SECONDS or len(plan.shards) == 1:
        return ThreadPoolExecutor(max_workers=1)
    # Spawned, never forked: numba's and OpenCV's threads do not survive a fork.
    return ProcessPoolExecutor(
        max_workers=min(workers or os.cpu_count() or 1, len(plan.shards)),
        mp_context=get_context("spawn"),
        initializer=start_worker,
    )


def _run_shards(
    plan: ExportPlan,
    partial: Path,
    make: Callable[[], Executor],
    on_progress: Callable[[int, int], None],
    cancelled: Callable[[], bool],
) -> None:
    """Run every missing shard; a pool that a killed worker broke is replaced, and the rest goes on.

    A broken pool does not say who broke it. The shards that were begun are suspects and are run one at a time
    from then on, so that the second death tells.
    """
    deaths: Counter[int] = Counter()
    idle_deaths = 0
    while missing := sorted(set(range(len(plan.shards))) - set(finished_shards(plan, partial))):
        for number in missing:
            for folder in begun_folders(partial, number):
                shutil.rmtree(folder, ignore_errors=True)
        (partial / CANCEL).unlink(missing_ok=True)
        batch = [number for number in missing if not deaths[number]] or missing[:1]
        try:
            _run_batch(plan, partial, batch, make, on_progress, cancelled)
        except BrokenExecutor as error:
            begun = [number for number in batch if begun_folders(partial, number)]
            _log.warning("a worker was killed; shards %s are run again", begun or batch)
            deaths.update(begun)
            idle_deaths = 0 if begun else idle_deaths + 1
            for number in begun:
                if deaths[number] >= MOST_DEATHS:
                    raise ArsError(_given_up(plan, number)) from error
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
    partial: Path,
    numbers: Sequence[int],
    make: Callable[[], Executor],
    on_progress: Callable[[int, int], None],
    cancelled: Callable[[], bool],
) -> None:
    """Run these shards in one executor. Whatever ends this early, no worker is left writing."""
    total = len(plan.frames)
    done = sum(plan.shards[n][1] - plan.shards[n][0] for n in finished_shards(plan, partial))
    digest = digest_of(plan)
    with make() as executor:
        try:
            on_progress(done, total)
            running: set[Future[int]] = {executor.submit(export_shard, str(partial), n, digest) for n in numbers}
            while running:
                if cancelled():
                    raise Cancelled("the export was cancelled")
                ended, running = wait(running, timeout=_LOOK_EVERY, return_when=FIRST_COMPLETED)
                for future in ended:
                    done += future.result()
                    on_progress(done, total)
        except BaseException:
            _ask_to_stop(partial)
            executor.shutdown(wait=True, cancel_futures=True)
            raise


def _ask_to_stop(partial: Path) -> None:
    try:
        (partial / CANCEL).touch()
    except OSError as error:
        # On a full or unwritable disk the workers stop by themselves.
        if error.errno not in (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES, errno.ENOENT):
            raise


def _no_progress(done: int, total: int) -> None:
    pass


def _never() -> bool:
    return False
