"""Where to look next: camera poses that see objects from directions in which no frame has seen them yet.

Poses are tried for each empty cell of an object: along directions in the cell, and along all others that the object's
symmetry makes look the same, at a few distances, the camera upright and looking at the object's centre. What each pose
shows, of all objects, is asked of the labels, so a pose is credited with every empty cell that it fills. Of the poses
those are chosen, one after the other, that fill most of what is still empty.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from jaxtyping import Bool, Float, Int

from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.cell_samples import alike, cell_samples
from ars_web.geometry.rigid_transform import Transform
from ars_web.geometry.sphere_bins import SphereBins
from ars_web.geometry.symmetry import Symmetry
from ars_web.geometry.view_directions import view_directions
from ars_web.geometry.view_limits import ViewLimits, looking_at, tilts_of

Reason = Literal["height", "tilt", "near", "large", "small", "hidden", "later"]
"""Why a cell is filled by no view. What a pose is asked is asked in this order, and the reason is that of the pose that
got furthest; `later`: there are poses, and fewer views were asked for."""

REASONS: tuple[Reason, ...] = get_args(Reason)

MARGIN = 0.02
"""Of the image's shorter side, that an object stays away from the image's border."""

SMALLEST = 0.05
"""Of the image's shorter side, that the longer side of an object's box in the image has at least."""

OTHERS = 1e-3
"""How much it counts to see cells again that are thinly seen, beside filling the one that is furthest from any seen."""

LOOKED_AT_ONCE = 200_000
"""Poses times objects that are looked at together, so that memory does not grow with the product of both."""

_DIGITS = 9
"""Of what a pose adds. Poses that add as much, which is common round a cube, are chosen alike on every machine."""

_UNTRIED, _FOUND = -1, len(REASONS)


@dataclass(frozen=True, eq=False)
class Shown:
    """What m poses show of b objects; image coordinates.

    Attributes:
        bbox_amodal: (m, b, 4) of the whole object; NaN where none of it is before the camera.
        labelled: (m, b) whether an export would label it.
        visible: (m, b) share that nothing nearer hides; NaN where it is not in the image.
    """

    bbox_amodal: Float[np.ndarray, "m b 4"]
    labelled: Bool[np.ndarray, "m b"]
    visible: Float[np.ndarray, "m b"]


Look = Callable[[Float[np.ndarray, "m 4 4"]], Shown]
"""Finds out what poses show."""


@dataclass(frozen=True, eq=False)
class WantedObject:
    """An object that views are wanted of.

    Attributes:
        place: which of the b objects it is.
        counts: (k,) views of each cell of its directions.
        wanted: (k,) whether a view of the cell is wanted.
        distances: metres to look at it from, the one to try first in front.
    """

    place: int
    box: Box
    symmetry: Symmetry
    counts: Int[np.ndarray, "k"]
    wanted: Bool[np.ndarray, "k"]
    distances: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class ProposedView:
    """A pose, and what it is for.

    Attributes:
        place: of the object looked at.
        distance: metres from its centre.
        height: z of the camera in the world, metres.
        tilt: of the camera's axis below the horizontal, radians.
        labelled: places of all objects that an export would label there.
        fills: (place, cell) of the empty cells that it fills, which no view chosen before it does.
    """

    T_world_camera: Transform
    place: int
    distance: float
    height: float
    tilt: float
    labelled: tuple[int, ...]
    fills: tuple[tuple[int, int], ...]


@dataclass(frozen=True, eq=False)
class Proposals:
    """Views in the order in which they were chosen, the most useful first, and (place, cell, reason) of the wanted
    cells that stay empty."""

    views: tuple[ProposedView, ...]
    left: tuple[tuple[int, int, Reason], ...]


def propose_views(
    objects: Sequence[WantedObject],
    bins: SphereBins,
    limits: ViewLimits,
    *,
    camera: Camera,
    obstacles: Sequence[Box],
    look: Look,
    count: int | None = None,
) -> Proposals:
    """At most `count` views that fill the wanted cells of the objects; None: as many as it takes to fill all that can
    be filled.

    A cell counts as filled by a view that shows its object whole, large enough and as visible as the limits ask.
    `obstacles`: boxes that the camera stays clear of.
    """
    poses = _Poses(objects, bins, limits, camera, obstacles, look)
    tried = poses.tried()
    chosen = _chosen(tried, objects, bins, count)
    filled = {pair for view in chosen for pair in view.fills}
    left: list[tuple[int, int, Reason]] = []
    for row, wanted in enumerate(objects):
        for cell in np.flatnonzero(wanted.wanted).tolist():
            if (wanted.place, cell) not in filled:
                stage = int(tried.stages[row, cell])
                left.append((wanted.place, cell, "later" if stage == _FOUND else REASONS[max(stage, 0)]))
    return Proposals(tuple(chosen), tuple(left))


@dataclass(frozen=True, eq=False)
class _Tried:
    """m poses that fill something, and how far the poses of each cell got.

    Attributes:
        cells: (m, c) the cell that each wanted object is well seen from; -1 where it is not.
        stages: (c, k) the place in REASONS that the best pose of each cell failed at, or _FOUND, or _UNTRIED.
    """

    Ts_world_camera: Float[np.ndarray, "m 4 4"]
    rows: Int[np.ndarray, "m"]
    labelled: Bool[np.ndarray, "m b"]
    cells: Int[np.ndarray, "m c"]
    stages: Int[np.ndarray, "c k"]


class _Poses:
    """Tries poses for the wanted cells of objects, the likeliest first, until each cell has some or none is left."""

    def __init__(
        self,
        objects: Sequence[WantedObject],
        bins: SphereBins,
        limits: ViewLimits,
        camera: Camera,
        obstacles: Sequence[Box],
        look: Look,
    ) -> None:
        self._objects, self._bins, self._limits = objects, bins, limits
        self._camera, self._obstacles, self._look = camera, obstacles, look
        self._stages = np.full((len(objects), bins.cells), _UNTRIED)

    def tried(self) -> _Tried:
        """All poses that fill something."""
        b = len(self._obstacles)
        parts = [
            (np.zeros((0, 4, 4)), np.zeros(0, int), np.zeros((0, b), bool), np.zeros((0, len(self._objects)), np.int32))
        ]
        step = max(1, LOOKED_AT_ONCE // max(1, b))
        for eyes, rows, cells in self._rounds():
            for first in range(0, len(eyes), step):
                some = slice(first, first + step)
                parts.append(self._useful(eyes[some], rows[some], cells[some]))
        Ts, rows, labelled, seen = (np.concatenate(column) for column in zip(*parts, strict=True))
        return _Tried(Ts, rows, labelled, seen, self._stages)

    def _useful(
        self, eyes: Float[np.ndarray, "m 3"], rows: Int[np.ndarray, "m"], cells: Int[np.ndarray, "m"]
    ) -> tuple[Float[np.ndarray, "u 4 4"], Int[np.ndarray, " u"], Bool[np.ndarray, "u b"], Int[np.ndarray, "u c"]]:
        """Of the poses at these eyes, each for the object of its row and one of its cells, those that fill something:
        the columns of `_Tried`. How far all of them got is noted."""
        targets = np.array([wanted.box.T_world_box[:3, 3] for wanted in self._objects])[rows]
        Ts = looking_at(eyes, targets)
        stages = self._stage_in_space(Ts)
        free = np.flatnonzero(stages == _FOUND)
        shown = self._look(Ts[free])
        clear = self._seen_well(shown)
        at = np.array([wanted.place for wanted in self._objects])
        stages[free] = self._stage_in_image(shown, at[rows[free]], np.arange(len(free)), clear)
        seen = self._cells_seen(Ts[free], clear[:, at])
        self._note(rows, cells, stages, seen)
        useful = self._fills(seen).any(axis=1)
        return Ts[free][useful], rows[free][useful], shown.labelled[useful], seen[useful]

    def _rounds(
        self,
    ) -> Iterator[tuple[Float[np.ndarray, "m 3"], Int[np.ndarray, "m"], Int[np.ndarray, "m"]]]:
        """Eyes, and of which object and cell, for all cells that no pose fills yet: from the middle of cells first,
        then from ever more of each, and from each at all distances, the usual ones first."""
        samples = [cell_samples(self._bins, wanted.symmetry) for wanted in self._objects]
        most, first, width = samples[0].shape[1] if samples else 0, 0, 1
        while first < most:
            for turn in range(max(len(wanted.distances) for wanted in self._objects)):
                eyes: list[Float[np.ndarray, "_ 3"]] = []
                rows: list[Int[np.ndarray, " _"]] = []
                cells: list[Int[np.ndarray, " _"]] = []
                for row, wanted in enumerate(self._objects):
                    empty = np.flatnonzero(wanted.wanted & (self._stages[row] < _FOUND))
                    if turn >= len(wanted.distances) or not len(empty):
                        continue
                    some = samples[row][empty, first : first + width]
                    directions = alike(some.reshape(-1, 3), wanted.symmetry)
                    of = np.repeat(np.repeat(empty, some.shape[1]), directions.shape[1])
                    flat = directions.reshape(-1, 3)
                    there = np.isfinite(flat).all(axis=1)
                    T = wanted.box.T_world_box
                    eyes.append(T[:3, 3] + wanted.distances[turn] * flat[there] @ T[:3, :3].T)
                    rows.append(np.full(int(there.sum()), row))
                    cells.append(of[there])
                if eyes:
                    yield np.concatenate(eyes), np.concatenate(rows), np.concatenate(cells)
            first, width = first + width, 3 * width

    def _stage_in_space(self, Ts: Float[np.ndarray, "m 4 4"]) -> Int[np.ndarray, "m"]:
        """Where in REASONS each pose fails by where it is; _FOUND where it does not."""
        limits, centres = self._limits, Ts[:, :3, 3]
        stages = np.full(len(Ts), _FOUND)
        near = np.zeros(len(Ts), dtype=bool)
        for box in self._obstacles:
            local = (centres - box.T_world_box[:3, 3]) @ box.T_world_box[:3, :3]
            near |= np.linalg.norm(np.maximum(np.abs(local) - box.size / 2, 0.0), axis=1) < limits.clearance
        stages[near] = REASONS.index("near")
        stages[~_within(tilts_of(Ts), limits.tilt)] = REASONS.index("tilt")
        stages[~_within(centres[:, 2], limits.height)] = REASONS.index("height")
        return stages

    def _seen_well(self, shown: Shown) -> Bool[np.ndarray, "m b"]:
        """Whether each object is whole, large enough and visible enough."""
        whole, large = self._whole(shown), self._large_enough(shown)
        return shown.labelled & whole & large & (shown.visible >= self._limits.min_visible)

    def _whole(self, shown: Shown) -> Bool[np.ndarray, "m b"]:
        x0, y0, x1, y1 = np.moveaxis(shown.bbox_amodal, -1, 0)
        margin = MARGIN * min(self._camera.width, self._camera.height)
        inside_x = (x0 >= margin) & (x1 <= self._camera.width - margin)
        return inside_x & (y0 >= margin) & (y1 <= self._camera.height - margin)

    def _large_enough(self, shown: Shown) -> Bool[np.ndarray, "m b"]:
        x0, y0, x1, y1 = np.moveaxis(shown.bbox_amodal, -1, 0)
        return np.maximum(x1 - x0, y1 - y0) >= SMALLEST * min(self._camera.width, self._camera.height)

    def _stage_in_image(
        self, shown: Shown, at: Int[np.ndarray, "m"], poses: Int[np.ndarray, "m"], clear: Bool[np.ndarray, "m b"]
    ) -> Int[np.ndarray, "m"]:
        """Where in REASONS each pose fails by how the object at `at` is seen; _FOUND where it does not."""
        stages = np.full(len(poses), REASONS.index("hidden"))
        stages[~self._large_enough(shown)[poses, at]] = REASONS.index("small")
        stages[~self._whole(shown)[poses, at]] = REASONS.index("large")
        stages[clear[poses, at]] = _FOUND
        return stages

    def _cells_seen(self, Ts: Float[np.ndarray, "m 4 4"], clear: Bool[np.ndarray, "m c"]) -> Int[np.ndarray, "m c"]:
        """The cell from which each wanted object is seen well; -1 where it is not."""
        centres = np.ascontiguousarray(Ts[:, :3, 3])
        cells = np.full(clear.shape, -1, dtype=np.int32)
        for row, wanted in enumerate(self._objects):
            _, found = self._bins.of(view_directions(centres, wanted.box, symmetry=wanted.symmetry))
            cells[:, row] = np.where(clear[:, row], found, -1)
        return cells

    def _fills(self, seen: Int[np.ndarray, "m c"]) -> Bool[np.ndarray, "m c"]:
        wanted = np.array([one.wanted for one in self._objects])
        return (seen >= 0) & wanted[np.arange(len(wanted)), seen]

    def _note(
        self,
        rows: Int[np.ndarray, "m"],
        cells: Int[np.ndarray, "m"],
        stages: Int[np.ndarray, "m"],
        seen: Int[np.ndarray, "f c"],
    ) -> None:
        """Keep how far the poses got. A pose that was meant for a cell may, by rounding, lie in the next: only what it
        is seen from counts as found."""
        np.maximum.at(self._stages, (rows, cells), np.minimum(stages, REASONS.index("hidden")))
        poses, of = np.nonzero(seen >= 0)
        self._stages[of, seen[poses, of]] = _FOUND


def _chosen(tried: _Tried, objects: Sequence[WantedObject], bins: SphereBins, count: int | None) -> list[ProposedView]:
    """Greedily the poses that fill most cells still empty; of those that fill as many, the one whose cells are the
    furthest from any that is seen, then the one that sees the thinnest others, each weighing 1 / (1 + its views).

    What a pose adds only falls as others are chosen, so the greedy choice of any number fills at least 63 % of what
    the best choice would (Nemhauser et al., 1978).
    """
    counts = np.array([wanted.counts for wanted in objects])
    empty = np.array([wanted.wanted for wanted in objects])
    gaps = np.stack([_gaps(bins, np.flatnonzero(row)) for row in counts])
    columns, seen = np.arange(len(objects)), tried.cells
    there, chosen = seen >= 0, list[ProposedView]()
    while len(seen) and (count is None or len(chosen) < count):
        fills = there & empty[columns, seen]
        aside = np.where(fills, gaps[columns, seen] / np.pi, 0.0).sum(axis=1)
        others = np.where(there & ~fills, 1.0 / (1.0 + counts[columns, seen]), 0.0).sum(axis=1)
        # Both together are less than one cell, however many objects are seen.
        gains = np.round(fills.sum(axis=1) + (aside + OTHERS * others) / (1 + len(objects)), _DIGITS)
        gains[~fills.any(axis=1)] = 0.0
        best = int(np.argmax(gains))
        if gains[best] <= 0.0:
            break
        pairs = [(row, int(seen[best, row])) for row in np.flatnonzero(fills[best]).tolist()]
        chosen.append(_view(tried, best, objects, tuple((objects[row].place, cell) for row, cell in pairs)))
        for row in np.flatnonzero(there[best]).tolist():
            counts[row, seen[best, row]] += 1
            empty[row, seen[best, row]] = False
            gaps[row] = np.minimum(gaps[row], _gaps(bins, seen[best, row : row + 1]))
    return chosen


def _gaps(bins: SphereBins, seen: Int[np.ndarray, "s"]) -> Float[np.ndarray, "k"]:
    """Radians from the middle of each cell to that of the nearest that is seen; pi where none is."""
    middles = bins.cell_directions
    nearest = (middles @ middles[seen].T).max(axis=1, initial=-1.0)
    return np.arccos(np.clip(nearest, -1.0, 1.0))


def _view(
    tried: _Tried, pose: int, objects: Sequence[WantedObject], fills: tuple[tuple[int, int], ...]
) -> ProposedView:
    T = tried.Ts_world_camera[pose]
    wanted = objects[int(tried.rows[pose])]
    return ProposedView(
        T_world_camera=T,
        place=wanted.place,
        distance=float(np.linalg.norm(T[:3, 3] - wanted.box.T_world_box[:3, 3])),
        height=float(T[2, 3]),
        tilt=float(tilts_of(T[None])[0]),
        labelled=tuple(np.flatnonzero(tried.labelled[pose]).tolist()),
        fills=fills,
    )


def _within(values: Float[np.ndarray, "m"], limits: tuple[float, float]) -> Bool[np.ndarray, "m"]:
    return (values >= limits[0]) & (values <= limits[1])
