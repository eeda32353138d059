"""Viewpoint coverage: from where a session's objects are seen in its frames, as histograms of directions.

A frame counts for an object where an export with the same options would label it there: what is not in the image, cut
too far or hidden too much teaches nobody how the object looks from that side. The paper's histogram has bins of equal
angles; the cells of equal area beside it say which share of all directions is missing.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from ars_web.datasets.options import ExportOptions
from ars_web.datasets.samples import kept, labels_in_frames
from ars_web.datasets.shapes import check_shape, meshes_of
from ars_web.errors import BadInput, NotFound
from ars_web.geometry.frame_blocks import over_blocks
from ars_web.geometry.sphere_bins import SphereBins
from ars_web.geometry.symmetry import Symmetry
from ars_web.geometry.view_directions import reachable, view_directions
from ars_web.sessions.model import SessionSnapshot, SessionState

SHOWN = 20
"""Boxes that are named where another was asked for."""


@dataclass(frozen=True, eq=False)
class SessionViews:
    """How n frames of a session see its b boxes, by ascending box id.

    Attributes:
        box_ids, class_ids: of each box.
        symmetries: of each box's class.
        directions: (b, n, 3) of unit length, from each box's centre to the camera's, in the box's frame, folded by the
            symmetry; NaN for a camera at the centre.
        counted: (b, n) whether the box is labelled in the frame.
    """

    box_ids: tuple[int, ...]
    class_ids: tuple[int, ...]
    symmetries: tuple[Symmetry, ...]
    directions: Float[np.ndarray, "b n 3"]
    counted: Bool[np.ndarray, "b n"]


@dataclass(frozen=True, eq=False)
class Coverage:
    """Views of some objects by direction, in a x p bins of equal angles and in k cells of equal area.

    Attributes:
        bins: whose edges and cells these are.
        counts: (a, p) views by azimuth and polar angle.
        reachable: (a, p) whether directions folded by the objects' symmetry can lie there at all.
        cell_counts, cells_reachable: (k,) the same of the cells.
        frames: in which any of the objects is labelled.
        views: labels of the objects in all frames; `counts` are as many, but for those of a camera at the object's very
            centre, which have no direction.
    """

    bins: SphereBins
    counts: Int[np.ndarray, "a p"]
    reachable: Bool[np.ndarray, "a p"]
    cell_counts: Int[np.ndarray, "k"]
    cells_reachable: Bool[np.ndarray, "k"]
    frames: int
    views: int

    @property
    def empty_fraction(self) -> float:
        """Share of the reachable bins of equal angles that no view lies in."""
        return float((self.counts[self.reachable] == 0).mean())

    @property
    def empty_area(self) -> float:
        """Share of the reachable directions, by area, that no view lies near: of the cells, those without a view."""
        return float((self.cell_counts[self.cells_reachable] == 0).mean())


def session_views(
    snapshot: SessionSnapshot, options: ExportOptions, *, indices: Sequence[int] | None = None
) -> SessionViews:
    """How the frames at `indices`, all of them by default, see the session's boxes, as an export would label them.

    Of the options count what decides of labels: the shape, visibility, truncation and area.

    Raises:
        BadInput: the options ask for a shape that no object has.
    """
    check_shape(options.shape, [snapshot])
    frames, state = snapshot.frames, snapshot.state
    rows = np.arange(len(frames)) if indices is None else np.asarray(indices, dtype=np.int64)
    boxes = [box for _, box in sorted(state.boxes.items())]
    table = labels_in_frames(
        snapshot.cameras,
        frames.camera_ids[rows],
        frames.Ts_world_camera[rows],
        [box.box for box in boxes],
        meshes=meshes_of(snapshot, shape=options.shape),
        with_visible=options.min_visible > 0,
    )
    keep, _ = kept(table, options)
    return views_where(snapshot, rows, keep)


def views_where(snapshot: SessionSnapshot, rows: Int[np.ndarray, "n"], keep: Bool[np.ndarray, "n b"]) -> SessionViews:
    """How the frames `rows` see the session's boxes where these, by ascending id, are labelled: `keep`."""
    boxes = [box for _, box in sorted(snapshot.state.boxes.items())]
    centres = np.ascontiguousarray(snapshot.frames.Ts_world_camera[rows, :3, 3])
    symmetries = tuple(snapshot.state.classes[box.class_id].symmetry for box in boxes)
    directions = np.empty((len(boxes), len(rows), 3))
    for row, (box, symmetry) in enumerate(zip(boxes, symmetries, strict=True)):
        directions[row] = view_directions(centres, box.box, symmetry=symmetry)
    return SessionViews(
        box_ids=tuple(box.id for box in boxes),
        class_ids=tuple(box.class_id for box in boxes),
        symmetries=symmetries,
        directions=directions,
        counted=np.ascontiguousarray(keep.T),
    )


