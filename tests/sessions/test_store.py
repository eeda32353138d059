"""Sessions appear whole or not at all, and are found again as they were."""

import shutil
import signal
import subprocess
import sys
import textwrap
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from ars_web.errors import BadInput, Cancelled, NotFound, RefusedPath
from ars_web.geometry.box import Box
from ars_web.recordings.recording import Frame, RecordedBox, Recording, SkippedFrame
from ars_web.sessions import session_folders
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.edits import differences
from ars_web.sessions.store import SessionStore

MakeRecording = Callable[..., Recording]
MakeBox = Callable[..., Box]


def test_a_session_holds_the_recording_as_it_was(store: SessionStore, make_recording: MakeRecording, a_box: MakeBox):
    recording = make_recording(
        5,
        class_names=("cube", "ball"),
        skipped=(SkippedFrame("x.jpg", "no pose", "poses.txt:3"),),
        boxes=(RecordedBox("ball", a_box()), RecordedBox("ball", a_box(1.0))),
    )
    made = store.create(recording, name="table", class_names=["ball", "ring"])
    with SessionStore(store.folder) as again:
        assert again.list() == [made]
        snapshot = again.snapshot(made.id)
        assert again.skipped(made.id) == recording.skipped
        assert again.cameras(made.id) == recording.cameras
        assert again.frames(made.id) is again.frames(made.id)
    assert (made.frames, made.classes, made.boxes, made.skipped, made.revision) == (5, 3, 2, 1, 0)
    assert made.source == str(recording.source)
    assert snapshot.cameras == recording.cameras
    assert snapshot.frames.names == tuple(frame.name for frame in recording.frames)
    assert snapshot.frames.images == tuple(frame.image for frame in recording.frames)
    assert snapshot.frames.camera_ids.tolist() == [0, 1, 0, 1, 0]
    assert np.array_equal(snapshot.frames.Ts_world_camera, recording.Ts_world_camera)
    assert [(c.id, c.name) for c in snapshot.state.classes.values()] == [(0, "cube"), (1, "ball"), (2, "ring")]
    assert [(b.id, b.class_id, b.name) for b in snapshot.state.boxes.values()] == [(1, 1, "ball"), (2, 1, "ball 2")]
    assert np.array_equal(snapshot.state.boxes[2].box.T_world_box, a_box(1.0).T_world_box)
    assert (snapshot.state.next_class_id, snapshot.state.next_box_id) == (3, 3)


def test_frames_that_many_want_at_once_are_read_once(store: SessionStore, make_recording: MakeRecording):
    sid = store.create(make_recording(3000), name="s").id
    start = threading.Barrier(8)

    def read(_: int):
        start.wait()
        return store.frames(sid)

    with ThreadPoolExecutor(8) as threads:
        first, *others = threads.map(read, range(8))
    assert all(frames is first for frames in others)


def test_frames_cannot_be_written_to(store: SessionStore, sid: str):
    frames = store.frames(sid)
    with pytest.raises(ValueError, match="read-only"):
        frames.Ts_world_camera[0, 0, 0] = 2.0


def test_images_are_copied_when_asked(store: SessionStore, make_recording: MakeRecording):
    recording = make_recording(4, images=True)
    seen: list[tuple[int, int]] = []
    sid = store.create(recording, name="s", copy_images=True, progress=lambda *done: seen.append(done)).id
    assert seen == [(1, 4), (2, 4), (3, 4), (4, 4)]
    shutil.rmtree(recording.source)
    for frame, image in zip(recording.frames, store.frames(sid).images, strict=True):
        assert image == store.folder / sid / "images" / frame.name
    assert store.frames(sid).images[3].read_bytes() == b"image 3" * 50
    assert store.check() == []


def test_progress_without_copies_ends_at_all_frames(store: SessionStore, make_recording: MakeRecording):
    seen: list[tuple[int, int]] = []
    store.create(make_recording(4500), name="s", progress=lambda *done: seen.append(done))
    assert seen == [(2000, 4500), (4000, 4500), (4500, 4500)]


def test_an_image_that_is_not_there_cannot_be_copied(store: SessionStore, make_recording: MakeRecording):
    recording = make_recording(4, images=True)
    recording.frames[2].image.unlink()
    with pytest.raises(BadInput, match=r"cam0/00002.jpg: the image cannot be read: No such file"):
        store.create(recording, name="s", copy_images=True)
    assert_nothing_left(store)


def test_what_progress_raises_stops_the_import_and_leaves_nothing(store: SessionStore, make_recording: MakeRecording):
    def stop(done: int, total: int) -> None:
        raise Cancelled("enough")

    for copy in (True, False):
        with pytest.raises(Cancelled):
            store.create(make_recording(3, images=True), name="s", copy_images=copy, progress=stop)
        assert_nothing_left(store)


