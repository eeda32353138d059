"""What an export would write, counted without writing: the numbers that its report then has."""

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path

import numpy as np
from jaxtyping import Bool
from pydantic import BaseModel, ConfigDict, Field

from ars_web.datasets.counting import select_labels, split_counts
from ars_web.datasets.frame_choosing import BINS
from ars_web.datasets.images import image_name, placement
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.planned import ChoiceMade, ExportPlan
from ars_web.datasets.registry import writer_of
from ars_web.datasets.report import ClassUsed, SessionUsed, ShardReport, SplitCounts, report_of, used_splits
from ars_web.datasets.splits import SPLITS
from ars_web.errors import Cancelled
from ars_web.geometry.view_directions import view_directions
from ars_web.recordings.stores import is_address

LABELS_AT_ONCE = 20_000
"""Boxes times frames between two looks whether the caller still waits; a fraction of a second."""


class _Record(BaseModel):
    model_config = ConfigDict(frozen=True)


class ImageCounts(_Record):
    """How the images get into the dataset. One that its Exif asks viewers to turn is encoded, too; that is seen only
    when it is written."""

    linked: int = Field(description="the same file under a second name, which takes no room")
    copied: int
    encoded: int = Field(description="written anew: undistorted, or in the encoding that the format needs")


class DirectionsSeen(_Record):
    """How many directions the frames show objects from. A direction is an object seen from one of the cells of equal
    area round it, where it gets a label; views that look alike by the class's symmetry are one."""

    all: int
    splits: dict[str, int]


class Forecast(_Record):
    """What an export would write of the sessions as they are."""

    format: str
    options: ExportOptions
    frames: int
    sessions: list[SessionUsed]
    classes: list[ClassUsed]
    splits: dict[str, SplitCounts]
    dropped: dict[str, int] = Field(description="boxes of frames without a label, by the first rule that applied")
    losses: list[str] = Field(description="what of the session the format cannot hold, one line each")
    directions: DirectionsSeen
    choice: ChoiceMade | None = Field(
        description="how the frames were chosen, beside all candidates and even spacing; null: by their place alone"
    )
    notes: list[str] = Field(description="where the choice or the splits hold less than was asked for, one line each")
    images: ImageCounts
    image_bytes: int = Field(description="of all images, linked ones too: about what a download holds")
    new_bytes: int = Field(description="of the images that are not linked: about what the dataset takes on the disk")

    def lines(self) -> list[str]:
        """How the frames were chosen and what they cover, a line each, for people."""
        found = [f"directions: {self.directions.all} covered, an object seen from one of {BINS.cells} sides being one"]
        if self.choice is not None:
            made = self.choice
            left_out = [(made.outside_sector, "outside the sector"), (made.near_twins, "near twins of chosen ones")]
            found = [
                f"frames: {made.chosen} of {made.candidates} chosen"
                + "".join(f", {count} {words}" for count, words in left_out if count),
                f"directions: {made.directions} covered, of {made.directions_of_candidates} that all"
                f" {made.candidates} frames show; {made.directions_evenly} by as many evenly spaced frames",
            ]
        return found + [f"note: {note}" for note in self.notes]


def forecast(plan: ExportPlan, *, cancelled: Callable[[], bool] | None = None) -> Forecast:
    """What `run_export` would write; `cancelled` is asked a few times a second.

    Raises:
        Cancelled: it answered yes.
    """
    seen = _Directions(plan)
    report = report_of(plan, _counted(plan, cancelled or (lambda: False), seen), {})
    images, image_bytes, new_bytes = _images(plan)
    return Forecast(
        format=plan.format,
        options=plan.options,
        frames=len(plan.frames),
        sessions=report.sessions,
        classes=report.classes,
        splits=report.splits,
        dropped=report.dropped,
        losses=report.losses,
        directions=seen.counts(used_splits(plan)),
        choice=plan.choice,
        notes=_notes(plan, report.splits),
        images=images,
        image_bytes=image_bytes,
        new_bytes=new_bytes,
    )


