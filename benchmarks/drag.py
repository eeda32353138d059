"""Dragging a box and entering frames in two real Chromiums through the real server: python benchmarks/drag.py

    python benchmarks/drag.py [--steps 40] [--executable PATH]

Prints, with software WebGL: how long a step of the mouse takes to be told to the dragging page (the gizmo, the server's
Python, the live line), and to move the box in the second browser; how many previews a second come of a steady drag; and
how long a frame takes from being asked for to its photo being on the screen's mesh.
"""

import argparse
import json
import os
import queue
import shutil
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from playwright.sync_api import Browser, Page, sync_playwright
from websockets.sync.client import connect
from websockets.sync.connection import Connection

from ars_web.demo.recording import make_demo
from ars_web.recordings.recording import Frame, RecordedBox, Recording
from ars_web.sessions.store import SessionStore

FLAGS = [
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
    "--disable-background-networking",
    "--no-first-run",
]

TOKEN = "token-of-the-benchmark"

FRAMES, SIZE = 12, (1280, 960)

READY = """() => {
    const own = window.__viserMutable;
    return Boolean(own && own.scene && !own.firstMessageBatch && own.messageQueue.length === 0
        && own.nodeRefFromName["/boxes/1/at"]);
}"""

# Notes when the box's place, and the photo's texture, change.
WATCH = """() => {
    window.moves = []; window.textures = [];
    let place = "", texture = "";
    setInterval(() => {
        const own = window.__viserMutable;
        const now = JSON.stringify(own.nodePoseData["/boxes/1/at"]?.position);
        if (now !== place) { place = now; window.moves.push(Date.now()); }
        let map = null;
        own.nodeRefFromName["/photo"]?.traverse((node) => (map ??= node.material?.map ?? null));
        if (map?.image && map.uuid !== texture) { texture = map.uuid; window.textures.push(Date.now()); }
    }, 2);
}"""

SCREEN = """([x, y, z]) => {
    const { camera, canvas, nodeRefFromName } = window.__viserMutable;
    const at = camera.position.clone().set(x, y, z).applyMatrix4(nodeRefFromName[""].matrixWorld).project(camera);
    return [(at.x + 1) / 2 * canvas.clientWidth, (1 - at.y) / 2 * canvas.clientHeight];
}"""


def make_session(folder: Path) -> tuple[str, np.ndarray]:
    """The generated recording with its boxes: the session's id, and where its first box is."""
    demo = make_demo(folder / "demo", frames=FRAMES, size=SIZE)
    poses = zip(demo.image_names, demo.Ts_world_camera, strict=True)
    frames = tuple(Frame(name, demo.folder / "images" / name, 0, T) for name, T in poses)
    boxes = tuple(RecordedBox(thing.class_name, thing.box) for thing in demo.objects)
    recording = Recording(
        "ars", demo.folder, {0: demo.camera}, frames, class_names=tuple(demo.class_names), boxes=boxes
    )
    say(f"{FRAMES} photos of {SIZE[0]} x {SIZE[1]}, {demo.camera.model}, {len(boxes)} boxes")
    with SessionStore(folder / "sessions") as store:
        return store.create(recording, name="benchmark").id, demo.objects[0].box.T_world_box[:3, 3]


@contextmanager
def served(folder: Path) -> Generator[str]:
    """The address of a server process."""
    command = [sys.executable, "-m", "ars_web", "serve", "--sessions", str(folder / "sessions"), "--port", "0"]
    server = subprocess.Popen([*command, "--token", TOKEN], stdout=subprocess.PIPE, text=True)
    try:
        assert server.stdout is not None
        yield [server.stdout.readline() for _ in range(2)][1].split()[-1].partition("/login")[0]
    finally:
        server.terminate()
        server.wait()