def assert_nothing_left(store: SessionStore) -> None:
    assert store.list() == []
    assert session_folders.leftovers(store.folder) == []
    assert sorted(path.name for path in store.folder.iterdir()) == [".building"]


def renamed(recording: Recording, *names: str) -> Recording:
    frames = tuple(
        Frame(name, f.image, f.camera_id, f.T_world_camera) for name, f in zip(names, recording.frames, strict=True)
    )
    return Recording("ars", recording.source, recording.cameras, frames)


def test_a_recording_that_is_not_sound_is_refused(store: SessionStore, make_recording: MakeRecording, a_box: MakeBox):
    two = make_recording(2)
    with pytest.raises(RefusedPath, match=r"\.\./a\.jpg"):
        store.create(renamed(two, "a.jpg", "../a.jpg"), name="s", copy_images=True)
    with pytest.raises(BadInput, match=r"two frames are called 'a\.jpg'"):
        store.create(renamed(two, "a.jpg", "a.jpg"), name="s")
    with pytest.raises(BadInput, match="no frame that can be used"):
        store.create(make_recording(0), name="s")
    with pytest.raises(BadInput, match="camera 1, which is not listed"):
        store.create(Recording("ars", two.source, {0: two.cameras[0]}, two.frames), name="s")
    with pytest.raises(BadInput, match="class 'ring', which it does not list"):
        store.create(make_recording(boxes=(RecordedBox("ring", a_box()),)), name="s")
    with pytest.raises(BadInput, match="a session needs a name"):
        store.create(two, name=" ")
    with pytest.raises(BadInput, match="a class's name"):
        store.create(two, name="s", class_names=["a\nb"])
    assert store.list() == []


def test_a_session_is_found_by_its_id_or_its_name(store: SessionStore, make_recording: MakeRecording):
    one, two = (store.create(make_recording(), name="table").id for _ in range(2))
    three = store.create(make_recording(), name="cell").id
    assert store.find(one) == one
    assert store.find("cell") == three
    with pytest.raises(BadInput, match=f"2 sessions are named 'table': say which by its id: {one}, {two}"):
        store.find("table")
    for unknown in ("", "nothing", "../table", "abcdefghijkl"):
        with pytest.raises(NotFound, match=repr(unknown)):
            store.find(unknown)


@pytest.mark.parametrize("unknown", ["", ".", "..", ".trash", "abcdefghijkl", "../sessions", "a/b", "a\0b"])
def test_an_unknown_session_is_not_found_by_any_method(store: SessionStore, sid: str, unknown: str):
    editor = SessionEditor(store)
    for method in (
        store.summary, store.state, store.cameras, store.frames, store.snapshot, store.skipped, store.edits,
        store.revision, store.delete, store.restore, lambda s: editor.undo(s, author="a"),
    ):  # fmt: skip
        with pytest.raises(NotFound):
            method(unknown)


def test_a_deleted_session_can_be_restored(store: SessionStore, editor: SessionEditor, sid: str, a_box: MakeBox):
    editor.add_box(sid, class_id=0, box=a_box(), author="me")
    before = store.state(sid)
    store.delete(sid)
    assert store.list() == []
    assert (store.folder / ".trash" / sid / "session.sqlite").is_file()
    with pytest.raises(NotFound):
        store.state(sid)
    store.restore(sid)
    assert differences(store.state(sid), before) == []
    editor.add_box(sid, class_id=0, box=a_box(), author="me")
    with pytest.raises(NotFound):
        store.restore(sid)


def test_an_edit_never_goes_to_a_session_that_another_process_deleted(store: SessionStore, sid: str, a_box: MakeBox):
    editor = SessionEditor(store)
    editor.add_box(sid, class_id=0, box=a_box(), author="me")
    with SessionStore(store.folder) as other:
        other.delete(sid)
        with pytest.raises(NotFound):
            editor.add_box(sid, class_id=0, box=a_box(), author="me")
        with pytest.raises(NotFound):
            store.revision(sid)
        other.restore(sid)
        assert editor.add_box(sid, class_id=0, box=a_box(), author="me").revision == 2


def test_a_writer_that_waits_while_the_session_is_deleted_writes_nothing(store: SessionStore, sid: str, a_box: MakeBox):
    with SessionStore(store.folder) as other:
        other.state(sid)
        outcome: list[Exception | None] = []

        def edit() -> None:
            try:
                SessionEditor(other).add_box(sid, class_id=0, box=a_box(), author="me")
                outcome.append(None)
            except NotFound as error:
                outcome.append(error)

        thread = threading.Thread(target=edit)
        with store.writing(sid):
            thread.start()  # the other store's writer now waits for SQLite's lock, or is about to
            thread.join(0.2)
            assert thread.is_alive()
            session_folders.put_away(store.folder, sid)
        thread.join(30)
    assert [type(error) for error in outcome] == [NotFound]
    store.restore(sid)
    assert store.revision(sid) == 0


