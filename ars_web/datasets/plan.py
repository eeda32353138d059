"""The plan of an export: every frame with its split, its file name and its shard, before any work is done.

A plan is made from snapshots alone, holds all that the work needs, and is the same for the same inputs whatever
the machine, so that an export that was interrupted can be recognised and resumed.
"""

import os
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from jaxtyping import Int

from ars_web.datasets.file_names import stems
from ars_web.datasets.frame_choosing import choose_frames, split_of_frames
from ars_web.datasets.image_stamps import stamps_now
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.planned import SECONDS_PER_FRAME, ExportPlan, PlannedClass, PlannedFrames, PlannedSession
from ars_web.datasets.registry import writer_of
from ars_web.datasets.shapes import check_shape, meshes_of, shape_kinds
from ars_web.errors import BadInput
from ars_web.sessions.model import SessionSnapshot

SHARD_SECONDS = 10.0
SHARD_BOX_FRAMES = 100_000
"""Labels of a shard are held in memory at once; with their outlines they stay below some 100 MB."""

FEWEST_SHARDS = 8
"""Of an export that takes long enough for a pool: then two or four workers end at about the same time."""


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
        BadInput: the format or the shape is unknown or cannot be made, the format can hold nothing useful of the
            sessions, `out` is in use, a frame or a session is chosen that is not there, or no frame at all.
        BadFile: a source image is missing, or has become a link.
    """
    writer = writer_of(format)
    check_merged(snapshots)
    check_shape(options.shape, snapshots)
    options = options.model_copy(update={"sessions": tuple(s.id for s in snapshots[1:])})
    out = usable_out(out)
    chosen, choice = choose_frames(snapshots, options)
    counts = [len(indices) for indices in chosen]
    classes = merged_classes(snapshots)
    class_names = [a_class.name for a_class in classes]
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
        split=split_of_frames(snapshots, chosen, options.split),
        Ts_world_camera=np.concatenate([s.frames.Ts_world_camera[i] for s, i in zip(snapshots, chosen, strict=True)]),
        stamps=np.zeros((len(picked), 2), dtype=np.int64) if options.images == "none" else _stamps(sources),
        names=tuple(snapshots[number].frames.names[i] for number, i in picked),
        stems=tuple(
            f"{place:0{writer.digits}d}" if writer.numbered else named[number][i]
            for place, (number, i) in enumerate(picked)
        ),
        sources=sources,
    )
    most_boxes = max(len(session.boxes) for session in sessions)
    cost = SECONDS_PER_FRAME[options.images] + writer.seconds_per_frame(options)
    length = frames_per_shard or _frames_per_shard(len(frames), most_boxes, cost)
    plan = ExportPlan(out, format, options, classes, sessions, frames, _shards(counts, length), cost, choice)
    # A format that can hold nothing useful of it, or not be written here, says so now and not when all is done.
    writer.losses(plan)
    return plan


def check_merged(snapshots: Sequence[SessionSnapshot]) -> None:
    """Raises BadInput where there is no session, or one is merged with itself."""
    ids = [snapshot.id for snapshot in snapshots]
    if not ids:
        raise BadInput("an export needs at least one session")
    twice = sorted({i for i in ids if ids.count(i) > 1})
    if twice:
        raise BadInput(f"session {twice[0]} is merged twice; name each session once")


def merged_classes(snapshots: Sequence[SessionSnapshot]) -> tuple[PlannedClass, ...]:
    """The classes of the sessions, those of one name being one.

    Raises:
        BadInput: two sessions say different things of the keypoints or the symmetry of one class.
    """
    found: dict[str, PlannedClass] = {}
    for snapshot in snapshots:
        for _, a_class in sorted(snapshot.state.classes.items()):
            planned = PlannedClass(a_class.name, snapshot.state.keypoints_of(a_class.id), a_class.symmetry)
            if found.setdefault(a_class.name, planned) != planned:
                raise BadInput(
                    f"class {a_class.name!r} has other keypoints or another symmetry in session {snapshot.id} than in"
                    " the sessions it is merged with; make them alike, or rename one"
                )
    return tuple(found.values())


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


def _planned_session(snapshot: SessionSnapshot, class_names: Sequence[str], shape: str | None) -> PlannedSession:
    state = snapshot.state
    place = {class_id: class_names.index(c.name) for class_id, c in state.classes.items()}
    boxes, meshes = [state.boxes[i] for i in sorted(state.boxes)], tuple(meshes_of(snapshot, shape=shape))
    return PlannedSession(
        id=snapshot.id,
        name=state.name,
        revision=state.revision,
        cameras=dict(sorted(snapshot.cameras.items())),
        box_ids=tuple(b.id for b in boxes),
        box_names=tuple(b.name for b in boxes),
        boxes=tuple(b.box for b in boxes),
        meshes=meshes,
        drawn_round=tuple(shape_kinds(snapshot, shape=shape)),
        class_of_box=tuple(place[b.class_id] for b in boxes),
    )


def _stamps(sources: Sequence[str]) -> Int[np.ndarray, "n 2"]:
    stamps = np.zeros((len(sources), 2), dtype=np.int64)
    stamp = stamps_now()
    for row, source in enumerate(sources):
        stamps[row] = stamp(source)
    return stamps


def _frames_per_shard(frames: int, most_boxes: int, cost: float) -> int:
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