class Line:
    """A page's end of the live line."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._state: dict[str, Any] = {
            "mode": "scene", "frame": 0, "selected": None, "tool": "select", "axes": "world", "snap_length": 0,
            "snap_angle": 0, "upright": False, "hidden": [], "dark": True,
        }  # fmt: skip
        self._heard: queue.Queue[tuple[float, dict[str, Any]]] = queue.Queue()
        threading.Thread(target=self._listen, daemon=True).start()

    def show(self, **changes: Any) -> None:
        self._state |= changes
        self._connection.send(json.dumps({"type": "view", **self._state}))

    def told(self, wanted: Callable[[dict[str, Any]], bool]) -> float:
        """When a message like that came, wall clock; those before it are passed over."""
        while True:
            at, message = self._heard.get(timeout=30)
            if wanted(message):
                return at

    def drain(self, seconds: float) -> int:
        """How many drag messages have come, and come within this time."""
        count, end = 0, time.monotonic() + seconds
        while True:
            try:
                _, message = self._heard.get(timeout=max(0.0, end - time.monotonic()))
            except queue.Empty:
                return count
            count += message["type"] == "dragged" and message["phase"] == "move"

    def _listen(self) -> None:
        for raw in self._connection:
            self._heard.put((time.time(), json.loads(raw)))


def open_scene(browser: Browser, base: str, sid: str, view: str, *, size: tuple[int, int]) -> Page:
    context = browser.new_context(viewport={"width": size[0], "height": size[1]})
    assert context.request.post(f"{base}/login", data={"token": TOKEN}, headers={"Origin": base}).ok
    page = context.new_page()
    page.goto(f"{base}/scene/{sid}/{view}/?fixedDpr=1")
    page.wait_for_function(READY, timeout=120_000)
    page.evaluate(WATCH)
    return page


def since(page: Page, list_name: str, begun: float) -> float:
    """Milliseconds until the first of the noted times after `begun`."""
    handle = page.wait_for_function(f"(t) => window.{list_name}.find((at) => at >= t)", arg=begun * 1e3 - 1, polling=5)
    return float(handle.json_value()) - begun * 1e3


def figures(values: list[float]) -> str:
    ordered = sorted(values)
    return f"median {statistics.median(ordered):.0f} ms, 9 of 10 within {ordered[int(0.9 * (len(ordered) - 1))]:.0f} ms"


def drag(page: Page, other: Page, line: Line, centre: np.ndarray, *, steps: int) -> None:
    line.show(mode="scene", selected=1, tool="move", axes="world")
    page.wait_for_function("() => window.__viserMutable.nodeRefFromName['/edit/gizmo']?.parent?.visible")
    above = centre + np.array([0.0, 0.0, 0.01])
    origin, ahead = (np.array(page.evaluate(SCREEN, at.tolist())) for at in (centre, above))
    up = (ahead - origin) / np.linalg.norm(ahead - origin)
    grip = origin + up * 55
    page.mouse.move(*grip)
    page.wait_for_timeout(500)
    page.mouse.down()
    page.mouse.move(*(grip + up * 4))
    line.told(lambda m: m["type"] == "dragged" and m["phase"] == "move")
    page.wait_for_timeout(400)
    own: list[float] = []
    others: list[float] = []
    for i in range(steps):
        at = grip + up * (6 + 2 * (i % 20))
        begun = time.time()
        page.mouse.move(*at)
        own.append((line.told(lambda m: m["type"] == "dragged" and m["phase"] == "move") - begun) * 1e3)
        others.append(since(other, "moves", begun))
        page.wait_for_timeout(120)
    say(f"a step of the mouse, told to the page          {figures(own)}")
    say(f"a step of the mouse, moves the other browser's {figures(others)}")
    line.drain(0.2)
    seen = len(other.evaluate("window.moves"))
    begun = time.perf_counter()
    for i in range(150):
        page.mouse.move(*(grip + up * (5 + 30 * abs(np.sin(i / 25)))))
        page.wait_for_timeout(16)
    seconds = time.perf_counter() - begun
    previews = line.drain(0.3)
    drawn = len(other.evaluate("window.moves")) - seen
    say(f"a steady drag: previews                        {previews / seconds:.0f} a second")
    say(f"a steady drag: places in the other browser     {drawn / seconds:.0f} a second")
    begun = time.time()
    page.mouse.up()
    stored = (line.told(lambda m: m["type"] == "dragged" and m["phase"] == "end") - begun) * 1e3
    say(f"released, stored and told                      {stored:.0f} ms")


def enter(page: Page, line: Line) -> None:
    def one(frame: int) -> tuple[float, float]:
        begun = time.time()
        line.show(mode="frame", frame=frame)
        told = (line.told(lambda m: m["type"] == "entered" and m["frame"] == frame) - begun) * 1e3
        return told, since(page, "textures", begun)

    def row(name: str, times: list[tuple[float, float]]) -> None:
        told, shown = zip(*times, strict=True)
        say(f"{name:<46} told {figures(list(told))}; photo on its mesh {figures(list(shown))}")

    row("the first frame entered", [one(0)])
    page.wait_for_timeout(1000)
    following: list[tuple[float, float]] = []
    for frame in range(1, 7):
        following.append(one(frame))
        page.wait_for_timeout(600)
    row("the next frame, six times", following)
    jumps: list[tuple[float, float]] = []
    for frame in (9, 11):
        jumps.append(one(frame))
        page.wait_for_timeout(600)
    row("a jump to a frame not seen yet, twice", jumps)
    back: list[tuple[float, float]] = []
    for frame in (2, 5, 9, 1):
        back.append(one(frame))
        page.wait_for_timeout(600)
    row("a jump to a frame seen before, four times", back)


def say(line: str) -> None:
    print(line, flush=True)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=40)
    parser.add_argument("--executable", default=os.environ.get("ARS_WEB_CHROMIUM") or shutil.which("chromium"))
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as place, sync_playwright() as playwright:
        folder = Path(place)
        sid, centre = make_session(folder)
        browsers = [playwright.chromium.launch(executable_path=options.executable, args=FLAGS) for _ in range(2)]
        with served(folder) as base:
            views = ["a" * 32, "b" * 32]
            headers = {"Authorization": f"Bearer {TOKEN}"}
            address = f"{base.replace('http', 'ws', 1)}/api/sessions/{sid}/live?view={views[0]}"
            with connect(address, additional_headers=headers, proxy=None) as connection:
                line = Line(connection)
                page = open_scene(browsers[0], base, sid, views[0], size=(1000, 700))
                other = open_scene(browsers[1], base, sid, views[1], size=(500, 400))
                page.bring_to_front()
                drag(page, other, line, centre, steps=options.steps)
                enter(page, line)
        for browser in browsers:
            browser.close()
    say(f"load of this machine: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")


if __name__ == "__main__":
    main()
