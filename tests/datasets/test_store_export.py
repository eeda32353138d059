"""Exports to a store: the same files as on a disk, `dataset.json` last, and nothing of anyone else's touched."""

import hashlib
import threading
from collections.abc import Callable
from concurrent.futures import Executor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import pytest

from ars_web.datasets import store_export
from ars_web.datasets.cluster import Cluster
from ars_web.datasets.jobs import plan_export, run_export
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.plan import ExportPlan
from ars_web.datasets.registry import WRITERS
from ars_web.datasets.store_export import plan_stored_export, run_stored_export
from ars_web.datasets.store_worker import partial_of, shard_name
from ars_web.errors import ArsError, BadFile, BadInput, Cancelled, StoreError
from ars_web.recordings.stores import StoreFolder, store_folder
from ars_web.sessions.model import SessionSnapshot

Make = Callable[..., SessionSnapshot]


@pytest.fixture
def target(tmp_path: Path) -> StoreFolder:
    """A folder of its own in a store of this process."""
    return store_folder(f"memory://{tmp_path.name}/sets/d")


def plan_of(*snapshots: SessionSnapshot, kind: str = "yolo", **changes: object) -> ExportPlan:
    options = ExportOptions.model_validate(changes)
    return plan_stored_export(snapshots, format=kind, options=options, frames_per_shard=2)


def one_thread() -> Executor:
    return ThreadPoolExecutor(1)


