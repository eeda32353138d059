"""The labels that an export of one session would write: which they are, how large, how much of them is seen and cut."""

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int

from ars_web.datasets.counting import select_labels
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.plan import plan_export
from ars_web.datasets.planned import ExportPlan
from ars_web.datasets.samples import DROP_REASONS
from ars_web.geometry.even_spacing import evenly
from ars_web.sessions.model import SessionSnapshot

VISIBLE_FRAMES = 2_000
"""Frames in which visible shares are looked for where no option needs all of them: of hulls that reach into each other
36,000 frames take minutes, and of this many the shares of a class are known to about one percent."""

LABELS_AT_ONCE = 100_000
"""Boxes times frames whose labels are in memory at once; with what is found on the way some 100 MB."""


@dataclass(frozen=True, eq=False)
class PlannedLabels:
    """What an export of one session would write of its b boxes, by ascending id, in its n frames.

    Attributes:
        plan: the export; its format decides nothing here, and its folder is none.
        in_image: (n, b) whether some part of the object is in the image.
        keep: (n, b) whether its label is written.
        side: (n, b) pixels, the square root of the area of the label's box; NaN where it is not in the image.
        truncated: (n, b) share of the whole object's outline outside the image.
        looked_at: (m,) rows of the frames of which visible shares are known, ascending.
        visible: (m, b) in those frames the share that no nearer object hides; NaN where not in the image.
        dropped: boxes of frames without a label, by the first rule that applied.
    """

    plan: ExportPlan
    in_image: Bool[np.ndarray, "n b"]
    keep: Bool[np.ndarray, "n b"]
    side: Float[np.ndarray, "n b"]
    truncated: Float[np.ndarray, "n b"]
    looked_at: Int[np.ndarray, "m"]
    visible: Float[np.ndarray, "m b"]
    dropped: dict[str, int]


def planned_labels(
    snapshot: SessionSnapshot, options: ExportOptions, *, visible_frames: int = VISIBLE_FRAMES
) -> PlannedLabels:
    """The labels of an export of the session with these options, which nothing is written for.

    Visible shares are known of all frames where `min_visible` needs them, else of `visible_frames` spread evenly.

    Raises:
        BadInput: the options choose a frame that is not there, no frame at all, a shape that no object has, or a
            split that one session cannot be divided into.
    """
    plan = plan_of(snapshot, options)
    n, b = len(plan.frames), len(snapshot.state.boxes)
    in_image, keep = np.zeros((n, b), dtype=bool), np.zeros((n, b), dtype=bool)
    side, truncated = np.full((n, b), np.nan, dtype=np.float32), np.ones((n, b), dtype=np.float32)
    every = options.min_visible > 0
    looked_at = np.arange(n) if every else evenly(n, visible_frames)
    visible = np.full((len(looked_at), b), np.nan, dtype=np.float32)
    dropped = dict.fromkeys(DROP_REASONS, 0)
    for rows in _runs(n, b):
        selection = select_labels(plan, rows)
        bbox = selection.table.bbox
        in_image[rows] = ~np.isnan(bbox[..., 0])
        keep[rows], truncated[rows] = selection.keep, selection.table.truncated
        side[rows] = np.sqrt((bbox[..., 2] - bbox[..., 0]) * (bbox[..., 3] - bbox[..., 1]))
        if every:
            visible[rows] = selection.table.visible
        for reason, count in selection.dropped.items():
            dropped[reason] += count
    if not every:
        for rows in _runs(len(looked_at), b):
            visible[rows] = select_labels(plan, looked_at[rows], with_visible=True).table.visible
    return PlannedLabels(plan, in_image, keep, side, truncated, looked_at, visible, dropped)


def plan_of(snapshot: SessionSnapshot, options: ExportOptions) -> ExportPlan:
    """The plan of an export that nobody wants written: its images need not be there.

    Raises:
        BadInput: as `planned_labels` says.
    """
    # A plan needs a folder that could be written. Stamps of images, which it would ask for, decide no label.
    with tempfile.TemporaryDirectory() as folder:
        without_images = options.model_copy(update={"images": "none"})
        plan = plan_export([snapshot], format="coco", options=without_images, out=Path(folder) / "dataset")
    return replace(plan, options=options)


def _runs(n: int, b: int) -> Iterator[slice]:
    step = max(1, LABELS_AT_ONCE // max(1, b))
    return (slice(first, min(first + step, n)) for first in range(0, n, step))
