"""Where an object may be that little is known of yet: balls, from its hull, its box or one outline, and the frames of
a recording that show them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from ars_web.errors import BadInput
from ars_web.geometry import camera as cameras
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.viewing_cone import cone_of_mask
from ars_web.geometry.visual_hull import View, VisualHull

SMALLEST_DIAMETER = 24.0
"""Pixels. What is smaller in an image cannot be drawn well."""

DEPTHS = 32
"""Of an object that is drawn in one frame only: how far it may be, between a twentieth of the camera path's extent and
six times that, in even shares. Whoever holds a camera before a table moves it by less than the table is away."""

POINTED = 8
"""How sharply it counts that cameras point at a guess: cameras are pointed at what is recorded. On the cell's ten
objects, 8 put the middle guess within 4 % of the true distance, and 1 no nearer than 20 %."""

PROBED = 500
"""Frames, evenly spread, that tell how likely a guess is, and among which the judges are chosen."""


@dataclass(frozen=True, eq=False)
class Guess:
    """Where an object may be, as a ball.

    Attributes:
        centre_world: (3,) metres.
        radius: metres.
        weight: how likely it is there, in proportion to the other guesses.
    """

    centre_world: Float[np.ndarray, "3"]
    radius: float
    weight: float = 1.0


@dataclass(frozen=True, eq=False)
class FrameRows:
    """The frames of a recording, n of them.

    Attributes:
        by_id: the cameras.
        camera_ids: (n,) keys into them.
        Ts_world_camera: (n, 4, 4).
    """

    by_id: Mapping[int, Camera]
    camera_ids: Int[np.ndarray, "n"]
    Ts_world_camera: Float[np.ndarray, "n 4 4"]

    def __len__(self) -> int:
        return len(self.camera_ids)


def guess_of_hull(hull: VisualHull) -> list[Guess]:
    """A ball as large as the hull, at its centre of mass."""
    return [Guess(hull.centre_of_mass, (hull.volume * 0.75 / math.pi) ** (1 / 3))]


def guess_of_box(box: Box) -> list[Guess]:
    """A ball in a box, as wide as the box is on the average."""
    return [Guess(box.T_world_box[:3, 3], float(np.cbrt(np.prod(box.size))) / 2)]


def guesses_of_view(view: View, frames: FrameRows) -> list[Guess]:
    """Balls along the ray through what is drawn in one frame, those likelier that more frames show.

    Raises:
        BadInput: no frame but this one shows what is drawn; or its outline encloses nothing.
    """
    cone = cone_of_mask(view.frame, view.camera, view.T_world_camera, view.polygons, widen=0.0)
    sides = np.ptp(cone.frame_of_rings[0], axis=0)
    along_axis = float(cone.middle_world @ view.T_world_camera[:3, 2])
    centres = frames.Ts_world_camera[:, :3, 3]
    extent = 2 * float(np.median(np.linalg.norm(centres - np.median(centres, axis=0), axis=1)))
    rows = evenly(np.arange(len(frames)), PROBED)
    found: list[Guess] = []
    for depth in extent * np.geomspace(1 / 20, 6, DEPTHS):
        place = cone.centre_world + cone.middle_world * (depth / along_axis)
        guess = Guess(place, float(depth * math.sqrt(np.prod(sides)) / 2))
        pointed = float((shows(frames, rows, guess) * pointed_at(frames, rows, place)).mean())
        if pointed > 0:
            found.append(Guess(place, guess.radius, pointed**POINTED))
    if not found:
        raise BadInput(f"no other frame shows what is drawn in frame {view.frame}; draw it where more frames look")
    return found


def evenly(rows: Int[np.ndarray, "n"], most: int) -> Int[np.ndarray, "k"]:
    """At most so many of the rows, evenly spread, the first and the last among them."""
    if len(rows) <= most:
        return rows
    return rows[np.linspace(0, len(rows) - 1, most).round().astype(np.int64)]


def shows(frames: FrameRows, rows: Int[np.ndarray, "k"], guess: Guess) -> Bool[np.ndarray, "k"]:
    """Which frames show a ball whole and large enough to be drawn."""
    shown = np.zeros(len(rows), dtype=bool)
    rims = np.array([[0, 0], [-1, 0], [1, 0], [0, -1], [0, 1]]) * guess.radius
    for camera_id, these in by_camera(frames, rows):
        camera = frames.by_id[camera_id]
        Ts = frames.Ts_world_camera[rows[these]]
        centres = np.einsum("ni,nij->nj", guess.centre_world - Ts[:, :3, 3], Ts[:, :3, :3])
        points = np.repeat(centres[:, None], len(rims), axis=1)
        points[..., :2] += rims
        # A camera within a few radii sees the ball bent round it; its rims are not where the points are.
        points[centres[:, 2] < 2 * guess.radius] = np.nan
        pixels = cameras.pixels_from_camera_points(camera, points)
        widths = np.linalg.norm(pixels[:, 2] - pixels[:, 1], axis=1)
        heights = np.linalg.norm(pixels[:, 4] - pixels[:, 3], axis=1)
        whole = cameras.in_image(camera, pixels).all(axis=1)
        shown[these] = whole & (np.minimum(widths, heights) >= SMALLEST_DIAMETER)
    return shown


def pointed_at(
    frames: FrameRows, rows: Int[np.ndarray, "k"], point_world: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "k"]:
    """1 for frames with a point in the middle of the image, falling to 0 at its border and out of it."""
    pointed = np.zeros(len(rows))
    for camera_id, these in by_camera(frames, rows):
        camera = frames.by_id[camera_id]
        Ts = frames.Ts_world_camera[rows[these]]
        point = np.einsum("ni,nij->nj", point_world - Ts[:, :3, 3], Ts[:, :3, :3])
        half = np.array([camera.width, camera.height]) / 2
        image = cameras.image_from_pixels(cameras.pixels_from_camera_points(camera, point))
        off = np.abs(image / half - 1).max(axis=1)
        pointed[these] = np.where(off < 1, 1 - off * off, 0.0)
    return pointed


def by_camera(frames: FrameRows, rows: Int[np.ndarray, "k"]) -> list[tuple[int, Int[np.ndarray, "m"]]]:
    """Each camera's id with the places in `rows` of its frames."""
    ids = frames.camera_ids[rows]
    return [(camera_id, np.flatnonzero(ids == camera_id)) for camera_id in np.unique(ids).tolist()]
