"""Undo, redo, and the stream of events."""

import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import httpx
import numpy as np
import pytest

from ars_web.geometry.polygon import Polygon
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.store import SessionStore


@pytest.fixture
def path(sid: str) -> str:
    return f"/api/sessions/{sid}"


def test_undo_and_redo_are_new_revisions(client: httpx.Client, path: str, box_json: dict[str, Any]) -> None:
    client.post(f"{path}/boxes", json=box_json)
    undone = client.post(f"{path}/undo")
    assert (undone.status_code, undone.headers["etag"]) == (200, '"2"')
    assert (undone.json()["revision"], undone.json()["undoes"]) == (2, 1)
    assert client.get(f"{path}/boxes").json() == []
    redone = client.post(f"{path}/redo")
    assert (redone.json()["revision"], redone.json()["redoes"]) == (3, 2)
    (change,) = redone.json()["changes"]
    assert (change["kind"], change["id"], change["before"]) == ("box", 1, None)
    assert client.get(f"{path}/boxes").json() == [change["after"]]


def test_the_history_says_what_was_done_and_what_stands(
    server, client: httpx.Client, path: str, box_json: dict[str, Any]
) -> None:
    empty = client.get(f"{path}/history")
    assert empty.json() == {"items": [], "can_undo": None, "can_redo": None}
    assert empty.headers["etag"] == '"0"'
    client.post(f"{path}/boxes", json=box_json)
    client.patch(f"{path}/boxes/1", json={"name": "left"}, headers={"If-Match": '"1"'})
    undo = client.post(f"{path}/undo").json()
    with server.browser() as page:
        page.post(f"{path}/boxes", json=box_json)
        theirs = page.get(f"{path}/history").json()
    found = client.get(f"{path}/history")
    assert found.headers["etag"] == '"4"'
    items = found.json()["items"]
    assert [(i["revision"], i["summary"], i["undone"], i["own"]) for i in items] == [
        (4, "Add cube 2", False, False),
        (3, "Undo: Rename cube", False, True),
        (2, "Rename cube", True, True),
        (1, "Add cube", False, True),
    ]
    assert {key: items[1][key] for key in undo} == undo
    assert found.json()["can_undo"] == {"revision": 1, "summary": "Add cube"}
    assert found.json()["can_redo"] == {"revision": 3, "summary": "Rename cube"}
    assert [i["own"] for i in theirs["items"]] == [True, False, False, False]
    assert (theirs["can_undo"], theirs["can_redo"]) == ({"revision": 4, "summary": "Add cube 2"}, None)
    page_of_two = client.get(f"{path}/history", params={"limit": 2, "before": 3}).json()["items"]
    assert page_of_two == items[2:]
    client.post(f"{path}/redo")
    again = client.get(f"{path}/history").json()
    assert [(i["revision"], i["undone"]) for i in again["items"]] == [
        (5, False), (4, False), (3, True), (2, False), (1, False),
    ]  # fmt: skip
    assert (again["can_undo"], again["can_redo"]) == ({"revision": 5, "summary": "Rename cube"}, None)
    for bad in ({"limit": 0}, {"limit": 501}, {"before": 0}, {"before": "x"}):
        assert client.get(f"{path}/history", params=bad).status_code == 422
    assert client.get("/api/sessions/nope/history").status_code == 404


def test_nothing_to_undo_is_a_conflict(client: httpx.Client, path: str) -> None:
    for verb in ("undo", "redo"):
        answer = client.post(f"{path}/{verb}")
        assert answer.status_code == 409
        assert answer.json()["type"].endswith("nothing-to-undo")


def test_a_repeated_undo_takes_back_only_one(client: httpx.Client, path: str, box_json: dict[str, Any]) -> None:
    for _ in range(2):
        client.post(f"{path}/boxes", json=box_json)
    for verb, left in (("undo", 1), ("redo", 2)):
        key = {"Idempotency-Key": verb}
        first, again = (client.post(f"{path}/{verb}", headers=key) for _ in range(2))
        assert first.json() == again.json()
        assert len(client.get(f"{path}/boxes").json()) == left


