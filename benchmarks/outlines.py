"""Convex outlines of 36,000 frames x 20 hulls under lens distortion, beside OpenCV and shapely, in one run.

    python benchmarks/outlines.py [--frames 36000] [--runs 3]

OpenCV projects every vertex and takes the hull of the points as they are (`cv2.projectPoints`, `cv2.convexHull`);
shapely takes the hull of our outline's points. Both get a part of the frames, and their time is scaled up. What both
answer is compared with ours, hull by hull.
"""

import argparse
import time

import cv2
import numba
import numpy as np
import scene
import shapely
from hull_labels import hulls, median_seconds, row

from ars_web.geometry import rigid_transform
from ars_web.geometry.camera import Camera
from ars_web.geometry.convex_outlines import convex_outlines, convex_outlines_of_boxes
from ars_web.geometry.labels import outlines
from ars_web.geometry.mesh import Mesh
from ars_web.geometry.mesh_labels import labels_of_meshes
from ars_web.geometry.mesh_outlines import mesh_outlines
from ars_web.geometry.minimum_rectangles import minimum_rectangles

CHUNK = 2000
"""Frames whose rings are kept at once, as an export keeps those of a shard."""

Rings = list[np.ndarray]


def twenty_hulls() -> list[Mesh]:
    """The five hulls of `hull_labels`, each in four places of the table."""
    found: list[Mesh] = []
    for i, hull in enumerate(hulls() * 4):
        turn = rigid_transform.rotation_about_z(np.pi / 2 * (i // 5))
        place = np.array([0.04 * (i // 5), -0.03 * (i // 5), 0.0])
        found.append(Mesh(hull.vertices_world @ turn.T + place, hull.faces))
    return found


def in_chunks(camera: Camera, Ts_world_camera: np.ndarray, meshes: list[Mesh], wanted: np.ndarray) -> int:
    """Convex outlines of all frames, chunk by chunk; how many there are."""
    found = 0
    for start in range(0, len(Ts_world_camera), CHUNK):
        part = slice(start, start + CHUNK)
        _, offsets = convex_outlines(camera, Ts_world_camera[part], meshes, wanted[part])
        found += int((np.diff(offsets) > 0).sum())
    return found


def by_opencv(camera: Camera, Ts_world_camera: np.ndarray, meshes: list[Mesh], wanted: np.ndarray) -> Rings:
    """Hulls of the projected vertices, cut to the image as shapely cuts them."""
    distortion, image, found = np.array(camera.distortion), shapely.box(0, 0, camera.width, camera.height), []
    for T, asked in zip(Ts_world_camera, wanted, strict=True):
        T_camera_world = np.linalg.inv(T)
        turn = cv2.Rodrigues(T_camera_world[:3, :3])[0]
        for mesh, ask in zip(meshes, asked, strict=True):
            if not ask:
                found.append(np.zeros((0, 2)))
                continue
            pixels, _ = cv2.projectPoints(mesh.vertices_world, turn, T_camera_world[:3, 3], camera.K, distortion)
            # What is behind the camera may be anywhere.
            pixels = np.clip(pixels[:, 0] + 0.5, -1e6, 1e6)
            ring = cv2.convexHull(pixels.astype(np.float32))[:, 0]
            inside = (ring >= 0).all() and (ring <= [camera.width, camera.height]).all()
            if not inside and len(ring) >= 3:
                part = shapely.Polygon(ring).intersection(image)
                ring = shapely.get_coordinates(part)[:-1] if not part.is_empty else np.zeros((0, 2))
            found.append(ring)
    return found


def by_shapely(camera: Camera, Ts_world_camera: np.ndarray, meshes: list[Mesh], wanted: np.ndarray) -> Rings:
    """Hulls of our joined outlines."""
    points, offsets = mesh_outlines(camera, Ts_world_camera, meshes, wanted)
    rings = np.split(points, offsets[1:-1])
    return [shapely.get_coordinates(shapely.MultiPoint(ring).convex_hull)[:-1] if len(ring) else ring for ring in rings]


def print_difference(name: str, ours: Rings, others: Rings, cut: np.ndarray) -> None:
    """How far two rings of one label are apart at most, over all labels and over those that the image's border cuts."""
    apart: list[float] = []
    border: list[bool] = []
    for one, other, at_border in zip(ours, others, cut.ravel(), strict=True):
        if len(one) >= 3:
            whole = len(other) >= 3
            off = shapely.hausdorff_distance(shapely.Polygon(one), shapely.Polygon(other)) if whole else np.inf
            apart.append(off)
            border.append(bool(at_border))
    off, at_border = np.array(apart), np.array(border)
    seen = off[np.isfinite(off)]
    print(
        f"{name:<36} apart {np.median(seen):6.3f} px (median), {seen.max():8.2f} px (most); more than 0.2 px"
        f" {np.mean(off[~at_border] > 0.2):6.1%} of {(~at_border).sum()} whole, {np.mean(off[at_border] > 0.2):6.1%}"
        f" of {at_border.sum()} cut; missed {np.isinf(off).sum()}"
    )


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--frames", type=int, default=36_000)
    arguments.add_argument("--runs", type=int, default=3)
    options = arguments.parse_args()
    n, runs = options.frames, options.runs
    start = time.perf_counter()
    camera, Ts, meshes, boxes = scene.camera(), scene.poses(n), twenty_hulls(), scene.boxes()
    b, threads = len(meshes), numba.get_num_threads()
    every = np.ones((n, b), dtype=bool)
    points, offsets = convex_outlines(camera, Ts[:2], meshes, every[:2])
    minimum_rectangles(points, offsets)
    for of in (convex_outlines_of_boxes, outlines):
        of(camera, Ts[:2], boxes, every[:2])
    mesh_outlines(camera, Ts[:2], meshes, every[:2])
    print(f"hulls made, kernels compiled or from the cache: {time.perf_counter() - start:.2f} s")
    print(f"hulls of {', '.join(str(len(mesh.vertices_world)) for mesh in meshes[:5])} vertices, four times each")
    seen = in_chunks(camera, Ts, meshes, every)
    print(f"{n} frames x {b} hulls, {seen} in the image, {camera.width} x {camera.height}, Brown distortion\n")

    ours = median_seconds(lambda: in_chunks(camera, Ts, meshes, every), runs=runs)
    ours = row(f"convex outlines of hulls, {threads} threads", ours, frames=n, hulls=b, of=n)
    of_boxes = median_seconds(lambda: convex_outlines_of_boxes(camera, Ts, boxes, every), runs=runs)
    row(f"convex outlines of boxes, {threads} threads", of_boxes, frames=n, hulls=b, of=n)
    of_boxes = median_seconds(lambda: outlines(camera, Ts, boxes, every), runs=runs)
    row(f"outlines of boxes, {threads} threads", of_boxes, frames=n, hulls=b, of=n)
    few = min(n, 300)
    part = slice(None, None, n // few)
    some, asked = Ts[part][:few], every[part][:few]
    points, offsets = convex_outlines(camera, some, meshes, asked)
    turned = median_seconds(lambda: minimum_rectangles(points, offsets), runs=runs)
    row("smallest rectangles round them", turned, frames=few, hulls=b, of=n)
    others: dict[str, Rings] = {}
    for name, peer in (("cv2.projectPoints, cv2.convexHull", by_opencv), ("mesh_outlines, shapely's hull", by_shapely)):
        seconds = median_seconds(
            lambda peer=peer, name=name: others.update({name: peer(camera, some, meshes, asked)}), runs=1
        )
        busy = row(name, seconds, frames=few, hulls=b, of=n)
        print(f"{'':<50} ours takes {ours / busy:.2f} of its busy seconds")
    print()
    rings, labels = np.split(points, offsets[1:-1]), labels_of_meshes(camera, some, meshes)
    for name, found in others.items():
        print_difference(name, rings, found, labels.truncated > 0)
    phantom = sum(
        len(other) >= 3 and len(one) == 0 for one, other in zip(rings, others[next(iter(others))], strict=True)
    )
    print(
        f"cv2.projectPoints sees {phantom} of {sum(len(ring) == 0 for ring in rings)} hulls that are not in the image"
    )


if __name__ == "__main__":
    main()
