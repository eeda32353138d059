"""How right labels become with the number of outlines, and with frames that were suggested, on the demo and on a
rendered cell.

    python benchmarks/views.py [PATH/TO/cell] [--firsts 4]

Outlines are the true ones, where a person sees the object whole and nearly unhidden. Each row's hull is made of so many
of them, its vertices are projected into all frames that show the object, and the boxes round them compared with the
true ones of the object's surface: the mean IoU over all frames and objects, and for each class.

evenly           frames evenly spread over those that can be drawn in; of two, the pair that is nearest to 80 degrees
suggested        a first frame anywhere (the mean over some), the others as `geometry/next_view.py` suggests them
suggested, all   the first, too: from a box that was placed by hand, 25 mm off and its sides some 15 % wrong
fitted           the box fitted to the outlines of the row above, in place of the hull

The eight corners of the true box are beside: what labels are without a hull.
"""

import argparse
import json
import time
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np

from ars_web.demo import building, measuring, rendering, scene
from ars_web.errors import BadInput
from ars_web.geometry import camera as cameras
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.box_fit import fit_box
from ars_web.geometry.box_sighting import sighting_of_region
from ars_web.geometry.camera import Camera
from ars_web.geometry.hull_box import box_of_hull
from ars_web.geometry.labels import labels_of_boxes
from ars_web.geometry.mask_regions import polygons_from_mask, region
from ars_web.geometry.next_view import suggest_views
from ars_web.geometry.polygon import Polygon
from ars_web.geometry.view_guess import FrameRows, guess_of_box, guess_of_hull, guesses_of_view
from ars_web.geometry.visual_hull import View, VisualHull, visual_hull

COUNTS = (2, 4, 8)
UNHIDDEN = 0.9
"""Of an object's pixels, for a person to outline it well."""


@dataclass(frozen=True, eq=False)
class Recording:
    """n frames and b objects.

    Attributes:
        amodal: (n, b, 4) true boxes, image coordinates; NaN where there is none.
        in_image: (n, b) whether the object is in the image.
        views: for each object, the frames in which it can be drawn, with its true outline.
    """

    name: str
    camera: Camera
    Ts_world_camera: np.ndarray
    classes: tuple[str, ...]
    boxes: tuple[Box, ...]
    amodal: np.ndarray
    in_image: np.ndarray
    views: tuple[dict[int, View], ...]


def is_whole(camera: Camera, amodal: np.ndarray) -> bool:
    """Whether all of an object is in the image, and a pixel from its border."""
    return bool((amodal[:2] > 1).all() and amodal[2] < camera.width - 1 and amodal[3] < camera.height - 1)


def cell(folder: Path) -> Recording:
    """The rendered cell, with an outline in every third frame."""
    truth = json.loads((folder / "truth" / "truth.json").read_bytes())
    masks = json.loads((folder / "truth" / "masks.json").read_bytes())
    K, (k1, k2, p1, p2) = truth["K"], truth["dist"]
    camera = Camera(*truth["size"], K[0][0], K[1][1], K[0][2], K[1][2], "brown", (k1, k2, p1, p2, 0.0))
    frames = truth["frames"]
    Ts = np.array([frame["T_world_camera"] for frame in frames])
    # The truth's pixels have their centres at integers.
    amodal = np.array([[thing["bbox_amodal"] for thing in frame["objects"]] for frame in frames]) + 0.5
    # In two frames it projects what is at the camera's own depth, to 1e18 pixels.
    amodal[(np.abs(amodal) > 1e4).any(axis=-1)] = np.nan
    unhidden = np.array([[thing["visible_fraction"] for thing in frame["objects"]] for frame in frames])
    in_image = np.array([[thing["px_in_image"] > 0 for thing in frame["objects"]] for frame in frames])
    views = tuple(
        {
            i: View(i, camera, Ts[i], (Polygon(np.array(rings[0]), tuple(np.array(ring) for ring in rings[1:])),))
            for i, rings in ((int(i), of[str(b)]) for i, of in masks.items() if str(b) in of)
            if unhidden[i, b] > UNHIDDEN and is_whole(camera, amodal[i, b])
        }
        for b in range(len(truth["objects"]))
    )
    return Recording(
        "cell",
        camera,
        Ts,
        tuple(thing["label"] for thing in truth["objects"]),
        tuple(Box(np.array(thing["T_world_box"]), np.array(thing["size"])) for thing in truth["objects"]),
        amodal,
        in_image,
        views,
    )


