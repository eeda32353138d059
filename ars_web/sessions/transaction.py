"""One change of one session, between `BEGIN IMMEDIATE` and `COMMIT`: what `editing.py` sees of the database."""

from collections.abc import Iterator

from sqlalchemy import Connection

from ars_web.errors import BadInput
from ars_web.sessions import hull_rows, mesh_rows, rows
from ars_web.sessions.edits import Edit, apply
from ars_web.sessions.history import LogEntry
from ars_web.sessions.hull_mesh import HullMesh
from ars_web.sessions.model import SessionState, SessionSummary
from ars_web.sessions.object_mesh import SourcedMesh
from ars_web.sessions.rows import Request


class SessionTransaction:
    """A session that nobody else can change while this is open.

    Attributes:
        state: the session as it is, the edits appended here included.
        appended: those edits.
    """

    def __init__(self, connection: Connection, state: SessionState) -> None:
        self.state = state
        self.appended: list[Edit] = []
        self._connection = connection

    def append(self, edit: Edit) -> None:
        """Append `edit` to the log and apply it.

        Raises:
            Conflict: it does not fit the state (see `edits.apply`); nothing is written.
        """
        state = apply(self.state, edit)
        rows.append_edit(self._connection, edit, state)
        self.state = state
        self.appended.append(edit)

    def keep_hull(self, hull: HullMesh) -> str:
        """Have `hull` stored, so that boxes can name it; its digest."""
        return hull_rows.keep_hull(self._connection, hull)

    def keep_mesh(self, mesh: SourcedMesh) -> str:
        """Have `mesh` stored, so that classes and boxes can name it; its digest."""
        return mesh_rows.keep_mesh(self._connection, mesh)

    def answered(self, key: str, *, digest: str) -> Edit | None:
        """The edit that was the answer to an earlier request with this idempotency key; None for a new key.

        Raises:
            BadInput: that request was another one.
        """
        found = rows.load_request(self._connection, key)
        if found is None:
            return None
        if found.digest != digest:
            raise BadInput(f"the idempotency key {key!r} was used for another request; use a new key for this one")
        return self.edit(found.revision)

    def remember(self, key: str, *, digest: str) -> None:
        """Keep that the newest edit is the answer to the request with this idempotency key."""
        rows.insert_request(self._connection, key, Request(digest, self.state.revision))

    def summary(self, sid: str) -> SessionSummary:
        """The session, whose id is `sid`, as a list shows it."""
        return rows.load_summary(self._connection, sid)

    def edit(self, revision: int) -> Edit:
        """The log's entry that made `revision`."""
        return rows.load_edit(self._connection, revision)

    def newest_entries(self, *, author: str) -> Iterator[LogEntry]:
        """The author's log, newest first."""
        return rows.newest_entries(self._connection, author=author)
