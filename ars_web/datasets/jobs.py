"""Running a planned export: shards through an executor, resumed from what is missing, published whole or not at all.

Any executor whose workers see the partial folder will do. That folder, `.NAME.partial`, lies beside the dataset's, in
the same file system; a lock on it keeps two exports from sharing it.
"""

import errno
import fcntl
import logging
import os
import shutil
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from multiprocessing import get_context
from pathlib import Path

from ars_web.datasets import cluster as clusters
from ars_web.datasets.assembly import assemble, finished_shards, is_published, publish
from ars_web.datasets.plan import plan_export, usable_out
from ars_web.datasets.plan_files import digest_of, read_digest, write_plan
from ars_web.datasets.planned import ExportPlan
from ars_web.datasets.report import ExportReport
from ars_web.datasets.shard_runs import Workplace, run_shards
from ars_web.datasets.worker import CANCEL, begun_folders, export_shard, start_worker
from ars_web.errors import ArsError, BadInput, Cancelled, StoreError

__all__ = ["partial_folder", "plan_export", "run_export"]

_log = logging.getLogger(__name__)

POOL_FROM_SECONDS = 3.0
"""Exports of less work than this run in a thread: a pool of two processes takes a second to start, so that is where
it begins to pay."""

SHOWN_IMAGES = 2
"""Of so many images, spread over the export, every worker of a cluster is asked whether it sees them."""

_BOOT = "boot"


def partial_folder(out: Path) -> Path:
    """Where the work of an export to `out` lies until it is published."""
    return out.parent / f".{out.name}.partial"


def run_export(
    plan: ExportPlan,
    *,
    executor_factory: Callable[[], Executor] | None = None,
    workers: int | None = None,
    cluster: clusters.Cluster | None = None,
    on_progress: Callable[[int, int], None] | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> ExportReport:
    """Do a planned export; where a partial folder of the same plan is found, only what is missing in it.

    `executor_factory` makes an executor each time one is needed (None: that of the `cluster`; without one a thread
    for a small export, else a pool of `workers` processes). `on_progress(done, total)` counts frames. `cancelled` is
    asked some ten times a second; when it answers yes the workers stop, everything written is removed, and Cancelled
    is raised. An exception out of either callback, Ctrl-C included, stops the workers too, but what is written stays
    and can be resumed.

    Raises:
        BadFile: a source image is missing, damaged or changed; nothing is published and nothing stays.
        BadInput: another export writes to the same folder, or the cluster cannot be reached or cannot do the work.
        Cancelled: as asked.
        StoreError: the disk is full or not to be written, or the cluster is gone; what is written stays and can be
            resumed.
        ArsError: a shard kills its worker whenever it is run; the message names it.
    """
    usable_out(plan.out)
    partial = partial_folder(plan.out)
    place = Workplace(
        executor_factory or (lambda: local_executor(plan, workers)), (BrokenExecutor,), cancelled or _never
    )
    try:
        partial.mkdir(parents=True, exist_ok=True)
        with _locked(partial), ExitStack() as stack:
            _prepare(plan, partial)
            if cluster is not None and executor_factory is None:
                place = _on_cluster(plan, partial, cluster, place, stack)
            try:
                run_shards(plan, _FolderKeeper(plan, partial), place, on_progress or _no_progress)
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


def local_executor(plan: ExportPlan, workers: int | None) -> Executor:
    """A thread of this process for a small export, else a pool of `workers` processes."""
    if plan.seconds < POOL_FROM_SECONDS or len(plan.shards) == 1:
        return ThreadPoolExecutor(max_workers=1)
    # Spawned, never forked: numba's and OpenCV's threads do not survive a fork.
    return ProcessPoolExecutor(
        max_workers=min(workers or os.cpu_count() or 1, len(plan.shards)),
        mp_context=get_context("spawn"),
        initializer=start_worker,
    )


def _on_cluster(
    plan: ExportPlan, partial: Path, cluster: clusters.Cluster, place: Workplace, stack: ExitStack
) -> Workplace:
    """The cluster as the place to work at, once its workers were looked at; left when the stack is."""
    token, content = partial / "token", clusters.new_token()
    token.write_text(content, encoding="ascii")
    sources = plan.frames.sources if plan.options.images != "none" else ()
    step = max(1, -(-len(sources) // SHOWN_IMAGES))
    try:
        connection = stack.enter_context(clusters.connected(cluster))
        connection.check_workers(str(token), content, images=sources[::step])
    except BadInput:
        # What an earlier run did is as good as before, and goes on once the cluster is in order.
        if not finished_shards(plan, partial):
            shutil.rmtree(partial, ignore_errors=True)
        raise
    return Workplace(connection.executor, (connection.killed, *place.killed), connection.watching(place.cancelled))


class _FolderKeeper:
    """Shards in a partial folder on a disk that the workers share."""

    def __init__(self, plan: ExportPlan, partial: Path) -> None:
        self._plan = plan
        self._partial = partial
        self._digest = digest_of(plan)

    def finished(self) -> list[int]:
        return finished_shards(self._plan, self._partial)

    def tries(self, number: int) -> int:
        # Each try has a folder of its own.
        return len(begun_folders(self._partial, number))

    def begin_round(self, numbers: Sequence[int]) -> None:
        for number in numbers:
            for folder in begun_folders(self._partial, number):
                shutil.rmtree(folder, ignore_errors=True)
        (self._partial / CANCEL).unlink(missing_ok=True)

    def submit(self, executor: Executor, number: int) -> Future[int]:
        return executor.submit(export_shard, str(self._partial), number, self._digest)

    def ask_to_stop(self) -> None:
        _ask_to_stop(self._partial)


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
