"""The sessions on disk: made from recordings, read, put away. Changes go through `editing.py`."""

import logging
import threading
from collections import OrderedDict
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Self

from sqlalchemy import Connection

from ars_web.errors import ArsError, BadInput, Conflict, NotFound, StoreError
from ars_web.geometry.camera import Camera
from ars_web.recordings.recording import Recording, SkippedFrame
from ars_web.sessions import hull_rows, mesh_rows, rows, session_folders
from ars_web.sessions.checking import check_session
from ars_web.sessions.database import Database
from ars_web.sessions.edits import Edit, apply
from ars_web.sessions.history import History, LogEntry, taken_back, to_redo, to_undo
from ars_web.sessions.hull_mesh import HullMesh
from ars_web.sessions.importing import fill, starting_state
from ars_web.sessions.migration import back_up
from ars_web.sessions.model import FrameTable, SessionSnapshot, SessionState, SessionSummary
from ars_web.sessions.names import checked_key
from ars_web.sessions.object_mesh import SourcedMesh
from ars_web.sessions.sqlite import explained
from ars_web.sessions.transaction import SessionTransaction

log = logging.getLogger(__name__)

OPEN_AT_ONCE = 32
"""Sessions whose databases stay open; beyond that the one unused for longest is closed."""


@dataclass(eq=False)
class _Open:
    """An open session: its database and what was read from it."""

    database: Database
    # Replaced as a whole, never changed in place, so that threads need no lock to read them.
    state: SessionState | None = None
    frames: FrameTable | None = None
    # Long recordings take a while to read, and a page that opens asks for a dozen images at once.
    frames_lock: threading.Lock = field(default_factory=threading.Lock)
    cameras: dict[int, Camera] | None = field(default=None)
    # By digest, of the boxes of a recent state. What a digest names never changes.
    hulls: dict[str, HullMesh] = field(default_factory=dict[str, HullMesh])
    # The same of its classes' and boxes' meshes.
    meshes: dict[str, SourcedMesh] = field(default_factory=dict[str, SourcedMesh])


