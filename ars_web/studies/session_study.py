"""A session looked at as an export would write it: its labels, and from where its objects are seen in them."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ars_web.datasets.coverage import Coverage, coverage_of, views_where
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.splits import SPLITS
from ars_web.errors import BadInput
from ars_web.geometry.even_spacing import evenly
from ars_web.geometry.sphere_bins import SphereBins
from ars_web.sessions.model import SessionSnapshot
from ars_web.studies.planned_labels import VISIBLE_FRAMES, PlannedLabels, planned_labels
from ars_web.studies.report_facts import SplitName
from ars_web.studies.split_neighbours import ASKED_FRAMES, Neighbours, neighbours

FINE = SphereBins()
"""As `ars-web coverage` has them."""

COARSE = SphereBins(12, 6)
"""Cells some 24 degrees wide, by which is judged how much of an object was seen: about as far as pictures of an object
stay alike, and few enough for a recording of a hundred frames to fill."""


@dataclass(frozen=True, eq=False)
class SeenFrom:
    """From where some objects are seen: histograms of fine and of coarse bins."""

    fine: Coverage
    coarse: Coverage


@dataclass(frozen=True, eq=False)
class SessionStudy:
    """A session, and what an export of it would hold.

    Attributes:
        labels: of all boxes by ascending id, in the chosen frames.
        distances: (n,) metres from each frame's camera to the centre of the nearest object that is labelled in it; inf
            where none is.
        classes: views of the objects of each class that has any, by id.
        boxes: views of each object, by id.
        neighbours: of labelled frames that validate or test, by split, where there are any and labelled ones train.
    """

    snapshot: SessionSnapshot
    options: ExportOptions
    labels: PlannedLabels
    distances: Float[np.ndarray, "n"]
    classes: dict[int, SeenFrom]
    boxes: dict[int, SeenFrom]
    neighbours: dict[SplitName, Neighbours]


def study_session(
    snapshot: SessionSnapshot, options: ExportOptions, *, visible_frames: int = VISIBLE_FRAMES
) -> SessionStudy:
    """Look at a session as an export with these options would write it.

    Raises:
        BadInput: there are sessions to merge; and as `planned_labels` says.
    """
    if options.sessions:
        raise BadInput("a report is of one session: leave out the sessions to merge with it")
    labels = planned_labels(snapshot, options, visible_frames=visible_frames)
    views = views_where(snapshot, labels.plan.frames.index, labels.keep)
    centres = labels.plan.frames.Ts_world_camera[:, :3, 3]
    distances = np.full(len(centres), np.inf)
    for row, box_id in enumerate(views.box_ids):
        away = np.linalg.norm(centres - snapshot.state.boxes[box_id].box.T_world_box[:3, 3], axis=1)
        distances = np.where(labels.keep[:, row], np.minimum(distances, away), distances)

    def seen(rows: list[int]) -> SeenFrom:
        return SeenFrom(coverage_of(views, FINE, rows), coverage_of(views, COARSE, rows))

    return SessionStudy(
        snapshot=snapshot,
        options=options,
        labels=labels,
        distances=distances,
        classes={
            one: seen([row for row, class_id in enumerate(views.class_ids) if class_id == one])
            for one in sorted(set(views.class_ids))
        },
        boxes={box_id: seen([row]) for row, box_id in enumerate(views.box_ids)},
        neighbours=_across_splits(labels, distances),
    )


def _across_splits(labels: PlannedLabels, distances: Float[np.ndarray, "n"]) -> dict[SplitName, Neighbours]:
    labelled, split = labels.keep.any(axis=1), labels.plan.frames.split
    training = np.flatnonzero(labelled & (split == SPLITS.index("train")))
    found: dict[SplitName, Neighbours] = {}
    for number, name in enumerate(SPLITS):
        rows = np.flatnonzero(labelled & (split == number))
        if name != "train" and len(rows) and len(training):
            asked = rows[evenly(len(rows), ASKED_FRAMES)]
            found[name] = neighbours(labels.plan.frames.Ts_world_camera, distances, asked, training)
    return found
