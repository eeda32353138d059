"""A session's edits as they happen, and again from any revision: for Server-Sent Events and for the live line.

The log in the store is the only queue. Who follows holds no edits, only the revision reached; when woken, it reads on
from there. So a slow client costs nothing, and one that comes back misses nothing.
"""

import asyncio
import logging
from collections.abc import AsyncGenerator, Generator
from contextlib import aclosing, asynccontextmanager, contextmanager, suppress
from dataclasses import dataclass, field
from typing import Literal

import orjson
from starlette.concurrency import run_in_threadpool

from ars_web.api.models import EditJson
from ars_web.errors import ArsError, NotFound
from ars_web.sessions.edits import Edit
from ars_web.sessions.store import SessionStore

logger = logging.getLogger(__name__)

EDITS_AT_ONCE = 200
"""How many edits are read from the log in one go."""


@dataclass(frozen=True, eq=False)
class SessionEvent:
    """What happened to a session.

    Attributes:
        name: `ready`: edits follow; `reset`: the client has seen revisions that the session does not have; `edit`;
            `gone`: the session was deleted, nothing follows; `quiet`: nothing happened for a while.
        revision: what a client has once it has taken this in.
        newest: the session's revision, where `name` is `ready` or `reset`; else as `revision`.
        edit: where `name` is `edit`.
    """

    name: Literal["ready", "reset", "edit", "gone", "quiet"]
    revision: int
    newest: int
    edit: EditJson | None = None


@dataclass(eq=False)
class _Topic:
    """One session that someone listens to.

    Attributes:
        changed: set, and replaced, whenever its log may have grown.
        newest: what was read last: (after which revision, the `changed` of then, the events). All who are up to
            date want the same; one of them reads it.
        reading: held by who reads.
    """

    listeners: int = 0
    revision: int = -2
    changed: asyncio.Event = field(default_factory=asyncio.Event)
    newest: tuple[int, asyncio.Event | None, list[SessionEvent]] = (-1, None, [])
    reading: asyncio.Lock = field(default_factory=asyncio.Lock)


class EventHub:
    """Wakes those who follow a session when it changes, whichever process changed it.

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

    async def follow(self, sid: str, *, after: int | None) -> AsyncGenerator[SessionEvent]:
        """What happens to the session after revision `after` (None: from now on); ends with `gone`, or `close`.

        First comes `ready` or `reset`, then every edit once and in order, and `quiet` each `keep_alive_seconds` in
        which there was none.

        Raises:
            NotFound: there is no such session at the beginning.
            StoreError: its log cannot be read.
        """
        revision = await run_in_threadpool(self._store.revision, sid)
        behind = after is None or after <= revision
        sent = after if after is not None and behind else revision
        yield SessionEvent("ready" if behind else "reset", sent, revision)
        with self._listening(sid) as topic:
            while not self._closing:
                changed = topic.changed
                try:
                    edits = await self._edits(topic, sid, after=sent)
                except NotFound:
                    yield SessionEvent("gone", sent, sent)
                    return
                for edit in edits:
                    sent = edit.revision
                    yield edit
                if edits or self._closing:
                    continue
                try:
                    async with asyncio.timeout(self.keep_alive_seconds):
                        await changed.wait()
                except TimeoutError:
                    yield SessionEvent("quiet", sent, sent)

    async def stream(self, sid: str, *, after: int | None) -> AsyncGenerator[bytes]:
        """What `follow` yields in the event-stream format; comments, where it is quiet, keep the connection up."""
        async with aclosing(self.follow(sid, after=after)) as events:
            async for event in events:
                yield _in_stream(event)

    async def _edits(self, topic: _Topic, sid: str, *, after: int) -> list[SessionEvent]:
        async with topic.reading:
            changed = topic.changed
            if topic.newest[:2] != (after, changed):
                topic.newest = (after, changed, await run_in_threadpool(self._read, sid, after))
            return topic.newest[2]

    def _read(self, sid: str, after: int) -> list[SessionEvent]:
        edits = self._store.edits(sid, after=after, limit=EDITS_AT_ONCE)
        return [SessionEvent("edit", edit.revision, edit.revision, EditJson.of(edit)) for edit in edits]

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


def _in_stream(event: SessionEvent) -> bytes:
    if event.name == "quiet":
        return b": still here\n\n"
    data = {"revision": event.newest} if event.edit is None else event.edit.model_dump(mode="json")
    return b"id: %d\nevent: %s\ndata: %s\n\n" % (event.revision, event.name.encode(), orjson.dumps(data))
