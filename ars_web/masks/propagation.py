"""From two drawn outlines of an object to its outlines in further frames.

The hull of the drawn ones says where the object can be in any frame, and their pixels which colours it has: that
proposes an outline in each of some frames. Proposals are then held against each other, by what must be true of
outlines of one object: none may cut away what another one shows. So an outline that something in front of the object
makes too small is found out, whatever its colours. Those that agree narrow the hull, and from the narrower one all
are proposed anew, until it stops changing.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from jaxtyping import Bool, Float, UInt8

from ars_web.errors import BadFile, BadInput, TooLarge
from ars_web.geometry.camera import image_from_pixels, pixels_from_camera_points
from ars_web.geometry.mask_regions import polygons_of, region
from ars_web.geometry.mesh_silhouette import silhouette
from ars_web.geometry.rigid_transform import invert, transform_points
from ars_web.geometry.visual_hull import View, VisualHull, visual_hull
from ars_web.masks.agreement import CUTS_NOTHING, Agreement, Bench
from ars_web.masks.candidate_frames import candidate_frames
from ars_web.masks.close_up import CloseUp, close_up
from ars_web.masks.proposals import Palette, edge_agreement
from ars_web.masks.views import Photographed, camera_of

FRAMES_MOST = 10
"""Outlines that are added, unless asked otherwise."""

LOOKED_AT = 1.6
"""Frames that are looked at for each outline that is wanted: in some of them something hides the object."""

POINTS = 25_000
"""That stand for the hull."""

MOST_TRIED = 2_000_000
"""Points of the hull's box, of which those in the hull are taken; a hull much smaller than its box gets fewer."""

FEWEST_POINTS = 100
"""Fewer do not tell what an outline cuts away."""

CUTS_LITTLE = 0.06
"""Beyond it an outline is certainly wrong; up to it a person is asked."""

EDGES_AGREE = 0.5
"""The share of an outline along which the photograph must have an edge."""

EDGES_COUNT = 8
"""How an outline is trusted: the share of it that has an edge, to this power, as if it were right where so many places
of it are."""

SEEN_SMALLER = 0.8
"""The share of an outline that must be left by all others."""

STOPS_CHANGING = 0.002
"""The share of the hull that a further outline, or another round, must take off to be worth it."""

ROUNDS_MOST = 3

GROW = 0.5
"""Pixels of the close-up that proposals are widened by: what a cut by colours leaves out."""


@dataclass(frozen=True)
class Dropped:
    """A frame whose outline is not among the accepted ones, and why not."""

    frame: int
    reason: str


@dataclass(frozen=True, eq=False)
class Propagation:
    """What was found.

    Attributes:
        accepted: proposed outlines that agree with the drawn ones and with each other, the most telling first.
        doubtful: proposed outlines that a person should look at.
        doubts: why, of each doubtful one.
        dropped: frames that were looked at in vain, or whose outline would add nothing.
        hull: of the drawn and the accepted ones.
    """

    accepted: tuple[View, ...]
    doubtful: tuple[View, ...]
    doubts: tuple[Dropped, ...]
    dropped: tuple[Dropped, ...]
    hull: VisualHull


