"""Databases of older programs open with all they hold; nothing is lost where that fails."""

import json
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
from ars_web.geometry.polygon import Polygon
from ars_web.sessions import migration, tables
from ars_web.sessions.editing import MaskDraft, SessionEditor
from ars_web.sessions.edits import differences
from ars_web.sessions.hull_mesh import HullMesh
from ars_web.sessions.model import SessionState
from ars_web.sessions.object_mesh import SourcedMesh
from ars_web.sessions.store import SessionStore

MakeBox = Callable[..., Box]
MakeOlder = Callable[[Path, str], None]


@pytest.fixture(params=["0001", "0002", "0003", "0004"])
def old(
    request: pytest.FixtureRequest,
    store: SessionStore,
    editor: SessionEditor,
    sid: str,
    a_box: MakeBox,
    made_by_older_program: MakeOlder,
) -> SessionState:
    """The session, with two edits in it, as an older program's database holds it; its state."""
    editor.add_box(sid, class_id=0, box=a_box(), author="me")
    editor.change_box(sid, 1, expected_revision=1, name="left", author="me")
    state = store.state(sid)
    store.close()
    made_by_older_program(store.folder / sid / "session.sqlite", request.param)
    return state


def schema(path: Path) -> str:
    with closing(sqlite3.connect(path)) as connection:
        return connection.execute("SELECT version_num FROM alembic_version").fetchone()[0]


def dump(path: Path) -> list[str]:
    with closing(sqlite3.connect(path)) as connection:
        return list(connection.iterdump())


def test_an_old_database_is_migrated_when_it_is_opened_and_backed_up_before(
    store: SessionStore,
    editor: SessionEditor,
    sid: str,
    old: SessionState,
    a_box: MakeBox,
    a_hull: Callable[..., HullMesh],
    a_mesh: Callable[..., SourcedMesh],
    outline: Callable[..., tuple[Polygon, ...]],
):
    path = store.folder / sid / "session.sqlite"
    before = dump(path)
    assert schema(path) < migration.SCHEMA
    assert differences(store.state(sid), old) == []
    assert schema(path) == migration.SCHEMA
    assert dump(path.with_name(f"session.sqlite.before-{migration.SCHEMA}")) == before
    with closing(sqlite3.connect(path)) as connection:
        columns = {row[1] for row in connection.execute("PRAGMA table_info(box)")}
    assert {"hull", "hull_options"} < columns
    assert "has_hull" not in columns  # no box had one
    assert editor.undo(sid, author="me").revision == 3
    assert editor.add_box(sid, class_id=0, box=a_box(), author="me", key="k").revision == 4
    assert sorted(p.name for p in path.parent.iterdir() if not p.name.endswith(("-wal", "-shm"))) == [
        "session.sqlite", f"session.sqlite.before-{migration.SCHEMA}",
    ]  # fmt: skip
    made = editor.put_object(
        sid, box_id=None, class_id=0, box=a_box(), hull=a_hull(), hull_options=None, masks=[MaskDraft(0, outline())],
        author="me",
    )  # fmt: skip
    assert (made.has_hull, list(store.state(sid).masks)) == (True, [1])
    shaped = editor.change_class(sid, 0, expected_revision=0, mesh=a_mesh(), fit_size=True, author="me")
    assert (shaped.mesh, shaped.default_size) == (a_mesh().mesh.digest, (0.25, 0.5, 1.0))
    assert all("images are not where" in problem for problem in store.check())


def test_a_step_that_fails_leaves_the_old_database(
    store: SessionStore, sid: str, old: SessionState, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    path = store.folder / sid / "session.sqlite"
    before, old_schema = dump(path), schema(path)
    scripts = tmp_path / "migrations"
    shutil.copytree(migration.SCRIPTS, scripts, ignore=shutil.ignore_patterns("__pycache__"))
    step = scripts / "versions" / "0005_meshes.py"
    step.write_text(step.read_text() + '    op.execute("DELETE FROM edit")\n    op.execute("SELECT * FROM nowhere")\n')
    with pytest.raises(
        StoreError, match=rf"from schema {old_schema} to {migration.SCHEMA} failed and was taken back: .*nowhere"
    ):
        migration.bring_up_to_date(path, scripts=scripts)
    assert dump(path) == before == dump(path.with_name(f"session.sqlite.before-{migration.SCHEMA}"))
    assert differences(store.state(sid), old) == []


def test_a_step_that_leaves_rows_without_what_they_refer_to_fails(
    store: SessionStore, sid: str, old: SessionState, tmp_path: Path
):
    path = store.folder / sid / "session.sqlite"
    before = dump(path)
    scripts = tmp_path / "migrations"
    shutil.copytree(migration.SCRIPTS, scripts, ignore=shutil.ignore_patterns("__pycache__"))
    step = scripts / "versions" / "0005_meshes.py"
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
            sorted(json.dumps(i, default=str, sort_keys=True) for i in inspector.get_indexes(table)),
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
