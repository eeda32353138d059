"""A box moved, turned and resized until its labels agree with where its object was seen: robust least squares on what
is exported, the box's label in each frame.

An object that is no box seldom touches the corners of the one round it, so the box whose labels are right is smaller
than the object's own. Where the object is a box, its outlines between the four sides are used, too: they tell more of
how it is turned.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from ars_web.errors import BadInput
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import CORNER_SIGNS, LARGEST_SIZE, Box, stack
from ars_web.geometry.box_parameters import PARAMETERS, STEP, BoxParameters, Orientation, upright_box, with_nearest_axes
from ars_web.geometry.box_sighting import SightedBoxes, Sighting
from ars_web.geometry.triangulation import Observation, triangulate

SMALLEST_START, LARGEST_START = 1e-3, 1e3
"""Metres, of the sizes that a search begins with."""

MOST_STEPS = 40

PIXEL = 1.0
"""What a careful person's outline is off; the scale below which nothing is called doubtful."""

BOX_SHAPED = 0.015
"""Of an object's size in an image: what outlines may be off a box's, in the root mean square, for it to be one."""

SMALLEST_EIGENVALUE = 1e-12
"""Of the normal equations, relative to the largest; below it they leave something open."""

MOST_STARTS = 6

ENOUGH_STARTS = 3
"""Where there are rows in plenty."""

MANY_STARTS = 12

FEW = 2
"""Rows for each number of a box's; where there are fewer, many starts are tried."""

SETTLED = 1.5
"""Pixels, in the root mean square, to which outlines are drawn; a fit as good as that needs no other start."""

PLENTY = 4
"""Rows for each parameter; where there are fewer, quite different boxes may fit."""

SAME_COST = 16.0
"""Squared pixels by which a box may fit worse and still be the true one: four standard deviations."""

LARGEST_ERROR = 0.12
"""Of the box's diagonal: how far off its worst corner may be, one standard deviation, if sides are seen to a pixel."""

WORST_FIT = 0.25
"""Of the size in the images: a box that is off by more, in the root mean square, is not round what was seen."""

DOUBTFUL = 3.5
"""Robust standard deviations (Iglewicz and Hoaglin 1993) beyond which a frame is an outlier."""

FEWEST_TO_DOUBT = 4
"""Frames; of fewer nobody can tell which is wrong."""


@dataclass(frozen=True, eq=False)
class BoxFit:
    """A box fitted to n sightings.

    Attributes:
        residuals_px: (n, 4) how far the sides of its labels, x0 y0 x1 y1, are to the right of or below the seen ones;
            0 for a side at the image's border that the label reaches.
        outliers: (n,) frames that agree with the box much worse than the others do.
        doubts: (n,) by how many robust standard deviations they do.
        rms_px: of all residuals.
        corner_error: metres, one standard deviation of the worst corner if every side was seen to a pixel.
        by_outline: whether the outlines between the four sides were used: the object is a box.
    """

    box: Box
    residuals_px: Float[np.ndarray, "n 4"]
    outliers: Bool[np.ndarray, "n"]
    doubts: Float[np.ndarray, "n"]
    rms_px: float
    corner_error: float
    by_outline: bool


