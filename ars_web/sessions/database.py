"""One session's SQLite database: how it is opened, how a transaction begins, and what its failures mean."""

import sqlite3
import threading
import time
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from sqlalchemy import Connection, create_engine, event
from sqlalchemy.engine.interfaces import DBAPIConnection, DBAPICursor
from sqlalchemy.pool import ConnectionPoolEntry, QueuePool

from ars_web.errors import NotFound, StoreError
from ars_web.sessions import migration
from ars_web.sessions.sqlite import NO_DATABASE, database_url, explained

BUSY_MS = 20_000
"""How long a writer waits for another process's transaction before it gives up."""


class Database:
    """A pool of connections to one database file; any number of threads may use it.

    Opening brings the schema up to date. `reading` and `writing` are the only ways to a connection.
    """

    def __init__(self, path: Path) -> None:
        """Raises StoreError for a file that is no usable database, NotFound where there is none."""
        self.path = path
        self._inode = _inode(path)
        self._closed = False
        self._engine = create_engine(
            database_url(path), poolclass=QueuePool, pool_size=2, max_overflow=62, pool_timeout=BUSY_MS / 1000
        )
        event.listen(self._engine, "connect", _configure)
        event.listen(self._engine, "begin", _begin)
        # SQLite's own wait polls and is not fair; threads of this process queue here instead.
        self.write_lock = threading.RLock()
        try:
            with self._connect(write=False) as connection:
                schema = migration.schema_of(connection)
            if schema is None:
                raise StoreError(f"{path}: {NO_DATABASE}")
            if schema != migration.SCHEMA:
                migration.bring_up_to_date(path)
        except BaseException:
            self.close()
            raise

    @property
    def is_current(self) -> bool:
        """Whether the file that was opened is still the one at its path; a session may be moved to the trash."""
        try:
            return _inode(self.path) == self._inode
        except NotFound:
            return False

    @contextmanager
    def reading(self) -> Generator[Connection]:
        """A connection that sees one state of the database, whatever others commit meanwhile."""
        with self._connect(write=False) as connection:
            self._refuse_moved()
            yield connection

    @contextmanager
    def writing(self) -> Generator[Connection]:
        """A connection that alone may write. Leaving commits; an exception takes everything back.

        What was written is on the disk when this returns.
        """
        with self.write_lock, self._connect(write=True) as connection:
            # After the lock is held: deleting a session takes the lock too, so nothing is written to the trash.
            self._refuse_moved()
            yield connection

    def close(self) -> None:
        """Close the connections that are not in use; those in use close when they are given back."""
        self._closed = True
        self._engine.dispose()

    @contextmanager
    def _connect(self, *, write: bool) -> Generator[Connection]:
        try:
            with explained(self.path), self._engine.connect().execution_options(ars_write=write) as connection:
                with connection.begin():
                    yield connection
        finally:
            if self._closed:  # by another thread, while this one was at work
                self._engine.dispose()

    def _refuse_moved(self) -> None:
        if not self.is_current:
            raise NotFound(f"session {self.path.parent.name} was deleted meanwhile")


def _inode(path: Path) -> int:
    try:
        return path.stat().st_ino
    except FileNotFoundError as error:
        raise NotFound(f"there is no session {path.parent.name!r}") from error


def _configure(connection: DBAPIConnection, record: ConnectionPoolEntry) -> None:
    # The driver would begin transactions by its own rules; `_begin` does it by ours.
    connection.isolation_level = None  # pyright: ignore[reportAttributeAccessIssue]: sqlite3's own
    cursor = connection.cursor()
    try:
        cursor.execute(f"PRAGMA busy_timeout = {BUSY_MS}")
        mode = _write_ahead(cursor)
        if mode != ("wal",):
            raise StoreError(f"SQLite cannot keep a write-ahead log here (got {mode}); is this a network file system?")
        # FULL: the log is synced at every commit. NORMAL would lose acknowledged edits in a power cut.
        cursor.execute("PRAGMA synchronous = FULL")
        # On macOS a plain sync leaves data in the drive's cache; elsewhere this is ignored.
        cursor.execute("PRAGMA fullfsync = ON")
        cursor.execute("PRAGMA foreign_keys = ON")
        # Session files come from strangers too: nothing in a schema may call functions with side effects.
        cursor.execute("PRAGMA trusted_schema = OFF")
    finally:
        cursor.close()


def _write_ahead(cursor: DBAPICursor) -> object:
    """Ask for the write-ahead log until the file is free: for this alone SQLite does not wait by itself, and others
    may be opening or migrating the same database."""
    deadline = time.monotonic() + BUSY_MS / 1000
    while True:
        try:
            cursor.execute("PRAGMA journal_mode = WAL")
            return cursor.fetchone()
        except sqlite3.OperationalError as error:
            if "locked" not in str(error) or time.monotonic() > deadline:
                raise
            time.sleep(0.01)


def _begin(connection: Connection) -> None:
    write = connection.get_execution_options().get("ars_write", False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if write else "BEGIN")
