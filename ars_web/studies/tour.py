"""Where to look next in a session: views that fill the empty cells of its objects' coverage, as a short tour."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ars_web.datasets.coverage import SessionViews, coverage_of
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.samples import kept, labels_in_frames
from ars_web.datasets.shapes import meshes_of
from ars_web.errors import BadInput, NotFound
from ars_web.geometry.box import Box
from ars_web.geometry.rigid_transform import Transform
from ars_web.geometry.sphere_bins import SphereBins
from ars_web.geometry.view_directions import view_directions
from ars_web.geometry.view_limits import (
    HALF_SEEN,
    LimitName,
    Range,
    ViewLimits,
    check_range,
    check_room,
    lean_of_world,
    tilts_of,
)
from ars_web.geometry.view_proposals import (
    REASONS,
    Proposals,
    ProposedView,
    Reason,
    Shown,
    WantedObject,
    propose_views,
)
from ars_web.geometry.view_tour import camera_turns, tour
from ars_web.sessions.model import SessionSnapshot

WIDENED = 0.1
"""Share of what the recording's own distances and heights extend over, that limits taken from it go beyond them."""

WIDENED_TILT = math.radians(5)

LEANS = math.radians(30)
"""From which lean on the world's z is doubted to be up. Hand-held cameras are level to within less."""

MOST_CELLS = 2_592
"""That views are looked for in: 72 x 36 bins, five degrees wide. Robots do not aim finer."""

LEAST_SEEN = 0.1
"""Share of an object that a proposed view shows at least, whatever is asked for: nobody goes to see what is hidden."""

MOST_VIEWS = 2_000

DEFAULT_BINS = SphereBins()

SAID: dict[Reason, str] = {
    "height": "the camera would be too low or too high",
    "tilt": "the camera would be tilted too much or too little",
    "near": "the camera would be in or too near a box",
    "large": "the object would not be whole in the image; allow more distance",
    "small": "the object would be too small in the image; allow less distance",
    "hidden": "other objects are in the way",
    "later": "further views would fill them; ask for more than the count",
}
"""Why cells stay empty, for people."""


@dataclass(frozen=True)
class TourRequest:
    """What kind of views are wanted; None: as the recording has it.

    Attributes:
        count: views at most.
        distance, height: metres.
        tilt: radians below the horizontal.
        min_visible: how much of an object must be seen, both in frames that count and in views proposed; None: frames
            count as an export without options labels them, and views show at least half.
        shape: what labels are drawn round, as exports have it.
        start_frame: the frame that the tour begins at; None: the last.
    """

    bins: SphereBins = DEFAULT_BINS
    count: int = 20
    distance: Range | None = None
    height: Range | None = None
    tilt: Range | None = None
    min_visible: float | None = None
    shape: str | None = None
    start_frame: int | None = None

    def __post_init__(self) -> None:
        """Raises BadInput for numbers that cannot be."""
        if not 1 <= self.count <= MOST_VIEWS:
            raise BadInput(f"the number of views must be from 1 to {MOST_VIEWS}, not {self.count}")
        if self.bins.cells > MOST_CELLS:
            raise BadInput(
                f"views are looked for in at most {MOST_CELLS} cells, 72 x 36 bins, not in {self.bins.azimuth} x"
                f" {self.bins.polar}"
            )
        if self.min_visible is not None and not 0.0 <= self.min_visible <= 1.0:
            raise BadInput(f"the share that must be visible is from 0 to 1, not {self.min_visible}")
        given: dict[LimitName, Range | None] = {"distance": self.distance, "height": self.height, "tilt": self.tilt}
        for name, limits in given.items():
            if limits is not None:
                check_range(name, limits)

    @property
    def options(self) -> ExportOptions:
        """Of an export that labels what counts as seen."""
        return ExportOptions.model_validate({"shape": self.shape, "min_visible": self.min_visible or 0.0})


@dataclass(frozen=True)
class Fill:
    """An empty cell that a view fills.

    Attributes:
        azimuth, polar: of the view's direction as the object sees it, folded by its symmetry, radians.
    """

    box_id: int
    cell: int
    azimuth: float
    polar: float


@dataclass(frozen=True, eq=False)
class TourStop:
    """A view of the tour; `labelled` are the ids of all boxes that an export would label there, `box_id` is the one
    looked at. The rest as in ProposedView."""

    T_world_camera: Transform
    box_id: int
    distance: float
    height: float
    tilt: float
    labelled: tuple[int, ...]
    fills: tuple[Fill, ...]


@dataclass(frozen=True)
class CellLeft:
    """An empty cell that no view of the tour fills, and why."""

    box_id: int
    cell: int
    reason: Reason


