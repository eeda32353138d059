"""The whole workspace in a real browser: a server process, its 3D scene, one or more pages."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from subprocess import Popen
from typing import Any

import httpx
import numpy as np
import pytest
from playwright.sync_api import Browser, BrowserContext, Frame, Page

from tests.browser.conftest import TOKEN

SETTLED = """() => {
    const viser = window.__viserMutable, points = window.__viserTestpoints;
    return Boolean(viser && points && viser.scene && viser.messageQueue.length === 0 && !viser.firstMessageBatch
        && points.rendererInfo.render.frame > 0);
}"""

ON_SCREEN = """([name, x, y, z]) => {
    const viser = window.__viserMutable, node = viser.nodeRefFromName[name];
    node.updateWorldMatrix(true, false);
    const at = viser.camera.position.clone().set(x, y, z).applyMatrix4(node.matrixWorld).project(viser.camera);
    const canvas = viser.canvas.getBoundingClientRect();
    return [canvas.x + (at.x + 1) / 2 * canvas.width, canvas.y + (1 - at.y) / 2 * canvas.height];
}"""

EXPECTED_COMPLAINTS = (
    "THREE.Clock",  # viser's own three.js says that it is old
    "'unsafe-eval' is not an allowed source",  # viser's splat sorter, which the page has no use for
    "GPU stall",  # drawn in software
    "preventDefault inside passive event listener",  # viser, where a mesh is dragged
    "WebSocket connection to",  # while the server is away, which some tests want
    "net::ERR_CONNECTION_REFUSED",
    "Failed to load resource",  # what the server refuses is shown in the page; Chromium says it here too
)


class Workspace:
    """One page with its scene, and the server asked directly."""

    def __init__(self, page: Page, client: httpx.Client, base: str, sid: str) -> None:
        self.page, self.client, self.base, self.sid = page, client, base, sid
        self.complaints: list[str] = []
        page.on("pageerror", lambda error: self._complain(str(error)))
        page.on("console", lambda told: self._complain(told.text) if told.type in ("error", "warning") else None)

    def _complain(self, text: str) -> None:
        if not any(part in text for part in EXPECTED_COMPLAINTS):
            self.complaints.append(text)

    def open(self, place: str = "") -> "Workspace":
        """Go to the session and wait until its scene is drawn."""
        self.page.goto(f"{self.base}/sessions/{self.sid}{place}")
        return self.settle()

    def settle(self) -> "Workspace":
        """Wait until the scene shows all that it was told."""
        self.page.locator(".stage .cover").wait_for(state="detached", timeout=60_000)
        self.scene.wait_for_function(SETTLED, timeout=60_000)
        return self

    @property
    def scene(self) -> Frame:
        """viser's page."""
        self.until(lambda: any("/scene/" in frame.url for frame in self.page.frames))
        return next(frame for frame in self.page.frames if "/scene/" in frame.url)

    def until(self, condition: Callable[[], Any], *, seconds: float = 60.0) -> None:
        """Wait for a condition; the page goes on meanwhile."""
        deadline = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < deadline, "the condition did not come about"
            self.page.wait_for_timeout(20)

    def box(self, box_id: int) -> dict[str, Any]:
        """A box, as the server has it."""
        answer = self.client.get(f"/api/sessions/{self.sid}/boxes/{box_id}")
        assert answer.status_code == 200, answer.text
        return answer.json()

    def revision(self) -> int:
        """The session's, as the server has it."""
        return self.client.get(f"/api/sessions/{self.sid}").json()["revision"]

    def saved(self, revision: int) -> None:
        """Wait until the page says that a revision is stored, and find that it is the server's."""
        self.page.get_by_text(f"Saved, revision {revision}", exact=True).wait_for(timeout=60_000)
        assert self.revision() == revision

    def enter(self, frame: int) -> None:
        """Stand at a frame's camera, and wait for its photo."""
        self.page.evaluate(
            "(frame) => import('/static/store.js').then((store) => store.actions.enterFrame(frame))", frame
        )
        self.until(
            lambda: self.page.evaluate("import('/static/store.js').then((store) => store.entered.value)") == frame
        )
        self.scene.wait_for_function("() => Boolean(window.__viserMutable.nodeRefFromName['/photo'])")
        self.settle()

    def on_screen(self, node: str, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> np.ndarray:
        """Where a point of a scene node, in its coordinates, is on the page, CSS pixels."""
        self.scene.wait_for_function("(name) => Boolean(window.__viserMutable.nodeRefFromName[name])", arg=node)
        stage = self.page.locator(".stage iframe").bounding_box()
        assert stage is not None
        seen: list[np.ndarray] = []

        def rests() -> bool:
            seen.append(np.array(self.scene.evaluate(ON_SCREEN, [node, x, y, z])))
            self.page.wait_for_timeout(150)
            return len(seen) > 2 and bool(np.ptp(seen[-3:], axis=0).max() < 0.5)

        self.until(rests)
        return seen[-1] + (stage["x"], stage["y"])

    def drag(self, start: np.ndarray, end: np.ndarray, *, steps: int = 12) -> None:
        """Press the mouse at one place and release it at another."""
        mouse = self.page.mouse
        mouse.move(*start)
        self.page.wait_for_timeout(300)  # what is under the pointer is found once it rests
        mouse.down()
        for step in range(1, steps + 1):
            mouse.move(*(start + (end - start) * step / steps))
            self.page.wait_for_timeout(30)
        self.page.wait_for_timeout(200)
        mouse.up()


@pytest.fixture
def open_workspace(at_server, browser: Browser) -> Callable[..., Any]:
    """`with open_workspace(sessions) as (process, base, page_of)`; `page_of(sid)` opens another person's page."""

    @contextmanager
    def opened(sessions: Path, *options: str) -> Iterator[tuple[Popen[str], str, Callable[..., Workspace]]]:
        pages: list[Workspace] = []
        contexts: list[BrowserContext] = []
        with at_server(sessions, *options) as (process, base):
            with httpx.Client(base_url=base, headers={"Authorization": f"Bearer {TOKEN}"}, timeout=60) as client:

                def page_of(sid: str, **context_options: Any) -> Workspace:
                    context = browser.new_context(**{"viewport": {"width": 1280, "height": 720}, **context_options})
                    context.add_init_script("localStorage.setItem('ars-web.hints-seen', '1')")
                    assert context.request.post(f"{base}/login", data={"token": TOKEN}).ok
                    contexts.append(context)
                    pages.append(Workspace(context.new_page(), client, base, sid))
                    return pages[-1]

                yield process, base, page_of
            for context in contexts:
                context.close()
        assert [complaint for page in pages for complaint in page.complaints] == []

    return opened


@pytest.fixture
def mug(boxed_session, demo_recording) -> tuple[Path, str, int]:
    """Sessions folder, session, and the mug's id, as the server counts boxes."""
    sessions, sid = boxed_session
    index = next(i for i, thing in enumerate(demo_recording.objects) if thing.class_name == "mug")
    return sessions, sid, index + 1
