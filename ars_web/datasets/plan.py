"""The plan of an export: every frame with its split, its file name and its shard, before any work is done.

A plan is made from snapshots alone, holds all that the work needs, and is the same for the same inputs whatever
the machine, so that an export that was interrupted can be recognised and resumed.
"""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from ars_web.datasets import splits
from ars_web.datasets.file_names import stems
from ars_web.datasets.image_stamps import stamps_now
from ars_web.datasets.options import ExportOptions, FrameChoice
from ars_web.datasets.registry import writer_of
from ars_web.datasets.samples import check_shape, hulls_of
from ars_web.errors import BadInput
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.mesh import Mesh
from ars_web.sessions.model import SessionSnapshot

SECONDS_PER_FRAME = {"none": 0.0003, "link": 0.0005, "copy": 0.001, "rectify": 0.02}
"""Rough cost on one core, by where the images come from: what shards are cut by, never what is promised."""

SHARD_SECONDS = 10.0
SHARD_BOX_FRAMES = 100_000
"""Labels of a shard are held in memory at once; with their outlines they stay below some 100 MB."""

FEWEST_SHARDS = 8
"""Of an export that takes long enough for a pool: then two or four workers end at about the same time."""


@dataclass(frozen=True, eq=False)
class PlannedSession:
    """What the work needs of one session.

    Attributes:
        hulls: in the world, what the labels of each box are drawn round; None: the box.
        class_of_box: places in the plan's class names.
    """

    id: str
    name: str
    revision: int
    cameras: dict[int, Camera]
    boxes: tuple[Box, ...]
    hulls: tuple[Mesh | None, ...]
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


@dataclass(frozen=True, eq=False)
class ExportPlan:
    """An export, decided.

    Attributes:
        out: the dataset's folder, absolute; not there yet, or empty.
        class_names: of the dataset, a class's id being its place: those of the sessions, merged by name in order.
        shards: ranges of frames, each within one session.
    """

    out: Path
    format: str
    options: ExportOptions
    class_names: tuple[str, ...]
    sessions: tuple[PlannedSession, ...]
    frames: PlannedFrames
    shards: tuple[tuple[int, int], ...]

    @property
    def seconds(self) -> float:
        """Rough work in seconds on one core."""
        return len(self.frames) * SECONDS_PER_FRAME[self.options.images]


def plan_export(
    snapshots: Sequence[SessionSnapshot],
    *,
    format: str,  # noqa: A002 - the contract's name
    options: ExportOptions,
    out: Path,
    frames_per_shard: int | None = None,
) -> ExportPlan:
    """Decide an export of sessions, merged where there are several, into the folder `out`.

    The plan's options name the sessions after the first, whatever names the caller's options had for them.

    `frames_per_shard` overrides the planner's choice of shards; the dataset's bytes do not depend on it.

    Raises:
        BadInput: the format or the shape is unknown or cannot be made, `out` is in use, a frame or a session is
            chosen that is not there, or no frame at all.
        BadFile: a source image is missing, or has become a link.
    """
    writer = writer_of(format)
    check_shape(options.shape)
    check_merged(snapshots)
    options = options.model_copy(update={"sessions": tuple(s.id for s in snapshots[1:])})
    out = usable_out(out)
    chosen = [_chosen(options.frames, snapshot) for snapshot in snapshots]
    counts = [len(indices) for indices in chosen]
    if sum(counts) == 0:
        raise BadInput(
            "no frame is chosen: the sessions have "
            + ", ".join(f"{len(s.frames)} ({s.id})" for s in snapshots)
            + " frames; widen the choice of frames"
        )
    class_names = tuple(dict.fromkeys(c.name for s in snapshots for _, c in sorted(s.state.classes.items())))
    sessions = tuple(_planned_session(snapshot, class_names, options.shape) for snapshot in snapshots)
    # All frames are named, not only the chosen ones, so that a frame is called the same in every export.
    prefixes = [f"{s.id}_" if len(snapshots) > 1 else "" for s in snapshots]
    all_stems = iter(stems(p + name for p, s in zip(prefixes, snapshots, strict=True) for name in s.frames.names))
    named = [[next(all_stems) for _ in s.frames.names] for s in snapshots]
    picked = [(number, i) for number, indices in enumerate(chosen) for i in indices.tolist()]
    sources = tuple(str(snapshots[number].frames.images[i]) for number, i in picked)
    frames = PlannedFrames(
        session=np.repeat(np.arange(len(snapshots)), counts),
        index=np.concatenate(chosen),
        camera_id=np.concatenate([s.frames.camera_ids[i] for s, i in zip(snapshots, chosen, strict=True)]),
        split=splits.assign(counts, options.split),
        Ts_world_camera=np.concatenate([s.frames.Ts_world_camera[i] for s, i in zip(snapshots, chosen, strict=True)]),
        stamps=np.zeros((len(picked), 2), dtype=np.int64) if options.images == "none" else _stamps(sources),
        names=tuple(snapshots[number].frames.names[i] for number, i in picked),
        stems=tuple(
            f"{place:05d}" if writer.numbered else named[number][i] for place, (number, i) in enumerate(picked)
        ),
        sources=sources,
    )
    most_boxes = max(len(session.boxes) for session in sessions)
    length = frames_per_shard or _frames_per_shard(len(frames), most_boxes, options.images)
    return ExportPlan(out, format, options, class_names, sessions, frames, _shards(counts, length))


