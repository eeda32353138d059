"""Labels of 36,000 frames x 20 boxes under lens distortion, beside the naive loop and OpenCV, in one run.

    python benchmarks/labels.py [--frames 36000] [--runs 5]

The naive loop is what the original tool does: every corner projected on its own, those behind the camera left out,
the rest clamped to the image. OpenCV projects all corners of a frame at once and clamps them likewise. Both are slow
and get a part of the frames; their time is scaled up, and the table says so. Errors are against the tests' oracle,
which finds each border by trying points all along it.
"""

import argparse
import importlib.util
import resource
import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path

import cv2
import numba
import numpy as np
import scene

from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.labels import NEAR, labels_of_boxes, outlines

ORACLE = Path(__file__).parents[1] / "tests" / "geometry" / "label_oracle.py"


def median_seconds(work: Callable[[], object], *, runs: int) -> float:
    seconds: list[float] = []
    for _ in range(runs):
        start = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - start)
    return statistics.median(seconds)


def row(name: str, seconds: float, *, frames: int, boxes: int, of: int, note: str = "") -> float:
    scaled = seconds * of / frames
    part = "" if frames == of else f"from {frames} frames, scaled"
    print(
        f"{name:<46} {scaled:9.3f} s {frames * boxes / seconds / 1e6:9.3f} M boxes/s   {part} {note}".rstrip(),
        flush=True,
    )
    return scaled


