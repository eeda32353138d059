"""The live line: what the page says reaches the scene, what happens reaches the page, and nobody else gets on it."""

import asyncio
import base64
import json
import os
import socket
import threading
from collections.abc import Iterator
from contextlib import AsyncExitStack
from dataclasses import replace
from typing import Any

import httpx
import numpy as np
import pytest
from websockets.asyncio.client import connect as connect_async
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from ars_web.api.live_line import LiveLines
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.workspace import (
    BoxPreview,
    Conflicted,
    Dragged,
    Entered,
    Look,
    NewBox,
    Picked,
    Refused,
    ViewState,
)

A, B = "a" * 32, "b" * 32
PLACE = {"position": [1.0, 2.0, 3.0], "wxyz": [1.0, 0.0, 0.0, 0.0]}


@pytest.fixture
def scene(server, live_page) -> Iterator[Any]:
    """What the server shows its pages from now on."""
    remembering = live_page.RememberingScene()
    before = server.services
    server.app.state.services = replace(before, scene=remembering)
    yield remembering
    server.app.state.services = before


@pytest.fixture
def line(server, live_page, sid: str, scene):
    """`with line(view, …) as page`: a line to a new session, by the token."""

    def opened(view: str = A, **options: Any) -> Any:
        return live_page.line(
            server.url, sid, view, **{"Authorization": f"Bearer {server.services.door.token}", **options}
        )

    return opened


def preview(box_id: int = 7, x: float = 1.0) -> BoxPreview:
    T = rigid_transform.from_rotation(np.eye(3), np.array([x, 2.0, 3.0]))
    return BoxPreview(box_id, Box(T, np.array([0.1, 0.2, 0.3])))


# Edits


def test_an_edit_over_http_reaches_every_line(client: httpx.Client, line, sid: str, box_json: dict[str, Any]) -> None:
    with line(A) as one, line(B) as other:
        for page in (one, other):
            assert page.next() == {"type": "ready", "revision": 0}
        made = client.post(f"/api/sessions/{sid}/boxes", json=box_json).json()
        for page in (one, other):
            message = page.next()
            assert (message["type"], message["edit"]["revision"], message["edit"]["author"]) == ("edit", 1, "api")
            assert message["edit"]["changes"] == [{"kind": "box", "id": 1, "before": None, "after": made}]


def test_what_was_missed_is_replayed(client: httpx.Client, line, sid: str, box_json: dict[str, Any]) -> None:
    for _ in range(5):
        client.post(f"/api/sessions/{sid}/boxes", json=box_json)
    with line(after=2) as page:
        assert page.next() == {"type": "ready", "revision": 5}
        assert [page.next()["edit"]["revision"] for _ in range(3)] == [3, 4, 5]
        client.post(f"/api/sessions/{sid}/undo")
        assert page.next()["edit"]["undoes"] == 5


def test_a_page_ahead_of_the_session_is_told_to_begin_again(line) -> None:
    with line(after=9) as page:
        assert page.next() == {"type": "reset", "revision": 0}


def test_a_deleted_session_ends_its_lines(client: httpx.Client, line, sid: str, scene, until) -> None:
    with line() as page:
        page.next()
        client.delete(f"/api/sessions/{sid}", headers={"If-Match": '"0"'})
        assert page.next() == {"type": "gone", "revision": 0}
        assert closed(page) == 4410
    until(lambda: scene.of(A)[-1] == ("detach",))


# To the scene


def test_what_a_page_says_reaches_the_scene(line, live_page, scene, until) -> None:
    with line() as page:
        page.next()
        page.say("view", **live_page.VIEW)
        page.say("look", at="selected")
        page.say("new-box", class_id=2)
        page.say("preview", box_id=7, T_world_box=PLACE, size=[0.1, 0.2, 0.3])
        page.say("preview", box_id=None)
        until(lambda: len(scene.of(A)) == 6)
    until(lambda: len(scene.of(A)) == 7)
    attached, shown, looked, new, typed, ended, detached = scene.of(A)
    assert attached == ("attach", "api")
    assert shown[1] == ViewState("frame", 3, None, "move", "world", 0.01, 0.1, True, frozenset({4, 5}), False)
    assert looked[1] == Look("selected")
    assert new[1] == NewBox(2)
    assert typed[1].box_id == 7
    np.testing.assert_array_equal(typed[1].box.T_world_box, preview().box.T_world_box)
    np.testing.assert_array_equal(typed[1].box.size, [0.1, 0.2, 0.3])
    assert ended[1] is None
    assert detached == ("detach",)


