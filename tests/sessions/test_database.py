"""Databases are durable on every connection, and what fails is said in words and loses nothing."""

import sqlite3
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import psutil
import pytest
from sqlalchemy import Engine, event

from ars_web.errors import StoreError
from ars_web.geometry.box import Box
from ars_web.recordings.recording import Recording
from ars_web.sessions import session_folders
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.store import OPEN_AT_ONCE, SessionStore

MakeRecording = Callable[..., Recording]
MakeBox = Callable[..., Box]


def test_every_connection_is_durable(store: SessionStore, sid: str):
    seen: set[int] = set()
    meet = threading.Barrier(8, timeout=30)
    found: list[tuple[object, ...]] = []

    def look() -> None:
        database = store._session(sid).database
        with database.reading() as connection:
            meet.wait()  # so that all eight hold a connection of their own
            seen.add(id(connection.connection.dbapi_connection))
            found.append(
                tuple(
                    connection.exec_driver_sql(f"PRAGMA {name}").scalar_one()
                    for name in ("journal_mode", "synchronous", "foreign_keys", "trusted_schema", "busy_timeout")
                )
            )

    threads = [threading.Thread(target=look) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert len(seen) == 8
    assert found == [("wal", 2, 1, 0, 20_000)] * 8


def open_files(folder: Path) -> int:
    return sum(file.path.startswith(str(folder)) for file in psutil.Process().open_files())


def test_many_sessions_do_not_keep_many_files_open(store: SessionStore, make_recording: MakeRecording):
    recording = make_recording()
    ids = [store.create(recording, name=f"s{i}").id for i in range(OPEN_AT_ONCE + 3)]
    assert {summary.id for summary in store.list()} == set(ids)
    assert 0 < open_files(store.folder) <= 3 * OPEN_AT_ONCE
    store.close()
    assert open_files(store.folder) == 0
    assert store.revision(ids[0]) == 0


def test_a_folder_that_cannot_be_is_a_store_error(tmp_path: Path, make_recording: MakeRecording):
    (tmp_path / "file").write_text("not a folder")
    with SessionStore(tmp_path / "file") as store:
        with pytest.raises(StoreError, match="the sessions folder cannot be read"):
            store.list()
        with pytest.raises(StoreError, match="the sessions folder cannot be written: Not a directory"):
            store.create(make_recording(), name="s")
    with SessionStore(tmp_path / "absent") as store:
        assert store.list() == []
        assert not (tmp_path / "absent").exists()


def add_until_refused(editor: SessionEditor, sid: str, a_box: MakeBox) -> None:
    """The pages that the database has already are filled first."""
    for _ in range(200):
        editor.add_box(sid, class_id=0, box=a_box(), name="x" * 90, author="me")


@pytest.mark.parametrize(
    ("pragma", "message"),
    [
        ("max_page_count = 1", "the disk is full; nothing of this change was kept"),
        ("query_only = ON", "the session cannot be written; check the folder's permissions"),
    ],
)
def test_a_full_disk_or_a_read_only_one_keeps_nothing_of_the_change(
    store: SessionStore, editor: SessionEditor, sid: str, a_box: MakeBox, pragma: str, message: str
):
    first = editor.add_box(sid, class_id=0, box=a_box(), author="me")
    store.close()

    def limit(connection: sqlite3.Connection, record: object) -> None:
        connection.execute(f"PRAGMA {pragma}")

    event.listen(Engine, "connect", limit)
    try:
        with pytest.raises(StoreError, match=message):
            add_until_refused(editor, sid, a_box)
    finally:
        event.remove(Engine, "connect", limit)
    store.close()
    state = store.state(sid)
    assert first.id in state.boxes
    assert [edit.revision for edit in store.edits(sid)] == list(range(1, state.revision + 1))
    assert len(state.boxes) == state.revision
    assert editor.add_box(sid, class_id=0, box=a_box(), author="me").revision == state.revision + 1


@pytest.mark.parametrize("pages", [1, 20])
def test_an_import_that_finds_the_disk_full_leaves_nothing(
    store: SessionStore, make_recording: MakeRecording, pages: int
):
    """With one page not even the tables can be made; with twenty the frames have no place."""

    def limit(connection: sqlite3.Connection, record: object) -> None:
        connection.execute(f"PRAGMA max_page_count = {pages}")

    event.listen(Engine, "connect", limit)
    try:
        with pytest.raises(StoreError, match="the disk is full"):
            store.create(make_recording(2000), name="s")
    finally:
        event.remove(Engine, "connect", limit)
    assert store.list() == []
    assert session_folders.leftovers(store.folder) == []


TOO_LARGE = """
import resource, sys
from pathlib import Path
import numpy as np
from ars_web.errors import StoreError
from ars_web.geometry.camera import Camera
from ars_web.recordings.recording import Frame, Recording
from ars_web.sessions.store import SessionStore

folder = Path(sys.argv[1])
frames = tuple(Frame(f"{i}.jpg", folder / f"{i}.jpg", 0, np.eye(4)) for i in range(5000))
recording = Recording("ars", folder, {0: Camera(8, 8, 5.0, 5.0, 4.0, 4.0)}, frames)
resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000))
try:
    SessionStore(folder).create(recording, name="s")
except StoreError as error:
    print(error)
"""


def test_an_import_that_the_disk_refuses_leaves_nothing(tmp_path: Path):
    folder = tmp_path / "sessions"
    said = subprocess.run([sys.executable, "-c", TOO_LARGE, folder], capture_output=True, text=True)
    assert "session.sqlite: the dis" in said.stdout, said
    assert session_folders.leftovers(folder) == []
    assert session_folders.session_ids(folder) == []


def test_a_damaged_session_is_named_and_does_not_hide_the_others(
    store: SessionStore, make_recording: MakeRecording, sid: str, caplog: pytest.LogCaptureFixture
):
    other = store.create(make_recording(), name="other").id
    store.close()
    path = store.folder / sid / "session.sqlite"
    path.write_bytes(b"not a database" * 1000)
    with pytest.raises(StoreError, match=r"session\.sqlite: this is no session database; bring back"):
        store.state(sid)
    assert [summary.id for summary in store.list()] == [other]
    assert sid in caplog.text
    assert any(sid in problem and "no session database" in problem for problem in store.check())


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        ("DELETE FROM session", "a row that must be there is not"),
        ("UPDATE session SET changed = 'now'", "holds 'now' where a moment should be"),
        ("UPDATE session SET changed = '2026-01-01T00:00:00'", "without a time zone"),
        (None, "this is no session database"),
    ],
)
def test_damage_of_one_session_is_told_and_hides_no_other(
    store: SessionStore, make_recording: MakeRecording, sid: str, damage: str | None, message: str
):
    other = store.create(make_recording(), name="other").id
    store.close()
    path = store.folder / sid / "session.sqlite"
    if damage is None:
        path.write_bytes(b"")
    else:
        with closing(sqlite3.connect(path)) as connection:
            connection.execute(damage)
            connection.commit()
    with pytest.raises(StoreError, match=message):
        store.summary(sid)
    assert [summary.id for summary in store.list()] == [other]
    assert any(problem.startswith(f"session {sid}: ") for problem in store.check())


