"""On the rendered cell: what is seen of objects, from boxes and from hulls made of eight true outlines, against the
true share; and the hulls' silhouettes against the true outlines in views that they are not made of."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import shapely

from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.instance_masks import instance_masks
from ars_web.geometry.labels import labels_of_boxes
from ars_web.geometry.mesh import Mesh
from ars_web.geometry.mesh_labels import labels_of_meshes
from ars_web.geometry.occlusion import visible_fractions
from ars_web.geometry.polygon import Polygon
from ars_web.geometry.shape_occlusion import visible_shares
from ars_web.geometry.visual_hull import View, visual_hull

CELL = Path(__file__).parents[3] / "shared" / "data" / "cell"
VIEWS = 8
RIM = 0.5
"""Pixels. The true outlines run through the middles of an object's outermost pixels."""

FEWEST_PIXELS = 200
"""Of an object in a frame. The true share of less is mostly noise."""


@dataclass(frozen=True, eq=False)
class Cell:
    """The truth by frame and object, the outlines of objects that are whole in the image and nearly unhidden, and which
    of them each object's hull is made of."""

    camera: Camera
    Ts_world_camera: np.ndarray
    boxes: list[Box]
    visible: np.ndarray
    pixels: np.ndarray
    views: list[dict[int, View]]
    used: list[list[int]]
    hulls: list[Mesh | None]


@pytest.fixture(scope="module")
def cell() -> Cell:
    truth = json.loads((CELL / "truth" / "truth.json").read_bytes())
    masks = json.loads((CELL / "truth" / "masks.json").read_bytes())
    K, (k1, k2, p1, p2) = truth["K"], truth["dist"]
    camera = Camera(*truth["size"], K[0][0], K[1][1], K[0][2], K[1][2], "brown", (k1, k2, p1, p2, 0.0))
    frames = truth["frames"]
    Ts = np.array([frame["T_world_camera"] for frame in frames])

    def of(name: str) -> np.ndarray:
        return np.array([[thing[name] for thing in frame["objects"]] for frame in frames], dtype=np.float64)

    amodal, visible = of("bbox_amodal") + 0.5, of("visible_fraction")
    views: list[dict[int, View]] = [{} for _ in truth["objects"]]
    for i, outlines in ((int(key), of_frame) for key, of_frame in masks.items()):
        for b, rings in ((int(key), rings) for key, rings in outlines.items()):
            x0, y0, x1, y1 = amodal[i, b]
            whole = x0 > 1 and y0 > 1 and x1 < camera.width - 1 and y1 < camera.height - 1
            if whole and visible[i, b] > 0.9:
                polygon = Polygon(np.array(rings[0]), tuple(np.array(ring) for ring in rings[1:]))
                views[b][i] = View(i, camera, Ts[i], (polygon,))
    boxes = [Box(np.array(thing["T_world_box"]), np.array(thing["size"])) for thing in truth["objects"]]
    used: list[list[int]] = []
    hulls: list[Mesh | None] = []
    for of_object in views:
        good = sorted(of_object)
        used.append(
            [good[int(k)] for k in np.linspace(0, len(good) - 1, VIEWS + 1)[:VIEWS]] if len(good) >= VIEWS else []
        )
        hull = visual_hull([of_object[frame] for frame in used[-1]], widen=RIM) if used[-1] else None
        hulls.append(None if hull is None else Mesh(hull.vertices, hull.faces))
    return Cell(camera, Ts, boxes, visible, of("px_in_image"), views, used, hulls)


def agreement(cell: Cell, visible: np.ndarray) -> tuple[float, float]:
    """Correlation with the true shares, and how far off them on average."""
    seen = cell.pixels > FEWEST_PIXELS
    assert not np.isnan(visible[seen]).any()
    a, b = visible[seen], cell.visible[seen]
    return float(np.corrcoef(a, b)[0, 1]), float(np.abs(a - b).mean())


def test_hulls_tell_what_is_seen_better_than_boxes(
    cell: Cell, record_testsuite_property: Callable[[str, object], None]
):
    bbox = labels_of_boxes(cell.camera, cell.Ts_world_camera, cell.boxes).bbox
    from_boxes = agreement(cell, visible_fractions(cell.camera, cell.Ts_world_camera, cell.boxes, bbox))
    for column, hull in enumerate(cell.hulls):
        if hull is not None:
            bbox[:, column] = labels_of_meshes(cell.camera, cell.Ts_world_camera, [hull]).bbox[:, 0]
    shares = visible_shares(cell.camera, cell.Ts_world_camera, cell.boxes, cell.hulls, bbox)
    from_hulls = agreement(cell, shares)
    made = sum(hull is not None for hull in cell.hulls)
    for name, (correlation, off) in (("boxes", from_boxes), (f"{made} hulls", from_hulls)):
        said = f"cell, visible share from {name}: correlation with the truth, mean error"
        record_testsuite_property(said, (round(correlation, 3), round(off, 3)))
    assert made >= 7
    assert from_boxes[0] > 0.75
    assert from_boxes[1] < 0.12
    assert from_hulls[0] > 0.9
    assert from_hulls[1] < 0.05
    assert from_hulls[1] < from_boxes[1]


def test_silhouettes_of_hulls_are_the_outlines_in_other_views(
    cell: Cell, record_testsuite_property: Callable[[str, object], None]
):
    found: list[float] = []
    for views, used, box, hull in zip(cell.views, cell.used, cell.boxes, cell.hulls, strict=True):
        for frame in sorted(set(views) - set(used)) if hull is not None else []:
            masks = instance_masks(cell.camera, cell.Ts_world_camera[frame], [box], [hull])
            want = pixels_of(views[frame].polygons[0], cell.camera)
            ours = masks.visible == 0
            found.append(float((ours & want).sum() / (ours | want).sum()))
    said = f"cell, silhouettes of eight-view hulls in {len(found)} other views: mean IoU"
    record_testsuite_property(said, round(float(np.mean(found)), 4))
    assert len(found) > 50
    assert np.mean(found) >= 0.95


def pixels_of(polygon: Polygon, camera: Camera) -> np.ndarray:
    """The pixels that a true outline bounds, those that it runs through the middles of included."""
    region = shapely.make_valid(shapely.Polygon(polygon.outer, polygon.holes))
    shapely.prepare(region)
    x0, y0, x1, y1 = region.bounds
    found = np.zeros((camera.height, camera.width), bool)
    left, top = max(int(x0), 0), max(int(y0), 0)
    v, u = np.mgrid[top : min(int(y1) + 1, camera.height), left : min(int(x1) + 1, camera.width)] + 0.5
    found[top : top + u.shape[0], left : left + u.shape[1]] = shapely.intersects_xy(region, u, v)
    return found
