"""Each of viser's private parts that is used is there, and does what it is used for."""

import asyncio
import threading
from collections.abc import Callable, Iterator

import httpx
import numpy as np
import pytest
import viser
from viser import _messages
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from ars_web.errors import StoreError
from ars_web.scene import hardening
from ars_web.scene.hardening import AUTHOR_HEADER, HEARD, SECRET, SECRET_HEADER, VIEW_HEADER
from ars_web.workspace import SceneAddress

SUBPROTOCOL = f"viser-v{viser.__version__}"


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    server = hardening.guarded_server()
    yield server
    server.stop()


@pytest.fixture
def open_server() -> Iterator[viser.ViserServer]:
    """viser's server as it comes."""
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield server
    server.stop()


def address(server: viser.ViserServer, **headers: str) -> SceneAddress:
    named = {f"X-Ars-Scene-{name.capitalize()}": value for name, value in headers.items()}
    return SceneAddress(f"ws://127.0.0.1:{server.get_port()}/", named)


def test_the_headers_are_those_of_the_tests() -> None:
    assert [SECRET_HEADER, VIEW_HEADER, AUTHOR_HEADER] == [f"X-Ars-Scene-{n}" for n in ("Secret", "View", "Author")]
    assert len(SECRET) >= 43


def statuses(server: viser.ViserServer) -> list[int]:
    """What strangers get: for the page, for the websocket without the secret, with a wrong one, and with two."""
    found = [httpx.get(f"http://127.0.0.1:{server.get_port()}/").status_code]
    url = f"ws://127.0.0.1:{server.get_port()}/"
    for headers in ([], [(SECRET_HEADER, "x" * 43)], [(SECRET_HEADER, SECRET), (SECRET_HEADER, SECRET)]):
        try:
            with connect(url, additional_headers=headers, subprotocols=[SUBPROTOCOL], proxy=None):
                found.append(101)
        except InvalidStatus as refusal:
            found.append(refusal.response.status_code)
    return found


def test_only_who_knows_the_secret_gets_in(server: viser.ViserServer) -> None:
    assert statuses(server) == [403, 403, 403, 403]
    url, headers = address(server, secret=SECRET).url, address(server, secret=SECRET).headers
    with connect(url, additional_headers=headers, subprotocols=[SUBPROTOCOL], proxy=None) as socket:
        assert isinstance(socket.recv(timeout=20), bytes)


def test_without_the_guard_anyone_would_get_in(open_server: viser.ViserServer) -> None:
    """The test above sees the difference."""
    assert statuses(open_server) == [200, 101, 101, 101]


def test_a_server_that_cannot_be_guarded_is_stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    before = set(threading.enumerate())
    monkeypatch.setattr(hardening, "_stand_in", lambda websockets, serve_guarded: websockets)
    with pytest.raises(StoreError, match="install that version"):
        hardening.guarded_server()
    assert set(threading.enumerate()) <= before


def test_what_viser_sees_of_websockets_is_put_back(server: viser.ViserServer) -> None:
    import viser.infra._infra as infra
    import websockets

    assert infra.websockets is websockets  # pyright: ignore


def test_it_listens_on_loopback_and_says_nothing(capfd: pytest.CaptureFixture[str]) -> None:
    server = hardening.guarded_server()
    assert server.get_host() == "127.0.0.1"
    assert not hardening.is_stopped(server)
    server.stop()
    assert hardening.is_stopped(server)
    assert capfd.readouterr() == ("", "")


def handled(server: viser.ViserServer) -> set[type]:
    return set(server._websock_server._incoming_handlers)  # pyright: ignore[reportPrivateUsage]


def test_clients_are_heard_only_where_the_scene_needs_it(
    server: viser.ViserServer, open_server: viser.ViserServer
) -> None:
    refused = {
        _messages.ShareUrlRequest,
        _messages.ShareUrlDisconnect,
        _messages.FileTransferStartUpload,
        _messages.GuiFormDirtyMessage,
    }
    assert refused <= handled(open_server)  # they are still called so
    assert set(HEARD) - {_messages.ViewerCameraMessage} <= handled(open_server)
    assert handled(server) == set(HEARD) - {_messages.ViewerCameraMessage}  # that one is heard by each client's own


def test_no_client_can_share_the_scene(server: viser.ViserServer, visit: Callable) -> None:
    shared: list[bool] = []
    server.request_share_url = lambda verbose=True: shared.append(True)  # pyright: ignore
    arrived = threading.Event()

    @server.on_client_connect
    async def _(client: viser.ClientHandle) -> None:
        hardening.hear_only_what_is_needed(client)
        arrived.set()

    clicked = threading.Event()

    async def click(event: viser.SceneClickEvent) -> None:
        clicked.set()

    server.scene.on_click()(click)  # pyright: ignore[reportArgumentType]
    with visit(address(server, secret=SECRET)) as visitor:
        assert arrived.wait(20)
        visitor.say(_messages.ShareUrlRequest())
        visitor.click(np.zeros(3), np.ones(3))  # what is said later is heard later
        assert clicked.wait(20)
    assert shared == []


def test_without_that_any_client_could(open_server: viser.ViserServer, visit: Callable, until: Callable) -> None:
    """The test above sees the difference."""
    shared: list[bool] = []
    open_server.request_share_url = lambda verbose=True: shared.append(True)  # pyright: ignore
    with visit(address(open_server)) as visitor:
        visitor.say(_messages.ShareUrlRequest())
        until(lambda: shared == [True])


def test_callbacks_know_who_is_behind_the_connection(
    server: viser.ViserServer, visit: Callable, until: Callable
) -> None:
    seen: list[tuple[str, hardening.Visitor]] = []

    @server.on_client_connect
    async def _(client: viser.ClientHandle) -> None:
        seen.append(("connected", hardening.visitor()))

    @server.on_client_disconnect
    async def _(client: viser.ClientHandle) -> None:
        assert hardening.is_gone(client)
        seen.append(("disconnected", hardening.visitor()))

    with (
        visit(address(server, secret=SECRET, view="a" * 32, author="page-1")) as _,
        visit(address(server, secret=SECRET)) as _,
    ):
        until(lambda: len(seen) == 2)
        assert not any(hardening.is_gone(client) for client in server.get_clients().values())
    until(lambda: len(seen) == 4)
    people = [hardening.Visitor("a" * 32, "page-1"), hardening.Visitor("", "")]
    for what in ("connected", "disconnected"):
        assert sorted(visitor.view for said, visitor in seen if said == what) == sorted(p.view for p in people)
    assert {visitor for _, visitor in seen} == set(people)


def test_the_loop_runs_until_the_server_is_stopped(server: viser.ViserServer) -> None:
    async def answer() -> int:
        return 42

    assert asyncio.run_coroutine_threadsafe(answer(), server.get_event_loop()).result(20) == 42
