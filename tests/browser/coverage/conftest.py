"""Coverage mode in a real browser: one server for a module's tests, and pages with or without their 3D scene."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import httpx
import numpy as np
import pytest
from playwright.sync_api import Browser, Frame, Locator, Page

from ars_web.recordings.recording import RecordedBox
from ars_web.recordings.registry import read_recording
from ars_web.sessions.store import SessionStore

TOKEN = "token-of-the-coverage-test"

BINS = "azimuth_bins=18&polar_bins=9"

EXPECTED_COMPLAINTS = (
    "THREE.Clock",  # viser's own three.js says that it is old
    "'unsafe-eval' is not an allowed source",  # viser's splat sorter, which the page has no use for
    "GPU stall",  # drawn in software
)

SETTLED = """() => {
    const viser = window.__viserMutable, points = window.__viserTestpoints;
    return Boolean(viser && points && viser.scene && viser.messageQueue.length === 0 && !viser.firstMessageBatch
        && points.rendererInfo.render.frame > 0);
}"""


@dataclass(frozen=True)
class Server:
    """A server with a boxed session, `sid`, and one without a box."""

    base: str
    client: httpx.Client
    sid: str
    empty: str


@dataclass(frozen=True)
class CoveragePage:
    """A session's page in Coverage mode, and its server asked directly."""

    page: Page
    server: Server
    sid: str
    complaints: list[str] = field(default_factory=list)

    def answer(self, path: str) -> Any:
        """What the server says of the session."""
        answer = self.server.client.get(f"/api/sessions/{self.sid}{path}")
        assert answer.status_code == 200, answer.text
        return answer.json()

    def coverage(self, of: str, *, bins: str = BINS) -> Any:
        """The server's counts of `box_id=…` or `class_id=…`."""
        return self.answer(f"/coverage?{of}&{bins}")

    @property
    def bins(self) -> Locator:
        """Of the heat map."""
        return self.page.get_by_role("gridcell")

    def bin(self, index: int) -> Locator:
        """One of them, by the place in which the API has it."""
        return self.page.locator(f'.bin[data-index="{index}"]')

    def counts(self) -> list[int]:
        """What the map shows, in the API's order, once it is of the newest state."""
        self.page.locator('.heat-map[data-stale="false"]').wait_for()
        read = "all => all.map(one => [Number(one.dataset.index), Number(one.dataset.count)])"
        return [count for _, count in sorted(self.bins.evaluate_all(read))]

    def until(self, condition: Callable[[], Any], *, tries: int = 1000) -> None:
        """Wait for a condition; the page goes on meanwhile."""
        for _ in range(tries):
            if condition():
                return
            self.page.wait_for_timeout(20)
        raise AssertionError("the condition did not come about")

    def in_store(self, what: str) -> Any:
        """What the page knows or shows, by an expression of `store`."""
        return self.page.evaluate(f"async () => {{ const store = await import('/static/store.js'); return {what}; }}")

    @property
    def scene(self) -> Frame:
        """viser's page."""
        return next(frame for frame in self.page.frames if "/scene/" in frame.url)

    def node(self, name: str, what: str) -> Any:
        """Evaluate `what` of a scene's `node`, once that is there."""
        self.scene.wait_for_function("(name) => Boolean(window.__viserMutable?.nodeRefFromName[name])", arg=name)
        return self.scene.evaluate(
            f"(name) => {{ const node = window.__viserMutable.nodeRefFromName[name]; return {what}; }}", name
        )

    def look_closer(self) -> None:
        """Turn the free camera to the selected object, and wait until it rests."""
        place = "window.__viserMutable.camera.position.toArray()"
        seen = [self.node("/coverage", place)]
        self.page.get_by_role("button", name="Look closer").click()

        def rests() -> bool:
            self.page.wait_for_timeout(150)
            seen.append(self.node("/coverage", place))
            return seen[-1] != seen[0] and seen[-1] == seen[-2] == seen[-3]

        self.until(rests)

    def on_screen(self, node: str, point: np.ndarray) -> tuple[float, float]:
        """Where a point of a scene's node, in its coordinates, is on the page, CSS pixels."""
        return tuple(
            self.node(
                node,
                f"""(() => {{
                    const viser = window.__viserMutable;
                    node.updateWorldMatrix(true, false);
                    const at = viser.camera.position.clone().set({", ".join(str(float(v)) for v in point)})
                        .applyMatrix4(node.matrixWorld).project(viser.camera);
                    const {{ x, y, width, height }} = viser.canvas.getBoundingClientRect();
                    const stage = frameElement.getBoundingClientRect();
                    return [stage.x + x + (at.x + 1) / 2 * width, stage.y + y + (1 - at.y) / 2 * height];
                }})()""",
            )
        )


@pytest.fixture(scope="module")
def server(served, demo_recording, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    boxes = tuple(RecordedBox(thing.class_name, thing.box) for thing in demo_recording.objects)
    recording = replace(read_recording(demo_recording.folder, format="ars"), class_names=demo_recording.class_names)
    sessions = tmp_path_factory.mktemp("coverage") / "sessions"
    with SessionStore(sessions) as store:
        sid, empty = (store.create(replace(recording, boxes=some), name="demo").id for some in (boxes, ()))
    with served(sessions, "--token", TOKEN) as (_, login):
        base = login.partition("/login")[0]
        with httpx.Client(base_url=base, headers={"Authorization": f"Bearer {TOKEN}"}, timeout=60) as client:
            yield Server(base, client, sid, empty)


OpenCoverage = Callable[..., AbstractContextManager[CoveragePage]]


@pytest.fixture
def open_coverage(server: Server, browser: Browser) -> OpenCoverage:
    """`with open_coverage(place="#mode=coverage", scene=False) as page`; nothing may be complained about."""

    @contextmanager
    def opened(
        place: str = "#mode=coverage&box=8", *, scene: bool = False, empty: bool = False
    ) -> Iterator[CoveragePage]:
        context = browser.new_context(viewport={"width": 1280, "height": 720})
        if not scene:
            context.route("**/scene/**", lambda route: route.fulfill(body="", content_type="text/html"))
        context.add_init_script("localStorage.setItem('ars-web.hints-seen', '1')")
        assert context.request.post(f"{server.base}/login", data={"token": TOKEN}).ok
        page = CoveragePage(context.new_page(), server, server.empty if empty else server.sid)

        def complain(text: str) -> None:
            if not any(part in text for part in EXPECTED_COMPLAINTS):
                page.complaints.append(text)

        page.page.on("pageerror", lambda error: complain(str(error)))
        page.page.on("console", lambda told: complain(told.text) if told.type in ("error", "warning") else None)
        page.page.goto(f"{server.base}/sessions/{page.sid}{place}")
        page.page.get_by_role("slider", name="Frame", exact=True).wait_for()
        if scene:
            page.page.locator(".stage .cover").wait_for(state="detached", timeout=60_000)
            page.scene.wait_for_function(SETTLED, timeout=60_000)
        yield page
        context.close()
        assert page.complaints == []

    return opened
