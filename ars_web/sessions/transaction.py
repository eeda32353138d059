"""One change of one session, between `BEGIN IMMEDIATE` and `COMMIT`: what `editing.py` sees of the database."""

from collections.abc import Iterator

from sqlalchemy import Connection

from ars_web.sessions import rows
from ars_web.sessions.edits import Edit, apply
from ars_web.sessions.history import LogEntry
from ars_web.sessions.model import SessionState, SessionSummary


class SessionTransaction:
    """A session that nobody else can change while this is open.

    Attributes:
        state: the session as it is, the edits appended here included.
        appended: those edits.
    """

    def __init__(self, sid: str, connection: Connection, state: SessionState) -> None:
        self.state = state
        self.appended: list[Edit] = []
        self._sid = sid
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

    def summary(self) -> SessionSummary:
        """The session as a list shows it."""
        return rows.load_summary(self._connection, self._sid)

    def edit(self, revision: int) -> Edit:
        """The log's entry that made `revision`."""
        return rows.load_edit(self._connection, revision)

    def newest_entries(self, *, author: str) -> Iterator[LogEntry]:
        """The author's log, newest first."""
        return rows.newest_entries(self._connection, author=author)
