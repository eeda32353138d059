"""Who can reach a scene, and what its page can be made to do, in a real browser."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest
import rich
import viser
from playwright.sync_api import Browser, Page
from viser import _messages

from ars_web.demo.truth import DemoTruth
from ars_web.recordings.recording import RecordedBox
from ars_web.recordings.registry import read_recording
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.store import SessionStore

HTML = '<img src=x onerror="window.slipped=1">'

READY = """name => {
    const viser = window.__viserMutable;
    return Boolean(viser && viser.nodeRefFromName[name] && viser.messageQueue.length === 0 && !viser.firstMessageBatch
        && window.__viserTestpoints.rendererInfo.render.frame > 2);
}"""


SOCKET = """url => new Promise(resolve => {
    const socket = new WebSocket(url, "viser-v1.1.1");
    socket.onopen = () => resolve("open");
    socket.onclose = socket.onerror = () => resolve("closed");
})"""


def wait_until(page: Page, condition: Callable[[], bool], *, seconds: float = 40.0) -> None:
    """Wait for a condition while the page's events are served."""
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "it did not come true in time"
        page.wait_for_timeout(20)


@pytest.fixture(scope="module")
def named_session(tmp_path_factory: pytest.TempPathFactory, demo_recording: DemoTruth) -> tuple[Path, str]:
    """A session with a class and a box that are called by a piece of HTML."""
    sessions = tmp_path_factory.mktemp("scene") / "sessions"
    thing = demo_recording.objects[0]
    read = replace(read_recording(demo_recording.folder, format="ars"), boxes=(RecordedBox(HTML, thing.box),))
    with SessionStore(sessions) as store:
        sid = store.create(replace(read, class_names=(HTML,)), name=HTML).id
        box = store.state(sid).boxes[1]
        SessionEditor(store).change_box(sid, 1, expected_revision=box.revision, name=HTML, author="test")
    return sessions, sid


@pytest.fixture(scope="module")
def server(served, named_session: tuple[Path, str]) -> Iterator[tuple[str, str]]:
    """The address of the session's scene, and its server's."""
    sessions, sid = named_session
    with served(sessions, "--token", "token-of-the-scene-test") as (_, login):
        base = login.partition("/login")[0]
        yield f"{base}/scene/{sid}/", base


@pytest.fixture
def page(browser: Browser, server: tuple[str, str]) -> Iterator[Page]:
    """A page that is logged in."""
    context = browser.new_context(viewport={"width": 640, "height": 400})
    assert context.request.post(f"{server[1]}/login", data={"token": "token-of-the-scene-test"}).ok
    yield context.new_page()
    context.close()


@contextmanager
def foreign_viser() -> Iterator[viser.ViserServer]:
    """Someone else's viser, which runs script in the pages that obey it."""
    rich.get_console().quiet = True
    foreign = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    foreign._websock_server.queue_message(  # pyright: ignore[reportPrivateUsage]
        _messages.RunJavascriptMessage(source="window.obeyed = 1")
    )
    foreign.scene.add_frame("/foreign")
    try:
        yield foreign
    finally:
        foreign.stop()


def told(page: Page) -> list[str]:
    """What the page says on its console, from now on."""
    said: list[str] = []
    page.on("console", lambda message: said.append(message.text))
    return said


def test_the_scene_is_seen_by_who_is_logged_in_and_runs_nothing_else(page: Page, server: tuple[str, str]) -> None:
    """The one string of code in viser that the policy stops belongs to Gaussian splats, of which we draw none."""
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    elsewhere: list[str] = []
    page.on("request", lambda request: elsewhere.append(request.url))
    page.goto(f"{server[0]}?fixedDpr=1")
    page.wait_for_function(READY, arg="/cameras/points", timeout=60_000)
    assert [error for error in errors if "Evaluating a string as JavaScript" not in error] == []
    assert [url for url in elsewhere if not url.startswith((f"{server[1]}/", "data:", "blob:"))] == []


def test_names_do_not_reach_viser(page: Page, server: tuple[str, str]) -> None:
    """The bridge writes them as text, see workspace/test_names.py; viser, which renders markup, is told of none."""
    asked = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto(f"{server[0]}?fixedDpr=1")
    page.wait_for_function(READY, arg="/boxes/1/at/edges", timeout=60_000)
    told = page.evaluate(
        "() => Object.entries(window.__viserSceneTree.getState()).map(([name, node]) => name"
        " + JSON.stringify(node?.message?.props ?? {}, (_, value) => ArrayBuffer.isView(value) ? null : value))"
    )
    assert any("/boxes/1/at/edges" in node for node in told)
    assert not any("onerror" in node for node in told)
    assert page.evaluate("window.slipped") is None
    assert [url for url in asked if url.endswith("/x")] == []