def fit_box(start: Box, sightings: Sequence[Sighting], *, orientation: Orientation = "upright") -> BoxFit:
    """The box whose labels agree best with where an object was seen, found from a rough one.

    `upright`: position, turn about the world's z and size (7 numbers), after the axis of `start` that is nearest to
    the vertical was made vertical. `free`: all 9. Its axes are those nearest to the start's.

    Raises:
        BadInput: fewer than two sightings, two in one frame, sightings that do not determine the box, or that no box
            fits; the message says what to do.
    """
    _check(sightings)
    seen = SightedBoxes(sightings)
    # Slivers have nowhere to grow from: sizes change by factors.
    start = Box(start.T_world_box, np.clip(start.size, SMALLEST_START, LARGEST_START))
    first = upright_box(start) if orientation == "upright" else start
    starts = _starts(first, sightings, seen, orientation=orientation)
    fit = None
    if seen.has_outlines:
        fit = _best(starts, seen, orientation=orientation, by_outline=True)
        if _spread(seen.misfits(*stack([fit.box]), by_outline=True)) > _good(seen):
            starts, fit = [fit.box, *starts], None
    if fit is None:
        fit = _best(starts, seen, orientation=orientation, by_outline=False)
    off = seen.off(*stack([fit.box]))[0]
    rms = math.sqrt(float(np.mean(off**2)))
    _check_fit(fit, sightings, seen, off, orientation=orientation)
    doubts = _doubts(off)
    worst = np.abs(off).max(axis=1)
    outliers = (doubts > DOUBTFUL) & (worst > 3 * max(_good(seen), float(np.median(worst))))
    return BoxFit(with_nearest_axes(fit.box, first), off, outliers, doubts, rms, fit.corner_error, fit.by_outline)


def _check(sightings: Sequence[Sighting]) -> None:
    frames = [sighting.frame for sighting in sightings]
    if len(frames) < 2:
        raise BadInput(
            f"a box needs to be seen in two frames at least, from two sides, not in {len(frames)}; draw it in another"
        )
    twice = next((frame for frame in frames if frames.count(frame) > 1), None)
    if twice is not None:
        raise BadInput(f"frame {twice} is given twice; an object has one outline in a frame")


@dataclass(frozen=True, eq=False)
class _Solution:
    """What one search led to; `typical` is the median of what is off, pixels."""

    box: Box
    cost: float
    typical: float
    corner_error: float
    by_outline: bool


def _starts(first: Box, sightings: Sequence[Sighting], seen: SightedBoxes, *, orientation: Orientation) -> list[Box]:
    """Boxes to begin with, the most promising first: the given one, and where the object is seen, of the size that it
    is seen in, turned this way and that."""
    parameters = BoxParameters(first, orientation)
    turns = [np.zeros(3), *(np.array([0, 0, math.radians(angle)]) for angle in (-22.5, 22.5, 45))]
    if orientation == "free":
        tilt = math.radians(25)
        turns += [sign * tilt * axis for axis in np.eye(3)[:2] for sign in (-1.0, 1.0)]
    first_turned = [parameters.turned(turn) for turn in turns]
    candidates = list(first_turned)
    first_turned += [Box(box.T_world_box, np.full(3, np.exp(np.log(box.size).mean()))) for box in first_turned]
    centre = _seen_centre(sightings)
    if centre is not None:
        moved = [_at(box, centre, scale=1.0) for box in first_turned]
        labels = seen.labelled(*stack(moved))
        ratio = seen.sizes / np.sqrt(np.prod(labels[..., 2:] - labels[..., :2], axis=-1))
        for box, scale in zip(moved, np.nanmedian(ratio, axis=1), strict=True):
            if np.isfinite(scale) and 1e-3 < scale < 1e3 and (box.size * scale <= LARGEST_SIZE).all():
                candidates.append(_at(box, centre, scale=float(scale)))
    costs = np.median(np.abs(seen.misfits(*stack(candidates), by_outline=False)), axis=1)
    return [candidates[i] for i in np.argsort(costs, kind="stable")]


def _at(box: Box, centre: Float[np.ndarray, "3"], *, scale: float) -> Box:
    return Box(rigid_transform.from_rotation(box.T_world_box[:3, :3], centre), box.size * scale)


def _seen_centre(sightings: Sequence[Sighting]) -> Float[np.ndarray, "3"] | None:
    """Where the middles of what is seen meet; None where they do not, or too few are seen whole."""
    whole = [sighting for sighting in sightings if not sighting.cut.any() and not sighting.is_amodal]
    if len(whole) < 2:
        return None
    try:
        found = triangulate(
            [Observation(s.frame, s.camera, s.T_world_camera, (s.bbox[:2] + s.bbox[2:]) / 2) for s in whole]
        )
    except BadInput:  # The given box may still be near enough; whether it fits is checked in the end.
        return None
    return found.point_world


