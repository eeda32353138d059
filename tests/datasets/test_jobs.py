"""Exports whole: what they publish, and that they publish all of it or nothing."""

import errno
import json
import os
import subprocess
import threading
from collections.abc import Callable
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

from ars_web.datasets import assembly, jobs, worker
from ars_web.datasets.jobs import partial_folder, run_export
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.plan import plan_export
from ars_web.datasets.planned import ExportPlan
from ars_web.datasets.registry import WRITERS
from ars_web.datasets.worker import export_shard, start_worker
from ars_web.errors import ArsError, BadFile, BadInput, Cancelled, StoreError
from ars_web.sessions.model import SessionSnapshot

Make = Callable[..., SessionSnapshot]
Tree = Callable[[Path], dict[str, str]]


def plan_of(*snapshots: SessionSnapshot, out: Path, shard: int | None = None, **changes: object) -> ExportPlan:
    kind = str(changes.pop("format", "yolo"))
    return plan_export(
        snapshots, format=kind, options=ExportOptions.model_validate(changes), out=out, frames_per_shard=shard
    )


def one_thread() -> Executor:
    return ThreadPoolExecutor(1)


def two_processes() -> Executor:
    return ProcessPoolExecutor(2, mp_context=get_context("spawn"), initializer=start_worker)


@pytest.mark.parametrize("kind", WRITERS)
@pytest.mark.parametrize("images", ["link", "copy", "rectify", "none"])
def test_bytes_do_not_depend_on_shards(make_snapshot: Make, tree: Tree, tmp_path: Path, kind: str, images: str) -> None:
    snapshots = [make_snapshot(12), make_snapshot(5, sid="s2", classes=("duck",))]
    trees: list[dict[str, str]] = []
    for shard in (1, 4, 100):
        out = tmp_path / f"{kind}-{shard}"
        run_export(plan_of(*snapshots, out=out, shard=shard, format=kind, images=images), executor_factory=one_thread)
        trees.append(tree(out))
    assert trees[0] == trees[1] == trees[2]
    assert sorted(p.name for p in tmp_path.iterdir() if p.name.startswith(".")) == []


@pytest.mark.parametrize("kind", ["yolo", "coco"])
def test_bytes_do_not_depend_on_processes(make_snapshot: Make, tree: Tree, tmp_path: Path, kind: str) -> None:
    snapshot = make_snapshot(12)
    run_export(plan_of(snapshot, out=tmp_path / "a", format=kind))
    run_export(plan_of(snapshot, out=tmp_path / "b", format=kind, shard=2), executor_factory=two_processes)
    assert tree(tmp_path / "a") == tree(tmp_path / "b")


@pytest.mark.parametrize("kind", WRITERS)
def test_nothing_of_this_machine_is_in_a_dataset(make_snapshot: Make, tmp_path: Path, kind: str) -> None:
    run_export(plan_of(make_snapshot(4), out=tmp_path / "d", format=kind, images="none"))
    for path in (tmp_path / "d").rglob("*"):
        if path.is_file():
            assert str(tmp_path).encode() not in path.read_bytes()


@pytest.mark.parametrize("kind", WRITERS)
def test_dataset_json_can_be_checked_with_sha256sum(make_snapshot: Make, tmp_path: Path, kind: str) -> None:
    report = run_export(plan_of(make_snapshot(12), out=tmp_path / "d", format=kind))
    written = json.loads((tmp_path / "d" / "dataset.json").read_bytes())
    assert written == report.model_dump(mode="json")
    folder = WRITERS[kind].label_folder
    command = f"find {folder} -type f | LC_ALL=C sort | xargs sha256sum | sha256sum"
    printed = subprocess.run(command, shell=True, cwd=tmp_path / "d", capture_output=True, check=True, text=True)
    assert printed.stdout.split()[0] == written["sha256"]
    found = subprocess.run(f"find {folder} -type f", shell=True, cwd=tmp_path / "d", capture_output=True, check=True)
    assert written["label_files"] == len(found.stdout.splitlines())