def coverage_of(views: SessionViews, bins: SphereBins, rows: Sequence[int]) -> Coverage:
    """The histograms of the boxes at `rows`, one or more, together."""
    chosen = list(rows)

    def look(places: slice) -> Int[np.ndarray, "2 k"]:
        # NOWHERE is -1: one place further on, it is the first.
        counts = np.zeros((2, bins.cells + 1), dtype=np.int64)
        for row in chosen[places]:
            for kind, found in enumerate(bins.of(views.directions[row])):
                counts[kind] += np.bincount(found[views.counted[row]] + 1, minlength=bins.cells + 1)
        return counts

    found = np.sum(over_blocks(look, len(chosen), block=1), axis=0)
    angle_counts, cell_counts = found[:, 1:]
    counted = views.counted[chosen]
    angles_reachable, cells_reachable = np.zeros(bins.cells, dtype=bool), np.zeros(bins.cells, dtype=bool)
    for symmetry in {views.symmetries[row] for row in chosen}:
        of_angles, of_cells = reachable(bins, symmetry)
        angles_reachable |= of_angles
        cells_reachable |= of_cells
    shape = bins.azimuth, bins.polar
    return Coverage(
        bins=bins,
        counts=angle_counts.reshape(shape),
        # A view on the edge of what can be reached may be rounded into the next bin; it is there all the same.
        reachable=(angles_reachable | (angle_counts > 0)).reshape(shape),
        cell_counts=cell_counts,
        cells_reachable=cells_reachable | (cell_counts > 0),
        frames=int(counted.any(axis=0).sum()),
        views=int(counted.sum()),
    )


def frames_in_bin(
    views: SessionViews, bins: SphereBins, rows: Sequence[int], *, angle: int | None = None, cell: int | None = None
) -> list[tuple[int, int]]:
    """Which frames see which boxes from a bin: places of frames and of boxes, frame by frame.

    `angle` is azimuth bin * polar bins + polar bin, `cell` a cell of equal area; one of the two is given.

    Raises:
        NotFound: there is no such bin.
    """
    wanted = cell if angle is None else angle
    if wanted is None or not 0 <= wanted < bins.cells:
        raise NotFound(f"there is no bin {wanted}; of {bins.azimuth} x {bins.polar} they go from 0 to {bins.cells - 1}")
    found: list[tuple[int, int]] = []
    for row in rows:
        places = np.flatnonzero(views.counted[row])
        angles, cells = bins.of(views.directions[row][places])
        found.extend((int(place), row) for place in places[(cells if angle is None else angles) == wanted])
    return sorted(found)


def chosen_boxes(snapshot: SessionSnapshot, *, box_id: int | None = None, class_id: int | None = None) -> list[int]:
    """Places, by ascending id, of the boxes that are meant: one, those of a class, or all.

    Raises:
        NotFound: there is no such box or class, or no box of it.
        BadInput: both are given.
    """
    state = snapshot.state
    if box_id is not None and class_id is not None:
        raise BadInput("give a box or a class, not both: a box is of one class")
    if box_id is not None and box_id not in state.boxes:
        raise NotFound(f"session {snapshot.id} has no box {box_id}{_there_are(state)}")
    if class_id is not None and class_id not in state.classes:
        raise NotFound(f"session {snapshot.id} has no class {class_id}")
    found = [
        place
        for place, (_, box) in enumerate(sorted(state.boxes.items()))
        if box_id in (None, box.id) and class_id in (None, box.class_id)
    ]
    if not found and class_id is not None:
        raise NotFound(
            f"class {state.classes[class_id].name!r} has no box: it is never labelled. Make a box of it first"
        )
    if not found:
        raise NotFound(f"session {snapshot.id} has no box yet; make one first")
    return found


def _there_are(state: SessionState) -> str:
    """What boxes there are instead, as the end of a sentence."""
    known = [f"{i} {box.name}".rstrip() for i, box in sorted(state.boxes.items())]
    more = f" and {len(known) - SHOWN} more" if len(known) > SHOWN else ""
    return f"; its boxes are: {', '.join(known[:SHOWN])}{more}" if known else "; it has none yet"


def called(snapshot: SessionSnapshot, *, box_id: int | None = None, class_id: int | None = None) -> str:
    """What to call the objects that `chosen_boxes` finds."""
    state = snapshot.state
    if box_id is not None:
        box = state.boxes[box_id]
        return box.name or f"{state.classes[box.class_id].name} {box_id}"
    return "all objects" if class_id is None else state.classes[class_id].name
