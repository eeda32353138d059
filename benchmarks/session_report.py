"""The report of a session of 36,000 frames x 20 objects, part by part: labels and views, facts, the page.

    python benchmarks/session_report.py [--frames 36000] [--boxes 20] [--runs 1] [--hulls]

The first run of all compiles, and is not shown. There are no images: the page tells so of each of its samples, and
with images each takes some 50 ms. `cpu` is the time of all threads. With --hulls each object has a hull of 162 corners.
"""

import argparse
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import TypeVar

import numpy as np
import scene
import trimesh

from ars_web.datasets.options import ExportOptions
from ars_web.sessions.hull_mesh import HullMesh
from ars_web.sessions.model import (
    FrameTable,
    ObjectClass,
    SessionSnapshot,
    SessionState,
    SessionSummary,
    VirtualBox,
)
from ars_web.studies.report_page import session_page
from ars_web.studies.session_report import session_report
from ars_web.studies.session_study import study_session

T = TypeVar("T")


def snapshot_of(n: int, boxes: int, *, with_hulls: bool) -> SessionSnapshot:
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.5)
    hull = HullMesh(ball.vertices, ball.faces) if with_hulls else None
    names = tuple(f"{i:06d}.jpg" for i in range(n))
    classes = {i: ObjectClass(i, f"class {i}", "#e6194b", 1) for i in range(5)}
    virtual = {
        i: VirtualBox(i, i % 5, f"box {i}", box, 1, hull=hull and hull.digest)
        for i, box in enumerate(scene.boxes(boxes), start=1)
    }
    state = SessionState(1, "benchmark", classes, virtual, 5, boxes + 1)
    images = tuple(Path("/recordings/desk/images") / name for name in names)
    frames = FrameTable(names, images, np.zeros(n, dtype=np.int64), scene.poses(n))
    return SessionSnapshot("bench", state, {0: scene.camera()}, frames, {hull.digest: hull} if hull else {})


def timed(name: str, work: Callable[[], T]) -> T:
    wall, cpu = time.perf_counter(), time.process_time()
    made = work()
    print(f"{name:<40} {time.perf_counter() - wall:7.2f} s {time.process_time() - cpu:7.2f} s cpu")
    return made


def report(snapshot: SessionSnapshot, options: ExportOptions) -> None:
    now, count = datetime.now(tz=UTC), len(snapshot.frames)
    recorded = SessionSummary("bench", "benchmark", 1, "ars", "", count, 5, len(snapshot.state.boxes), 0, now, now)
    study = timed("labels, views, neighbours", lambda: study_session(snapshot, options))
    facts = timed("facts and warnings", lambda: session_report(study, recorded))
    page = timed("page", lambda: session_page(study, facts))
    print(f"{len(page.encode()) / 2**20:.2f} MiB, {len(facts.warnings)} warnings")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=36_000)
    parser.add_argument("--boxes", type=int, default=20)
    parser.add_argument("--runs", type=int, default=1)
    parser.add_argument("--hulls", action="store_true")
    arguments = parser.parse_args()
    for given in ({}, {"min_visible": 0.1}):
        options = ExportOptions.model_validate(given)
        study_session(snapshot_of(60, arguments.boxes, with_hulls=arguments.hulls), options)
        print(f"\n{arguments.frames} frames x {arguments.boxes} boxes, {given or 'no options'}")
        for _ in range(arguments.runs):
            report(snapshot_of(arguments.frames, arguments.boxes, with_hulls=arguments.hulls), options)


if __name__ == "__main__":
    main()
