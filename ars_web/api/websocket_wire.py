"""uvicorn's websockets, hung up on where a peer makes the server keep what it never takes.

What an application sends waits while the peer does not read. Three things do not wait, and uvicorn bounds none of them:
answers to pings, parts of a message that never ends, and the goodbye to a peer that is no longer there. Nor does it
answer what asks for a websocket in a way that none is asked for.
"""

from typing import TYPE_CHECKING

from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.frames import Frame

if TYPE_CHECKING:
    from uvicorn._types import ASGISendEvent

MOST_UNREAD = 2**20
"""Bytes that wait for a peer which goes on pinging."""

MOST_PARTS = 1024
"""Of one message."""


class WebsocketWire(WebSocketsSansIOProtocol):
    """One websocket connection."""

    def data_received(self, data: bytes) -> None:
        """Take it in, unless it is not even a question for a websocket."""
        super().data_received(data)
        if self.conn.handshake_exc is not None and not self.handshake_initiated:
            self.transport.abort()

    async def send(self, message: "ASGISendEvent") -> None:
        """Send; an application that has answered with a refusal has done all it could."""
        await super().send(message)
        if message["type"] == "websocket.http.response.body" and not message.get("more_body", False):
            # Otherwise uvicorn logs an error for each stranger who is refused.
            self.handshake_complete = True

    def handle_ping(self) -> None:
        """Answer, unless the answers before it were not read."""
        if self.transport.get_write_buffer_size() > MOST_UNREAD:
            self.transport.abort()
            return
        super().handle_ping()

    def handle_cont(self, event: Frame) -> None:
        """Keep a part of a message, unless there are too many: empty ones count for nothing in its size."""
        if len(self.frames) >= MOST_PARTS:
            self.transport.abort()
            return
        super().handle_cont(event)

    def keepalive_timeout(self) -> None:
        """The peer is gone; nobody waits until it has read what was sent to it, and the application hears of it now."""
        super().keepalive_timeout()
        self.transport.abort()
