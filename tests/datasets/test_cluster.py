"""Exports on a Dask cluster of real processes: the bytes of a local one, or a clear no before any shard runs."""

import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType

import pytest

from ars_web import __version__
from ars_web.datasets import cluster as clusters
from ars_web.datasets.cluster import Cluster, checked_executor, cluster_at, connected
from ars_web.datasets.jobs import partial_folder, run_export
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.plan import ExportPlan, plan_export
from ars_web.datasets.store_export import plan_stored_export, run_stored_export
from ars_web.datasets.store_worker import partial_of
from ars_web.errors import ArsError, BadFile, BadInput, Cancelled, StoreError
from ars_web.recordings.stores import store_folder
from ars_web.sessions.model import SessionSnapshot

Make = Callable[..., SessionSnapshot]
Tree = Callable[[Path], dict[str, str]]

PATIENCE = 60.0


@pytest.fixture(scope="module")
def faults(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """See `faulty_worker.py`."""
    return tmp_path_factory.mktemp("faults")


@pytest.fixture(scope="module")
def running(
    dask_cluster: ModuleType, s3: dict[str, str], faults: Path, tmp_path_factory: pytest.TempPathFactory
) -> Iterator:
    """A cluster of two workers; a shard is given up when three of them died at it."""
    preload = Path(__file__).parents[1] / "faulty_worker.py"
    told = {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "2", "FAULTS": str(faults), **s3}
    with dask_cluster.running_cluster(tmp_path_factory.mktemp("cluster") / "own", told) as cluster:
        for name in ("first", "second"):
            cluster.start(name, "--preload", str(preload))
        until(cluster, lambda names: len(names) == 2)
        yield cluster


def until(running, condition: Callable[[set[str]], bool]) -> None:
    """Wait until the scheduler's workers are so."""
    deadline = time.monotonic() + PATIENCE
    with connected(running.cluster) as connection:
        while not condition(set(connection._workers().values())):
            assert time.monotonic() < deadline
            time.sleep(0.05)


def plan_of(*snapshots: SessionSnapshot, out: Path, **changes: object) -> ExportPlan:
    kind = str(changes.pop("format", "yolo"))
    options = ExportOptions.model_validate(changes)
    return plan_export(snapshots, format=kind, options=options, out=out, frames_per_shard=2)


def begun(partial: Path, number: int) -> bool:
    return any((partial / "shards").glob(f"{number:05d}.*.tmp"))


@pytest.mark.parametrize(("kind", "images"), [("coco", "link"), ("yolo", "rectify"), ("voc", "copy")])
def test_the_bytes_are_those_of_a_local_export(
    running, make_snapshot: Make, tree: Tree, tmp_path: Path, kind: str, images: str
) -> None:
    snapshots = [make_snapshot(8), make_snapshot(3, sid="s2", classes=("duck",))]
    run_export(plan_of(*snapshots, out=tmp_path / "here", format=kind, images=images))
    seen: list[tuple[int, int]] = []
    run_export(
        plan_of(*snapshots, out=tmp_path / "there", format=kind, images=images),
        cluster=running.cluster,
        on_progress=lambda done, total: seen.append((done, total)),
    )
    assert tree(tmp_path / "there") == tree(tmp_path / "here")
    assert (seen[0], seen[-1]) == ((0, 11), (11, 11))
    assert not partial_folder(tmp_path / "there").exists()


def test_the_command_line_exports_on_a_cluster(running, demo_recording, tree: Tree, tmp_path: Path) -> None:
    def run(*arguments: object) -> str:
        line = [sys.executable, "-m", "ars_web", *map(str, arguments), "--sessions", str(tmp_path / "sessions")]
        return subprocess.run(line, capture_output=True, text=True, check=True, env=running.environment).stdout

    sid = run("import", demo_recording.folder).split()[-1]
    run("export", sid, "--format", "coco", "--out", tmp_path / "here")
    run("export", sid, "--format", "coco", "--out", tmp_path / "there", *running.options())
    assert tree(tmp_path / "there") == tree(tmp_path / "here")


def test_a_worker_killed_in_the_middle_costs_its_shard_and_nothing_else(
    running, faults: Path, make_snapshot: Make, tree: Tree, tmp_path: Path
) -> None:
    snapshot = make_snapshot(10)
    run_export(plan_of(snapshot, out=tmp_path / "here", format="coco"))
    plan = plan_of(snapshot, out=tmp_path / "there", format="coco")
    (faults / "hold-1").touch()
    killed: list[int] = []

    def kill(done: int, total: int) -> None:
        # The others are done, and a worker is in the shard that is held: which of the two, one of them tells by dying.
        if done == 8 and not killed:
            wait_for(lambda: begun(partial_folder(plan.out), 1))
            for name in ("first", "second"):
                process = running.process_of(name)
                process.send_signal(signal.SIGKILL)
                killed.append(process.pid)
            (faults / "hold-1").unlink()

    run_export(plan, cluster=running.cluster, on_progress=kill)
    assert len(killed) == 2
    assert tree(tmp_path / "there") == tree(tmp_path / "here")
    until(running, lambda names: len(names) == 2)


@pytest.mark.parametrize("kill", [False, True])
def test_the_files_on_a_store_are_those_of_a_local_export(
    running, faults: Path, make_snapshot: Make, tmp_path: Path, kill: bool
) -> None:
    snapshot, target = make_snapshot(10), store_folder(f"s3://bucket/{tmp_path.name}/set")
    run_export(plan_of(snapshot, out=tmp_path / "here", format="coco"))
    options = ExportOptions()
    plan = plan_stored_export([snapshot], format="coco", options=options, frames_per_shard=2)
    shard = partial_of(target).below("shards/00001")
    killed: list[int] = []
    if kill:
        (faults / "hold-1").touch()

    def disturb(done: int, total: int) -> None:
        if kill and done == 8 and not killed:
            wait_for(lambda: shard.names() != [])
            for name in ("first", "second"):
                process = running.process_of(name)
                process.send_signal(signal.SIGKILL)
                killed.append(process.pid)
            (faults / "hold-1").unlink()

    run_stored_export(plan, target, cluster=running.cluster, on_progress=disturb)
    assert len(killed) == (2 if kill else 0)
    files = (path for path in (tmp_path / "here").rglob("*") if path.is_file())
    here = {path.relative_to(tmp_path / "here").as_posix(): path.read_bytes() for path in files}
    assert {name: target.read(name) for name in target.names()} == here
    assert partial_of(target).names() == []
    until(running, lambda names: len(names) == 2)


def wait_for(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_a_shard_that_kills_its_workers_is_named(running, faults: Path, make_snapshot: Make, tmp_path: Path) -> None:
    (faults / "poison-1").touch()
    try:
        with pytest.raises(ArsError, match="shard 00001 killed its worker 3 times: frames 2 to 3 of session s1"):
            run_export(plan_of(make_snapshot(8), out=tmp_path / "d"), cluster=running.cluster)
    finally:
        (faults / "poison-1").unlink()
    assert [path.name for path in tmp_path.iterdir()] == ["recording-s1"]
    until(running, lambda names: len(names) == 2)


def test_a_fault_in_a_shard_is_told_as_here(running, make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(6)
    plan = plan_of(snapshot, out=tmp_path / "d")
    snapshot.frames.images[3].write_bytes(snapshot.frames.images[2].read_bytes())
    with pytest.raises(BadFile, match=r"0003\.jpg: the image changed since"):
        run_export(plan, cluster=running.cluster)
    assert [path.name for path in tmp_path.iterdir()] == ["recording-s1"]


def test_a_cancelled_export_leaves_nothing(running, faults: Path, make_snapshot: Make, tmp_path: Path) -> None:
    plan = plan_of(make_snapshot(40), out=tmp_path / "d")
    (faults / "hold-0").touch()

    def cancelled() -> bool:
        if not begun(partial_folder(plan.out), 0):
            return False
        (faults / "hold-0").unlink(missing_ok=True)
        return True

    with pytest.raises(Cancelled):
        run_export(plan, cluster=running.cluster, cancelled=cancelled)
    assert [path.name for path in tmp_path.iterdir()] == ["recording-s1"]


class Stopped(Exception):
    """Stands for Ctrl-C."""


def test_an_export_that_was_stopped_goes_on_where_it_was(
    running, make_snapshot: Make, tree: Tree, tmp_path: Path
) -> None:
    snapshot = make_snapshot(12)
    run_export(plan_of(snapshot, out=tmp_path / "here"))
    plan = plan_of(snapshot, out=tmp_path / "there")

    def stop(done: int, total: int) -> None:
        if done >= 4:
            raise Stopped

    with pytest.raises(Stopped):
        run_export(plan, cluster=running.cluster, on_progress=stop)
    # A cluster that is out of order meanwhile takes nothing of it away.
    with pytest.raises(BadInput, match="TLS"):
        run_export(plan, cluster=Cluster(running.address))
    seen: list[int] = []
    run_export(plan, cluster=running.cluster, on_progress=lambda done, total: seen.append(done))
    assert min(seen, default=12) >= 4  # nothing is left to do where the workers were quick
    assert tree(tmp_path / "there") == tree(tmp_path / "here")


@pytest.mark.parametrize(
    ("program", "says"),
    [
        ('__version__ = "9.9.9"', f"stranger .* has version 9.9.9 of this program, and this is {__version__}"),
        ('raise ImportError("not here")', "stranger .* does not have this program: install"),
    ],
)
def test_a_worker_without_this_program_is_named_before_any_shard(
    running, make_snapshot: Make, tmp_path: Path, program: str, says: str
) -> None:
    package = tmp_path / "elsewhere" / "ars_web"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text(program)
    running.start("stranger", cwd=tmp_path, PYTHONPATH=str(package.parent))
    try:
        until(running, lambda names: len(names) == 3)
        progressed: list[int] = []
        with pytest.raises(BadInput, match=f"no shard was run, for 1 of 3 workers cannot do it: {says}"):
            run_export(
                plan_of(make_snapshot(2), out=tmp_path / "d"),
                cluster=running.cluster,
                on_progress=lambda done, total: progressed.append(done),
            )
        assert progressed == []
        assert not partial_folder(tmp_path / "d").exists()
    finally:
        running.stop("stranger")
        until(running, lambda names: len(names) == 2)


def test_workers_that_do_not_see_the_folder_or_the_images_are_named(running, tmp_path: Path) -> None:
    token = tmp_path / "token"
    token.write_text("known")
    with connected(running.cluster) as connection:
        connection.check_workers(str(token), "known", images=[str(token)])
        with pytest.raises(BadInput, match=rf"2 of 2 workers.*first .*does not see {tmp_path}: the dataset must lie"):
            connection.check_workers(str(token), "other", images=[])
        with pytest.raises(BadInput, match=r"second .*does not see the image /nowhere/0.jpg"):
            connection.check_workers(str(token), "known", images=["/nowhere/0.jpg"])


def test_a_worker_of_another_python_is_named(running, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clusters, "_release", lambda versions: "3.99" if "host" not in versions else "3.11")
    with connected(running.cluster) as connection:
        real = connection._client.get_versions
        monkeypatch.setattr(connection._client, "get_versions", lambda: {**real(), "client": {}})
        with pytest.raises(BadInput, match=r"first \(tls:.*\) runs Python 3.11, and this is 3.99"):
            connection.check_workers("/token", "x", images=[])


def test_a_cluster_without_workers_is_said_so(dask_cluster: ModuleType, make_snapshot: Make, tmp_path: Path) -> None:
    with dask_cluster.running_cluster(tmp_path / "cluster", {}) as cluster:
        plan = plan_of(make_snapshot(2), out=tmp_path / "d")
        with pytest.raises(BadInput, match="has no workers; start some"):
            run_export(plan, cluster=cluster.cluster)
        # And one that does not know who is asking.
        strangers = dask_cluster.make_certificates(tmp_path / "strangers")
        with pytest.raises(BadInput, match="cannot be reached"):
            run_export(plan, cluster=Cluster(cluster.address, strangers.ca_file, strangers.cert, strangers.key))
    assert not partial_folder(plan.out).exists()


def test_a_cluster_that_goes_away_leaves_what_is_done(
    running, make_snapshot: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(clusters, "_LOOK_EVERY", 0.0)
    monkeypatch.setattr(clusters, "SECONDS_WITHOUT_WORKERS", 0.0)
    gone = threading.Event()
    real = clusters.Connection._workers
    monkeypatch.setattr(clusters.Connection, "_workers", lambda self: {} if gone.is_set() else real(self))
    plan = plan_of(make_snapshot(8), out=tmp_path / "d")
    with pytest.raises(StoreError, match=r"no workers any more; what is done stays in"):
        run_export(plan, cluster=running.cluster, on_progress=lambda done, total: gone.set() if done else None)
    assert partial_folder(plan.out).exists()


def test_a_scheduler_that_is_not_there_is_said_so(
    dask_cluster: ModuleType, make_snapshot: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(clusters, "SECONDS_TO_REACH", 0.5)
    files = dask_cluster.make_certificates(tmp_path / "tls")
    # Nobody answers, and one who answers nothing.
    with socket.create_server(("127.0.0.1", 0)) as silent:
        for port in (1, silent.getsockname()[1]):
            cluster = Cluster(f"tls://127.0.0.1:{port}", files.ca_file, files.cert, files.key)
            with pytest.raises(BadInput, match=rf"127.0.0.1:{port} cannot be reached: .*is it running"):
                run_export(plan_of(make_snapshot(1), out=tmp_path / "d"), cluster=cluster)
    assert not partial_folder(tmp_path / "d").exists()


@pytest.mark.parametrize("executor", ["tcp://192.0.2.7:8786", "tcp://scheduler:8786", "tcp://[2001:db8::1]:8786"])
def test_a_plain_port_off_this_machine_is_refused(executor: str) -> None:
    with pytest.raises(BadInput, match=r"a plain port runs the code of anyone who reaches it.*tls://HOST:PORT"):
        cluster_at(executor)


@pytest.mark.parametrize("executor", ["", "remote", "tls://host", "tls://a b:1", "tls://host:1/x", "tls://u@host:1"])
def test_what_is_no_scheduler_is_refused(executor: str) -> None:
    with pytest.raises(BadInput, match=r"give local, or a Dask scheduler as tls://HOST:PORT"):
        cluster_at(executor)


def test_executors_that_are_taken(dask_cluster: ModuleType, tmp_path: Path) -> None:
    assert cluster_at("local") is None
    for executor in ("tcp://127.0.0.1:8786", "tcp://localhost:8786", "tcp://[::1]:8786", "tls://far:8786"):
        assert checked_executor(executor) == executor
    files = dask_cluster.make_certificates(tmp_path / "tls")
    assert cluster_at("tls://far:1", ca_file=files.ca_file, cert=files.cert, key=files.key) == Cluster(
        "tls://far:1", files.ca_file, files.cert, files.key
    )
    with pytest.raises(BadInput, match="--tls-key is missing"):
        cluster_at("tls://far:1", ca_file=files.ca_file, cert=files.cert)
    with pytest.raises(BadInput, match=r"--tls-cert .*nothing: there is no such file"):
        cluster_at("tls://far:1", ca_file=files.ca_file, cert=tmp_path / "nothing", key=files.key)
    with pytest.raises(BadInput, match="--tls-key is for a cluster"):
        cluster_at("local", key=files.key)
    broken = Cluster("tls://127.0.0.1:1", files.ca_file, files.key, files.key)
    with pytest.raises(BadInput, match=r"the TLS files for tls://127.0.0.1:1 cannot be used"), connected(broken):
        pass


def test_without_dask_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(BadInput, match=r"`distributed`, which is not installed.*ars-web\[cluster\]"):
        cluster_at("tls://host:8786")