def test_check_sees_what_the_log_does_not_explain(store: SessionStore, sid: str, a_box: MakeBox):
    SessionEditor(store).add_box(sid, class_id=0, box=a_box(), author="me")
    frames = store.frames(sid)
    for image in frames.images:
        image.parent.mkdir(parents=True, exist_ok=True)
        image.write_bytes(b"x")
    assert store.check() == []
    with closing(sqlite3.connect(store.folder / sid / "session.sqlite")) as connection:
        connection.execute("UPDATE box SET size_x = 2 * size_x")
        connection.commit()
    store.close()
    assert store.check() == [f"session {sid}: the log and the tables differ in box 1"]
    frames.images[1].unlink()
    assert f"1 images are not where they were, the first is {frames.images[1]}" in store.check()[1]


def test_a_backup_brought_back_under_a_running_store_is_what_is_read(
    store: SessionStore, editor: SessionEditor, sid: str, a_box: MakeBox, tmp_path: Path
):
    store.back_up(sid, tmp_path / "earlier.sqlite")
    editor.add_box(sid, class_id=0, box=a_box(), author="me")
    with (
        closing(sqlite3.connect(tmp_path / "earlier.sqlite")) as earlier,
        closing(sqlite3.connect(store.folder / sid / "session.sqlite")) as live,
    ):
        earlier.backup(live)
    assert store.state(sid).boxes == {}
    assert editor.add_box(sid, class_id=0, box=a_box(), author="me").revision == 1


def test_one_session_that_is_slow_to_open_holds_up_no_other(
    store: SessionStore,
    make_recording: MakeRecording,
    sid: str,
    made_by_older_program: Callable[[Path, str], None],
):
    other = store.create(make_recording(), name="other").id
    store.close()
    path = store.folder / sid / "session.sqlite"
    made_by_older_program(path, "0001")  # so that opening it migrates, for which it waits below
    found: list[int] = []
    with closing(sqlite3.connect(path, isolation_level=None)) as holder:
        holder.execute("BEGIN IMMEDIATE")
        thread = threading.Thread(target=lambda: found.append(store.revision(sid)))
        thread.start()
        thread.join(0.3)
        assert thread.is_alive()
        assert store.revision(other) == 0
        assert found == []
        holder.execute("ROLLBACK")
    thread.join(30)
    assert found == [0]


def test_a_locked_database_is_said_in_words(store: SessionStore, sid: str, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("ars_web.sessions.database.BUSY_MS", 50)
    with closing(sqlite3.connect(store.folder / sid / "session.sqlite", isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")
        with SessionStore(store.folder) as late, pytest.raises(StoreError, match="another program holds"):
            SessionEditor(late).add_class(sid, name="ring", author="me")
        assert store.revision(sid) == 0  # readers do not wait for writers
