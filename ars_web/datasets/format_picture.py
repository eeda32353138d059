"""A picture of one frame with what a format holds of its labels, so that people see what they will get."""

import cv2
import numpy as np
from jaxtyping import UInt8

from ars_web.datasets.drawing import Canvas, color_of
from ars_web.datasets.frame_marks import frame_shapes
from ars_web.datasets.label_functions import HIDDEN, UNSEEN
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.registry import writer_of
from ars_web.datasets.samples import kept, labels_of_shapes
from ars_web.datasets.shapes import posed_shapes
from ars_web.errors import BadInput
from ars_web.recordings.images import read_image
from ars_web.recordings.stored_images import local
from ars_web.sessions.model import SessionSnapshot

JPEG_QUALITY = 88

FILLED = ("outline", "silhouette", "mask")
"""Label functions whose area is tinted, too."""

MOST_TRIED = 60
"""Frames, spread over the recording, among which the one with the most labels is shown."""


def format_picture(
    snapshot: SessionSnapshot,
    *,
    format: str,  # noqa: A002 - the contract's name
    options: ExportOptions,
    index: int | None = None,
) -> bytes:
    """A JPEG of frame `index`, or else of one with many labels, drawn by `draw_format`; raises as that does.

    Raises:
        BadInput: the session has no frame.
    """
    index = telling_frame(snapshot, options) if index is None else index
    picture = draw_format(snapshot, index, format=format, options=options)
    ok, content = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    assert ok, "OpenCV cannot encode JPEG"
    return content.tobytes()


def draw_format(
    snapshot: SessionSnapshot,
    index: int,
    *,
    format: str,  # noqa: A002 - the contract's name
    options: ExportOptions,
) -> UInt8[np.ndarray, "h w 3"]:
    """The frame's image (BGR, enlarged where it is small) with the labels that an export would write, drawn as the
    format holds them.

    Raises:
        NotFound: the session has no such frame.
        BadInput: there is no such format or shape.
        BadFile: the frame's image cannot be read.
    """
    writer = writer_of(format)
    found = frame_shapes(snapshot, index, shape=options.shape)
    keep, _ = kept(found.table, options)
    canvas = Canvas(read_image(local(snapshot.frames.images[index])))
    boxes = [box for _, box in sorted(snapshot.state.boxes.items())]
    colors = [color_of(snapshot.state.classes[box.class_id].color) for box in boxes]
    # What is drawn first lies below: areas, then lines, then points.
    for function in writer.shows:
        marks = found.marks(function)
        for column in np.flatnonzero(keep[0]).tolist():
            rings = marks.rings.of(column)
            if function in FILLED:
                canvas.fill_rings(rings, colors[column], opacity=0.3)
            canvas.lines([np.vstack([ring, ring[:1]]) for ring in rings], colors[column], width=2.0)
            for point, state in zip(marks.points[0, column], marks.states[0, column].tolist(), strict=True):
                if state != UNSEEN:
                    canvas.dot(point, colors[column], hollow=state == HIDDEN)
    for column in np.flatnonzero(keep[0])[::-1].tolist():
        x0, y0, x1, y1 = found.table.bbox[0, column].tolist()
        name = snapshot.state.classes[boxes[column].class_id].name
        canvas.tag((x0, y0, x1, y1), name, "", colors[column])
    return canvas.pixels


def telling_frame(snapshot: SessionSnapshot, options: ExportOptions) -> int:
    """A frame in which many labels are kept, and of those the one that shows most of them.

    Raises:
        BadInput: the session has no frame.
    """
    count = len(snapshot.frames)
    if count == 0:
        raise BadInput(f"session {snapshot.id} has no frames to show")
    rows = sorted({round(place) for place in np.linspace(0, count - 1, min(count, MOST_TRIED)).tolist()})
    table = labels_of_shapes(posed_shapes(snapshot, rows, shape=options.shape))
    keep, _ = kept(table, options)
    seen = np.where(keep, np.nan_to_num(table.visible) * (1.0 - table.truncated), 0.0).sum(axis=1)
    return rows[int(np.argmax(keep.sum(axis=1) + 0.5 * seen))]
