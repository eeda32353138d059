"""What SQLite's failures mean to a user, and what its files are called."""

import sqlite3
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from sqlalchemy import URL
from sqlalchemy.exc import DatabaseError, NoResultFound, OperationalError
from sqlalchemy.exc import TimeoutError as PoolTimeout

from ars_web.errors import StoreError

DAMAGED = "the database is damaged; bring back the newest session.sqlite.before-* or a session export"
NO_DATABASE = "this is no session database; bring back session.sqlite from a backup or a session export"

_REMEDIES = {
    "full": "the disk is full; nothing of this change was kept. Free some space and try again",
    "locked": "another program holds the session's database; try again when it is done",
    "readonly": "the session cannot be written; check the folder's permissions",
    "unable to open": "the session's database cannot be opened; check the folder's permissions",
    "disk I/O": "the disk refused a read or write; check its space and health",
    "malformed": DAMAGED,
    "not a database": NO_DATABASE,
}


def database_url(path: Path) -> URL:
    """SQLAlchemy's name for a database file, whatever characters its path has."""
    return URL.create("sqlite", database=str(path))


@contextmanager
def explained(path: Path) -> Generator[None]:
    """Say in words, and with the remedy, what SQLite says in codes."""
    try:
        yield
    except PoolTimeout as error:
        raise StoreError(f"{path}: too many requests at once; try again") from error
    except NoResultFound as error:
        raise StoreError(f"{path}: a row that must be there is not: {DAMAGED}") from error
    except sqlite3.Error as error:
        raise StoreError(f"{path}: {_remedy(str(error))}") from error
    except DatabaseError as error:
        # Its other children (a broken constraint, a wrong statement) would be mistakes of this program.
        if not isinstance(error, OperationalError) and type(error) is not DatabaseError:
            raise
        raise StoreError(f"{path}: {_remedy(str(error.orig))}") from error


def _remedy(said: str) -> str:
    for sign, remedy in _REMEDIES.items():
        if sign in said:
            return f"{remedy} (SQLite: {said})"
    return f"SQLite: {said}"
