"""Labels of 36,000 frames x 5 hulls of about 1,000 vertices under lens distortion, beside OpenCV, in one run.

    python benchmarks/hull_labels.py [--frames 36000] [--runs 5]

OpenCV projects every vertex of all hulls, frame by frame, clamped to the image; it gets a part of the frames, and its
time is scaled up. Errors are against the tests' oracle, which tries points all along the borders.
"""

import argparse
import importlib.util
import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path

import cv2
import numba
import numpy as np
import scene
import shapely
import trimesh

from ars_web.geometry.camera import Camera
from ars_web.geometry.labels import NEAR
from ars_web.geometry.mesh import Mesh
from ars_web.geometry.mesh_labels import labels_of_meshes
from ars_web.geometry.mesh_outlines import mesh_outlines
from ars_web.geometry.polygon import Polygon
from ars_web.geometry.visual_hull import View, visual_hull

ORACLE = Path(__file__).parents[1] / "tests" / "geometry" / "mesh_oracle.py"

VIEWS, CORNERS = 12, 72
"""Outlines that each hull is made of, and the corners of each: hulls then have about 1,000 vertices."""


def shapes() -> list[trimesh.Trimesh]:
    """Five objects of about 10 cm, of which one has a tunnel and one is bent."""
    bent = trimesh.creation.box((0.03, 0.08, 0.04)).union(
        trimesh.creation.box((0.10, 0.03, 0.04)).apply_translation([0.035, -0.025, 0.0])
    )
    return [
        trimesh.creation.icosphere(4, 0.05),
        trimesh.creation.box((0.10, 0.07, 0.05)),
        trimesh.creation.cylinder(0.035, 0.10, sections=64),
        trimesh.creation.torus(0.038, 0.014, major_sections=48, minor_sections=24),
        bent,
    ]


