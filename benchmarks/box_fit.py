"""Boxes fitted to where their object is seen: how near the truth, how fast, and what is refused, beside a plain least
squares on projected corners by SciPy.

    python benchmarks/box_fit.py [--trials 40]

Each trial: a box on a table, cameras with Brown distortion anywhere above and round it, boxes or outlines seen to a
pixel (one standard deviation), and a start that is 25 mm off, turned by 20 degrees, its sides some 15 % wrong. A wrong
answer is one with a corner more than a quarter of the diagonal off, given without a word.
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scene
import shapely
from scipy.optimize import least_squares

from ars_web.errors import BadInput
from ars_web.geometry import camera as cameras
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.box_fit import fit_box
from ars_web.geometry.box_parameters import BoxParameters, Orientation
from ars_web.geometry.box_sighting import Sighting, sighting_of_region
from ars_web.geometry.labels import labels_of_boxes, outline

CAMERA = scene.camera()
SIZE = np.array([0.1, 0.07, 0.05])


@dataclass(frozen=True, eq=False)
class Trial:
    """One object, seen and roughly placed."""

    true: Box
    start: Box
    boxes: list[Sighting]
    outlines: list[Sighting]


def looking(centres: np.ndarray, targets: np.ndarray) -> np.ndarray:
    z = targets - centres
    z /= np.linalg.norm(z, axis=1, keepdims=True)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return rigid_transform.from_rotation(np.stack([x, np.cross(z, x), z], axis=-1), centres)


def trial(views: int, orientation: Orientation, seed: int) -> Trial:
    random = np.random.default_rng(seed)
    azimuth, elevation = random.uniform(0, 2 * np.pi, views), np.radians(random.uniform(20, 70, views))
    away = np.column_stack(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    )
    Ts = looking(random.uniform(0.4, 0.8, (views, 1)) * away, random.normal(0, 0.04, (views, 3)))
    turn = rigid_transform.rotation_about_z(random.uniform(-np.pi, np.pi))
    axis = np.array([0.0, 0.0, random.choice([-1.0, 1.0])])
    if orientation == "free":
        turn = turn @ rigid_transform.rotation_from_wxyz(np.append(1.0, random.normal(0, 0.15, 3)))
        axis = random.normal(size=3)
    true = Box(rigid_transform.from_rotation(turn, random.uniform(-0.03, 0.03, 3)), SIZE)
    half = np.radians(20) / 2
    off = rigid_transform.rotation_from_wxyz(np.append(np.cos(half), np.sin(half) * axis / np.linalg.norm(axis)))
    away = random.normal(size=3)
    place = true.T_world_box[:3, 3] + 0.025 * away / np.linalg.norm(away)
    start = Box(rigid_transform.from_rotation(off @ turn, place), SIZE * np.exp(random.normal(0, 0.15, 3)))
    seen = labels_of_boxes(CAMERA, Ts, [true]).bbox[:, 0] + random.normal(0, 1.0, (views, 4))
    boxes = [Sighting(i, CAMERA, T, bbox) for i, (T, bbox) in enumerate(zip(Ts, seen, strict=True))]
    outlines: list[Sighting] = []
    for i, T in enumerate(Ts):
        ring = shapely.get_coordinates(shapely.Polygon(outline(CAMERA, T, true)).simplify(0.5))[:-1]
        drawn = shapely.MultiPolygon([shapely.Polygon(ring + random.normal(0, 1.0, ring.shape))])
        outlines.append(sighting_of_region(i, CAMERA, T, drawn))
    return Trial(true, start, boxes, outlines)


def corners_off(found: Box, true: Box) -> float:
    apart = np.linalg.norm(found.corners_world[:, None] - true.corners_world[None], axis=2)
    return float(apart.min(axis=1).max())


def plain(start: Box, sightings: list[Sighting], orientation: Orientation) -> Box:
    """What one writes first: the eight corners' box against the seen one, by SciPy with its own differences."""
    parameters = BoxParameters(start, orientation)
    Ts_camera_world = rigid_transform.invert(np.array([sighting.T_world_camera for sighting in sightings]))
    seen = np.array([sighting.bbox for sighting in sightings])

    def off(x: np.ndarray) -> np.ndarray:
        corners = rigid_transform.transform_points(Ts_camera_world, parameters.box(x).corners_world)
        image = cameras.image_from_pixels(cameras.pixels_from_camera_points(CAMERA, corners))
        return np.nan_to_num(np.concatenate([image.min(axis=1), image.max(axis=1)], axis=1) - seen, nan=1e4).ravel()

    return parameters.box(least_squares(off, np.zeros(parameters.count)).x)


def line(name: str, trials: list[Trial], orientation: Orientation, fit: Callable[[Trial], Box]) -> None:
    spent, centres, corners, refused = [], [], [], 0
    for one in trials:
        begun = time.perf_counter()
        try:
            found = fit(one)
        except BadInput:
            refused += 1
            continue
        finally:
            spent.append(1e3 * (time.perf_counter() - begun))
        centres.append(1e3 * float(np.linalg.norm(found.T_world_box[:3, 3] - one.true.T_world_box[:3, 3])))
        corners.append(1e3 * corners_off(found, one.true))
    wrong = sum(corner > 250 * np.linalg.norm(SIZE) for corner in corners)
    head = f"{orientation:8} {len(trials[0].boxes):2d} {name:20} {np.median(spent):6.0f} ms"
    if not corners:
        print(f"{head}  all {refused} refused", flush=True)
        return
    print(
        f"{head} {np.median(centres):7.2f} {np.median(corners):8.2f} {np.quantile(corners, 0.9):8.2f}"
        f" {max(corners):8.1f} {wrong:6d} {refused:8d}",
        flush=True,
    )


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--trials", type=int, default=40)
    options = arguments.parse_args()
    warm = trial(4, "upright", 0)
    fit_box(warm.start, warm.outlines)  # compiled, or read from the cache
    print(
        f"{options.trials} trials each; mm\n{'':32} {'median':>9} {'centre':>7} {'corner':>8} {'90 %':>8} {'most':>8}"
        f" {'wrong':>6} {'refused':>8}"
    )
    for orientation in ("upright", "free"):
        for views in (2, 3, 4, 8, 16):
            trials = [trial(views, orientation, seed) for seed in range(options.trials)]
            line("boxes", trials, orientation, lambda t, o=orientation: fit_box(t.start, t.boxes, orientation=o).box)
            line(
                "outlines",
                trials,
                orientation,
                lambda t, o=orientation: fit_box(t.start, t.outlines, orientation=o).box,
            )
            line("corners, plain SciPy", trials, orientation, lambda t, o=orientation: plain(t.start, t.boxes, o))


if __name__ == "__main__":
    main()
