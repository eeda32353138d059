"""All of viser's private parts that this program uses, in one place; each has a test that fails when it changes.

viser has no login, answers any Origin and Host, prints to the terminal, and lets any client open a public tunnel. So
its server listens on loopback only, asks every connection for a secret that only the proxy in front of it knows, and
hears nothing from clients but what the scene needs.
"""

import http
import secrets
import threading
from collections.abc import Awaitable, Callable
from contextvars import ContextVar
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import rich
import viser
import viser.infra._infra
from viser import _messages as viser_messages
from websockets.asyncio.server import ServerConnection, serve
from websockets.http11 import Request, Response

from ars_web.errors import StoreError

SECRET = secrets.token_urlsafe(32)
"""What the proxy says to viser's servers, new in each process. Other users of the machine cannot know it."""

SECRET_HEADER = "X-Ars-Scene-Secret"
VIEW_HEADER = "X-Ars-Scene-View"
AUTHOR_HEADER = "X-Ars-Scene-Author"

HEARD = (
    viser_messages.ViewerCameraMessage,
    viser_messages.ScenePointerMessage,
    viser_messages.SceneNodeClickMessage,
    viser_messages.SceneNodeDragMessage,
    viser_messages.TransformControlsUpdateMessage,
    viser_messages.TransformControlsDragStartMessage,
    viser_messages.TransformControlsDragEndMessage,
)
"""What a client may say. Not: share a public URL, upload files, or change a panel that others see."""


@dataclass(frozen=True)
class Visitor:
    """Who is behind a connection, as the proxy says.

    Attributes:
        view: the page's name for its view; empty: a browser that has the scene open by itself.
        author: of the edits made by dragging.
    """

    view: str
    author: str


_visitor: ContextVar[Visitor] = ContextVar("visitor")

_starting = threading.Lock()

_infra: Any = viser.infra._infra


def visitor() -> Visitor:
    """Who is behind the connection whose `async` callback is running; viser runs those in the connection's context."""
    return _visitor.get()


def guarded_server() -> viser.ViserServer:
    """A viser server on a free loopback port that only who knows the SECRET can reach.

    Raises:
        StoreError: viser did not start as expected, so that the server would be open; none is running then.
    """
    guarded: list[int] = []

    def serve_guarded(handler: Callable[[ServerConnection], Awaitable[None]], *args: Any, **options: Any) -> serve:
        answer = options.pop("process_request")

        def check(connection: ServerConnection, request: Request) -> Response | None:
            given = request.headers.get_all(SECRET_HEADER)
            if len(given) != 1 or not secrets.compare_digest(given[0].encode(), SECRET.encode()):
                return connection.respond(http.HTTPStatus.FORBIDDEN, "ask the server in front of this one\n")
            return answer(connection, request)

        async def known(connection: ServerConnection) -> None:
            assert connection.request is not None, "the handshake is over"
            headers = connection.request.headers
            _visitor.set(Visitor(view=headers.get(VIEW_HEADER, ""), author=headers.get(AUTHOR_HEADER, "")))
            await handler(connection)

        guarded.append(1)
        return serve(known, *args, process_request=check, **options)

    # viser prints where it listens, and that it stopped, to rich's own console, which nothing else here uses.
    rich.get_console().quiet = True
    with _starting:
        theirs, _infra.websockets = _infra.websockets, _stand_in(_infra.websockets, serve_guarded)
        try:
            server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
        finally:
            _infra.websockets = theirs
    if not guarded or server.get_host() != "127.0.0.1":
        server.stop()
        raise StoreError(f"viser {viser.__version__} starts its server in another way than 1.1.1: install that version")
    hear_only_what_is_needed(server)
    return server


def _stand_in(websockets: Any, serve_guarded: Callable[..., serve]) -> SimpleNamespace:
    """The `websockets` that viser's server sees while it starts; no other code sees it."""
    return SimpleNamespace(
        asyncio=SimpleNamespace(server=SimpleNamespace(serve=serve_guarded)),
        exceptions=websockets.exceptions,
        datastructures=websockets.datastructures,
    )


def hear_only_what_is_needed(owner: viser.ViserServer | viser.ClientHandle) -> None:
    """Drop the handlers of all messages but HEARD; for the server, and for each client that connects."""
    interface = owner._websock_server if isinstance(owner, viser.ViserServer) else owner._websock_connection  # pyright: ignore[reportPrivateUsage]
    handlers = interface._incoming_handlers  # pyright: ignore[reportPrivateUsage]
    for message in [message for message in handlers if message not in HEARD]:
        interface.unregister_handler(message)


def is_gone(client: viser.ClientHandle) -> bool:
    """Whether the client's connection is closing, so that nothing can be sent to it any more."""
    return client._websock_connection.get_message_buffer().done  # pyright: ignore[reportPrivateUsage]


def is_stopped(server: viser.ViserServer) -> bool:
    """Whether the server's thread has ended."""
    thread = server._websock_server._server_thread  # pyright: ignore[reportPrivateUsage]
    return thread is None or not thread.is_alive()
