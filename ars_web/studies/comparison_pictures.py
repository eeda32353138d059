"""Frames with manual and automatic labels drawn beside each other."""

from itertools import pairwise

import numpy as np

from ars_web.datasets.drawing import Canvas, Color, color_of
from ars_web.errors import BadFile
from ars_web.recordings.images import read_image
from ars_web.recordings.stored_images import local
from ars_web.reporting.jpeg import jpeg
from ars_web.sessions.model import SessionSnapshot
from ars_web.studies.compared_frames import ComparedLabel, WorstFrame

MANUAL = "#56b4e9"
AUTOMATIC = "#e69f00"
LONELY = "#ff4d6d"

GOOD = 0.75
"""Pairs that overlap more are drawn without a word."""

_LONGEST = 1280
"""Pixels of a picture's longer side."""

_DASHES = 14
"""Along each side of what is seen of an object."""


def picture(snapshot: SessionSnapshot, worst: WorstFrame) -> bytes:
    """The frame as JPEG: manual labels in MANUAL, automatic ones in AUTOMATIC, dashed round what is seen of them; those
    without a partner in LONELY, with a word that says whose they are.

    Raises:
        BadFile: its image cannot be read.
    """
    canvas = Canvas(read_image(local(snapshot.frames.images[worst.frame.index])))
    for label in worst.labels:
        if label.by == "program" and label.visible_bbox is not None and label.visible_bbox != label.bbox:
            canvas.lines(_dashes(label.visible_bbox), color_of(AUTOMATIC), width=1.0)
    for label in worst.labels:
        canvas.lines([_ring(label.bbox)], _color(label), width=1.0 if not label.counts else 2.0)
    # A pair is told once, at the automatic label.
    for label in worst.labels:
        word = _word(label)
        if word and label.counts:
            canvas.tag(label.bbox, label.class_name, word, _color(label))
    return jpeg(canvas.pixels, longest=_LONGEST)


def picture_or_reason(snapshot: SessionSnapshot, worst: WorstFrame) -> bytes | str:
    """The picture; where its image cannot be read, why."""
    try:
        return picture(snapshot, worst)
    except BadFile as error:
        # Reports are passed on: where the recording lies is nobody's business.
        return str(error).replace(str(snapshot.frames.images[worst.frame.index]), worst.frame.name)


def _color(label: ComparedLabel) -> Color:
    if label.iou is None and label.counts:
        return color_of(LONELY)
    return color_of(MANUAL if label.by == "hand" else AUTOMATIC)


def _word(label: ComparedLabel) -> str:
    if label.iou is not None:
        return f"IoU {label.iou:.2f}" if label.by == "program" and label.iou < GOOD else ""
    if label.other_class is not None:
        return f"hand; program: {label.other_class}" if label.by == "hand" else ""
    return "hand alone" if label.by == "hand" else "program alone"


def _ring(bbox: tuple[float, float, float, float]) -> np.ndarray:
    x0, y0, x1, y1 = bbox
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]])


def _dashes(bbox: tuple[float, float, float, float]) -> list[np.ndarray]:
    ring, dashes = _ring(bbox), list[np.ndarray]()
    for start, end in pairwise(ring):
        stops = start + np.linspace(0, 1, 2 * _DASHES)[:, None] * (end - start)
        dashes.extend(stops.reshape(_DASHES, 2, 2))
    return dashes