REFUSED: dict[str, tuple[Any, str]] = {
    "no JSON": ("{", "not JSON"),
    "too deep": ("[" * 5000, "not JSON"),
    "half a surrogate": ('{"type": "hello", "name": "\\ud800"}', "not JSON"),
    "a list": ("[]", "object"),
    "bytes": (b"{}", "binary"),
    "too long": ("x" * 300_000, "262144"),
    "no type": ({"name": "x"}, "type: missing"),
    "another type": ({"type": "shout"}, "type: must be one of hello, view"),
    "a message to the page": ({"type": "ready", "revision": 1}, "type: must be"),
    "an unknown field": ({"type": "hello", "name": "x", "age": 3}, "hello.age: unknown field"),
    "a number for a name": ({"type": "hello", "name": 3}, "hello.name: "),
    "a missing field": ({"type": "look"}, "look.at: "),
    "an unknown place": ({"type": "look", "at": "away"}, "look.at: "),
    "a string for a number": ({"type": "new-box", "class_id": "1"}, "new-box.class_id: "),
    "a fraction": ({"type": "new-box", "class_id": 1.5}, "new-box.class_id: "),
    "half a box": ({"type": "preview", "box_id": 1, "size": [1, 1, 1]}, "preview: T_world_box is missing"),
    "a box of nothing": (
        {"type": "preview", "box_id": None, "size": [1, 1, 1]},
        "preview: T_world_box and size belong",
    ),
    "no size": ({"type": "preview", "box_id": 1, "T_world_box": PLACE, "size": [1, 0, 1]}, "preview.size.1: "),
    "not finite": (
        {"type": "preview", "box_id": 1, "T_world_box": {**PLACE, "position": [0, 0, float("inf")]}, "size": [1, 1, 1]},
        "preview.T_world_box.position.2: ",
    ),
    "too far": (
        {"type": "preview", "box_id": 1, "T_world_box": {**PLACE, "position": [0, 0, 9e8]}, "size": [1, 1, 1]},
        "within 1e+07 m",
    ),
}

