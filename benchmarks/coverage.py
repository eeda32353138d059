"""Viewpoint histograms of 36,000 frames and 20 boxes: 720,000 views by direction, beside NumPy and a plain loop.

    python benchmarks/coverage.py [--frames 36000] [--runs 5]

Ours finds the bins of equal angles and the cells of equal area at once. The peers do the paper's histogram alone:
NumPy's `histogram2d`, and a loop over frames and boxes, timed on 300 frames and scaled.
"""

import argparse
import time
from collections.abc import Callable

import numpy as np
import scene

from ars_web.datasets.coverage import SessionViews, coverage_of
from ars_web.geometry import rigid_transform
from ars_web.geometry.sphere_bins import SphereBins
from ars_web.geometry.symmetry import NO_SYMMETRY
from ars_web.geometry.view_directions import view_directions

BINS = SphereBins()
LOOPED = 300


def ours(centres: np.ndarray, boxes: list, counted: np.ndarray) -> np.ndarray:
    directions = np.stack([view_directions(centres, box) for box in boxes])
    ids = tuple(range(len(boxes)))
    views = SessionViews(ids, ids, (NO_SYMMETRY,) * len(ids), directions, counted)
    return coverage_of(views, BINS, ids).counts


def by_numpy(centres: np.ndarray, boxes: list, counted: np.ndarray) -> np.ndarray:
    total = np.zeros((BINS.azimuth, BINS.polar))
    for box, seen in zip(boxes, counted, strict=True):
        x, y, z = ((centres[seen] - box.T_world_box[:3, 3]) @ box.T_world_box[:3, :3]).T
        polar = np.arccos(z / np.sqrt(x * x + y * y + z * z))
        total += np.histogram2d(np.arctan2(y, x), polar, bins=(BINS.azimuth_edges, BINS.polar_edges))[0]
    return total


def by_loop(centres: np.ndarray, boxes: list, counted: np.ndarray) -> np.ndarray:
    total = np.zeros((BINS.azimuth, BINS.polar))
    for box, seen in zip(boxes, counted, strict=True):
        T_box_world = rigid_transform.invert(box.T_world_box)
        for centre in centres[seen]:
            x, y, z, _ = T_box_world @ np.append(centre, 1.0)
            azimuth = int((np.arctan2(y, x) + np.pi) / (2 * np.pi) * BINS.azimuth)
            polar = int(np.arccos(z / np.sqrt(x * x + y * y + z * z)) / np.pi * BINS.polar)
            total[min(azimuth, BINS.azimuth - 1), min(polar, BINS.polar - 1)] += 1
    return total


def seconds(work: Callable[[], np.ndarray], runs: int) -> tuple[float, float, np.ndarray]:
    """The best wall time of some runs, its processor time, and the result."""
    best, busy, result = np.inf, np.inf, work()
    for _ in range(runs):
        began, began_busy = time.perf_counter(), time.process_time()
        result = work()
        best, busy = min(best, time.perf_counter() - began), min(busy, time.process_time() - began_busy)
    return best, busy, result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=36_000)
    parser.add_argument("--runs", type=int, default=5)
    given = parser.parse_args()
    boxes = scene.boxes()
    centres = np.ascontiguousarray(scene.poses(given.frames)[:, :3, 3])
    counted = np.ones((len(boxes), len(centres)), dtype=bool)
    print(f"{counted.sum()} views")
    wall, busy, found = seconds(lambda: ours(centres, boxes, counted), given.runs)
    print(f"ours, equal angles and equal area   {wall:7.3f} s  {busy:7.3f} s busy")
    wall, busy, expected = seconds(lambda: by_numpy(centres, boxes, counted), given.runs)
    print(f"NumPy's histogram2d, equal angles   {wall:7.3f} s  {busy:7.3f} s busy")
    few = centres[:: max(1, len(centres) // LOOPED)]
    wall, busy, _ = seconds(lambda: by_loop(few, boxes, np.ones((len(boxes), len(few)), dtype=bool)), 1)
    scale = len(centres) / len(few)
    print(f"plain loop, scaled                  {wall * scale:7.3f} s  {busy * scale:7.3f} s busy")
    print(f"views in another bin than NumPy's: {int(np.abs(found - expected).sum() / 2)}")


if __name__ == "__main__":
    main()
