"""The guard before every request: Host, Origin, who is asking; and the headers on every answer.

What each check is for:

Host      a page on the internet that rebinds its own name to 127.0.0.1 (DNS rebinding) sends its own name as Host
Origin    a page elsewhere, also on another port of this machine, that lets the visitor's browser send for it
token     other programs and users of this machine, and of the network where the server listens on it
headers   content that is not what it seems, framing, leaks by referrer, script from anywhere but here
"""

import ipaddress
import re
from collections.abc import Callable, MutableMapping
from dataclasses import dataclass
from typing import Any

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import cookie_parser
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from ars_web.api.credentials import Cookies, same
from ars_web.api.problems import ProblemResponse

SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})

LOOPBACK_NAMES = frozenset({"localhost", "127.0.0.1", "::1"})

OPEN_PATHS = frozenset({"/", "/login", "/favicon.ico", "/api/health"})
"""What is answered without a login; beside them only the page's files, below OPEN_FOLDER, and WORKSPACE. None holds
data."""

OPEN_FOLDER = "/static/"

WORKSPACE = re.compile(r"/sessions/[a-z][a-z0-9]{11}")
"""The address of a session's page: always the same file, or how to log in. Whether there is such a session is not
told by it."""

SMALL_BODY = 64 * 1024
"""Bytes that a refused request may still send, so that its sender gets to read the answer."""

CONTENT_SECURITY_POLICY = "; ".join(
    [
        "default-src 'none'",
        "script-src 'self'",
        "style-src 'self'",
        "img-src 'self' blob:",
        "font-src 'self'",
        "connect-src 'self'",
        "frame-src 'self'",
        "base-uri 'none'",
        "form-action 'self'",
        "frame-ancestors 'self'",
    ]
)

HEADERS = {
    "Content-Security-Policy": CONTENT_SECURITY_POLICY,
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "SAMEORIGIN",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), geolocation=(), microphone=()",
}
"""On every answer."""


@dataclass(frozen=True)
class Door:
    """Who is let in.

    Attributes:
        token: the bearer token.
        cookies: signs and knows the login cookies.
        cookie_name: the login cookie's name; browsers share cookies among the ports of a host, so the port is in it.
        host: the address that the server listens on.
        hosts: further names that it is reached by.
    """

    token: str
    cookies: Cookies
    cookie_name: str
    host: str
    hosts: tuple[str, ...] = ()

    def knows_host(self, name: str) -> bool:
        """Whether `name` (no port) is a name of this server.

        Where it listens on more than loopback, an address is taken for any IP address: a rebound name is never one.
        """
        name = name.lower().rstrip(".")
        if name in LOOPBACK_NAMES or name == self.host.lower() or name in {host.lower() for host in self.hosts}:
            return True
        return not _is_loopback(self.host) and _is_address(name)


class Refused(Exception):
    """A request that does not pass; carries its answer."""

    def __init__(self, status: int, kind: str, title: str, detail: str, **headers: str) -> None:
        super().__init__(detail)
        self.title = title
        self.response = ProblemResponse(
            status, kind, title, detail, headers={k.replace("_", "-"): v for k, v in headers.items()}
        )


class Guard:
    """Middleware: checks what comes in, adds HEADERS to what goes out.

    An accepted request's `scope["state"]["author"]` names who asks: `api` for the token, `page-…` for a browser
    that has logged in, None for nobody (only where `is_open_path`).
    """

    def __init__(self, app: ASGIApp, *, door: Callable[[], Door]) -> None:
        self.app = app
        self.door = door

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on, or answer with a problem."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return

        async def send_guarded(message: Message) -> None:
            if message["type"] in ("http.response.start", "websocket.http.response.start"):
                _add_headers(message, scope["path"])
            await send(message)

        try:
            state: MutableMapping[str, Any] = scope.setdefault("state", {})
            state["author"] = self._check(scope)
        except Refused as refused:
            if scope["type"] == "websocket" and "websocket.http.response" not in scope.get("extensions", {}):
                await send({"type": "websocket.close", "code": 1008, "reason": refused.title})
                return
            if _sends_much(Headers(scope=scope)):
                # Otherwise the server would go on reading what it throws away, for as long as the stranger sends.
                refused.response.headers["Connection"] = "close"
            await refused.response(scope, receive, send_guarded)
            return
        await self.app(scope, receive, send_guarded)

    def _check(self, scope: Scope) -> str | None:
        headers = Headers(scope=scope)
        door = self.door()
        host = check_host(door, headers.getlist("host"))
        unsafe = scope["type"] == "websocket" or scope["method"] not in SAFE_METHODS
        if unsafe:
            check_origin(headers.getlist("origin"), host)
        author = who(door, headers)
        is_open = is_open_path(scope["path"])
        if author is None:
            if is_open and scope["type"] == "http":
                return None
            raise Refused(
                401,
                "unauthorized",
                "Not logged in",
                "send `Authorization: Bearer TOKEN`, the token in the sessions folder's .token file, or open the"
                " one-time URL that the server printed when it started",
                WWW_Authenticate="Bearer",
            )
        if author.startswith("page-"):
            check_browser(headers, unsafe=unsafe)
        if is_open and scope["type"] == "websocket":
            # What serves files would fail on it.
            raise Refused(404, "not-found", "Not found", "there is no websocket at this address")
        return author


