"""What a plan of an export holds; `plan.py` decides it, `plan_files.py` keeps it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from ars_web.datasets.options import ExportOptions
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.keypoints import Keypoint
from ars_web.geometry.mesh import Mesh
from ars_web.geometry.symmetry import Symmetry

SECONDS_PER_FRAME = {"none": 0.0003, "link": 0.0005, "copy": 0.001, "rectify": 0.02}
"""Rough cost on one core, by where the images come from: what shards are cut by, never what is promised."""


@dataclass(frozen=True)
class PlannedClass:
    """A class of the dataset; its id is its place in the plan.

    Attributes:
        keypoints: its objects' named points, in order.
        symmetry: which turns leave its objects as they look.
    """

    name: str
    keypoints: tuple[Keypoint, ...]
    symmetry: Symmetry


@dataclass(frozen=True, eq=False)
class PlannedSession:
    """What the work needs of one session.

    Attributes:
        box_ids, box_names: in the session, of each box, by ascending id.
        meshes: in the world, what the labels of each box are drawn round; None: the box.
        drawn_round: of each box, `box`, `hull` or `mesh`.
        class_of_box: places in the plan's classes.
    """

    id: str
    name: str
    revision: int
    cameras: dict[int, Camera]
    box_ids: tuple[int, ...]
    box_names: tuple[str, ...]
    boxes: tuple[Box, ...]
    meshes: tuple[Mesh | None, ...]
    drawn_round: tuple[str, ...]
    class_of_box: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class PlannedFrames:
    """The chosen frames, one column each, session after session and by index within.

    Attributes:
        session: (n,) places in the plan's sessions.
        index: (n,) in the session.
        camera_id: (n,) key into the session's cameras.
        split: (n,) places in `splits.SPLITS`.
        Ts_world_camera: (n, 4, 4).
        stamps: (n, 2) size in bytes and time of change in ns of the source images, of those on a store a number that
            changes with them; zeros where none are wanted.
        names: in the session.
        stems: of the dataset's files.
        sources: the images, absolute, or their addresses on a store.
    """

    session: Int[np.ndarray, "n"]
    index: Int[np.ndarray, "n"]
    camera_id: Int[np.ndarray, "n"]
    split: Int[np.ndarray, "n"]
    Ts_world_camera: Float[np.ndarray, "n 4 4"]
    stamps: Int[np.ndarray, "n 2"]
    names: Sequence[str]
    stems: Sequence[str]
    sources: Sequence[str]

    def __len__(self) -> int:
        return len(self.names)


@dataclass(frozen=True)
class ChoiceMade:
    """How frames were chosen, where more than their place in the recording decided.

    A direction is an object seen from one of the cells of equal area round it, where it gets a label.

    Attributes:
        candidates: frames of the range or the list.
        outside_sector: candidates that stand outside the sector.
        near_twins: of the others, those left out because they are near twins of a chosen frame.
        asked: how many were asked for; None: all that are left.
        chosen: how many were chosen.
        directions_of_candidates: how many directions all candidates show.
        directions: how many the chosen frames show.
        directions_evenly: how many as many evenly spaced frames would, of those that the sector and near twins leave.
    """

    candidates: int
    outside_sector: int
    near_twins: int
    asked: int | None
    chosen: int
    directions_of_candidates: int
    directions: int
    directions_evenly: int


@dataclass(frozen=True, eq=False)
class ExportPlan:
    """An export, decided.

    Attributes:
        out: the dataset's folder, absolute; not there yet, or empty.
        classes: of the dataset, a class's id being its place: those of the sessions, merged by name in order.
        shards: ranges of frames, each within one session.
        seconds_per_frame: rough work on one core.
        choice: how its frames were chosen; None: by their place alone, or before the plan was read from a disk.
    """

    out: Path
    format: str
    options: ExportOptions
    classes: tuple[PlannedClass, ...]
    sessions: tuple[PlannedSession, ...]
    frames: PlannedFrames
    shards: tuple[tuple[int, int], ...]
    seconds_per_frame: float
    choice: ChoiceMade | None = None

    @property
    def class_names(self) -> tuple[str, ...]:
        """The names of its classes."""
        return tuple(a_class.name for a_class in self.classes)

    @property
    def seconds(self) -> float:
        """Rough work in seconds on one core."""
        return len(self.frames) * self.seconds_per_frame
