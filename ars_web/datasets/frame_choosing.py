"""Which frames of its sessions an export takes: by their place, by where their cameras stand, and by what they show.

What a frame shows are the labels that the export would write of it; a direction is a cell of equal area on the sphere
round an object, as coverage counts them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from ars_web.datasets import splits
from ars_web.datasets.coverage import SessionViews, session_views
from ars_web.datasets.options import ExportOptions, FrameChoice, SplitChoice
from ars_web.datasets.planned import ChoiceMade
from ars_web.errors import BadInput, NotFound
from ars_web.geometry.camera import rectified
from ars_web.geometry.even_spacing import evenly
from ars_web.geometry.frame_selection import NOTHING, FrameViews, Nearness, apart, covered, covering, twins_of
from ars_web.geometry.sphere_bins import NOWHERE, SphereBins
from ars_web.geometry.view_sector import azimuths_round, in_sector
from ars_web.sessions.model import SessionSnapshot

BINS = SphereBins()
"""Whose cells of equal area are the directions that frames are chosen by: those that coverage counts by default."""


@dataclass(frozen=True, eq=False)
class _Left:
    """The frames that filters leave of all candidates: rows of those."""

    rows: Int[np.ndarray, "n"]
    outside_sector: int


def choose_frames(
    snapshots: Sequence[SessionSnapshot], options: ExportOptions
) -> tuple[list[Int[np.ndarray, "n"]], ChoiceMade | None]:
    """The indices of the frames of each session that the options mean, ascending; and how they were chosen, None where
    their place alone decided.

    Raises:
        BadInput: a frame is listed that is not there; there is nothing that a sector could be round; or no frame is
            left, with what took how many.
    """
    choice = options.frames
    candidates = [_placed(choice, snapshot) for snapshot in snapshots]
    total = sum(map(len, candidates))
    if total == 0:
        raise BadInput(
            "no frame is chosen: the sessions have "
            + ", ".join(f"{len(s.frames)} ({s.id})" for s in snapshots)
            + " frames; widen the choice of frames"
        )
    if not choice.looks_at_views:
        return candidates, None
    left = _in_sector(snapshots, candidates, choice)
    views = _views_of([_as_written(snapshot, options) for snapshot in snapshots], candidates, options)
    of_left = views.of(left.rows)
    near = Nearness(choice.near_degrees, choice.near_frames)
    kept = apart(of_left, near)
    twins = len(of_left) - len(kept)
    if choice.count is None:
        picked = kept
    elif choice.by == "even":
        picked = kept[evenly(len(kept), choice.count)]
    else:
        picked = covering(of_left, choice.count, near=near)
        twins = int(twins_of(of_left, picked, near).sum())
    chosen = left.rows[picked]
    made = ChoiceMade(
        candidates=total,
        outside_sector=left.outside_sector,
        near_twins=twins,
        asked=choice.count,
        chosen=len(chosen),
        directions_of_candidates=covered(views.elements),
        directions=covered(views.elements[chosen]),
        directions_evenly=covered(of_left.elements[kept[evenly(len(kept), len(picked))]]),
    )
    return [views.index[chosen[views.recording[chosen] == i]] for i in range(len(snapshots))], made


def split_of_frames(
    snapshots: Sequence[SessionSnapshot], chosen: Sequence[Int[np.ndarray, "n"]], choice: SplitChoice
) -> Int[np.ndarray, "n"]:
    """The split number of each chosen frame, session after session.

    Raises:
        BadInput: the sessions cannot be divided so.
    """
    by_sector = zip(snapshots, chosen, strict=True) if choice.by == "sector" else ()
    return splits.assign(
        [len(rows) for rows in chosen],
        choice,
        session_ids=[snapshot.id for snapshot in snapshots],
        azimuths=[_azimuths(snapshot, rows, None) for snapshot, rows in by_sector],
    )


def directions_in_frames(views: SessionViews) -> Int[np.ndarray, "n b"]:
    """The direction that each box is seen from in each frame: its row * cells + cell; NOTHING without a label."""
    boxes, frames = views.counted.shape
    found = np.full((frames, boxes), NOTHING, dtype=np.int64)
    for row in range(boxes):
        _, cells = BINS.of(views.directions[row])
        seen = views.counted[row] & (cells != NOWHERE)
        found[seen, row] = row * BINS.cells + cells[seen]
    return found


def _placed(choice: FrameChoice, snapshot: SessionSnapshot) -> Int[np.ndarray, "n"]:
    """The indices of the range or the list in this session, ascending."""
    count = len(snapshot.frames)
    if choice.list is None:
        return np.arange(choice.start, min(count, choice.stop if choice.stop is not None else count), choice.step)
    beyond = [i for i in choice.list if i >= count]
    if beyond:
        raise BadInput(f"frame {beyond[0]} is listed, but session {snapshot.id} has {count} frames, from 0")
    return np.array(sorted(set(choice.list)), dtype=np.int64)


def _in_sector(
    snapshots: Sequence[SessionSnapshot], candidates: Sequence[Int[np.ndarray, "n"]], choice: FrameChoice
) -> _Left:
    total = sum(map(len, candidates))
    if choice.sector is None:
        return _Left(np.arange(total), 0)
    start, stop = choice.sector
    azimuths = [_azimuths(s, rows, choice.sector_box) for s, rows in zip(snapshots, candidates, strict=True)]
    rows = np.flatnonzero(in_sector(np.concatenate(azimuths), start=start, stop=stop))
    if len(rows) == 0:
        raise BadInput(
            f"no frame is left: the cameras of all {total} stand outside the sector from {start:g} to {stop:g} degrees;"
            " widen it"
        )
    return _Left(rows, total - len(rows))


def _azimuths(snapshot: SessionSnapshot, rows: Int[np.ndarray, "n"], box_id: int | None) -> Float[np.ndarray, "n"]:
    """Of the cameras of some frames, in degrees: in a box's own frame, as its coverage has them, or in the world's
    axes about the middle of all boxes.

    Raises:
        BadInput: the session has no box.
        NotFound: it has not this one.
    """
    boxes = snapshot.state.boxes
    if not boxes:
        raise BadInput(f"session {snapshot.id} has no box that a sector of views could be round; make one first")
    if box_id is not None and box_id not in boxes:
        raise NotFound(f"session {snapshot.id} has no box {box_id} that a sector of views could be round")
    if box_id is not None:
        T_world_about = boxes[box_id].box.T_world_box
    else:
        T_world_about = np.eye(4)
        T_world_about[:3, 3] = np.mean([box.box.T_world_box[:3, 3] for _, box in sorted(boxes.items())], axis=0)
    return azimuths_round(snapshot.frames.Ts_world_camera[rows, :3, 3], T_world_about)


def _as_written(snapshot: SessionSnapshot, options: ExportOptions) -> SessionSnapshot:
    """The session with the cameras of the images as they are written."""
    if options.images != "rectify":
        return snapshot
    return replace(snapshot, cameras={i: rectified(camera) for i, camera in snapshot.cameras.items()})


def _views_of(
    snapshots: Sequence[SessionSnapshot], candidates: Sequence[Int[np.ndarray, "n"]], options: ExportOptions
) -> FrameViews:
    """What the candidates show, session after session; each has elements of its own."""
    most = max(len(snapshot.state.boxes) for snapshot in snapshots)
    total = sum(map(len, candidates))
    elements = np.full((total, most), NOTHING, dtype=np.int64)
    directions, distances = np.full((total, most, 3), np.nan), np.full((total, most), np.nan)
    first = 0
    for number, (snapshot, rows) in enumerate(zip(snapshots, candidates, strict=True)):
        views = session_views(snapshot, options, indices=rows.tolist())
        place = slice(first, first + len(rows)), slice(0, len(views.box_ids))
        found = directions_in_frames(views)
        elements[place] = np.where(found == NOTHING, NOTHING, found + number * most * BINS.cells)
        directions[place] = views.directions.transpose(1, 0, 2)
        cameras = snapshot.frames.Ts_world_camera[rows, :3, 3]
        for row, box_id in enumerate(views.box_ids):
            centre = snapshot.state.boxes[box_id].box.T_world_box[:3, 3]
            distances[first : first + len(rows), row] = np.linalg.norm(cameras - centre, axis=1)
        first += len(rows)
    return FrameViews(
        elements=elements,
        directions=directions,
        distances=distances,
        recording=np.repeat(np.arange(len(snapshots)), [len(rows) for rows in candidates]),
        index=np.concatenate(candidates),
    )
