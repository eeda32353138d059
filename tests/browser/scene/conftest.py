"""viser's own page with our bridge in it, in an iframe of a page that listens, and the Python side of that browser."""

import json
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rich
import viser
from playwright.sync_api import Browser, BrowserContext, Frame, Page

STATIC = Path(__file__).parents[3] / "static" / "scene"

HOST = """<!doctype html><style>html, body { margin: 0; height: 100% } iframe { border: 0; width: 100%; height: 100% }
</style><script>window.told = []; addEventListener("message", (event) => told.push(event.data));</script>
<iframe src="/?fixedDpr=RATIO"></iframe>"""

READY = """() => {
    const viser = window.__viserMutable;
    return viser && viser.messageQueue.length === 0 && !viser.firstMessageBatch
        && window.__viserTestpoints.rendererInfo.render.frame > 0;
}"""


def wait_until(condition: Callable[[], Any], *, page: Page | None = None, seconds: float = 60.0) -> None:
    """Wait for a condition; with a `page`, its events are served meanwhile."""
    deadline, pause = time.monotonic() + seconds, threading.Event()
    while not condition():
        assert time.monotonic() < deadline, "the condition did not come about"
        if page is None:
            pause.wait(0.01)
        else:
            page.wait_for_timeout(10)


class ScenePage:
    """A browser's page round a viser server's scene.

    Attributes:
        page: the page, of which the iframe is all.
        scene: the iframe, with viser and the bridge.
        client: viser's handle of it.
    """

    def __init__(self, context: BrowserContext, server: viser.ViserServer, *, ratio: int) -> None:
        self.page: Page = context.new_page()
        self.complaints: list[str] = []
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("console", lambda said: self.complaints.append(said.text) if said.type == "error" else None)
        base = f"http://127.0.0.1:{server.get_port()}"
        host = HOST.replace("RATIO", str(ratio))
        self.page.route("**/host", lambda route: route.fulfill(body=host, content_type="text/html"))
        # Before any script of the frame's own, as the server's page has it.
        bridge = (STATIC / "bridge.js").read_text()
        self.page.add_init_script(f'if (location.pathname === "/") {{ {bridge} }}')
        before = set(server.get_clients())
        self.page.goto(f"{base}/host")
        self.page.wait_for_function("told.some((message) => message.ars === 'ready')", timeout=60_000)
        self.scene: Frame = self.page.frames[1]
        self.scene.add_style_tag(content=(STATIC / "bridge.css").read_text())
        self.scene.wait_for_function(READY, timeout=60_000)
        wait_until(lambda: set(server.get_clients()) - before, page=self.page)
        self.client: viser.ClientHandle = server.get_clients()[max(set(server.get_clients()) - before)]

    def tell_bridge(self, **message: Any) -> None:
        """What the page round the scene tells the bridge; returns when it has been heard and drawn."""
        self.page.evaluate(
            "(message) => document.querySelector('iframe').contentWindow.postMessage(message, location.origin)",
            {"ars": "view", **message},
        )
        self.settle()

    def told(self, kind: str) -> list[dict[str, Any]]:
        """What the bridge has told the page."""
        return [message for message in self.page.evaluate("told") if message.get("ars") == kind]

    def settle(self) -> None:
        """Wait until all that viser has sent is drawn."""
        self.client.flush()
        # A message that is still on its way is answered before the one that asks for this round trip.
        self.scene.wait_for_function("() => window.__viserMutable.messageQueue.length === 0")
        drawn = """() => {
            window.__viserMutable.requestRender();
            return window.__viserTestpoints.rendererInfo.render.frame;
        }"""
        frame = self.scene.evaluate(drawn)
        self.scene.wait_for_function(
            "(frame) => window.__viserTestpoints.rendererInfo.render.frame > frame + 2", arg=frame
        )

    def node(self, name: str, what: str) -> Any:
        """An attribute of a scene node's three.js object, as JSON; None where there is no such node."""
        return self.scene.evaluate(
            "([name, what]) => { const node = window.__viserMutable.nodeRefFromName[name];"
            " return node === undefined ? null : what.split('.').reduce((part, key) => part[key], node); }",
            [name, what],
        )

    def pose(self, name: str) -> tuple[list[float], list[float]] | None:
        """Position and wxyz of a node as the browser has them; None: it has no such node."""
        found = self.scene.evaluate("(name) => window.__viserMutable.nodePoseData[name] ?? null", name)
        return None if found is None else (found["position"], found["wxyz"])

    def camera_place(self) -> list[float]:
        """Where the browser's camera is and how it is turned."""
        return self.scene.evaluate(
            "() => { const { camera } = window.__viserMutable;"
            " return [...camera.position.toArray(), ...camera.quaternion.toArray()]; }"
        )

    def look(self, eye: Any, at: Any) -> None:
        """Put the free camera somewhere, and wait until it is there."""
        before = self.camera_place()
        with self.client.atomic():
            self.client.camera.position = np.array(eye, dtype=float)
            self.client.camera.look_at = np.array(at, dtype=float)
        self.client.flush()
        wait_until(lambda: self.camera_place() != before, page=self.page)
        self.settle()

    def drag(self, start: tuple[float, float], end: tuple[float, float], *, steps: int = 8) -> None:
        """Press at one place of the screen, move to another in steps, and hold."""
        mouse = self.page.mouse
        mouse.move(*start)
        self.settle()  # what the pointer is over is known once it has been drawn
        mouse.down()
        for i in range(1, steps + 1):
            mouse.move(*(a + (b - a) * i / steps for a, b in zip(start, end, strict=True)))
            self.page.wait_for_timeout(30)

    def screen_of(self, point_world: Any) -> tuple[float, float]:
        """Where a point of the world is on the screen, CSS pixels, as the browser's camera sees it."""
        x, y = self.scene.evaluate(
            """(point) => {
                const { camera, canvas, nodeRefFromName } = window.__viserMutable;
                const root = nodeRefFromName[""];
                root.updateWorldMatrix(true, false);
                const at = camera.position.clone().set(...point).applyMatrix4(root.matrixWorld).project(camera);
                return [(at.x + 1) / 2 * canvas.clientWidth, (1 - at.y) / 2 * canvas.clientHeight];
            }""",
            [float(v) for v in point_world],
        )
        return x, y


@pytest.fixture
def viser_server() -> Iterator[viser.ViserServer]:
    """A plain viser server on a free port."""
    rich.get_console().quiet = True
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    server.scene.world_axes.visible = False
    server.gui.configure_theme(show_logo=False, show_share_button=False)
    yield server
    server.stop()


@pytest.fixture
def scene_page(browser: Browser, viser_server: viser.ViserServer) -> Iterator[Callable[..., ScenePage]]:
    """Makes a page round the scene; at the end none may have complained."""
    opened: list[tuple[BrowserContext, ScenePage]] = []

    def make(width: int = 1000, height: int = 700, *, ratio: int = 1) -> ScenePage:
        context = browser.new_context(viewport={"width": width, "height": height}, device_scale_factor=ratio)
        page = ScenePage(context, viser_server, ratio=ratio)
        opened.append((context, page))
        return page

    yield make
    for context, page in opened:
        context.close()
        assert page.complaints == [], json.dumps(page.complaints)


@pytest.fixture
def until() -> Callable[..., None]:
    return wait_until