def naive(camera: Camera, Ts_world_camera: np.ndarray, boxes: list[Box]) -> np.ndarray:
    """(n, b, 4), NaN where no corner is in front: the original's way, in plain Python."""
    k1, k2, p1, p2, k3 = camera.distortion
    found = np.full((len(Ts_world_camera), len(boxes), 4), np.nan)
    corners = [box.corners_world for box in boxes]
    for i, T in enumerate(Ts_world_camera):
        T_camera_world = np.linalg.inv(T)
        for j, box_corners in enumerate(corners):
            us: list[float] = []
            vs: list[float] = []
            for corner in box_corners:
                X, Y, Z, _ = T_camera_world @ np.append(corner, 1.0)
                if Z <= 0:
                    continue
                x, y = X / Z, Y / Z
                r2 = x * x + y * y
                radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
                u = camera.fx * (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + camera.cx
                v = camera.fy * (y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + camera.cy
                us.append(min(max(u + 0.5, 0.0), camera.width))
                vs.append(min(max(v + 0.5, 0.0), camera.height))
            if us:
                found[i, j] = min(us), min(vs), max(us), max(vs)
    return found


def opencv(camera: Camera, Ts_world_camera: np.ndarray, boxes: list[Box]) -> np.ndarray:
    """(n, b, 4): `cv2.projectPoints` once a frame."""
    corners = np.concatenate([box.corners_world for box in boxes])
    found = np.empty((len(Ts_world_camera), len(boxes), 4))
    distortion = np.array(camera.distortion)
    for i, T in enumerate(Ts_world_camera):
        T_camera_world = np.linalg.inv(T)
        turn = cv2.Rodrigues(T_camera_world[:3, :3])[0]
        pixels = (
            cv2.projectPoints(corners, turn, T_camera_world[:3, 3], camera.K, distortion)[0].reshape(-1, 8, 2) + 0.5
        )
        pixels = np.clip(pixels, 0, [camera.width, camera.height])
        found[i, :, :2], found[i, :, 2:] = pixels.min(axis=1), pixels.max(axis=1)
    return found


def print_errors(camera: Camera, Ts_world_camera: np.ndarray, boxes: list[Box], *, samples: int) -> None:
    """Ours against the oracle, and the two others against ours."""
    spec = importlib.util.spec_from_file_location("label_oracle", ORACLE)
    assert spec is not None
    assert spec.loader is not None
    oracle = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = oracle
    spec.loader.exec_module(oracle)
    ours = labels_of_boxes(camera, Ts_world_camera, boxes)
    random = np.random.default_rng(0)
    errors: list[float] = []
    shares: list[float] = []
    missed = 0
    for _ in range(samples):
        i, j = int(random.integers(len(Ts_world_camera))), int(random.integers(len(boxes)))
        want = oracle.label(camera, Ts_world_camera[i], boxes[j], near=NEAR)
        missed += int(np.isnan(want.bbox[0]) != np.isnan(ours.bbox[i, j, 0]))
        for found, true in ((ours.bbox[i, j], want.bbox), (ours.bbox_amodal[i, j], want.bbox_amodal)):
            if np.isfinite(found).all() and np.isfinite(true).all():
                errors.append(float(np.abs(found - true).max()))
        shares.append(abs(float(ours.truncated[i, j]) - want.truncated))
    print(f"\nours against the oracle, {samples} boxes in frames drawn at random:")
    print(f"  clipped and amodal boxes off by {np.median(errors):.3f} px (median), {max(errors):.3f} px (most)")
    print(f"  truncation off by {max(shares):.4f} (most); seen by one and not by the other: {missed}")
    seen = ~np.isnan(ours.bbox[..., 0])
    cut = seen & (ours.truncated > 0)
    for name, other in (
        ("naive loop", naive(camera, Ts_world_camera[::10], boxes)),
        ("cv2.projectPoints", opencv(camera, Ts_world_camera[::10], boxes)),
    ):
        truth, here, part = ours.bbox[::10], seen[::10], cut[::10]
        off = np.abs(np.nan_to_num(other, nan=1e9) - truth).max(axis=-1)
        phantom = (other[..., 2] > other[..., 0]) & (other[..., 3] > other[..., 1])
        print(
            f"{name}: more than 1 px wrong for {np.mean(off[here] > 1):.0%} of the boxes in the image"
            f" ({np.mean(off[part] > 1):.0%} of those it cuts), up to {off[here].max():.0f} px;"
            f" a label for {np.mean(phantom[~here]):.0%} of those not in it"
        )


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--frames", type=int, default=36_000)
    arguments.add_argument("--runs", type=int, default=5)
    arguments.add_argument("--oracle-samples", type=int, default=100)
    options = arguments.parse_args()
    n, runs = options.frames, options.runs
    camera, Ts, boxes = scene.camera(), scene.poses(n), scene.boxes()
    b = len(boxes)

    start = time.perf_counter()
    seen = ~np.isnan(labels_of_boxes(camera, Ts[:1], boxes).bbox[..., 0])
    outlines(camera, Ts[:1], boxes, seen)
    print(f"first call, compiled or from the cache: {time.perf_counter() - start:.2f} s")
    threads = numba.get_num_threads()
    print(f"{n} frames x {b} boxes, {camera.width} x {camera.height}, Brown distortion; median of {runs} runs\n")
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    exact = row(
        f"exact labels, {threads} threads",
        median_seconds(lambda: labels_of_boxes(camera, Ts, boxes), runs=runs),
        frames=n,
        boxes=b,
        of=n,
    )
    after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    one = median_seconds(lambda: labels_of_boxes(camera, Ts, boxes[:1]), runs=runs)
    row(f"one box moved and labelled again, {threads} threads", one, frames=n, boxes=1, of=n)
    numba.set_num_threads(1)
    single = median_seconds(lambda: labels_of_boxes(camera, Ts, boxes), runs=runs)
    row("exact labels, 1 thread", single, frames=n, boxes=b, of=n)
    numba.set_num_threads(threads)
    seen = ~np.isnan(labels_of_boxes(camera, Ts, boxes).bbox[..., 0])
    rings = median_seconds(lambda: outlines(camera, Ts, boxes, seen), runs=runs)
    row(f"outlines of the {seen.sum()} in the image, {threads} threads", rings, frames=n, boxes=b, of=n)
    few = min(n, 2000)
    by_opencv = median_seconds(lambda: opencv(camera, Ts[:: n // few][:few], boxes), runs=3)
    by_opencv = row("cv2.projectPoints a frame, clamped (wrong)", by_opencv, frames=few, boxes=b, of=n)
    few = min(n, 100)
    by_loop = median_seconds(lambda: naive(camera, Ts[:: n // few][:few], boxes), runs=3)
    by_loop = row("naive Python loop, clamped (wrong)", by_loop, frames=few, boxes=b, of=n)
    print(
        f"\nours is {by_loop / exact:.0f} times as fast as the naive loop and {by_opencv / exact:.1f} times as OpenCV"
    )
    print(f"peak memory of the process: {before:.0f} MB before, {after:.0f} MB after the exact labels")
    print_errors(camera, Ts, boxes, samples=options.oracle_samples)


if __name__ == "__main__":
    main()
