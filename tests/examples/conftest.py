"""`examples` is no installed package: it is found beside the tests. A small exported set that the examples train on.

What trains is looked at where PyTorch is, which is the extra `train`: it is too large to be among what tests need.
"""

import sys
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import pytest

from ars_web.datasets.jobs import plan_export, run_export
from ars_web.datasets.options import ExportOptions
from ars_web.recordings.recording import RecordedBox
from ars_web.recordings.registry import read_recording
from ars_web.sessions.store import SessionStore

collect_ignore = [] if find_spec("torch") else ["test_training.py"]

sys.path.insert(0, str(Path(__file__).parents[2]))


@pytest.fixture(scope="package")
def exported(demo_recording, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the generated recording exported as `coco` and as `yolo`; read only."""
    folder = tmp_path_factory.mktemp("exported")
    boxes = tuple(RecordedBox(thing.class_name, thing.box) for thing in demo_recording.objects)
    recording = read_recording(demo_recording.folder, format="ars")
    recording = replace(recording, class_names=demo_recording.class_names, boxes=boxes)
    with SessionStore(folder / "sessions") as store:
        snapshot = store.snapshot(store.create(recording, name="demo").id)
    for name in ("coco", "yolo"):
        run_export(plan_export([snapshot], format=name, options=ExportOptions(), out=folder / name))
    return folder
