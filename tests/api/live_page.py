"""A page's end of the live line, and a scene that remembers what it was asked."""

import json
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from websockets.sync.client import ClientConnection, connect

from ars_web.workspace import BoxPreview, ViewAction, ViewEvent, ViewState

PATIENCE = 20.0


class Page:
    """Messages as a page sends and gets them."""

    def __init__(self, connection: ClientConnection) -> None:
        self.connection = connection

    def say(self, type_: str, **fields: Any) -> None:
        self.connection.send(json.dumps({"type": type_, **fields}))

    def next(self, *types: str) -> dict[str, Any]:
        """The next message of one of these types (none named: of any but `here`); others are passed over."""
        deadline = time.monotonic() + PATIENCE
        while True:
            message = json.loads(self.connection.recv(timeout=deadline - time.monotonic()))
            if message["type"] in types or (not types and message["type"] != "here"):
                return message

    def people(self, until: Callable[[list[dict[str, Any]]], bool]) -> list[dict[str, Any]]:
        """Who is there, once that is as it should be."""
        deadline = time.monotonic() + PATIENCE
        while not until(people := self.next("here")["people"]):
            # It is told again and again, so that waiting for the next alone would never end.
            assert time.monotonic() < deadline, people
        return people


def address(url: str, sid: str, view: str, *, after: int | None = None) -> str:
    """Where a page finds its line."""
    return f"{url.replace('http', 'ws', 1)}/api/sessions/{sid}/live?view={view}" + (
        "" if after is None else f"&after={after}"
    )


@contextmanager
def line(url: str, sid: str, view: str, *, after: int | None = None, query: str = "", **headers: str) -> Iterator[Page]:
    """A live line; headers are the test's to choose."""
    where = address(url, sid, view, after=after) + query
    with connect(where, additional_headers=headers, proxy=None, close_timeout=1) as connection:
        yield Page(connection)


VIEW: dict[str, Any] = {
    "mode": "frame",
    "frame": 3,
    "selected": None,
    "tool": "move",
    "axes": "world",
    "snap_length": 0.01,
    "snap_angle": 0.1,
    "upright": True,
    "hidden": [4, 5],
    "dark": False,
}
"""The fields of a `view` message."""


@dataclass
class RememberingScene:
    """What each view was asked, in order; `send` of a view speaks to its page as a scene would."""

    asked: list[tuple[Any, ...]] = field(default_factory=list[tuple[Any, ...]])
    send: dict[tuple[str, str], Callable[[ViewEvent], None]] = field(
        default_factory=dict[tuple[str, str], Callable[[ViewEvent], None]]
    )
    lock: threading.Lock = field(default_factory=threading.Lock)

    def attach(self, sid: str, view: str, *, author: str, send: Callable[[ViewEvent], None]) -> None:
        with self.lock:
            assert (sid, view) not in self.send, "attached twice"
            self.send[sid, view] = send
            self.asked.append(("attach", view, author))

    def detach(self, sid: str, view: str) -> None:
        with self.lock:
            del self.send[sid, view]
            self.asked.append(("detach", view))

    def show(self, sid: str, view: str, state: ViewState) -> None:
        self._asked("show", sid, view, state)

    def act(self, sid: str, view: str, action: ViewAction) -> None:
        self._asked("act", sid, view, action)

    def preview(self, sid: str, view: str, preview: BoxPreview | None) -> None:
        self._asked("preview", sid, view, preview)

    def of(self, view: str) -> list[tuple[Any, ...]]:
        """What was asked for one view, its name left out."""
        with self.lock:
            return [(one[0], *one[2:]) for one in self.asked if one[1] == view]

    def _asked(self, what: str, sid: str, view: str, value: Any) -> None:
        with self.lock:
            assert (sid, view) in self.send, f"{what} of a view that is not attached"
            self.asked.append((what, view, value))