def test_each_takes_back_their_own(server, client: httpx.Client, path: str, box_json: dict[str, Any]) -> None:
    with server.browser() as page:
        page.post(f"{path}/boxes", json=box_json)
        client.post(f"{path}/boxes", json=box_json)
        page.post(f"{path}/undo")
        assert [box["id"] for box in client.get(f"{path}/boxes").json()] == [2]
        assert page.post(f"{path}/undo").status_code == 409


def test_an_undo_that_meets_a_later_change_is_a_conflict(
    server, client: httpx.Client, path: str, box_json: dict[str, Any]
) -> None:
    with server.browser() as page:
        one = page.post(f"{path}/boxes", json=box_json).headers["location"]
        changed = client.patch(one, json={"size": [1, 1, 1]}, headers={"If-Match": '"1"'})
        answer = page.post(f"{path}/undo")
    assert answer.status_code == 409
    assert answer.json()["current"] == changed.json()


# Events


class Events:
    """A stream of Server-Sent Events, read as they come."""

    def __init__(self, response: httpx.Response) -> None:
        self.lines = response.iter_lines()

    def next(self) -> dict[str, Any]:
        """The next event, comments left out."""
        event: dict[str, Any] = {}
        for line in self.lines:
            if not line:
                if event:
                    return event
                continue
            name, _, value = line.partition(": ")
            if name:
                event[name] = json.loads(value) if name in ("id", "data") else value
        raise EOFError


@contextmanager
def events(client: httpx.Client, path: str, **headers: str) -> Iterator[Events]:
    with client.stream("GET", f"{path}/events", headers=headers, timeout=20) as response:
        assert response.status_code == 200
        assert response.headers["content-type"].startswith("text/event-stream")
        yield Events(response)


def test_edits_come_as_they_happen(client: httpx.Client, path: str, box_json: dict[str, Any]) -> None:
    with events(client, path) as stream:
        assert stream.next() == {"id": 0, "event": "ready", "data": {"revision": 0}}
        made = client.post(f"{path}/boxes", json=box_json).json()
        event = stream.next()
        assert (event["id"], event["event"]) == (1, "edit")
        assert event["data"]["author"] == "api"
        assert event["data"]["changes"] == [{"kind": "box", "id": 1, "before": None, "after": made}]
        client.post(f"{path}/classes", json={"name": "ball"})
        assert stream.next()["data"]["changes"][0]["kind"] == "class"
        client.patch(path, json={"name": "new"}, headers={"If-Match": '"2"'})
        assert stream.next()["data"]["changes"] == [{"kind": "name", "id": None, "before": "scene", "after": "new"}]


def test_masks_come_with_their_outlines_and_stay_without_them_in_the_history(
    server, client: httpx.Client, sid: str, path: str
) -> None:
    triangle = Polygon(np.array([[1.0, 2.0], [30.25, 2.0], [30.25, 40.0004]]))
    editor: SessionEditor = server.services.editor
    with events(client, path) as stream:
        stream.next()
        mask = editor.put_mask(
            sid, box_id=None, frame=3, class_id=0, polygons=[triangle], expected_revision=None, author="me"
        )
        (change,) = stream.next()["data"]["changes"]
        told = {
            "id": 1, "box_id": 1, "class_id": 0, "frame": 3, "origin": "drawn", "accepted": True, "revision": 1,
        }  # fmt: skip
        outline = {"polygons": [{"outer": [[1.0, 2.0], [30.25, 2.0], [30.25, 40.0]], "holes": []}], "points": 3}
        assert change == {"kind": "mask", "id": 1, "before": None, "after": {**told, **outline}}
        editor.delete_mask(sid, mask.id, expected_revision=1, author="me")
        assert stream.next()["data"]["changes"] == [{"kind": "mask", "id": 1, "before": told, "after": None}]
    items = client.get(f"{path}/history").json()["items"]
    assert [item["changes"] for item in items] == [
        [{"kind": "mask", "id": 1, "before": told, "after": None}],
        [{"kind": "mask", "id": 1, "before": None, "after": told}],
    ]