@pytest.mark.parametrize("kind", WRITERS)
def test_counts_add_up(make_snapshot: Make, tmp_path: Path, kind: str) -> None:
    snapshots = [make_snapshot(12), make_snapshot(5, sid="s2", classes=("duck", "cube"))]
    report = run_export(plan_of(*snapshots, out=tmp_path / "d", format=kind, shard=3, min_visible=0.5, min_area_px=30))
    labels = sum(split.labels for split in report.splits.values())
    assert labels + sum(report.dropped.values()) == 17 * 3
    assert report.dropped["not_in_image"] > 0
    assert report.dropped["area"] + report.dropped["visibility"] > 0
    for split in report.splits.values():
        assert sum(split.classes.values()) == split.labels
        assert list(split.classes) == ["cube", "tall one", "duck"]
    assert sum(split.images for split in report.splits.values()) == 17
    assert sum(split.negatives for split in report.splits.values()) >= 2
    assert [(s.id, s.revision, s.frames) for s in report.sessions] == [("s1", 3, 12), ("s2", 3, 5)]
    assert [(c.id, c.name) for c in report.classes] == [(0, "cube"), (1, "tall one"), (2, "duck")]


@pytest.mark.parametrize("kind", WRITERS)
def test_poor_sessions_make_whole_datasets(make_snapshot: Make, tmp_path: Path, kind: str) -> None:
    no_boxes = make_snapshot(3, objects=[])
    report = run_export(plan_of(no_boxes, out=tmp_path / "no-boxes", format=kind))
    assert sum(s.negatives for s in report.splits.values()) == 3
    no_classes = replace(no_boxes, state=replace(no_boxes.state, classes={}))
    report = run_export(plan_of(no_classes, out=tmp_path / "no-classes", format=kind))
    assert report.classes == []
    single = make_snapshot(1)
    report = run_export(plan_of(single, out=tmp_path / "single", format=kind))
    assert (report.splits["train"].images, report.splits["val"].images) == (1, 0)
    only_train = plan_of(make_snapshot(8), out=tmp_path / "train", format=kind, split={"train": 1.0, "val": 0.0})
    assert run_export(only_train).splits["val"].images == 0
    with_test = plan_of(
        make_snapshot(8), out=tmp_path / "test", format=kind, split={"train": 0.5, "val": 0.25, "test": 0.25}
    )
    assert {k: s.images for k, s in run_export(with_test).splits.items()} == {"train": 4, "val": 2, "test": 2}


def test_an_empty_folder_becomes_the_dataset(make_snapshot: Make, tmp_path: Path) -> None:
    (tmp_path / "d").mkdir()
    run_export(plan_of(make_snapshot(2), out=tmp_path / "d"))
    assert (tmp_path / "d" / "data.yaml").is_file()


def test_a_folder_that_filled_meanwhile_is_left_alone(make_snapshot: Make, tmp_path: Path) -> None:
    plan = plan_of(make_snapshot(2), out=tmp_path / "d")
    (tmp_path / "d").mkdir()
    (tmp_path / "d" / "precious").touch()
    with pytest.raises(BadInput, match="not empty"):
        run_export(plan)
    assert [path.name for path in (tmp_path / "d").iterdir()] == ["precious"]


def test_progress_counts_frames_up_to_all(make_snapshot: Make, tmp_path: Path) -> None:
    seen: list[tuple[int, int]] = []
    plan = plan_of(make_snapshot(7), out=tmp_path / "d", shard=2)
    run_export(plan, executor_factory=one_thread, on_progress=lambda done, total: seen.append((done, total)))
    assert seen[0] == (0, 7)
    assert seen[-1] == (7, 7)
    assert seen == sorted(seen)


class Stopped(Exception):
    """Stands for whatever ends an export from outside."""


