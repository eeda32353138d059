"""The scene behind the program's one port: its page, and the websocket that is passed on to the session's viser.

The guard has looked at Host, Origin and cookie before anything here runs, for websockets as well.
"""

import asyncio
import gzip
import logging
import re
from contextlib import suppress
from typing import Annotated

from fastapi import APIRouter, Header, Response, WebSocket
from starlette.concurrency import run_in_threadpool
from starlette.websockets import WebSocketDisconnect, WebSocketState
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, WebSocketException
from websockets.typing import Subprotocol

from ars_web.api.dependencies import AuthorDep, ServicesDep
from ars_web.api.problems import of_error
from ars_web.errors import ArsError, NotFound, StoreError

logger = logging.getLogger(__name__)

router = APIRouter(tags=["scene"], include_in_schema=False)

VIEW = re.compile(r"[0-9a-f]{32}")
"""A page's name for its view."""

SUBPROTOCOL = re.compile(r"viser-v[0-9.]{1,20}")

OPEN_SECONDS = 10.0
"""How long the scene's server may take to answer; it is on this machine."""

CLOSE_SECONDS = 2.0
"""How long it may take to say goodbye, where a browser went while much was on its way to it."""

QUEUE = 4
"""Messages that wait for a slow browser before the scene's server is made to wait."""


@router.get("/scene/{sid}/")
@router.get("/scene/{sid}/{view}/")
def page(
    sid: str,
    services: ServicesDep,
    view: str = "",
    if_none_match: Annotated[str, Header()] = "",
    accept_encoding: Annotated[str, Header()] = "",
) -> Response:
    """The page of an iframe that shows the session's scene; it finds its websocket by its own address."""
    _check_view(view)
    services.store.revision(sid)
    served = services.scene_pages.page()
    headers = {
        "Content-Security-Policy": served.content_security_policy,
        "ETag": served.etag,
        "Cache-Control": "private, no-cache",
        "Vary": "Accept-Encoding",
    }
    if served.etag in [tag.strip().removeprefix("W/") for tag in if_none_match.split(",")]:
        return Response(status_code=304, headers=headers)
    if "gzip" not in accept_encoding.lower():
        return Response(gzip.decompress(served.body), media_type="text/html", headers=headers)
    return Response(served.body, media_type="text/html", headers={**headers, "Content-Encoding": "gzip"})


@router.websocket("/scene/{sid}")
@router.websocket("/scene/{sid}/")
@router.websocket("/scene/{sid}/{view}")
@router.websocket("/scene/{sid}/{view}/")
async def proxy(browser: WebSocket, sid: str, services: ServicesDep, author: AuthorDep, view: str = "") -> None:
    """Pass a browser's messages on to the session's scene and back, until either side ends it."""
    try:
        _check_view(view)
        address = await run_in_threadpool(services.scene_pages.address, sid, view=view, author=author)
        offered = [Subprotocol(name) for name in browser.scope["subprotocols"] if SUBPROTOCOL.fullmatch(name)]
        # No compression: on loopback it would only cost time. No pings: the browser is asked by the server in front.
        scene = await connect(
            address.url,
            additional_headers=address.headers,
            subprotocols=offered or None,
            compression=None,
            max_size=None,
            max_queue=QUEUE,
            open_timeout=OPEN_SECONDS,
            close_timeout=CLOSE_SECONDS,
            ping_interval=None,
            proxy=None,
        )
    except ArsError as error:
        await browser.send_denial_response(of_error(error))
        return
    except (OSError, TimeoutError, WebSocketException) as error:
        logger.error("the scene of session %s does not answer: %s", sid, error)
        await browser.send_denial_response(of_error(StoreError("the scene does not answer; try again")))
        return
    async with scene:
        await browser.accept(subprotocol=scene.subprotocol)
        code, reason = await _until_either_ends(browser, scene)
        await scene.close(code, reason)
        if browser.application_state is WebSocketState.CONNECTED:
            with suppress(WebSocketDisconnect):
                await browser.close(code, reason)


async def _until_either_ends(browser: WebSocket, scene: ClientConnection) -> tuple[int, str]:
    """Pass messages on, both ways at once; how the side that ended it did so: a close code and its reason."""
    both = [asyncio.create_task(_from_browser(browser, scene)), asyncio.create_task(_from_scene(scene, browser))]
    try:
        done, _ = await asyncio.wait(both, return_when=asyncio.FIRST_COMPLETED)
        return done.pop().result()
    finally:
        for task in both:
            task.cancel()
        await asyncio.gather(*both, return_exceptions=True)


async def _from_browser(browser: WebSocket, scene: ClientConnection) -> tuple[int, str]:
    try:
        while True:
            message = await browser.receive()
            if message["type"] == "websocket.disconnect":
                return _sendable(message.get("code")), message.get("reason") or ""
            data: bytes | None = message.get("bytes")
            if data is None:
                return 1003, "this websocket takes binary messages only"
            await scene.send(data)
    except ConnectionClosed:
        return _sendable(scene.close_code), scene.close_reason or ""


async def _from_scene(scene: ClientConnection, browser: WebSocket) -> tuple[int, str]:
    with suppress(WebSocketDisconnect, ConnectionClosed):
        async for message in scene:
            assert isinstance(message, bytes), "viser speaks binary"
            await browser.send_bytes(message)
    return _sendable(scene.close_code), scene.close_reason or ""


def _sendable(code: int | None) -> int:
    """A close code that may be sent; those that only tell how a connection ended may not."""
    return code if code is not None and (1000 <= code < 5000) and code not in (1004, 1005, 1006, 1015) else 1001


def _check_view(view: str) -> None:
    if view and not VIEW.fullmatch(view):
        raise NotFound(f"{view[:64]!r} cannot name a view: a page names its own by 32 hexadecimal digits")
