"""Server-Sent Events: a session's edits as they happen, and again from any revision.

The log in the store is the only queue. A stream holds no edits, only the revision that it has sent; when it is woken
it reads on from there. So a slow client costs nothing, and one that comes back misses nothing.
"""

import asyncio
import logging
from collections.abc import AsyncGenerator, Generator
from contextlib import asynccontextmanager, contextmanager, suppress
from dataclasses import dataclass, field

import orjson
from starlette.concurrency import run_in_threadpool

from ars_web.api.models import EditJson
from ars_web.errors import ArsError, NotFound
from ars_web.sessions.edits import Edit
from ars_web.sessions.store import SessionStore

logger = logging.getLogger(__name__)

EDITS_AT_ONCE = 200
"""How many edits a stream reads from the log in one go."""


@dataclass(eq=False)
class _Topic:
    """One session that someone listens to; `changed` is set, and replaced, whenever its log may have grown."""

    listeners: int = 0
    revision: int = -2
    changed: asyncio.Event = field(default_factory=asyncio.Event)


class EventHub:
    """Wakes the streams of a session when it changes, whichever process changed it.

    Edits made through this process wake them at once (`wake`); those of another process within `poll_seconds`, by
    one cheap look at each session's revision, however many listen. No stream holds a thread.

    Attributes:
        keep_alive_seconds: how long a stream may be silent before a comment is sent.
    """

    def __init__(self, store: SessionStore, *, poll_seconds: float = 0.5, keep_alive_seconds: float = 15.0) -> None:
        self._store = store
        self._poll_seconds = poll_seconds
        self.keep_alive_seconds = keep_alive_seconds
        self._topics: dict[str, _Topic] = {}
        self._closing = False
        self._loop: asyncio.AbstractEventLoop | None = None

    @asynccontextmanager
    async def running(self) -> AsyncGenerator["EventHub"]:
        """Watch until left; all streams end then."""
        self._loop = asyncio.get_running_loop()
        poll = asyncio.create_task(self._poll())
        try:
            yield self
        finally:
            self.close()
            poll.cancel()
            with suppress(asyncio.CancelledError):
                await poll
            self._loop = None

    @property
    def watched(self) -> frozenset[str]:
        """The sessions that someone listens to."""
        return frozenset(self._topics)

    def close(self) -> None:
        """End all streams; on the event loop's thread. The server calls it before it waits for connections."""
        self._closing = True
        for topic in self._topics.values():
            topic.changed.set()

    def wake(self, sid: str, edit: Edit) -> None:
        """Tell the session's streams of an edit; from any thread. Made to be given to `SessionEditor.listen`."""
        if self._loop is not None:
            self._loop.call_soon_threadsafe(self._changed, sid, edit.revision)

    async def stream(self, sid: str, *, after: int | None) -> AsyncGenerator[bytes]:
        """The session's edits after revision `after` (None: from now on) in the event-stream format.

        First comes `ready`, or `reset` where the client has seen revisions that the session does not have; then an
        `edit` for each, its id the revision; `gone` when the session is deleted. Comments keep the connection up.
        """
        revision = await run_in_threadpool(self._store.revision, sid)
        behind = after is None or after <= revision
        sent = after if after is not None and behind else revision
        yield _event("ready" if behind else "reset", sent, {"revision": revision})
        with self._listening(sid) as topic:
            while not self._closing:
                changed = topic.changed
                try:
                    edits = await run_in_threadpool(self._store.edits, sid, after=sent, limit=EDITS_AT_ONCE)
                except NotFound:
                    yield _event("gone", sent, {"revision": sent})
                    return
                for edit in edits:
                    yield _event("edit", edit.revision, EditJson.of(edit).model_dump(mode="json"))
                    sent = edit.revision
                if edits or self._closing:
                    continue
                try:
                    async with asyncio.timeout(self.keep_alive_seconds):
                        await changed.wait()
                except TimeoutError:
                    yield b": still here\n\n"

    @contextmanager
    def _listening(self, sid: str) -> Generator[_Topic]:
        topic = self._topics.setdefault(sid, _Topic())
        topic.listeners += 1
        try:
            yield topic
        finally:
            topic.listeners -= 1
            if topic.listeners == 0:
                del self._topics[sid]

    def _changed(self, sid: str, revision: int) -> None:
        topic = self._topics.get(sid)
        if topic is not None:
            topic.revision = revision
            topic.changed.set()
            topic.changed = asyncio.Event()

    async def _poll(self) -> None:
        while True:
            await asyncio.sleep(self._poll_seconds)
            for sid, topic in list(self._topics.items()):
                try:
                    revision = await run_in_threadpool(self._store.revision, sid)
                except ArsError as error:  # the streams meet it themselves, and end
                    logger.info("session %s: %s", sid, error)
                    revision = -1
                if revision != topic.revision:
                    self._changed(sid, revision)


def _event(name: str, revision: int, data: object) -> bytes:
    return b"id: %d\nevent: %s\ndata: %s\n\n" % (revision, name.encode(), orjson.dumps(data))
