"""On the rendered cell: frames that are suggested give righter labels than evenly spread ones, and a box fitted to
outlines is the true one where the object is a box."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from ars_web.geometry import camera as cameras
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.box_fit import fit_box
from ars_web.geometry.box_sighting import sighting_of_region
from ars_web.geometry.camera import Camera
from ars_web.geometry.mask_regions import region
from ars_web.geometry.next_view import suggest_views
from ars_web.geometry.polygon import Polygon
from ars_web.geometry.view_guess import FrameRows, guess_of_hull, guesses_of_view
from ars_web.geometry.visual_hull import View, VisualHull, visual_hull

CELL = Path(__file__).parents[3] / "shared" / "data" / "cell"
JENGA, DUCK, BALL = 2, 4, 5


@dataclass(frozen=True, eq=False)
class Cell:
    """The recording, its true boxes in images, and true outlines where objects are whole and unhidden."""

    camera: Camera
    Ts_world_camera: np.ndarray
    boxes: list[Box]
    amodal: np.ndarray
    views: list[dict[int, View]]

    @property
    def rows(self) -> FrameRows:
        n = len(self.Ts_world_camera)
        return FrameRows({0: self.camera}, np.zeros(n, dtype=np.int64), self.Ts_world_camera)

    def mean_iou(self, number: int, hull: VisualHull) -> float:
        """Of the boxes round the hull's vertices with the true ones, over all frames that show the object whole."""
        T_camera_world = rigid_transform.invert(self.Ts_world_camera)
        points = rigid_transform.transform_points(T_camera_world, hull.vertices)
        image = cameras.image_from_pixels(cameras.pixels_from_camera_points(self.camera, points))
        a, b = np.concatenate([image.min(axis=1), image.max(axis=1)], axis=1), self.amodal[:, number]
        size = [self.camera.width, self.camera.height]
        whole = (b[:, :2] > 0).all(axis=1) & (b[:, 2:] < size).all(axis=1) & np.isfinite(a).all(axis=1)
        a, b = a[whole], b[whole]
        shared = np.clip(np.minimum(a[:, 2:], b[:, 2:]) - np.maximum(a[:, :2], b[:, :2]), 0, None).prod(axis=1)
        areas = (a[:, 2:] - a[:, :2]).prod(axis=1) + (b[:, 2:] - b[:, :2]).prod(axis=1)
        return float((shared / (areas - shared)).mean())


@pytest.fixture(scope="module")
def cell() -> Cell:
    truth = json.loads((CELL / "truth" / "truth.json").read_bytes())
    masks = json.loads((CELL / "truth" / "masks.json").read_bytes())
    K, (k1, k2, p1, p2) = truth["K"], truth["dist"]
    camera = Camera(*truth["size"], K[0][0], K[1][1], K[0][2], K[1][2], "brown", (k1, k2, p1, p2, 0.0))
    frames = truth["frames"]
    Ts = np.array([frame["T_world_camera"] for frame in frames])
    amodal = np.array([[thing["bbox_amodal"] for thing in frame["objects"]] for frame in frames]) + 0.5
    views: list[dict[int, View]] = [{} for _ in truth["objects"]]
    for i, outlines in ((int(key), of) for key, of in masks.items()):
        for b, rings in ((int(key), rings) for key, rings in outlines.items()):
            x0, y0, x1, y1 = amodal[i, b]
            whole = x0 > 1 and y0 > 1 and x1 < camera.width - 1 and y1 < camera.height - 1
            if whole and frames[i]["objects"][b]["visible_fraction"] > 0.9:
                polygon = Polygon(np.array(rings[0]), tuple(np.array(ring) for ring in rings[1:]))
                views[b][i] = View(i, camera, Ts[i], (polygon,))
    boxes = [Box(np.array(thing["T_world_box"]), np.array(thing["size"])) for thing in truth["objects"]]
    return Cell(camera, Ts, boxes, amodal, views)


@pytest.mark.parametrize("number", [DUCK, BALL])
def test_suggested_views_beat_even_ones(cell: Cell, number: int, record_testsuite_property):
    views = cell.views[number]
    good = sorted(views)
    allowed = np.isin(np.arange(len(cell.rows)), good)
    chosen = good[:1]
    guesses = guesses_of_view(views[chosen[0]], cell.rows)
    while len(chosen) < 4:
        (found,) = suggest_views(guesses, chosen, cell.rows, allowed=allowed)
        chosen.append(found.frame)
        hull = visual_hull([views[frame] for frame in chosen])
        guesses = guess_of_hull(hull)
    even = visual_hull([views[good[int(k)]] for k in np.linspace(0, len(good) - 1, 5)[:4]])
    suggested, spread = cell.mean_iou(number, hull), cell.mean_iou(number, even)
    record_testsuite_property(f"cell {number}, 4 views: suggested, even", (round(suggested, 3), round(spread, 3)))
    assert suggested > 0.91
    assert suggested > spread


def test_a_brick_is_fitted_to_two_outlines(cell: Cell):
    """From a box that was placed by hand, 25 mm off and turned by 20 degrees."""
    true, views = cell.boxes[JENGA], cell.views[JENGA]
    turn = rigid_transform.rotation_about_z(np.radians(20)) @ true.T_world_box[:3, :3]
    place = true.T_world_box[:3, 3] + [0.015, -0.02, 0.0]
    start = Box(rigid_transform.from_rotation(turn, place), true.size * [0.8, 1.2, 1.2])
    first = sorted(views)[0]
    allowed = np.isin(np.arange(len(cell.rows)), list(views))
    (second,) = suggest_views(guesses_of_view(views[first], cell.rows), [first], cell.rows, allowed=allowed)
    seen = [
        sighting_of_region(frame, cell.camera, cell.Ts_world_camera[frame], region(views[frame].polygons))
        for frame in (first, second.frame)
    ]
    fit = fit_box(start, seen)
    assert fit.by_outline
    assert fit.rms_px < 1
    apart = np.linalg.norm(fit.box.corners_world[:, None] - true.corners_world[None], axis=2).min(axis=1)
    assert apart.max() < 2e-3
