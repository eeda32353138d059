"""kill -9 in the middle of exports: the finished dataset is byte for byte that of an undisturbed one.

Each test runs twice: as it is, and with one protection taken away, where it must see the damage.
"""

import hashlib
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import psutil
import pytest

from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.recordings.recording import Frame, Recording
from ars_web.sessions.editing import BoxDraft, SessionEditor
from ars_web.sessions.store import SessionStore

SCRIPT = Path(__file__).with_name("kill_export.py")
CHECKOUT = Path(__file__).parents[2]
FRAMES = 240
PATIENCE = 120.0


@dataclass(frozen=True)
class Recorded:
    """A sessions folder, a session in it, and the digests of its undisturbed datasets by format."""

    sessions: Path
    sid: str
    whole: dict[str, dict[str, str]]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    folder = tmp_path_factory.mktemp("kill")
    camera = Camera(640, 480, 500.0, 500.0, 320.0, 240.0, "brown", (-0.2, 0.05, 0.001, -0.001, 0.0))
    random = np.random.default_rng(0)
    frames: list[Frame] = []
    for i in range(FRAMES):
        texture = random.integers(0, 255, (30, 40, 3), dtype=np.uint8)
        path = folder / "images" / f"{i:04d}.jpg"
        path.parent.mkdir(exist_ok=True)
        assert cv2.imwrite(str(path), cv2.resize(texture, (640, 480)))
        T = rigid_transform.from_rotation(np.eye(3), np.array([0.002 * i - 0.2, 0.0, -1.0]))
        frames.append(Frame(path.name, path, 0, T))
    with SessionStore(folder / "sessions") as store:
        sid = store.create(Recording("poses", folder, {0: camera}, tuple(frames), class_names=("cube",)), name="r").id
        drafts = [
            BoxDraft(0, Box(rigid_transform.from_rotation(np.eye(3), np.array([0.3 * i, 0, 0])), np.full(3, 0.2)), None)
            for i in range(3)
        ]
        SessionEditor(store).add_boxes(sid, drafts, author="test")
    whole: dict[str, dict[str, str]] = {}
    for kind in ("yolo", "coco"):
        out = folder / f"whole-{kind}"
        with running("export", folder / "sessions", sid, out, kind) as process:
            assert process.wait(PATIENCE) == 0
        whole[kind] = digests(out)
    return Recorded(folder / "sessions", sid, whole)


def digests(folder: Path) -> dict[str, str]:
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


@contextmanager
def running(*arguments: object) -> Iterator[subprocess.Popen[str]]:
    """The script in a process; whatever is left of it and its workers ends with the block."""
    command = [sys.executable, str(SCRIPT), *map(str, arguments)]
    # The script runs the ars_web beside it, whether or not one is installed.
    search = {**os.environ, "PYTHONPATH": str(CHECKOUT)}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=search)
    seen: set[psutil.Process] = set()
    stop = threading.Event()

    def watch() -> None:
        while not stop.wait(0.02):
            with suppress(psutil.NoSuchProcess):
                seen.update(psutil.Process(process.pid).children(recursive=True))

    watcher = threading.Thread(target=watch)
    watcher.start()
    try:
        yield process
    finally:
        stop.set()
        watcher.join()
        process.kill()
        process.wait()
        assert process.stdout
        process.stdout.close()
        for child in seen:
            with suppress(psutil.NoSuchProcess):
                child.kill()


def wait_for(condition: Callable[[], object], process: subprocess.Popen[str]) -> None:
    deadline, moment = time.monotonic() + PATIENCE, threading.Event()
    while not condition():
        assert process.poll() is None, f"the export ended too early, with {process.returncode}"
        assert time.monotonic() < deadline
        moment.wait(0.002)


def whole_shards(partial: Path) -> list[Path]:
    return list(partial.glob("shards/?????/shard.json"))


def begun(partial: Path) -> bool:
    """Whether some shard holds some of its images, but not nearly all, and another is whole."""
    unfinished = (f for f in partial.glob("shards/?????*") if not (f / "shard.json").exists())
    return len(whole_shards(partial)) >= 1 and any(2 <= images_in(folder) <= 6 for folder in unfinished)


def images_in(shard: Path) -> int:
    try:
        return sum(1 for _ in shard.glob("files/images/**/*.jpg"))
    except FileNotFoundError:
        return 0  # it was put in its place, under another name, while it was looked at


