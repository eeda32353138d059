"""The scene behind the one port: its page, who is let in, and the websocket that is passed on."""

import gzip
import socket
import threading
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, HTTPServer
from typing import Any

import httpx
import pytest
import viser
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect

from ars_web.errors import StoreError
from ars_web.workspace import SceneAddress

VIEW = "0123456789abcdef" * 2
SUBPROTOCOL = f"viser-v{viser.__version__}"


def cookie(server) -> dict[str, str]:
    door = server.services.door
    return {"Cookie": f"{door.cookie_name}={door.cookies.issue()}"}


def ws(server, path: str, *, origin: str | None = "own", **options: Any) -> ClientConnection:
    """A browser's websocket with the cookie, to `path`."""
    return connect(
        f"ws://{server.host}{path}",
        origin=server.url if origin == "own" else origin,
        additional_headers=options.pop("headers", cookie(server)),
        subprotocols=options.pop("subprotocols", [SUBPROTOCOL]),
        max_size=None,
        compression=None,
        proxy=None,
        **options,
    )


def refusal(server, path: str, **options: Any) -> int:
    with pytest.raises(InvalidStatus) as refused, ws(server, path, **options):
        pass
    return refused.value.response.status_code


def ending(line: ClientConnection) -> int | None:
    """The code with which the server ends it."""
    try:
        while True:
            line.recv(timeout=20)
    except ConnectionClosed as closed:
        return None if closed.rcvd is None else closed.rcvd.code


@pytest.mark.parametrize("path", ["/scene/{sid}/", "/scene/{sid}/" + VIEW + "/"])
def test_the_page_is_visers_under_a_policy_of_its_own(server, sid: str, path: str) -> None:
    with server.browser() as browser:
        answer = browser.get(path.format(sid=sid))
        assert answer.status_code == 200
        assert answer.headers["content-type"] == "text/html; charset=utf-8"
        assert '<div id="root"></div>' in answer.text
        assert "/static/scene/bridge.js" in answer.text
        policy = answer.headers.get_list("content-security-policy")
        assert len(policy) == 1
        assert "connect-src 'self' data: blob:" in policy[0]
        assert "frame-ancestors 'self'" in policy[0]
        assert "'unsafe-eval'" not in policy[0].replace("'wasm-unsafe-eval'", "")
        assert answer.headers["x-frame-options"] == "SAMEORIGIN"
        assert answer.headers["x-content-type-options"] == "nosniff"


def test_the_page_is_sent_once_and_compressed(server, sid: str) -> None:
    with server.browser() as browser:
        first = browser.get(f"/scene/{sid}/")
        assert first.headers["content-encoding"] == "gzip"
        tag = first.headers["etag"]
        for known in (tag, f'"other", W/{tag}'):
            again = browser.get(f"/scene/{sid}/", headers={"If-None-Match": known})
            assert again.status_code == 304
            assert again.content == b""
            assert again.headers["content-security-policy"] == first.headers["content-security-policy"]
        plain = browser.get(f"/scene/{sid}/", headers={"Accept-Encoding": "identity"})
        assert "content-encoding" not in plain.headers
        assert plain.text == first.text
        assert gzip.decompress(server.services.scene_pages.page().body).decode() == first.text


@pytest.mark.parametrize(
    "path",
    ["/scene/none/", "/scene/{sid}/short/", "/scene/{sid}/" + VIEW.upper() + "/", "/scene/{sid}/a/b/", "/scene/"],
)
def test_there_is_no_other_page(server, sid: str, path: str) -> None:
    with server.browser() as browser:
        answer = browser.get(path.format(sid=sid))
        assert answer.status_code == 404
        assert answer.headers["content-type"] == "application/problem+json"


def test_strangers_get_neither_page_nor_websocket(server, sid: str) -> None:
    with server.stranger() as stranger:
        assert stranger.get(f"/scene/{sid}/").status_code == 401
    for headers in ({}, {"Cookie": f"{server.services.door.cookie_name}=forged"}):
        assert refusal(server, f"/scene/{sid}", headers=headers) == 401
        assert refusal(server, f"/scene/{sid}/{VIEW}", headers=headers) == 401
    assert server.services.scene_pages.open_sessions == frozenset()  # nothing was started for them