@dataclass(frozen=True, eq=False)
class Tour:
    """Views in the order in which to visit them.

    Attributes:
        start: where the tour begins, which is no view of it.
        length: metres from the start through all views.
        turn: radians that the camera turns on the way.
        limits: that were kept to.
        from_recording: the names of those limits that nobody gave.
        lean: radians between the world's z and the axis about which the frames' cameras are level.
        cells: of all chosen objects together, those that their symmetry leaves.
        empty: how many of them no frame lies in.
    """

    stops: tuple[TourStop, ...]
    start: Transform
    length: float
    turn: float
    limits: ViewLimits
    from_recording: tuple[str, ...]
    lean: float
    cells: int
    empty: int
    left: tuple[CellLeft, ...]

    @property
    def filled(self) -> int:
        """How many empty cells the views fill."""
        return sum(len(stop.fills) for stop in self.stops)

    @property
    def left_by_reason(self) -> dict[Reason, int]:
        """How many cells stay empty for each reason that occurs, in the order of REASONS."""
        counted = Counter(cell.reason for cell in self.left)
        return {reason: counted[reason] for reason in REASONS if counted[reason]}

    @property
    def doubts(self) -> list[str]:
        """What may make the views other than they seem, in words."""
        if self.lean <= LEANS:
            return []
        return [
            f"the cameras are level about an axis {math.degrees(self.lean):.0f} degrees off the world's z: if that is"
            " not up, heights and tilts are not what they say; turn the recording's poses so that z is up, and import"
            " it again"
        ]

    def lines(self) -> list[str]:
        """What a person wants to know of it, as lines to print."""
        limits = self.limits
        said = {
            "distance": f"distance {limits.distance[0]:.3g} to {limits.distance[1]:.3g} m",
            "height": f"height {limits.height[0]:.3g} to {limits.height[1]:.3g} m",
            "tilt": f"tilt {math.degrees(limits.tilt[0]):.3g} to {math.degrees(limits.tilt[1]):.3g} degrees",
        }
        kept_to = ", ".join(
            text + (" (as the frames)" if name in self.from_recording else "") for name, text in said.items()
        )
        lines = [f"limits: {kept_to}; at least {limits.min_visible:.0%} visible"]
        lines += self.doubts
        if not self.empty:
            return [*lines, f"nothing is empty: frames lie in all of the {self.cells} cells"]
        lines.append(
            f"{len(self.stops)} views fill {self.filled} of {self.empty} empty cells ({self.cells} in all); the way is"
            f" {self.length:.2f} m with {math.degrees(self.turn):.0f} degrees of turning, obstacles not looked at"
        )
        return lines + [f"{count} cells stay empty: {SAID[reason]}" for reason, count in self.left_by_reason.items()]


def plan_tour(snapshot: SessionSnapshot, views: SessionViews, rows: Sequence[int], request: TourRequest) -> Tour:
    """A short tour of views that fill the empty cells of the boxes at `rows`, one or more.

    `views` are the session's with `request.options`. The camera is that of the frame at which the tour begins.

    Raises:
        NotFound: there is no such frame to start from.
        BadInput: limits that cannot be, that exclude every view, or from which no object fits in the image.
    """
    frames, state = snapshot.frames, snapshot.state
    first = len(frames) - 1 if request.start_frame is None else request.start_frame
    if not 0 <= first < len(frames):
        raise NotFound(f"session {snapshot.id} has no frame {first}; its frames are 0 to {len(frames) - 1}")
    boxes = [box.box for _, box in sorted(state.boxes.items())]
    limits = _limits(snapshot, views, rows, request)
    check_room(limits, [boxes[row] for row in rows])
    camera, camera_id = snapshot.cameras[int(frames.camera_ids[first])], int(frames.camera_ids[first])
    meshes = meshes_of(snapshot, shape=request.shape)

    def look(Ts: Float[np.ndarray, "m 4 4"]) -> Shown:
        ids = np.full(len(Ts), camera_id)
        table = labels_in_frames(snapshot.cameras, ids, Ts, boxes, meshes=meshes)
        labelled, _ = kept(table, request.options)
        return Shown(table.bbox_amodal, labelled, table.visible)

    wanted: list[WantedObject] = []
    reached = 0
    for row in rows:
        coverage = coverage_of(views, request.bins, [row])
        reached += int(coverage.cells_reachable.sum())
        wanted.append(
            WantedObject(
                place=row,
                box=boxes[row],
                symmetry=views.symmetries[row],
                counts=coverage.cell_counts,
                wanted=coverage.cells_reachable & (coverage.cell_counts == 0),
                distances=_distances(snapshot, views, row, boxes[row].T_world_box[:3, 3], limits),
            )
        )
    found = propose_views(wanted, request.bins, limits, camera=camera, obstacles=boxes, look=look, count=request.count)
    _refuse_nothing(found, request, limits)
    stops = [_stop(view, views, boxes) for view in found.views]
    start = frames.Ts_world_camera[first]
    order = tour(start, np.array([stop.T_world_camera for stop in stops]).reshape(-1, 4, 4)).tolist()
    path = np.concatenate([start[None], *(stops[place].T_world_camera[None] for place in order)])
    steps = np.linalg.norm(np.diff(path[:, :3, 3], axis=0), axis=1)
    return Tour(
        stops=tuple(stops[place] for place in order),
        start=start,
        length=float(steps.sum()),
        turn=float(camera_turns(path).sum()),
        limits=limits,
        from_recording=tuple(name for name in ("distance", "height", "tilt") if getattr(request, name) is None),
        lean=lean_of_world(frames.Ts_world_camera),
        cells=reached,
        empty=sum(int(one.wanted.sum()) for one in wanted),
        left=tuple(CellLeft(views.box_ids[place], cell, reason) for place, cell, reason in found.left),
    )


