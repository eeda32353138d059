"""Bringing a session's database to the schema that this program knows, with a backup before each time."""

import os
import sqlite3
import threading
from contextlib import closing
from pathlib import Path

from sqlalchemy import Connection, create_engine, event, text
from sqlalchemy.engine.interfaces import DBAPIConnection
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.pool import ConnectionPoolEntry, NullPool

from ars_web.errors import StoreError
from ars_web.sessions.sqlite import database_url, explained

SCHEMA = "0005"
"""The newest step under `migrations/versions`. A constant, so that opening a session does not load Alembic."""

SCRIPTS = Path(__file__).parent / "migrations"

_ALEMBIC = threading.Lock()


def bring_up_to_date(path: Path, *, scripts: Path = SCRIPTS, target: str = SCHEMA) -> None:
    """Bring the database at `path`, made if it is not there, to schema `target`; nothing happens where it is there.

    An existing database is first copied to `NAME.before-TARGET` beside it. All steps run in one transaction: if
    one fails, the database is what it was.

    Raises:
        StoreError: the database was made by a newer program, or a step failed.
    """
    engine = create_engine(database_url(path), poolclass=NullPool)
    event.listen(engine, "connect", _begin_by_hand)
    # Leaving the connection without COMMIT takes everything back.
    with explained(path), engine.connect() as connection:
        connection.exec_driver_sql("BEGIN IMMEDIATE")
        # Asked again within the transaction: another process may have migrated it meanwhile.
        found = schema_of(connection)
        if found == target:
            return
        if found is None:
            _run_steps(connection, scripts, target)
        else:
            _refuse_newer(found, path, scripts)
            back_up(path, path.with_name(f"{path.name}.before-{target}"))
            try:
                _run_steps(connection, scripts, target)
                _refuse_broken_links(connection)
            except (SQLAlchemyError, StoreError) as error:
                raise StoreError(
                    f"{path}: migrating from schema {found} to {target} failed and was taken back: {error};"
                    f" a copy is at {path.name}.before-{target}"
                ) from error
        connection.exec_driver_sql("COMMIT")


def schema_of(connection: Connection) -> str | None:
    """The schema's number, None for a database without one."""
    named = text("SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = 'alembic_version'")
    if connection.execute(named).first() is None:
        return None
    return connection.execute(text("SELECT version_num FROM alembic_version")).scalar_one()


def back_up(source: Path, target: Path) -> None:
    """Copy a database as it is now, while others may write to it, to a single file that is whole or absent."""
    partial = target.with_name(f".{target.name}.partial")
    partial.unlink(missing_ok=True)
    with closing(sqlite3.connect(source)) as old, closing(sqlite3.connect(partial)) as new:
        old.backup(new)
        # A copied WAL database would want its side files back; alone it is to be one file.
        new.execute("PRAGMA journal_mode = DELETE")
    try:
        with partial.open("rb+") as file:
            os.fsync(file.fileno())
        partial.replace(target)
    except OSError as error:
        raise StoreError(f"{target}: the database cannot be copied here: {error.strerror}") from error


def _begin_by_hand(connection: DBAPIConnection, record: ConnectionPoolEntry) -> None:
    # The driver commits before DDL unless it is told to leave transactions alone. No foreign keys here: steps
    # that rebuild a table drop the old one, and what they leave is checked as a whole.
    connection.isolation_level = None  # pyright: ignore[reportAttributeAccessIssue]: sqlite3's own
    connection.execute("PRAGMA busy_timeout = 30000")  # pyright: ignore[reportAttributeAccessIssue]: sqlite3's own


def _run_steps(connection: Connection, scripts: Path, target: str) -> None:
    from alembic import command
    from alembic.config import Config

    config = Config(attributes={"connection": connection})
    # Alembic's options are ini values: a % in a path would be read as the start of a reference.
    config.set_main_option("script_location", str(scripts).replace("%", "%%"))
    config.set_main_option("path_separator", "os")
    # Alembic keeps what it is doing in a module's globals: one thread at a time.
    with _ALEMBIC:
        command.upgrade(config, target)


def _refuse_broken_links(connection: Connection) -> None:
    broken = connection.exec_driver_sql("PRAGMA foreign_key_check").all()
    if broken:
        raise StoreError(f"rows are left without the row they refer to: {broken[:3]}")


def _refuse_newer(found: str, path: Path, scripts: Path) -> None:
    from alembic.script import ScriptDirectory

    known = {script.revision for script in ScriptDirectory(scripts).walk_revisions()}
    if found not in known:
        raise StoreError(
            f"{path}: its schema is {found}, which a newer ars-web made; this one knows up to {max(known)}."
            " Update ars-web to open it"
        )
