"""Telling whoever listens which edits were made, in the order they were made, once they are on the disk."""

import logging
import threading
from collections import deque
from collections.abc import Callable, Iterable

from ars_web.sessions.edits import Edit

log = logging.getLogger(__name__)

Listener = Callable[[str, Edit], None]


class Listeners:
    """Callbacks and the edits they have not been told of; any number of threads may use it."""

    def __init__(self) -> None:
        self._registrations: tuple[tuple[Listener], ...] = ()
        self._lock = threading.Lock()
        self._untold: deque[tuple[str, Edit]] = deque()
        self._telling = False

    def add(self, callback: Listener) -> Callable[[], None]:
        """Call `callback(sid, edit)` for every edit told from now on. Returns the way to stop."""
        registration = (callback,)  # a new object each time, so that one callback may be added twice
        with self._lock:
            self._registrations = (*self._registrations, registration)

        def unsubscribe() -> None:
            with self._lock:
                self._registrations = tuple(r for r in self._registrations if r is not registration)

        return unsubscribe

    def put(self, sid: str, edits: Iterable[Edit]) -> None:
        """Line up edits of one session; whoever calls sees to their order."""
        self._untold.extend((sid, edit) for edit in edits)

    def tell(self) -> None:
        """Tell what is lined up, one thread at a time.

        Where another thread is at it, it tells these too. A callback may edit: that edit comes after this one
        for every callback. One that raises is logged and keeps nothing from the others.
        """
        while self._untold:
            with self._lock:
                if self._telling:
                    return
                self._telling = True
            try:
                self._tell_all()
            finally:
                with self._lock:
                    self._telling = False

    def _tell_all(self) -> None:
        while self._untold:
            sid, edit = self._untold.popleft()
            for (callback,) in self._registrations:
                try:
                    callback(sid, edit)
                except Exception:
                    # The edit is kept whatever a view makes of it, and the other views must hear of it.
                    log.exception("a listener failed on revision %d of session %s", edit.revision, sid)
