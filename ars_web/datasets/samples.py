"""Samples: the labels of a session's boxes in its frames, and which of them an export keeps.

This is the only caller of the geometry for exports, previews and the API's labels, so what is drawn, answered and
written comes from the same functions.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from ars_web.datasets.options import ExportOptions
from ars_web.datasets.shape_rings import columns_of, rings_of_shapes
from ars_web.datasets.shapes import PosedShapes, by_camera, check_shape, meshes_of
from ars_web.errors import BadInput, NotFound
from ars_web.geometry import labels as geometry
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.labels import BoxLabels
from ars_web.geometry.mesh import Mesh
from ars_web.geometry.mesh_labels import labels_of_meshes
from ars_web.geometry.mesh_outlines import mesh_outlines
from ars_web.geometry.shape_occlusion import visible_shares
from ars_web.sessions.model import FrameTable, SessionSnapshot

Meshes = Sequence[Mesh | None]
"""In the world, of each box; None for those whose labels are drawn round the box."""

DROP_REASONS: tuple[str, ...] = ("not_in_image", "area", "truncation", "visibility")
"""Why a box of a frame has no label, in the order in which the rules are tried; the first that applies counts."""


@dataclass(frozen=True, eq=False)
class LabelTable:
    """Labels of b boxes in n frames, a row a frame; image coordinates (x0, y0, x1, y1).

    Attributes:
        bbox: (n, b, 4) of the part in the image; NaN where no part is in it.
        bbox_amodal: (n, b, 4) of the whole object, unclipped; NaN where nothing is in front of the camera.
        truncated: (n, b) share of the amodal outline outside the image; 1 where bbox is NaN.
        visible: (n, b) share of the in-image outline that no nearer shape hides; NaN where bbox is NaN or where it
            was not asked for. A shape is what labels are drawn round: the box, the hull or the mesh.
    """

    bbox: Float[np.ndarray, "n b 4"]
    bbox_amodal: Float[np.ndarray, "n b 4"]
    truncated: Float[np.ndarray, "n b"]
    visible: Float[np.ndarray, "n b"]


@dataclass(frozen=True, eq=False)
class Outlines:
    """Rings of labels one after the other, image coordinates.

    Attributes:
        points: (m, 2) of all rings.
        starts: (n * b + 1,) where the ring of frame i and box j begins is `starts[i * b + j]`; it ends where the
            next begins, and is empty for a label that was not asked for.
    """

    points: Float[np.ndarray, "m 2"]
    starts: Int[np.ndarray, "k"]


@dataclass(frozen=True, eq=False)
class FrameLabel:
    """One box in one frame, as the API answers it; image coordinates.

    Attributes:
        bbox: None where no part of the box is in the image.
        bbox_amodal: None where no part of the box is in front of the camera.
        outline: (k, 2) ring of the part in the image, not closed.
        wireframe: polylines (k, 2) of the box's edges within the image, whatever the label is drawn round.
        truncated: 1 where bbox is None.
        visible: 0 where bbox is None.
    """

    box_id: int
    class_id: int
    bbox: tuple[float, float, float, float] | None
    bbox_amodal: tuple[float, float, float, float] | None
    outline: Float[np.ndarray, "k 2"]
    wireframe: list[Float[np.ndarray, "k 2"]]
    truncated: float
    visible: float


@dataclass(frozen=True, eq=False)
class PreviewLabel:
    """A box that is not stored, in one frame; as FrameLabel has it, without what other boxes hide of it."""

    bbox: tuple[float, float, float, float] | None
    outline: Float[np.ndarray, "k 2"]
    wireframe: list[Float[np.ndarray, "k 2"]]
    truncated: float


def labels_in_frames(
    cameras: Mapping[int, Camera],
    camera_ids: Int[np.ndarray, "n"],
    Ts_world_camera: Float[np.ndarray, "n 4 4"],
    boxes: Sequence[Box],
    *,
    meshes: Meshes | None = None,
    with_visible: bool = True,
    step: int = 8,
) -> LabelTable:
    """Labels of every box, or its hull, in every frame; frames are taken together camera by camera.

    `with_visible` False spares the search for nearer shapes; `step` is its grid in pixels.
    """
    n, b = len(camera_ids), len(boxes)
    table = LabelTable(np.full((n, b, 4), np.nan), np.full((n, b, 4), np.nan), np.ones((n, b)), np.full((n, b), np.nan))
    shapes = list(meshes) if meshes is not None else [None] * b
    solids, plain = columns_of(shapes)
    for camera, rows in by_camera(cameras, camera_ids):
        Ts = Ts_world_camera[rows]
        found: list[tuple[list[int], BoxLabels]] = []
        if plain:
            found.append((plain, geometry.labels_of_boxes(camera, Ts, [boxes[i] for i in plain])))
        if solids:
            found.append((list(solids), labels_of_meshes(camera, Ts, list(solids.values()))))
        for columns, labels in found:
            place = rows[:, None], np.array(columns)
            table.bbox[place], table.bbox_amodal[place] = labels.bbox, labels.bbox_amodal
            table.truncated[place] = labels.truncated
        if with_visible and b:
            table.visible[rows] = visible_shares(camera, Ts, boxes, shapes, table.bbox[rows], step=step)
    return table


def labels_of_shapes(shapes: PosedShapes, *, with_visible: bool = True, step: int = 8) -> LabelTable:
    """The same of shapes that know where they are seen from."""
    return labels_in_frames(
        shapes.cameras,
        shapes.camera_ids,
        shapes.Ts_world_camera,
        shapes.boxes,
        meshes=shapes.meshes,
        with_visible=with_visible,
        step=step,
    )


def outlines_of_shapes(shapes: PosedShapes, wanted: Bool[np.ndarray, "n b"]) -> Outlines:
    """The outlines that `outlines_in_frames` draws, of shapes that know where they are seen from."""
    return Outlines(*rings_of_shapes(shapes, wanted, of_boxes=geometry.outlines, of_meshes=mesh_outlines))


def outlines_in_frames(
    cameras: Mapping[int, Camera],
    camera_ids: Int[np.ndarray, "n"],
    Ts_world_camera: Float[np.ndarray, "n 4 4"],
    boxes: Sequence[Box],
    wanted: Bool[np.ndarray, "n b"],
    *,
    meshes: Meshes | None = None,
) -> Outlines:
    """Outlines of the boxes, or their meshes, in the frames where they are wanted."""
    none = np.zeros((len(boxes), 0, 3))
    shapes = PosedShapes(cameras, camera_ids, Ts_world_camera, boxes, meshes or [None] * len(boxes), none)
    return outlines_of_shapes(shapes, wanted)


def label_table(
    snapshot: SessionSnapshot, indices: Sequence[int], *, shape: str | None = None, step: int = 8
) -> LabelTable:
    """Labels of all boxes of a session, by ascending box id, in the frames at `indices`, in that order."""
    rows = np.asarray(indices, dtype=np.int64)
    frames = snapshot.frames
    return labels_in_frames(
        snapshot.cameras,
        frames.camera_ids[rows],
        frames.Ts_world_camera[rows],
        [snapshot.state.boxes[i].box for i in sorted(snapshot.state.boxes)],
        meshes=meshes_of(snapshot, shape=shape),
        step=step,
    )


def kept(table: LabelTable, options: ExportOptions) -> tuple[Bool[np.ndarray, "n b"], dict[str, int]]:
    """Which labels (n, b) the options keep, and how many were dropped for each of DROP_REASONS."""
    in_image = ~np.isnan(table.bbox[..., 0])
    with np.errstate(invalid="ignore"):
        width = table.bbox[..., 2] - table.bbox[..., 0]
        height = table.bbox[..., 3] - table.bbox[..., 1]
        failed = (
            ~in_image,
            (width * height < options.min_area_px) | (width <= 0) | (height <= 0),
            table.truncated > options.max_truncated,
            table.visible < options.min_visible,
        )
    keep = np.ones(in_image.shape, dtype=bool)
    dropped: dict[str, int] = {}
    for reason, fails in zip(DROP_REASONS, failed, strict=True):
        dropped[reason] = int((keep & fails).sum())
        keep &= ~fails
    return keep, dropped


def frame_labels(snapshot: SessionSnapshot, index: int, *, shape: str | None = None) -> list[FrameLabel]:
    """Labels of all boxes of a session in frame `index`, by ascending box id, those out of sight included.

    `shape` is the export option of that name: None and `hull` mean the hull where a box has one, else the box.

    Raises:
        NotFound: the session has no such frame.
        BadInput: `shape` is `mesh`, or no shape at all.
    """
    check_shape(shape, [snapshot])
    frames = snapshot.frames
    if not 0 <= index < len(frames):
        raise NotFound(f"session {snapshot.id} has no frame {index}; its frames are 0 to {len(frames) - 1}")
    boxes = [virtual for _, virtual in sorted(snapshot.state.boxes.items())]
    shapes, meshes = [virtual.box for virtual in boxes], meshes_of(snapshot, shape=shape)
    camera_ids, Ts = frames.camera_ids[[index]], frames.Ts_world_camera[[index]]
    table = labels_in_frames(snapshot.cameras, camera_ids, Ts, shapes, meshes=meshes)
    seen = ~np.isnan(table.bbox[..., 0])
    rings = outlines_in_frames(snapshot.cameras, camera_ids, Ts, shapes, seen, meshes=meshes)
    camera = snapshot.cameras[int(camera_ids[0])]
    found: list[FrameLabel] = []
    for column, virtual in enumerate(boxes):
        bbox = _bbox_or_none(table.bbox[0, column])
        found.append(
            FrameLabel(
                box_id=virtual.id,
                class_id=virtual.class_id,
                bbox=bbox,
                bbox_amodal=_bbox_or_none(table.bbox_amodal[0, column]),
                outline=rings.points[rings.starts[column] : rings.starts[column + 1]],
                wireframe=geometry.wireframe(camera, Ts[0], virtual.box) if bbox else [],
                truncated=float(table.truncated[0, column]),
                visible=float(table.visible[0, column]) if bbox else 0.0,
            )
        )
    return found


def preview_labels(
    cameras: Mapping[int, Camera], frames: FrameTable, boxes: Sequence[Box], indices: Sequence[int]
) -> list[list[PreviewLabel]]:
    """Labels of boxes in the frames `indices`, frame by frame, those out of sight included.

    Raises:
        BadInput: there is no such frame.
    """
    wrong = next((index for index in indices if not 0 <= index < len(frames)), None)
    if wrong is not None:
        raise BadInput(f"there is no frame {wrong}; the session's frames are 0 to {len(frames) - 1}")
    rows = list(indices)
    camera_ids, Ts = frames.camera_ids[rows], frames.Ts_world_camera[rows]
    table = labels_in_frames(cameras, camera_ids, Ts, boxes, with_visible=False)
    seen = ~np.isnan(table.bbox[..., 0])
    rings = outlines_in_frames(cameras, camera_ids, Ts, boxes, seen)
    found: list[list[PreviewLabel]] = []
    for row, camera_id in enumerate(camera_ids.tolist()):
        labels: list[PreviewLabel] = []
        for column, box in enumerate(boxes):
            first = row * len(boxes) + column
            labels.append(
                PreviewLabel(
                    bbox=_bbox_or_none(table.bbox[row, column]),
                    outline=rings.points[rings.starts[first] : rings.starts[first + 1]],
                    wireframe=geometry.wireframe(cameras[camera_id], Ts[row], box) if seen[row, column] else [],
                    truncated=float(table.truncated[row, column]),
                )
            )
        found.append(labels)
    return found


def _bbox_or_none(bbox: Float[np.ndarray, "4"]) -> tuple[float, float, float, float] | None:
    if np.isnan(bbox[0]):
        return None
    x0, y0, x1, y1 = bbox.tolist()
    return x0, y0, x1, y1
