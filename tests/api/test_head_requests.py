"""HEAD answers like GET, without the body."""

from typing import Any

import httpx
import pytest


@pytest.mark.parametrize(
    "path",
    [
        "/api/health",
        "/api/sessions",
        "/api/sessions/{sid}",
        "/api/sessions/{sid}/boxes",
        "/api/sessions/{sid}/frames?limit=2",
        "/api/sessions/{sid}/frames/0/image",
        "/api/sessions/{sid}/history",
        "/api/sessions/nope",
        "/static/styles/base.css",
        "/nowhere",
    ],
)
def test_head_is_get_without_its_body(client: httpx.Client, sid: str, box_json: dict[str, Any], path: str) -> None:
    client.post(f"/api/sessions/{sid}/boxes", json=box_json)
    path = path.format(sid=sid)
    got, head = client.get(path), client.head(path)
    assert head.status_code == got.status_code != 405
    assert head.content == b""
    kept = set(got.headers) - {"date"}
    assert {name: head.headers.get(name) for name in kept} == {name: got.headers[name] for name in kept}


def test_head_of_a_stream_ends_and_leaves_no_listener(server, client: httpx.Client, sid: str, until) -> None:
    path = f"/api/sessions/{sid}/events"
    head = client.head(path, timeout=10)
    assert (head.status_code, head.content) == (200, b"")
    assert head.headers["content-type"].startswith("text/event-stream")
    # The same connection serves what comes next.
    assert client.get(f"/api/sessions/{sid}").status_code == 200
    until(lambda: sid not in server.services.events.watched)


def test_head_is_no_way_round_the_door_and_changes_nothing(server, client: httpx.Client, sid: str) -> None:
    with server.stranger() as stranger:
        assert stranger.head(f"/api/sessions/{sid}").status_code == 401
        assert stranger.head("/api/health").status_code == 200
    assert client.head(f"/api/sessions/{sid}/undo").status_code == 405
    assert client.get(f"/api/sessions/{sid}").json()["revision"] == 0
