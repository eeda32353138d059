"""Recordings of the study's scenes by the demo's renderer: folders that `ars-web import` reads, with their truth."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float

from ars_web.demo import building, measuring, rendering, scene
from ars_web.demo.scene import Thing
from ars_web.demo.truth import TRUTH_FILE, DemoObject, DemoTruth, load_demo, truth_json
from ars_web.demo.world import World
from ars_web.geometry.mask_regions import polygons_from_mask
from ars_web.geometry.polygon import Polygon

JPEG_QUALITY = 92

WHOLE = 0.998
"""Share of an object's pixels that is seen where nothing hides it."""


def film(
    folder: Path,
    things: Sequence[Thing],
    Ts_world_camera: Float[np.ndarray, "n 4 4"],
    *,
    size: tuple[int, int],
    noise: int,
    progress: Callable[[int, int], None] | None = None,
    world: World | None = None,
) -> DemoTruth:
    """The recording in `folder`, made there unless it is there already, whole: its truth is written last.

    Args:
        size: the images' width and height.
        noise: the sensor's noise is of frame number `noise` and those after it.
        progress: called with (images done, images in all).
        world: the scene as arrays; None: as `lit_world` gives it, which takes half a minute.
    """
    if (folder / TRUTH_FILE).exists():
        return load_demo(folder)
    (folder / "images").mkdir(parents=True, exist_ok=True)
    camera = scene.camera(*size)
    rays = rendering.ray_table(camera)
    names = tuple(f"{i:05d}.jpg" for i in range(len(Ts_world_camera)))
    points = [measuring.surface_points_world(thing) for thing in things]
    with ThreadPoolExecutor(os.cpu_count()) as executor:
        lit = world or building.lit_world(
            things, desk=scene.desk(), executor=executor, meanwhile=rendering.compile_kernels
        )

        def photograph(i: int) -> tuple[int, measuring.Counts]:
            sight = rendering.look(lit.parts, rays, Ts_world_camera[i])
            image = rendering.paint(lit, rays, Ts_world_camera[i], sight, seed=noise + i)
            _, jpeg = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
            return (folder / "images" / names[i]).write_bytes(jpeg.tobytes()), measuring.pixel_counts(sight)

        taken: list[tuple[int, measuring.Counts]] = []
        for one in executor.map(photograph, range(len(names))):
            taken.append(one)
            if progress is not None:
                progress(len(taken), len(names))
    counts = [count for _, count in taken]
    truth = DemoTruth(
        folder=folder,
        class_names=tuple(dict.fromkeys(thing.class_name for thing in things)),
        objects=tuple(DemoObject(thing.class_name, thing.name, thing.box) for thing in things),
        camera=camera,
        image_names=names,
        image_bytes=tuple(written for written, _ in taken),
        Ts_world_camera=Ts_world_camera,
        bbox_amodal=np.array([[measuring.amodal_box(camera, T, own) for own in points] for T in Ts_world_camera]),
        bbox_visible=np.array([count.bbox_visible for count in counts]),
        px_in_image=np.array([count.in_image for count in counts]),
        px_visible=np.array([count.visible for count in counts]),
    )
    matrices = Ts_world_camera.reshape(-1, 16)
    (folder / "poses.txt").write_text("".join(" ".join(f"{x:.15g}" for x in row) + "\n" for row in matrices))
    k1, k2, p1, p2, _ = camera.distortion
    values = (camera.fx, camera.fy, camera.cx, camera.cy, k1, k2, p1, p2)
    (folder / "camera_intrinsics.txt").write_text(" ".join([*map(str, size), *(f"{x:.15g}" for x in values)]) + "\n")
    (folder / TRUTH_FILE).write_bytes(truth_json(truth, version=1))
    return truth


def outlines(
    truth: DemoTruth, things: Sequence[Thing], thing: int, *, count: int
) -> list[tuple[int, tuple[Polygon, ...]]]:
    """An object's outline in `count` frames, as a careful person would draw it: (frame, polygons).

    They are frames that show it whole and unhidden, of those one after the other the one whose direction of view is
    farthest from all before.
    """
    whole = np.flatnonzero(_shows_whole(truth, thing))
    eyes = truth.Ts_world_camera[whole, :3, 3] - truth.objects[thing].box.T_world_box[:3, 3]
    directions = eyes / np.linalg.norm(eyes, axis=1, keepdims=True)
    chosen = [0]
    while len(chosen) < min(count, len(whole)):
        chosen.append(int(np.argmin((directions @ directions[chosen].T).max(axis=1))))
    rays, parts = rendering.ray_table(truth.camera), building.place(things, desk=scene.desk())
    frames = sorted(int(frame) for frame in whole[chosen])
    return [
        (frame, polygons_from_mask(rendering.look(parts, rays, truth.Ts_world_camera[frame]).objects == thing))
        for frame in frames
    ]


def _shows_whole(truth: DemoTruth, thing: int) -> np.ndarray:
    x0, y0, x1, y1 = truth.bbox_amodal[:, thing].T
    inside = (x0 > 1) & (y0 > 1) & (x1 < truth.camera.width - 1) & (y1 < truth.camera.height - 1)
    return inside & (truth.px_visible[:, thing] >= WHOLE * truth.px_in_image[:, thing])
