"""Choosing 2,000 of 36,000 frames with 20 boxes: ours beside even spacing and a greedy choice that is not lazy.

    python benchmarks/choosing.py [--frames 36000] [--count 2000] [--near-degrees 3] [--near-frames 5]

Directions are covered objects x cells of equal area; worth is what their views add up to, 1/1 + 1/2 + ... of each. The
dense greedy choice finds by NumPy what every frame would add, for every choice anew; it is timed on 50 choices and
scaled. `from labels on` is all that an export does to choose: labels, directions, cells and the choice.
"""

import argparse
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import scene

from ars_web.datasets.coverage import session_views
from ars_web.datasets.frame_choosing import choose_frames, directions_in_frames
from ars_web.datasets.options import ExportOptions
from ars_web.geometry import selection_kernels
from ars_web.geometry.even_spacing import evenly
from ars_web.geometry.frame_selection import (
    NOTHING,
    FrameViews,
    Nearness,
    covering,
    greedily,
    tie_order,
    worth,
)
from ars_web.sessions.model import FrameTable, ObjectClass, SessionSnapshot, SessionState, VirtualBox

LOOPED = 50


def session(n: int) -> SessionSnapshot:
    boxes = {i: VirtualBox(i, 0, "", box, 1) for i, box in enumerate(scene.boxes())}
    state = SessionState(0, "bench", {0: ObjectClass(0, "thing", "#ffffff", 1)}, boxes, 1, len(boxes))
    names = tuple(f"{i:06d}.jpg" for i in range(n))
    frames = FrameTable(names, tuple(Path(name) for name in names), np.zeros(n, dtype=np.int64), scene.poses(n))
    return SessionSnapshot("s", state, {0: scene.camera()}, frames)


def views_of(snapshot: SessionSnapshot) -> FrameViews:
    found = session_views(snapshot, ExportOptions())
    centres = snapshot.frames.Ts_world_camera[:, :3, 3]
    at = np.array([box.box.T_world_box[:3, 3] for _, box in sorted(snapshot.state.boxes.items())])
    n = len(centres)
    distances = np.linalg.norm(centres[:, None] - at, axis=2)
    directions = found.directions.transpose(1, 0, 2)
    return FrameViews(directions_in_frames(found), directions, distances, np.zeros(n, dtype=np.int64), np.arange(n))


def dense(elements: np.ndarray, count: int) -> np.ndarray:
    """What `greedily` chooses, every frame looked at for every choice."""
    order = tie_order(elements)
    seen = elements[order]
    labelled, boxes = seen != NOTHING, elements.shape[1]
    counts, free, chosen = np.zeros(elements.max() + 1, dtype=np.int64), np.ones(len(order), dtype=bool), []
    for _ in range(count):
        of_label = counts[np.where(labelled, seen, 0)]
        gains = np.where(labelled, selection_kernels.WHOLE // (of_label + 1), 0).sum(axis=1)
        gains += selection_kernels.WHOLE * (boxes + 1) * (labelled & (of_label == 0)).sum(axis=1)
        row = int(np.where(free, gains, -1).argmax())
        free[row] = False
        counts[seen[row][labelled[row]]] += 1
        chosen.append(row)
    return order[np.array(chosen)]


def timed(work: Callable[[], np.ndarray]) -> tuple[float, float, np.ndarray]:
    """Wall time, processor time and the result of a second run: the first compiles."""
    work()
    began, busy = time.perf_counter(), time.process_time()
    result = work()
    return time.perf_counter() - began, time.process_time() - busy, result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=36_000)
    parser.add_argument("--count", type=int, default=2_000)
    parser.add_argument("--near-degrees", type=float, default=3.0)
    parser.add_argument("--near-frames", type=int, default=5)
    given = parser.parse_args()
    snapshot = session(given.frames)
    views = views_of(snapshot)
    near = Nearness(given.near_degrees, given.near_frames)
    choice = {"count": given.count, "near_degrees": given.near_degrees, "near_frames": given.near_frames}
    options = ExportOptions.model_validate({"frames": choice})
    rows: dict[str, tuple[float, float, np.ndarray]] = {
        "all frames": (0.0, 0.0, np.arange(given.frames)),
        "even spacing": timed(lambda: evenly(given.frames, given.count)),
        "ours": timed(lambda: covering(views, given.count)),
        "ours, no near twins": timed(lambda: covering(views, given.count, near=near)),
        "ours, from labels on": timed(lambda: choose_frames([snapshot], options)[0][0]),
    }
    print(f"{int((views.elements != NOTHING).sum())} labels of {given.frames} frames; {given.count} to choose")
    print(f"{'':22}{'frames':>8}{'directions':>12}{'worth':>12}{'wall':>10}{'busy':>10}")
    for name, (wall, busy, chosen) in rows.items():
        directions, of_views = worth(views.elements, chosen)
        utility = of_views / selection_kernels.WHOLE
        print(f"{name:22}{len(chosen):8}{directions:12}{utility:12.1f}{wall:8.3f} s{busy:8.3f} s")
    began, busy = time.perf_counter(), time.process_time()
    expected = dense(views.elements, LOOPED)
    scale = given.count / LOOPED
    wall, busy = (time.perf_counter() - began) * scale, (time.process_time() - busy) * scale
    same = (expected == greedily(views, given.count)[:LOOPED]).all()
    print(f"{'dense greedy, scaled':54}{wall:8.3f} s{busy:8.3f} s   its {LOOPED} choices are ours: {same}")


if __name__ == "__main__":
    main()
