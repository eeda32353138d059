"""No request makes the server hold more than it agreed to."""

import re

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from ars_web.api.problems import ProblemResponse

UPLOADS = re.compile(
    r"/api/(?:sessions/upload|imports/uploads|sessions/[^/]+/(?:labels/upload|(?:classes|boxes)/[^/]+/mesh))"
)
"""Paths that are read piece by piece by their handlers, which count for themselves."""


class BodyLimit:
    """Middleware: reads each request's body before it is handled, and refuses it beyond `largest` bytes."""

    def __init__(self, app: ASGIApp, *, largest: int) -> None:
        self.app = app
        self.largest = largest

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on with the body in hand, or answer 413."""
        if scope["type"] != "http" or UPLOADS.fullmatch(scope["path"]):
            await self.app(scope, receive, send)
            return
        declared = Headers(scope=scope).get("content-length", "0")
        held: list[Message] = []
        size = int(declared) if declared.isascii() and declared.isdigit() else 0
        received = 0
        more = size <= self.largest
        while more:
            message = await receive()
            held.append(message)
            received += len(message.get("body", b""))
            size = max(size, received)
            more = message.get("more_body", False) and size <= self.largest
        if size > self.largest:
            detail = f"the request's body is over {self.largest} bytes"
            await ProblemResponse(413, "too-large", "Too large", detail)(scope, receive, send)
            return
        held.reverse()

        async def replay() -> Message:
            return held.pop() if held else await receive()

        await self.app(scope, replay, send)