@pytest.mark.parametrize("origin", ["http://elsewhere.example", "http://127.0.0.1:1", "null", None])
def test_another_origins_page_gets_no_websocket(server, sid: str, origin: str | None) -> None:
    assert refusal(server, f"/scene/{sid}", origin=origin) == 403


def test_a_rebound_name_gets_no_websocket(server, sid: str) -> None:
    name, _, port = server.host.partition(":")
    with (
        pytest.raises(InvalidStatus) as refused,
        connect(
            f"ws://evil.example:{port}/scene/{sid}",
            sock=socket.create_connection((name, int(port))),
            additional_headers=cookie(server),
            origin=f"http://evil.example:{port}",
            subprotocols=[SUBPROTOCOL],
            proxy=None,
        ),
    ):
        pass
    assert refused.value.response.status_code == 421


@pytest.mark.parametrize("path", ["/scene/none", "/scene/{sid}/short", "/scene/{sid}/" + VIEW + "0"])
def test_there_is_no_other_websocket(server, sid: str, path: str) -> None:
    assert refusal(server, path.format(sid=sid)) == 404


def test_a_client_of_another_version_is_sent_away(server, sid: str) -> None:
    for subprotocols in (["viser-v0.0.1"], ["other"], None):
        with ws(server, f"/scene/{sid}", subprotocols=subprotocols) as line:
            assert ending(line) == 1002


@pytest.mark.parametrize(
    "path", ["/scene/{sid}", "/scene/{sid}/", "/scene/{sid}/" + VIEW, "/scene/{sid}/" + VIEW + "/"]
)
def test_the_scene_comes_through(server, sid: str, path: str) -> None:
    with ws(server, path.format(sid=sid)) as line:
        assert line.subprotocol == SUBPROTOCOL
        assert isinstance(line.recv(timeout=20), bytes)
        assert "Sec-WebSocket-Extensions" not in line.response.headers  # pyright: ignore


def test_visers_own_port_is_closed_to_others(server, sid: str) -> None:
    address: SceneAddress = server.services.scene_pages.address(sid, view="", author="api")
    assert httpx.get(address.url.replace("ws:", "http:")).status_code == 403
    with (
        pytest.raises(InvalidStatus) as refused,
        connect(address.url, additional_headers=cookie(server), subprotocols=[SUBPROTOCOL], proxy=None),
    ):
        pass
    assert refused.value.response.status_code == 403


def test_who_asks_is_told_to_the_scene_and_cannot_be_made_up(server, sid: str, monkeypatch, until: Callable) -> None:
    asked: list[tuple[str, str, str]] = []
    address = server.services.scene_pages.address

    def noted(sid: str, *, view: str, author: str) -> SceneAddress:
        asked.append((sid, view, author))
        return address(sid, view=view, author=author)

    monkeypatch.setattr(server.services.scene_pages, "address", noted)
    door = server.services.door
    issued = door.cookies.issue()
    headers = {
        "Cookie": f"{door.cookie_name}={issued}",
        "X-Ars-Scene-Author": "page-other",
        "X-Ars-Scene-View": "f" * 32,
    }
    with ws(server, f"/scene/{sid}/{VIEW}", headers=headers) as line:
        line.recv(timeout=20)
    assert asked == [(sid, VIEW, f"page-{door.cookies.browser(issued)}")]
    with connect(
        f"ws://{server.host}/scene/{sid}",
        additional_headers={"Authorization": f"Bearer {door.token}"},
        subprotocols=[SUBPROTOCOL],
        proxy=None,
    ) as line:
        line.recv(timeout=20)
    assert asked[1:] == [(sid, "", "api")]


def test_a_text_message_ends_the_connection(server, sid: str) -> None:
    with ws(server, f"/scene/{sid}") as line:
        line.send("text")
        assert ending(line) == 1003


