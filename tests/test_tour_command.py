"""`ars-web tour`."""

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from ars_web.cli import run
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.symmetry import turn_about
from ars_web.recordings.recording import RecordedBox
from ars_web.recordings.registry import read_recording
from ars_web.sessions.store import SessionStore

Command = Callable[..., tuple[str, str]]
FEW = ("--azimuth-bins", "12", "--polar-bins", "6")


def make_session(folder: Path, ring_scene: ModuleType) -> Path:
    """The sessions folder in `folder`, with the session `ring` of the recording `ring` beside it: twelve frames round
    a ball, from a camera that is held a little before the wrist. The ball has a box, and nobody made a cube."""
    recording = ring_scene.write(folder / "ring")
    (recording / "camera_extrinsics.txt").write_text("0 0 0.1 0 0 0 1\n")
    T = np.eye(4)
    T[:3, 3] = ring_scene.CENTRE
    ball = RecordedBox("ball", Box(T, np.full(3, 0.08)))
    with SessionStore(folder / "sessions") as store:
        store.create(replace(read_recording(recording), class_names=("ball", "cube"), boxes=(ball,)), name="ring")
    return folder / "sessions"


@pytest.fixture(scope="module")
def sessions(tmp_path_factory: pytest.TempPathFactory, ring_scene: ModuleType) -> Path:
    return make_session(tmp_path_factory.mktemp("tour"), ring_scene)


@pytest.fixture
def command(sessions: Path, capsys: pytest.CaptureFixture[str]) -> Command:
    """What `ars-web tour ring` prints on either stream."""

    def ask(*rest: str, status: int = 0, sessions: Path = sessions) -> tuple[str, str]:
        found = run(["tour", "ring", *rest, "--sessions", str(sessions)])
        captured = capsys.readouterr()
        assert found == status, captured.out + captured.err
        return captured.out, captured.err

    return ask


def test_views_are_listed_with_what_they_keep_to(command: Command) -> None:
    lines = command("--class", "ball", "--count", "4", "--tilt", "10:60", *FEW)[0].splitlines()
    assert [line.split()[:2] for line in lines[1:5]] == [[str(i), "ball"] for i in range(1, 5)]
    assert "tilt 10 to 60 degrees;" in lines[5]
    assert "m (as the frames)" in lines[5]
    assert lines[6].startswith("4 views fill 4 of ")
    assert any("cells stay empty: further views would fill them" in line for line in lines[7:])


def test_json_and_wrist_poses_are_written(command: Command, tmp_path: Path) -> None:
    numbers, poses = tmp_path / "tour.json", tmp_path / "tour.txt"
    told = json.loads(command("--box", "1", "--count", "3", "--json", "--out", str(numbers), *FEW)[0])
    assert json.loads(numbers.read_bytes()) == told
    assert len(told["views"]) == told["cells_filled"] == 3
    assert told["cells_filled"] + len(told["cells_left"]) == told["cells_empty"] < told["cells"] == 72
    assert told["limits"]["from_recording"] == ["distance", "height", "tilt"]
    assert (
        math.radians(10) < told["limits"]["tilt"][0] < math.radians(20) < math.radians(45) < told["limits"]["tilt"][1]
    )
    assert command("--box", "1", "--count", "3", "--out", str(poses), *FEW)[0].splitlines()[-1] == str(poses)
    rows = [[float(word) for word in line.split()] for line in poses.read_text().splitlines()]
    for row, view in zip(rows, told["views"], strict=True):
        wrist = rigid_transform.from_position_wxyz(np.array(row[:3]), np.array([row[6], *row[3:6]]))
        camera = view["T_world_camera"]
        T_world_camera = rigid_transform.from_position_wxyz(np.array(camera["position"]), np.array(camera["wxyz"]))
        T_wrist_camera = rigid_transform.from_rotation(np.eye(3), np.array([0.0, 0.0, 0.1]))
        assert wrist @ T_wrist_camera == pytest.approx(T_world_camera)
        assert view["T_world_wrist"]["position"] == pytest.approx(row[:3])


def test_the_camera_in_the_wrist_can_be_given(command: Command, tmp_path: Path, ring_scene: ModuleType) -> None:
    sessions, given, out = make_session(tmp_path, ring_scene), tmp_path / "hand_eye.txt", tmp_path / "tour.txt"
    (tmp_path / "ring" / "camera_extrinsics.txt").unlink()
    _, err = command("--out", str(out), *FEW, status=1, sessions=sessions)
    assert "is to hold poses of the wrist, but" in err
    assert "camera_extrinsics.txt: is missing; give --hand-eye FILE, or write a .json" in err
    assert not out.exists()
    (view,) = json.loads(command("--count", "1", "--json", *FEW, sessions=sessions)[0])["views"]
    assert view["T_world_wrist"] is None
    given.write_text("0 0 0 0 0 0 1\n")
    (view,) = json.loads(command("--count", "1", "--json", "--hand-eye", str(given), *FEW)[0])["views"]
    assert view["T_world_wrist"] == view["T_world_camera"]
    given.write_text("0 0 0 0 0 0\n")
    assert "hand_eye.txt:1: has 6 values" in command("--hand-eye", str(given), *FEW, status=1)[1]


