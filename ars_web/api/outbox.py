"""What waits to be sent to one page: bounded, filled by any thread, emptied by the event loop."""

import asyncio
import threading
from collections.abc import Hashable
from typing import Generic, TypeVar

T = TypeVar("T")

LARGEST = 256
"""Messages that may wait. A page that is that far behind is better off with a new line."""


class Overflown(Exception):
    """More waited than there is place for, and something was dropped."""


class Outbox(Generic[T]):
    """Messages in the order they were last put; of those put under the same key only the newest waits."""

    def __init__(self, loop: asyncio.AbstractEventLoop, *, largest: int = LARGEST) -> None:
        self._loop = loop
        self._largest = largest
        self._lock = threading.Lock()
        self._waiting: dict[Hashable, T] = {}
        self._filled = asyncio.Event()
        self._overflown = False
        self._closed = False

    def put(self, message: T, *, key: Hashable = None) -> None:
        """Line a message up; from any thread, without waiting. Without a key nothing replaces it.

        After `close` nothing happens.
        """
        key = object() if key is None else key
        with self._lock:
            if self._closed or self._overflown:
                return
            # Put at the end again: what it says happened after all that waits.
            self._waiting.pop(key, None)
            if len(self._waiting) < self._largest:
                self._waiting[key] = message
            else:
                self._overflown = True
            # Once is enough, however much comes before the loop gets to it. Under the lock: when `close` has
            # returned nobody calls a loop that may be closed.
            if len(self._waiting) == 1 or self._overflown:
                self._loop.call_soon_threadsafe(self._filled.set)

    async def take(self) -> T:
        """The message that waits for longest, as soon as there is one.

        Raises:
            Overflown: a message was dropped.
        """
        while True:
            with self._lock:
                if self._overflown:
                    raise Overflown
                if self._waiting:
                    return self._waiting.pop(next(iter(self._waiting)))
                self._filled.clear()
            await self._filled.wait()

    def close(self) -> None:
        """Take nothing more in."""
        with self._lock:
            self._closed = True
            self._waiting.clear()
