"""Making the generated recording: once, whole or not at all, the same bytes every time."""

import os
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import orjson
import pytest

from ars_web.demo.recording import make_demo
from ars_web.errors import BadFile, BadInput

STOPPING = """
import sys
from pathlib import Path
from ars_web.demo.recording import make_demo

def stop(done, total):
    print(done, flush=True)
    sys.stdin.read()

make_demo(Path(sys.argv[1]), frames=3, size=(96, 72), progress=stop)
"""


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def times(folder: Path) -> dict[str, int]:
    return {str(path.relative_to(folder)): path.stat().st_mtime_ns for path in folder.rglob("*")}


def beside(folder: Path) -> set[str]:
    return {path.name for path in folder.parent.iterdir()}


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """Made all by itself, as a user's is."""
    folder = tmp_path_factory.mktemp("small") / "demo"
    make_demo(folder, frames=3, size=(96, 72))
    return folder


@pytest.fixture
def make(world):
    """make_demo of a small recording, in a scene that is lit already."""
    return partial(make_demo, frames=3, size=(96, 72), world=world)


def test_the_folder_holds_a_scene_and_its_truth(small):
    assert set(contents(small)) == {
        "camera_extrinsics.txt",
        "camera_intrinsics.txt",
        "robot_poses.txt",
        "truth.json",
        *(f"images/{i:05d}.jpg" for i in range(3)),
    }
    assert beside(small) == {"demo", ".demo.lock"}


def test_the_same_arguments_give_the_same_bytes(make, small, tmp_path):
    make(tmp_path / "demo")
    assert contents(tmp_path / "demo") == contents(small)


def test_images_differ_in_their_noise_and_view(small):
    images = {(small / "images" / f"{i:05d}.jpg").read_bytes() for i in range(3)}
    assert len(images) == 3


def test_a_second_call_makes_nothing(make, small):
    before = times(small)
    calls = []
    truth = make(small, progress=lambda done, total: calls.append(done))
    assert times(small) == before
    assert calls == []
    assert truth.folder == small


def test_progress_counts_the_images(make, tmp_path):
    calls = []
    make(tmp_path / "demo", progress=lambda done, total: calls.append((done, total)))
    assert calls == [(1, 3), (2, 3), (3, 3)]


def test_other_arguments_make_it_again(make, tmp_path):
    folder = tmp_path / "demo"
    make(folder)
    truth = make(folder, frames=2)
    assert len(truth.image_names) == 2
    assert len(list((folder / "images").iterdir())) == 2
    assert beside(folder) == {"demo", ".demo.lock"}


@pytest.mark.parametrize("damage", ["an image gone", "an image cut short", "poses gone", "truth cut short", "older"])
def test_what_is_not_whole_is_made_again(make, small, tmp_path, damage):
    folder = tmp_path / "demo"
    make(folder)
    image, truth = folder / "images/00001.jpg", folder / "truth.json"
    if damage == "an image gone":
        image.unlink()
    elif damage == "an image cut short":
        image.write_bytes(image.read_bytes()[:-1])
    elif damage == "poses gone":
        (folder / "robot_poses.txt").unlink()
    elif damage == "truth cut short":
        truth.write_bytes(truth.read_bytes()[:100])
    else:
        truth.write_bytes(orjson.dumps(orjson.loads(truth.read_bytes()) | {"version": 0}))
    make(folder)
    assert contents(folder) == contents(small)


def test_a_killed_run_leaves_nothing_half_made(make, small, tmp_path):
    folder = tmp_path / "demo"
    process = subprocess.Popen(
        [sys.executable, "-c", STOPPING, str(folder)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
    )
    with process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"1\n"
        process.send_signal(signal.SIGKILL)
    assert not folder.exists()
    assert ".demo.partial" in beside(folder)
    make(folder)
    assert contents(folder) == contents(small)
    assert beside(folder) == {"demo", ".demo.lock"}


def test_a_run_that_fails_leaves_nothing(make, tmp_path):
    class StopHere(Exception):
        pass

    def stop(done: int, total: int) -> None:
        raise StopHere

    with pytest.raises(StopHere):
        make(tmp_path / "demo", progress=stop)
    assert beside(tmp_path / "demo") == {".demo.lock"}


def test_of_two_that_want_it_at_once_one_makes_it(make, small, tmp_path):
    calls: list[int] = []

    def want(_: int) -> Path:
        return make(tmp_path / "demo", progress=lambda done, total: calls.append(done)).folder

    with ThreadPoolExecutor(2) as pool:
        assert set(pool.map(want, range(2))) == {tmp_path / "demo"}
    assert calls == [1, 2, 3]
    assert contents(tmp_path / "demo") == contents(small)


def test_a_folder_of_something_else_is_left_alone(make, tmp_path):
    folder = tmp_path / "thesis"
    folder.mkdir()
    (folder / "chapter1.txt").write_text("It was a dark and stormy night.")
    with pytest.raises(BadInput, match="thesis: holds something else"):
        make(folder)
    assert contents(folder) == {"chapter1.txt": b"It was a dark and stormy night."}


def test_an_empty_folder_will_do(make, small, tmp_path):
    make(tmp_path)
    assert contents(tmp_path) == contents(small)


def test_a_place_that_cannot_be_written_is_named(make, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(BadFile, match="cannot be written"):
        make(tmp_path / "file" / "demo")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"frames": 0}, "at least 1 frame"),
        ({"size": (32, 24)}, "64 x 48"),
        ({"size": (960, 960)}, "4 : 3"),
    ],
)
def test_arguments_that_cannot_be_are_refused(tmp_path, arguments, message):
    with pytest.raises(BadInput, match=message):
        make_demo(tmp_path / "demo", **arguments)
    assert list(tmp_path.iterdir()) == []