def hulls() -> list[Mesh]:
    """Visual hulls of the shapes, standing about the table, from outlines a pixel rough, as people draw them."""
    camera, random = scene.camera(), np.random.default_rng(3)
    Ts = scene.poses(36_000)
    found: list[Mesh] = []
    for shape, place in zip(shapes(), [(0, 0), (-0.2, 0.1), (0.2, 0.12), (-0.12, -0.16), (0.2, -0.12)], strict=True):
        vertices = np.array(shape.vertices) + np.array([*place, 0.05])
        mesh = Mesh(vertices, np.array(shape.faces))
        seen = np.isclose(labels_of_meshes(camera, Ts[::50], [mesh]).truncated[:, 0], 0.0)
        frames = (50 * np.flatnonzero(seen))[:: max(seen.sum() // VIEWS, 1)][:VIEWS]
        views: list[View] = []
        for frame in frames.tolist():
            ring, _ = mesh_outlines(camera, Ts[frame : frame + 1], [mesh], np.ones((1, 1), dtype=bool))
            border = shapely.Polygon(ring).buffer(1.0).exterior
            rough = shapely.get_coordinates(
                border.interpolate(np.linspace(0, 1, CORNERS, endpoint=False), normalized=True)
            )
            views.append(View(frame, camera, Ts[frame], (Polygon(rough + random.normal(size=rough.shape)),)))
        hull = visual_hull(views, widen=2.0)
        found.append(Mesh(hull.vertices, hull.faces))
    return found


def median_seconds(work: Callable[[], object], *, runs: int) -> tuple[float, float]:
    """By the clock, and of all processors together, which other programs disturb less."""
    seconds: list[tuple[float, float]] = []
    for _ in range(runs):
        start = time.perf_counter(), time.process_time()
        work()
        seconds.append((time.perf_counter() - start[0], time.process_time() - start[1]))
    return statistics.median(s for s, _ in seconds), statistics.median(s for _, s in seconds)


def row(name: str, seconds: tuple[float, float], *, frames: int, hulls: int, of: int) -> float:
    """The processors' seconds, scaled to all frames."""
    clock, busy = (s * of / frames for s in seconds)
    part = "" if frames == of else f"   from {frames} frames, scaled"
    print(f"{name:<50} {clock:8.2f} s {busy:8.2f} s busy {1e6 * busy / (of * hulls):8.1f} us a label{part}", flush=True)
    return busy


def opencv(camera: Camera, Ts_world_camera: np.ndarray, meshes: list[Mesh]) -> np.ndarray:
    """(n, b, 4): `cv2.projectPoints` of all vertices once a frame, their bounds clamped to the image."""
    vertices = np.concatenate([mesh.vertices_world for mesh in meshes])
    starts = np.cumsum([0, *(len(mesh.vertices_world) for mesh in meshes)])[:-1]
    found = np.empty((len(Ts_world_camera), len(meshes), 4))
    distortion = np.array(camera.distortion)
    for i, T in enumerate(Ts_world_camera):
        T_camera_world = np.linalg.inv(T)
        turn = cv2.Rodrigues(T_camera_world[:3, :3])[0]
        pixels = cv2.projectPoints(vertices, turn, T_camera_world[:3, 3], camera.K, distortion)[0][:, 0] + 0.5
        pixels = np.clip(pixels, 0, [camera.width, camera.height])
        found[i, :, :2] = np.minimum.reduceat(pixels, starts)
        found[i, :, 2:] = np.maximum.reduceat(pixels, starts)
    return found


def print_errors(camera: Camera, Ts_world_camera: np.ndarray, meshes: list[Mesh], *, samples: int) -> None:
    """Ours against the oracle, and OpenCV against ours."""
    spec = importlib.util.spec_from_file_location("mesh_oracle", ORACLE)
    assert spec is not None
    assert spec.loader is not None
    oracle = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = oracle
    spec.loader.exec_module(oracle)
    ours = labels_of_meshes(camera, Ts_world_camera, meshes)
    random = np.random.default_rng(0)
    errors: list[float] = []
    shares: list[float] = []
    missed = 0
    for _ in range(samples):
        i, j = int(random.integers(len(Ts_world_camera))), int(random.integers(len(meshes)))
        want = oracle.label(camera, Ts_world_camera[i], meshes[j], near=NEAR)
        missed += int(np.isnan(want.bbox[0]) != np.isnan(ours.bbox[i, j, 0]))
        for found, true in ((ours.bbox[i, j], want.bbox), (ours.bbox_amodal[i, j], want.bbox_amodal)):
            if np.isfinite(found).all() and np.isfinite(true).all():
                errors.append(float(np.abs(found - true).max()))
        shares.append(abs(float(ours.truncated[i, j]) - want.truncated))
    print(f"\nours against the oracle, {samples} hulls in frames drawn at random:")
    print(f"  clipped and amodal boxes off by {np.median(errors):.3f} px (median), {max(errors):.3f} px (most)")
    print(f"  truncation off by {max(shares):.4f} (most); seen by one and not by the other: {missed}")
    seen = ~np.isnan(ours.bbox[..., 0])
    cut = seen & (ours.truncated > 0)
    other, truth, here, part = opencv(camera, Ts_world_camera[::30], meshes), ours.bbox[::30], seen[::30], cut[::30]
    off = np.abs(other - truth).max(axis=-1)
    phantom = (other[..., 2] > other[..., 0]) & (other[..., 3] > other[..., 1])
    print(
        f"cv2.projectPoints: more than 1 px wrong for {np.mean(off[here] > 1):.0%} of the hulls in the image"
        f" ({np.mean(off[part] > 1):.0%} of those it cuts), up to {off[here].max():.0f} px;"
        f" a label for {np.mean(phantom[~here]):.0%} of those not in it"
    )


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--frames", type=int, default=36_000)
    arguments.add_argument("--runs", type=int, default=5)
    arguments.add_argument("--oracle-samples", type=int, default=20)
    options = arguments.parse_args()
    n, runs = options.frames, options.runs
    start = time.perf_counter()
    camera, Ts, meshes = scene.camera(), scene.poses(n), hulls()
    b, threads = len(meshes), numba.get_num_threads()
    seen = ~np.isnan(labels_of_meshes(camera, Ts[:1], meshes).bbox[..., 0])
    mesh_outlines(camera, Ts[:1], meshes, seen)
    print(f"hulls made, kernels compiled or from the cache: {time.perf_counter() - start:.2f} s")
    print(f"hulls of {', '.join(str(len(mesh.vertices_world)) for mesh in meshes)} vertices")
    print(f"{n} frames x {b} hulls, {camera.width} x {camera.height}, Brown distortion; median of {runs} runs\n")
    exact = median_seconds(lambda: labels_of_meshes(camera, Ts, meshes), runs=runs)
    exact = row(f"exact labels, {threads} threads", exact, frames=n, hulls=b, of=n)
    one = median_seconds(lambda: labels_of_meshes(camera, Ts, meshes[:1]), runs=runs)
    row(f"one hull moved and labelled again, {threads} threads", one, frames=n, hulls=1, of=n)
    numba.set_num_threads(1)
    single = median_seconds(lambda: labels_of_meshes(camera, Ts, meshes), runs=runs)
    row("exact labels, 1 thread", single, frames=n, hulls=b, of=n)
    numba.set_num_threads(threads)
    found = labels_of_meshes(camera, Ts, meshes)
    seen = ~np.isnan(found.bbox[..., 0])
    few = min(n, 3600)
    part = slice(None, None, n // few)
    rings = median_seconds(lambda: mesh_outlines(camera, Ts[part], meshes, seen[part]), runs=1)
    row(f"outlines of the {seen.sum()} in the image, {threads} threads", rings, frames=len(Ts[part]), hulls=b, of=n)
    few = min(n, 1000)
    by_opencv = median_seconds(lambda: opencv(camera, Ts[:: n // few][:few], meshes), runs=3)
    by_opencv = row("cv2.projectPoints a frame, clamped (wrong)", by_opencv, frames=few, hulls=b, of=n)
    cut = np.mean(seen & (found.truncated > 0))
    print(
        f"\nours is {by_opencv / exact:.1f} times as fast as OpenCV, by busy seconds; the image's border cuts {cut:.0%}"
    )
    print_errors(camera, Ts, meshes, samples=options.oracle_samples)


if __name__ == "__main__":
    main()