def _limits(snapshot: SessionSnapshot, views: SessionViews, rows: Sequence[int], request: TourRequest) -> ViewLimits:
    """What was asked for, and the rest as the frames have it in which the objects at `rows` are labelled, a little
    widened; all frames count where none of them is."""
    Ts = snapshot.frames.Ts_world_camera
    counted = views.counted[list(rows)]
    if not counted.any():
        counted = np.ones_like(counted)
    seeing = Ts[counted.any(axis=0)]
    centres = [snapshot.state.boxes[views.box_ids[row]].box.T_world_box[:3, 3] for row in rows]
    away = np.stack([np.linalg.norm(Ts[:, :3, 3] - centre, axis=1) for centre in centres])[counted]
    near, far = float(away.min()), float(away.max())
    spread = WIDENED * max(far - near, WIDENED * far)
    low, high = float(seeing[:, 2, 3].min()), float(seeing[:, 2, 3].max())
    rise = WIDENED * max(high - low, WIDENED * far)
    tilts = tilts_of(seeing)
    tilt = max(float(tilts.min()) - WIDENED_TILT, -np.pi / 2), min(float(tilts.max()) + WIDENED_TILT, np.pi / 2)
    least = HALF_SEEN if request.min_visible is None else max(request.min_visible, LEAST_SEEN)
    return ViewLimits(
        distance=request.distance or (max(near - spread, near / 2), far + spread),
        height=request.height or (low - rise, high + rise),
        tilt=request.tilt or tilt,
        min_visible=least,
    )


def _distances(
    snapshot: SessionSnapshot, views: SessionViews, row: int, centre: Float[np.ndarray, "3"], limits: ViewLimits
) -> tuple[float, ...]:
    """From how far to look at an object: as far as the recording does mostly, then further away, then nearer."""
    near, far = limits.distance
    near = max(near, far / 100)
    seeing = snapshot.frames.Ts_world_camera[views.counted[row], :3, 3]
    usual = float(np.median(np.linalg.norm(seeing - centre, axis=1))) if len(seeing) else (near + far) / 2
    usual = min(max(usual, near), far)
    found: list[float] = []
    for distance in (usual, (usual + far) / 2, far, (usual + near) / 2, near):
        if all(abs(distance - other) > 0.01 * far for other in found):
            found.append(distance)
    return tuple(found)


def _refuse_nothing(found: Proposals, request: TourRequest, limits: ViewLimits) -> None:
    """Raises BadInput where somebody asked for distances from which no object is whole, large enough and apart."""
    if found.views or not found.left or request.distance is None:
        return
    near, far = limits.distance
    reasons = {reason for _, _, reason in found.left}
    for reason, fault in (
        ("small", "every object is too small in the image; allow less distance"),
        ("large", "no object is whole in the image; allow more distance"),
        ("near", f"the camera would be nearer than {limits.clearance:g} m to a box; allow more distance"),
    ):
        if reason in reasons and reasons <= {reason, "height", "tilt", "near"}:
            raise BadInput(f"from {near:g} to {far:g} m, the limits of distance, {fault}")


def _stop(view: ProposedView, views: SessionViews, boxes: Sequence[Box]) -> TourStop:
    fills: list[Fill] = []
    for place, cell in view.fills:
        eye = np.ascontiguousarray(view.T_world_camera[None, :3, 3])
        x, y, z = view_directions(eye, boxes[place], symmetry=views.symmetries[place])[0].tolist()
        fills.append(Fill(views.box_ids[place], cell, math.atan2(y, x), math.acos(min(max(z, -1.0), 1.0))))
    return TourStop(
        T_world_camera=view.T_world_camera,
        box_id=views.box_ids[view.place],
        distance=view.distance,
        height=view.height,
        tilt=view.tilt,
        labelled=tuple(views.box_ids[place] for place in view.labelled),
        fills=tuple(fills),
    )
