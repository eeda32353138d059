"""What the page waits for: thumbnails, telling frames, previews of labels, points: python benchmarks/page_pictures.py

    python benchmarks/page_pictures.py [--frames 36000] [--thumbnails 100]

A server process on loopback answers; a client with six connections asks, as a browser would. The recording's images are
made of the generated recording's nine, over and over, so that each is a file of its own.
"""

import argparse
import os
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import cv2
import httpx
import numpy as np
import scene

from ars_web.demo.recording import make_demo
from ars_web.demo.truth import DemoTruth
from ars_web.geometry import box_sensitivity as sensitivity
from ars_web.geometry import camera as cameras
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.triangulation import Observation, triangulate
from ars_web.recordings.recording import Frame, RecordedBox, Recording
from ars_web.sessions.store import SessionStore

CONNECTIONS = 6
"""Of a browser to one host."""


def row(name: str, seconds: float, note: str = "") -> None:
    print(f"{name:<58} {seconds * 1e3:9.2f} ms   {note}".rstrip(), flush=True)


def median_seconds(work: Callable[[], object], *, runs: int) -> float:
    seconds: list[float] = []
    for _ in range(runs):
        start = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - start)
    return statistics.median(seconds)


def recording(place: Path, demo: DemoTruth, frames: int) -> Recording:
    """The demo's images over and over, each a file, with the poses that belong to them."""
    (place / "images").mkdir(parents=True)
    found: list[Frame] = []
    for i in range(frames):
        source = i % len(demo.image_names)
        target = place / "images" / f"{i:05d}.jpg"
        shutil.copyfile(demo.folder / "images" / demo.image_names[source], target)
        found.append(Frame(target.name, target, 0, demo.Ts_world_camera[source]))
    boxes = tuple(RecordedBox(thing.class_name, thing.box) for thing in demo.objects)
    return Recording("ars", place, {0: demo.camera}, tuple(found), class_names=demo.class_names, boxes=boxes)


def long_recording(place: Path, frames: int) -> Recording:
    """The benchmarks' scene; its images need not be there."""
    found = tuple(Frame(f"{i:05d}.jpg", place / f"{i:05d}.jpg", 0, T) for i, T in enumerate(scene.poses(frames)))
    boxes = tuple(RecordedBox("thing", box) for box in scene.boxes())
    return Recording("ars", place, {0: scene.camera()}, found, class_names=("thing",), boxes=boxes)


def thumbnails(client: httpx.Client, sid: str, count: int) -> None:
    def one(frame: int, headers: dict[str, str]) -> httpx.Response:
        answer = client.get(f"/api/sessions/{sid}/frames/{frame}/image?width=160", headers=headers)
        assert answer.status_code in (200, 304), answer.text
        return answer

    def all_of_them(headers: list[dict[str, str]]) -> list[httpx.Response]:
        with ThreadPoolExecutor(CONNECTIONS) as pool:
            return list(pool.map(one, range(count), headers))

    nothing: list[dict[str, str]] = [{}] * count
    start = time.perf_counter()
    answers = all_of_them(nothing)
    row(f"{count} thumbnails, decoded", time.perf_counter() - start, f"{len(answers[0].content)} bytes each")
    row(f"{count} thumbnails, from memory", median_seconds(lambda: all_of_them(nothing), runs=5))
    known = [{"If-None-Match": answer.headers["etag"]} for answer in answers]
    row(f"{count} thumbnails that the browser has, asked about", median_seconds(lambda: all_of_them(known), runs=5))
    again = median_seconds(lambda: [client.get("/api/health") for _ in range(count)], runs=5)
    row(f"{count} answers that do nothing, one after the other", again, "what HTTP alone costs")


def previews(client: httpx.Client, sid: str) -> None:
    box = client.get(f"/api/sessions/{sid}/boxes").json()[0]
    views = client.get(f"/api/sessions/{sid}/boxes/{box['id']}/telling-frames?count=6").json()
    body = {
        "boxes": [{"T_world_box": box["T_world_box"], "size": box["size"]}],
        "frames": [view["frame"] for view in views],
    }
    answer = client.post(f"/api/sessions/{sid}/labels", json=body)
    assert len(answer.json()) == 6
    seconds = median_seconds(lambda: client.post(f"/api/sessions/{sid}/labels", json=body), runs=100)
    row("labels-preview, one box in six frames", seconds, f"{len(answer.content)} bytes")

    def crops() -> None:
        for view in views:
            crop = ",".join(map(str, view["crop"]))
            got = client.get(f"/api/sessions/{sid}/frames/{view['frame']}/image", params={"crop": crop, "width": 192})
            assert got.status_code == 200

    start = time.perf_counter()
    crops()
    row("six crops of 192 px, decoded, one after the other", time.perf_counter() - start)
    row("six crops of 192 px, from memory", median_seconds(crops, runs=5))


def telling(client: httpx.Client, sid: str, frames: int) -> None:
    boxes = client.get(f"/api/sessions/{sid}/boxes").json()
    seconds: list[float] = []
    for box in boxes:
        start = time.perf_counter()
        answer = client.get(f"/api/sessions/{sid}/boxes/{box['id']}/telling-frames")
        seconds.append(time.perf_counter() - start)
        assert len(answer.json()) == 6
    note = f"first {seconds[0] * 1e3:.0f}, most {max(seconds[1:]) * 1e3:.0f}, {len(boxes)} boxes"
    row(f"telling frames of a box in {frames}", statistics.median(seconds[1:]), note)
    path = f"/api/sessions/{sid}/boxes/{boxes[0]['id']}/telling-frames"
    row("the same again, kept", median_seconds(lambda: client.get(path), runs=20))