def propagate(
    drawn: Sequence[View],
    taken: Photographed,
    *,
    read: Callable[[int], UInt8[np.ndarray, "h w 3"]],
    frames_most: int = FRAMES_MOST,
    widen: float = 0.0,
    ground: float | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Propagation:
    """Outline the object of two drawn views or more in up to `frames_most` further frames.

    Args:
        drawn: outlines that are taken as true.
        read: the photograph of a frame, blue green red.
        widen, ground: as the hull is made.
        progress: called with (steps done, steps in all); what it raises ends the work.

    Raises:
        ViewsDisagree: the drawn outlines give no hull.
        BadInput: no other frame shows the object, or a number that cannot be.
    """
    if frames_most < 1:
        raise BadInput(f"at least 1 frame is to be outlined, not {frames_most}")
    hull = visual_hull(drawn, widen=widen, ground=ground)
    frames = candidate_frames(
        taken, hull, drawn=[view.frame for view in drawn], count=int(np.ceil(frames_most * LOOKED_AT))
    )
    if not frames:
        raise BadInput("no other frame shows the whole object: outline it by hand in one that shows a part of it")
    # Reading a photograph and the rounds of proposals take about as long each.
    steps = _Steps(progress, len(drawn) + len(frames) * (1 + ROUNDS_MOST))
    points, spacing = _points_within(hull, drawn, widen, ground)
    sources = [_shot(view.frame, taken, read, region(view.polygons), points, steps) for view in drawn]
    truths = [shot.raster(view.polygons) for shot, view in zip(sources, drawn, strict=True)]
    dropped: dict[int, str] = {}
    shots: dict[int, CloseUp] = {}
    possible: dict[int, Bool[np.ndarray, "h w"]] = {}
    for frame in frames:
        camera, T = camera_of(taken, frame), taken.frames.Ts_world_camera[frame]
        outline = silhouette(camera, T, hull.vertices, hull.faces)
        if not outline.intersects(shapely.box(0, 0, camera.width, camera.height)):
            dropped[frame] = "its photograph does not show the object"
            continue
        try:
            shots[frame] = _shot(frame, taken, read, outline, points, steps)
        except (BadFile, TooLarge) as error:
            dropped[frame] = f"its photograph cannot be read: {error}"
            continue
        possible[frame] = shots[frame].raster(polygons_of(outline.buffer(1.0 / shots[frame].scale)))
    bench = Bench(
        shots, points, spacing, {shot.frame: (shot, mask) for shot, mask in zip(sources, truths, strict=True)}
    )
    found, agreement = _rounds(bench, Palette(list(zip(sources, truths, strict=True))), possible, steps)
    chosen, doubts, unused = _sorted_out(bench, found, agreement, frames_most=frames_most)
    dropped |= unused

    def view(frame: int) -> View:
        shot = shots[frame]
        return View(frame, shot.camera, shot.T_world_camera, shot.polygons(found[frame], grow=GROW / shot.scale))

    accepted = [view(frame) for frame in chosen]
    return Propagation(
        accepted=tuple(accepted),
        doubtful=tuple(view(frame) for frame in sorted(doubts)),
        doubts=tuple(Dropped(frame, doubts[frame]) for frame in sorted(doubts)),
        dropped=tuple(Dropped(frame, dropped[frame]) for frame in sorted(dropped)),
        hull=visual_hull([*drawn, *accepted], widen=widen, ground=ground),
    )


class _Steps:
    """Counts what is done."""

    def __init__(self, progress: Callable[[int, int], None], total: int) -> None:
        self._progress, self._total, self._done = progress, total, 0
        progress(0, total)

    def advance(self) -> None:
        self._done += 1
        self._progress(min(self._done, self._total), self._total)


def _rounds(
    bench: Bench, palette: Palette, possible: dict[int, Bool[np.ndarray, "h w"]], steps: _Steps
) -> tuple[dict[int, Bool[np.ndarray, "h w"]], Agreement]:
    """Proposals of the last round, by frame, and how they stand to each other; `possible` becomes narrower."""
    found: dict[int, Bool[np.ndarray, "h w"]] = {}
    agreement = bench.agreement(found, trust={})
    for _ in range(ROUNDS_MOST):
        before = int(agreement.kept.sum())
        found = {}
        for frame, shot in bench.shots.items():
            mask = palette.propose(shot, possible[frame])
            if mask is not None:
                found[frame] = mask
            steps.advance()
        trust = {frame: edge_agreement(bench.shots[frame], mask) ** EDGES_COUNT for frame, mask in found.items()}
        agreement = bench.agreement(found, trust=trust)
        if before - int(agreement.kept.sum()) < STOPS_CHANGING * before:
            break
        for frame, cells in bench.cells.items():
            others = cells.of_points(bench.left_by_others(agreement, frame))
            possible[frame] = possible[frame] & cells.pixels(others)
    return found, agreement


def _sorted_out(
    bench: Bench,
    found: Mapping[int, Bool[np.ndarray, "h w"]],
    agreement: Agreement,
    *,
    frames_most: int,
) -> tuple[list[int], dict[int, str], dict[int, str]]:
    """Frames whose proposals count, the most telling first; those that a person is asked about, with why; and those
    that are dropped, with why."""
    doubts: dict[int, str] = {}
    dropped = {
        frame: "nothing there looks like the outlines that were drawn" for frame in bench.shots if frame not in found
    }
    for frame, (share, other) in agreement.cuts.items():
        if share > CUTS_NOTHING:
            hidden = "something hides the object, or looks like what is behind it"
            told = f"it would cut away {share:.0%} of what frame {other} shows: {hidden}"
        else:
            beyond = 1 - bench.seen_by_others(agreement, frame, found[frame])
            told = f"{beyond:.0%} of it is more than the other frames leave of the object"
        (doubts if share <= CUTS_LITTLE else dropped)[frame] = told
    sound: list[int] = []
    for frame in agreement.accepted:
        edges = edge_agreement(bench.shots[frame], found[frame])
        seen = bench.seen_by_others(agreement, frame, found[frame])
        if edges < EDGES_AGREE:
            doubts[frame] = f"{1 - edges:.0%} of its outline follow no edge in the photograph"
        elif seen < SEEN_SMALLER:
            doubts[frame] = f"{1 - seen:.0%} of it is more than the other frames leave of the object"
        else:
            sound.append(frame)
    kept = np.ones(len(bench.points), dtype=np.bool_)
    chosen: list[int] = []
    while sound and len(chosen) < frames_most:
        best = min(sound, key=lambda frame: (int((kept & agreement.left[frame]).sum()), frame))
        after = kept & agreement.left[best]
        if kept.sum() - after.sum() < STOPS_CHANGING * kept.sum():
            break
        kept = after
        chosen.append(best)
        sound.remove(best)
    for frame in sound:
        dropped[frame] = "it agrees with the others, and would hardly change the hull"

    return chosen, doubts, dropped


def _shot(
    frame: int,
    taken: Photographed,
    read: Callable[[int], UInt8[np.ndarray, "h w 3"]],
    outline: shapely.Geometry,
    points: Float[np.ndarray, "n 3"],
    steps: _Steps,
) -> CloseUp:
    made = close_up(
        read(frame),
        frame=frame,
        camera=camera_of(taken, frame),
        T_world_camera=taken.frames.Ts_world_camera[frame],
        region=outline,
        points=points,
    )
    steps.advance()
    return made


def _points_within(
    hull: VisualHull, drawn: Sequence[View], widen: float, ground: float | None
) -> tuple[Float[np.ndarray, "n 3"], float]:
    """Points on a grid inside the hull, and their spacing in metres."""
    low, high = hull.vertices.min(axis=0), hull.vertices.max(axis=0)
    spacing = max(hull.volume / POINTS, float(np.prod(high - low)) / MOST_TRIED) ** (1 / 3)
    axes = [np.arange(a + spacing / 2, b, spacing) for a, b in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    for view in drawn:
        seen = transform_points(invert(view.T_world_camera), points)
        image = image_from_pixels(pixels_from_camera_points(view.camera, seen))
        known = np.isfinite(image[:, 0])
        inside = ~known
        shown = image[known]
        area = region(view.polygons).buffer(widen)
        within = ((shown >= 0) & (shown <= (view.camera.width, view.camera.height))).all(axis=1)
        # Beyond the image's border an outline that touches it is open.
        inside[known] = ~within | shapely.contains_xy(area, shown[:, 0], shown[:, 1])
        points = points[inside]
    if len(points) < FEWEST_POINTS:
        raise BadInput(
            "the outlines leave hardly anything that they both show: widen the masks, or outline the object once more"
            " from another side"
        )
    return points, spacing