def is_open_path(path: str) -> bool:
    """Whether an address is answered without a login."""
    return path in OPEN_PATHS or path.startswith(OPEN_FOLDER) or WORKSPACE.fullmatch(path) is not None


def check_host(door: Door, values: list[str]) -> str:
    """The one Host header.

    Raises:
        Refused: it is missing, repeated, or none of this server's.
    """
    if len(values) == 1 and door.knows_host(_host_name(values[0])):
        return values[0]
    shown = ", ".join(values)[:200] or "no name"
    raise Refused(
        421,
        "misdirected",
        "Another server's name",
        f"this server is not known as {shown}; use 127.0.0.1 or the host it was started with",
    )


def check_origin(values: list[str], host: str) -> None:
    """Refuse what another origin's page sends; a request that names no origin does not come from a page.

    Raises:
        Refused: an Origin header is not this server's own.
    """
    for origin in values:
        if len(values) > 1 or origin.lower() not in (f"http://{host}".lower(), f"https://{host}".lower()):
            raise Refused(
                403, "foreign-origin", "Another origin", f"a page of {origin[:200]} may not change anything here"
            )


def check_browser(headers: Headers, *, unsafe: bool) -> None:
    """What a cookie proves is only that the browser is logged in: its page must be ours, too.

    Raises:
        Refused: the browser says that another site's page is asking, or an unsafe request names no origin.
    """
    if headers.get("sec-fetch-site", "same-origin") not in ("same-origin", "none"):
        raise Refused(403, "foreign-origin", "Another origin", "another site's page may not read from here")
    if unsafe and "origin" not in headers:
        raise Refused(
            403, "foreign-origin", "No origin", "a change by cookie needs an Origin header; scripts use the token"
        )


def who(door: Door, headers: Headers) -> str | None:
    """The author that the request's token or cookie stands for; None for neither, or a wrong one."""
    scheme, _, token = headers.get("authorization", "").partition(" ")
    if scheme.lower() == "bearer" and same(token.strip(), door.token):
        return "api"
    for header in headers.getlist("cookie"):
        value = cookie_parser(header).get(door.cookie_name)
        browser = door.cookies.browser(value) if value else None
        if browser is not None:
            return f"page-{browser}"
    return None


def _sends_much(headers: Headers) -> bool:
    declared = headers.get("content-length", "0")
    return "transfer-encoding" in headers or not declared.isdigit() or int(declared) > SMALL_BODY


def _add_headers(message: Message, path: str) -> None:
    headers = MutableHeaders(scope=message)
    for name, value in HEADERS.items():
        headers.setdefault(name, value)
    # Images say otherwise themselves; the page's files are asked about before they are used again.
    headers.setdefault("Cache-Control", "no-cache" if path.startswith(OPEN_FOLDER) else "no-store")


def _host_name(value: str) -> str:
    """The name of a `NAME`, `NAME:PORT`, `[V6]` or `[V6]:PORT`; empty where it is none of them."""
    if value.startswith("["):
        name, closed, rest = value[1:].partition("]")
        return name if closed and _is_port(rest) else ""
    name, colon, port = value.partition(":")
    return name if _is_port(colon + port) else ""


def _is_port(text: str) -> bool:
    return text == "" or (text[0] == ":" and text[1:].isascii() and text[1:].isdigit() and len(text) <= 6)


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _is_loopback(host: str) -> bool:
    return host.lower() == "localhost" or (_is_address(host) and ipaddress.ip_address(host).is_loopback)
