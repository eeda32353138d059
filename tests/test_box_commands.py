"""`ars-web boxes from-masks`, on a recording round a ball."""

import io
import json
import sys
from pathlib import Path
from typing import Any

import pytest

from ars_web.cli import run
from ars_web.recordings.registry import ReadOptions, read_recording
from ars_web.sessions.store import SessionStore


@pytest.fixture
def sessions(tmp_path: Path, ring_scene) -> Path:
    """A folder with the session `ring`, which has the class `ball`."""
    recording = read_recording(ring_scene.write(tmp_path / "ring"), format="ars", options=ReadOptions())
    with SessionStore(tmp_path / "sessions") as store:
        store.create(recording, name="ring", class_names=["ball"])
    return tmp_path / "sessions"


@pytest.fixture
def make(sessions: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    """What `boxes from-masks` prints on either stream, of a file that holds this."""

    def ask(content: object, *options: str, status: int = 0) -> tuple[str, str]:
        file = tmp_path / "masks.json"
        file.write_text(content if isinstance(content, str) else json.dumps(content))
        found = run(["boxes", "from-masks", "ring", str(file), "--sessions", str(sessions), *options])
        out, err = capsys.readouterr()
        assert found == status, err
        return out, err

    return ask


@pytest.fixture
def ball(ring_scene):
    """The JSON of the ball's box from some frames; what is said of a frame changes the ball there."""

    def body(*frames: int, but: dict[int, dict[str, Any]] | None = None, **more: Any) -> dict[str, Any]:
        views = [
            {"frame": frame, "polygons": ring_scene.polygons(frame, **(but or {}).get(frame, {}))} for frame in frames
        ]
        return {"class_id": 0, "views": views, **more}

    return body


def boxes_in(sessions: Path) -> list[Any]:
    with SessionStore(sessions) as store:
        return list(store.state(store.find("ring")).boxes.values())


def test_a_box_is_made_of_one_object(make, ball, sessions: Path) -> None:
    out, err = make(ball(0, 3, name="the ball", orientation="upright"))
    assert err == ""
    title, row = out.splitlines()
    assert title.split()[:3] == ["id", "name", "masks"]
    (box,) = boxes_in(sessions)
    assert box.name == "the ball"
    assert box.hull_options.orientation == "upright"
    assert " x ".join(f"{1000 * side:.1f}" for side in box.box.size) in row


def test_a_list_makes_each_and_names_those_that_do_not_fit(make, ball, ring_scene, sessions: Path) -> None:
    wrong = ball(0, 3, but={3: {"centre": (0.1, 0.0, 0.0)}})
    pixels = {"class_id": 0, "views": [{"frame": frame, "mask_png": ring_scene.png(frame)} for frame in (0, 4)]}
    out, err = make([ball(0, 3), wrong, ball(0, 3, class_id=7), pixels], status=1)
    assert len(out.splitlines()) == 1 + 2
    first, second = err.splitlines()
    assert "masks.json: object 1: no object fits: the outlines do not meet (frame 0: " in first
    assert "masks.json: object 2: there is no class 7 in this session; its classes are: 0 ball" in second
    with SessionStore(sessions) as store:
        state = store.state(store.find("ring"))
    assert (len(state.boxes), len(state.masks), state.revision) == (2, 4, 2)


def test_json_is_what_the_api_answers(make, ball, sessions: Path) -> None:
    out, _ = make(ball(0, 3), "--json")
    (made,) = json.loads(out)
    (box,) = boxes_in(sessions)
    assert (made["id"], made["revision"], made["has_hull"]) == (box.id, 1, True)
    assert set(made["hull"]) == {"volume", "centre_of_mass", "vertices", "faces", "position"}
    assert len(made["hull"]["vertices"][0]) == 3


def test_standard_input_is_read_too(make, ball, sessions: Path, monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    said = io.TextIOWrapper(io.BytesIO(json.dumps(ball(0, 3)).encode()))
    monkeypatch.setattr(sys, "stdin", said)
    assert run(["boxes", "from-masks", "ring", "-", "--sessions", str(sessions)]) == 0
    assert len(boxes_in(sessions)) == 1
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(b"{")))
    assert run(["boxes", "from-masks", "ring", "-", "--sessions", str(sessions)]) == 1
    assert "standard input:1: is not JSON" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("[" * 100_000, "nested too deeply"),
        ("{", "masks.json:1: is not JSON"),
        ("3", "masks.json: "),
        ('{"class_id": 0, "class_id": 1}', "'class_id' is given twice"),
        ({"class_id": 0}, "masks.json: views: Field required"),
        ([{"class_id": 0, "views": 3}], "masks.json: object 0, views: "),
        ({"class_id": 0, "views": [{"frame": 0, "polygons": []}] * 2}, "views[0].polygons: "),
        ({"class_id": 0, "views": [{"frame": 0}] * 2}, "views[0]: give polygons or mask_png"),
        ({"class_id": 0, "views": [{"frame": 0, "mask_png": "AA"}] * 2, "color": 1}, "color: Extra inputs"),
        (
            {"class_id": 0, "views": [{"frame": 0, "mask_png": "AA=="}] * 2},
            "masks.json: frame 0: the mask is not a PNG",
        ),
    ],
)
def test_a_fault_in_the_file_is_named_in_one_line(make, sessions: Path, content: object, words: str) -> None:
    out, err = make(content, status=1)
    assert out == ""
    assert err.count("\n") == 1
    assert words in err
    assert boxes_in(sessions) == []


