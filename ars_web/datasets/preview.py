"""Previews: a few frames with their labels drawn, because people would rather look."""

from collections.abc import Collection, Sequence
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import UInt8

from ars_web.datasets.drawing import Canvas, Color, color_of
from ars_web.datasets.file_names import stems
from ars_web.datasets.format_picture import draw_format
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.samples import FrameLabel, frame_labels, labels_in_frames
from ars_web.datasets.shapes import check_shape, meshes_of
from ars_web.errors import BadInput, NotFound, StoreError
from ars_web.geometry.even_spacing import evenly
from ars_web.recordings.images import read_image
from ars_web.recordings.stored_images import local
from ars_web.sessions.model import SessionSnapshot

HARDLY_VISIBLE = 0.05
"""Labels that are hidden nearly whole are drawn thinly."""


def preview(
    snapshot: SessionSnapshot,
    out: Path,
    *,
    count: int = 6,
    format: str | None = None,  # noqa: A002 - the contract's name
    shape: str | None = None,
) -> list[Path]:
    """Write `count` frames with their labels drawn into the folder `out`, as PNG; the files, in the frames' order.

    They are drawn as `format` holds them; None: outlines, edges, boxes and visible shares. The frames are spread
    evenly over those in which a box is seen; there may be fewer of them.

    Raises:
        BadInput: no box of the session is in any of its images, or there is no such format or shape.
        BadFile: one of the chosen images cannot be read.
        StoreError: `out` cannot be written.
    """
    if count < 1:
        raise BadInput(f"a preview of {count} frames shows nothing; ask for at least one")
    check_shape(shape, [snapshot])
    indices = labelled_frames(snapshot)
    if not indices:
        boxes = len(snapshot.state.boxes)
        seen = f"none of its {boxes} boxes is in any image" if boxes else "it has no boxes"
        raise BadInput(f"session {snapshot.id} has nothing to draw: {seen}; put a box where the camera looked")
    names, chosen = stems(snapshot.frames.names), ExportOptions.model_validate({"shape": shape})
    written: list[Path] = []
    for index in spread(indices, count):
        if format is None:
            picture = draw_frame(snapshot, index, shape=shape)
        else:
            picture = draw_format(snapshot, index, format=format, options=chosen)
        ok, content = cv2.imencode(".png", picture)
        assert ok, "OpenCV cannot encode PNG"
        path = out / f"{names[index]}.png"
        try:
            out.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content.data)
        except OSError as error:
            raise StoreError(f"{path}: {error.strerror}; choose another folder for the pictures") from error
        written.append(path)
    return written


def labelled_frames(snapshot: SessionSnapshot) -> list[int]:
    """Indices of the frames in which some part of a box, or of its hull where it has one, is in the image."""
    frames, boxes = snapshot.frames, [box.box for _, box in sorted(snapshot.state.boxes.items())]
    table = labels_in_frames(
        snapshot.cameras,
        frames.camera_ids,
        frames.Ts_world_camera,
        boxes,
        meshes=meshes_of(snapshot, shape=None),
        with_visible=False,
    )
    return np.flatnonzero(~np.isnan(table.bbox[..., 0]).all(axis=1)).tolist() if boxes else []


def spread(indices: Sequence[int], count: int) -> list[int]:
    """`count` of the indices, or all where there are fewer, each from the middle of an equal share of them."""
    return [indices[place] for place in evenly(len(indices), count).tolist()]


def draw_frame(
    snapshot: SessionSnapshot, index: int, *, shape: str | None = None, only: Collection[int] | None = None
) -> UInt8[np.ndarray, "h w 3"]:
    """The frame's image (BGR, enlarged where it is small) with outlines, edges, boxes, names and shares visible.

    `only` the boxes of these ids are drawn; None: all.
    """
    if not 0 <= index < len(snapshot.frames):
        raise NotFound(f"session {snapshot.id} has no frame {index}; its frames are 0 to {len(snapshot.frames) - 1}")
    canvas = Canvas(read_image(local(snapshot.frames.images[index])))
    seen = (label for label in frame_labels(snapshot, index, shape=shape) if label.bbox is not None)
    labels = [label for label in seen if only is None or label.box_id in only]
    # Far boxes first: near ones are drawn over them, as they are seen.
    labels.sort(key=lambda label: -_distance(snapshot, index, label))
    colors = {label.box_id: color_of(snapshot.state.classes[label.class_id].color) for label in labels}
    for label in labels:
        _draw_box(canvas, label, colors[label.box_id])
    for label in reversed(labels):
        assert label.bbox is not None
        name = snapshot.state.classes[label.class_id].name
        canvas.tag(label.bbox, name, f"{round(100 * label.visible)}%", colors[label.box_id])
    plural = "" if len(labels) == 1 else "s"
    canvas.caption(snapshot.frames.names[index], f"frame {index}   {len(labels)} label{plural}")
    return canvas.pixels


def _draw_box(canvas: Canvas, label: FrameLabel, color: Color) -> None:
    assert label.bbox is not None
    plain = label.visible >= HARDLY_VISIBLE
    if plain:
        canvas.fill(label.outline, color, opacity=0.14)
    canvas.rectangle(label.bbox, color)
    canvas.lines(label.wireframe, color, width=2.0 if plain else 1.0)


def _distance(snapshot: SessionSnapshot, index: int, label: FrameLabel) -> float:
    camera = snapshot.frames.Ts_world_camera[index][:3, 3]
    return float(np.linalg.norm(snapshot.state.boxes[label.box_id].box.T_world_box[:3, 3] - camera))
