"""The commands as a user runs them: real processes, on a small recording made here."""

import contextlib
import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple
from urllib.request import HTTPCookieProcessor, build_opener, urlopen

import cv2
import numpy as np
import pytest

FRAMES = 6
CAMERA = "160 120 150 150 79.5 59.5 0.05 -0.01 0 0"
BOX = {
    "class_id": 0,
    "name": "the cube",
    "T_world_box": {"position": [0.0, 0.0, 0.0], "wxyz": [1.0, 0.0, 0.0, 0.0]},
    "size": [0.1, 0.1, 0.1],
}


def make_recording(folder: Path, *, frames: int = FRAMES) -> Path:
    """An ARS scene folder: a camera that slides along x, one metre before the origin, looking along +z."""
    (folder / "images").mkdir(parents=True)
    picture = np.random.default_rng(0).integers(0, 255, (120, 160, 3), dtype=np.uint8)
    first = folder / "images" / "00000.jpg"
    cv2.imwrite(str(first), picture)
    for i in range(1, frames):
        (folder / "images" / f"{i:05d}.jpg").hardlink_to(first)
    poses = [f"{0.05 * i} 0 -1 0 0 0 1" for i in range(frames)]
    (folder / "robot_poses.txt").write_text("\n".join(poses) + "\n")
    (folder / "camera_extrinsics.txt").write_text("0 0 0 0 0 0 1\n")
    (folder / "camera_intrinsics.txt").write_text(CAMERA + "\n")
    return folder


class Output(NamedTuple):
    """What a command printed."""

    stdout: str
    stderr: str


