"""The demo as a user meets it: the generated recording as a session, with datasets and pictures made from it.

The session comes first, so that its page can be opened while another process makes the rest.
"""

import json
import os
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Generator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import ars_web
from ars_web.datasets.jobs import plan_export, run_export
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.preview import preview
from ars_web.demo.recording import make_demo
from ars_web.demo.truth import TRUTH_FILE
from ars_web.recordings.recording import RecordedBox
from ars_web.recordings.registry import read_recording
from ars_web.sessions.store import SessionStore
from ars_web.terminal import OnProgress

FOLDER = ".demo"
"""Within the sessions folder: `recording/`, one folder a dataset, `pictures/`, and MADE_FROM."""

DATASETS = ("yolo", "coco")

MADE_FROM = "made-from.json"
"""Which revision of which session the datasets and pictures show; written last."""

Show = Callable[[str], AbstractContextManager[OnProgress]]
"""Opens a display of progress under a title."""

_GENTLE = 10
"""How much the process beside the server steps back, as `nice` counts it."""


@dataclass(frozen=True)
class Demonstration:
    """Where everything is, absolute."""

    recording: Path
    session: str
    datasets: dict[str, Path]
    pictures: Path

    @property
    def home(self) -> Path:
        """The folder that all but the session lies in."""
        return self.recording.parent

    def lines(self) -> list[str]:
        """What was made of the session, as lines to print."""
        made = [f"dataset   {folder} ({name})" for name, folder in self.datasets.items()]
        return [*made, f"pictures  {self.pictures}"]


def prepare(sessions: Path, *, show: Show) -> Demonstration:
    """The recording and its session in a sessions folder, made where they are not there yet.

    Raises:
        StoreError: the sessions folder cannot be written.
    """
    home = sessions.resolve() / FOLDER
    recording = home / "recording"
    with show("Rendering the recording") as advance:
        truth = make_demo(recording, progress=advance)
    with SessionStore(sessions) as store:
        made = next((summary for summary in store.list() if Path(summary.source) == recording), None)
        if made is not None and made.created.timestamp() < (recording / TRUTH_FILE).stat().st_mtime:
            # A newer version of the program rendered other images, which these boxes do not fit. It can be restored.
            store.delete(made.id)
            made = None
        if made is None:
            boxes = tuple(RecordedBox(o.class_name, o.box) for o in truth.objects)
            read = replace(read_recording(recording, format="ars"), class_names=truth.class_names, boxes=boxes)
            with show("Importing") as advance:
                made = store.create(read, name="demo", progress=advance)
    return Demonstration(recording, made.id, {name: home / name for name in DATASETS}, home / "pictures")


def make_datasets(sessions: Path, demo: Demonstration, *, show: Show) -> None:
    """The datasets and pictures of the demo's session, anew where it was changed since they were made.

    Raises:
        StoreError: the sessions folder cannot be used.
    """
    with SessionStore(sessions) as store:
        snapshot = store.snapshot(demo.session)
    stamp = {"session": snapshot.id, "revision": snapshot.state.revision, "version": ars_web.__version__}
    if _are_made(demo, stamp):
        return
    (demo.home / MADE_FROM).unlink(missing_ok=True)
    for folder in (*demo.datasets.values(), demo.pictures):
        shutil.rmtree(folder, ignore_errors=True)
    for name, folder in demo.datasets.items():
        plan = plan_export([snapshot], format=name, options=ExportOptions(), out=folder)  # pyright: ignore[reportCallIssue]
        with show(f"Exporting {name}") as advance:
            run_export(plan, on_progress=advance)
    preview(snapshot, demo.pictures)
    (demo.home / MADE_FROM).write_text(json.dumps(stamp))


@contextmanager
def making_datasets(sessions: Path, demo: Demonstration, *, tell: Callable[[str], None]) -> Generator[None]:
    """Have another process make the datasets and pictures while the block runs; `tell` is given lines about it.

    Another process, since this one is to answer a page meanwhile. Where the block ends first, the process is stopped;
    the next run goes on.
    """
    # This very command, which ends where it does not serve.
    line = [sys.executable, "-m", "ars_web", "demo", "--no-serve", "--sessions", str(sessions)]
    process = subprocess.Popen(
        line, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )
    os.setpriority(os.PRIO_PROCESS, process.pid, _GENTLE)
    stopped = threading.Event()

    def report() -> None:
        _, said = process.communicate()
        if process.returncode == 0:
            for made in demo.lines():
                tell(made)
        elif not stopped.is_set():
            tell(f"datasets  could not be made: {said.strip().splitlines()[-1] if said.strip() else 'it was stopped'}")

    reporter = threading.Thread(target=report)
    reporter.start()
    try:
        yield
    finally:
        stopped.set()
        if process.poll() is None:
            process.send_signal(signal.SIGTERM)
        reporter.join()


def _are_made(demo: Demonstration, stamp: object) -> bool:
    folders = (*demo.datasets.values(), demo.pictures)
    return all(folder.is_dir() for folder in folders) and _read_stamp(demo.home / MADE_FROM) == stamp


def _read_stamp(path: Path) -> object:
    try:
        return json.loads(path.read_text())
    except (OSError, ValueError):
        return None