def test_where_the_browser_goes_the_scene_lets_go(server, sid: str, until: Callable) -> None:
    pages = server.services.scene_pages
    with ws(server, f"/scene/{sid}") as line:
        line.recv(timeout=20)
        scene = pages._open[sid].scene.server  # pyright: ignore
        until(lambda: len(scene._websock_server._live_connections) == 1)  # pyright: ignore
        line.close(4000, "gone")
    until(lambda: len(scene._websock_server._live_connections) == 0)  # pyright: ignore


def test_where_the_scene_goes_the_browser_is_told(server, sid: str) -> None:
    with ws(server, f"/scene/{sid}") as line:
        line.recv(timeout=20)
        server.services.scene_pages._open[sid].scene.server._websock_server.disconnect_all_clients()  # pyright: ignore
        assert ending(line) == 1000


def test_a_slow_browser_holds_up_the_scene_and_not_the_memory(server, sid: str, monkeypatch, until: Callable) -> None:
    """What it does not read waits at its source."""
    from websockets.sync.server import serve

    sent: list[int] = []

    def pour(line: Any) -> None:
        try:
            for _ in range(400):
                line.send(b"x" * 2**20)
                sent.append(1)
        except ConnectionClosed:
            pass

    with serve(pour, "127.0.0.1", 0, select_subprotocol=lambda _, offered: offered[0], compression=None) as source:
        thread = threading.Thread(target=source.serve_forever)
        thread.start()
        port = source.socket.getsockname()[1]
        monkeypatch.setattr(
            server.services.scene_pages, "address", lambda sid, **_: SceneAddress(f"ws://127.0.0.1:{port}/", {})
        )
        with ws(server, f"/scene/{sid}", max_queue=1, close_timeout=0.1) as line:
            line.recv(timeout=20)
            settled = [-1, -2]

            def stands_still() -> bool:
                settled.append(len(sent))
                threading.Event().wait(0.2)
                return settled[-1] == settled[-2] == len(sent)

            until(stands_still)
            assert len(sent) < 100
        source.shutdown()
        thread.join()


class _NoScene(BaseHTTPRequestHandler):
    def do_GET(self) -> None:
        self.send_error(500)

    def log_message(self, format: str, *args: object) -> None: ...  # noqa: A002


def test_a_scene_that_does_not_answer_is_a_problem_and_no_hang(server, sid: str, monkeypatch) -> None:
    with HTTPServer(("127.0.0.1", 0), _NoScene) as broken:
        thread = threading.Thread(target=broken.serve_forever)
        thread.start()
        for port in (broken.server_port, 1):
            monkeypatch.setattr(
                server.services.scene_pages,
                "address",
                lambda sid, port=port, **_: SceneAddress(f"ws://127.0.0.1:{port}/", {}),
            )
            assert refusal(server, f"/scene/{sid}") == 503
        broken.shutdown()
        thread.join()


def test_a_scene_that_cannot_be_opened_is_a_problem(server, sid: str, monkeypatch) -> None:
    def fail(sid: str, **_: str) -> SceneAddress:
        raise StoreError("the disk is full")

    monkeypatch.setattr(server.services.scene_pages, "address", fail)
    assert refusal(server, f"/scene/{sid}") == 503


def test_a_server_that_stops_lets_go_of_its_scenes(tmp_path, run_server: Callable) -> None:
    before = set(threading.enumerate())
    with run_server(tmp_path) as server:
        made = server.client.post(
            "/api/sessions", json={"name": "scene", "root": "data", "path": "scene", "classes": ["cube"]}
        )
        with ws(server, f"/scene/{made.json()['id']}") as line:
            line.recv(timeout=20)
            assert len(server.services.scene_pages.open_sessions) == 1
    left = {thread for thread in set(threading.enumerate()) - before if thread.is_alive()}
    assert not [thread for thread in left if "scene" in thread.name or "_background_worker" in thread.name]
