"""The memory that exports take at 36,000 and 360,000 frames x 20 boxes, beside each other.

    python benchmarks/memory.py [--frames 36000 360000] [--formats yolo coco voc] [--folder DIR]

Labels alone, without images: with images, each worker holds one at a time besides. Each export runs in a process of
its own with two workers. `session` is the coordinator before the export: the program and the session's frames; `peak`
is its most; `worker` is the most that one of its workers took. What grows with the frames is the session and the plan
(names, poses), in the coordinator alone; all else is bounded by a shard. Linux only: /proc tells each process's most.
"""

import argparse
import json
import re
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import psutil
import scene

from ars_web.datasets.jobs import plan_export, run_export
from ars_web.datasets.options import ExportOptions
from ars_web.sessions.model import FrameTable, ObjectClass, SessionSnapshot, SessionState, VirtualBox

BOXES = 20
MIB = 2**20


def snapshot_of(n: int) -> SessionSnapshot:
    camera = scene.camera()
    names = tuple(f"{i:06d}.jpg" for i in range(n))
    classes = {i: ObjectClass(i, f"class {i}", "#e6194b", 1) for i in range(5)}
    virtual = {i: VirtualBox(i, i % 5, f"box {i}", box, 1) for i, box in enumerate(scene.boxes(BOXES), start=1)}
    state = SessionState(1, "benchmark", classes, virtual, 5, BOXES + 1)
    images = tuple(Path("/recordings/desk/images") / name for name in names)
    frames = FrameTable(names, images, np.zeros(n, dtype=np.int64), scene.poses(n))
    return SessionSnapshot("bench", state, {0: camera}, frames)


def peak(process: int | str = "self") -> float:
    """The most memory that a process had so far, in MiB; 0 where it is gone.

    getrusage tells of a child no less than its parent had when it was started.
    """
    try:
        status = Path(f"/proc/{process}/status").read_text()
    except (FileNotFoundError, ProcessLookupError):
        return 0.0
    found = re.search(r"VmHWM:\s+(\d+) kB", status)
    return int(found[1]) * 1024 / MIB if found else 0.0


@contextmanager
def watching_workers() -> Iterator[list[float]]:
    """The most that any process below this one takes within the block, in MiB, as the list's only entry."""
    most, ended = [0.0], threading.Event()
    own = psutil.Process()

    def watch() -> None:
        while not ended.wait(0.1):
            most[0] = max([*most, *(peak(child.pid) for child in own.children(recursive=True))])

    watcher = threading.Thread(target=watch)
    watcher.start()
    try:
        yield most
    finally:
        ended.set()
        watcher.join()


def one(kind: str, n: int, folder: Path) -> dict[str, float]:
    snapshot = snapshot_of(n)
    session = peak()
    plan = plan_export([snapshot], format=kind, options=ExportOptions.model_validate({"images": "none"}), out=folder)
    start = time.perf_counter()
    with watching_workers() as worker:
        report = run_export(plan, workers=2)
    return {
        "seconds": time.perf_counter() - start,
        "labels": sum(split.labels for split in report.splits.values()),
        "shards": len(plan.shards),
        "session": session,
        "peak": peak(),
        "worker": worker[0],
    }


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--frames", type=int, nargs="+", default=[36_000, 360_000])
    parser.add_argument("--formats", nargs="+", default=["yolo", "coco", "voc"])
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--one", nargs=2, metavar=("FORMAT", "DIR"), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one:
        kind, folder = arguments.one
        print(json.dumps(one(kind, arguments.frames[0], Path(folder))))
        return
    print(f"{BOXES} boxes, two workers; MiB\n")
    titles = ("frames", "labels", "shards", "session", "peak", "worker", "time")
    widths = (8, 10, 7, 8, 8, 8, 9)
    print(f"{'format':<10}", *(title.rjust(width) for title, width in zip(titles, widths, strict=True)))
    for kind in arguments.formats:
        for n in arguments.frames:
            with tempfile.TemporaryDirectory(dir=arguments.folder) as folder:
                line = [sys.executable, __file__, "--frames", str(n), "--one", kind, f"{folder}/set"]
                done = json.loads(subprocess.run(line, check=True, stdout=subprocess.PIPE, text=True).stdout)
            print(
                f"{kind:<10} {n:>8} {done['labels']:>10} {done['shards']:>7} {done['session']:>8.0f}"
                f" {done['peak']:>8.0f} {done['worker']:>8.0f} {done['seconds']:>7.1f} s",
                flush=True,
            )


if __name__ == "__main__":
    main()
