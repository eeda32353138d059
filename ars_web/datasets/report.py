"""What an export says of itself: `dataset.json`, and the parts of it that each shard counts."""

import hashlib
from collections.abc import Iterable, Mapping

from pydantic import BaseModel, ConfigDict, Field

from ars_web import __version__
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.planned import ExportPlan
from ars_web.datasets.registry import WRITERS, writer_of
from ars_web.datasets.samples import DROP_REASONS
from ars_web.datasets.splits import SPLITS
from ars_web.geometry.camera import rectified


class _Record(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class SplitCounts(_Record):
    """One split: its images, those of them without a label, and its labels by class."""

    images: int
    negatives: int
    labels: int
    classes: dict[str, int]


class ShardReport(_Record):
    """What a shard adds to the whole."""

    splits: dict[str, SplitCounts]
    dropped: dict[str, int]
    digests: dict[str, str]


class SessionUsed(_Record):
    """A session as it was exported."""

    id: str
    name: str
    revision: int
    frames: int


class ClassUsed(_Record):
    """A class; its id is its place in the dataset, from 0. COCO's category ids are one more."""

    id: int
    name: str


class RectifiedCamera(_Record):
    """The pinhole camera of rectified images; OpenCV's convention, the top left pixel's centre at (0, 0)."""

    session: str
    camera: int
    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float


class ExportReport(_Record):
    """`dataset.json`: no clock, no path, nothing random, so that equal exports have equal reports."""

    format: str
    program: str = "ars-web"
    version: str = __version__
    options: ExportOptions
    shape: str = Field(
        description="what the labels are drawn round: box, hull, mesh, or such as `hull or box` where some have no hull"
    )
    sessions: list[SessionUsed]
    classes: list[ClassUsed]
    splits: dict[str, SplitCounts]
    dropped: dict[str, int] = Field(description="boxes of frames without a label, by the first rule that applied")
    losses: list[str] = Field(description="what of the session the format cannot hold, one line each")
    rectified_cameras: list[RectifiedCamera]
    label_files: int
    sha256: str = Field(
        description="over the label files: the SHA-256 of what `sha256sum` prints for them in byte order of their paths"
    )

    def as_file(self) -> bytes:
        """The content of `dataset.json`."""
        return f"{self.model_dump_json(indent=2)}\n".encode()


def report_of(plan: ExportPlan, shards: Iterable[ShardReport], joined: Mapping[str, str]) -> ExportReport:
    """The report of a plan whose shards are done; `joined` are the digests of label files that span shards."""
    splits = {split: _no_counts(plan.class_names) for split in used_splits(plan)}
    dropped = dict.fromkeys(DROP_REASONS, 0)
    # Of each label file its path, a line's end, which sorts before all that is in a path, and its digest: a third of
    # what a dictionary takes, and there is one for each frame.
    files = [_path_and_digest(*file) for file in joined.items()]
    for shard in shards:
        for split, counts in shard.splits.items():
            splits[split] = _sum(splits[split], counts)
        for reason, count in shard.dropped.items():
            dropped[reason] += count
        files += [_path_and_digest(*file) for file in shard.digests.items()]
    rectify = plan.options.images == "rectify"
    return ExportReport(
        format=plan.format,
        options=plan.options,
        shape=_shape(plan),
        sessions=[
            SessionUsed(id=s.id, name=s.name, revision=s.revision, frames=int((plan.frames.session == number).sum()))
            for number, s in enumerate(plan.sessions)
        ],
        classes=[ClassUsed(id=place, name=name) for place, name in enumerate(plan.class_names)],
        splits=splits,
        dropped=dropped,
        losses=list(writer_of(plan.format).losses(plan)),
        rectified_cameras=_rectified_cameras(plan) if rectify else [],
        label_files=len(files),
        sha256=_dataset_sha256(files),
    )


def _shape(plan: ExportPlan) -> str:
    kinds = {shape for session in plan.sessions for shape in session.drawn_round}
    return " or ".join(shape for shape in ("mesh", "hull", "box") if shape in kinds) or "box"


def used_splits(plan: ExportPlan) -> list[str]:
    """`train` and `val`, which every reader expects, and `test` where it has a share."""
    return [split for split in SPLITS if split != "test" or plan.options.split.test > 0]


def _path_and_digest(path: str, digest: str) -> bytes:
    return path.encode() + b"\n" + bytes.fromhex(digest)


def _dataset_sha256(files: list[bytes]) -> str:
    """One digest over files from the digest of each, by path in the dataset.

    It can be checked without this program, in the dataset's folder, FOLDER being the format's label folder:
    `find FOLDER -type f | LC_ALL=C sort | xargs sha256sum | sha256sum`.
    """
    files.sort()
    total = hashlib.sha256()
    for file in files:
        path, _, digest = file.partition(b"\n")
        total.update(digest.hex().encode() + b"  " + path + b"\n")
    return total.hexdigest()


def label_folder(report: ExportReport) -> str:
    """The folder whose files the report's sha256 is over."""
    return WRITERS[report.format].label_folder


def _no_counts(class_names: Iterable[str]) -> SplitCounts:
    return SplitCounts(images=0, negatives=0, labels=0, classes=dict.fromkeys(class_names, 0))


def _sum(a: SplitCounts, b: SplitCounts) -> SplitCounts:
    return SplitCounts(
        images=a.images + b.images,
        negatives=a.negatives + b.negatives,
        labels=a.labels + b.labels,
        classes={name: count + b.classes.get(name, 0) for name, count in a.classes.items()},
    )


def _rectified_cameras(plan: ExportPlan) -> list[RectifiedCamera]:
    found: list[RectifiedCamera] = []
    for session in plan.sessions:
        for camera_id, camera in session.cameras.items():
            flat = rectified(camera)
            found.append(
                RectifiedCamera(
                    session=session.id,
                    camera=camera_id,
                    width=flat.width,
                    height=flat.height,
                    fx=flat.fx,
                    fy=flat.fy,
                    cx=flat.cx,
                    cy=flat.cy,
                )
            )
    return found
