"""`ars-web classes`, and the meshes and polygons of `ars-web boxes`."""

import json
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ars_web.class_commands import symmetry_from_text, symmetry_text
from ars_web.cli import run
from ars_web.errors import BadInput
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.symmetry import Symmetry
from ars_web.recordings.recording import Frame, RecordedBox, Recording
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.model import SessionState
from ars_web.sessions.store import SessionStore

CORNERS = np.array([[0.0, 0.0, 0.0], [40.0, 0.0, 0.0], [0.0, 20.0, 0.0], [0.0, 0.0, 10.0]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])

Command = Callable[..., tuple[str, str]]


def an_stl(faces: np.ndarray = FACES) -> bytes:
    rows = [struct.pack("<12fH", 0, 0, 0, *CORNERS[face].ravel(), 0) for face in faces]
    return b"\0" * 80 + struct.pack("<I", len(rows)) + b"".join(rows)


@pytest.fixture
def sessions(tmp_path: Path) -> Path:
    """A folder with the session `desk`, which has the classes `brick` and `2`, and a brick."""
    frame = Frame("0.png", tmp_path / "0.png", 0, np.eye(4))
    brick = RecordedBox("brick", Box(np.eye(4), np.array([0.1, 0.2, 0.3])))
    camera = Camera(64, 48, 50.0, 50.0, 31.5, 23.5)
    recording = Recording("ars", tmp_path, {0: camera}, (frame,), class_names=("brick", "2"), boxes=(brick,))
    with SessionStore(tmp_path / "sessions") as store:
        store.create(recording, name="desk")
    return tmp_path / "sessions"


@pytest.fixture
def command(sessions: Path, capsys: pytest.CaptureFixture[str]) -> Command:
    """What a command about `desk` prints on either stream."""

    def ask(group: str, verb: str, *rest: str, status: int = 0) -> tuple[str, str]:
        found = run([group, verb, "desk", *rest, "--sessions", str(sessions)])
        out, err = capsys.readouterr()
        assert found == status, err
        return out, err

    return ask


def state_in(sessions: Path) -> SessionState:
    with SessionStore(sessions) as store:
        return store.state(store.find("desk"))


def test_a_class_is_added_with_a_colour_of_its_own(command: Command, sessions: Path) -> None:
    out, _ = command("classes", "add", "mug", "--size", "0.08,0.08,0.1")
    assert out == "mug: class 2\n"
    out, _ = command("classes", "add", "cup", "--color", "#102030", "--json")
    assert (json.loads(out)["id"], json.loads(out)["color"]) == (3, "#102030")
    classes = state_in(sessions).classes
    assert classes[2].default_size == (0.08, 0.08, 0.1)
    assert len({one.color for one in classes.values()}) == 4
    for bad, says in (
        (["mug"], "mug"),
        (["pot", "--size", "1,2"], "--size"),
        (["pot", "--color", "red"], "red"),
    ):
        _, err = command("classes", "add", *bad, status=1)
        assert says in err
    assert list(state_in(sessions).classes) == [0, 1, 2, 3]


def test_what_is_set_of_a_class_is_listed(command: Command, sessions: Path) -> None:
    out, err = command(
        "classes", "set", "brick", "--symmetry", "z4,x2", "--keypoint", "tip=0,0,0.5", "--keypoint", "a=b=-0.5,0,1e-1",
        "--size", "0.1,0.2,0.3", "--color", "#AABBCC",
    )  # fmt: skip
    assert (out, err) == ("brick: changed\n", "")
    brick = state_in(sessions).classes[0]
    assert brick.symmetry.rotations == (((0.0, 0.0, 1.0), 4), ((1.0, 0.0, 0.0), 2))
    assert [(point.name, point.place) for point in brick.keypoints] == [("tip", (0, 0, 0.5)), ("a=b", (-0.5, 0, 0.1))]
    assert (brick.default_size, brick.color, brick.revision) == ((0.1, 0.2, 0.3), "#aabbcc", 1)
    lines = command("classes", "list")[0].splitlines()
    assert lines[0].split() == ["id", "name", "color", "size,", "mm", "symmetry", "keypoints", "mesh"]
    assert lines[1].split() == ["0", "brick", "#aabbcc", "100.0", "x", "200.0", "x", "300.0", "z4,x2", "2"]
    listed = json.loads(command("classes", "list", "--json")[0])
    assert (listed[0]["symmetry"]["kind"], listed[1]["mesh"]) == ("discrete", None)

    assert command("classes", "set", "0", "--symmetry", "z4,x2")[0] == "brick: as it was\n"
    out, _ = command("classes", "set", "0", "--symmetry", "none", "--default-keypoints", "--size", "none", "--json")
    answer = json.loads(out)
    assert (answer["keypoints"], answer["default_size"], answer["revision"]) == ([], None, 2)
    # A name counts before an id.
    command("classes", "set", "2", "--symmetry", "continuous:z+flip")
    assert state_in(sessions).classes[1].symmetry == Symmetry("continuous", axis=(0.0, 0.0, 1.0), flip=True)


