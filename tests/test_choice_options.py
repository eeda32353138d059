"""`ars-web export --dry-run`, and the options that choose frames, on a recording round a ball."""

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from ars_web.cli import run
from ars_web.geometry.box import Box
from ars_web.recordings.recording import RecordedBox
from ars_web.recordings.registry import read_recording
from ars_web.sessions.store import SessionStore

Command = Callable[..., tuple[str, str]]


@pytest.fixture
def command(tmp_path: Path, ring_scene: ModuleType, capsys: pytest.CaptureFixture[str]) -> Command:
    """What `export ring --format yolo` prints on either stream; a second session is called `again`."""
    read = read_recording(ring_scene.write(tmp_path / "ring"))
    T = np.eye(4)
    T[:3, 3] = ring_scene.CENTRE
    read = replace(read, class_names=("ball",), boxes=(RecordedBox("ball", Box(T, np.full(3, 0.08))),))
    with SessionStore(tmp_path / "sessions") as store:
        for name in ("ring", "again"):
            store.create(read, name=name)

    def ask(*options: object, status: int = 0) -> tuple[str, str]:
        line = ["export", "ring", "--format", "yolo", "--sessions", tmp_path / "sessions", *options]
        found = run([str(part) for part in line])
        out, err = capsys.readouterr()
        assert found == status, out + err
        return out, err

    return ask


def chosen(command: Command, *options: object) -> list[list[int]]:
    """The frames of each session that a dry run tells."""
    return list(json.loads(command("--dry-run", "--json", *options)[0])["frames"].values())


def test_a_dry_run_tells_which_frames_and_what_they_cover_and_writes_nothing(command: Command, tmp_path: Path) -> None:
    choice = ("--frames-count", 4, "--frames-near-frames", 1)
    printed, _ = command("--out", tmp_path / "d", "--dry-run", *choice)
    assert not (tmp_path / "d").exists()
    assert re.search(r"frames: 4 of 12 chosen, \d near twins of chosen ones", printed)
    assert "directions: 4 covered, of 12 that all 12 frames show; 4 by as many evenly spaced frames" in printed
    found = json.loads(command("--dry-run", "--json", *choice)[0])
    (frames,) = found["frames"].values()
    assert len(frames) == found["forecast"]["choice"]["chosen"] == 4
    assert (np.diff(frames) > 1).all()
    plain, _ = command("--dry-run")
    assert "directions: 12 covered" in plain


def test_frames_are_chosen_as_asked(command: Command) -> None:
    # Frame i stands i * 30 degrees round, low and high in turn.
    assert chosen(command, "--frames-sector", "0:180") == [[0, 1, 2, 3, 4, 5]]
    assert chosen(command, "--frames-sector", "-45:45", "--frames-sector-box", 1) == [[0, 1, 11]]
    assert chosen(command, "--frames-count", 3, "--frames-by", "even") == [[2, 6, 10]]
    assert chosen(command, "--frames-near-degrees", 40) == [[0, 2, 4, 6, 8, 10]]


def test_a_recording_is_held_out_by_name(command: Command) -> None:
    line = ("--dry-run", "--merge", "again", "--split-by", "session", "--split-hold-out")
    rows = [row.split()[:2] for row in command(*line, "ring")[0].splitlines()[1:3]]
    assert rows == [["train", "12"], ["val", "12"]]
    assert "all sessions are held out" in command(*line, "ring,again", status=1)[1]
    assert "to be held out, but is not in this export" in command(*line[:1], *line[3:], "again", status=1)[1]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--frames-count", "0"), "--frames-count"),
        (("--frames-near-degrees", "-1"), "--frames-near-degrees"),
        (("--frames-near-degrees", "nan"), "--frames-near-degrees"),
        (("--frames-sector", "90"), "such as 0:180"),
        (("--frames-sector", "nan:9"), "--frames-sector"),
        (("--frames-sector", "9:9"), "the sector from 9 to 9 degrees is empty"),
        (("--frames-by", "even"), "give a count"),
        (("--split-hold-out", "again"), "split by 'session'"),
        (("--check",), "--check"),
    ],
)
def test_what_cannot_be_is_refused(command: Command, options: tuple[str, ...], said: str) -> None:
    out, err = command("--dry-run", *options, status=2)
    assert out == ""
    assert said in err


def test_only_a_dry_run_does_without_a_folder(command: Command) -> None:
    assert "--out" in command(status=2)[1]


def test_a_choice_that_leaves_nothing_says_what_took_it(command: Command) -> None:
    assert "the cameras of all 12 stand outside the sector from 1 to 2" in command(
        "--dry-run", "--frames-sector", "1:2", status=1
    )[1].replace("\n", " ")
