"""The guard: each attack is refused, and gets through once the check that stops it is taken away."""

import asyncio
from typing import Any

import httpx
import pytest

from ars_web.api import security
from ars_web.api.credentials import Cookies
from ars_web.api.security import HEADERS, Door, Guard

EVIL = "http://evil.example"


def rebound_name(server) -> httpx.Response:
    """A page that made its own name mean 127.0.0.1, and knows nothing else: health is all it could read."""
    with server.stranger(Host="evil.example") as client:
        return client.get("/api/health")


def foreign_page_by_bearer(server) -> httpx.Response:
    with server.stranger(Origin=EVIL, Authorization=f"Bearer {server.services.door.token}") as client:
        return client.post("/api/sessions/nope/undo")


def foreign_page_by_cookie(server) -> httpx.Response:
    with server.browser(Origin=EVIL) as client:
        return client.post("/api/sessions/nope/undo")


def page_on_another_port(server) -> httpx.Response:
    """Same site for cookies, another origin."""
    with server.browser(Origin="http://127.0.0.1:1") as client:
        return client.post("/api/sessions/nope/undo")


def page_without_origin(server) -> httpx.Response:
    """What a sandboxed frame, a file or a plain form sends."""
    with server.browser(Origin="null") as client:
        return client.post("/api/sessions/nope/undo")


def embedding_page(server) -> httpx.Response:
    """An <img> or a <script> on a page of another port of this machine."""
    with server.browser(**{"Sec-Fetch-Site": "same-site"}) as client:
        return client.get("/api/sessions/nope")


def nobody(server) -> httpx.Response:
    with server.stranger() as client:
        return client.get("/api/sessions/nope")


ATTACKS: dict[str, tuple[Any, int, str, Any]] = {
    "rebound name": (rebound_name, 421, "check_host", lambda door, values: values[0]),
    "foreign page by bearer": (foreign_page_by_bearer, 403, "check_origin", lambda values, host: None),
    "foreign page by cookie": (foreign_page_by_cookie, 403, "check_origin", lambda values, host: None),
    "page on another port": (page_on_another_port, 403, "check_origin", lambda values, host: None),
    "page without origin": (page_without_origin, 403, "check_origin", lambda values, host: None),
    "embedding page": (embedding_page, 403, "check_browser", lambda headers, unsafe: None),
    "nobody": (nobody, 401, "who", lambda door, headers: "api"),
}


@pytest.mark.parametrize("name", ATTACKS)
def test_an_attack_is_refused(server, name: str) -> None:
    attack, status, _, _ = ATTACKS[name]
    answer = attack(server)
    assert answer.status_code == status
    assert answer.headers["content-type"] == "application/problem+json"


