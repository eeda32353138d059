"""The sessions folder: where each session lies, how one appears whole or not at all, and how one is put away.

SESSIONS/SID/session.sqlite     a session; SID is its id
SESSIONS/SID/images/            its images, where they were copied in
SESSIONS/.building/             sessions that are being made, unseen until they are renamed
SESSIONS/.trash/                deleted sessions
"""

import contextlib
import fcntl
import hashlib
import os
import re
import secrets
import shutil
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from ars_web.errors import BadInput, NotFound, StoreError

DATABASE = "session.sqlite"
BUILDING = ".building"
TRASH = ".trash"
LOCK = "lock"

ID_LENGTH = 12
_ID = re.compile(r"[a-z][a-z0-9]{11}")
_ALPHABET = "abcdefghijklmnopqrstuvwxyz0123456789"


def new_id(*, key: str | None = None) -> str:
    """A session id: random, or for an idempotency key always the same, so that the folder itself is the memory
    of which keys were used."""
    if key is None:
        rest = "".join(secrets.choice(_ALPHABET) for _ in range(ID_LENGTH - 1))
        return secrets.choice(_ALPHABET[:26]) + rest
    number = int.from_bytes(hashlib.sha256(key.encode()).digest())
    digits: list[str] = []
    for base in (26, *[36] * (ID_LENGTH - 1)):
        number, digit = divmod(number, base)
        digits.append(_ALPHABET[digit])
    return "".join(digits)


def is_id(text: str) -> bool:
    """Whether `text` has the form of a session id; nothing else ever becomes part of a path."""
    return _ID.fullmatch(text) is not None


def session_folder(sessions: Path, sid: str) -> Path:
    """The folder of session `sid`.

    Raises:
        NotFound: there is none.
    """
    if not is_id(sid) or not (sessions / sid / DATABASE).is_file():
        raise NotFound(f"there is no session {sid!r}")
    return sessions / sid


def session_ids(sessions: Path) -> list[str]:
    """The ids of all sessions, sorted; none where the folder is not there yet.

    Raises:
        StoreError: the folder cannot be read.
    """
    try:
        return sorted(entry.name for entry in sessions.iterdir() if is_id(entry.name) and (entry / DATABASE).is_file())
    except FileNotFoundError:
        return []
    except OSError as error:
        raise StoreError(f"{sessions}: the sessions folder cannot be read: {error.strerror}") from error


@contextmanager
def building(sessions: Path, sid: str) -> Generator[Path]:
    """An empty hidden folder that becomes session `sid` when the block ends, and goes when it raises.

    A killed process leaves it behind; `clean_up` takes it away later.

    Raises:
        StoreError: the sessions folder cannot be written.
        FileExistsError: there is a session `sid` by now.
    """
    with unseen_folder(sessions) as folder:
        yield folder
        with _in_words(sessions):
            _sync(folder)
            try:
                folder.rename(sessions / sid)
            except OSError as error:
                if (sessions / sid).exists():
                    raise FileExistsError(sid) from error
                raise
            _sync(sessions)


@contextmanager
def unseen_folder(sessions: Path) -> Generator[Path]:
    """An empty folder under SESSIONS/.building that is gone, if it still is there, when the block ends."""
    place = sessions / BUILDING
    with _in_words(sessions):
        place.mkdir(parents=True, exist_ok=True)
        lock = os.open(place / LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    try:
        # Shared among builders of all processes; the kernel lets go of it when one is killed.
        fcntl.flock(lock, fcntl.LOCK_SH)
        folder = place / secrets.token_hex(8)
        with _in_words(sessions):
            folder.mkdir()
        try:
            yield folder
        finally:
            shutil.rmtree(folder, ignore_errors=True)
    finally:
        os.close(lock)


@contextmanager
def _in_words(sessions: Path) -> Generator[None]:
    try:
        yield
    except FileExistsError:
        raise
    except OSError as error:
        raise StoreError(f"{sessions}: the sessions folder cannot be written: {error.strerror}") from error


def leftovers(sessions: Path) -> list[Path]:
    """What killed imports left behind, or running ones are making."""
    try:
        return sorted(entry for entry in (sessions / BUILDING).iterdir() if entry.name != LOCK)
    except OSError:
        return []


def clean_up(sessions: Path) -> None:
    """Take away what killed imports left behind, unless one is at work just now.

    Where the folder cannot be written the remains stay: they cost space and harm nothing, and `ars-web check`
    names them.
    """
    remains = leftovers(sessions)
    if not remains:
        return
    with contextlib.suppress(OSError):
        lock = os.open(sessions / BUILDING / LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            for folder in leftovers(sessions):
                shutil.rmtree(folder, ignore_errors=True)
        finally:
            os.close(lock)


def put_away(sessions: Path, sid: str) -> None:
    """Move a session's folder to the trash."""
    with _in_words(sessions):
        (sessions / TRASH).mkdir(exist_ok=True)
        (sessions / sid).rename(sessions / TRASH / sid)
        _sync(sessions)


def bring_back(sessions: Path, sid: str) -> None:
    """Move a deleted session's folder back.

    Raises:
        NotFound: it is not in the trash.
        BadInput: there is a session of that id.
    """
    if not is_id(sid) or not (sessions / TRASH / sid / DATABASE).is_file():
        raise NotFound(f"there is no session {sid!r} in the trash")
    if (sessions / sid).exists():
        raise BadInput(f"there is a session {sid!r} already; delete it first")
    with _in_words(sessions):
        (sessions / TRASH / sid).rename(sessions / sid)
        _sync(sessions)


def is_put_away(sessions: Path, sid: str) -> bool:
    """Whether the session lies in the trash."""
    return (sessions / TRASH / sid).exists()


def _sync(folder: Path) -> None:
    """Have the folder's entries on the disk, not only in the cache."""
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
