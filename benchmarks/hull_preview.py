"""How long a hull preview takes, which a page asks for again and again while outlines are drawn, over HTTP.

    python benchmarks/hull_preview.py [--times 20]

The outlines are the silhouettes of ellipsoids in the boxes of the generated recording, as a person draws them: to half
a pixel. Each row is one object, outlined in so many frames and shown in so many panes. The clock runs on the client, so
that the server's reading and writing of JSON are in it; on a busy machine the server's own seconds say more.
"""

import argparse
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import psutil
import trimesh

from ars_web.demo.recording import make_demo
from ars_web.demo.truth import DemoTruth
from ars_web.geometry.mask_regions import polygons_of
from ars_web.geometry.mesh_silhouette import silhouette
from ars_web.geometry.rigid_transform import transform_points

TOKEN = "token-of-the-benchmark"
FRAMES = 60
WIDTHS = (6, 6, 9, 11, 10, 8, 10, 7)
GOAL = 150.0
"""Milliseconds, for two views in two panes."""


@contextmanager
def server(folder: Path) -> Iterator[tuple[psutil.Process, httpx.Client]]:
    """A server process that may import from the folder, and a client of it."""
    options = ["--sessions", str(folder / "sessions"), "--root", f"data={folder}", "--token", TOKEN, "--port", "0"]
    line = [sys.executable, "-m", "ars_web", "serve", *options]
    process = subprocess.Popen(line, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        url = next(word for word in process.stdout.readline().split() if word.startswith("http://"))
        headers = {"Authorization": f"Bearer {TOKEN}"}
        with httpx.Client(base_url=url.rstrip("/"), headers=headers, timeout=60) as client:
            yield psutil.Process(process.pid), client
    finally:
        process.terminate()
        process.wait()


def outlines(truth: DemoTruth, index: int) -> dict[int, list[dict[str, Any]]]:
    """By frame, the outline of an object that is wholly in the image."""
    box = truth.objects[index].box
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.5)
    vertices = transform_points(box.T_world_box, np.asarray(ball.vertices) * box.size)
    found: dict[int, list[dict[str, Any]]] = {}
    for frame, T_world_camera in enumerate(truth.Ts_world_camera):
        x0, y0, x1, y1 = truth.bbox_amodal[frame, index]
        if x0 >= 0 and y0 >= 0 and x1 <= truth.camera.width and y1 <= truth.camera.height:
            region = silhouette(truth.camera, T_world_camera, vertices, np.asarray(ball.faces))
            rings = polygons_of(region, tolerance=0.5)
            found[frame] = [{"outer": ring.outer.round(2).tolist()} for ring in rings]
    return found


def main() -> None:
    """Print the table."""
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--times", type=int, default=20)
    times = arguments.parse_args().times
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        truth = make_demo(folder / "demo", frames=FRAMES, size=(480, 360))
        drawn = max((outlines(truth, index) for index in range(len(truth.objects))), key=len)
        frames = sorted(drawn)
        with server(folder) as (process, client):
            body = {"name": "demo", "root": "data", "path": "demo"}
            path = f"/api/sessions/{client.post('/api/sessions', json=body).json()['id']}/hull-preview"
            titles = ("views", "panes", "corners", "median ms", "worst ms", "cpu ms", "overlays", "kB")
            print("".join(f"{title:>{width}}" for title, width in zip(titles, WIDTHS, strict=True)))
            for views in (1, 2, 4, 8, 16):
                chosen = [frames[i] for i in np.linspace(0, len(frames) * (1 - 1 / views), views).astype(int)]
                for panes in (2, 4):
                    others = [frame for frame in frames if frame not in chosen]
                    show_in = [*chosen[:2], *others[:: len(others) // 4]][:panes]
                    wish = {"views": [{"frame": f, "polygons": drawn[f]} for f in chosen], "show_in": show_in}
                    took: list[float] = []
                    for i in range(times + 1):
                        if i == 1:
                            before = process.cpu_times()
                        begin = time.perf_counter()
                        answer = client.post(path, json=wish)
                        took.append(1e3 * (time.perf_counter() - begin))
                    answer.raise_for_status()
                    used = process.cpu_times()
                    cpu = 1e3 * (used.user - before.user + used.system - before.system) / times
                    corners = sum(len(ring["outer"]) for f in chosen for ring in drawn[f]) // views
                    median, worst = statistics.median(took[1:]), max(took[1:])
                    row = f"{views:>6}{panes:>6}{corners:>9}{median:>11.1f}{worst:>10.1f}{cpu:>8.1f}"
                    goal = f"   goal {GOAL:.0f} ms" if (views, panes) == (2, 2) else ""
                    print(
                        f"{row}{len(answer.json()['overlays']):>10}{len(answer.content) / 1e3:>7.1f}{goal}", flush=True
                    )


if __name__ == "__main__":
    main()
