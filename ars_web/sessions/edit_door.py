"""The one door for change: appends an edit to the log, applies it and tells listeners, in that order.

Appending and applying are one transaction, and listeners are told once it is on the disk. Nothing else writes to a
session.
"""

from collections.abc import Callable, Generator
from contextlib import contextmanager
from datetime import UTC, datetime

from ars_web.sessions.edits import Change, Edit
from ars_web.sessions.listeners import Listener, Listeners
from ars_web.sessions.names import checked_key, checked_name
from ars_web.sessions.store import SessionStore
from ars_web.sessions.transaction import SessionTransaction


class EditDoor:
    """Opens sessions for edits, for any number of threads; `SessionEditor` says which there are."""

    def __init__(self, store: SessionStore) -> None:
        self._store = store
        self._listeners = Listeners()

    def listen(self, callback: Listener) -> Callable[[], None]:
        """Call `callback(sid, edit)` after each edit made through this editor, in the order of revisions.

        It is called by a thread that edits, and should be quick. Edits of other processes are not told; the log
        has them (`SessionStore.edits`). Returns the way to stop.
        """
        return self._listeners.add(callback)

    @contextmanager
    def _editing(self, sid: str) -> Generator[SessionTransaction]:
        with self._store.writing(sid, committed=lambda edits: self._listeners.put(sid, edits)) as session:
            yield session
        self._listeners.tell()

    def _answered(self, session: SessionTransaction, key: str | None, *, digest: str) -> Edit | None:
        """The edit that was the answer to an earlier request with this idempotency key, if there is one."""
        return None if key is None else session.answered(checked_key(key), digest=digest)

    def _append(
        self,
        session: SessionTransaction,
        changes: tuple[Change, ...],
        *,
        author: str,
        summary: str,
        undoes: int | None = None,
        redoes: int | None = None,
        key: str | None = None,
        digest: str = "",
    ) -> Edit:
        """Append the edit; with an idempotency `key`, keep that it answers the request of that `digest`."""
        edit = Edit(
            revision=session.state.revision + 1,
            author=checked_name(author, what="an author"),
            summary=summary,
            changes=changes,
            undoes=undoes,
            redoes=redoes,
            at=datetime.now(UTC),
        )
        session.append(edit)
        if key is not None:
            session.remember(key, digest=digest)
        return edit