@pytest.mark.parametrize("name", ATTACKS)
def test_the_attack_is_real_without_its_check(server, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    attack, status, check, disarmed = ATTACKS[name]
    monkeypatch.setattr(security, check, disarmed)
    assert attack(server).status_code in (200, 404) != status


def test_a_change_by_cookie_needs_an_origin(server) -> None:
    with server.browser() as client:
        del client.headers["Origin"]
        assert client.get("/api/sessions").status_code == 200
        assert client.post("/api/sessions/nope/undo").status_code == 403


def test_a_page_of_this_server_gets_through(server) -> None:
    with server.browser() as client:
        assert client.get("/api/sessions").status_code == 200
        assert client.post("/api/sessions/nope/undo").status_code == 404
        # Typed into the address bar.
        assert client.get("/api/sessions", headers={"Sec-Fetch-Site": "none"}).status_code == 200


@pytest.mark.parametrize(
    "authorization",
    ["", "Bearer", "Bearer wrong", "Basic a-token-for-tests", "Bearer a-token-for-test", "Bearer ümläut"],
)
def test_a_wrong_token_is_refused(server, authorization: str) -> None:
    with server.stranger() as client:
        answer = client.get("/api/sessions", headers={"Authorization": authorization.encode("latin-1")})
    assert answer.status_code == 401
    assert answer.headers["www-authenticate"] == "Bearer"


def test_a_cookie_that_is_forged_expired_or_of_another_token_is_refused(server) -> None:
    door = server.services.door
    browser, expiry, signature = door.cookies.issue().split(".")
    values = [
        "",
        "x",
        f"{browser}.{int(expiry) + 1}.{signature}",
        f"intruder.{expiry}.{signature}",
        Cookies("another token").issue(),
        Cookies(door.token, clock=lambda: 0.0).issue(),
    ]
    with server.stranger() as client:
        for value in values:
            answer = client.get("/api/sessions", headers={"Cookie": f"{door.cookie_name}={value}"})
            assert answer.status_code == 401, value


def test_everything_but_the_open_paths_needs_a_login(server) -> None:
    with server.stranger() as client:
        for path in ("/", "/api/health", "/static/main.js"):
            assert client.get(path).status_code == 200, path
        for path in (
            "/api/openapi.json",
            "/api/sessions",
            "/docs",
            "/nothing",
            "//api/health",
            "/api/health/",
            "/static",
        ):
            assert client.get(path).status_code == 401, path


def test_the_page_tells_strangers_nothing(server, sid: str) -> None:
    with server.stranger() as client, server.browser() as known:
        assert "Log in" in client.get("/").text
        assert sid not in client.get("/").text
        assert "Log in" not in known.get("/").text


@pytest.mark.parametrize(
    ("path", "status"),
    [("/", 200), ("/api/sessions", 200), ("/api/sessions/nope", 404), ("/nothing", 404), ("/static/main.js", 200)],
)
def test_every_answer_has_the_headers(server, path: str, status: int) -> None:
    answer = server.client.get(path)
    assert answer.status_code == status
    for name, value in HEADERS.items():
        assert answer.headers[name] == value
    assert answer.headers["cache-control"] == ("no-cache" if path.startswith("/static/") else "no-store")


def test_refusals_have_the_headers_too(server) -> None:
    for attack, _, _, _ in ATTACKS.values():
        answer = attack(server)
        assert HEADERS.items() <= {name.title().replace("Xss", "XSS"): v for name, v in answer.headers.items()}.items()


def test_only_scripts_of_this_origin_may_run() -> None:
    policy = dict(part.split(" ", 1) for part in HEADERS["Content-Security-Policy"].split("; "))
    assert policy["default-src"] == "'none'"
    assert policy["script-src"] == "'self'"
    assert policy["frame-ancestors"] == "'self'"
    assert "unsafe" not in HEADERS["Content-Security-Policy"]


@pytest.mark.parametrize(
    ("listens_on", "name", "known"),
    [
        ("127.0.0.1", "127.0.0.1", True),
        ("127.0.0.1", "LOCALHOST.", True),
        ("127.0.0.1", "::1", True),
        ("127.0.0.1", "lab.example", True),
        ("127.0.0.1", "192.168.1.5", False),
        ("127.0.0.1", "evil.example", False),
        ("127.0.0.1", "127.0.0.1.evil.example", False),
        ("127.0.0.1", "localhost.evil.example", False),
        ("127.0.0.1", "", False),
        ("0.0.0.0", "192.168.1.5", True),
        ("0.0.0.0", "evil.example", False),
        ("192.168.1.5", "192.168.1.5", True),
    ],
)
def test_which_names_are_this_servers(listens_on: str, name: str, known: bool) -> None:
    door = Door("t", Cookies("t"), "cookie", host=listens_on, hosts=("lab.example",))
    assert door.knows_host(name) is known


@pytest.mark.parametrize("value", ["127.0.0.1:8000", "localhost", "[::1]:8000", "[::1]"])
def test_a_host_with_any_port_is_taken(value: str) -> None:
    door = Door("t", Cookies("t"), "cookie", host="127.0.0.1")
    assert security.check_host(door, [value]) == value


@pytest.mark.parametrize(
    "values",
    [[], ["localhost", "evil.example"], ["[::1"], ["localhost:x"], ["localhost:80:80"], ["localhost@evil.example"]],
)
def test_a_host_that_is_missing_double_or_odd_is_refused(values: list[str]) -> None:
    door = Door("t", Cookies("t"), "cookie", host="127.0.0.1")
    with pytest.raises(security.Refused):
        security.check_host(door, values)


@pytest.mark.parametrize(
    ("path", "headers", "passes"),
    [
        ("/scene/s/", {"host": "localhost:1", "authorization": "Bearer t"}, True),
        ("/scene/s/", {"host": "localhost:1", "authorization": "Bearer t", "origin": "http://localhost:1"}, True),
        ("/scene/s/", {"host": "localhost:1", "authorization": "Bearer t", "origin": "http://localhost:2"}, False),
        ("/scene/s/", {"host": "evil.example", "authorization": "Bearer t"}, False),
        ("/scene/s/", {"host": "localhost:1"}, False),
        # Open to requests, which is no reason to open a line there.
        ("/static/main.js", {"host": "localhost:1"}, False),
        ("/static/main.js", {"host": "localhost:1", "authorization": "Bearer t"}, False),
        ("/", {"host": "localhost:1"}, False),
    ],
)
def test_websockets_are_guarded_alike(path: str, headers: dict[str, str], passes: bool) -> None:
    reached: list[str] = []
    sent: list[dict[str, Any]] = []

    async def app(scope: Any, receive: Any, send: Any) -> None:
        reached.append(scope["path"])

    async def send(message: Any) -> None:
        sent.append(message)

    async def receive() -> Any:
        return {"type": "websocket.connect"}

    scope = {
        "type": "websocket",
        "path": path,
        "headers": [(k.encode(), v.encode()) for k, v in headers.items()],
    }
    guard = Guard(app, door=lambda: Door("t", Cookies("t"), "cookie", host="127.0.0.1"))
    asyncio.run(guard(scope, receive, send))
    assert bool(reached) is passes
    assert [message["type"] for message in sent] == ([] if passes else ["websocket.close"])
