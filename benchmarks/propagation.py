"""What two drawn outlines become by outlining the rest, on the rendered cell.

    python benchmarks/propagation.py PATH/TO/cell [--angle DEGREES] [--frames-most N]

Of each object the two true outlines are drawn whose directions are nearest to --angle apart, of those in which it is
whole and hardly hidden. The figures are the mean IoU of the boxes that the hull has in all frames that show the object
with the true amodal ones.
"""

import argparse
import itertools
import json
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ars_web.geometry.mask_regions import iou
from ars_web.geometry.mesh import Mesh
from ars_web.geometry.mesh_labels import labels_of_meshes
from ars_web.geometry.polygon import Polygon
from ars_web.geometry.visual_hull import View, VisualHull, visual_hull
from ars_web.masks.propagation import FRAMES_MOST, propagate
from ars_web.masks.views import Photographs
from ars_web.recordings.images import read_image
from ars_web.recordings.registry import read_recording
from ars_web.sessions.model import FrameTable

HARDLY_HIDDEN = 0.9


@dataclass(frozen=True)
class Cell:
    """The rendered cell with its truth."""

    taken: Photographs
    truth: dict[str, Any]
    outlines: dict[int, dict[int, tuple[Polygon, ...]]]

    @classmethod
    def read(cls, folder: Path) -> "Cell":
        """From its folder."""
        recording = read_recording(folder)
        frames = recording.frames
        table = FrameTable(
            tuple(frame.name for frame in frames),
            tuple(frame.image for frame in frames),
            np.array([frame.camera_id for frame in frames]),
            np.array([frame.T_world_camera for frame in frames]),
        )
        masks = json.loads((folder / "truth" / "masks.json").read_bytes())
        outlines = {
            int(frame): {
                int(thing): (Polygon(np.array(rings[0]), tuple(np.array(hole) for hole in rings[1:])),)
                for thing, rings in things.items()
            }
            for frame, things in masks.items()
        }
        truth = json.loads((folder / "truth" / "truth.json").read_bytes())
        return cls(Photographs(recording.cameras, table), truth, outlines)

    def view(self, frame: int, thing: int) -> View:
        """The true outline of an object in a frame."""
        camera = self.taken.cameras[int(self.taken.frames.camera_ids[frame])]
        return View(frame, camera, self.taken.frames.Ts_world_camera[frame], self.outlines[frame][thing])

    def drawn(self, thing: int, *, angle: float) -> list[View]:
        """The two true outlines whose directions are nearest to `angle` degrees apart."""
        width, height = self.truth["size"]
        good: list[int] = []
        for frame, things in self.outlines.items():
            seen = self.truth["frames"][frame]["objects"][thing]
            x0, y0, x1, y1 = seen["bbox_amodal"]
            whole = x0 > 1 and y0 > 1 and x1 < width - 2 and y1 < height - 2
            if thing in things and whole and seen["visible_fraction"] > HARDLY_HIDDEN:
                good.append(frame)
        centre = np.array(self.truth["objects"][thing]["T_world_box"])[:3, 3]
        ways = self.taken.frames.Ts_world_camera[:, :3, 3] - centre
        ways /= np.linalg.norm(ways, axis=1, keepdims=True)

        def off(pair: tuple[int, int]) -> float:
            return abs(np.degrees(np.arccos(np.clip(ways[pair[0]] @ ways[pair[1]], -1, 1))) - angle)

        return [self.view(frame, thing) for frame in min(itertools.combinations(good, 2), key=off)]

    def score(self, hull: VisualHull, thing: int) -> float:
        """The mean IoU of the hull's boxes with the true ones, over all frames that show the object."""
        camera = self.taken.cameras[0]
        found = labels_of_meshes(camera, self.taken.frames.Ts_world_camera, [Mesh(hull.vertices, hull.faces)])
        ious: list[float] = []
        for frame, boxes in zip(self.truth["frames"], found.bbox_amodal[:, 0], strict=True):
            seen = frame["objects"][thing]
            if seen["px_in_image"] > 0:
                ious.append(overlap(np.array(seen["bbox_amodal"]), boxes))
        return float(np.mean(ious))


def overlap(a: np.ndarray, b: np.ndarray) -> float:
    """IoU of two boxes; 0 where one is not known."""
    shared = np.clip(np.minimum(a[2:], b[2:]) - np.maximum(a[:2], b[:2]), 0, None).prod()
    union = (a[2:] - a[:2]).prod() + (b[2:] - b[:2]).prod() - shared
    return float(shared / union) if union > 0 else 0.0


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("cell", type=Path)
    arguments.add_argument("--angle", type=float, default=80.0)
    arguments.add_argument("--frames-most", type=int, default=FRAMES_MOST)
    given = arguments.parse_args()
    cell = Cell.read(given.cell)
    columns = ("object", "2 drawn", "outlined", "accepted", "doubtful", "dropped", "mask IoU", "s", "cpu s")
    print(("{:<10}" + "{:>10}" * 8).format(*columns))
    rows: list[tuple[str, float, float, float, float]] = []
    for number, thing in enumerate(cell.truth["objects"]):
        drawn = cell.drawn(number, angle=given.angle)
        before = cell.score(visual_hull(drawn), number)
        began, cpu = time.perf_counter(), time.process_time()
        found = propagate(
            drawn,
            cell.taken,
            read=lambda frame: read_image(cell.taken.frames.images[frame]),
            frames_most=given.frames_most,
        )
        seconds, cpu = time.perf_counter() - began, time.process_time() - cpu
        after = cell.score(found.hull, number)
        masks = [
            iou(view.polygons, cell.outlines[view.frame][number])
            for view in found.accepted
            if number in cell.outlines.get(view.frame, {})
        ]
        quality = f"{np.mean(masks):.3f}" if masks else "-"
        counts = (len(found.accepted), len(found.doubtful), len(found.dropped))
        name = f"{number} {thing['label']}"
        print(
            f"{name:<10}{before:10.3f}{after:10.3f}"
            + "".join(f"{count:10d}" for count in counts)
            + f"{quality:>10}{seconds:10.1f}{cpu:10.1f}"
        )
        rows.append((thing["label"], before, after, seconds, cpu))
    print()
    for label in sorted({row[0] for row in rows}):
        print(summary(label, [row for row in rows if row[0] == label]))
    print(summary("all", rows))
    print("\nmask IoU: of the accepted outlines with the true ones, in the frames whose true outlines are known")


def summary(name: str, rows: list[tuple[str, float, float, float, float]]) -> str:
    before, after, seconds, cpu = np.mean([row[1:] for row in rows], axis=0)
    return f"{name:<10}{before:10.3f}{after:10.3f}{'':40}{seconds:10.1f}{cpu:10.1f}"


if __name__ == "__main__":
    main()
