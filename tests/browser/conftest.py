"""A real browser."""

import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from subprocess import Popen
from tempfile import TemporaryFile
from typing import Any

import httpx
import pytest
from playwright.sync_api import Browser, Page, Route, expect, sync_playwright

from ars_web.demo.truth import DemoTruth
from ars_web.recordings.recording import RecordedBox
from ars_web.recordings.registry import read_recording
from ars_web.sessions.store import SessionStore

FLAGS = [
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
    # Pages are put together without SwiftShader, which WebGL alone needs: a third of what a test without it takes.
    "--disable-gpu-compositing",
    "--disable-gpu-rasterization",
    "--disable-background-networking",
    "--disable-quic",
    "--no-first-run",
    "--disable-component-update",
    "--disable-sync",
]


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """The Chromium that ARS_WEB_CHROMIUM names, else the system's, else Playwright's own."""
    names = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
    system = next((path for name in names if (path := shutil.which(name))), None)
    expect.set_options(timeout=60_000)  # what must come about is waited for, however busy the machine is
    with sync_playwright() as playwright:
        launched = playwright.chromium.launch(
            executable_path=os.environ.get("ARS_WEB_CHROMIUM") or system, args=FLAGS, headless=True
        )
        yield launched
        launched.close()


TOKEN = "token-of-the-browser-test"


@dataclass(frozen=True)
class Shelf:
    """A server that many tests share, each with sessions of its own.

    Attributes:
        process: the server's; who would stop it takes a server of their own.
        sessions: the folder in which the sessions lie.
        base: the server's address.
    """

    process: Popen[str]
    sessions: Path
    base: str


@pytest.fixture(scope="session")
def shelf(served, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Shelf]:
    """The server of all tests that do nothing to theirs: to start one takes three seconds of the processor."""
    sessions = tmp_path_factory.mktemp("shelf") / "sessions"
    with TemporaryFile("w+") as log, served(sessions, "--token", TOKEN, log=log) as (process, login):
        yield Shelf(process, sessions, login.partition("/login")[0])


@pytest.fixture
def at_server(served, shelf: Shelf) -> Callable[..., AbstractContextManager[tuple[Popen[str], str]]]:
    """`with at_server(sessions, *options) as (process, base)`: a server of a folder, the shared one where that is its
    folder; it takes `TOKEN`."""

    @contextmanager
    def at(sessions: Path, *options: str) -> Iterator[tuple[Popen[str], str]]:
        if sessions == shelf.sessions and not options:
            yield shelf.process, shelf.base
        else:
            with served(sessions, "--token", TOKEN, *options) as (process, login):
                yield process, login.partition("/login")[0]

    return at


@dataclass(frozen=True)
class Workspace:
    """A session's page, and its server asked directly.

    Attributes:
        complaints: errors and warnings of the page; who expects some takes them out.
    """

    page: Page
    client: httpx.Client
    sid: str
    complaints: list[str]

    def answer(self, path: str) -> Any:
        """What the server says of the session."""
        answer = self.client.get(f"/api/sessions/{self.sid}{path}")
        assert answer.status_code == 200, answer.text
        return answer.json()


OpenFlatly = Callable[..., AbstractContextManager[Workspace]]


@pytest.fixture
def demo_in(demo_recording: DemoTruth) -> Callable[[Path], tuple[Path, str]]:
    """`demo_in(sessions)`: the folder, and the id of a session made in it: the small demo, boxed as in truth."""

    def made_in(sessions: Path) -> tuple[Path, str]:
        boxes = tuple(RecordedBox(thing.class_name, thing.box) for thing in demo_recording.objects)
        read = read_recording(demo_recording.folder, format="ars")
        with SessionStore(sessions) as store:
            made = store.create(replace(read, class_names=demo_recording.class_names, boxes=boxes), name="demo")
        return sessions, made.id

    return made_in


@pytest.fixture
def boxed_session(demo_in, shelf: Shelf) -> tuple[Path, str]:
    """The small demo's session at the shared server; who stops its server makes one with `demo_in`."""
    return demo_in(shelf.sessions)


@pytest.fixture
def open_flatly(at_server, browser: Browser) -> OpenFlatly:
    """`with open_flatly(sessions, sid, **context) as workspace`: a session's page without its 3D scene, which would
    take most of the machine where it is drawn in software. Nothing is complained about."""

    @contextmanager
    def opened(sessions: Path, sid: str, **options: Any) -> Iterator[Workspace]:
        with at_server(sessions) as (_, base):
            headers = {"Authorization": f"Bearer {TOKEN}"}
            context = browser.new_context(**{"viewport": {"width": 1280, "height": 720}, **options})
            context.route("**/scene/**", _empty)
            context.add_init_script("localStorage.setItem('ars-web.hints-seen', '1')")
            assert context.request.post(f"{base}/login", data={"token": TOKEN}).ok
            page = context.new_page()
            complaints: list[str] = []
            page.on("pageerror", lambda error: complaints.append(str(error)))
            page.on("console", lambda told: complaints.append(told.text) if told.type in ("error", "warning") else None)
            page.goto(f"{base}/sessions/{sid}")
            page.get_by_role("slider", name="Frame", exact=True).wait_for()
            with httpx.Client(base_url=base, headers=headers, timeout=60) as client:
                yield Workspace(page, client, sid, complaints)
            context.close()
        assert complaints == []

    return opened


def _empty(route: Route) -> None:
    route.fulfill(body="", content_type="text/html")
