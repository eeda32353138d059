"""Visible shares of 36,000 frames x 20 shapes, boxes and hulls, beside polygons painted by shapely, in one run.

    python benchmarks/visibility.py [--frames 36000] [--runs 3]

Hulls are made of twelve rough outlines and have about 1,000 vertices each. They stand on the table as things do, apart
from each other; and once more as `scene.boxes` has them, reaching into each other, where only depths tell what is
nearer. The painter takes each hull's exact outline, and its centre's distance as its depth. It gets a part of the
frames; its time is scaled up. Errors are against a ray a pixel.
"""

import argparse

import hull_labels
import numba
import numpy as np
import scene
import shapely
from hull_labels import median_seconds, row

from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.instance_masks import instance_masks
from ars_web.geometry.mesh import Mesh
from ars_web.geometry.mesh_labels import labels_of_meshes
from ars_web.geometry.mesh_outlines import mesh_outlines
from ars_web.geometry.occlusion import visible_fractions
from ars_web.geometry.polygon import Polygon
from ars_web.geometry.shape_occlusion import visible_shares
from ars_web.geometry.shape_stack import stack_shapes
from ars_web.geometry.visual_hull import View, visual_hull

VIEWS, CORNERS = 12, 72


def boxes_apart(n: int = 20) -> list[Box]:
    """n boxes of 5 to 18 cm, which stand about the table with room between them."""
    random = np.random.default_rng(0)
    found: list[Box] = []
    for k in range(n):
        size = random.uniform(0.05, 0.18, 3)
        size[:2] *= min(1.0, 0.19 / np.hypot(*size[:2]))
        place = np.array([(k % 5 - 2) * 0.22, (k // 5 - 1.5) * 0.2, size[2] / 2])
        turn = rigid_transform.rotation_about_z(random.uniform(0, 2 * np.pi))
        found.append(Box(rigid_transform.from_rotation(turn, place), size))
    return found


def hulls_in(boxes: list[Box], camera: Camera) -> list[Mesh]:
    """Visual hulls of the shapes of `hull_labels`, stretched over the boxes, from outlines as people draw them."""
    random, Ts = np.random.default_rng(3), scene.poses(36_000)[::50]
    shapes = hull_labels.shapes()
    found: list[Mesh] = []
    for k, box in enumerate(boxes):
        shape = shapes[k % len(shapes)]
        vertices = (np.array(shape.vertices) - shape.bounds.mean(axis=0)) / np.ptp(shape.bounds, axis=0)
        mesh = Mesh(rigid_transform.transform_points(box.T_world_box, vertices * box.size), np.array(shape.faces))
        seen = np.flatnonzero(np.isclose(labels_of_meshes(camera, Ts, [mesh]).truncated[:, 0], 0.0))
        views: list[View] = []
        for frame in seen[:: max(len(seen) // VIEWS, 1)][:VIEWS].tolist():
            ring, _ = mesh_outlines(camera, Ts[frame : frame + 1], [mesh], np.ones((1, 1), dtype=bool))
            border = shapely.Polygon(ring).buffer(1.0).exterior
            places = np.linspace(0, 1, CORNERS, endpoint=False)
            rough = shapely.get_coordinates(border.interpolate(places, normalized=True))
            views.append(View(frame, camera, Ts[frame], (Polygon(rough + random.normal(size=rough.shape)),)))
        hull = visual_hull(views, widen=2.0)
        found.append(Mesh(hull.vertices, hull.faces))
    return found


def painter(camera: Camera, Ts_world_camera: np.ndarray, hulls: list[Mesh]) -> np.ndarray:
    """(n, b) by subtracting exact outlines in the order of the centres' distances."""
    n, b = len(Ts_world_camera), len(hulls)
    points, offsets = mesh_outlines(camera, Ts_world_camera, hulls, np.ones((n, b), dtype=bool))
    centres = np.array([hull.sphere[0] for hull in hulls])
    visible = np.full((n, b), np.nan)
    for i in range(n):
        nearer: list[shapely.Geometry] = []
        for j in np.argsort(np.linalg.norm(centres - Ts_world_camera[i, :3, 3], axis=1)):
            ring = points[offsets[i * b + j] : offsets[i * b + j + 1]]
            if len(ring) < 3:
                continue
            polygon = shapely.make_valid(shapely.Polygon(ring))
            hiding = [other for other in nearer if shapely.intersects(other, polygon)]
            left = shapely.difference(polygon, shapely.union_all(hiding)) if hiding else polygon
            visible[i, j] = shapely.area(left) / shapely.area(polygon)
            nearer.append(polygon)
    return visible


def print_scene(name: str, boxes: list[Box], *, frames: int, runs: int) -> None:
    camera, Ts = scene.camera(), scene.poses(frames)
    hulls, b, threads = hulls_in(boxes, camera), len(boxes), numba.get_num_threads()
    parting = stack_shapes(boxes, hulls).parting
    together = (int(np.isnan(parting[..., 0]).sum()) - b) // 2
    vertices = np.mean([len(hull.vertices_world) for hull in hulls])
    print(f"\n{name}: {vertices:.0f} vertices a hull; {together} of {b * (b - 1) // 2} pairs are not parted by a plane")
    bbox = labels_of_meshes(camera, Ts, hulls).bbox
    visible_shares(camera, Ts[:2], boxes, hulls, bbox[:2])
    visible_fractions(camera, Ts[:2], boxes, bbox[:2])
    seconds = median_seconds(lambda: visible_fractions(camera, Ts, boxes, bbox), runs=runs)
    row(f"boxes, rays against slabs, {threads} threads", seconds, frames=frames, hulls=b, of=frames)
    seconds = median_seconds(lambda: visible_shares(camera, Ts, boxes, hulls, bbox), runs=runs)
    ours = row(f"hulls, a ray every 8 px, {threads} threads", seconds, frames=frames, hulls=b, of=frames)
    some = slice(None, None, max(frames // 100, 1))
    seconds = median_seconds(lambda: painter(camera, Ts[some], hulls), runs=1)
    peer = row("hulls, shapely, painter's order", seconds, frames=len(Ts[some]), hulls=b, of=frames)
    for T in Ts[some][:2]:
        instance_masks(camera, T, boxes, hulls)
    seconds = median_seconds(lambda: [instance_masks(camera, T, boxes, hulls) for T in Ts[some][:20]], runs=1)
    print(f"instance masks, every pixel, one thread: {50 * seconds[1]:.1f} ms busy a frame")
    print(f"ours is {peer / ours:.0f} times as fast as the painter, by busy seconds")
    truth = visible_shares(camera, Ts[some], boxes, hulls, bbox[some], step=1)
    area = (bbox[some][..., 2] - bbox[some][..., 0]) * (bbox[some][..., 3] - bbox[some][..., 1])
    counted = area > 400
    for found, method in (
        (visible_shares(camera, Ts[some], boxes, hulls, bbox[some]), "a ray every 8 px"),
        (painter(camera, Ts[some], hulls), "painter's order"),
    ):
        off = np.abs(found - truth)[counted]
        print(
            f"  {method}: off by {off.mean():.4f} on average, {np.quantile(off, 0.99):.3f} at the 99th percentile,"
            f" of {counted.sum()} hulls of more than 400 square pixels"
        )


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--frames", type=int, default=36_000)
    arguments.add_argument("--runs", type=int, default=3)
    options = arguments.parse_args()
    print(f"{options.frames} frames x 20 shapes, 1280 x 720, Brown distortion; median of {options.runs} runs")
    print_scene("standing apart", boxes_apart(), frames=options.frames, runs=options.runs)
    print_scene("reaching into each other", scene.boxes(), frames=options.frames, runs=options.runs)


if __name__ == "__main__":
    main()