def hear_ctrl_c() -> None:
    """Undo what a shell does to commands in the background, these tests among them: it lets them ignore Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@dataclass(frozen=True)
class Commands:
    """Runs `ars-web` on one sessions folder."""

    sessions: Path

    def start(self, *arguments: object) -> subprocess.Popen[str]:
        line = [sys.executable, "-m", "ars_web", *map(str, arguments)]
        environment = {**os.environ, "ARS_WEB_SESSIONS": str(self.sessions), "COLUMNS": "100"}
        pipes = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        return subprocess.Popen(line, text=True, env=environment, preexec_fn=hear_ctrl_c, **pipes)

    def __call__(self, *arguments: object, status: int = 0) -> Output:
        """What a command printed; its exit status must be `status`."""
        with self.start(*arguments) as process:
            output = Output(*process.communicate(timeout=300))
        assert process.returncode == status, output.stderr
        assert "Traceback" not in output.stderr
        return output

    def with_one_box(self, recording: Path, folder: Path) -> str:
        """A session of the recording with one box; its id."""
        sid = self("import", recording, "--classes", "cube, ball").stdout.strip()
        boxes = folder / "boxes.json"
        boxes.write_text(json.dumps([BOX]))
        self("boxes", "import", sid, boxes)
        return sid


@pytest.fixture
def run(tmp_path: Path) -> Commands:
    return Commands(tmp_path / "sessions")


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    return make_recording(tmp_path / "desk")


@pytest.fixture
def session(run: Commands, recording: Path, tmp_path: Path) -> str:
    return run.with_one_box(recording, tmp_path)


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> tuple[Commands, str]:
    """A session for tests that change nothing."""
    folder = tmp_path_factory.mktemp("shared")
    run = Commands(folder / "sessions")
    return run, run.with_one_box(make_recording(folder / "desk"), folder)


def one_line(done: Output) -> str:
    """What it said on stderr, which must be one line, with nothing on stdout."""
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1, done.stderr
    return done.stderr.strip()


def wait_until(true: Callable[[], bool], process: subprocess.Popen[str], *, seconds: float = 120) -> None:
    """Look again and again until it is true; the process must still run by then."""
    deadline = time.monotonic() + seconds
    while not true():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(0.02)


def test_a_recording_becomes_a_training_set(run: Commands, recording: Path, tmp_path: Path) -> None:
    sid = run("import", recording, "--classes", "cube").stdout.splitlines()[-1]
    listed = json.loads(run("list", "--json").stdout)
    assert [(s["id"], s["name"], s["frames"], s["boxes"]) for s in listed] == [(sid, "desk", FRAMES, 0)]

    boxes = tmp_path / "boxes.json"
    boxes.write_text(json.dumps([BOX]))
    assert run("boxes", "import", "desk", boxes).stdout == "1 boxes added\n"

    out = tmp_path / "yolo"
    assert run("export", "desk", "--format", "yolo", "--out", out).stdout.splitlines()[-1] == str(out)
    rows = [path.read_text().split() for path in sorted(out.glob("labels/*/*.txt"))]
    assert len(rows) == FRAMES
    # Frame 0 looks straight at a 10 cm cube whose front face is 0.95 m away: 0.1 * 150 / 0.95 = 15.8 px of 160.
    first = [float(value) for value in rows[0]]
    assert first[0] == 0
    assert first[1:3] == pytest.approx([0.5, 0.5], abs=0.002)
    assert first[3] == pytest.approx(0.1 * 150 / 0.95 / 160, rel=0.01)

    pictures = run("preview", "desk", "--out", tmp_path / "pictures", "--frames", 2).stdout.splitlines()
    assert len(pictures) == 2
    assert all(Path(picture).read_bytes().startswith(b"\x89PNG") for picture in pictures)


def test_a_set_is_read_back(shared: tuple[Commands, str], tmp_path: Path) -> None:
    run, session = shared
    printed = run("export", session, "--format", "voc", "--out", tmp_path / "d", "--check").stdout
    assert "counts that differ: none" in printed
    assert "largest error: 0." in printed
    found = json.loads(run("export", session, "--format", "yolo", "--out", tmp_path / "y", "--check", "--json").stdout)
    assert (found["check"]["frames"], found["check"]["wrong_counts"]) == (FRAMES, 0)


def test_import_prints_the_id_alone_and_names_skipped_frames(run: Commands, recording: Path) -> None:
    poses = (recording / "robot_poses.txt").read_text().splitlines()
    poses[2] = "nan 0 0 0 0 0 1"
    (recording / "robot_poses.txt").write_text("\n".join(poses) + "\n")
    done = run("import", recording)
    assert done.stdout.count("\n") == 1
    assert "robot_poses.txt:3" in done.stderr
    report = json.loads(run("import", recording, "--json").stdout)
    assert report["session"]["skipped"] == 1
    assert [frame["name"] for frame in report["skipped"]] == ["00002.jpg"]


def test_import_counts_what_it_does_not_name(run: Commands, tmp_path: Path) -> None:
    recording = make_recording(tmp_path / "long", frames=20)
    (recording / "robot_poses.txt").write_text("0 0 -1 0 0 0 1\n" * 8 + "nan 0 0 0 0 0 1\n" * 12)
    done = run("import", recording)
    assert done.stderr.count(" is not finite (") == 5
    assert "and 7 more: 12 frames are skipped in all" in done.stderr


def test_boxes_come_back_as_they_went_in(run: Commands, session: str, tmp_path: Path) -> None:
    file = tmp_path / "out.json"
    assert run("boxes", "export", session, file).stdout == ""
    (box,) = json.loads(file.read_text())
    assert {key: box[key] for key in BOX} == BOX
    assert json.loads(run("boxes", "export", session, "-").stdout) == [box]
    run("boxes", "import", session, file)
    assert len(json.loads(run("boxes", "export", session, "-").stdout)) == 2


def test_boxes_export_replaces_a_file_only_when_told_to(run: Commands, session: str, tmp_path: Path) -> None:
    file = tmp_path / "precious.json"
    file.write_text("precious")
    assert "--force" in one_line(run("boxes", "export", session, file, status=1))
    assert file.read_text() == "precious"
    run("boxes", "export", session, file, "--force")
    assert json.loads(file.read_text())


def test_a_session_travels_in_one_file(run: Commands, session: str, tmp_path: Path) -> None:
    packed = tmp_path / "desk.zip"
    run("pack", session, packed)
    other = run("unpack", packed, "--name", "desk again").stdout.strip()
    assert other != session
    assert run("boxes", "export", "desk again", "-").stdout == run("boxes", "export", session, "-").stdout


def test_export_takes_every_option(run: Commands, session: str, recording: Path, tmp_path: Path) -> None:
    other = run("import", recording, "--name", "second", "--classes", "ball").stdout.strip()
    done = run(
        *("export", session, "--format", "coco", "--out", tmp_path / "coco", "--json"),
        *("--frames-step", 2, "--frames-start", 1, "--frames-stop", 5, "--images", "none", "--shape", "box"),
        *("--min-visible", 0.1, "--max-truncated", 0.9, "--min-area-px", 5, "--merge", "second"),
        *("--frames-count", 2, "--frames-by", "even", "--frames-near-degrees", 0.5, "--frames-near-frames", 1),
        *("--split-train", 0.5, "--split-val", 0.25, "--split-test", 0.25, "--split-by", "frame", "--split-seed", 7),
        *("--workers", 1),
    )
    assert json.loads(done.stdout)["report"]["options"] == {
        "frames": {"step": 2, "start": 1, "stop": 5, "list": None}
        | {"count": 2, "by": "even", "near_degrees": 0.5, "near_frames": 1, "sector": None, "sector_box": None},
        "images": "none",
        "shape": "box",
        "min_visible": 0.1,
        "max_truncated": 0.9,
        "min_area_px": 5.0,
        "masks": "write",
        "heading_bins": 18,
        "split": {"train": 0.5, "val": 0.25, "test": 0.25, "by": "frame", "hold_out": [], "seed": 7},
        "sessions": [other],
    }
    listed = run("export", session, "--format", "ars", "--out", tmp_path / "ars", "--frames-list", "0,3", "--json")
    assert sum(split["images"] for split in json.loads(listed.stdout)["report"]["splits"].values()) == 2


@pytest.mark.parametrize("arguments", [("list",), ("check",), ("formats",), ("import", "RECORDING"), ("openapi",)])
def test_json_is_all_there_is_on_stdout(
    shared: tuple[Commands, str], recording: Path, arguments: tuple[str, ...]
) -> None:
    given = [recording if argument == "RECORDING" else argument for argument in arguments]
    printed = json.loads(shared[0](*given, *([] if arguments == ("openapi",) else ["--json"])).stdout)
    assert isinstance(printed, dict | list)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("nonsense",), "nonsense"),
        (("import",), "PATH"),
        (("import", ".", "--format", "zip"), "zip"),
        (("import", ".", "--classes", "a,,b"), "--classes"),
        (("export", "S", "--out", "D"), "--format"),
        (("export", "SESSION", "--format", "nope", "--out", "D"), "nope"),
        (("export", "SESSION", "--format", "yolo", "--out", "D", "--min-visible", "2"), "--min-visible"),
        (("export", "SESSION", "--format", "yolo", "--out", "D", "--frames-step", "0"), "--frames-step"),
        (("export", "SESSION", "--format", "yolo", "--out", "D", "--frames-list", "1,x"), "--frames-list"),
        (("export", "SESSION", "--format", "yolo", "--out", "D", "--frames-list", "1", "--frames-step", "2"), "both"),
        (("export", "SESSION", "--format", "yolo", "--out", "D", "--split-train", "0.9"), "--split-train"),
        (
            ("export", "SESSION", "--format", "yolo", "--out", "D", "--split-hold-out", "SESSION"),
            "value for --split-hold-out:",
        ),
        (("export", "SESSION", "--format", "yolo", "--out", "D", "--images", "steal"), "--images"),
        (("export", "SESSION", "--format", "yolo", "--out", "D", "--heading-bins", "8"), "an option of compass"),
        (("export", "SESSION", "--format", "yolo", "--out", "memory://a/b", "--check"), "not read back"),
        (("serve", "--root", "here"), "NAME=PATH"),
        (("serve", "--root", "a=.", "--root", "a=."), "'a'"),
        (("serve", "--root", "a=nowhere"), "nowhere"),
        (("serve", "--executor", "tcp://192.0.2.7:1"), "a plain port runs the code of anyone"),
        (("export", "SESSION", "--format", "yolo", "--out", "D", "--executor", "tcp://192.0.2.7:1"), "--executor"),
        (("serve", "--port", "70000"), "--port"),
    ],
)
def test_wrong_arguments_end_with_2_and_one_line(
    shared: tuple[Commands, str], arguments: tuple[str, ...], named: str
) -> None:
    run, session = shared
    given = [session if argument == "SESSION" else argument for argument in arguments]
    line = one_line(run(*given, status=2))
    assert named in line
    assert line.endswith("--help`)")


def test_what_is_wrong_with_the_input_ends_with_1_and_one_line(
    shared: tuple[Commands, str], recording: Path, tmp_path: Path
) -> None:
    run, session = shared
    assert "nope" in one_line(run("export", "nope", "--format", "yolo", "--out", tmp_path / "d", status=1))
    assert "nowhere" in one_line(run("import", "nowhere", status=1))
    damaged = tmp_path / "boxes.json"
    damaged.write_text('[{"class_id": 0}]')
    assert "boxes.json" in one_line(run("boxes", "import", session, damaged, status=1))
    damaged.write_text(json.dumps([BOX, {**BOX, "class_id": 77}]))
    line = one_line(run("boxes", "import", session, damaged, status=1))
    assert "boxes.json: box 1: there is no class 77 in this session; its classes are: 0 " in line
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "file").touch()
    assert "full" in one_line(run("export", session, "--format", "yolo", "--out", tmp_path / "full", status=1))
    unwritten = one_line(run("boxes", "export", session, tmp_path / "nowhere" / "boxes.json", status=1))
    assert f"there is no folder {tmp_path / 'nowhere'}" in unwritten
    assert "not empty" in one_line(run("import", recording, "--name", "", status=1))
    assert "no such file" in one_line(run("serve", "--port", "0", "--segmenter", tmp_path / "none.onnx", status=1))
    assert "boxes.json" in one_line(run("serve", "--port", "0", "--segmenter", damaged, status=1))


def test_a_folder_whose_name_is_not_utf8_is_refused_in_one_line(run: Commands, recording: Path) -> None:
    odd = recording.rename(recording.parent / os.fsdecode(b"desk\xff"))
    assert "UTF-8" in run("import", odd, "--name", "desk", status=1).stderr
    assert json.loads(run("list", "--json").stdout) == []


def test_a_dataset_may_go_to_a_folder_whose_name_is_not_utf8(shared: tuple[Commands, str], tmp_path: Path) -> None:
    run, session = shared
    out = tmp_path / os.fsdecode(b"set\xff")
    for arguments in ((), ("--json",)):
        printed = run("export", session, "--format", "yolo", "--out", out / str(len(arguments)), *arguments).stdout
        assert "udcff" in printed
    assert (out / "0" / "data.yaml").is_file()


def test_a_reader_of_the_output_may_leave_early(run: Commands) -> None:
    with run.start("formats") as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        assert process.stderr.read() == ""
    assert process.returncode == 1


def test_check_says_what_is_wrong_and_how_to_mend_it(run: Commands, session: str, tmp_path: Path) -> None:
    assert "WRONG" not in run("check").stdout
    database = tmp_path / "sessions" / session / "session.sqlite"
    database.write_bytes(b"no database at all" * 100)
    done = run("check", status=1)
    assert session in done.stdout
    assert "WRONG" in done.stdout
    file = tmp_path / "file"
    file.touch()
    assert "--sessions" in run("check", "--sessions", file / "sessions", status=1).stderr


def test_ctrl_c_stops_an_export_that_the_same_command_goes_on_with(run: Commands, tmp_path: Path) -> None:
    # Enough frames for several seconds of work after the first shard, however busy the machine.
    run.with_one_box(make_recording(tmp_path / "desk", frames=8000), tmp_path)
    line = ("export", "desk", "--format", "yolo", "--out", tmp_path / "yolo", "--images", "rectify", "--workers", 1)
    with run.start(*line) as process:
        wait_until((tmp_path / ".yolo.partial" / "shards" / "00000").is_dir, process)
        process.send_signal(signal.SIGINT)
        output = Output(*process.communicate(timeout=60))
    assert process.returncode == 130
    assert one_line(output).endswith("the same command goes on from here")
    assert not (tmp_path / "yolo").exists()
    run(*line)
    assert len(list(tmp_path.glob("yolo/images/*/*"))) == 8000


def test_serve_prints_a_login_address_and_ends_with_ctrl_c(run: Commands) -> None:
    with run.start("serve", "--port", 0) as process:
        assert process.stdout is not None
        lines = [process.stdout.readline(), process.stdout.readline()]
        address = re.search(r"http://127\.0\.0\.1:\d+/", lines[0])
        assert address is not None
        assert f"{address[0]}login?code=" in lines[1]
        with urlopen(f"{address[0]}api/health", timeout=10) as answer:
            assert answer.status == 200
        process.send_signal(signal.SIGINT)
        output = Output(*process.communicate(timeout=60))
    assert process.returncode in (0, 130)
    assert "Traceback" not in output.stderr


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> tuple[Commands, str]:
    """The demo, made; and what was printed."""
    run = Commands(tmp_path_factory.mktemp("demo") / "sessions")
    return run, run("demo", "--no-serve").stdout


def test_the_demo_is_made_once_and_exported_anew_when_its_session_changes(
    demo: tuple[Commands, str], tmp_path: Path
) -> None:
    run, first = demo
    home = run.sessions / ".demo"
    assert all(str(home / name) in first for name in ("yolo", "coco", "pictures"))
    assert len(list((home / "pictures").glob("*.png"))) == 6
    report = json.loads((home / "yolo" / "dataset.json").read_text())
    assert sum(split["labels"] for split in report["splits"].values()) > 300

    def times() -> dict[Path, int]:
        return {path: path.stat().st_mtime_ns for path in home.rglob("[!.]*") if path.is_file()}

    before = times()
    assert run("demo", "--no-serve").stdout == first
    assert times() == before

    boxes = tmp_path / "boxes.json"
    boxes.write_text(json.dumps([BOX]))
    run("boxes", "import", "demo", boxes)
    run("demo", "--no-serve")
    changed = json.loads((home / "yolo" / "dataset.json").read_text())
    assert (report["sessions"][0]["revision"], changed["sessions"][0]["revision"]) == (0, 1)
    assert len(json.loads(run("list", "--json").stdout)) == 1

    # As if a newer version had rendered the images again: the session that was made from the old ones goes.
    (home / "recording" / "truth.json").touch()
    run("demo", "--no-serve")
    (fresh,) = json.loads(run("list", "--json").stdout)
    assert fresh["id"] != report["sessions"][0]["id"]
    assert fresh["revision"] == 0


def read_until(process: subprocess.Popen[str], begin: str) -> list[str]:
    """What a process prints, up to a line that begins so."""
    assert process.stdout is not None
    lines: list[str] = []
    for line in process.stdout:
        lines.append(line)
        if line.startswith(begin):
            return lines
    raise AssertionError("".join(lines) + process.communicate()[1])


def test_the_demo_is_served_and_its_datasets_are_made_meanwhile(demo: tuple[Commands, str], tmp_path: Path) -> None:
    run, _ = demo
    (session,) = json.loads(run("list", "--json").stdout)
    boxes = tmp_path / "boxes.json"
    boxes.write_text(json.dumps([BOX]))
    run("boxes", "import", "demo", boxes)
    with run.start("demo", "--no-browser", "--port", 0) as process:
        *_, said = read_until(process, "Log in, once,")
        address = said.split()[-1]
        assert address.endswith(f"&next=/sessions/{session['id']}")
        browser = build_opener(HTTPCookieProcessor())
        with browser.open(address, timeout=30) as page:
            assert page.url.endswith(f"/sessions/{session['id']}")
            assert b"Log in" not in page.read()
        base = address.partition("/login")[0]
        with browser.open(f"{base}/api/roots/demo/folders", timeout=30) as answer:
            assert {"name": "recording", "formats": ["ars"], "images": 60, "problem": None} in json.load(answer)[
                "folders"
            ]
        made = read_until(process, "pictures")
        assert [line.split()[0] for line in made] == ["dataset", "dataset", "pictures"]
        report = json.loads((run.sessions / ".demo" / "yolo" / "dataset.json").read_text())
        assert report["sessions"][0]["revision"] == session["revision"] + 1
        with urlopen(f"{base}/api/health", timeout=30) as answer:
            assert answer.status == 200
        process.send_signal(signal.SIGINT)
        output = Output(*process.communicate(timeout=60))
    assert (process.returncode in (0, 130), output.stderr) == (True, "")


def test_the_demo_is_stopped_while_its_datasets_are_made(demo: tuple[Commands, str]) -> None:
    run, _ = demo
    made_from = run.sessions / ".demo" / "made-from.json"
    made_from.unlink()
    with run.start("demo", "--no-browser", "--port", 0) as process:
        read_until(process, "Log in, once,")
        process.send_signal(signal.SIGINT)
        output = Output(*process.communicate(timeout=60))  # it would wait for a process that still writes to it
    assert (process.returncode in (0, 130), output) == (True, Output("", ""))
    assert not made_from.exists()
    run("demo", "--no-serve")
    assert made_from.exists()


def test_the_demo_takes_another_port_only_where_none_was_asked_for(demo: tuple[Commands, str]) -> None:
    run, _ = demo
    with contextlib.ExitStack() as stack:
        with contextlib.suppress(OSError):  # where somebody else has it, it is taken as well
            stack.enter_context(socket.create_server(("127.0.0.1", 8000)))
        with run.start("demo", "--no-browser") as process:
            said = read_until(process, "Log in, once,")
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=60)
        assert "Port 8000 is taken; this is another.\n" in said
        assert ":8000/" not in said[-1]
        refused = run("demo", "--no-browser", "--port", 8000, status=1)
        assert "cannot listen on 127.0.0.1:8000: Address already in use" in refused.stderr


def test_version_and_help_name_every_command(run: Commands) -> None:
    assert run("--version").stdout.startswith("ars-web ")
    top = run("--help").stdout
    assert run().stdout == top
    for name in ("demo", "serve", "import", "list", "boxes", "export", "preview", "check", "openapi"):
        assert f"  {name} " in top


def test_help_loads_nothing_heavy(run: Commands) -> None:
    watched = ("numpy", "numba", "cv2", "scipy", "sqlalchemy", "fastapi", "uvicorn", "trimesh", "shapely", "rich")
    code = (
        "import sys; from ars_web.cli import run; run(['--help']);"
        f" print([m for m in {watched!r} if m in sys.modules], file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.strip() == "[]"