def stop_after(frames: int) -> Callable[[int, int], None]:
    def progress(done: int, total: int) -> None:
        if done >= frames:
            raise Stopped

    return progress


@pytest.mark.parametrize("kind", WRITERS)
def test_an_interrupted_export_goes_on_with_what_is_missing(
    make_snapshot: Make, tree: Tree, tmp_path: Path, kind: str
) -> None:
    snapshot = make_snapshot(12)
    run_export(plan_of(snapshot, out=tmp_path / "whole", format=kind))
    plan = plan_of(snapshot, out=tmp_path / "d", format=kind, shard=2)
    with pytest.raises(Stopped):
        run_export(plan, executor_factory=one_thread, on_progress=stop_after(6))
    assert not (tmp_path / "d").exists()
    seen: list[int] = []
    run_export(plan, executor_factory=one_thread, on_progress=lambda done, total: seen.append(done))
    assert seen[0] >= 6
    assert tree(tmp_path / "d") == tree(tmp_path / "whole")
    assert not partial_folder(tmp_path / "d").exists()


@pytest.mark.parametrize("kind", WRITERS)
@pytest.mark.parametrize("stage", ["_move_files", "report_of", "publish"])
def test_an_assembly_that_was_cut_short_is_done_again(
    make_snapshot: Make, tree: Tree, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str, stage: str
) -> None:
    snapshot = make_snapshot(12)
    run_export(plan_of(snapshot, out=tmp_path / "whole", format=kind))
    plan = plan_of(snapshot, out=tmp_path / "d", format=kind, shard=3)
    module = jobs if stage == "publish" else assembly
    real, calls = getattr(module, stage), []

    def cut_short(*args: object) -> object:
        calls.append(args)
        if len(calls) > (2 if stage == "_move_files" else 0):
            raise Stopped
        return real(*args)

    with monkeypatch.context() as patch:
        patch.setattr(module, stage, cut_short)
        with pytest.raises(Stopped):
            run_export(plan, executor_factory=one_thread)
    run_export(plan, executor_factory=one_thread)
    assert tree(tmp_path / "d") == tree(tmp_path / "whole")


