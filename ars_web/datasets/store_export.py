"""Exports to an object store: what `jobs` does on a disk, where there are no renames and no locks.

The files of single frames are uploaded to their places as shards are made. What spans shards is joined on this
machine's disk once all of them are whole, and `dataset.json` is uploaded last: a folder with it is a whole dataset, one
without it is not. Beside the dataset, `<dataset>.partial/` holds the plan and what is done (`store_worker` says how),
so that an interrupted export goes on, and goes when `dataset.json` is there.

Two exports to one folder: each takes it by writing its name into `owner`, and stops once another's is there.
"""

import secrets
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory

from ars_web.datasets import cluster as clusters
from ars_web.datasets.assembly import DOCUMENT, description_of
from ars_web.datasets.jobs import SHOWN_IMAGES, local_executor
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.plan import plan_export
from ars_web.datasets.plan_files import FILES as PLAN_FILES
from ars_web.datasets.plan_files import digest_of, write_plan
from ars_web.datasets.planned import ExportPlan
from ars_web.datasets.registry import writer_of
from ars_web.datasets.report import ExportReport, ShardReport, report_of
from ars_web.datasets.shard_runs import Workplace, run_shards
from ars_web.datasets.store_worker import (
    BEGUN,
    FILES,
    FRAGMENTS,
    REPORT,
    cancel_name,
    export_stored_shard,
    files_below,
    partial_of,
    shard_name,
)
from ars_web.errors import ArsError, BadInput, Cancelled, StoreError
from ars_web.recordings.stores import StoreFolder, is_this_process_only
from ars_web.sessions.model import SessionSnapshot

IMAGES_PER_SHARD = 200
"""A shard with its images lies on the worker's disk until it is uploaded."""

_DIGEST = "digest"
_OWNER = "owner"
_JOINED = "joined"
"""The names of the files that span shards, written before the first of them is uploaded."""

_LOOK_EVERY = 5.0
"""Seconds between looks whether the folder is still this export's."""


def plan_stored_export(
    snapshots: Sequence[SessionSnapshot],
    *,
    format: str,  # noqa: A002 - the contract's name
    options: ExportOptions,
    frames_per_shard: int | None = None,
) -> ExportPlan:
    """Decide an export to a store, as `plan_export` does one to a disk; the plan's `out` means nothing."""
    length = frames_per_shard or (None if options.images == "none" else IMAGES_PER_SHARD)
    nowhere = Path("dataset on a store")
    return plan_export(snapshots, format=format, options=options, out=nowhere, frames_per_shard=length)


