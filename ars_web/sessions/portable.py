"""One session as one folder or zip that can be carried elsewhere: its database, and its images as plain files.

TARGET/session.sqlite    classes, boxes, the whole log, frames and cameras
TARGET/images/           every frame's image under its name

A session taken in may come from a stranger. Its database is checked, value by value and by replaying its log,
before it is seen; what it says about places on this machine is refused.
"""

import os
import secrets
import shutil
import sqlite3
import tempfile
import zipfile
from collections.abc import Callable
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path

from ars_web.errors import BadFile, BadInput, RefusedPath, StoreError
from ars_web.recordings.stored_images import local
from ars_web.sessions import rows
from ars_web.sessions.archive import DEFAULT_LIMITS, ArchiveLimits, extract_zip
from ars_web.sessions.checking import check_database, check_portable, check_strange
from ars_web.sessions.database import Database
from ars_web.sessions.edits import Edit, NameChange
from ars_web.sessions.model import FrameTable, SessionSummary
from ars_web.sessions.names import checked_name
from ars_web.sessions.rows import IMAGES
from ars_web.sessions.session_folders import DATABASE
from ars_web.sessions.sqlite import explained
from ars_web.sessions.store import SessionStore
from ars_web.sessions.transaction import SessionTransaction

Progress = Callable[[int, int], None]

EPOCH = (1980, 1, 1, 0, 0, 0)
"""The earliest moment that a zip can hold: the same session gives the same archive whenever it is packed."""


def export_session(store: SessionStore, sid: str, target: Path, *, progress: Progress | None = None) -> None:
    """Write the session to `target`, a folder, or a zip (stored, not deflated) if its name ends in `.zip`.

    The session may be edited meanwhile: what is written is one revision. Nothing is left where it fails.

    Raises:
        NotFound: there is no such session.
        BadInput: there is something at `target`.
        StoreError: an image cannot be read, or `target` cannot be written.
    """
    target = Path(target)
    if target.is_symlink() or (target.exists() and not (target.is_dir() and not any(target.iterdir()))):
        raise BadInput(f"{target}: there is something here already; choose a new place")
    packed = target.suffix.lower() == ".zip"
    if packed and target.exists():
        raise BadInput(f"{target}: is a folder; a zip cannot be written there")
    frames = store.frames(sid)
    partial = target.with_name(f".{target.name}.{secrets.token_hex(4)}.partial")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        partial.mkdir()
        database = partial / DATABASE
        store.back_up(sid, database)
        _forget_places(database)
        if packed:
            whole = partial / target.name
            _pack(database, frames, whole, progress)
            whole.replace(target)
        else:
            _copy(frames, partial / IMAGES, progress)
            partial.replace(target)
    except OSError as error:
        raise StoreError(f"{error.filename or target}: the session cannot be exported: {error.strerror}") from error
    finally:
        shutil.rmtree(partial, ignore_errors=True)


def import_session(
    store: SessionStore, source: Path, *, name: str | None = None, limits: ArchiveLimits = DEFAULT_LIMITS
) -> SessionSummary:
    """A new session from what `export_session` wrote: the same state, log and frames under a new id.

    With `name`, the new session is called so, by an edit of its own.

    Raises:
        BadFile: it is no exported session, or a damaged one.
        RefusedPath, TooLarge: see `extract_zip`.
        StoreError: the sessions folder cannot be written.
    """
    source = Path(source)
    if not source.exists():
        raise BadFile(source, "there is nothing here to import")
    if name is not None:
        name = checked_name(name, what="a session")

    def fill(building: Path) -> None:
        if source.is_dir():
            _take(source, building, source=source, name=name, bring=_copy_file)
        else:
            with tempfile.TemporaryDirectory(dir=building.parent, prefix="unpacked-") as unpacked:
                folder = Path(unpacked) / "session"
                extract_zip(source, folder, limits=limits)
                _take(folder, building, source=source, name=name, bring=os.replace)
        # Once for all files: they are on the disk before the session is seen.
        os.sync()

    return store.summary(store.take_in(fill))