REFUSED_VIEWS: dict[str, tuple[str, Any]] = {
    "another mode": ("mode", "mask"),
    "a frame that is not there": ("frame", 6),
    "a frame before the first": ("frame", -1),
    "a truth value for a frame": ("frame", True),
    "a string for a truth value": ("dark", "yes"),
    "a number for a truth value": ("upright", 1),
    "a negative snap": ("snap_length", -0.1),
    "no number": ("snap_angle", float("nan")),
    "more than half a turn": ("snap_angle", 4),
    "hidden that is no list": ("hidden", 4),
    "hidden that are no ids": ("hidden", [1, -1]),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_bad_message_is_refused_and_the_line_stays(line, scene, until, name: str) -> None:
    message, words = REFUSED[name]
    with line() as page:
        page.next()
        page.connection.send(message if isinstance(message, str | bytes) else json.dumps(message))
        refusal = page.next()
        assert refusal["type"] == "refused"
        assert words in refusal["detail"]
        page.say("look", at="all")
        until(lambda: scene.of(A)[1:] == [("act", Look("all"))])


@pytest.mark.parametrize("name", REFUSED_VIEWS)
def test_a_bad_view_is_refused_by_its_field(line, live_page, scene, until, name: str) -> None:
    wrong, value = REFUSED_VIEWS[name]
    with line() as page:
        page.next()
        page.say("view", **{**live_page.VIEW, wrong: value})
        assert page.next()["detail"].startswith(f"view.{wrong}")
        page.say("view", **live_page.VIEW)
        until(lambda: [what for what, *_ in scene.of(A)] == ["attach", "show"])


# From the scene


def test_what_happens_in_the_scene_reaches_its_page_alone(
    server, client: httpx.Client, line, sid: str, scene, box_json: dict[str, Any]
) -> None:
    current = client.post(f"/api/sessions/{sid}/boxes", json=box_json).json()
    stored = server.services.store.state(sid).boxes[1]
    happened = [
        Picked(box_id=7),
        Entered(3, 12.5),
        Dragged("move", preview(), "X +12.0 mm", own=True),
        Conflicted("it was changed", preview(), stored),
        Conflicted("it was deleted", preview(), None),
        Refused("no"),
    ]
    placed = {"box_id": 7, "T_world_box": PLACE, "size": [0.1, 0.2, 0.3]}
    with line(A) as page, line(B) as other:
        for one in (page, other):
            one.next()
        talking = threading.Thread(target=lambda: [scene.send[sid, A](event) for event in happened])
        talking.start()
        assert [page.next() for _ in happened] == [
            {"type": "picked", "box_id": 7, "frame": None},
            {"type": "entered", "frame": 3, "milliseconds": 12.5},
            {"type": "dragged", "phase": "move", **placed, "text": "X +12.0 mm", "own": True},
            {"type": "conflicted", "detail": "it was changed", "yours": placed, "current": current},
            {"type": "conflicted", "detail": "it was deleted", "yours": placed, "current": None},
            {"type": "refused", "detail": "no"},
        ]
        talking.join()
        client.post(f"/api/sessions/{sid}/classes", json={"name": "ball"})
        assert other.next()["type"] == "edit"


def test_what_a_scene_says_after_its_page_has_gone_is_let_drop(line, sid: str, scene, until) -> None:
    with line() as page:
        page.next()
        send = scene.send[sid, A]
    until(lambda: scene.of(A)[-1] == ("detach",))
    send(Refused("too late"))
    with line() as page:  # the same view again, as after a reload
        assert page.next()["type"] == "ready"
        scene.send[sid, A](Refused("in time"))
        assert page.next("refused")["detail"] == "in time"


def test_a_slow_page_gets_the_newest_drag_and_every_edit(
    client: httpx.Client, line, sid: str, scene, box_json: dict[str, Any]
) -> None:
    drags = 5000  # of 10 KB each: far more than the connection holds
    with line() as page:
        page.next()
        for i in range(drags):
            scene.send[sid, A](Dragged("move", preview(), f"{i}".ljust(10_000), own=False))
        for _ in range(40):
            client.post(f"/api/sessions/{sid}/boxes", json=box_json)
        order, revisions = [-1], [0]
        while revisions[-1] < 40 or order[-1] < drags - 1:
            message = page.next("dragged", "edit")
            if message["type"] == "edit":
                revisions.append(message["edit"]["revision"])
            else:
                order.append(int(message["text"]))
    assert revisions == list(range(41))
    assert order == sorted(order)
    assert len(order) < drags


def test_the_end_of_ones_own_drag_is_told_though_another_drags_the_same_box_then(line, sid: str, scene) -> None:
    with line() as page:
        page.next()
        for i in range(2000):  # of 10 KB each: more than the connection holds
            scene.send[sid, A](Dragged("move", preview(8), f"{i}".ljust(10_000), own=False))
        scene.send[sid, A](Dragged("end", preview(), "own", own=True))
        scene.send[sid, A](Dragged("start", preview(), "another's", own=False))
        texts: list[str] = []
        while "another's" not in texts:
            texts.append(page.next("dragged")["text"])
    assert texts[-2:] == ["own", "another's"]


def test_a_page_that_never_reads_is_given_up(server, line, sid: str, scene, until) -> None:
    server.app.state.services = replace(server.services, lines=LiveLines(patience_seconds=0.2))
    with line() as page:
        page.next()
        send = scene.send[sid, A]

        def talked_to_a_wall() -> bool:
            send(Dragged("move", preview(), "x" * 100_000, own=False))
            return scene.of(A)[-1] == ("detach",)

        until(talked_to_a_wall)


# The line itself


@pytest.mark.parametrize(
    ("view", "query", "words"),
    [
        ("A" * 32, "", "view: "),
        ("a" * 31, "", "view: "),
        ("a" * 32 + "%0A", "", "view: "),
        ("", "", "view: "),
        (A, "&after=-1", "after: "),
        (A, "&after=1.5", "after: "),
        (A, f"&after={2**53}", "after: "),
        (A, "&aftr=1", "aftr: unknown field"),
    ],
)
def test_an_address_that_cannot_be_used_is_refused(line, scene, view: str, query: str, words: str) -> None:
    with line(view, query=query) as page:
        assert page.next()["detail"].startswith(words)
        assert closed(page) == 4400
    assert scene.asked == []


def test_a_line_to_an_unknown_session_is_closed(server, live_page, scene) -> None:
    for sid in ("nope", "abcdefghijkl", "%00"):
        with live_page.line(server.url, sid, A, Authorization=f"Bearer {server.services.door.token}") as page:
            assert closed(page) == 4404
    assert scene.asked == []


def test_a_newer_line_takes_the_place_of_the_older(line, live_page, scene, until) -> None:
    with line() as old:
        old.next()
        with line() as new:
            new.next()
            assert closed(old) == 4409
            assert [what for what, *_ in scene.of(A)] == ["attach", "detach", "attach"]
            new.say("view", **live_page.VIEW)
            assert len(new.people(lambda people: people[-1]["frame"] == 3)) == 1
    until(lambda: scene.of(A)[-1] == ("detach",))


def test_nobody_takes_the_place_of_another_author(server, line, live_page, sid: str, scene, until) -> None:
    with line() as mine, server.browser() as browser:
        mine.next()
        with live_page.line(server.url, sid, A, **headers_of(browser)) as theirs:
            assert closed(theirs) == 4403
        mine.say("look", at="all")
        until(lambda: [what for what, *_ in scene.of(A)] == ["attach", "act"])


def test_a_silent_line_says_who_is_there(server, line, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server.services.events, "keep_alive_seconds", 0.05)
    with line() as page:
        for _ in range(4):
            assert [one["view"] for one in page.next("here")["people"]] == [A]


def test_many_lines_take_no_threads(server, client: httpx.Client, live_page, sid: str, scene, until) -> None:
    before = threading.active_count()

    async def many(n: int) -> tuple[int, list[int]]:
        async with AsyncExitStack() as stack:
            headers = {"Authorization": f"Bearer {server.services.door.token}"}
            addresses = [live_page.address(server.url, sid, f"{i:032x}") for i in range(n)]
            opened = [connect_async(address, additional_headers=headers, proxy=None) for address in addresses]
            pages = [await stack.enter_async_context(one) for one in opened]
            await asyncio.to_thread(client.post, f"/api/sessions/{sid}/classes", json={"name": "ball"})
            return threading.active_count(), [await first_edit(page) for page in pages]

    async def first_edit(page: Any) -> int:
        while (message := json.loads(await page.recv()))["type"] != "edit":
            pass
        return message["edit"]["revision"]

    threads, revisions = asyncio.run(many(100))
    assert revisions == [1] * 100
    assert threads - before < 60
    until(lambda: client.get(f"/api/sessions/{sid}/people").json() == [])


def test_a_page_that_vanished_is_detached(tmp_path, run_server, live_page, until) -> None:
    """It answers no ping, and never says goodbye, as a laptop whose lid was closed."""
    with run_server(tmp_path, websockets={"ws_ping_interval": 0.1, "ws_ping_timeout": 0.1}) as server:
        scene = live_page.RememberingScene()
        server.app.state.services = replace(server.services, scene=scene)
        made = server.client.post("/api/sessions", json={"name": "scene", "root": "data", "path": "scene"}).json()
        with socket.create_connection(("127.0.0.1", int(server.url.rpartition(":")[2]))) as silent:
            silent.sendall(handshake(server, f"/api/sessions/{made['id']}/live?view={A}"))
            until(lambda: [what for what, *_ in scene.of(A)] == ["attach", "detach"])
        people = f"/api/sessions/{made['id']}/people"
        until(lambda: server.client.get(people).json() == [])


# Strangers


def headers_of(browser: httpx.Client) -> dict[str, str]:
    request = browser.build_request("GET", "/")
    return {name: request.headers[name] for name in ("Cookie", "Origin", "Sec-Fetch-Site") if name in request.headers}


STRANGERS: dict[str, tuple[dict[str, str | None], int]] = {
    "nobody": ({"Cookie": None, "Origin": None}, 401),
    "a page that is not logged in": ({"Cookie": None}, 401),
    "a forged cookie": ({"Cookie": "ars_web_1=x.9999999999.y"}, 401),
    "another site's page": ({"Origin": "http://evil.example"}, 403),
    "a page on another port": ({"Origin": "http://127.0.0.1:1"}, 403),
    "a sandboxed frame or a file": ({"Origin": "null"}, 403),
    "no origin": ({"Origin": None}, 403),
    "an empty origin": ({"Origin": ""}, 403),
    "what the browser calls another site's": ({"Sec-Fetch-Site": "cross-site"}, 403),
    "a rebound name": ({"Host": "evil.example"}, 421),
    "a rebound name with its origin": ({"Host": "evil.example", "Origin": "http://evil.example"}, 421),
    "a wrong token": ({"Cookie": None, "Origin": None, "Authorization": "Bearer wrong"}, 401),
}


@pytest.mark.parametrize("name", STRANGERS)
def test_a_stranger_gets_no_line(server, sid: str, scene, name: str) -> None:
    changes, status = STRANGERS[name]
    with server.browser() as browser:
        headers = {"Host": server.host, **headers_of(browser), **changes}
    answer = asked_for_a_line(server, f"/api/sessions/{sid}/live?view={A}", headers)
    assert answer.status_code == status
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert scene.asked == []


def test_a_page_with_its_cookie_gets_a_line_as_its_author(server, live_page, sid: str, scene) -> None:
    with server.browser() as browser, live_page.line(server.url, sid, A, **headers_of(browser)) as page:
        assert page.next()["type"] == "ready"
        ((what, author),) = scene.of(A)
        assert what == "attach"
        assert author.startswith("page-")
        made = browser.post(f"/api/sessions/{sid}/classes", json={"name": "ball"})
        assert made.status_code == 201
        assert page.next()["edit"]["author"] == author


def test_the_page_s_files_are_no_websocket(server) -> None:
    with pytest.raises(InvalidStatus, match="404"):
        from_token(server, "/static/main.js")
    with pytest.raises(InvalidStatus, match="403"):
        from_token(server, "/api/nothing")


def from_token(server, path: str) -> None:
    headers = {"Authorization": f"Bearer {server.services.door.token}"}
    with connect(server.url.replace("http", "ws", 1) + path, additional_headers=headers, proxy=None):
        pass


def handshake(server, path: str, headers: dict[str, str | None] | None = None) -> bytes:
    """A websocket's request, to be sent over a plain socket."""
    fields = {
        "Host": server.host,
        "Authorization": f"Bearer {server.services.door.token}",
        "Connection": "Upgrade",
        "Upgrade": "websocket",
        "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": base64.b64encode(os.urandom(16)).decode(),
    }
    if headers is not None:
        fields = {**fields, "Authorization": None, **headers}
    lines = [f"{name}: {value}" for name, value in fields.items() if value is not None]
    return "\r\n".join([f"GET {path} HTTP/1.1", *lines, "", ""]).encode()


def asked_for_a_line(server, path: str, headers: dict[str, str | None]) -> httpx.Response:
    """What a websocket's request is answered, where that is not the line itself."""
    request = {**headers, "Connection": "Upgrade", "Upgrade": "websocket", "Sec-WebSocket-Version": "13"}
    request["Sec-WebSocket-Key"] = base64.b64encode(os.urandom(16)).decode()
    with httpx.Client(base_url=server.url) as client:
        return client.get(path, headers={name: value for name, value in request.items() if value is not None})


def closed(page: Any) -> int:
    """The code that the server closes the line with."""
    with pytest.raises(ConnectionClosed) as caught:
        page.people(lambda people: False)
    assert caught.value.rcvd is not None
    return caught.value.rcvd.code