def told(frames: int) -> None:
    """How much more the chosen six tell than six evenly spaced ones."""
    camera, Ts = scene.camera(), scene.poses(frames)
    gains: list[float] = []
    for box in scene.boxes():
        chosen = sensitivity.telling_frames({0: camera}, np.zeros(frames, dtype=np.int64), Ts, box, count=6)
        rows = [one.frame for one in chosen]
        slopes = sensitivity.corner_slopes(camera, Ts, box)
        shown = np.flatnonzero(slopes.seen.any(axis=1))
        even = shown[np.linspace(0, len(shown) - 1, 6).astype(int)]
        gains.append(spread(slopes, box, even) / spread(slopes, box, np.array(rows)))
    print(
        f"  an error that could hide in six evenly spaced frames that show the box is {statistics.median(gains):.1f}"
        f" times (median of {len(gains)} boxes; {min(gains):.1f} to {max(gains):.1f}) what could hide in these"
    )


def spread(slopes: sensitivity.CornerSlopes, box: Box, rows: np.ndarray) -> float:
    """The geometric mean of the axes of the ellipsoid of errors that frames leave open."""
    some = sensitivity.CornerSlopes(slopes.seen[rows], slopes.by_place[rows])
    known = sensitivity.prior(box) + sensitivity.information(some, box).sum(axis=0)
    return float(np.exp(-np.linalg.slogdet(known)[1] / 2 / sensitivity.PARAMETERS))


def points(*, samples: int = 500) -> None:
    """Two places off by a pixel at random, in frames of the benchmarks' scene."""
    camera, random = scene.camera(), np.random.default_rng(0)
    Ts = scene.poses(36_000)
    errors: dict[str, list[float]] = {"ours": [], "cv2": []}
    spent = {"ours": 0.0, "cv2": 0.0}
    while len(errors["ours"]) < samples:
        point = random.uniform([-0.3, -0.3, 0.0], [0.3, 0.3, 0.2])
        pair = random.integers(len(Ts), size=2)
        at = rigid_transform.transform_points(rigid_transform.invert(Ts[pair]), point[None])[:, 0]
        pixels = cameras.pixels_from_camera_points(camera, at) + random.normal(size=(2, 2))
        if not cameras.in_image(camera, pixels).all():
            continue
        images = cameras.image_from_pixels(pixels)
        start = time.perf_counter()
        seen = [Observation(int(i), camera, Ts[i], image) for i, image in zip(pair, images, strict=True)]
        if np.linalg.norm(np.subtract(*Ts[pair, :3, 3])) < 0.1:
            continue
        ours = triangulate(seen).point_world
        spent["ours"] += time.perf_counter() - start
        start = time.perf_counter()
        flat = cv2.undistortPoints(pixels[:, None], camera.K, np.array(camera.distortion))[:, 0]
        X = cv2.triangulatePoints(*rigid_transform.invert(Ts[pair])[:, :3], flat[0], flat[1])[:, 0]
        spent["cv2"] += time.perf_counter() - start
        errors["ours"].append(float(np.linalg.norm(ours - point)))
        errors["cv2"].append(float(np.linalg.norm(X[:3] / X[3] - point)))
    for name, label in (("ours", "a point from two frames"), ("cv2", "cv2.undistortPoints and cv2.triangulatePoints")):
        off = np.array(errors[name]) * 1e3
        note = f"off by {np.median(off):.2f} mm (median), {np.sqrt(np.mean(off**2)):.2f} mm (root mean square)"
        row(label, spent[name] / samples, note)


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--frames", type=int, default=36_000)
    arguments.add_argument("--thumbnails", type=int, default=100)
    options = arguments.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        place, token = Path(folder), "benchmark" * 5
        demo = make_demo(place / "demo", frames=9, size=(1280, 960))
        with SessionStore(place / "sessions") as store:
            short = store.create(recording(place / "short", demo, options.thumbnails), name="short").id
            long = store.create(long_recording(place, options.frames), name="long").id
        line = [sys.executable, "-m", "ars_web", "serve", "--sessions", str(place / "sessions"), "--port", "0"]
        environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[1])}
        server = subprocess.Popen([*line, "--token", token], stdout=subprocess.PIPE, text=True, env=environment)
        try:
            assert server.stdout is not None
            found = re.search(r"http://\S+", server.stdout.readline())
            assert found is not None
            limits = httpx.Limits(max_connections=CONNECTIONS, max_keepalive_connections=CONNECTIONS)
            headers = {"Authorization": f"Bearer {token}"}
            with httpx.Client(base_url=found[0], headers=headers, limits=limits, timeout=60) as client:
                busy = f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}"
                print(f"images of {demo.camera.width} x {demo.camera.height}; {busy}")
                thumbnails(client, short, options.thumbnails)
                previews(client, short)
                telling(client, long, options.frames)
        finally:
            server.terminate()
            server.wait()
    told(options.frames)
    points()


if __name__ == "__main__":
    main()
