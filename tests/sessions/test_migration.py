"""Databases of older programs open with all they hold; nothing is lost where that fails."""

import shutil
import sqlite3
import threading
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest
from alembic.script import ScriptDirectory
from sqlalchemy import create_engine, inspect

from ars_web.errors import StoreError
from ars_web.geometry.box import Box
from ars_web.sessions import migration, tables
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.edits import differences
from ars_web.sessions.model import SessionState
from ars_web.sessions.store import SessionStore

MakeBox = Callable[..., Box]


@pytest.fixture
def old(store: SessionStore, editor: SessionEditor, sid: str, a_box: MakeBox, tmp_path: Path) -> SessionState:
    """The session's database, with two edits in it, made anew by the first step alone; its state."""
    editor.add_box(sid, class_id=0, box=a_box(), author="me")
    editor.change_box(sid, 1, expected_revision=1, name="left", author="me")
    state = store.state(sid)
    store.close()
    path, older = store.folder / sid / "session.sqlite", tmp_path / "older.sqlite"
    migration.bring_up_to_date(older, target="0001")
    with closing(sqlite3.connect(older)) as connection:
        connection.execute("ATTACH ? AS newer", (str(path),))
        made = connection.execute("SELECT name FROM main.sqlite_master WHERE type = 'table'").fetchall()
        assert ("request",) not in made
        for (table,) in made:
            if table != "alembic_version":
                connection.execute(f"INSERT INTO main.{table} SELECT * FROM newer.{table}")
        connection.commit()
    older.replace(path)
    return state


def schema(path: Path) -> str:
    with closing(sqlite3.connect(path)) as connection:
        return connection.execute("SELECT version_num FROM alembic_version").fetchone()[0]


def dump(path: Path) -> list[str]:
    with closing(sqlite3.connect(path)) as connection:
        return list(connection.iterdump())


def test_an_old_database_is_migrated_when_it_is_opened_and_backed_up_before(
    store: SessionStore, editor: SessionEditor, sid: str, old: SessionState, a_box: MakeBox
):
    path = store.folder / sid / "session.sqlite"
    before = dump(path)
    assert schema(path) == "0001"
    assert differences(store.state(sid), old) == []
    assert schema(path) == migration.SCHEMA
    assert dump(path.with_name("session.sqlite.before-0002")) == before
    assert editor.undo(sid, author="me").revision == 3
    assert editor.add_box(sid, class_id=0, box=a_box(), author="me", key="k").revision == 4
    assert sorted(p.name for p in path.parent.iterdir() if not p.name.endswith(("-wal", "-shm"))) == [
        "session.sqlite", "session.sqlite.before-0002",
    ]  # fmt: skip


def test_a_step_that_fails_leaves_the_old_database(
    store: SessionStore, sid: str, old: SessionState, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    path = store.folder / sid / "session.sqlite"
    before = dump(path)
    scripts = tmp_path / "migrations"
    shutil.copytree(migration.SCRIPTS, scripts, ignore=shutil.ignore_patterns("__pycache__"))
    step = scripts / "versions" / "0002_requests.py"
    step.write_text(step.read_text() + '    op.execute("DELETE FROM edit")\n    op.execute("SELECT * FROM nowhere")\n')
    with pytest.raises(StoreError, match=r"from schema 0001 to 0002 failed and was taken back: .*nowhere"):
        migration.bring_up_to_date(path, scripts=scripts)
    assert dump(path) == before == dump(path.with_name("session.sqlite.before-0002"))
    assert differences(store.state(sid), old) == []


def test_a_step_that_leaves_rows_without_what_they_refer_to_fails(
    store: SessionStore, sid: str, old: SessionState, tmp_path: Path
):
    path = store.folder / sid / "session.sqlite"
    before = dump(path)
    scripts = tmp_path / "migrations"
    shutil.copytree(migration.SCRIPTS, scripts, ignore=shutil.ignore_patterns("__pycache__"))
    step = scripts / "versions" / "0002_requests.py"
    step.write_text(step.read_text() + '    op.execute("DELETE FROM object_class")\n')
    with pytest.raises(StoreError, match="rows are left without the row they refer to"):
        migration.bring_up_to_date(path, scripts=scripts)
    assert dump(path) == before


def test_a_database_of_a_newer_program_is_left_alone(store: SessionStore, sid: str):
    store.close()
    path = store.folder / sid / "session.sqlite"
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("UPDATE alembic_version SET version_num = '9999'")
        connection.commit()
    before = dump(path)
    with pytest.raises(StoreError, match=r"its schema is 9999, which a newer ars-web made.*Update ars-web"):
        store.state(sid)
    assert dump(path) == before
    assert any("newer ars-web" in problem for problem in store.check())
    assert list(path.parent.glob("*before*")) == []


def test_threads_that_open_an_old_database_at_once_migrate_it_once(store: SessionStore, sid: str, old: SessionState):
    meet = threading.Barrier(4, timeout=30)
    found: list[SessionState] = []

    def look() -> None:
        with SessionStore(store.folder) as own:
            meet.wait()
            found.append(own.state(sid))

    threads = [threading.Thread(target=look) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert [differences(state, old) for state in found] == [[]] * 4


def test_the_schema_is_the_newest_step_and_makes_the_tables(tmp_path: Path):
    assert ScriptDirectory(migration.SCRIPTS).get_current_head() == migration.SCHEMA
    migration.bring_up_to_date(tmp_path / "new.sqlite")
    engines = [create_engine(f"sqlite:///{tmp_path / name}.sqlite") for name in ("new", "declared")]
    tables.metadata.create_all(engines[1])
    migrated, declared = (described(inspect(engine)) for engine in engines)
    for engine in engines:
        engine.dispose()
    del migrated["alembic_version"]
    assert migrated == declared


def described(inspector: object) -> dict[str, object]:
    keys = ("name", "nullable", "default", "primary_key")
    return {
        table: (
            [(str(c["type"]), *(c[key] for key in keys)) for c in inspector.get_columns(table)],
            sorted(str(sorted(i.items(), key=str)) for i in inspector.get_indexes(table)),
            sorted(str(sorted(k.items(), key=str)) for k in inspector.get_foreign_keys(table)),
            sorted(str(u["column_names"]) for u in inspector.get_unique_constraints(table)),
            sorted(str(c["sqltext"]) for c in inspector.get_check_constraints(table)),
        )
        for table in inspector.get_table_names()
    }  # fmt: skip


def test_a_folder_may_have_any_name(tmp_path: Path):
    folder = tmp_path / "100% of ünïcode ?mode=ro#x"
    folder.mkdir()
    migration.bring_up_to_date(folder / "session.sqlite")
    assert schema(folder / "session.sqlite") == migration.SCHEMA
    with closing(sqlite3.connect(folder / "session.sqlite")):
        assert [path.name for path in folder.iterdir()] == ["session.sqlite"]
