"""Every format's files, byte by byte, as they were looked at once and found right.

Where a format changes on purpose, write the files anew from the folder that the failure names, and look at them.
"""

from collections.abc import Callable
from pathlib import Path

import cv2
import pytest

from ars_web import __version__
from ars_web.datasets.jobs import plan_export, run_export
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.registry import WRITERS
from ars_web.sessions.model import SessionSnapshot

GOLDEN = Path(__file__).parents[1] / "golden"


@pytest.mark.parametrize("kind", WRITERS)
def test_files_are_the_golden_ones(make_snapshot: Callable[..., SessionSnapshot], tmp_path: Path, kind: str) -> None:
    options = ExportOptions.model_validate(
        {"images": "none", "frames": {"step": 3}, "split": {"train": 0.5, "val": 0.25, "test": 0.25, "seed": 7}}
    )
    snapshot = make_snapshot(12, classes=("cube", 'a "tall" & <odd> one: #1'))
    out = tmp_path / kind
    run_export(plan_export([snapshot], format=kind, options=options, out=out, frames_per_shard=2))
    found = _contents(out)
    # The version is the one thing in it that changes by itself.
    found["dataset.json"] = found["dataset.json"].replace(f'"version": "{__version__}"', '"version": "VERSION"')
    golden = GOLDEN / kind
    assert found == _contents(golden)


def _contents(folder: Path) -> dict[str, str]:
    """Every file's text by its path; of images the pixels, which encoders may pack as they like; of other files that
    are no text, the bytes in Python's notation."""
    found: dict[str, str] = {}
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        content = path.read_bytes()
        if path.suffix == ".png":
            found[str(path.relative_to(folder))] = repr(cv2.imread(str(path), cv2.IMREAD_UNCHANGED).tolist())
            continue
        try:
            found[str(path.relative_to(folder))] = content.decode()
        except UnicodeDecodeError:
            found[str(path.relative_to(folder))] = repr(content)
    return found
