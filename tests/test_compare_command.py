"""`ars-web compare`, on a recording in a ring of cameras with two boxes."""

import json
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from ars_web.cli import run
from ars_web.geometry.box import Box
from ars_web.recordings.registry import read_recording
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.store import SessionStore


@pytest.fixture(scope="module")
def sessions(tmp_path_factory: pytest.TempPathFactory, ring_scene: ModuleType) -> Path:
    """A folder with the session `ring`: two boxes side by side, seen from all round."""
    folder = tmp_path_factory.mktemp("compare")
    recording = read_recording(ring_scene.write(folder / "ring", frames=6))
    with SessionStore(folder / "sessions") as store:
        editor = SessionEditor(store)
        sid = store.create(recording, name="ring").id
        for name, x in (("cup", -0.03), ("book", 0.03)):
            T = np.eye(4)
            T[:3, 3] = (x, 0.0, 0.05)
            class_id = editor.add_class(sid, name=name, author="test").id
            editor.add_box(sid, class_id=class_id, box=Box(T, np.array([0.03, 0.04, 0.05])), author="test")
    return folder / "sessions"


@pytest.fixture(scope="module")
def yolo(sessions: Path) -> Path:
    """The session's own labels as a YOLO set."""
    out = sessions.parent / "yolo"
    assert (
        run(["export", "ring", "--format", "yolo", "--images", "none", "--out", str(out), "--sessions", str(sessions)])
        == 0
    )
    return out


def compare(sessions: Path, *arguments: str) -> int:
    return run(["compare", "ring", *arguments, "--sessions", str(sessions)])


def test_its_own_labels_agree(sessions: Path, yolo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    assert compare(sessions, "--labels", str(yolo), "--json") == 0
    out, _ = capsys.readouterr()
    told = json.loads(out)
    total = told["rectangles"]["in_image"]["total"]
    assert (total["manual"], total["matched"], total["precision"], total["recall"]) == (12, 12, 1.0, 1.0)
    assert total["mean_iou"] > 0.999
    assert set(told["rectangles"]) == {"in_image", "amodal", "visible"}
    assert [frame["index"] for frame in told["frames"]] == list(range(6))
    assert (told["format"], told["left_out"], told["never_by_hand"]) == ("yolo", [], [])


def test_tables_and_a_report(sessions: Path, yolo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of the ring's first frame the book is called a cup, and its second was not labelled."""
    labels = tmp_path / "labels"
    labels.mkdir()
    (labels / "classes.txt").write_text("mug\nbook\n")
    files = sorted(yolo.glob("labels/*/*.txt"))
    for file in [files[0], *files[2:]]:
        text = file.read_text()
        (labels / file.name).write_text(text.replace("1 ", "0 ", 1) if file == files[0] else text)
    report = tmp_path / "new" / "report.html"
    capsys.readouterr()
    given = ("--labels", str(labels), "--classes", "mug=cup", "--out", str(report), "--worst", "2")
    assert compare(sessions, *given) == 0
    out, err = capsys.readouterr()
    lines = [line.split() for line in out.splitlines()]
    # Ten labels of five frames on both sides, nine pairs.
    assert lines[1][:9] == ["whole,", "in", "the", "image", "10", "10", "9", "90.00", "%"]
    assert lines[4][-5:] == ["98.49", "%", "95.02", "%", "0.70"]
    assert ["cup", "book", "1"] in lines
    assert out.rstrip().endswith(str(report))
    assert "Comparing: 5 of 5" in err
    assert "Only 9 labels have a partner" in err
    page = report.read_text()
    assert "Annotation study of ring" in page
    assert page.count("data:image/jpeg") == 2


@pytest.mark.parametrize(
    ("arguments", "status", "said"),
    [
        (("--labels", "nowhere"), 1, "nowhere: is missing"),
        (("--labels", "."), 1, "holds no labels that are known"),
        (("--labels", ".", "--format", "bop"), 2, "'bop' is none of auto, coco, cvat, voc, yolo"),
        (("--labels", ".", "--classes", "mug"), 2, "'mug' is not MANUAL=SESSION"),
        (("--labels", ".", "--classes", "=cup"), 2, "'=cup' is not MANUAL=SESSION"),
        (("--labels", ".", "--classes", "a=b,a=c"), 2, "'a' is told twice"),
        (("--labels", ".", "--min-visible", "2"), 2, "--min-visible"),
        (("--labels", ".", "--worst", "-1"), 2, "--worst"),
        ((), 2, "--labels"),
    ],
)
def test_what_cannot_be_is_one_line(
    sessions: Path, arguments: tuple[str, ...], status: int, said: str, tmp_path: Path, monkeypatch, capsys
) -> None:
    monkeypatch.chdir(tmp_path)
    assert compare(sessions, *arguments) == status
    assert said in capsys.readouterr().err


def test_what_the_labels_or_the_disk_refuse_is_one_line(sessions: Path, yolo: Path, tmp_path: Path, capsys) -> None:
    (tmp_path / "file").write_text("")
    given = ("--labels", str(yolo))
    for more, said in (
        (("--iou", "0"), "above 0 and at most 1, not 0"),
        (("--classes", "cup=mug"), "the session has no class 'mug'; its classes are book, cup"),
        (("--out", str(tmp_path / "file" / "x.html")), "cannot be written"),
    ):
        assert compare(sessions, *given, *more) == 1
        assert said in capsys.readouterr().err.splitlines()[-1]


def test_rectangles_of_yolo_become_boxes(sessions: Path, yolo: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """`labels import` takes the same files: in each image one object of a class, in three images or more."""
    capsys.readouterr()
    assert run(["labels", "import", "ring", str(yolo), "--dry-run", "--sessions", str(sessions)]) == 0
    out, _ = capsys.readouterr()
    assert "2 boxes and 0 masks would come in (yolo)" in out
