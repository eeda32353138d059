"""The demo as a user meets it: the generated recording as a session, with datasets and pictures made from it."""

import json
import shutil
from collections.abc import Callable
from contextlib import AbstractContextManager
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


@dataclass(frozen=True)
class Demonstration:
    """Where everything is, absolute."""

    recording: Path
    session: str
    datasets: dict[str, Path]
    pictures: Path


def prepare(sessions: Path, *, show: Callable[[str], AbstractContextManager[OnProgress]]) -> Demonstration:
    """The demo in a sessions folder: made where it is not there yet, exported anew where its session was changed.

    `show` opens a display of progress under a title.

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
        snapshot = store.snapshot(made.id)

    demonstration = Demonstration(recording, made.id, {name: home / name for name in DATASETS}, home / "pictures")
    folders = (*demonstration.datasets.values(), demonstration.pictures)
    stamp = {"session": snapshot.id, "revision": snapshot.state.revision, "version": ars_web.__version__}
    if all(folder.is_dir() for folder in folders) and _read_stamp(home / MADE_FROM) == stamp:
        return demonstration

    (home / MADE_FROM).unlink(missing_ok=True)
    for folder in folders:
        shutil.rmtree(folder, ignore_errors=True)
    for name, folder in demonstration.datasets.items():
        plan = plan_export([snapshot], format=name, options=ExportOptions(), out=folder)  # pyright: ignore[reportCallIssue]
        with show(f"Exporting {name}") as advance:
            run_export(plan, on_progress=advance)
    preview(snapshot, demonstration.pictures)
    (home / MADE_FROM).write_text(json.dumps(stamp))
    return demonstration


def _read_stamp(path: Path) -> object:
    try:
        return json.loads(path.read_text())
    except (OSError, ValueError):
        return None