def test_what_is_full_is_said(command: Command) -> None:
    lines = command("--azimuth-bins", "1", "--polar-bins", "1")[0].splitlines()
    assert lines[-1] == "nothing is empty: frames lie in all of the 1 cells"


@pytest.mark.parametrize(
    ("options", "status", "said"),
    [
        (("--out", "tour.csv"), 2, "tour.csv ends neither in .json nor in .txt"),
        (("--box", "0", "--class", "ball"), 2, "not both"),
        (("--box", "7"), 1, "has no box 7; its boxes are: 1 ball"),
        (("--class", "dragon"), 1, "no class 'dragon'"),
        (("--class", "cube"), 1, "class 'cube' has no box: it is never labelled"),
        (("--count", "0"), 2, "'--count': Input should be greater than or equal to 1, not 0 (see"),
        (("--distance", "0.5"), 2, "'0.5' must be two numbers with a colon between"),
        (("--distance", "near:far"), 2, "'near:far' must be two numbers"),
        (("--distance", "0.9:0.3"), 2, "the limits of distance are the wrong way round: 0.9 is more than 0.3 metres"),
        (("--distance", "-1:0.3"), 2, "a distance must be more than 0 m"),
        (("--distance", "nan:1"), 2, "the limits of distance must be finite numbers of metres"),
        (("--tilt", "-100:0"), 2, "a tilt lies between -90 degrees, straight up, and 90, straight down, not -100 to 0"),
        (("--tilt", "20:10"), 2, "the limits of tilt are the wrong way round: 20 is more than 10 degrees"),
        (("--tilt", "nan:20"), 2, "the limits of tilt must be finite numbers of degrees, not nan and 20"),
        (("--height", "7:8"), 1, "no camera is 7 to 8 m high"),
        (("--min-visible", "2"), 2, "from 0 to 1, not 2.0"),
        (("--start-frame", "12"), 1, "no frame 12; its frames are 0 to 11"),
        (("--azimuth-bins", "360"), 2, "at most 2592 cells"),
    ],
)
def test_what_is_wrong_is_said(command: Command, options: tuple[str, ...], status: int, said: str) -> None:
    out, err = command(*options, status=status)
    assert out == ""
    assert said in err
    assert len(err.splitlines()) == 1


@pytest.mark.parametrize("name", ["tour.txt", "tour.json"])
def test_a_file_is_written_whole_or_not_at_all(command: Command, tmp_path: Path, name: str) -> None:
    new, taken = tmp_path / "new" / name, tmp_path / "taken" / name
    command("--count", "1", "--out", str(new), *FEW)
    assert [one.name for one in new.parent.iterdir()] == [name]
    (taken / "inside").mkdir(parents=True)
    _, err = command("--count", "1", "--out", str(taken), *FEW, status=1)
    assert err.startswith(f"ars-web: {taken} cannot be written: Is a directory; name a file in a folder")
    assert [one.name for one in taken.parent.iterdir()] == [name]


def test_a_world_whose_z_may_not_be_up_is_doubted(command: Command, tmp_path: Path, ring_scene: ModuleType) -> None:
    assert "off the world's z" not in command("--count", "1", *FEW)[0]
    assert json.loads(command("--count", "1", *FEW, "--json")[0])["doubts"] == []
    sessions = tmp_path / "on_side"
    on_side = np.eye(4)
    on_side[:3, :3] = turn_about(np.array([1.0, 0.0, 0.0]), np.pi / 2)
    read = read_recording(ring_scene.write(tmp_path / "ring"))
    frames = [replace(one, T_world_camera=on_side @ one.T_world_camera) for one in read.frames]
    T = np.eye(4)
    T[:3, 3] = on_side[:3, :3] @ ring_scene.CENTRE
    ball = RecordedBox("ball", Box(T, np.full(3, 0.08)))
    with SessionStore(sessions) as store:
        store.create(replace(read, frames=frames, class_names=("ball",), boxes=(ball,)), name="ring")
    lines = command("--count", "1", *FEW, sessions=sessions)[0].splitlines()
    (doubt,) = (line for line in lines if "off the world's z" in line)
    assert doubt.startswith("the cameras are level about an axis 90 degrees off the world's z: if that is not up,")
    told = json.loads(command("--count", "1", *FEW, "--json", sessions=sessions)[0])
    assert told["doubts"] == [doubt]
