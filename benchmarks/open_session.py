"""How long a session of 36,000 frames takes to be made and to open: python benchmarks/open_session.py

Beside it the naive way: one JSON file, one object a frame. Opening means that frames, boxes and classes are
answered by a store that has not seen the session before.
"""

import json
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import numpy as np
import scene

from ars_web.geometry import rigid_transform
from ars_web.recordings.recording import Frame, RecordedBox, Recording
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.edits import differences, replay
from ars_web.sessions.store import SessionStore

T = TypeVar("T")

FRAMES, EDITS = 36_000, 1000


def recording(place: Path) -> Recording:
    """The benchmarks' scene; its images need not be there."""
    frames = tuple(
        Frame(f"images/{i:05d}.jpg", place / "images" / f"{i:05d}.jpg", 0, T) for i, T in enumerate(scene.poses(FRAMES))
    )
    boxes = tuple(RecordedBox(f"class {i % 5}", box) for i, box in enumerate(scene.boxes()))
    names = tuple(f"class {i}" for i in range(5))
    return Recording("ars", place, {0: scene.camera()}, frames, class_names=names, boxes=boxes)


def seconds(work: Callable[[], T]) -> tuple[float, T]:
    """How long `work` took, and what it gave."""
    begin = time.perf_counter()
    result = work()
    return time.perf_counter() - begin, result


def naive_write(path: Path, made: Recording) -> None:
    """Every frame as a JSON object."""
    frames = [{"name": f.name, "image": str(f.image), "T": f.T_world_camera.tolist()} for f in made.frames]
    path.write_text(json.dumps(frames))


def naive_open(path: Path) -> list[Frame]:
    """Every JSON object as a frame."""
    return [
        Frame(frame["name"], Path(frame["image"]), 0, rigid_transform.checked(np.array(frame["T"])))
        for frame in json.loads(path.read_text())
    ]


def main() -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        made = recording(place)
        with SessionStore(place / "sessions") as store:
            create, summary = seconds(lambda: store.create(made, name="bench"))
            editor, sid = SessionEditor(store), summary.id
            origin = store.state(sid)

            def edit() -> None:
                for i in range(EDITS):
                    box = store.state(sid).boxes[1 + i % 20]
                    size = np.array([0.1, 0.2, 0.1 + i / 1000])
                    editor.change_box(sid, box.id, expected_revision=box.revision, size=size, author="bench")

            editing, _ = seconds(edit)
        with SessionStore(place / "sessions") as store:
            opening, snapshot = seconds(lambda: store.snapshot(sid))
            again, _ = seconds(lambda: store.snapshot(sid))
            replaying, replayed = seconds(lambda: replay(origin, store.edits(sid)))
        assert np.array_equal(snapshot.frames.Ts_world_camera, made.Ts_world_camera)
        assert differences(replayed, snapshot.state) == []
        naive_create, _ = seconds(lambda: naive_write(place / "naive.json", made))
        naive, _ = seconds(lambda: naive_open(place / "naive.json"))
    print(f"{FRAMES} frames, 20 boxes, {EDITS} edits")
    print(f"{'make the session':36} {create:7.3f} s    one JSON file {naive_create:7.3f} s")
    print(f"{'open it: frames, boxes, classes':36} {opening:7.3f} s    one JSON file {naive:7.3f} s")
    print(f"{'ask the open one again':36} {again * 1e3:7.3f} ms")
    print(f"{'one edit, on the disk':36} {editing / EDITS * 1e3:7.3f} ms")
    print(f"{'replay the log':36} {replaying:7.3f} s")


if __name__ == "__main__":
    main()