def test_an_empty_list_and_a_file_that_is_not_there(make, sessions: Path, tmp_path: Path, capsys) -> None:
    assert make([]) == ("", "")
    assert run(["boxes", "from-masks", "ring", str(tmp_path / "no.json"), "--sessions", str(sessions)]) == 1
    assert "no.json: No such file" in capsys.readouterr().err


@pytest.fixture
def refine(sessions: Path, capsys: pytest.CaptureFixture[str]):
    """What `boxes refine` prints on either stream."""

    def ask(*arguments: str, status: int = 0) -> tuple[str, str]:
        found = run(["boxes", "refine", "ring", *arguments, "--sessions", str(sessions)])
        out, err = capsys.readouterr()
        assert found == status, err
        return out, err

    return ask


def test_a_box_is_fitted_to_its_masks(make, refine, ball, sessions: Path) -> None:
    make(ball(0, 2, 5, 7, 9))
    (made,) = boxes_in(sessions)
    out, err = refine(str(made.id), "--dry-run")
    *rows, told = out.splitlines()
    assert [row.split()[0] for row in rows] == ["frame", "0", "2", "5", "7", "9"]
    assert "moved by" in told
    assert "does not fill a box" in err
    assert boxes_in(sessions)[0].revision == made.revision
    found = json.loads(refine(str(made.id), "--json")[0])
    (after,) = boxes_in(sessions)
    assert found["box"]["size"] == after.box.size.tolist()
    assert after.box.volume < made.box.volume
    assert after.hull is not None


def test_a_box_is_fitted_to_what_a_file_says(make, refine, ball, sessions: Path, ring_scene, tmp_path: Path) -> None:
    make(ball(0, 3))
    bounds = {frame: ring_scene.outline(frame) for frame in (0, 2, 5, 7, 9)}
    views = [
        {"frame": frame, "bbox": [*ring.min(axis=0).tolist(), *ring.max(axis=0).tolist()]}
        for frame, ring in bounds.items()
    ]
    file = tmp_path / "seen.json"
    file.write_text(json.dumps({"views": views, "orientation": "upright"}))
    found = json.loads(refine("1", str(file), "--json")[0])
    assert [row["frame"] for row in found["residuals"]] == [0, 2, 5, 7, 9]
    assert found["box"]["T_world_box"]["position"] == pytest.approx(list(ring_scene.CENTRE), abs=3e-3)
    file.write_text(json.dumps({"views": [{"frame": 0}]}))
    assert "seen.json: views[0]: give bbox, polygons or mask_png" in refine("1", str(file), status=1)[1]
    assert "box 9 is not in this session" in refine("9", status=1)[1]
