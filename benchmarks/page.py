"""The workspace page in a real Chromium with software WebGL, through a real server: how soon, and how large.

    python benchmarks/page.py [--frames 36000] [--runs 2] [--executable PATH]

Prints for each run how long the page takes to open on the demo and on a long recording, from the start of navigation to
a scene that is all there and a film strip full of pictures; what the browser holds then; how long it takes to enter a
frame, from the click's handler to its photo drawn as the texture of the plane behind the boxes; and how long a drag and
an edit take to a second browser. All is drawn by the processor's cores: how many seconds of them an opening took, those
of browser and server together, says what it would take where nothing else runs.
"""

import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Generator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import psutil
from playwright.sync_api import Browser, BrowserContext, Frame, Page, Playwright, WebSocket, sync_playwright
from scene_frames import FLAGS, make_session

from ars_web.demo.recording import make_demo
from ars_web.demo.truth import DemoTruth
from ars_web.geometry.camera import Camera
from ars_web.recordings.recording import RecordedBox
from ars_web.recordings.registry import read_recording
from ars_web.sessions.store import SessionStore

TOKEN = "token-of-the-benchmark"
ENTERED = 20
MOVES = 40
EDITS = 20
GRIP = 50
"""CSS pixels from the gizmo's middle to where its arrow is taken."""

OPENED = """() => {
    const scene = document.querySelector('.stage iframe')?.contentWindow;
    const own = scene?.__viserMutable, seen = scene?.__viserTestpoints;
    const strip = document.querySelector('[aria-label="Film strip"]');
    if (!own || !seen || !strip) return null;
    const { left, right } = strip.getBoundingClientRect();
    const inSight = [...strip.querySelectorAll('.slot')].filter((slot) => {
        const at = slot.getBoundingClientRect();
        return at.right > left && at.left < right;
    });
    const filled = inSight.length > 3 && inSight.every((slot) => slot.querySelector('img')?.naturalWidth > 0);
    const ready = own.scene && !own.firstMessageBatch && own.messageQueue.length === 0
        && own.nodeRefFromName['/cameras/path'] && own.nodeRefFromName['/current/frustum']
        && seen.rendererInfo.render.frame > 2 && document.querySelector('.stage .cover') === null;
    const times = (window.benchmark ??= { scene: null, strip: null });
    if (filled) times.strip ??= performance.now();
    if (ready) times.scene ??= performance.now();
    return times.scene !== null && times.strip !== null && times;
}"""

ENTER = """async (index) => {
    const store = await import('/static/store.js');
    const scene = document.querySelector('.stage iframe').contentWindow;
    const photo = () => {
        let map = null;
        scene.__viserMutable.nodeRefFromName['/photo']?.traverse((node) => (map = node.material?.map ?? map));
        return map;
    };
    const drawn = () => scene.__viserTestpoints.rendererInfo.render.frame;
    const until = async (met) => { while (!met()) await new Promise(requestAnimationFrame); };
    const before = photo(), begun = performance.now();
    store.actions.enterFrame(index);
    await until(() => photo() !== null && photo() !== before);
    const frame = drawn();
    await until(() => drawn() > frame);
    return performance.now() - begun;
}"""

WATCH_NODE = """(name) => {
    window.seen = [];
    let last = '';
    const look = () => {
        const now = window.__viserMutable.nodeRefFromName[name]?.position.toArray().join();
        if (now !== last) window.seen.push(performance.timeOrigin + performance.now());
        last = now;
        requestAnimationFrame(look);
    };
    look();
}"""

WATCH_MOUSE = """() => {
    window.moved = [];
    addEventListener('pointermove', (event) => window.moved.push(performance.timeOrigin + event.timeStamp), true);
}"""

WATCH_NUMBER = """() => {
    window.seen = [];
    let last = '';
    const look = () => {
        const now = document.querySelector('[role="spinbutton"][aria-label="Size X"]')?.value;
        if (now !== last) window.seen.push(performance.timeOrigin + performance.now());
        last = now;
        requestAnimationFrame(look);
    };
    look();
}"""

