"""uvicorn's websockets, hung up on where a peer makes the server keep what it never takes.

What an application sends waits while the peer does not read. These three do not wait, and uvicorn bounds none of them:
answers to pings, parts of a message that never ends, and the goodbye to a peer that is no longer there.
"""

from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.frames import Frame

MOST_UNREAD = 2**20
"""Bytes that wait for a peer which goes on pinging."""

MOST_PARTS = 1024
"""Of one message."""


class WebsocketWire(WebSocketsSansIOProtocol):
    """One websocket connection."""

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
