"""The server as a process: how it starts, what it prints, how it ends."""

import asyncio
import signal
import socket
import stat
import subprocess
import sys
from pathlib import Path

import httpx
import pytest

from ars_web.app import create_app, listening, serve, sessions_token, static_folder
from ars_web.errors import BadInput, StoreError
from ars_web.settings import Settings

TOKEN = "token-of-the-app-test"


def test_the_page_is_found() -> None:
    assert (static_folder() / "index.html").is_file()


def test_making_the_app_touches_nothing(tmp_path: Path) -> None:
    create_app(Settings(sessions=tmp_path / "sessions"))
    assert not (tmp_path / "sessions").exists()


def test_a_server_prints_a_url_that_logs_in(served, tmp_path: Path) -> None:
    with served(tmp_path / "sessions") as (_, login), httpx.Client(follow_redirects=True) as browser:
        base = login.partition("/login")[0]
        assert base.startswith("http://127.0.0.1:")
        assert browser.get(f"{base}/api/sessions").status_code == 401
        assert browser.get(login).status_code == 200
        assert browser.get(f"{base}/api/sessions").json() == []
        assert httpx.get(login).status_code == 403
        token = (tmp_path / "sessions" / ".token").read_text().strip()
        bearer = {"Authorization": f"Bearer {token}"}
        assert httpx.get(f"{base}/api/sessions", headers=bearer).json() == []
        assert stat.S_IMODE((tmp_path / "sessions" / ".token").stat().st_mode) == 0o600


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_server_that_is_stopped_ends_its_streams_and_goes(
    served, demo_recording, tmp_path: Path, number: signal.Signals
) -> None:
    options = ["--token", TOKEN, "--root", f"demo={demo_recording.folder}"]
    with served(tmp_path / "sessions", *options) as (process, login):
        headers = {"Authorization": f"Bearer {TOKEN}"}
        with httpx.Client(base_url=login.partition("/login")[0], headers=headers, timeout=60) as client:
            made = client.post("/api/sessions", json={"name": "demo", "root": "demo", "path": ""})
            with client.stream("GET", f"{made.headers['location']}/events") as stream:
                lines = stream.iter_lines()
                assert next(lines) == "id: 0"
                process.send_signal(number)
                assert not [line for line in lines if line.startswith("event: edit")]
        _, errors = process.communicate(timeout=60)
    assert errors == ""  # no trace, and no stream that had to be cut off


def test_a_port_in_use_is_said_so(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(BadInput, match=rf"127\.0\.0\.1:{port}"):
            serve(Settings(sessions=tmp_path, port=port))


def test_small_answers_are_sent_at_once() -> None:
    """asyncio turns Nagle's algorithm off on accepted sockets only where the listening one says it is TCP."""
    with listening("127.0.0.1", 0) as listener, socket.create_connection(listener.getsockname()):
        accepted, _ = listener.accept()
        with accepted:
            assert accepted.proto == socket.IPPROTO_TCP


def test_a_token_that_others_can_read_stops_the_server(tmp_path: Path) -> None:
    (tmp_path / ".token").write_text("known\n")
    (tmp_path / ".token").chmod(0o644)
    with pytest.raises(StoreError, match="chmod 600"):
        sessions_token(Settings(sessions=tmp_path))
    command = [sys.executable, "-m", "ars_web", "serve", "--sessions", str(tmp_path), "--port", "0"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, cwd=Path(__file__).parents[1])
    assert (done.returncode, done.stdout) == (1, "")
    assert "chmod 600" in done.stderr
    assert "Traceback" not in done.stderr


def test_the_servers_own_machine_is_the_default() -> None:
    assert Settings(sessions=Path()).host == "127.0.0.1"


@pytest.mark.parametrize("executor", ["tcp://host:8786", "tls://host", "tls://a b:1", "remote", "", "tls://host:1/x"])
def test_only_a_dask_scheduler_with_tls_is_taken(executor: str) -> None:
    with pytest.raises(ValueError, match="executor"):
        Settings(sessions=Path(), executor=executor)


def test_a_server_without_dask_does_not_start_for_a_scheduler(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    app = create_app(Settings(sessions=tmp_path, executor="tls://host:8786"))

    async def start() -> None:
        async with app.router.lifespan_context(app):
            pass

    with pytest.raises(BadInput, match="distributed"):
        asyncio.run(start())


def test_a_root_that_is_no_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="not a folder"):
        Settings(sessions=tmp_path, roots={"data": tmp_path / "nothing"})
    with pytest.raises(ValueError, match="roots"):
        Settings(sessions=tmp_path, roots={"../x": tmp_path})
