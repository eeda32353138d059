"""Which labels of planned frames an export keeps, and how many: what is written and what a forecast says of it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int

from ars_web.datasets.planned import ExportPlan
from ars_web.datasets.report import SplitCounts
from ars_web.datasets.samples import LabelTable, kept, labels_of_shapes
from ars_web.datasets.shapes import PosedShapes, stacked_keypoints
from ars_web.geometry.camera import rectified


@dataclass(frozen=True, eq=False)
class Selection:
    """The labels of a run of n frames of one session with b boxes.

    Attributes:
        shapes: with the cameras of the images as they are written.
        table: of all boxes.
        keep: (n, b) which of them are written.
        dropped: how many are not, by reason.
    """

    shapes: PosedShapes
    table: LabelTable
    keep: Bool[np.ndarray, "n b"]
    dropped: dict[str, int]


def select_labels(plan: ExportPlan, rows: slice | Int[np.ndarray, "n"], *, with_visible: bool = False) -> Selection:
    """The labels of some of the plan's frames, all of one session.

    Visible shares are found where the options drop labels by them, or `with_visible` asks for them.
    """
    frames = plan.frames
    session = plan.sessions[int(frames.session[rows][0])]
    rectify = plan.options.images == "rectify"
    keypoints = [plan.classes[place].keypoints for place in session.class_of_box]
    shapes = PosedShapes(
        cameras={i: rectified(c) if rectify else c for i, c in session.cameras.items()},
        camera_ids=frames.camera_id[rows],
        Ts_world_camera=frames.Ts_world_camera[rows],
        boxes=session.boxes,
        meshes=session.meshes,
        keypoints_world=stacked_keypoints(session.boxes, keypoints),
    )
    table = labels_of_shapes(shapes, with_visible=with_visible or plan.options.min_visible > 0)
    return Selection(shapes, table, *kept(table, plan.options))


def split_counts(
    splits: Sequence[str], keep: Bool[np.ndarray, "n b"], class_of_box: Sequence[int], class_names: Sequence[str]
) -> dict[str, SplitCounts]:
    """Images and labels of each split among `splits`, one a frame; `class_of_box` are places in `class_names`."""
    found: dict[str, SplitCounts] = {}
    of_frame, of_box = np.array(splits), np.array(class_of_box, dtype=np.int64)
    for split in sorted(set(splits)):
        chosen = keep[of_frame == split]
        per_class = np.bincount(of_box, weights=chosen.sum(axis=0), minlength=len(class_names))
        found[split] = SplitCounts(
            images=len(chosen),
            negatives=int((~chosen.any(axis=1)).sum()),
            labels=int(chosen.sum()),
            classes=dict(zip(class_names, per_class.astype(int).tolist(), strict=True)),
        )
    return found
