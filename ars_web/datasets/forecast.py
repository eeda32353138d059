"""What an export would write, counted without writing: the numbers that its report then has."""

import os
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field

from ars_web.datasets.counting import select_labels, split_counts
from ars_web.datasets.images import image_name, placement
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.planned import ExportPlan
from ars_web.datasets.registry import writer_of
from ars_web.datasets.report import ClassUsed, SessionUsed, ShardReport, SplitCounts, report_of
from ars_web.datasets.splits import SPLITS
from ars_web.errors import Cancelled
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
    images: ImageCounts
    image_bytes: int = Field(description="of all images, linked ones too: about what a download holds")
    new_bytes: int = Field(description="of the images that are not linked: about what the dataset takes on the disk")


def forecast(plan: ExportPlan, *, cancelled: Callable[[], bool] | None = None) -> Forecast:
    """What `run_export` would write; `cancelled` is asked a few times a second.

    Raises:
        Cancelled: it answered yes.
    """
    report = report_of(plan, _counted(plan, cancelled or (lambda: False)), {})
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
        images=images,
        image_bytes=image_bytes,
        new_bytes=new_bytes,
    )


def _counted(plan: ExportPlan, cancelled: Callable[[], bool]) -> Iterator[ShardReport]:
    for start, stop in plan.shards:
        session = plan.sessions[int(plan.frames.session[start])]
        step = max(1, LABELS_AT_ONCE // max(1, len(session.boxes)))
        for first in range(start, stop, step):
            if cancelled():
                raise Cancelled("nobody waits for what the export would write any more")
            last = min(first + step, stop)
            selection = select_labels(plan, slice(first, last))
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
            if how == "linked" and (is_address(source) or device(source.rpartition("/")[0]) != here):
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