class _Directions:
    """Which directions each split shows, found while labels are counted."""

    def __init__(self, plan: ExportPlan) -> None:
        self._plan = plan
        self._seen = [
            np.zeros((len(SPLITS), len(session.boxes), BINS.cells + 1), dtype=bool) for session in plan.sessions
        ]

    def look(self, rows: slice, keep: Bool[np.ndarray, "n b"]) -> None:
        """Add the labels `keep` of some frames of one session."""
        frames = self._plan.frames
        number = int(frames.session[rows][0])
        session = self._plan.sessions[number]
        centres = np.ascontiguousarray(frames.Ts_world_camera[rows, :3, 3])
        for column, box in enumerate(session.boxes):
            symmetry = self._plan.classes[session.class_of_box[column]].symmetry
            _, cells = BINS.of(view_directions(centres, box, symmetry=symmetry))
            kept = keep[:, column]
            # A camera at the centre has none, which is the last place.
            self._seen[number][frames.split[rows][kept], column, cells[kept]] = True

    def counts(self, splits: Sequence[str]) -> DirectionsSeen:
        """How many they are."""
        seen = [of_session[..., :-1] for of_session in self._seen]
        return DirectionsSeen(
            all=sum(int(one.any(axis=0).sum()) for one in seen),
            splits={split: sum(int(one[SPLITS.index(split)].sum()) for one in seen) for split in splits},
        )


def _notes(plan: ExportPlan, splits: Mapping[str, SplitCounts]) -> list[str]:
    choice, shares, found = plan.choice, plan.options.split, list[str]()
    if choice is not None and choice.asked is not None and choice.chosen < choice.asked:
        found.append(f"{choice.asked} frames are asked for, and {choice.chosen} are left to choose from: all are taken")
    for split, share in (("train", shares.train), ("val", shares.val), ("test", shares.test)):
        if share > 0 and splits[split].images == 0:
            found.append(f"{split} has a share of {share:g}, but gets no frame of the {len(plan.frames)} chosen")
    return found


def _counted(plan: ExportPlan, cancelled: Callable[[], bool], seen: _Directions) -> Iterator[ShardReport]:
    for start, stop in plan.shards:
        session = plan.sessions[int(plan.frames.session[start])]
        step = max(1, LABELS_AT_ONCE // max(1, len(session.boxes)))
        for first in range(start, stop, step):
            if cancelled():
                raise Cancelled("nobody waits for what the export would write any more")
            last = min(first + step, stop)
            selection = select_labels(plan, slice(first, last))
            seen.look(slice(first, last), selection.keep)
            splits = [SPLITS[i] for i in plan.frames.split[first:last].tolist()]
            counts = split_counts(splits, selection.keep, session.class_of_box, plan.class_names)
            yield ShardReport(splits=counts, dropped=selection.dropped, digests={})


def _images(plan: ExportPlan) -> tuple[ImageCounts, int, int]:
    """How the images come, the bytes of them all, and of those that are not linked. Encoded ones are taken to be as
    large as their sources."""
    counts, size, new = {"linked": 0, "copied": 0, "encoded": 0}, 0, 0
    frames, options = plan.frames, plan.options
    if options.images != "none":
        writer = writer_of(plan.format)
        device = cache(_device)
        here = device(str(plan.out.parent))
        columns = (frames.session.tolist(), frames.camera_id.tolist(), frames.stamps[:, 0].tolist())
        for source, stem, session, camera_id, bytes_ in zip(frames.sources, frames.stems, *columns, strict=True):
            target = image_name(stem, source, only_jpeg=writer.only_jpeg, only_png=writer.only_png)
            how = placement(source, target, camera=plan.sessions[session].cameras[camera_id], images=options.images)
            # Images that the writer puts into its own files are written once more.
            stays = writer.image_folder is not None and not is_address(source)
            if how == "linked" and not (stays and device(source.rpartition("/")[0]) == here):
                how = "copied"
            counts[how] += 1
            size += bytes_
            new += 0 if how == "linked" else bytes_
    return ImageCounts(**counts), size, new


def _device(folder: str) -> int:
    """The file system that a folder is in, or will be in once it is made."""
    path = Path(folder)
    while not path.exists():
        path = path.parent
    return os.stat(path).st_dev  # noqa: PTH116
