"""`ars-web report`, on a recording in a ring of cameras."""

import json
from pathlib import Path
from types import ModuleType

import pytest

from ars_web.cli import run
from ars_web.recordings.registry import read_recording
from ars_web.sessions.store import SessionStore


@pytest.fixture
def sessions(tmp_path: Path, ring_scene: ModuleType, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the session `the ring`, which has a ball; the folder above it is the current one."""
    recording = read_recording(ring_scene.write(tmp_path / "ring"))
    with SessionStore(tmp_path / "sessions") as store:
        store.create(recording, name="the ring", class_names=("ball",))
    box = {
        "class_id": 0,
        "name": "the ball",
        "T_world_box": {"position": list(ring_scene.CENTRE), "wxyz": [1, 0, 0, 0]},
        "size": [0.08, 0.08, 0.08],
    }
    (tmp_path / "boxes.json").write_text(json.dumps([box]))
    assert (
        run(["boxes", "import", "the ring", str(tmp_path / "boxes.json"), "--sessions", str(tmp_path / "sessions")])
        == 0
    )
    monkeypatch.chdir(tmp_path)
    return tmp_path / "sessions"


def report(sessions: Path, *arguments: str) -> int:
    return run(["report", "the ring", *arguments, "--sessions", str(sessions)])


def test_a_page_is_written_here_and_its_warnings_are_printed(
    sessions: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    assert report(sessions) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1] == "the_ring-report.html"
    assert lines[0].startswith(("warning: ", "grave: "))
    page = Path("the_ring-report.html").read_text()
    assert "the ring: before training" in page
    assert page.count("data:image/jpeg;base64,") == 6
    assert report(sessions, "--out", "again.html") == 0
    assert Path("again.html").read_text() == page


def test_json_has_the_facts_and_options_decide_them(sessions: Path, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    assert report(sessions, "--json") == 0
    facts = json.loads(capsys.readouterr().out)
    assert list(Path().glob("*.html")) == []
    assert facts["labels"] == facts["frames"]["chosen"] == facts["frames"]["recorded"]
    assert facts["classes"][0]["sizes"]["histogram"]["edges"][0] == 0
    assert facts["boxes"][0]["size_mm"] == [80.0, 80.0, 80.0]
    options = ["--frames-step", "2", "--split-train", "0.5", "--split-val", "0.25", "--split-test", "0.25"]
    assert report(sessions, "--json", "--out", "some.html", *options) == 0
    fewer = json.loads(capsys.readouterr().out)
    assert fewer["frames"]["chosen"] == -(-facts["frames"]["recorded"] // 2)
    assert list(fewer["splits"]) == ["train", "val", "test"]
    assert Path("some.html").is_file()
    # The command that it names writes what it told of.
    export = [*fewer["command"].split()[1:], "--images", "none", "--workers", "1"]
    assert run([*export, "--sessions", str(sessions), "--json"]) == 0
    written = json.loads(capsys.readouterr().out)["report"]
    assert written["dropped"] == fewer["dropped"]
    assert written["splits"] == {name: split["counts"] for name, split in fewer["splits"].items()}


@pytest.mark.parametrize(
    ("arguments", "code", "says"),
    [
        (["--out", "report.pdf"], 2, "report.pdf does not end in .html"),
        (["--frames-start", "10000"], 1, "no frame is chosen"),
        (["--shape", "mesh"], 1, "needs a mesh"),
        (["--split-train", "0.5"], 2, "train + val + test must be 1"),
        (["--split-by", "session"], 1, "a split by session needs"),
    ],
)
def test_what_cannot_be_is_one_clear_line(
    sessions: Path, arguments: list[str], code: int, says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    assert report(sessions, *arguments) == code
    out, err = capsys.readouterr()
    assert out == ""
    assert says in " ".join(err.split())
    assert list(Path().glob("*.html")) == []


def test_chosen_frames_of_one_side_are_reported_as_the_command_it_names_writes_them(
    sessions: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    choice = ("--frames-sector", "0:180", "--frames-count", "4", "--split-by", "sector", "--split-val", "0.2")
    assert report(sessions, *choice, "--json") == 0
    facts = json.loads(capsys.readouterr().out)
    assert report(sessions, *choice, "--out", "side.html") == 0
    assert "sides that cameras look from" in Path("side.html").read_text()
    assert facts["frames"]["chosen"] == 4
    words = facts["command"].split()
    assert words[words.index("--frames-sector") + 1] == "0.0:180.0"
    assert run([*words[1:], "--sessions", str(sessions)]) == 0
    assert len(list((tmp_path / "dataset" / "images").rglob("*.jpg"))) == 4
