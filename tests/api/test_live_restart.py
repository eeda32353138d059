"""A server that stops, or is killed, and comes back: pages learn of it at once and miss nothing."""

import signal
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus

from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.store import SessionStore

TOKEN = "token-of-the-restart-test"
A, B = "a" * 32, "b" * 32


@pytest.fixture
def running(tmp_path: Path, served, write_scene, live_page):
    """`with running() as (process, client, line)`: a server process on one and the same folder."""
    write_scene(tmp_path / "root" / "scene")

    @contextmanager
    def start():
        options = ["--root", f"data={tmp_path / 'root'}", "--token", TOKEN]
        with served(tmp_path / "sessions", *options) as (process, login):
            url = login.rpartition("/login")[0]
            headers = {"Authorization": f"Bearer {TOKEN}"}
            with httpx.Client(base_url=url, headers=headers, timeout=30) as client:
                yield process, client, lambda sid, view, **more: live_page.line(url, sid, view, **{**headers, **more})

    return start


def new_session(client: httpx.Client) -> str:
    return client.post("/api/sessions", json={"name": "s", "root": "data", "path": "scene"}).json()["id"]


def add_class(client: httpx.Client, sid: str, name: str) -> None:
    assert client.post(f"/api/sessions/{sid}/classes", json={"name": name}).status_code == 201


def names(page: Any, n: int) -> list[str]:
    return [page.next("edit")["edit"]["changes"][0]["after"]["name"] for _ in range(n)]


@pytest.mark.parametrize("stop", [signal.SIGINT, signal.SIGTERM])
def test_a_server_that_stops_says_so_on_every_line(running, stop: signal.Signals) -> None:
    with running() as (process, client, line):
        sid = new_session(client)
        with line(sid, A) as one, line(sid, B) as other:
            for page in (one, other):
                page.next()
            with pytest.raises(InvalidStatus, match="401"):
                line(sid, A, Authorization="Bearer wrong").__enter__()
            process.send_signal(stop)
            for page in (one, other):
                with pytest.raises(ConnectionClosed) as caught:
                    page.people(lambda people: False)
                assert caught.value.rcvd.code == 1001
        _, said = process.communicate(timeout=20)
        assert said == "", "neither a stranger nor the end is an error of the server's"


def test_a_page_comes_back_to_a_killed_server_and_misses_nothing(running, tmp_path: Path) -> None:
    with running() as (process, client, line):
        sid = new_session(client)
        with line(sid, A, after=0) as page:
            assert page.next() == {"type": "ready", "revision": 0}
            for name in ("one", "two"):
                add_class(client, sid, name)
            assert names(page, 2) == ["one", "two"]
            add_class(client, sid, "three")  # perhaps on its way when the server dies; taken for missed
            process.kill()
            assert process.wait() == -signal.SIGKILL
            with pytest.raises(ConnectionClosed) as caught:
                names(page, 2)
            assert caught.value.rcvd is None
    with SessionStore(tmp_path / "sessions") as store:
        SessionEditor(store).add_class(sid, name="four", author="cli")
    with running() as (_, client, line), line(sid, A, after=2) as page, line(sid, B, after=9) as ahead:
        assert page.next() == {"type": "ready", "revision": 4}
        assert names(page, 2) == ["three", "four"]
        assert ahead.next() == {"type": "reset", "revision": 4}
        add_class(client, sid, "five")
        assert names(page, 1) == names(ahead, 1) == ["five"]
