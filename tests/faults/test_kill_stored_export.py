"""kill -9 of an export to a store before its end: a folder with a `dataset.json` is a whole dataset.

The test runs twice: as it is, and with `dataset.json` uploaded first, where it must see the damage.
"""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from ars_web.datasets.jobs import plan_export, run_export
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.store_worker import partial_of
from ars_web.recordings.registry import read_recording
from ars_web.recordings.stores import StoreFolder, store_folder
from ars_web.sessions.store import SessionStore

SCRIPT = Path(__file__).with_name("kill_stored_export.py")
CHECKOUT = Path(__file__).parents[2]
PATIENCE = 120.0


def started(*arguments: object) -> "subprocess.Popen[bytes]":
    line = [sys.executable, str(SCRIPT), *map(str, arguments)]
    return subprocess.Popen(line, env={**os.environ, "PYTHONPATH": str(CHECKOUT)})


@pytest.fixture(scope="module")
def recorded(demo_recording, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str, dict[str, bytes]]:
    """A sessions folder, a session in it, and the files of its undisturbed dataset."""
    folder = tmp_path_factory.mktemp("kill-stored")
    with SessionStore(folder / "sessions") as store:
        sid = store.create(read_recording(demo_recording.folder), name="demo").id
        snapshot = store.snapshot(sid)
    run_export(plan_export([snapshot], format="coco", options=ExportOptions(), out=folder / "whole"))
    files = (path for path in (folder / "whole").rglob("*") if path.is_file())
    whole = {path.relative_to(folder / "whole").as_posix(): path.read_bytes() for path in files}
    return folder / "sessions", sid, whole


def files_of(target: StoreFolder) -> dict[str, bytes]:
    return {name: target.read(name) for name in target.names()}


def killed_before_the_end(sessions: Path, sid: str, target: StoreFolder, mark: Path, *faults: str) -> None:
    process = started(*faults, sessions, sid, target, mark)
    try:
        deadline = time.monotonic() + PATIENCE
        while not mark.exists():
            assert process.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.02)
        process.send_signal(signal.SIGKILL)
    finally:
        process.kill()
        process.wait()


def test_a_killed_export_has_no_manifest_and_goes_on(recorded, s3: dict[str, str], tmp_path: Path) -> None:
    sessions, sid, whole = recorded
    target = store_folder("s3://bucket/killed/d")
    killed_before_the_end(sessions, sid, target, tmp_path / "mark")
    before = target.names()
    assert before != []
    assert "dataset.json" not in before
    assert partial_of(target).has("shards/00002/shard.json")
    process = started(sessions, sid, target, "-")
    assert process.wait(PATIENCE) == 0
    assert files_of(target) == whole
    assert partial_of(target).names() == []


def test_a_manifest_that_comes_first_tells_of_a_dataset_that_is_not_whole(
    recorded, s3: dict[str, str], tmp_path: Path
) -> None:
    sessions, sid, whole = recorded
    target = store_folder("s3://bucket/torn/d")
    killed_before_the_end(sessions, sid, target, tmp_path / "mark", "--document-first")
    assert "dataset.json" in target.names()
    assert files_of(target).keys() != whole.keys()
