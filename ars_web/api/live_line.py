"""One live line: what a page says goes to the scene and to the others, what happens comes to the page.

Edits are read from the log as fast as the page takes them, so none is ever lost and none waits in memory. All else
waits in an outbox, where the newest of its kind replaces what is older.
"""

import asyncio
import logging
from collections.abc import Coroutine, Sequence
from contextlib import aclosing
from enum import IntEnum
from typing import Any

from pydantic import BaseModel
from starlette.concurrency import run_in_threadpool
from starlette.websockets import WebSocket, WebSocketDisconnect

from ars_web.api.events import EventHub, SessionEvent
from ars_web.api.live_models import (
    EditMessage,
    GoneMessage,
    HelloMessage,
    HereMessage,
    LookMessage,
    NewBoxMessage,
    PageMessage,
    PersonJson,
    PreviewMessage,
    ReadyMessage,
    RefusedMessage,
    ResetMessage,
    SessionMessage,
    ViewMessage,
    page_message,
    view_event_message,
)
from ars_web.api.outbox import Outbox, Overflown
from ars_web.api.presence import Person, Presence
from ars_web.errors import ArsError, BadInput, NotFound
from ars_web.workspace import Conflicted, Dragged, Refused, SceneViews, ViewEvent

logger = logging.getLogger(__name__)

LARGEST_MESSAGE = 256 * 1024
"""Characters of a message from a page."""

GOODBYE_SECONDS = 1.0
"""How long a page that reads nothing may hold up the end of its line."""


class Close(IntEnum):
    """Why the server closes a line. After those from 4400 to 4410 a new one to the same address has no better fate."""

    STOPPING = 1001
    """The server stops; the page should come back."""
    FAILED = 1011
    """The sessions folder cannot be used; a `refused` message before said why."""
    BAD_ADDRESS = 4400
    """`view` or `after` cannot be used; a `refused` message before said why."""
    NOT_YOURS = 4403
    """`view` is the name of somebody else's page."""
    NO_SESSION = 4404
    """There is no such session."""
    REPLACED = 4409
    """A newer line has the same `view`."""
    GONE = 4410
    """The session was deleted; a `gone` message came before."""
    TOO_SLOW = 4429
    """The page did not read; it should come back."""


class Ended(Exception):
    """The line is to be closed."""

    def __init__(self, code: Close, reason: str) -> None:
        super().__init__(reason)
        self.code = code
        self.reason = reason


class LiveLine:
    """The line of one page, from its acceptance to its end."""

    def __init__(
        self,
        websocket: WebSocket,
        *,
        sid: str,
        person: Person,
        frames: int,
        events: EventHub,
        presence: Presence,
        scene: SceneViews,
        patience_seconds: float,
    ) -> None:
        self.sid = sid
        self.view = person.view
        self.author = person.author
        self._websocket = websocket
        self._person = person
        self._frames = frames
        self._events = events
        self._presence = presence
        self._scene = scene
        self._patience_seconds = patience_seconds
        self._outbox = Outbox[BaseModel](asyncio.get_running_loop())
        self._replaced = asyncio.Event()

    async def run(self, *, after: int | None) -> Ended | None:
        """Serve the page until either side ends it, and tell the scene and the others when that is over.

        Returns why the line is to be closed; None: the page has gone.
        """
        try:
            await run_in_threadpool(
                self._scene.attach, self.sid, self.view, author=self.author, send=self._happened_in_scene
            )
            try:
                self._presence.enter(self.sid, self._person, self._show_people)
                try:
                    return await _first_end(self._listen(), self._follow(after), self._deliver(), self._give_way())
                finally:
                    self._presence.leave(self.sid, self.view)
            finally:
                self._outbox.close()
                await run_in_threadpool(self._scene.detach, self.sid, self.view)
        except ArsError as error:
            return await failed(self._websocket, error)

    def give_way(self) -> None:
        """End, since the page has a newer line."""
        self._replaced.set()

    async def _give_way(self) -> None:
        await self._replaced.wait()
        raise Ended(Close.REPLACED, "the page has a newer line")

    # From the page

    async def _listen(self) -> None:
        while True:
            message = await self._websocket.receive()
            if message["type"] == "websocket.disconnect":
                raise WebSocketDisconnect(message["code"])
            try:
                await self._take(_parsed(message))
            except ArsError as error:
                # Sent, not put: who sends nonsense gets to send more as fast as it reads the answers.
                await self._send(RefusedMessage(detail=str(error)))

    async def _take(self, message: PageMessage) -> None:
        match message:
            case HelloMessage():
                self._presence.update(self.sid, self.view, name=message.name)
            case ViewMessage():
                if message.frame >= self._frames:
                    raise BadInput(f"view.frame: this session's frames are 0 to {self._frames - 1}")
                self._presence.update(self.sid, self.view, place=(message.mode, message.frame, message.selected))
                await run_in_threadpool(self._scene.show, self.sid, self.view, message.state)
            case LookMessage() | NewBoxMessage():
                await run_in_threadpool(self._scene.act, self.sid, self.view, message.action)
            case PreviewMessage():
                await run_in_threadpool(self._scene.preview, self.sid, self.view, message.preview)

    # To the page

    async def _follow(self, after: int | None) -> None:
        async with aclosing(self._events.follow(self.sid, after=after)) as events:
            async for event in events:
                if event.name == "quiet":
                    # A browser tells its page nothing of pings: this is how the page knows that the line is alive.
                    self._show_people(self._presence.people(self.sid))
                else:
                    await self._send(_session_message(event))
                if event.name == "gone":
                    raise Ended(Close.GONE, "the session was deleted")
        raise Ended(Close.STOPPING, "the server stops")

    async def _deliver(self) -> None:
        try:
            while True:
                await self._send(await self._outbox.take())
        except Overflown:
            raise Ended(Close.TOO_SLOW, "too much was left unread") from None

    def _happened_in_scene(self, event: ViewEvent) -> None:
        """Called by any thread."""
        match event:
            case Dragged():
                # Not one in the place of the other: the end of one's own is not to be lost where another begins.
                key = ("dragged", event.preview.box_id, event.own)
            case Conflicted() | Refused():
                key = None
            case _:
                key = type(event)
        self._outbox.put(view_event_message(event), key=key)

    def _show_people(self, people: Sequence[Person]) -> None:
        self._outbox.put(HereMessage(people=[person_json(one, own_view=self.view) for one in people]), key="here")

    async def _send(self, message: BaseModel) -> None:
        try:
            async with asyncio.timeout(self._patience_seconds):
                await self._websocket.send_text(message.model_dump_json())
        except TimeoutError:
            raise Ended(Close.TOO_SLOW, f"nothing was read for {self._patience_seconds:g} s") from None