def local(*snapshots: SessionSnapshot, out: Path, kind: str = "yolo", **changes: object) -> dict[str, str]:
    """The digests of a local export's files, by name."""
    options = ExportOptions.model_validate(changes)
    run_export(plan_export(snapshots, format=kind, options=options, out=out), executor_factory=one_thread)
    files = (path for path in out.rglob("*") if path.is_file())
    return {path.relative_to(out).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def stored(folder: StoreFolder) -> dict[str, str]:
    return {name: hashlib.sha256(folder.read(name)).hexdigest() for name in folder.names()}


@pytest.mark.parametrize("kind", WRITERS)
@pytest.mark.parametrize("images", ["link", "rectify", "none"])
def test_the_files_are_those_of_a_local_export(
    make_snapshot: Make, target: StoreFolder, tmp_path: Path, kind: str, images: str
) -> None:
    snapshots = [make_snapshot(7), make_snapshot(3, sid="s2", classes=("duck",))]
    seen: list[tuple[int, int]] = []
    report = run_stored_export(
        plan_of(*snapshots, kind=kind, images=images),
        target,
        on_progress=lambda done, total: seen.append((done, total)),
    )
    assert stored(target) == local(*snapshots, out=tmp_path / "d", kind=kind, images=images)
    assert target.read("dataset.json") == report.as_file()
    assert partial_of(target).names() == []
    assert (seen[0], seen[-1]) == ((0, 10), (10, 10))


class Stopped(Exception):
    """Stands for whatever ends an export from outside."""


def stop_after(frames: int) -> Callable[[int, int], None]:
    def progress(done: int, total: int) -> None:
        if done >= frames:
            raise Stopped

    return progress


def test_an_interrupted_export_goes_on_with_what_is_missing(
    make_snapshot: Make, target: StoreFolder, tmp_path: Path
) -> None:
    snapshot = make_snapshot(12)
    plan = plan_of(snapshot, kind="coco")
    with pytest.raises(Stopped):
        run_stored_export(plan, target, executor_factory=one_thread, on_progress=stop_after(6))
    assert not target.has("dataset.json")
    seen: list[int] = []
    run_stored_export(plan, target, executor_factory=one_thread, on_progress=lambda done, total: seen.append(done))
    assert min(seen) >= 6
    assert stored(target) == local(snapshot, out=tmp_path / "d", kind="coco")
    assert partial_of(target).names() == []


def test_an_export_that_only_lacked_the_tidying_is_done(
    make_snapshot: Make, target: StoreFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = plan_of(make_snapshot(4))
    real = StoreFolder.write

    def killed(self: StoreFolder, name: str, content: bytes) -> None:
        real(self, name, content)
        if name == "dataset.json":
            raise Stopped

    with monkeypatch.context() as patch:
        patch.setattr(StoreFolder, "write", killed)
        with pytest.raises(Stopped):
            run_stored_export(plan, target)
    assert partial_of(target).names() != []
    before = stored(target)
    report = run_stored_export(plan, target, executor_factory=lambda: pytest.fail("there is nothing to do"))
    assert report.as_file() == target.read("dataset.json")
    assert stored(target) == before
    assert partial_of(target).names() == []
    with pytest.raises(BadInput, match="is not empty"):
        run_stored_export(plan, target)


def test_the_beginning_of_another_export_is_discarded(make_snapshot: Make, target: StoreFolder, tmp_path: Path) -> None:
    snapshot = make_snapshot(12)
    with pytest.raises(Stopped):
        run_stored_export(plan_of(snapshot), target, executor_factory=one_thread, on_progress=stop_after(6))
    assert target.names() != []
    run_stored_export(plan_of(snapshot, kind="voc", min_area_px=50), target)
    assert stored(target) == local(snapshot, out=tmp_path / "d", kind="voc", min_area_px=50)
    assert partial_of(target).names() == []


def test_what_is_not_ours_is_left_alone(make_snapshot: Make, target: StoreFolder) -> None:
    target.write("precious", b"mine")
    with pytest.raises(BadInput, match=r"sets/d is not empty; name a folder"):
        run_stored_export(plan_of(make_snapshot(2)), target)
    # Nor is what was put there while a cancelled export ran.
    other = StoreFolder(f"{target}2")
    with pytest.raises(Cancelled):
        run_stored_export(
            plan_of(make_snapshot(6)),
            other,
            executor_factory=one_thread,
            on_progress=lambda done, total: other.write("precious", b"mine"),
            cancelled=lambda: len(other.names()) > 4,
        )
    for folder in (target, other):
        assert stored(folder) == {"precious": hashlib.sha256(b"mine").hexdigest()}
        assert partial_of(folder).names() == []


def test_two_exports_do_not_share_a_folder(
    make_snapshot: Make, target: StoreFolder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The later one goes on; the earlier one stops when it sees so, and removes nothing."""
    monkeypatch.setattr(store_export, "_LOOK_EVERY", 0.0)
    snapshot = make_snapshot(8)
    plan, begun = plan_of(snapshot), threading.Event()

    def second(done: int, total: int) -> None:
        if done and not begun.is_set():
            begun.set()
            with pytest.raises(Stopped):
                run_stored_export(plan, target, executor_factory=one_thread, on_progress=stop_after(0))

    with pytest.raises(BadInput, match="another export is writing to memory://"):
        run_stored_export(plan, target, executor_factory=one_thread, on_progress=second)
    run_stored_export(plan, target)
    assert stored(target) == local(snapshot, out=tmp_path / "d")


def test_a_fault_in_the_inputs_leaves_nothing(make_snapshot: Make, target: StoreFolder) -> None:
    snapshot = make_snapshot(6)
    plan = plan_of(snapshot)
    snapshot.frames.images[5].unlink()
    with pytest.raises(BadFile, match=r"0005\.jpg: the image cannot be exported"):
        run_stored_export(plan, target)
    assert target.names() == partial_of(target).names() == []


def test_a_store_that_fails_keeps_what_is_done(
    make_snapshot: Make, target: StoreFolder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    snapshot = make_snapshot(8)
    plan, real = plan_of(snapshot), StoreFolder.write

    def failing(self: StoreFolder, name: str, content: bytes) -> None:
        if name == f"{shard_name(2)}/shard.json":
            raise PermissionError(13, "not allowed", f"{self}/{name}")
        real(self, name, content)

    with monkeypatch.context() as patch:
        patch.setattr(StoreFolder, "write", failing)
        with pytest.raises(StoreError, match=r"shard.json: not allowed; what is done stays in .*d\.partial"):
            run_stored_export(plan, target, executor_factory=one_thread)
    assert not target.has("dataset.json")
    run_stored_export(plan, target)
    assert stored(target) == local(snapshot, out=tmp_path / "d")


class DyingPool(ThreadPoolExecutor):
    """Breaks as a process pool does when the worker of shard 1 is killed, leaving the shard begun."""

    def submit(self, fn, /, target, number, digest, run):
        if number == 1:
            partial_of(store_folder(target)).write(f"{shard_name(1)}/begun-x", b"")
            raise BrokenProcessPool("a child process terminated abruptly")
        return super().submit(fn, target, number, digest, run)


def test_a_shard_that_kills_its_worker_is_named(make_snapshot: Make, target: StoreFolder) -> None:
    with pytest.raises(ArsError, match="shard 00001 killed its worker 3 times: frames 2 to 3 of session s1"):
        run_stored_export(plan_of(make_snapshot(8)), target, executor_factory=lambda: DyingPool(1))
    assert target.names() == partial_of(target).names() == []


def test_targets_that_cannot_be(make_snapshot: Make) -> None:
    plan = plan_of(make_snapshot(1))
    with pytest.raises(BadInput, match=r"memory://bucket is all of a bucket; name a folder"):
        run_stored_export(plan, store_folder("memory://bucket"))
    with pytest.raises(BadInput, match="in this process's memory, which no worker"):
        run_stored_export(plan, store_folder("memory://a/b"), cluster=Cluster("tls://host:1"))