def test_what_was_missed_is_replayed(client: httpx.Client, path: str, box_json: dict[str, Any]) -> None:
    for _ in range(5):
        client.post(f"{path}/boxes", json=box_json)
    with events(client, path, **{"Last-Event-ID": "2"}) as stream:
        assert stream.next() == {"id": 2, "event": "ready", "data": {"revision": 5}}
        assert [stream.next()["id"] for _ in range(3)] == [3, 4, 5]
        client.post(f"{path}/undo")
        assert stream.next()["data"]["undoes"] == 5
    with client.stream("GET", f"{path}/events?after=0") as response:
        stream = Events(response)
        assert [stream.next()["id"] for _ in range(7)] == [0, 1, 2, 3, 4, 5, 6]
    with client.stream("GET", f"{path}/events?after=0", headers={"Last-Event-ID": "5"}) as response:
        stream = Events(response)
        assert [stream.next()["id"] for _ in range(2)] == [5, 6]


def test_a_client_ahead_of_the_session_is_told_to_begin_again(client: httpx.Client, path: str) -> None:
    with events(client, path, **{"Last-Event-ID": "9"}) as stream:
        assert stream.next() == {"id": 0, "event": "reset", "data": {"revision": 0}}


@pytest.mark.parametrize("value", ["-1", "x", "1.5", "9" * 30])
def test_an_id_that_is_no_revision_is_refused(client: httpx.Client, path: str, value: str) -> None:
    assert client.get(f"{path}/events", headers={"Last-Event-ID": value}).status_code == 422


def test_events_of_an_unknown_session_are_not_found(client: httpx.Client) -> None:
    assert client.get("/api/sessions/nope/events").status_code == 404


def test_edits_of_another_process_come_too(server, client: httpx.Client, sid: str, path: str) -> None:
    """A second store on the same folder tells the server nothing, as another process would."""
    with events(client, path) as stream, SessionStore(server.services.store.folder) as store:
        stream.next()
        SessionEditor(store).add_class(sid, name="elsewhere", author="cli")
        event = stream.next()
        assert (event["id"], event["data"]["author"]) == (1, "cli")


def test_a_deleted_session_ends_its_streams(client: httpx.Client, path: str) -> None:
    with events(client, path) as stream:
        stream.next()
        assert client.delete(path, headers={"If-Match": '"0"'}).status_code == 204
        assert stream.next()["event"] == "gone"
        with pytest.raises(EOFError):
            stream.next()


def test_many_streams_take_no_threads(server, client: httpx.Client, path: str, box_json: dict[str, Any], until) -> None:
    limits = httpx.Limits(max_connections=None)
    with httpx.Client(base_url=server.url, headers=client.headers, limits=limits, timeout=30) as many:
        opened = [many.stream("GET", f"{path}/events") for _ in range(60)]
        streams = [Events(manager.__enter__()) for manager in opened]
        for stream in streams:
            assert stream.next()["event"] == "ready"
        assert threading.active_count() < 60
        client.post(f"{path}/boxes", json=box_json)
        assert [stream.next()["id"] for stream in streams] == [1] * 60
        for manager in opened:
            manager.__exit__(None, None, None)
    until(lambda: not server.services.events.watched)


def test_a_quiet_stream_is_kept_alive(client: httpx.Client, server, path: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server.services.events, "keep_alive_seconds", 0.05)
    with client.stream("GET", f"{path}/events") as response:
        lines = response.iter_lines()
        assert sum(next(lines).startswith(":") for _ in range(12)) >= 3


def test_edits_of_many_threads_come_once_each_and_in_order(
    client: httpx.Client, path: str, box_json: dict[str, Any]
) -> None:
    def work() -> None:
        for _ in range(10):
            assert client.post(f"{path}/boxes", json=box_json).status_code == 201

    with events(client, path) as stream:
        stream.next()
        threads = [threading.Thread(target=work) for _ in range(4)]
        for thread in threads:
            thread.start()
        assert [stream.next()["id"] for _ in range(40)] == list(range(1, 41))
        for thread in threads:
            thread.join()