def _best(starts: Sequence[Box], seen: SightedBoxes, *, orientation: Orientation, by_outline: bool) -> _Solution:
    """The best of what a few starts lead to; one is enough where it leads to a good fit of so many rows that there is
    hardly another.

    Raises:
        BadInput: two boxes that differ fit as well.
    """
    rows = seen.misfits(*stack([starts[0]]), by_outline=by_outline).size
    plenty = rows >= PLENTY * PARAMETERS[orientation]
    few = rows < FEW * PARAMETERS[orientation]
    found: list[_Solution] = []
    for start in starts[: MANY_STARTS if few else MOST_STARTS]:
        found.append(_solve(start, seen, orientation=orientation, by_outline=by_outline))
        off = seen.misfits(*stack([found[-1].box]), by_outline=by_outline)
        if plenty and (math.sqrt(float(np.mean(off**2))) <= SETTLED * PIXEL or len(found) == ENOUGH_STARTS):
            break
        if len(found) == ENOUGH_STARTS and min(one.typical for one in found) > WORST_FIT * float(seen.sizes.max()):
            break  # what is seen is of no one object
    best = min(found, key=lambda solution: solution.cost)
    if not plenty:
        _check_one(best, found, seen)
    # Where an object is no box the misfits are large for all frames; none of them is an outlier for that.
    spread = 1.5 * _spread(seen.misfits(*stack([best.box]), by_outline=by_outline))
    if spread > _good(seen):
        return _solve(best.box, seen, orientation=orientation, by_outline=by_outline, scale=spread)
    return best


def _check_one(best: _Solution, found: Sequence[_Solution], seen: SightedBoxes) -> None:
    """Refuse where another box that is quite different fits as well."""
    allowed = LARGEST_ERROR * float(np.linalg.norm(best.box.size))
    rivals = [_corners_apart(best.box, other.box) for other in found if other.cost < best.cost + SAME_COST * PIXEL**2]
    if max(rivals) > allowed:
        more = "" if seen.has_outlines else ", or draw outlines in place of boxes"
        raise BadInput(
            f"two boxes whose corners are {max(rivals) * 1e3:.0f} mm apart agree with these frames equally well; add a"
            f" frame from another side{more}"
        )


def _corners_apart(a: Box, b: Box) -> float:
    """Metres from a corner of one box to the nearest of the other: the largest."""
    return float(np.linalg.norm(a.corners_world[:, None] - b.corners_world[None], axis=2).min(axis=1).max())


def _good(seen: SightedBoxes) -> float:
    """Pixels that a box's misfits may spread for it to have the shape that was seen."""
    return max(1.5 * PIXEL, BOX_SHAPED * float(np.median(seen.sizes)))


def _spread(misfits: Float[np.ndarray, "*n"]) -> float:
    """Robust standard deviation about 0, from the median of what is off."""
    return 1.4826 * float(np.median(np.abs(misfits)))


def _solve(
    start: Box,
    seen: SightedBoxes,
    *,
    orientation: Orientation,
    by_outline: bool,
    scale: float | None = None,
) -> _Solution:
    """Least squares from one start, by Huber's loss, linear beyond `scale` pixels."""
    # SciPy's optimisers take half a second to load, which commands that never fit a box need not wait for.
    from scipy.optimize import least_squares

    parameters = BoxParameters(start, orientation)

    def misfits(x: Float[np.ndarray, "p"]) -> Float[np.ndarray, "m"]:
        return seen.misfits(*parameters.placed(x[None]), by_outline=by_outline)[0]

    def slopes(x: Float[np.ndarray, "p"]) -> Float[np.ndarray, "m p"]:
        rows = seen.misfits(*parameters.around(x), by_outline=by_outline)
        return (rows[1:] - rows[0]).T / STEP

    scale = 2 * _good(seen) if scale is None else scale
    found = least_squares(
        misfits,
        np.zeros(parameters.count),
        jac=slopes,  # pyright: ignore[reportArgumentType]: the stubs know no callable here
        loss="huber",
        f_scale=scale,
        xtol=1e-4,
        ftol=1e-4,
        max_nfev=MOST_STEPS,
    )
    x = np.asarray(found.x, dtype=np.float64)
    off = misfits(x)
    weights = np.minimum(1.0, scale / np.maximum(np.abs(off), 1e-9))
    cost = float(np.sum(np.where(weights < 1, 2 * scale * np.abs(off) - scale**2, off**2)))
    return _Solution(
        parameters.box(x),
        cost,
        float(np.median(np.abs(off))),
        _corner_error(parameters, x, slopes(x), weights),
        by_outline,
    )