def demo(frames: int = 60) -> Recording:
    """The generated recording; outlines follow the pixels that would see the object alone, in every third frame."""
    camera, things, Ts = scene.camera(960, 720), scene.things(), scene.camera_path(frames)
    parts, rays = building.place(things, desk=scene.desk()), rendering.ray_table(camera)
    surfaces = [measuring.surface_points_world(thing) for thing in things]
    amodal = np.array([[measuring.amodal_box(camera, T, points) for points in surfaces] for T in Ts])
    in_image = np.zeros(amodal.shape[:2], dtype=bool)
    views: tuple[dict[int, View], ...] = tuple({} for _ in things)

    def look(i: int) -> rendering.Sight:
        return rendering.look(parts, rays, Ts[i])

    with ThreadPoolExecutor() as pool:
        for i, sight in enumerate(pool.map(look, range(frames))):
            counts = measuring.pixel_counts(sight)
            in_image[i] = counts.in_image > 0
            for b in np.flatnonzero(counts.visible > UNHIDDEN * counts.in_image).tolist():
                if i % 3 == 0 and is_whole(camera, amodal[i, b]):
                    views[b][i] = View(i, camera, Ts[i], polygons_from_mask(sight.alone[b]))
    classes = tuple(thing.class_name for thing in things)
    return Recording("demo", camera, Ts, classes, tuple(thing.box for thing in things), amodal, in_image, views)


def ious(recording: Recording, number: int, labels: np.ndarray) -> np.ndarray:
    """(k,) of boxes (n, 4) with the true ones, in the frames that show the object."""
    true = recording.amodal[:, number]
    shown = recording.in_image[:, number] & np.isfinite(true).all(axis=1) & np.isfinite(labels).all(axis=1)
    a, b = labels[shown], true[shown]
    shared = np.clip(np.minimum(a[:, 2:], b[:, 2:]) - np.maximum(a[:, :2], b[:, :2]), 0, None).prod(axis=1)
    return shared / ((a[:, 2:] - a[:, :2]).prod(axis=1) + (b[:, 2:] - b[:, :2]).prod(axis=1) - shared)


def of_vertices(recording: Recording, hull: VisualHull) -> np.ndarray:
    """(n, 4) boxes round the hull's vertices; NaN where one is behind the camera."""
    points = rigid_transform.transform_points(rigid_transform.invert(recording.Ts_world_camera), hull.vertices)
    image = cameras.image_from_pixels(cameras.pixels_from_camera_points(recording.camera, points))
    return np.concatenate([image.min(axis=1), image.max(axis=1)], axis=1)


def of_box(recording: Recording, box: Box) -> np.ndarray:
    return labels_of_boxes(recording.camera, recording.Ts_world_camera, [box]).bbox_amodal[:, 0]


def even_frames(recording: Recording, number: int, count: int) -> list[int]:
    good = sorted(recording.views[number])
    if count > 2:
        return sorted({good[int(k)] for k in np.linspace(0, len(good) - 1, count + 1)[:count]})
    centre = recording.boxes[number].T_world_box[:3, 3]
    towards = {frame: recording.Ts_world_camera[frame, :3, 3] - centre for frame in good}

    def off(pair: tuple[int, int]) -> float:
        a, b = (towards[frame] / np.linalg.norm(towards[frame]) for frame in pair)
        return abs(float(np.degrees(np.arccos(a @ b))) - 80)

    return list(min(combinations(good, 2), key=off))


def suggested_frames(recording: Recording, number: int, count: int, first: int | Box) -> tuple[list[int], list[float]]:
    """Frames as they are suggested one after the other, and the milliseconds of each suggestion."""
    views, rows = recording.views[number], frame_rows(recording)
    allowed = np.isin(np.arange(len(rows)), list(views))
    frames = [first] if isinstance(first, int) else []
    spent: list[float] = []
    while len(frames) < count:
        if len(frames) > 1:
            guesses = guess_of_hull(visual_hull([views[frame] for frame in frames]))
        elif isinstance(first, Box):
            guesses = guess_of_box(first)
        else:
            guesses = guesses_of_view(views[first], rows)
        start = time.perf_counter()
        found = suggest_views(guesses, frames, rows, allowed=allowed)
        spent.append(1e3 * (time.perf_counter() - start))
        if not found:
            break
        frames.append(found[0].frame)
    return frames, spent