def run_stored_export(
    plan: ExportPlan,
    target: StoreFolder,
    *,
    executor_factory: Callable[[], Executor] | None = None,
    workers: int | None = None,
    cluster: clusters.Cluster | None = None,
    on_progress: Callable[[int, int], None] | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> ExportReport:
    """Do a planned export into the store's folder `target`; arguments and what is raised are those of `run_export`."""
    _refuse_unusable(target, cluster)
    keeper = _StoreKeeper(plan, target)
    try:
        report = keeper.prepare()
        if report is not None:
            return report
        asked = keeper.watching(cancelled or (lambda: False))
        place = Workplace(executor_factory or (lambda: _executor(plan, target, workers)), cancelled=asked)
        with ExitStack() as stack:
            if cluster is not None and executor_factory is None:
                place = _on_cluster(keeper, cluster, place, stack)
            try:
                run_shards(plan, keeper, place, on_progress or (lambda done, total: None))
                report = _publish(keeper, cancelled or (lambda: False))
            except ArsError:
                if keeper.is_ours():
                    keeper.discard()
                raise
    except OSError as error:
        raise StoreError(
            f"{error.filename or target}: {error.strerror or error}; what is done stays in {keeper.partial}, and the"
            " same export goes on from there"
        ) from error
    return report


class _StoreKeeper:
    """The shards of an export in the partial folder beside its dataset."""

    def __init__(self, plan: ExportPlan, target: StoreFolder) -> None:
        self.plan = plan
        self.target = target
        self.partial = partial_of(target)
        self.run = secrets.token_hex(8)
        self._digest = digest_of(plan)
        self._next_look = 0.0

    def prepare(self) -> ExportReport | None:
        """Leave in the partial folder this plan and its finished shards, and take it; the report of an export that
        was done but for tidying up."""
        there = set(self.partial.names())
        same = _DIGEST in there and self.partial.read(_DIGEST).decode() == self._digest
        whole = bool(there) and self.target.has(DOCUMENT)
        if same and whole:
            report = ExportReport.model_validate_json(self.target.read(DOCUMENT))
            self.partial.remove(sorted(there))
            return report
        if not same:
            if whole:
                self.partial.remove(sorted(there))
            elif there:
                self.discard()
            if self.target.names():
                raise BadInput(f"{self.target} is not empty; name a folder that is not there yet, or empty it")
            with TemporaryDirectory(prefix="ars-web-plan-") as folder:
                write_plan(self.plan, Path(folder))
                self.partial.upload([(Path(folder) / name, name) for name in PLAN_FILES])
                # Last: with it, the plan is whole.
                self.partial.upload([(Path(folder) / _DIGEST, _DIGEST)])
        self.partial.write(_OWNER, self.run.encode())
        return None

    def is_ours(self) -> bool:
        """Whether no other export has taken the folder."""
        try:
            return self.partial.read(_OWNER).decode() == self.run
        except FileNotFoundError:
            return False

    def refuse_another(self) -> None:
        """Raises BadInput where another export has taken the folder."""
        if not self.is_ours():
            raise BadInput(f"another export is writing to {self.target}; wait for it, or choose another folder")

    def watching(self, cancelled: Callable[[], bool]) -> Callable[[], bool]:
        """`cancelled`, which also notices another export in the same folder."""

        def watched() -> bool:
            if time.monotonic() >= self._next_look:
                self.refuse_another()
                self._next_look = time.monotonic() + _LOOK_EVERY
            return cancelled()

        return watched

    def finished(self) -> list[int]:
        there = set(self.partial.names())
        return [n for n in range(len(self.plan.shards)) if f"{shard_name(n)}/{REPORT}" in there]

    def tries(self, number: int) -> int:
        there = self.partial.below(shard_name(number)).names()
        return 0 if REPORT in there else sum(name.startswith(BEGUN) for name in there)

    def begin_round(self, numbers: Sequence[int]) -> None:
        folders = tuple(f"{shard_name(number)}/{BEGUN}" for number in numbers)
        self.partial.remove([name for name in self.partial.names() if name.startswith(("cancel-", *folders))])

    def submit(self, executor: Executor, number: int) -> Future[int]:
        return executor.submit(export_stored_shard, self.target.address, number, self._digest, self.run)

    def ask_to_stop(self) -> None:
        self.partial.write(cancel_name(self.run), b"")

    def discard(self) -> None:
        """Remove what exports whose partial folder this is have written, and nothing else."""
        there = self.partial.names()
        listed = [name for name in there if name == _JOINED or name.endswith(f"/{FILES}")]
        for name in listed:
            self.target.remove(self.partial.read(name).decode().splitlines())
        # The digest last: until then, what is left is known for what it is.
        self.partial.remove([name for name in there if name != _DIGEST])
        self.partial.remove([_DIGEST])


def _publish(keeper: _StoreKeeper, cancelled: Callable[[], bool]) -> ExportReport:
    """Join what spans shards, upload it, and say by `dataset.json` that the dataset is whole."""
    plan, partial = keeper.plan, keeper.partial
    with TemporaryDirectory(prefix="ars-web-join-") as folder:
        shards, dataset = Path(folder) / "partial", Path(folder) / "dataset"
        dataset.mkdir()
        partial.download([n for n in partial.names() if f"/{FRAGMENTS}/" in n or n.endswith(f"/{REPORT}")], shards)
        folders = [shards / shard_name(number) for number in range(len(plan.shards))]
        for shard in folders:
            (shard / FRAGMENTS).mkdir(exist_ok=True)
        joined = writer_of(plan.format).join(description_of(plan), [f / FRAGMENTS for f in folders], dataset)
        report = report_of(plan, _reports(folders), joined)
        files = files_below(dataset)
        partial.write(_JOINED, "".join(f"{name}\n" for _, name in [*files, (dataset, DOCUMENT)]).encode())
        upload_joined(keeper.target, files)
    if cancelled():
        raise Cancelled("the export was cancelled")
    keeper.refuse_another()
    keeper.target.write(DOCUMENT, report.as_file())
    partial.remove([name for name in partial.names() if name != _DIGEST])
    partial.remove([_DIGEST])
    return report


def upload_joined(target: StoreFolder, files: Sequence[tuple[Path, str]]) -> None:
    """Upload the files that span shards."""
    target.upload(files)


def _reports(folders: Sequence[Path]) -> Iterator[ShardReport]:
    return (ShardReport.model_validate_json((folder / REPORT).read_bytes()) for folder in folders)


def _refuse_unusable(target: StoreFolder, cluster: clusters.Cluster | None) -> None:
    if "/" not in target.address.partition("://")[2]:
        raise BadInput(f"{target} is all of a bucket; name a folder in it, such as {target}/dataset")
    if cluster is not None and is_this_process_only(target.address):
        raise BadInput(f"{target} is in this process's memory, which no worker of a cluster sees; name another store")


def _executor(plan: ExportPlan, target: StoreFolder, workers: int | None) -> Executor:
    return ThreadPoolExecutor(1) if is_this_process_only(target.address) else local_executor(plan, workers)


def _on_cluster(keeper: _StoreKeeper, cluster: clusters.Cluster, place: Workplace, stack: ExitStack) -> Workplace:
    """The cluster as the place to work at, once its workers were looked at; left when the stack is."""
    content = clusters.new_token()
    keeper.partial.write("token", content.encode())
    sources = keeper.plan.frames.sources if keeper.plan.options.images != "none" else ()
    step = max(1, -(-len(sources) // SHOWN_IMAGES))
    try:
        connection = stack.enter_context(clusters.connected(cluster))
        connection.check_workers(f"{keeper.partial}/token", content, images=sources[::step])
    except BadInput:
        if not keeper.finished():
            keeper.discard()
        raise
    return Workplace(connection.executor, (connection.killed, *place.killed), connection.watching(place.cancelled))