def check_merged(snapshots: Sequence[SessionSnapshot]) -> None:
    """Raises BadInput where there is no session, or one is merged with itself."""
    ids = [snapshot.id for snapshot in snapshots]
    if not ids:
        raise BadInput("an export needs at least one session")
    twice = sorted({i for i in ids if ids.count(i) > 1})
    if twice:
        raise BadInput(f"session {twice[0]} is merged twice; name each session once")


def usable_out(out: Path) -> Path:
    """`out` made absolute, once it is clear that a dataset can be published there by one rename.

    Raises:
        BadInput: it is a file, a folder that is not empty, a link, or a mount point.
    """
    out = Path(os.path.abspath(out))  # noqa: PTH100 - resolve() would follow a link that has to be refused
    if out.is_symlink():
        raise BadInput(f"{out} is a link; name the folder itself")
    if out.exists():
        if not out.is_dir():
            raise BadInput(f"{out} is a file; name a folder that is not there yet")
        if any(out.iterdir()):
            raise BadInput(f"{out} is not empty; name a folder that is not there yet, or empty it")
        if os.path.ismount(out):
            raise BadInput(f"{out} is a mount point, which cannot be renamed to; name a folder inside it")
    if not out.name:
        raise BadInput(f"{out} cannot hold a dataset; name a folder that is not there yet")
    return out


def _chosen(choice: FrameChoice, snapshot: SessionSnapshot) -> Int[np.ndarray, "n"]:
    """The indices that the choice means in this session, ascending."""
    count = len(snapshot.frames)
    if choice.list is None:
        return np.arange(choice.start, min(count, choice.stop if choice.stop is not None else count), choice.step)
    beyond = [i for i in choice.list if i >= count]
    if beyond:
        raise BadInput(f"frame {beyond[0]} is listed, but session {snapshot.id} has {count} frames, from 0")
    return np.array(sorted(set(choice.list)), dtype=np.int64)


def _planned_session(snapshot: SessionSnapshot, class_names: tuple[str, ...], shape: str | None) -> PlannedSession:
    state = snapshot.state
    place = {class_id: class_names.index(c.name) for class_id, c in state.classes.items()}
    boxes = [state.boxes[i] for i in sorted(state.boxes)]
    return PlannedSession(
        id=snapshot.id,
        name=state.name,
        revision=state.revision,
        cameras=dict(sorted(snapshot.cameras.items())),
        boxes=tuple(b.box for b in boxes),
        hulls=tuple(hulls_of(snapshot, shape=shape)),
        class_of_box=tuple(place[b.class_id] for b in boxes),
    )


def _stamps(sources: Sequence[str]) -> Int[np.ndarray, "n 2"]:
    stamps = np.zeros((len(sources), 2), dtype=np.int64)
    stamp = stamps_now()
    for row, source in enumerate(sources):
        stamps[row] = stamp(source)
    return stamps


def _frames_per_shard(frames: int, most_boxes: int, images: str) -> int:
    cost = SECONDS_PER_FRAME[images]
    longest = min(SHARD_SECONDS / cost, SHARD_BOX_FRAMES / max(most_boxes, 1))
    if frames * cost > 2.0:
        longest = min(longest, frames / FEWEST_SHARDS)
    return max(1, int(longest))


def _shards(counts: Sequence[int], length: int) -> tuple[tuple[int, int], ...]:
    """Ranges of at most `length` frames, nearly equal, none across two sessions."""
    found: list[tuple[int, int]] = []
    first = 0
    for count in counts:
        pieces = -(-count // length)
        edges = [first + piece * count // pieces for piece in range(pieces + 1)] if pieces else []
        found.extend(pairwise(edges))
        first += count
    return tuple(found)