def test_what_is_left_of_a_published_export_is_never_taken_for_its_shards(
    make_snapshot: Make, tree: Tree, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Killed between the rename and the tidying: the shards are still listed, but their files have left."""
    plan = plan_of(make_snapshot(6), out=tmp_path / "d", shard=2)
    with monkeypatch.context() as patch:
        patch.setattr(assembly, "remove_folder", lambda folder: None)
        run_export(plan, executor_factory=one_thread)
    assert partial_folder(plan.out).is_dir()
    first = tree(tmp_path / "d")
    (tmp_path / "d").rename(tmp_path / "first")
    run_export(plan, executor_factory=one_thread)
    assert tree(tmp_path / "d") == first


def test_the_beginning_of_another_export_is_discarded(
    make_snapshot: Make, tree: Tree, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    snapshot = make_snapshot(12)
    with pytest.raises(Stopped):
        run_export(
            plan_of(snapshot, out=tmp_path / "d", shard=2), executor_factory=one_thread, on_progress=stop_after(6)
        )
    changed = plan_of(snapshot, out=tmp_path / "d", shard=2, min_area_px=50)
    with caplog.at_level("INFO"):
        run_export(changed, executor_factory=one_thread)
    assert "discarded" in caplog.text
    run_export(plan_of(snapshot, out=tmp_path / "whole", min_area_px=50))
    assert tree(tmp_path / "d") == tree(tmp_path / "whole")


def test_two_exports_do_not_share_a_folder(make_snapshot: Make, tmp_path: Path) -> None:
    plan = plan_of(make_snapshot(4), out=tmp_path / "d", shard=1)
    refused: list[str] = []

    def second(done: int, total: int) -> None:
        if not refused:
            with pytest.raises(BadInput, match="another export is writing") as caught:
                run_export(plan)
            refused.append(str(caught.value))

    run_export(plan, executor_factory=one_thread, on_progress=second)
    assert refused
    assert (tmp_path / "d" / "data.yaml").is_file()


def test_a_cancelled_export_leaves_nothing(make_snapshot: Make, tmp_path: Path) -> None:
    asked = threading.Event()
    plan = plan_of(make_snapshot(12), out=tmp_path / "d", shard=2)
    with pytest.raises(Cancelled):
        run_export(
            plan,
            executor_factory=one_thread,
            on_progress=lambda done, total: asked.set() if done else None,
            cancelled=asked.is_set,
        )
    assert sorted(p.name for p in tmp_path.iterdir()) == ["recording-s1"]


def test_a_worker_looks_for_the_cancel_mark_within_its_shard(make_snapshot: Make, tmp_path: Path) -> None:
    """One shard of all frames: only a look inside it can end it early."""
    plan = plan_of(make_snapshot(4000), out=tmp_path / "d", shard=4000, images="rectify")
    shards = partial_folder(plan.out) / "shards"
    unfinished: list[int] = []

    def cancelled() -> bool:
        placed = sum(1 for _ in shards.rglob("*.jpg"))
        if placed:
            unfinished.append(placed)
        return placed > 0

    with pytest.raises(Cancelled):
        run_export(plan, executor_factory=two_processes, cancelled=cancelled)
    assert unfinished[0] < 4000
    assert not partial_folder(plan.out).exists()


@pytest.mark.parametrize("images", ["link", "copy", "rectify"])
@pytest.mark.parametrize(
    ("damage", "says"),
    [("removed", "cannot be exported"), ("replaced", "changed since"), ("cut", "changed since")],
)
def test_an_image_that_changed_after_planning_fails_the_export(
    make_snapshot: Make, tmp_path: Path, damage: str, says: str, images: str
) -> None:
    snapshot = make_snapshot(6)
    plan = plan_of(snapshot, out=tmp_path / "d", shard=2, images=images)
    image = snapshot.frames.images[3]
    if damage == "removed":
        image.unlink()
    elif damage == "replaced":
        image.write_bytes(snapshot.frames.images[2].read_bytes())
    else:
        image.write_bytes(image.read_bytes()[:-40])
    with pytest.raises(BadFile, match=rf"0003\.jpg: the image {says}"):
        run_export(plan, executor_factory=two_processes if images == "rectify" else one_thread)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["recording-s1"]


def test_an_image_of_another_size_than_its_cameras_is_refused(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(6)
    snapshot.frames.images[3].write_bytes(snapshot.frames.images[4].read_bytes())
    with pytest.raises(BadFile, match=r"0003\.jpg: the image is 48 x 64 pixels, but its camera's are 64 x 48"):
        run_export(plan_of(snapshot, out=tmp_path / "d"))


def test_a_truncated_image_is_refused(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(3)
    image = snapshot.frames.images[1]
    image.write_bytes(image.read_bytes()[:-40])
    with pytest.raises(BadFile, match=r"0001\.jpg: the image ends before its data does"):
        run_export(plan_of(snapshot, out=tmp_path / "d"))


def test_a_full_disk_is_said_and_can_be_gone_on_from(
    make_snapshot: Make, tree: Tree, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    snapshot = make_snapshot(8)
    plan = plan_of(snapshot, out=tmp_path / "d", shard=2)
    real, written = os.write, []

    def nearly_full(file: int, content: memoryview) -> int:
        written.append(file)
        if len(written) > 5:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return real(file, content)

    with monkeypatch.context() as patch:
        patch.setattr(os, "write", nearly_full)
        with pytest.raises(StoreError, match=r"No space left on device.*goes on from there"):
            run_export(plan, executor_factory=one_thread)
    assert not (tmp_path / "d").exists()
    run_export(plan, executor_factory=one_thread)
    run_export(plan_of(snapshot, out=tmp_path / "whole"))
    assert tree(tmp_path / "d") == tree(tmp_path / "whole")


def test_a_folder_that_cannot_be_made_is_named(make_snapshot: Make, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(StoreError, match="file"):
        run_export(plan_of(make_snapshot(1), out=tmp_path / "file" / "d"))
    with pytest.raises(StoreError, match="/proc"):
        run_export(plan_of(make_snapshot(1), out=Path("/proc/dataset")))


class DyingPool(ThreadPoolExecutor):
    """Breaks as a process pool does when the worker of a certain shard is killed, leaving the shard begun."""

    deadly: dict[int, int]

    def submit(self, fn, /, partial, number, digest):
        if self.deadly.get(number, 0) > 0:
            self.deadly[number] -= 1
            worker.new_folder(Path(partial), number)
            raise BrokenProcessPool("a child process terminated abruptly")
        return super().submit(fn, partial, number, digest)


def test_a_shard_is_run_again_after_its_worker_died(make_snapshot: Make, tree: Tree, tmp_path: Path) -> None:
    snapshot = make_snapshot(8)
    DyingPool.deadly = {1: 2, 3: 1}
    run_export(plan_of(snapshot, out=tmp_path / "d", shard=2), executor_factory=lambda: DyingPool(1))
    run_export(plan_of(snapshot, out=tmp_path / "whole"))
    assert tree(tmp_path / "d") == tree(tmp_path / "whole")


def test_a_shard_that_kills_its_worker_three_times_is_named(make_snapshot: Make, tmp_path: Path) -> None:
    DyingPool.deadly = {1: 3}
    with pytest.raises(ArsError, match="shard 00001 killed its worker 3 times: frames 2 to 3 of session s1"):
        run_export(plan_of(make_snapshot(8), out=tmp_path / "d", shard=2), executor_factory=lambda: DyingPool(1))


def test_workers_that_die_before_they_begin_are_given_up(make_snapshot: Make, tmp_path: Path) -> None:
    def stillborn() -> Executor:
        return ProcessPoolExecutor(1, mp_context=get_context("spawn"), initializer=os._exit, initargs=(1,))

    with pytest.raises(ArsError, match="killed 3 times before they began"):
        run_export(plan_of(make_snapshot(2), out=tmp_path / "d"), executor_factory=stillborn)


def test_a_shard_written_twice_is_the_same_shard(make_snapshot: Make, tree: Tree, tmp_path: Path) -> None:
    """A worker that was thought dead may have finished: the second finds the first's place taken or free."""
    plan = plan_of(make_snapshot(4), out=tmp_path / "d", shard=2)
    with pytest.raises(Stopped):
        run_export(plan, executor_factory=one_thread, on_progress=stop_after(2))
    partial = partial_folder(plan.out)
    (partial / "cancel").unlink()
    first = tree(partial / "shards" / "00000")
    digest = (partial / "digest").read_text()
    assert export_shard(str(partial), 0, digest) == 2
    assert tree(partial / "shards" / "00000") == first


def test_rectified_datasets_say_so_and_have_labels_for_the_rectified_camera(
    make_snapshot: Make, tmp_path: Path
) -> None:
    snapshot = make_snapshot(12)
    straight = run_export(plan_of(snapshot, out=tmp_path / "d", images="rectify", min_area_px=0))
    assert [(c.camera, c.width, c.height) for c in straight.rectified_cameras] == [(0, 64, 48), (1, 48, 64)]
    bent = run_export(plan_of(snapshot, out=tmp_path / "bent", min_area_px=0))
    assert bent.rectified_cameras == []

    def rows(folder: str, stem: str) -> np.ndarray:
        (path,) = (tmp_path / folder / "labels").glob(f"*/{stem}.txt")
        return np.loadtxt(path, ndmin=2)

    # Frame 4 is the flat camera's: nothing to straighten. Frame 0 is the bent one's.
    assert np.array_equal(rows("d", "0004"), rows("bent", "0004"))
    assert not np.array_equal(rows("d", "0000"), rows("bent", "0000"))
