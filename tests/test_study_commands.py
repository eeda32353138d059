"""`ars-web coverage`."""

import json
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
def sessions(tmp_path: Path, ring_scene: ModuleType) -> Path:
    """A folder with the session `ring`: twelve frames round a ball, which has a box; nobody made a cube."""
    read = read_recording(ring_scene.write(tmp_path / "ring"))
    T = np.eye(4)
    T[:3, 3] = ring_scene.CENTRE
    ball = RecordedBox("ball", Box(T, np.full(3, 0.08)))
    with SessionStore(tmp_path / "sessions") as store:
        store.create(replace(read, class_names=("ball", "cube"), boxes=(ball,)), name="ring")
    return tmp_path / "sessions"


@pytest.fixture
def command(sessions: Path, capsys: pytest.CaptureFixture[str]) -> Command:
    """What a command about `ring` prints on either stream."""

    def ask(verb: str, *rest: str, status: int = 0) -> tuple[str, str]:
        found = run([verb, "ring", *rest, "--sessions", str(sessions)])
        captured = capsys.readouterr()
        assert found == status, captured.out + captured.err
        return captured.out, captured.err

    return ask


def test_coverage_is_told_object_by_object(command: Command) -> None:
    lines = [line.split() for line in command("coverage", "--azimuth-bins", "12", "--polar-bins", "6")[0].splitlines()]
    assert [line[:2] for line in lines[1:]] == [["box", "ball"], ["class", "ball"]]
    # Twelve views in twelve of 72 bins.
    assert lines[1][2:6] == ["12", "12", "83.3", "%"]


def test_coverage_is_written_as_picture_and_as_json(command: Command, tmp_path: Path) -> None:
    picture, numbers = tmp_path / "c.png", tmp_path / "c.json"
    assert command("coverage", "--class", "ball", "--out", str(picture))[0].splitlines()[-1] == str(picture)
    assert picture.read_bytes().startswith(b"\x89PNG")
    command("coverage", "--box", "1", "--out", str(numbers))
    told = json.loads(command("coverage", "--box", "1", "--json")[0])
    assert json.loads(numbers.read_bytes()) == told
    assert np.array(told["counts"]).shape == (36, 18)
    assert np.array(told["counts"]).sum() == told["frames"] == 12


@pytest.mark.parametrize(
    ("options", "status", "said"),
    [
        (("--out", "c.gif"), 2, "c.gif ends neither in .png nor in .json"),
        (("--box", "0", "--class", "ball"), 2, "not both"),
        (("--box", "7"), 1, "has no box 7; its boxes are: 1 ball"),
        (("--class", "dragon"), 1, "no class 'dragon'"),
        (("--class", "cube"), 1, "class 'cube' has no box: it is never labelled"),
        (("--azimuth-bins", "0"), 2, "'--azimuth-bins': Input should be greater than or equal to 1, not 0 (see"),
        (("--shape", "ball"), 2, "'--shape': 'ball' is not one of 'box', 'hull', 'mesh' (see"),
        (("--min-visible", "2"), 2, "min-visible"),
    ],
)
def test_what_is_wrong_is_said(command: Command, options: tuple[str, ...], status: int, said: str) -> None:
    out, err = command("coverage", *options, status=status)
    assert out == ""
    assert said in err
    assert len(err.splitlines()) == 1


@pytest.mark.parametrize("name", ["c.png", "c.json"])
def test_a_file_is_written_whole_or_not_at_all(command: Command, tmp_path: Path, name: str) -> None:
    new, taken = tmp_path / "new" / name, tmp_path / "taken" / name
    command("coverage", "--out", str(new))
    assert [one.name for one in new.parent.iterdir()] == [name]
    (taken / "inside").mkdir(parents=True)
    _, err = command("coverage", "--out", str(taken), status=1)
    assert err.startswith(f"ars-web: {taken} cannot be written: Is a directory; name a file in a folder")
    assert [one.name for one in taken.parent.iterdir()] == [name]


def test_of_one_box_its_class_is_not_told(command: Command) -> None:
    lines = command("coverage", "--box", "1")[0].splitlines()
    assert [line.split()[:2] for line in lines[1:]] == [["box", "ball"]]