def _corner_error(
    parameters: BoxParameters,
    x: Float[np.ndarray, "p"],
    slopes: Float[np.ndarray, "m p"],
    weights: Float[np.ndarray, "m"],
) -> float:
    """Metres, one standard deviation of the worst corner if every row was seen to a pixel; infinity where the rows
    leave something open. To first order: the parameters' covariance is (J^T W J)^-1, a corner's is D of it D^T."""
    Ts_world_box, sizes = parameters.around(x)
    corners = rigid_transform.transform_points(Ts_world_box, CORNER_SIGNS * sizes[:, None] / 2)
    moves = (corners[1:] - corners[0]) / STEP
    values, vectors = np.linalg.eigh((slopes.T * weights) @ slopes)
    if not values[0] > SMALLEST_EIGENVALUE * values[-1]:
        return math.inf
    spread = np.einsum("pkc,pe->kce", moves, vectors / np.sqrt(values)) * PIXEL
    return float(np.linalg.norm(spread, axis=(1, 2)).max())


def _check_fit(
    fit: _Solution,
    sightings: Sequence[Sighting],
    seen: SightedBoxes,
    off: Float[np.ndarray, "n 4"],
    *,
    orientation: Orientation,
) -> None:
    """Refuse what is no answer."""
    lost = np.isnan(off).any(axis=1)
    if lost.any():
        frame = sightings[int(np.argmax(lost))].frame
        raise BadInput(
            f"no box that is seen in frame {frame} as it should be was found; place the box roughly on the object"
            " first, or leave that frame out"
        )
    frames = ", ".join(str(sighting.frame) for sighting in sightings)
    if not fit.corner_error <= LARGEST_ERROR * float(np.linalg.norm(fit.box.size)):
        more = "or fit an upright box, which needs fewer" if orientation == "free" else "such as from 60 to 90 degrees"
        raise BadInput(
            f"frames {frames} do not tell enough of the box: {_uncertainty(fit)}; add a frame from another side, {more}"
        )
    shares = np.sqrt(np.mean(off**2, axis=1)) / seen.sizes
    if np.median(shares) > WORST_FIT:
        worst = int(np.argmax(shares))
        raise BadInput(
            f"no one box agrees with frames {frames}: the best is {np.abs(off[worst]).max():.0f} px off in frame"
            f" {sightings[worst].frame}; look whether all of them show the same object"
        )


def _uncertainty(fit: _Solution) -> str:
    if not fit.corner_error < 10 * float(np.linalg.norm(fit.box.size)):
        return "it could be anywhere along some direction"
    return f"an error of a pixel would move its corners by {fit.corner_error * 1e3:.0f} mm"


def _doubts(off: Float[np.ndarray, "n 4"]) -> Float[np.ndarray, "n"]:
    """By how many robust standard deviations each frame agrees worse than the frames do in the middle."""
    worst = np.abs(off).max(axis=1)
    if len(worst) < FEWEST_TO_DOUBT:
        return np.zeros(len(worst))
    middle = np.median(worst)
    return (worst - middle) / max(1.4826 * float(np.median(np.abs(worst - middle))), PIXEL)
