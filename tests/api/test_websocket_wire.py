"""Peers that make a server keep what they never take: hung up on, and real without what hangs up on them."""

import base64
import os
import socket
import struct
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from itertools import count
from typing import Any

import numpy as np
import pytest

from ars_web.api.websocket_wire import MOST_PARTS, WebsocketWire
from ars_web.geometry.box import Box
from ars_web.workspace import BoxPreview, Dragged

A = "a" * 32


@pytest.fixture
def server(tmp_path, run_server, live_page):
    with run_server(tmp_path, websockets={"ws_ping_interval": 0.3, "ws_ping_timeout": 0.3}) as running:
        scene = live_page.RememberingScene()
        running.app.state.services = replace(running.services, scene=scene)
        yield running


@pytest.fixture
def silent(server):
    """A socket that has a live line and reads no more than its beginning."""
    made = server.client.post("/api/sessions", json={"name": "scene", "root": "data", "path": "scene"}).json()
    with socket.socket() as peer:
        peer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        peer.settimeout(20)
        peer.connect(("127.0.0.1", int(server.url.rpartition(":")[2])))
        lines = [
            f"GET /api/sessions/{made['id']}/live?view={A} HTTP/1.1",
            f"Host: {server.host}",
            f"Authorization: Bearer {server.services.door.token}",
            "Connection: Upgrade",
            "Upgrade: websocket",
            "Sec-WebSocket-Version: 13",
            f"Sec-WebSocket-Key: {base64.b64encode(os.urandom(16)).decode()}",
        ]
        peer.sendall("\r\n".join([*lines, "", ""]).encode())
        assert peer.recv(12) == b"HTTP/1.1 101"
        yield peer


def frame(opcode: int, data: bytes = b"", *, fin: bool = True) -> bytes:
    """A short frame as a client sends it; a mask of nothing changes nothing."""
    return struct.pack("!BB4x", opcode | (0x80 if fin else 0), 0x80 | len(data)) + data


def hung_up_on(peer: socket.socket, pieces: Any) -> bool:
    """Whether the server ends the connection before it has taken all pieces."""
    try:
        for piece in pieces:
            peer.sendall(piece)
    except (ConnectionResetError, BrokenPipeError):
        return True
    return False


def ping_flood(peer: socket.socket) -> bool:
    return hung_up_on(peer, (frame(0x9, b"x" * 125) * 500 for _ in range(400)))


def endless_message(peer: socket.socket) -> bool:
    parts = (frame(0x0, fin=False) * 100 for _ in range(MOST_PARTS))
    return hung_up_on(peer, [frame(0x1, b"{", fin=False), *parts]) or not answers(peer)


def answers(peer: socket.socket) -> bool:
    """Whether the server answers one more ping."""
    seen = b""
    try:
        peer.sendall(frame(0x9, b"there?"))
        while not seen.endswith(b"\x8a\x06there?"):
            got = peer.recv(1)
            if not got:
                return False
            seen += got
    except (ConnectionResetError, BrokenPipeError):
        return False
    return True


ATTACKS: dict[str, Callable[[socket.socket], bool]] = {"handle_ping": ping_flood, "handle_cont": endless_message}


@pytest.mark.parametrize("answer", ATTACKS)
def test_a_peer_that_never_takes_what_it_asks_for_is_hung_up_on(silent, monkeypatch, answer: str) -> None:
    monkeypatch.setattr(WebsocketWire, "keepalive_timeout", lambda self: None)
    assert ATTACKS[answer](silent)


@pytest.mark.parametrize("answer", ATTACKS)
def test_without_that_the_server_takes_it_all(silent, monkeypatch, answer: str) -> None:
    monkeypatch.setattr(WebsocketWire, "keepalive_timeout", lambda self: None)
    monkeypatch.delattr(WebsocketWire, answer)
    assert not ATTACKS[answer](silent)


@pytest.mark.parametrize("request_line", ["POST / HTTP/1.1", "PUT / HTTP/1.1"])
def test_what_asks_for_no_websocket_is_hung_up_on(server, request_line: str) -> None:
    with socket.create_connection(("127.0.0.1", int(server.url.rpartition(":")[2])), timeout=20) as peer:
        lines = [request_line, f"Host: {server.host}", "Connection: Upgrade", "Upgrade: websocket"]
        peer.sendall("\r\n".join([*lines, "", ""]).encode())
        with suppress(ConnectionResetError):
            assert peer.recv(100) == b""


def test_a_message_beyond_all_measure_ends_the_line(silent) -> None:
    size = 2**20 + 1
    assert hung_up_on(silent, [struct.pack("!BBQ4x", 0x81, 0x80 | 127, size), *[b"x" * 2**16] * 256])


def test_a_peer_that_vanished_with_much_on_the_way_is_detached(server, silent, until) -> None:
    scene = server.services.scene
    preview = BoxPreview(1, Box(np.eye(4), np.ones(3)))
    until(lambda: scene.send != {})
    ((_, send),) = scene.send.items()
    number = count()

    def is_detached() -> bool:
        send(Dragged("move", preview, f"{next(number)}".ljust(100_000), own=False))
        return scene.of(A)[-1] == ("detach",)

    until(is_detached)
