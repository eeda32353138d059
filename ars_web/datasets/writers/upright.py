"""Boxes as formats know them whose objects stand upright before the camera: how far ours are from that, and the
nearest that do."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ars_web.datasets.planned import ExportPlan
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import stack
from ars_web.geometry.camera import in_image, pixels_from_camera_points, rectified

_AXES_ACROSS = np.array([[1, 2], [0, 2], [0, 1]])
"""For each axis that is up, the box's axes that are its length and its width: x before y before z."""

_AT_ONCE = 4096
"""Frames whose boxes are looked at together."""

_BINS_PER_DEGREE = 100


@dataclass(frozen=True, eq=False)
class UprightBoxes:
    """Of b boxes before n cameras, metres and radians, OpenCV's axes: y is down.

    Attributes:
        height_width_length: (n, b, 3).
        bottom: (n, b, 3) the bottom's centre.
        yaw: (n, b) about y; at 0 the length is along the camera's x, at a quarter turn along its -z.
    """

    height_width_length: Float[np.ndarray, "n b 3"]
    bottom: Float[np.ndarray, "n b 3"]
    yaw: Float[np.ndarray, "n b"]


def upright(Ts_camera_box: Float[np.ndarray, "n b 4 4"], sizes: Float[np.ndarray, "b 3"]) -> UprightBoxes:
    """The upright boxes with the same centres whose axes are the nearest.

    The axis nearest to the camera's y is the height; of the other two the first, in the order x, y, z, is the length
    and its positive end the front. The yaw is of the rotation about y that is nearest in the Frobenius norm.
    """
    R = Ts_camera_box[..., :3, :3]
    up = np.abs(R[..., 1, :]).argmax(axis=-1)
    along, across = _AXES_ACROSS[up][..., 0], _AXES_ACROSS[up][..., 1]
    length = np.take_along_axis(R, along[..., None, None], axis=-1)[..., 0]
    down = np.take_along_axis(R, up[..., None, None], axis=-1)[..., 0]
    down = np.where(down[..., 1:2] < 0, -down, down)
    width = np.cross(length, down)
    # Of the rotations [[c, 0, s], [0, 1, 0], [-s, 0, c]] the one with the largest trace of its transpose times ours.
    yaw = np.arctan2(width[..., 0] - length[..., 2], length[..., 0] + width[..., 2])
    boxes = np.arange(len(sizes))
    height = sizes[boxes, up]
    bottom = Ts_camera_box[..., :3, 3].copy()
    bottom[..., 1] += height / 2
    return UprightBoxes(np.stack([height, sizes[boxes, across], sizes[boxes, along]], axis=-1), bottom, yaw)


def tilts(R_camera_box: Float[np.ndarray, "*batch 3 3"]) -> Float[np.ndarray, "*batch"]:
    """Radians between the camera's y axis and the nearest of a box's axes, whichever its end."""
    return np.arccos(np.clip(np.abs(R_camera_box[..., 1, :]).max(axis=-1), 0.0, 1.0))


@dataclass(frozen=True)
class TiltCounts:
    """How boxes stand before their cameras.

    Attributes:
        count: of boxes whose centres are in an image, in all frames.
        tilted: of those that are tilted beyond what was asked.
        median, most: degrees; 0 where there is none.
    """

    count: int
    tilted: int
    median: float
    most: float


def count_tilts(plan: ExportPlan, *, beyond: float) -> TiltCounts:
    """How the plan's boxes stand; `beyond` in degrees. A box counts in a frame where its centre is in the image: which
    labels are kept would take as long as the export to know."""
    # A histogram, so that a plan of any length takes no more memory.
    histogram = np.zeros(90 * _BINS_PER_DEGREE + 1, dtype=np.int64)
    tilted, most = 0, 0.0
    for degrees in _tilts_in_images(plan):
        bins = np.rint(degrees * _BINS_PER_DEGREE).astype(np.int64)
        histogram += np.bincount(bins, minlength=len(histogram))
        tilted += int((degrees > beyond).sum())
        most = max(most, float(degrees.max(initial=0.0)))
    count = int(histogram.sum())
    median = float(np.searchsorted(np.cumsum(histogram), (count + 1) // 2)) / _BINS_PER_DEGREE if count else 0.0
    return TiltCounts(count, tilted, median, most)


def _tilts_in_images(plan: ExportPlan) -> Iterator[Float[np.ndarray, "m"]]:
    frames = plan.frames
    for number, session in enumerate(plan.sessions):
        Ts_world_box, _ = stack(list(session.boxes))
        for camera_id, camera in session.cameras.items():
            seen_by = rectified(camera) if plan.options.images == "rectify" else camera
            rows = np.flatnonzero((frames.session == number) & (frames.camera_id == camera_id))
            for first in range(0, len(rows), _AT_ONCE):
                Ts = rigid_transform.invert(frames.Ts_world_camera[rows[first : first + _AT_ONCE]])[:, None]
                Ts_camera_box = Ts @ Ts_world_box[None]
                there = in_image(seen_by, pixels_from_camera_points(seen_by, Ts_camera_box[..., :3, 3]))
                yield np.degrees(tilts(Ts_camera_box[..., :3, :3][there]))
