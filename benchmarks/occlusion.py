"""Visible fractions of 36,000 frames x 20 boxes beside polygons painted from the nearest on by shapely, in one run.

    python benchmarks/occlusion.py [--frames 36000] [--runs 3]

The painter takes each box as its convex outline and its centre's distance as its depth, and subtracts the outlines
of all nearer boxes. It gets a part of the frames; its time is scaled up, and the table says so. Errors are against
rays through every pixel.
"""

import argparse
import statistics
import time
from collections.abc import Callable

import numba
import numpy as np
import scene
import shapely

from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.labels import labels_of_boxes, outlines
from ars_web.geometry.occlusion import visible_fractions


def median_seconds(work: Callable[[], object], *, runs: int) -> float:
    seconds: list[float] = []
    for _ in range(runs):
        start = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - start)
    return statistics.median(seconds)


def painter(camera: Camera, Ts_world_camera: np.ndarray, boxes: list[Box], bbox: np.ndarray) -> np.ndarray:
    """(n, b) by subtracting outlines in the order of the centres' distances; exact outlines, and so kind to it."""
    n, b = bbox.shape[:2]
    seen = ~np.isnan(bbox[..., 0])
    points, offsets = outlines(camera, Ts_world_camera, boxes, seen)
    visible = np.full((n, b), np.nan)
    centres = np.array([box.T_world_box[:3, 3] for box in boxes])
    for i in range(n):
        distance = np.linalg.norm(centres - Ts_world_camera[i, :3, 3], axis=1)
        nearer: list[shapely.Geometry] = []
        for j in np.argsort(distance):
            ring = points[offsets[i * b + j] : offsets[i * b + j + 1]]
            if len(ring) < 3:
                continue
            polygon = shapely.make_valid(shapely.Polygon(ring))
            hiding = [other for other in nearer if shapely.intersects(other, polygon)]
            left = shapely.difference(polygon, shapely.union_all(hiding)) if hiding else polygon
            visible[i, j] = shapely.area(left) / shapely.area(polygon)
            nearer.append(polygon)
    return visible


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--frames", type=int, default=36_000)
    arguments.add_argument("--runs", type=int, default=3)
    options = arguments.parse_args()
    n = options.frames
    camera, Ts, boxes = scene.camera(), scene.poses(n), scene.boxes()
    bbox = labels_of_boxes(camera, Ts, boxes).bbox
    visible_fractions(camera, Ts[:1], boxes, bbox[:1])
    threads = numba.get_num_threads()
    print(f"{n} frames x {len(boxes)} boxes, {camera.width} x {camera.height}; median of {options.runs} runs\n")
    ours = median_seconds(lambda: visible_fractions(camera, Ts, boxes, bbox), runs=options.runs)
    print(f"rays against slabs, a ray every 8 px, {threads} threads   {ours:9.2f} s", flush=True)
    some = slice(None, None, max(n // 200, 1))
    Ts_some, bbox_some = Ts[some], bbox[some]
    by_shapely = median_seconds(lambda: painter(camera, Ts_some, boxes, bbox_some), runs=1) * n / len(Ts_some)
    print(f"shapely, painter's order {by_shapely:33.2f} s   from {len(Ts_some)} frames, scaled, one run")
    print(f"ours is {by_shapely / ours:.0f} times as fast\n")

    truth = visible_fractions(camera, Ts_some, boxes, bbox_some, step=1)
    area = (bbox_some[..., 2] - bbox_some[..., 0]) * (bbox_some[..., 3] - bbox_some[..., 1])
    counted = area > 400
    print(f"against a ray a pixel, {counted.sum()} boxes of more than 400 square pixels:")
    for name, found in (
        ("rays every 8 px", visible_fractions(camera, Ts_some, boxes, bbox_some)),
        ("painter's order", painter(camera, Ts_some, boxes, bbox_some)),
    ):
        off = np.abs(found - truth)[counted]
        print(
            f"  {name}: off by {off.mean():.4f} on average, {np.quantile(off, 0.99):.3f} at the 99th percentile;"
            f" by more than 0.1 for {np.mean(off > 0.1):.1%}"
        )


if __name__ == "__main__":
    main()
