"""The scene of 36,000 generated frames in a real Chromium with software WebGL, through the real server.

    python benchmarks/scene_frames.py [--frames 36000] [--seconds 6] [--executable PATH]

Prints how long it takes from the address to a scene that is all there, first with its viser server yet to be opened
and then once more, how long a frame takes to draw while the camera orbits, and what the browser's renderer holds.
"""

import argparse
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
import psutil
import scene
from playwright.sync_api import Page, sync_playwright

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

READY = """() => {
    const own = window.__viserMutable, seen = window.__viserTestpoints;
    return Boolean(own && seen && own.scene && !own.firstMessageBatch && own.messageQueue.length === 0
        && own.nodeRefFromName["/cameras/path"] && own.nodeRefFromName["/current/frustum"]
        && seen.rendererInfo.render.frame > 2);
}"""

ORBIT = """async seconds => {
    const own = window.__viserMutable, drawn = () => window.__viserTestpoints.rendererInfo.render.frame;
    const first = drawn(), begun = performance.now();
    while (performance.now() - begun < seconds * 1000) {
        own.cameraControl.rotate(0.02, 0, false);
        own.requestRender();
        await new Promise(requestAnimationFrame);
    }
    return (performance.now() - begun) / (drawn() - first);
}"""


def make_session(folder: Path, *, frames: int) -> str:
    """A session of the benchmarks' path and boxes with one image for all frames; its id."""
    camera, image = scene.camera(), folder / "image.jpg"
    noise = np.random.default_rng(1).integers(0, 255, (camera.height // 20, camera.width // 20, 3), dtype=np.uint8)
    assert cv2.imwrite(str(image), noise.repeat(20, 0).repeat(20, 1))
    recording = Recording(
        format="ars",
        source=folder,
        cameras={0: camera},
        frames=tuple(Frame(f"{i:06d}.jpg", image, 0, T) for i, T in enumerate(scene.poses(frames))),
        class_names=("thing",),
        boxes=tuple(RecordedBox("thing", box) for box in scene.boxes()),
    )
    with SessionStore(folder / "sessions") as store:
        return store.create(recording, name="benchmark").id


@contextmanager
def served(sessions: Path) -> Iterator[str]:
    """The one-time URL of a server process."""
    command = [sys.executable, "-m", "ars_web", "serve", "--sessions", str(sessions), "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            yield [process.stdout.readline() for _ in range(2)][-1].split()[-1]
        finally:
            process.terminate()


def renderer_megabytes() -> float:
    """The resident memory of the largest renderer among this process's descendants."""
    sizes = [0.0]
    for process in psutil.Process().children(recursive=True):
        try:
            if "--type=renderer" in process.cmdline():
                sizes.append(process.memory_info().rss / 2**20)
        except psutil.NoSuchProcess:
            continue
    return max(sizes)


def opened(page: Page, url: str) -> float:
    """Seconds from the address to the scene."""
    begun = time.perf_counter()
    page.goto(url)
    page.wait_for_function(READY, timeout=300_000)
    return time.perf_counter() - begun


def main() -> None:
    """Measure, and print."""
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--frames", type=int, default=36000)
    arguments.add_argument("--seconds", type=float, default=6.0)
    arguments.add_argument("--executable", default=os.environ.get("ARS_WEB_CHROMIUM") or shutil.which("chromium"))
    given = arguments.parse_args()
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        sid = make_session(Path(folder), frames=given.frames)
        with served(Path(folder) / "sessions") as login:
            browser = playwright.chromium.launch(executable_path=given.executable, args=FLAGS)
            page = browser.new_page(viewport={"width": 1280, "height": 720})
            page.goto(login)
            url = f"{login.partition('/login')[0]}/scene/{sid}/?fixedDpr=1"
            first, again = opened(page, url), opened(page, url)
            page.evaluate(ORBIT, 2.0)
            frame = statistics.median(page.evaluate(ORBIT, given.seconds / 3) for _ in range(3))
            print(f"{given.frames} frames, 20 boxes, 1280 x 720, software WebGL on {os.cpu_count()} cores")
            print(f"{'scene ready, its server opened first':<40} {first:8.2f} s")
            print(f"{'scene ready, once more':<40} {again:8.2f} s")
            print(f"{'a drawn frame while orbiting':<40} {frame:8.1f} ms")
            print(f"{'renderer, resident':<40} {renderer_megabytes():8.0f} MB")
            heap = page.evaluate("performance.memory.usedJSHeapSize") / 2**20
            print(f"{'renderer, script heap':<40} {heap:8.0f} MB")
            browser.close()


if __name__ == "__main__":
    main()