def frame_rows(recording: Recording) -> FrameRows:
    return FrameRows(
        {0: recording.camera}, np.zeros(len(recording.Ts_world_camera), dtype=int), recording.Ts_world_camera
    )


def by_hand(box: Box, random: np.random.Generator) -> Box:
    """A box as a person places it."""
    T = box.T_world_box.copy()
    away = random.normal(size=3)
    T[:3, 3] += 0.025 * away / np.linalg.norm(away)
    return Box(T, box.size * np.exp(random.normal(0, 0.15, 3)))


@dataclass
class Row:
    """What a method reached: IoU by class, over all objects, tries and frames, and what it could not do."""

    name: str
    found: dict[str, list[np.ndarray]]
    refused: int = 0

    def add(self, class_name: str, shares: np.ndarray) -> None:
        self.found.setdefault(class_name, []).append(shares)

    def line(self, classes: Sequence[str]) -> str:
        everything = np.concatenate([shares for each in self.found.values() for shares in each])
        cells = [f"{np.mean(np.concatenate(self.found[c])):7.3f}" if c in self.found else f"{'-':>7}" for c in classes]
        note = f"   {self.refused} refused" if self.refused else ""
        return f"{self.name:<26} {everything.mean():7.3f} {np.percentile(everything, 5):7.3f} {' '.join(cells)}{note}"


def rows_of(recording: Recording, count: int, *, firsts: int, spent: list[float]) -> Iterable[Row]:
    drawable = [number for number, views in enumerate(recording.views) if len(views) >= count]
    even, some, every, fitted = (
        Row(f"{count} views, {name}", {}) for name in ("evenly", "suggested", "suggested, all", "fitted")
    )
    random = np.random.default_rng(0)
    for number in drawable:
        views, class_name = recording.views[number], recording.classes[number]

        def hull_of(frames: Sequence[int], views: dict[int, View] = views) -> VisualHull:
            return visual_hull([views[frame] for frame in frames])

        def share(hull: VisualHull, number: int = number) -> np.ndarray:
            return ious(recording, number, of_vertices(recording, hull))

        even.add(class_name, share(hull_of(even_frames(recording, number, count))))
        good = sorted(views)
        for first in [good[int(k)] for k in np.linspace(0, len(good) - 1, firsts + 1)[:firsts]]:
            frames, ms = suggested_frames(recording, number, count, first)
            spent += ms
            some.add(class_name, share(hull_of(frames)))
        frames, ms = suggested_frames(recording, number, count, by_hand(recording.boxes[number], random))
        spent += ms
        hull = hull_of(frames)
        every.add(class_name, share(hull))
        seen = [
            sighting_of_region(frame, recording.camera, views[frame].T_world_camera, region(views[frame].polygons))
            for frame in frames
        ]
        try:
            fit = fit_box(box_of_hull(hull, orientation="upright"), seen)
        except BadInput:
            fitted.refused += 1
        else:
            fitted.add(class_name, ious(recording, number, of_box(recording, fit.box)))
    return even, some, every, fitted


def print_table(recording: Recording, *, firsts: int) -> None:
    classes = sorted(set(recording.classes))
    print(
        f"\n{recording.name}: {len(recording.classes)} objects in {len(recording.Ts_world_camera)} frames;"
        f" {', '.join(str(len(views)) for views in recording.views)} frames to draw each in"
    )
    print(f"{'mean IoU with the true box':<26} {'all':>7} {'5 %':>7} {' '.join(f'{c:>7}' for c in classes)}")
    corners = Row("corners of the true box", {})
    for number, class_name in enumerate(recording.classes):
        corners.add(class_name, ious(recording, number, of_box(recording, recording.boxes[number])))
    print(corners.line(classes), flush=True)
    spent: list[float] = []
    for count in COUNTS:
        for row in rows_of(recording, count, firsts=firsts, spent=spent):
            print(row.line(classes), flush=True)
    print(f"a suggestion took {np.median(spent):.0f} ms (median), {max(spent):.0f} ms (most)")


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("cell", type=Path, nargs="?")
    arguments.add_argument("--firsts", type=int, default=4, help="first frames that are tried for each object")
    options = arguments.parse_args()
    if options.cell is not None:
        print_table(cell(options.cell), firsts=options.firsts)
    print_table(demo(), firsts=options.firsts)


if __name__ == "__main__":
    main()
