"""What outlines give before anything of them is stored: for whoever is drawing, many times a second."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import shapely
from jaxtyping import Float

from ars_web.errors import BadInput, ViewsDisagree
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.camera import (
    Camera,
    image_from_pixels,
    normalised_from_pixels,
    pixels_from_camera_points,
    pixels_from_image,
)
from ars_web.geometry.hull_box import box_of_hull
from ars_web.geometry.mask_regions import multipolygon, polygons_of
from ars_web.geometry.mesh_silhouette import silhouette
from ars_web.geometry.next_view import SuggestedView, suggest_views
from ars_web.geometry.polygon import Polygon
from ars_web.geometry.view_guess import FrameRows, guess_of_hull, guesses_of_view
from ars_web.geometry.visual_hull import View, VisualHull, angle_between, band, visual_hull
from ars_web.masks.views import Photographed, camera_of
from ars_web.sessions.model import HullOptions

SMALL_ANGLE = math.radians(60.0)
"""Between the two views that are farthest apart, below which the hull is more than 2.7 times too large."""

WORTH_DRAWING = math.radians(5.0)
"""By which a further view must widen the angle, for it to be advised."""

LITTLE_LEFT = 0.4
"""Of the rectangle round an outline. Outlines of one object, drawn with care, leave nearly all of each other."""

DEPTHS = 100.0
"""An object is at most so many times as far from a camera as the recording is wide, and no nearer than that part."""

MOST_IN_BAND = 6
"""Views, evenly chosen, that a band is made of; it may be a little wide, not late."""

AROUND = 2.0
"""Radii of the image up to which overlays are told, so that their ends are not seen in it."""

SPECK = 1.0
"""Square pixels. Smaller pieces of overlays are left out: they come of rounding, where a silhouette is thin."""

COARSE = 0.25
"""Pixels that overlays are simplified to."""


@dataclass(frozen=True, eq=False)
class Overlay:
    """Where something of the object is in one frame; image coordinates.

    Attributes:
        kind: `band`: where the object must lie by the outlines in all other frames; `hull`: where the hull of all of
            them is seen.
    """

    frame: int
    polygons: tuple[Polygon, ...]
    kind: Literal["band", "hull"]


@dataclass(frozen=True, eq=False)
class HullPreview:
    """What outlines give.

    Attributes:
        hull, box: None where there are fewer than two views, or they give none.
        angle: radians between the two views that are farthest apart; None where there is no hull.
        problem: why there is none, of two views or more; ViewsDisagree where it is that.
        next_view: the frame to draw next; None where none would do more, or the views disagree. Where they are too much
            alike to tell anything, it is the best one beside the first.
        warnings: what is uncertain and what to do about it, in words.
    """

    hull: VisualHull | None
    box: Box | None
    angle: float | None
    overlays: tuple[Overlay, ...]
    problem: BadInput | None
    next_view: SuggestedView | None
    warnings: tuple[str, ...]


def preview_hull(
    taken: Photographed, views: Sequence[View], options: HullOptions, *, show_in: Sequence[int]
) -> HullPreview:
    """What outlines in one view or more give, with overlays for the frames of `show_in`.

    Raises:
        BadInput: a frame of `show_in` is not there.
    """
    hull, problem = _hull(views, options)
    angle = None if hull is None else angle_between(views, hull.centre_of_mass)
    next_view = _next_view(taken, views, hull) if problem is None or _tells_nothing(problem) else None
    return HullPreview(
        hull=hull,
        box=None if hull is None else box_of_hull(hull, orientation=options.orientation, position=options.position),
        angle=angle,
        overlays=_overlays(taken, views, options, hull, show_in),
        problem=problem,
        next_view=next_view,
        warnings=() if hull is None or angle is None else _warnings(taken, views, hull, angle, next_view),
    )


def _hull(views: Sequence[View], options: HullOptions) -> tuple[VisualHull | None, BadInput | None]:
    if len(views) < 2:
        return None, None
    try:
        return visual_hull(views, widen=options.widen, ground=options.ground), None
    except BadInput as error:
        return None, error


def _overlays(
    taken: Photographed, views: Sequence[View], options: HullOptions, hull: VisualHull | None, show_in: Sequence[int]
) -> tuple[Overlay, ...]:
    # By the frames of its views. Where a frame has no outline, all others are all.
    bands: dict[tuple[int, ...], VisualHull | None] = {}
    if hull is not None:
        bands[tuple(view.frame for view in views)] = hull
    overlays: list[Overlay] = []
    for frame in show_in:
        others = [view for view in views if view.frame != frame]
        frames = tuple(view.frame for view in others)
        if others and frames not in bands:
            bands[frames] = _band(taken, others, options)
        overlays += _overlay(taken, frame, bands.get(frames), "band")
        overlays += _overlay(taken, frame, hull, "hull")
    return tuple(overlays)


def _overlay(taken: Photographed, frame: int, mesh: VisualHull | None, kind: Literal["band", "hull"]) -> list[Overlay]:
    """One, or none where nothing of it can be seen."""
    if mesh is None:
        return []
    camera = camera_of(taken, frame)
    T_world_camera = taken.frames.Ts_world_camera[frame]
    region = silhouette(camera, T_world_camera, mesh.vertices, mesh.faces, reach=AROUND * _corner_radius(camera))
    around = shapely.box(-camera.width, -camera.height, 2 * camera.width, 2 * camera.height)
    seen = [part for part in multipolygon(region.intersection(around)).geoms if part.area >= SPECK]
    polygons = polygons_of(shapely.MultiPolygon(seen), tolerance=COARSE)
    return [Overlay(frame, polygons, kind)] if polygons else []


def _corner_radius(camera: Camera) -> float:
    """How far the image reaches in the normalised plane."""
    corners = np.array([[0, 0], [camera.width, 0], [camera.width, camera.height], [0, camera.height]], dtype=np.float64)
    radii = np.linalg.norm(normalised_from_pixels(camera, pixels_from_image(corners)), axis=1)
    return float(radii.max()) if np.isfinite(radii).all() else camera.valid_radius


def _band(taken: Photographed, views: Sequence[View], options: HullOptions) -> VisualHull | None:
    """Where the object may be by these views, or by some of them, which tell most of it; None where they give no
    place."""
    views = [views[i] for i in np.linspace(0, len(views) - 1, min(len(views), MOST_IN_BAND)).round().astype(int)]
    places = taken.frames.Ts_world_camera[:, :3, 3]
    reach = float(np.linalg.norm(places - places.mean(axis=0), axis=1).max()) or 1.0
    try:
        return band(views, depth=(reach / DEPTHS, reach * DEPTHS), widen=options.widen, ground=options.ground)
    except BadInput:
        return None


def _next_view(taken: Photographed, views: Sequence[View], hull: VisualHull | None) -> SuggestedView | None:
    rows = FrameRows(taken.cameras, taken.frames.camera_ids, taken.frames.Ts_world_camera)
    try:
        guesses = guesses_of_view(views[0], rows) if hull is None else guess_of_hull(hull)
    except BadInput:
        return None  # no other frame shows what is drawn
    found = suggest_views(guesses, [view.frame for view in views], rows)
    return found[0] if found else None


def _tells_nothing(problem: BadInput) -> bool:
    """Whether the views are not said to be wrong, only too much alike."""
    return isinstance(problem, ViewsDisagree) and all(math.isnan(pixels) for _, pixels in problem.misfits)


def _warnings(
    taken: Photographed, views: Sequence[View], hull: VisualHull, angle: float, next_view: SuggestedView | None
) -> tuple[str, ...]:
    """What is uncertain of a hull, and what to do about it."""
    found: list[str] = []
    left = {view.frame: _share_left(view, hull) for view in views}
    worst = min(left, key=lambda frame: left[frame])
    if left[worst] < LITTLE_LEFT:
        shares = ", ".join(f"{100 * share:.0f} % in frame {frame}" for frame, share in left.items())
        found.append(
            f"Little of the outlines is left in the hull ({shares}): one of them is of something else, or far too"
            " small. Look where the hull lies in each."
        )
    if angle < SMALL_ANGLE:
        further = 0.0
        if next_view is not None:
            there = View(next_view.frame, *_camera_at(taken, next_view.frame), views[0].polygons)
            further = angle_between([*views, there], hull.centre_of_mass)
        found.append(
            f"The outlines see the object from {math.degrees(angle):.0f} degrees apart at most, so that its depth is"
            " uncertain and the box too long. "
            + (
                "Draw it in a frame from further round, too."
                if further > angle + WORTH_DRAWING
                else "No frame shows it from much further round: say what it stands on, or fit the box to its masks."
            )
        )
    return tuple(found)


def _share_left(view: View, hull: VisualHull) -> float:
    """How much of the rectangle round an outline the one round the hull takes up, as its camera sees them; at least
    what is: a hull may go on beyond the image."""
    points = rigid_transform.transform_points(rigid_transform.invert(view.T_world_camera), hull.vertices)
    seen = image_from_pixels(pixels_from_camera_points(view.camera, points))
    seen = seen[np.isfinite(seen).all(axis=1)]
    drawn = np.concatenate([polygon.outer for polygon in view.polygons])
    if len(seen) == 0:
        return 0.0
    share = np.ptp(seen, axis=0).prod() / max(float(np.ptp(drawn, axis=0).prod()), 1e-12)
    return min(float(share), 1.0)


def _camera_at(taken: Photographed, frame: int) -> tuple[Camera, Float[np.ndarray, "4 4"]]:
    return camera_of(taken, frame), taken.frames.Ts_world_camera[frame]
