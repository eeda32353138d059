"""How far visible shares follow the true ones on the rendered cell, from boxes and from hulls, and how far the hulls'
silhouettes are the true outlines.

    python benchmarks/cell_visibility.py PATH/TO/cell [--views 8]

Hulls are made of so many of an object's true outlines, evenly spread over those frames that show it whole and nearly
unhidden; objects that have too few stay boxes. Boxes hide more than the objects in them, and are seen where those are
not. Silhouettes are compared, as regions, with the outlines in the frames that are not used.
"""

import argparse
import json
from pathlib import Path

import numpy as np
import views as benchmark
from views import Recording, even_frames

from ars_web.geometry.labels import labels_of_boxes
from ars_web.geometry.mask_regions import region
from ars_web.geometry.mesh import Mesh
from ars_web.geometry.mesh_labels import labels_of_meshes
from ars_web.geometry.mesh_silhouette import silhouette
from ars_web.geometry.occlusion import visible_fractions
from ars_web.geometry.shape_occlusion import visible_shares
from ars_web.geometry.visual_hull import visual_hull

FEWEST_PIXELS = 200
"""Of an object in a frame. The true share of less is mostly noise."""


def hulls_of(recording: Recording, count: int) -> list[Mesh | None]:
    found: list[Mesh | None] = []
    for number, views in enumerate(recording.views):
        hull = visual_hull([views[f] for f in even_frames(recording, number, count)]) if len(views) >= count else None
        found.append(None if hull is None else Mesh(hull.vertices, hull.faces))
    return found


def silhouette_ious(recording: Recording, number: int, hull: Mesh | None, count: int) -> list[float]:
    """In the frames that can be outlined and are not used."""
    found: list[float] = []
    if hull is not None:
        views = recording.views[number]
        for frame in sorted(set(views) - set(even_frames(recording, number, count))):
            T = recording.Ts_world_camera[frame]
            ours, true = silhouette(recording.camera, T, hull.vertices_world, hull.faces), region(views[frame].polygons)
            found.append(ours.intersection(true).area / ours.union(true).area)
    return found


def agreement(found: np.ndarray, true: np.ndarray) -> str:
    varies = len(found) > 1 and np.ptp(found) > 0 and np.ptp(true) > 0
    correlation = f"{np.corrcoef(found, true)[0, 1]:8.3f}" if varies else f"{'constant':>8}"
    return f"{found.mean():6.3f} {np.abs(found - true).mean():6.3f} {correlation}"


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("cell", type=Path)
    arguments.add_argument("--views", type=int, default=8)
    options = arguments.parse_args()
    recording = benchmark.cell(options.cell)
    truth = json.loads((options.cell / "truth" / "truth.json").read_bytes())
    true = np.array([[thing["visible_fraction"] for thing in frame["objects"]] for frame in truth["frames"]])
    pixels = np.array([[thing["px_in_image"] for thing in frame["objects"]] for frame in truth["frames"]])
    boxes, Ts, camera = list(recording.boxes), recording.Ts_world_camera, recording.camera
    bbox = labels_of_boxes(camera, Ts, boxes).bbox
    by_boxes = visible_fractions(camera, Ts, boxes, bbox)
    hulls = hulls_of(recording, options.views)
    for number, hull in enumerate(hulls):
        if hull is not None:
            bbox[:, number] = labels_of_meshes(camera, Ts, [hull]).bbox[:, 0]
    by_hulls = visible_shares(camera, Ts, boxes, hulls, bbox)
    seen = pixels > FEWEST_PIXELS
    print(f"{'':<12} {'':>6} {'':>6} | {'boxes':^22} | {f'hulls of {options.views} views':^22} | silhouettes")
    heads = f"{'share':>6} {'off by':>6} {'correl.':>8}"
    print(f"{'object':<12} {'frames':>6} {'true':>6} | {heads} | {heads} | {'frames':>6} {'IoU':>6}")
    every: list[float] = []
    for number, name in enumerate(recording.classes):
        ious = silhouette_ious(recording, number, hulls[number], options.views)
        every += ious
        part = seen[:, number]
        print(line(f"{number} {name}", true[part, number], by_boxes[part, number], by_hulls[part, number], ious))
    print(line("all", true[seen], by_boxes[seen], by_hulls[seen], every))
    made = sum(hull is not None for hull in hulls)
    print(f"\n{made} of {len(hulls)} objects have a hull; objects of more than {FEWEST_PIXELS} pixels in a frame")


def line(name: str, true: np.ndarray, by_boxes: np.ndarray, by_hulls: np.ndarray, ious: list[float]) -> str:
    iou = f"{np.mean(ious):6.3f}" if ious else f"{'-':>6}"
    shares = f"{agreement(by_boxes, true)} | {agreement(by_hulls, true)}"
    return f"{name:<12} {len(true):6d} {true.mean():6.3f} | {shares} | {len(ious):6d} {iou}"


if __name__ == "__main__":
    main()
