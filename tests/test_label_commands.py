"""`ars-web labels import`, on a recording in a ring of cameras."""

import json
from pathlib import Path
from types import ModuleType

import pytest

from ars_web.cli import run
from ars_web.recordings.registry import read_recording
from ars_web.sessions.store import SessionStore


@pytest.fixture
def sessions(tmp_path: Path, ring_scene: ModuleType) -> Path:
    """A folder with the session `ring`."""
    recording = read_recording(ring_scene.write(tmp_path / "ring"))
    with SessionStore(tmp_path / "sessions") as store:
        store.create(recording, name="ring")
    return tmp_path / "sessions"


@pytest.fixture
def scene(bop_scene: ModuleType, ring_scene: ModuleType, tmp_path: Path) -> Path:
    """A BOP scene of which one kind of object has no model, and one pose is of an image that the session lacks."""
    scene = bop_scene.write(ring_scene, tmp_path / "bop", images=False)
    models = scene.parents[1] / "models" / "models_info.json"
    known = json.loads(models.read_text())
    del known["7"]
    models.write_text(json.dumps(known))
    return scene


def labels(sessions: Path, *arguments: str) -> int:
    return run(["labels", "import", "ring", *arguments, "--sessions", str(sessions)])


def boxes_in(sessions: Path) -> list[str]:
    with SessionStore(sessions) as store:
        return [box.name for box in store.state(store.find("ring")).boxes.values()]


def test_what_came_in_and_what_did_not_is_printed(
    sessions: Path, scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert labels(sessions, str(scene)) == 0
    out, err = capsys.readouterr()
    lines = [line.split() for line in out.splitlines()]
    assert lines[1][:7] == ["obj_000001", "obj_000001", "poses", "0", "60.0", "x", "40.0"]
    assert "2 boxes and 0 masks came in (bop), new classes: obj_000001" in out
    assert lines[-1][0] == "6"
    assert "its size is not known" in out
    assert "image 0, object 2 (obj_id 7)" in out
    assert "digits in a frame's name" in err
    assert boxes_in(sessions) == ["obj_000001", "obj_000001 2"]


def test_a_dry_run_stores_nothing_and_json_says_the_same(
    sessions: Path, scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert labels(sessions, str(scene), "--dry-run") == 0
    assert "2 boxes and 0 masks would come in" in capsys.readouterr().out
    assert labels(sessions, str(scene), "--dry-run", "--json") == 0
    said = json.loads(capsys.readouterr().out)
    assert (said["boxes"], said["masks"], said["revision"]) == (2, 0, None)
    assert (said["left_out"][0]["count"], len(said["left_out"][0]["examples"])) == (6, 3)
    assert boxes_in(sessions) == []


@pytest.mark.parametrize(
    ("arguments", "status", "said"),
    [
        (("nowhere",), 1, "nowhere: is missing"),
        ((".",), 1, "holds no labels that are known"),
        ((".", "--format", "kitti"), 2, "'kitti' is none of auto, bop, coco, cvat, voc, yolo"),
    ],
)
def test_what_cannot_be_read_is_one_line(
    sessions: Path, arguments: tuple[str, ...], status: int, said: str, tmp_path: Path, monkeypatch, capsys
) -> None:
    (tmp_path / "empty").mkdir()
    monkeypatch.chdir(tmp_path / "empty")
    assert labels(sessions, *arguments) == status
    assert said in capsys.readouterr().err