class SessionStore:
    """All sessions under one folder. Any number of threads and processes may use the same folder at once."""

    def __init__(self, folder: Path) -> None:
        self.folder = Path(folder).absolute()
        self._open: OrderedDict[str, _Open] = OrderedDict()
        self._lock = threading.Lock()
        session_folders.clean_up(self.folder)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Close every database. The store may be used again; it opens what it needs."""
        with self._lock:
            for session in self._open.values():
                session.database.close()
            self._open.clear()

    def create(
        self,
        recording: Recording,
        *,
        name: str,
        class_names: Sequence[str] = (),
        copy_images: bool = False,
        key: str | None = None,
        progress: Callable[[int, int], None] | None = None,
    ) -> SessionSummary:
        """A new session, which appears whole or not at all.

        Classes are the recording's, then `class_names`; the recording's boxes become boxes. With `copy_images`
        the images are copied into the session. A repeat with the same idempotency `key` returns the session that
        the first made. `progress` is told (frames done, frames in all); what it raises stops the work.

        Raises:
            BadInput: a name cannot be used, an image cannot be copied, or the key was used for something else.
            StoreError: the folder cannot be written.
        """
        state = starting_state(recording, name=name, class_names=class_names)
        sid = session_folders.new_id(key=None if key is None else checked_key(key))
        if key is not None and session_folders.is_put_away(self.folder, sid):
            raise BadInput(f"the idempotency key {key!r} made session {sid}, which was deleted since; use another key")
        if key is None or sid not in session_folders.session_ids(self.folder):
            try:
                with session_folders.building(self.folder, sid) as building:
                    fill(building, recording, state=state, copy_images=copy_images, progress=progress)
                return self.summary(sid)
            except FileExistsError:
                if key is None:
                    raise StoreError(f"session id {sid} was taken meanwhile; try again") from None
        return self._made_before(sid, recording, state, key)

    def _made_before(self, sid: str, recording: Recording, state: SessionState, key: str | None) -> SessionSummary:
        with self._reading(sid) as (connection, _):
            first, summary = rows.load_origin(connection), rows.load_summary(connection, sid)
        asked = (state.name, [c.name for c in state.classes.values()], recording.format, str(recording.source))
        made = (first.name, [c.name for c in first.classes.values()], summary.format, summary.source)
        if asked != made:
            raise BadInput(f"the idempotency key {key!r} was used for another import, session {sid}; use a new key")
        return summary

    def edits(self, sid: str, *, after: int = 0, limit: int | None = None) -> list[Edit]:
        """The log's entries that made the revisions above `after`, oldest first, at most `limit` of them."""
        with self._reading(sid) as (connection, _):
            return rows.load_edits(connection, after=after, limit=limit)

    def history(self, sid: str, *, author: str, before: int | None = None, limit: int = 50) -> History:
        """The `limit` newest of the log's entries below revision `before`, and what `author` could undo and redo."""
        with self._reading(sid) as (connection, _):
            edits = rows.load_newest_edits(connection, before=before, limit=limit)
            own = [LogEntry(edit.revision, edit.undoes, edit.redoes) for edit in edits]
            gone = taken_back([*rows.load_inversions(connection, edits), *own])
            undo, redo = (choose(rows.newest_entries(connection, author=author)) for choose in (to_undo, to_redo))
            return History(
                revision=rows.load_revision(connection),
                edits=tuple(edits),
                taken_back=frozenset(gone & {edit.revision for edit in edits}),
                can_undo=None if undo is None else rows.load_edit(connection, undo),
                can_redo=None if redo is None else rows.load_edit(connection, redo),
            )

    def check(self) -> list[str]:
        """What is wrong with the sessions folder and each session, in words with the remedy; empty if nothing is."""
        problems: list[str] = []
        remains = session_folders.leftovers(self.folder)
        if remains:
            problems.append(f"{len(remains)} unfinished imports lie in {remains[0].parent}: running, or to be deleted")
        for sid in session_folders.session_ids(self.folder):
            try:
                with self._reading(sid) as (connection, _):
                    problems += [f"session {sid}: {what}" for what in check_session(connection, self.folder / sid)]
            except ArsError as error:
                problems.append(f"session {sid}: {error}")
        return problems

    def list(self) -> list[SessionSummary]:
        """All sessions, oldest first. A damaged one is left out; `check` says what is wrong with it."""
        found: list[SessionSummary] = []
        for sid in session_folders.session_ids(self.folder):
            try:
                found.append(self.summary(sid))
            except NotFound:
                continue  # deleted since the folder was read
            except StoreError as error:
                log.warning("session %s is left out of the list: %s", sid, error)
        return sorted(found, key=lambda summary: (summary.created, summary.id))

    def find(self, session: str) -> str:
        """The id of the session that `session` names, by its id or its name.

        Raises:
            NotFound: there is none.
            BadInput: several have that name.
        """
        if session_folders.is_id(session) and session in session_folders.session_ids(self.folder):
            return session
        named = [summary.id for summary in self.list() if summary.name == session]
        if not named:
            raise NotFound(f"there is no session with the id or name {session!r}; `ars-web list` shows them")
        if len(named) > 1:
            raise BadInput(f"{len(named)} sessions are named {session!r}: say which by its id: {', '.join(named)}")
        return named[0]

    def summary(self, sid: str) -> SessionSummary:
        """What a list shows of one session."""
        with self._reading(sid) as (connection, _):
            return rows.load_summary(connection, sid)

    def revision(self, sid: str) -> int:
        """The session's revision; cheap enough to ask often."""
        with self._reading(sid) as (connection, _):
            return rows.load_revision(connection)

    def state(self, sid: str) -> SessionState:
        """All of the session that edits can change, at its newest revision."""
        with self._reading(sid) as (connection, session):
            return _current_state(connection, session)

    def cameras(self, sid: str) -> dict[int, Camera]:
        """The recording's cameras by id."""
        with self._reading(sid) as (connection, session):
            return dict(_cameras(connection, session))

    def frames(self, sid: str) -> FrameTable:
        """The recording's frames. They never change, so they are read once."""
        with self._reading(sid) as (connection, session):
            return self._frames(sid, connection, session)

    def skipped(self, sid: str) -> tuple[SkippedFrame, ...]:
        """What the recording listed and could not be used."""
        with self._reading(sid) as (connection, _):
            return rows.load_skipped(connection)

    def snapshot(self, sid: str) -> SessionSnapshot:
        """The whole session at one revision."""
        with self._reading(sid) as (connection, session):
            state = _current_state(connection, session)
            return SessionSnapshot(
                id=sid,
                state=state,
                cameras=dict(_cameras(connection, session)),
                frames=self._frames(sid, connection, session),
                hulls=_hulls(connection, session, state),
                meshes={digest: known.mesh for digest, known in _meshes(connection, session, state).items()},
            )

    def hull(self, sid: str, digest: str) -> HullMesh:
        """A hull that a box of the session has, or had.

        Raises:
            NotFound: the session has no such hull.
        """
        with self._reading(sid) as (connection, session):
            known = session.hulls.get(digest)
            return hull_rows.load_hull(connection, digest) if known is None else known

    def mesh(self, sid: str, digest: str) -> SourcedMesh:
        """A mesh that a class or a box of the session has, or had, and where it came from.

        Raises:
            NotFound: the session has no such mesh.
        """
        with self._reading(sid) as (connection, session):
            known = session.meshes.get(digest)
            return mesh_rows.load_mesh(connection, digest) if known is None else known

    def meshes(self, sid: str) -> dict[str, SourcedMesh]:
        """The meshes that the session's classes and boxes have, by digest, and where they came from."""
        with self._reading(sid) as (connection, session):
            return _meshes(connection, session, _current_state(connection, session))

    def delete(self, sid: str, *, expected_revision: int | None = None) -> None:
        """Move the session to the trash, once the edits that are being written are done.

        Raises:
            Conflict: it is not at `expected_revision`; `current` is its summary.
        """
        with self.writing(sid) as session:
            if expected_revision not in (None, session.state.revision):
                raise Conflict(
                    f"the session is at revision {session.state.revision}, not {expected_revision}",
                    current=session.summary(sid),
                )
            session_folders.put_away(self.folder, sid)
        self._forget(sid)

    def restore(self, sid: str) -> None:
        """Bring a deleted session back.

        Raises:
            NotFound: it is not in the trash.
        """
        session_folders.bring_back(self.folder, sid)

    def back_up(self, sid: str, target: Path) -> None:
        """Copy the session's database, as it is at one moment, to the single file `target`."""
        with self._reading(sid) as (_, session), explained(session.database.path):
            back_up(session.database.path, target)

    def take_in(self, fill: Callable[[Path], None]) -> str:
        """A new session of which `fill` writes the whole folder, and its id. For `portable.py`."""
        sid = session_folders.new_id()
        with session_folders.building(self.folder, sid) as building:
            fill(building)
        return sid

    @contextmanager
    def writing(
        self, sid: str, *, committed: Callable[[Sequence[Edit]], None] | None = None
    ) -> Generator[SessionTransaction]:
        """The session at its newest revision, which nobody else can change meanwhile. For `editing.py`.

        Leaving the block commits; an exception takes everything back. Once the edits are on the disk, and before
        another thread of this process can make the next one, `committed` is called with them.
        """
        session = self._session(sid)
        with session.database.write_lock:
            with session.database.writing() as connection:
                transaction = SessionTransaction(connection, _current_state(connection, session))
                yield transaction
            session.state = transaction.state
            if committed is not None:
                committed(transaction.appended)

    @contextmanager
    def _reading(self, sid: str) -> Generator[tuple[Connection, _Open]]:
        session = self._session(sid)
        with session.database.reading() as connection:
            yield connection, session

    def _session(self, sid: str) -> _Open:
        folder = session_folders.session_folder(self.folder, sid)
        session = self._opened(sid)
        if session is None:
            # Not under the lock: opening may migrate, or wait for another process, and the other sessions need not.
            opened = _Open(Database(folder / session_folders.DATABASE))
            session = self._opened(sid, otherwise=opened) or opened
            if session is not opened:
                opened.database.close()
        return session

    def _opened(self, sid: str, *, otherwise: _Open | None = None) -> _Open | None:
        """The open session, or `otherwise`, which then is open; those in the way are closed."""
        with self._lock:
            session = self._open.get(sid)
            if session is not None and not session.database.is_current:
                self._open.pop(sid).database.close()
                session = None
            if session is None and otherwise is not None:
                session = self._open[sid] = otherwise
            if session is not None:
                self._open.move_to_end(sid)
            while len(self._open) > OPEN_AT_ONCE:
                self._open.popitem(last=False)[1].database.close()
            return session

    def _forget(self, sid: str) -> None:
        with self._lock:
            session = self._open.pop(sid, None)
            if session is not None:
                session.database.close()

    def _frames(self, sid: str, connection: Connection, session: _Open) -> FrameTable:
        if session.frames is None:
            with session.frames_lock:
                if session.frames is None:
                    session.frames = rows.load_frames(connection, self.folder / sid)
        return session.frames


