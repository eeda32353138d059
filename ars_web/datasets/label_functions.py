"""Label functions: what is drawn of an object in an image, given its shape and where it is seen from.

De Gregorio et al. call such a function tau. Adding one is a small function and one line in `LABEL_FUNCTIONS`. The
page's overlay, the pictures of a format and the writers all draw what they say.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from ars_web.datasets.samples import LabelTable, outlines_of_shapes
from ars_web.datasets.shape_rings import columns_of, rings_of_shapes
from ars_web.datasets.shapes import PosedShapes
from ars_web.errors import BadInput
from ars_web.geometry.convex_outlines import convex_outlines, convex_outlines_of_boxes
from ars_web.geometry.hidden_points import hidden
from ars_web.geometry.instance_masks import instance_masks
from ars_web.geometry.labels import outlines
from ars_web.geometry.mask_outlines import even_outlines, pixel_outlines
from ars_web.geometry.mesh_outlines import mesh_regions
from ars_web.geometry.minimum_rectangles import minimum_rectangles
from ars_web.geometry.projected_points import project_points
from ars_web.geometry.rings import Rings, one_ring_each, rings_of

UNSEEN, HIDDEN, SEEN = 0, 1, 2
"""States of a keypoint, as COCO numbers them: not in the image; in it behind something, or on the object's far side;
in sight."""


@dataclass(frozen=True, eq=False)
class Marks:
    """What a label function draws of b objects in n frames; image coordinates.

    Attributes:
        rings: of each label that was wanted; none where there is nothing to draw.
        points: (n, b, k, 2) named points, wherever they are; NaN for those that an object has not, that are behind
            the camera or beyond what the lens can show. k is 0 where the function draws none.
        states: (n, b, k) UNSEEN, HIDDEN or SEEN.
    """

    rings: Rings
    points: Float[np.ndarray, "n b k 2"]
    states: Int[np.ndarray, "n b k"]


@dataclass(frozen=True)
class LabelFunction:
    """One of the ways to mark an object.

    Attributes:
        name: its key.
        title: its name for people.
        description: one line for people.
        draw: the marks of the labels (n, b) that are wanted, given the table of all.
    """

    name: str
    title: str
    description: str
    draw: Callable[[PosedShapes, LabelTable, Bool[np.ndarray, "n b"]], Marks]


def _box(shapes: PosedShapes, table: LabelTable, wanted: Bool[np.ndarray, "n b"]) -> Marks:
    """The smallest box in the image, from its top left corner round by the bottom left one."""
    corners = table.bbox[..., [0, 1, 0, 3, 2, 3, 2, 1]].reshape(-1, 4, 2)
    drawn = (wanted & ~np.isnan(table.bbox[..., 0])).ravel()
    return _rings_alone(one_ring_each(corners[drawn].reshape(-1, 2), np.cumsum([0, *(4 * drawn)])), wanted)


def _outline(shapes: PosedShapes, table: LabelTable, wanted: Bool[np.ndarray, "n b"]) -> Marks:
    """The border of the part in the image as one ring, which goes to pieces and holes on lines that enclose nothing."""
    found = outlines_of_shapes(shapes, wanted)
    return _rings_alone(one_ring_each(found.points, found.starts), wanted)


def _silhouette(shapes: PosedShapes, table: LabelTable, wanted: Bool[np.ndarray, "n b"]) -> Marks:
    """The border of the part in the image, a ring for each of its pieces and holes."""
    solids, plain = columns_of(shapes.meshes)
    labels: list[list[Float[np.ndarray, "k 2"]]] = [[] for _ in range(wanted.size)]
    for camera, rows in shapes.by_camera():
        Ts = shapes.Ts_world_camera[rows]
        for columns, rings in (
            (plain, one_ring_each(*outlines(camera, Ts, [shapes.boxes[i] for i in plain], wanted[rows][:, plain]))),
            (list(solids), mesh_regions(camera, Ts, list(solids.values()), wanted[rows][:, list(solids)])),
        ):
            places = (rows[:, None] * wanted.shape[1] + np.array(columns, dtype=np.int64)).ravel().tolist()
            for number, place in enumerate(places):
                labels[place] = rings.of(number)
    return _rings_alone(rings_of(labels), wanted)


def _convex(shapes: PosedShapes, table: LabelTable, wanted: Bool[np.ndarray, "n b"]) -> Marks:
    """The convex hull, in the image, of the part in it."""
    return _rings_alone(one_ring_each(*_convex_rings(shapes, wanted)), wanted)


def _rectangle(shapes: PosedShapes, table: LabelTable, wanted: Bool[np.ndarray, "n b"]) -> Marks:
    """The rectangle of the smallest area, turned as it may be, round the part in the image."""
    points, offsets = _convex_rings(shapes, wanted)
    corners, drawn = minimum_rectangles(points, offsets), np.diff(offsets) > 0
    return _rings_alone(one_ring_each(corners[drawn].reshape(-1, 2), np.cumsum([0, *(4 * drawn)])), wanted)


def _convex_rings(
    shapes: PosedShapes, wanted: Bool[np.ndarray, "n b"]
) -> tuple[Float[np.ndarray, "m 2"], Int[np.ndarray, "k"]]:
    return rings_of_shapes(shapes, wanted, of_boxes=convex_outlines_of_boxes, of_meshes=convex_outlines)


def _mask(shapes: PosedShapes, table: LabelTable, wanted: Bool[np.ndarray, "n b"]) -> Marks:
    """The border of the pixels in which no nearer shape is seen, stairs evened out."""
    labels: list[list[Float[np.ndarray, "k 2"]]] = [[] for _ in range(wanted.size)]
    for row in np.flatnonzero(wanted.any(axis=1)).tolist():
        camera = shapes.cameras[int(shapes.camera_ids[row])]
        masks = instance_masks(camera, shapes.Ts_world_camera[row], shapes.boxes, shapes.meshes)
        for column in np.flatnonzero(wanted[row]).tolist():
            seen = masks.visible_of(column)
            if seen.mask.any():
                corner = np.array([seen.column, seen.row], dtype=np.float64)
                rings = even_outlines(pixel_outlines(seen.mask))
                labels[row * wanted.shape[1] + column] = [ring + corner for ring in rings]
    return _rings_alone(rings_of(labels), wanted)


def _keypoints(shapes: PosedShapes, table: LabelTable, wanted: Bool[np.ndarray, "n b"]) -> Marks:
    """The object's named points: by default its centre and its box's eight corners."""
    b, k = shapes.keypoints_world.shape[:2]
    points = np.full((len(shapes.camera_ids), b, k, 2), np.nan)
    states = np.full(points.shape[:3], UNSEEN)
    for camera, rows in shapes.by_camera():
        found = project_points(camera, shapes.Ts_world_camera[rows], shapes.keypoints_world)
        points[rows] = found
        with np.errstate(invalid="ignore"):
            inside = ((found >= 0.0) & (found <= [camera.width, camera.height])).all(axis=-1)
        behind = hidden(shapes.Ts_world_camera[rows], shapes.keypoints_world, shapes.boxes, shapes.meshes, np.arange(b))
        states[rows] = np.where(inside & wanted[rows, :, None], np.where(behind, HIDDEN, SEEN), UNSEEN)
    none = one_ring_each(np.zeros((0, 2)), np.zeros(wanted.size + 1, dtype=np.int64))
    return Marks(none, points, states)


def _rings_alone(rings: Rings, wanted: Bool[np.ndarray, "n b"]) -> Marks:
    return Marks(rings, np.zeros((*wanted.shape, 0, 2)), np.zeros((*wanted.shape, 0), dtype=np.int64))


LABEL_FUNCTIONS: dict[str, LabelFunction] = {
    function.name: function
    for function in (
        LabelFunction("box", "Box", "the smallest upright rectangle round what is in the image", _box),
        LabelFunction("convex", "Convex outline", "the convex hull of what is in the image", _convex),
        LabelFunction(
            "outline", "Outline", "the border of what is in the image as one ring, as polygon formats hold it", _outline
        ),
        LabelFunction("silhouette", "Silhouette", "the border of what is in the image, holes included", _silhouette),
        LabelFunction("rectangle", "Turned rectangle", "the rectangle of the smallest area", _rectangle),
        LabelFunction(
            "keypoints", "Keypoints", "the object's named points, and which of them are in sight", _keypoints
        ),
    )
}
"""In the order in which they are offered."""


def label_function(name: str) -> LabelFunction:
    """The label function of that name; BadInput names the known ones."""
    if name not in LABEL_FUNCTIONS:
        raise BadInput(f"label function {name!r} is unknown; known are {', '.join(LABEL_FUNCTIONS)}")
    return LABEL_FUNCTIONS[name]