ON_SCREEN = """([name, x]) => {
    const viser = window.__viserMutable, node = viser.nodeRefFromName[name];
    node.updateWorldMatrix(true, false);
    const at = viser.camera.position.clone().set(x, 0, 0).applyMatrix4(node.matrixWorld).project(viser.camera);
    const canvas = viser.canvas.getBoundingClientRect();
    return [canvas.x + (at.x + 1) / 2 * canvas.width, canvas.y + (1 - at.y) / 2 * canvas.height];
}"""


def row(what: str, told: str) -> None:
    print(f"  {what:<60} {told}", flush=True)


def milliseconds(times: list[float], *, high: str) -> str:
    found = max(times) if high == "max" else statistics.quantiles(times, n=10)[-1]
    return f"{statistics.median(times):7.0f} ms median {found:7.0f} ms {high}, of {len(times)}"


@contextmanager
def server(sessions: Path) -> Generator[str]:
    """The address of a server process."""
    options = ["--sessions", str(sessions), "--token", TOKEN, "--port", "0"]
    with subprocess.Popen([sys.executable, "-m", "ars_web", "serve", *options], stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        try:
            yield [process.stdout.readline() for _ in range(2)][-1].split()[-1].decode().partition("/login")[0]
        finally:
            process.terminate()


@contextmanager
def chromium(playwright: Playwright, executable: str | None) -> Generator[Browser]:
    launched = playwright.chromium.launch(executable_path=executable, args=[*FLAGS, "--enable-precise-memory-info"])
    yield launched
    launched.close()


def context_of(browser: Browser, base: str) -> BrowserContext:
    """One person's browser, logged in."""
    context = browser.new_context(viewport={"width": 1280, "height": 720})
    context.add_init_script("localStorage.setItem('ars-web.hints-seen', '1')")
    assert context.request.post(f"{base}/login", data={"token": TOKEN}).ok
    return context


def opened(page: Page, url: str) -> str:
    """Seconds from the start of navigation to the scene and to the filled strip, in words."""
    page.goto("about:blank")
    before = processor_seconds()
    page.goto(url)
    times = page.wait_for_function(OPENED, timeout=300_000).json_value()
    busy, whole = processor_seconds() - before, max(times.values()) / 1e3
    return f"{whole:7.2f} s (scene {times['scene'] / 1e3:.2f}, strip {times['strip'] / 1e3:.2f}; processor {busy:.1f})"


def processor_seconds() -> float:
    """What browser and server have used of the processor."""
    found = 0.0
    for process in psutil.Process().children(recursive=True):
        with suppress(psutil.NoSuchProcess):
            times = process.cpu_times()
            found += times.user + times.system
    return found


def scene_of(page: Page) -> Frame:
    return next(frame for frame in page.frames if "/scene/" in frame.url)


def renderers() -> list[psutil.Process]:
    """The browser's processes that hold pages."""
    found: list[psutil.Process] = []
    for process in psutil.Process().children(recursive=True):
        with suppress(psutil.NoSuchProcess):
            if "--type=renderer" in process.cmdline():
                found.append(process)
    return found


def print_memory(page: Page) -> None:
    processes = renderers()
    resident = sum(process.memory_info().rss for process in processes) / 2**20
    own = sum(process.memory_full_info().uss for process in processes) / 2**20
    heap = page.evaluate("performance.memory.usedJSHeapSize") / 2**20
    row(f"{len(processes)} renderer processes, resident (not shared)", f"{resident:7.0f} MB ({own:.0f} MB)")
    row("script heap of the page and its scene", f"{heap:7.0f} MB")


def measure_opening(playwright: Playwright, executable: str | None, base: str, sid: str, what: str) -> None:
    """Each opening in a browser of its own: the first also opens the session's scene on the server."""
    for which in ("first time, its scene opened too", "in another browser"):
        with chromium(playwright, executable) as browser:
            page = context_of(browser, base).new_page()
            row(f"{what}, {which}", opened(page, f"{base}/sessions/{sid}"))
            row(f"{what}, reloaded", opened(page, f"{base}/sessions/{sid}"))
            print_memory(page)


def measure_entering(page: Page, frames: int, heard: list[dict[str, Any]]) -> tuple[list[float], list[float]]:
    """Into frames that are not next to one entered before, which would have been made ready: all of it, and what of
    that the server told to be its part."""
    step = max(3, frames // (ENTERED + 2))
    page.evaluate(ENTER, 0)
    found: list[float] = []
    heard.clear()
    for i in range(1, ENTERED + 1):
        found.append(page.evaluate(ENTER, i * step % frames))
        page.wait_for_timeout(300)
    return found, [message["milliseconds"] for message in heard if message["type"] == "entered"]


def hear(page: Page) -> list[dict[str, Any]]:
    """What the server tells the page over its line, from now on."""
    heard: list[dict[str, Any]] = []

    def listen(line: WebSocket) -> None:
        if "/live?" in line.url:
            line.on("framereceived", lambda payload: heard.append(json.loads(payload)))

    page.on("websocket", listen)
    return heard


def resting(scene: Frame, node: str, x: float) -> np.ndarray:
    """Where a point of a node is on the canvas, CSS pixels, once it stays there."""
    before = np.full(2, np.nan)
    while not np.allclose(now := np.array(scene.evaluate(ON_SCREEN, [node, x])), before, atol=0.5):
        before = now
        scene.page.wait_for_timeout(400)
    return now


def measure_drag(mover: Page, watcher: Page, box_id: int) -> list[float]:
    """From a move of one person's mouse to the box's place in the other's scene."""
    mover.keyboard.press("g")
    ours, theirs = scene_of(mover), scene_of(watcher)
    ours.wait_for_function("() => window.__viserMutable.nodeRefFromName['/edit/gizmo']?.parent?.visible")
    stage = mover.locator(".stage iframe").bounding_box()
    assert stage is not None
    corner = np.array([stage["x"], stage["y"]])
    middle, tip = (resting(ours, "/edit/gizmo", x) + corner for x in (0.0, 0.05))
    along = (tip - middle) / np.linalg.norm(tip - middle)
    ours.evaluate(WATCH_MOUSE)
    theirs.evaluate(WATCH_NODE, f"/boxes/{box_id}/at")
    mover.mouse.move(*(middle + along * GRIP))
    mover.wait_for_timeout(500)
    mover.mouse.down()
    mover.mouse.move(*(middle + along * (GRIP + 1)))
    mover.locator(".readout").wait_for()
    mover.wait_for_timeout(500)
    found: list[float] = []
    for i in range(MOVES):
        theirs.evaluate("() => (window.seen.length = 0)")
        ours.evaluate("() => (window.moved.length = 0)")
        mover.mouse.move(*(middle + along * (GRIP + 3 + 2 * i)))
        seen = theirs.wait_for_function("() => window.seen[0]", timeout=20_000).json_value()
        found.append(seen - ours.evaluate("() => window.moved[0]"))
        mover.wait_for_timeout(60)
    mover.mouse.up()
    mover.locator(".readout").wait_for(state="detached")  # it is stored
    return found


def measure_edits(watcher: Page, client: httpx.Client, sid: str, box_id: int) -> list[float]:
    """From before a PATCH to the number on a page."""
    watcher.evaluate(WATCH_NUMBER)
    path, found = f"/api/sessions/{sid}/boxes/{box_id}", []
    for i in range(EDITS):
        box = client.get(path).json()
        watcher.wait_for_timeout(100)
        watcher.evaluate("() => (window.seen.length = 0)")
        begun = time.time() * 1e3
        changes: dict[str, Any] = {"size": [0.05 + i / 1000, *box["size"][1:]]}
        answer = client.patch(path, json=changes, headers={"If-Match": f'"{box["revision"]}"'})
        assert answer.status_code == 200, answer.text
        found.append(watcher.wait_for_function("() => window.seen[0]", timeout=20_000).json_value() - begun)
    return found


def make_sessions(folder: Path, demo: DemoTruth, *, frames: int) -> dict[str, str]:
    """The demo, its images as of a lens without distortion, and a long recording; ids by what they are."""
    read = read_recording(demo.folder, format="ars")
    boxes = tuple(RecordedBox(thing.class_name, thing.box) for thing in demo.objects)
    bent = replace(read, class_names=demo.class_names, boxes=boxes)
    straight = {key: Camera(c.width, c.height, c.fx, c.fy, c.cx, c.cy) for key, c in read.cameras.items()}
    with SessionStore(folder / "sessions") as store:
        made = {
            "demo": store.create(bent, name="demo").id,
            "straight": store.create(replace(bent, cameras=straight), name="without distortion").id,
        }
    return {**made, "long": make_session(folder, frames=frames)}


def measure(playwright: Playwright, executable: str | None, base: str, ids: dict[str, str], demo: DemoTruth) -> None:
    """All of it once, printed."""
    frame = len(demo.image_names) // 2
    box_id = int(demo.px_visible[frame].argmax()) + 1  # the largest in this frame; the server counts from 1
    for which, what in (("demo", "the demo"), ("long", "the long recording")):
        measure_opening(playwright, executable, base, ids[which], f"open {what}")
    with chromium(playwright, executable) as browser:
        for which, what in (("straight", "photo without distortion"), ("demo", "photo with distortion, rectified")):
            page = context_of(browser, base).new_page()
            heard = hear(page)
            opened(page, f"{base}/sessions/{ids[which]}")
            whole, server_part = measure_entering(page, len(demo.image_names), heard)
            row(f"enter a frame, {what}", milliseconds(whole, high="max"))
            row("  of which the server", milliseconds(server_part, high="max"))
            page.context.close()
    # Two people have two computers: one Chromium would draw both scenes in one process, one after the other.
    with chromium(playwright, executable) as one, chromium(playwright, executable) as other:
        mover, watcher = (context_of(browser, base).new_page() for browser in (one, other))
        for page in (watcher, mover):
            opened(page, f"{base}/sessions/{ids['demo']}#box={box_id}&frame=0")
        mover.evaluate(ENTER, frame)
        times = measure_drag(mover, watcher, box_id)
        row("mouse move to the second browser's scene, one by one", milliseconds(times, high="p90"))
        headers = {"Authorization": f"Bearer {TOKEN}"}
        with httpx.Client(base_url=base, headers=headers, timeout=60) as client:
            times = measure_edits(watcher, client, ids["demo"], box_id)
        row("PATCH to the number on a second page, two open", milliseconds(times, high="p90"))


def main() -> None:
    """Measure, and print."""
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--frames", type=int, default=36000)
    arguments.add_argument("--runs", type=int, default=2)
    arguments.add_argument("--executable", default=os.environ.get("ARS_WEB_CHROMIUM") or shutil.which("chromium"))
    given = arguments.parse_args()
    with tempfile.TemporaryDirectory() as place, sync_playwright() as playwright:
        demo = make_demo(Path(place) / "demo")
        for run in range(given.runs):
            folder = Path(place) / str(run)
            folder.mkdir()
            ids = make_sessions(folder, demo, frames=given.frames)
            load = " ".join(f"{each:.1f}" for each in os.getloadavg())
            print(
                f"run {run + 1}: 1280 x 720, software WebGL on {os.cpu_count()} cores, load average {load}", flush=True
            )
            with server(folder / "sessions") as base:
                measure(playwright, given.executable, base, ids, demo)
        print(f"load average at the end {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