def test_script_in_the_scenes_page_does_not_run(page: Page, server: tuple[str, str]) -> None:
    """Should a name ever become HTML there."""
    page.goto(f"{server[0]}?fixedDpr=1")
    page.wait_for_function(READY, arg="/cameras/points", timeout=60_000)
    stopped = page.evaluate(
        """html => new Promise(resolve => {
            const stopped = [];
            addEventListener("securitypolicyviolation", event => {
                stopped.push(event.violatedDirective);
                if (stopped.length === 3) resolve(stopped);
            });
            const holder = document.createElement("div");
            holder.innerHTML = html;
            const script = document.createElement("script");
            script.textContent = "window.slipped = 2";
            document.body.append(holder, script);
            fetch("http://127.0.0.1:1/").catch(() => {});
        })""",
        HTML,
    )
    assert sorted(stopped) == ["connect-src", "script-src-attr", "script-src-elem"]
    assert page.evaluate("window.slipped") is None


def test_a_link_to_a_foreign_server_connects_nowhere(page: Page, server: tuple[str, str]) -> None:
    with foreign_viser() as foreign:
        address = f"ws://127.0.0.1:{foreign.get_port()}"
        said = told(page)
        page.goto(f"{server[0]}?fixedDpr=1&websocket={address}")
        wait_until(page, lambda: any(text.startswith(f"Connecting to: {address}") for text in said))
        wait_until(page, lambda: any("websocket is not connected" in text for text in said))
        assert page.evaluate(SOCKET, address) == "closed"
        assert foreign._websock_server._client_state_from_id == {}  # pyright: ignore[reportPrivateUsage]
        assert page.evaluate("window.obeyed") is None


def test_without_the_policy_it_would(browser: Browser, page: Page, server: tuple[str, str]) -> None:
    """The test above sees the difference."""
    context = browser.new_context(storage_state=page.context.storage_state(), bypass_csp=True)
    free = context.new_page()
    with foreign_viser() as foreign:
        free.goto(f"{server[0]}?fixedDpr=1&websocket=ws://127.0.0.1:{foreign.get_port()}")
        free.wait_for_function("window.obeyed === 1", timeout=60_000)
        assert foreign._websock_server._client_state_from_id != {}  # pyright: ignore[reportPrivateUsage]
        context.close()


class _Elsewhere(BaseHTTPRequestHandler):
    def do_GET(self) -> None:
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()
        self.wfile.write(b"<!doctype html><title>elsewhere</title>")

    def log_message(self, format: str, *args: object) -> None: ...  # noqa: A002


@pytest.fixture
def elsewhere() -> Iterator[str]:
    """Another origin on this machine, with which browsers share the cookie: a cookie knows no port."""
    with ThreadingHTTPServer(("127.0.0.1", 0), _Elsewhere) as other:
        thread = threading.Thread(target=other.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{other.server_port}"
        other.shutdown()
        thread.join()


def test_another_origins_page_reaches_no_scene(page: Page, server: tuple[str, str], elsewhere: str) -> None:
    address = server[0].replace("http:", "ws:").rstrip("/")
    page.goto(f"{server[1]}/static/icon.svg")
    assert page.evaluate(SOCKET, address) == "open"
    page.goto(elsewhere)
    assert page.evaluate(SOCKET, address) == "closed"
    framed = page.evaluate(
        """url => new Promise(resolve => {
            const frame = document.createElement("iframe");
            frame.onload = () => resolve(frame.contentDocument === null);
            frame.src = url;
            document.body.append(frame);
        })""",
        server[0],
    )
    assert framed
    assert all(frame.evaluate("document.getElementById('root')") is None for frame in page.frames[1:])


def test_without_the_cookie_there_is_no_scene(browser: Browser, server: tuple[str, str]) -> None:
    context = browser.new_context()
    page = context.new_page()
    answer = page.goto(server[0])
    assert answer is not None
    assert answer.status == 401
    assert page.evaluate(SOCKET, server[0].replace("http:", "ws:")) == "closed"
    context.close()