def workers_of(process: subprocess.Popen[str]) -> list[psutil.Process]:
    children = psutil.Process(process.pid).children(recursive=True)
    return [child for child in children if "spawn_main" in " ".join(child.cmdline())]


@pytest.mark.parametrize("kind", ["yolo", "coco"])
def test_a_killed_worker_costs_its_shard_and_nothing_else(recorded: Recorded, tmp_path: Path, kind: str) -> None:
    out = tmp_path / "d"
    with running("export", recorded.sessions, recorded.sid, out, kind) as process:
        wait_for(lambda: begun(tmp_path / ".d.partial"), process)
        workers_of(process)[0].kill()
        assert process.wait(PATIENCE) == 0
    assert digests(out) == recorded.whole[kind]
    assert [path.name for path in tmp_path.iterdir()] == ["d"]


def test_without_a_second_try_a_killed_worker_ends_the_export(recorded: Recorded, tmp_path: Path) -> None:
    out = tmp_path / "d"
    with running("--once", "export", recorded.sessions, recorded.sid, out, "yolo") as process:
        wait_for(lambda: begun(tmp_path / ".d.partial"), process)
        workers_of(process)[0].kill()
        assert process.wait(PATIENCE) != 0
    assert not out.exists()


def killed_and_run_again(recorded: Recorded, out: Path, kind: str, *faults: str, kills: int = 1) -> int:
    """Kill the exporting process in the middle, `kills` times, then let it end; its exit status."""
    partial = out.parent / f".{out.name}.partial"
    arguments = (*faults, "export", recorded.sessions, recorded.sid, out, kind)
    for _ in range(kills):
        with running(*arguments) as process:
            wait_for(lambda: begun(partial), process)
            process.send_signal(signal.SIGKILL)
            process.wait()
        assert not out.exists()
    done = len(whole_shards(partial))
    assert 0 < done < FRAMES // 10
    with running(*arguments) as process:
        return process.wait(PATIENCE)


@pytest.mark.parametrize(("kind", "kills"), [("yolo", 3), ("coco", 1)])
def test_an_export_that_was_killed_goes_on(recorded: Recorded, tmp_path: Path, kind: str, kills: int) -> None:
    out = tmp_path / "d"
    assert killed_and_run_again(recorded, out, kind, kills=kills) == 0
    assert digests(out) == recorded.whole[kind]
    assert [path.name for path in tmp_path.iterdir()] == ["d"]


def test_shards_written_in_place_are_torn_by_a_kill(recorded: Recorded, tmp_path: Path) -> None:
    out = tmp_path / "d"
    status = killed_and_run_again(recorded, out, "yolo", "--in-place")
    assert status != 0 or digests(out) != recorded.whole["yolo"]


def orphans_after_a_kill(recorded: Recorded, out: Path, *faults: str) -> list[psutil.Process]:
    """The workers that still run five seconds after their parent was killed."""
    with running(*faults, "export", recorded.sessions, recorded.sid, out, "yolo") as process:
        wait_for(lambda: begun(out.parent / f".{out.name}.partial"), process)
        workers = workers_of(process)
        assert workers
        process.send_signal(signal.SIGKILL)
        process.wait()
        _, alive = psutil.wait_procs(workers, timeout=5)
        return alive


def test_workers_end_with_their_parent(recorded: Recorded, tmp_path: Path) -> None:
    assert orphans_after_a_kill(recorded, tmp_path / "d") == []


def test_workers_that_do_not_watch_their_parent_stay(recorded: Recorded, tmp_path: Path) -> None:
    assert orphans_after_a_kill(recorded, tmp_path / "d", "--no-watch") != []


def test_a_killed_server_goes_on_with_its_jobs(recorded: Recorded, tmp_path: Path) -> None:
    with running("serve", recorded.sessions, recorded.sid, "coco") as process:
        assert process.stdout
        folder = recorded.sessions / ".exports" / process.stdout.readline().strip()
        wait_for(lambda: begun(folder / ".dataset.partial"), process)
        process.send_signal(signal.SIGKILL)
        process.wait()
    assert not (folder / "dataset").exists()
    before = {os.fspath(path): path.stat().st_mtime_ns for path in whole_shards(folder / ".dataset.partial")}
    assert before
    with running("serve", recorded.sessions) as process:
        assert process.wait(PATIENCE) == 0
    assert digests(folder / "dataset") == recorded.whole["coco"]
    assert '"state":"done"' in (folder / "job.json").read_text()