def _cameras(connection: Connection, session: _Open) -> dict[int, Camera]:
    if session.cameras is None:
        session.cameras = rows.load_cameras(connection)
    return session.cameras


def _hulls(connection: Connection, session: _Open, state: SessionState) -> dict[str, HullMesh]:
    """Those of the state's boxes: the ones at hand, and the others read."""
    known = session.hulls
    wanted = {box.hull for box in state.boxes.values() if box.hull is not None}
    if wanted != known.keys():
        kept = {digest: known[digest] for digest in wanted & known.keys()}
        known = session.hulls = {**kept, **hull_rows.load_hulls(connection, wanted - kept.keys())}
    return dict(known)


def _meshes(connection: Connection, session: _Open, state: SessionState) -> dict[str, SourcedMesh]:
    """Those of the state's classes and boxes: the ones at hand, and the others read."""
    known, wanted = session.meshes, state.meshes_named
    if wanted != known.keys():
        kept = {digest: known[digest] for digest in wanted & known.keys()}
        known = session.meshes = {**kept, **mesh_rows.load_meshes(connection, wanted - kept.keys())}
    return dict(known)


def _current_state(connection: Connection, session: _Open) -> SessionState:
    """The state the connection sees: the one at hand, brought forward by the log, or read anew."""
    revision, known = rows.load_revision(connection), session.state
    if known is None or known.revision > revision:
        known = rows.load_state(connection)
    elif known.revision < revision:
        for edit in rows.load_edits(connection, after=known.revision):
            known = apply(known, edit)
    session.state = known
    return known