def _forget_places(database: Path) -> None:
    """Have every frame's image be the one beside the database, and no place of this machine left in it."""
    with explained(database), closing(sqlite3.connect(database, isolation_level=None)) as connection:
        connection.execute("UPDATE frame SET image = NULL")
        connection.execute("VACUUM")


def _copy(frames: FrameTable, images: Path, progress: Progress | None) -> None:
    for done, (name, image) in enumerate(zip(frames.names, frames.images, strict=True), start=1):
        target = images / name
        target.parent.mkdir(parents=True, exist_ok=True)
        _copy_file(local(image), target)
        if progress is not None:
            progress(done, len(frames))


def _pack(database: Path, frames: FrameTable, target: Path, progress: Progress | None) -> None:
    with zipfile.ZipFile(target, "x", compression=zipfile.ZIP_STORED) as archive:
        _add(archive, database, DATABASE)
        for done, (name, image) in enumerate(zip(frames.names, frames.images, strict=True), start=1):
            _add(archive, local(image), f"{IMAGES}/{name}")
            if progress is not None:
                progress(done, len(frames))


def _add(archive: zipfile.ZipFile, path: Path, name: str) -> None:
    member = zipfile.ZipInfo(name, EPOCH)
    member.external_attr = 0o644 << 16
    with path.open("rb") as file:
        # Known in advance, so that members beyond 4 GiB get the fields they need.
        member.file_size = os.fstat(file.fileno()).st_size
        with archive.open(member, "w") as packed:
            shutil.copyfileobj(file, packed, length=1 << 20)


def _take(folder: Path, building: Path, *, source: Path, name: str | None, bring: Callable[[Path, Path], None]) -> None:
    """Fill `building` with the session that lies in `folder`; `source` is what the user calls it."""
    if (folder / f"{DATABASE}-wal").exists():
        raise BadFile(source, "is a session in use, not an exported one: export it first")
    frames = _take_database(folder, building, source=source, name=name, bring=bring)
    for image in frames.names:
        target = building / IMAGES / image
        target.parent.mkdir(parents=True, exist_ok=True)
        bring(_plain_file(folder, Path(IMAGES) / image, source=source), target)


def _take_database(
    folder: Path, building: Path, *, source: Path, name: str | None, bring: Callable[[Path, Path], None]
) -> FrameTable:
    path = building / DATABASE
    bring(_plain_file(folder, Path(DATABASE), source=source), path)
    try:
        with explained(path):
            problems = check_strange(path)
        if not problems:
            with closing(Database(path)) as database, database.writing() as connection:
                problems = check_database(connection) or check_portable(connection)
                if not problems:
                    if name is not None:
                        _rename(SessionTransaction(connection, rows.load_state(connection)), name)
                    return rows.load_frames(connection, building)
    except StoreError as error:
        raise BadFile(source, f"its {DATABASE} cannot be used: {error}") from error
    raise BadFile(source, f"its {DATABASE} cannot be used: {problems[0]}")


def _rename(transaction: SessionTransaction, name: str) -> None:
    state = transaction.state
    if name != state.name:
        change, at = NameChange(state.name, name), datetime.now(UTC)
        transaction.append(
            Edit(state.revision + 1, "import", f"Rename the session to {name}", (change,), None, None, at)
        )


def _plain_file(folder: Path, relative: Path, *, source: Path) -> Path:
    """The file at `folder / relative`, with no link on the way to it."""
    path = folder
    for part in relative.parts:
        path = path / part
        if path.is_symlink():
            raise RefusedPath(f"{source}: {relative} is, or lies behind, a link; only plain files are taken in")
    if not path.is_file():
        raise BadFile(source, f"{relative} is missing: this is no exported session, or not all of it")
    return path


def _copy_file(source: Path, target: Path) -> None:
    with source.open("rb") as original, target.open("xb") as copy:
        shutil.copyfileobj(original, copy, length=1 << 20)