class LiveLines:
    """The lines of all sessions. Used on the event loop's thread alone.

    Attributes:
        patience_seconds: how long a page may leave what was sent to it unread.
    """

    def __init__(self, *, patience_seconds: float = 20.0) -> None:
        self.patience_seconds = patience_seconds
        self._lines: dict[tuple[str, str], LiveLine] = {}
        self._open = 0
        self._changed = asyncio.Condition()

    async def run(self, line: LiveLine, websocket: WebSocket, *, after: int | None) -> None:
        """Run a line to its end and close it, in place of the older one of the same page, whose end the page may have
        seen before the server did."""
        self._open += 1
        try:
            ended = await self._run(line, after)
            if ended is not None:
                await close(websocket, ended)
        finally:
            self._open -= 1
            async with self._changed:
                self._changed.notify_all()

    async def _run(self, line: LiveLine, after: int | None) -> Ended | None:
        key = (line.sid, line.view)
        async with self._changed:
            while (older := self._lines.get(key)) is not None:
                if older.author != line.author:
                    return Ended(Close.NOT_YOURS, "this view is somebody else's page; choose another random name")
                older.give_way()
                await self._changed.wait()
            self._lines[key] = line
        try:
            return await line.run(after=after)
        finally:
            del self._lines[key]
            async with self._changed:
                self._changed.notify_all()

    async def all_closed(self, *, seconds: float) -> None:
        """Returns when no line is open, or after `seconds`. The lines end when the events do."""
        try:
            async with asyncio.timeout(seconds), self._changed:
                await self._changed.wait_for(lambda: self._open == 0)
        except TimeoutError:
            logger.warning("%d live lines do not end", self._open)


async def close(websocket: WebSocket, ended: Ended) -> None:
    """Close the line, unless the page is gone, or reads nothing."""
    try:
        async with asyncio.timeout(GOODBYE_SECONDS):
            await websocket.close(ended.code, ended.reason)
    except (TimeoutError, WebSocketDisconnect):
        logger.info("a page was not there to be told: %s", ended.reason)


async def failed(websocket: WebSocket, error: ArsError) -> Ended:
    """How a line ends after an error that is no fault of the page's; the page is told which."""
    if isinstance(error, NotFound):
        return Ended(Close.NO_SESSION, "there is no such session")
    logger.error("a live line fails: %s", error)
    await refuse(websocket, error)
    return Ended(Close.FAILED, "the session cannot be used")


async def refuse(websocket: WebSocket, error: ArsError) -> None:
    """Say what is wrong, unless the page is gone, or reads nothing."""
    try:
        async with asyncio.timeout(GOODBYE_SECONDS):
            await websocket.send_text(RefusedMessage(detail=str(error)).model_dump_json())
    except (TimeoutError, WebSocketDisconnect):
        logger.info("a page was not there to be told: %s", error)


def person_json(person: Person, *, own_view: str | None) -> PersonJson:
    """A person as told to the page `own_view`."""
    return PersonJson(
        view=person.view,
        author=person.author,
        name=person.name,
        frame=person.frame,
        selected=person.selected,
        mode=person.mode,
        own=person.view == own_view,
    )


def _parsed(message: Any) -> PageMessage:
    text: object = message.get("text")
    if not isinstance(text, str):
        raise BadInput("messages are JSON texts, not binary")
    if len(text) > LARGEST_MESSAGE:
        raise BadInput(f"a message has at most {LARGEST_MESSAGE} characters, not {len(text)}")
    return page_message(text)


def _session_message(event: SessionEvent) -> SessionMessage:
    if event.edit is not None:
        return EditMessage(edit=event.edit)
    kinds = {"ready": ReadyMessage, "reset": ResetMessage, "gone": GoneMessage}
    return kinds[event.name](revision=event.newest)


async def _first_end(*parts: Coroutine[Any, Any, None]) -> Ended | None:
    """Run the parts of a line side by side until one of them ends it; None: the page has gone."""
    ended: list[Ended] = []
    gone = False
    errors: list[ArsError] = []
    try:
        async with asyncio.TaskGroup() as tasks:
            for part in parts:
                tasks.create_task(part)
    except* Ended as found:
        ended += [one for one in found.exceptions if isinstance(one, Ended)]
    except* WebSocketDisconnect:
        gone = True
    except* ArsError as found:
        errors += [one for one in found.exceptions if isinstance(one, ArsError)]
    if gone:
        return None
    if errors:
        raise errors[0]
    return ended[0]