def test_a_class_is_given_a_mesh_and_loses_it(command: Command, sessions: Path, tmp_path: Path) -> None:
    file = tmp_path / "brick.stl"
    file.write_bytes(an_stl(FACES[:3]))
    out, err = command("classes", "mesh", "brick", str(file), "--unit", "mm", "--axes", "-x,-y,z")
    assert out == "brick: brick.stl, 6 faces, 40.0 x 20.0 x 10.0 mm\n"
    assert err == "ars-web: the surface has 3 open edges: it is seen from both sides\n"
    brick = state_in(sessions).classes[0]
    assert brick.default_size == pytest.approx((0.04, 0.02, 0.01))
    assert "brick.stl, 6 faces" in command("classes", "list")[0]
    file.write_bytes(an_stl())
    out, _ = command(
        "classes", "mesh", "brick", str(file), "--unit", "cm", "--axes", "x,y,z", "--origin", "file", "--fit-size",
        "--json",
    )  # fmt: skip
    answer = json.loads(out)
    assert answer["mesh"]["source"] == {"name": "brick.stl", "unit": "cm", "axes": "x,y,z", "origin": "file"}
    assert answer["default_size"] == answer["mesh"]["extent"]
    assert command("classes", "mesh", "brick", "--remove")[0] == "brick: no mesh\n"
    assert state_in(sessions).classes[0].mesh is None
    with SessionStore(sessions) as store:
        SessionEditor(store).undo(store.find("desk"), author="cli")
    assert state_in(sessions).classes[0].mesh == answer["mesh"]["digest"]


def test_a_box_is_given_a_mesh_or_a_polygon(command: Command, sessions: Path, tmp_path: Path) -> None:
    stl, ring = tmp_path / "brick.stl", tmp_path / "ring.json"
    stl.write_bytes(an_stl())
    out, _ = command("boxes", "mesh", "1", str(stl), "--unit", "mm", "--axes", "x,y,z")
    assert out == "brick: brick.stl, 4 faces, 40.0 x 20.0 x 10.0 mm\n"
    ring.write_text('{"polygon": [[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0]], "frame_of": "world"}')
    assert command("boxes", "polygon", "1", str(ring))[0] == "brick: polygon, 2 faces, 100.0 x 100.0 x 0.0 mm\n"
    assert json.loads(command("boxes", "mesh", "1", str(stl), "--unit", "mm", "--axes", "x,y,z", "--json")[0])[
        "has_mesh"
    ]
    assert command("boxes", "polygon", "1", "--remove")[0] == "brick: no mesh of its own\n"
    assert command("boxes", "mesh", "1", "--remove")[0] == "brick: no mesh of its own\n"
    state = state_in(sessions)
    assert (state.boxes[1].mesh, state.revision) == (None, 4)
    for content, words in (
        ("{", "ring.json:1: is not JSON"),
        ("3", "ring.json: "),
        ('{"polygon": [[0, 0, 0], [1, 0, 0], [1, 1, "0"]], "frame_of": "box"}', "ring.json: polygon[2][2]: "),
        (
            '{"polygon": [[0, 0, 0], [1, 0, 0], [2, 0, 0]], "frame_of": "box"}',
            "ring.json: a flat polygon must have an area",
        ),
    ):
        ring.write_text(content)
        assert words in command("boxes", "polygon", "1", str(ring), status=1)[1]
    assert "cannot be read" in command("boxes", "polygon", "1", str(tmp_path / "no.json"), status=1)[1]


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (["classes", "set", "ball"], "there is no class 'ball' in this session; its classes are: 0 brick, 1 2"),
        (["classes", "set", "brick", "--symmetry", "square"], "--symmetry takes none, turns such as z4,x2"),
        (["classes", "set", "brick", "--symmetry", "z1"], "whole number from 2 to 72, not 1"),
        (["classes", "set", "brick", "--symmetry", "continuous:up"], "an axis needs three numbers such as 0/0/1"),
        (["classes", "set", "brick", "--keypoint", "tip"], "NAME=X,Y,Z, such as tip=0,0,0.5, not 'tip'"),
        (["classes", "set", "brick", "--keypoint", "tip=1,2"], "keypoint 'tip' needs three numbers"),
        (["classes", "set", "brick", "--keypoint", "tip=1,2,3"], "from -2 to 2"),
        (["classes", "set", "brick", "--keypoint", "t=0,0,0", "--default-keypoints"], "exclude each other"),
        (["classes", "set", "brick", "--size", "1,2"], "--size needs three numbers"),
        (["classes", "set", "brick", "--size", "1,2,-3"], "each > 0"),
        (["classes", "mesh", "brick"], "a mesh needs its file, --unit and --axes"),
        (["classes", "mesh", "brick", "a.stl", "--unit", "mm"], "a mesh needs its file, --unit and --axes"),
        (["classes", "mesh", "brick", "a.stl", "--remove"], "leave the file out"),
        (["classes", "mesh", "brick", "a.stl", "--unit", "mm", "--axes", "x,y,z"], "a.stl: cannot be read"),
        (["classes", "mesh", "brick", "a.stl", "--unit", "ft", "--axes", "x,y,z"], "unit must be one of"),
        (["boxes", "mesh", "7", "--remove"], "box 7 is not in this session"),
        (["boxes", "polygon", "1"], "a polygon needs its file"),
        (["boxes", "polygon", "1", "a.json", "--remove"], "a polygon needs its file; --remove takes it away"),
    ],
)
def test_what_cannot_be_is_said_in_one_line(command: Command, sessions: Path, line: list[str], words: str) -> None:
    out, err = command(*line, status=1)
    assert out == ""
    assert words in err
    assert err.count("\n") == 1
    assert state_in(sessions).revision == 0


@pytest.mark.parametrize("text", ["", "z2", "z4,x2", "continuous:y", "continuous:x+flip", "0.6/0/0.8^3,y2"])
def test_a_symmetry_reads_as_it_is_written(text: str) -> None:
    assert symmetry_text(symmetry_from_text(text or "none")) == text


def test_an_axis_may_be_of_any_length() -> None:
    assert symmetry_from_text("1/1/1^3").rotations[0][0] == pytest.approx([3**-0.5] * 3)
    assert symmetry_from_text("z^4") == symmetry_from_text("z4")
    for text in ("z", "4", "w4", "1/1^3", "z4;x2", ""):
        with pytest.raises(BadInput):
            symmetry_from_text(text)