def test_a_repeated_key_gives_the_first_session(store: SessionStore, make_recording: MakeRecording):
    first = store.create(make_recording(), name="table", key="k-1")
    assert store.create(make_recording(), name="table", key="k-1") == first
    assert store.create(make_recording(), name="table", key="k-2").id != first.id
    with pytest.raises(BadInput, match="key 'k-1' was used for another import"):
        store.create(make_recording(), name="cell", key="k-1")
    SessionEditor(store).rename(first.id, name="renamed since", expected_revision=0, author="me")
    assert store.create(make_recording(), name="table", key="k-1").id == first.id
    store.delete(first.id)
    with pytest.raises(BadInput, match="deleted since"):
        store.create(make_recording(), name="table", key="k-1")
    with pytest.raises(BadInput, match="idempotency key"):
        store.create(make_recording(), name="table", key="")


def test_two_imports_with_one_key_at_once_make_one_session(store: SessionStore, make_recording: MakeRecording):
    both_build = threading.Barrier(2, timeout=30)
    found: list[str] = []

    def create() -> None:
        waited: list[int] = []

        def meet(done: int, total: int) -> None:
            if not waited:
                waited.append(done)
                both_build.wait()

        found.append(store.create(make_recording(), name="table", key="same", progress=meet).id)

    threads = [threading.Thread(target=create) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert len(found) == 2
    assert len(set(found)) == 1
    assert [summary.id for summary in store.list()] == found[:1]
    assert session_folders.leftovers(store.folder) == []


KILLED_IMPORT = """
import os, signal, sys
from pathlib import Path
import numpy as np
from ars_web.geometry.camera import Camera
from ars_web.recordings.recording import Frame, Recording
from ars_web.sessions.store import SessionStore

folder = Path(sys.argv[1])
image = folder.parent / "image.jpg"
image.write_bytes(b"x")
frames = tuple(Frame(f"{i}.jpg", image, 0, np.eye(4)) for i in range(5))
recording = Recording("ars", folder, {0: Camera(8, 8, 5.0, 5.0, 4.0, 4.0)}, frames)

def die(done, total):
    if done == 3:
        print("dying", flush=True)
        os.kill(os.getpid(), signal.SIGKILL)

SessionStore(folder).create(recording, name="half", copy_images=True, progress=die)
"""


def test_a_killed_import_leaves_no_session_and_is_cleaned_up(tmp_path: Path):
    folder = tmp_path / "sessions"
    killed = subprocess.run([sys.executable, "-c", KILLED_IMPORT, folder], capture_output=True, text=True)
    assert killed.returncode == -signal.SIGKILL, killed.stderr
    assert len(session_folders.leftovers(folder)) == 1
    with session_folders.unseen_folder(folder) as alive:
        # While another import is at work nothing is taken away, neither its folder nor the dead one's.
        with SessionStore(folder) as store:
            assert store.list() == []
            assert len(session_folders.leftovers(folder)) == 2
            assert "2 unfinished imports" in store.check()[0]
        assert alive.is_dir()
    with SessionStore(folder) as store:
        assert session_folders.leftovers(folder) == []
        assert store.check() == []


def test_reading_sees_what_another_process_wrote(store: SessionStore, sid: str, a_box: MakeBox):
    before = store.state(sid)
    script = textwrap.dedent("""
        import sys
        from pathlib import Path
        import numpy as np
        from ars_web.geometry.box import Box
        from ars_web.sessions.editing import SessionEditor
        from ars_web.sessions.store import SessionStore
        with SessionStore(Path(sys.argv[1])) as store:
            editor = SessionEditor(store)
            editor.add_class(sys.argv[2], name="ring", author="cli")
            editor.add_box(sys.argv[2], class_id=1, box=Box(np.eye(4), np.ones(3)), author="cli")
    """)
    subprocess.run([sys.executable, "-c", script, store.folder, sid], check=True)
    state = store.state(sid)
    assert (before.revision, state.revision) == (0, 2)
    assert state.classes[1].name == "ring"
    assert state.boxes[1].name == "ring"
    assert [edit.author for edit in store.edits(sid)] == ["cli", "cli"]
    assert [edit.revision for edit in store.edits(sid, after=1)] == [2]
    assert [edit.revision for edit in store.edits(sid, limit=1)] == [1]
    assert store.edits(sid, after=2) == []
