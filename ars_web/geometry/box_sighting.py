"""Where an object was seen in frames, and what a box placed round it would be labelled there."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from jaxtyping import Bool, Float

from ars_web.errors import BadInput
from ars_web.geometry.camera import Camera
from ars_web.geometry.labels import labels_of_stacked, outlines_of_stacked
from ars_web.geometry.rigid_transform import Transform

AT_BORDER = 1.5
"""Pixels. A side that is seen nearer to the image's border is taken to be cut by it: nobody draws more exactly."""

SMALLEST = 2.0
"""Pixels. Of less than that, width or height, a box says nothing about a size."""

TOLERANCE = 5e-3
"""Pixels that a label may be off, so that the difference of two is a slope."""

BETWEEN = np.array([[np.cos(a), np.sin(a)] for a in np.arange(16) * np.pi / 8 if round(a * 8 / np.pi) % 4])
"""(12, 2) Directions between the four of a box's sides, in which an outline is compared as well."""


@dataclass(frozen=True, eq=False)
class Sighting:
    """Where an object is seen in a frame, image coordinates.

    A box within the image is round the part of the object that lies in it; one that reaches out of it, by more than
    half a pixel, is round the whole object.

    Attributes:
        frame: its index, for messages.
        bbox: (4,) x0, y0, x1, y1.
        outline: (k, 2) the corners of the outline's convex hull; None where only the box is known.
    """

    frame: int
    camera: Camera
    T_world_camera: Transform
    bbox: Float[np.ndarray, "4"]
    outline: Float[np.ndarray, "k 2"] | None = None

    def __post_init__(self) -> None:
        """Raises BadInput for a box that is not finite, smaller than SMALLEST, or wholly out of the image."""
        x0, y0, x1, y1 = self.bbox.tolist()
        if not np.isfinite(self.bbox).all():
            raise BadInput(f"frame {self.frame}: a box's sides must be finite numbers, not {self.bbox.tolist()}")
        if x1 - x0 < SMALLEST or y1 - y0 < SMALLEST:
            raise BadInput(
                f"frame {self.frame}: {_sides(self.bbox)} is no box to fit to; x0, y0, x1, y1 are needed, at least"
                f" {SMALLEST:g} pixels apart"
            )
        if not (x0 < self.camera.width and y0 < self.camera.height and x1 > 0 and y1 > 0):
            raise BadInput(
                f"frame {self.frame}: {_sides(self.bbox)} is outside the image, which is {self.camera.width} x"
                f" {self.camera.height} pixels"
            )

    @property
    def size(self) -> Float[np.ndarray, "2"]:
        """Width and height, pixels."""
        return self.bbox[2:] - self.bbox[:2]

    @property
    def is_amodal(self) -> bool:
        """Whether the box is round the whole object, also where that is out of the image."""
        beyond = np.concatenate([-self.bbox[:2], self.bbox[2:] - self.image_size])
        return bool((beyond > 0.5).any())

    @property
    def cut(self) -> Bool[np.ndarray, "4"]:
        """Which sides the image's border cuts, so that the object reaches as far or further."""
        if self.is_amodal:
            return np.zeros(4, dtype=bool)
        return np.concatenate([self.bbox[:2] < AT_BORDER, self.bbox[2:] > self.image_size - AT_BORDER])

    @property
    def image_size(self) -> Float[np.ndarray, "2"]:
        """Width and height of the image, pixels."""
        return np.array([self.camera.width, self.camera.height], dtype=np.float64)


def _sides(bbox: Float[np.ndarray, "4"]) -> str:
    return "[" + ", ".join(f"{side:g}" for side in bbox.tolist()) + "]"


def sighting_of_region(frame: int, camera: Camera, T_world_camera: Transform, region: shapely.Geometry) -> Sighting:
    """A mask as a sighting: the bounding box of its part in the image, and that part's convex hull.

    Raises:
        BadInput: there is nothing of it in the image, or too little.
    """
    seen = shapely.intersection(region, shapely.box(0, 0, camera.width, camera.height))
    if shapely.area(seen) == 0:
        raise BadInput(f"frame {frame}: the mask has nothing in the image; draw it on the object")
    hull = shapely.get_coordinates(shapely.convex_hull(seen))[:-1]
    return Sighting(frame, camera, T_world_camera, shapely.bounds(seen), hull)


class SightedBoxes:
    """What boxes would be labelled in the frames of n sightings, against what was seen there."""

    def __init__(self, sightings: Sequence[Sighting]) -> None:
        self._sightings = sightings
        self._seen = np.array([sighting.bbox for sighting in sightings])
        self._is_amodal = np.array([sighting.is_amodal for sighting in sightings])
        self._cut = np.array([sighting.cut for sighting in sightings])
        cameras = [sighting.camera for sighting in sightings]
        self._rows = {camera: np.flatnonzero([c == camera for c in cameras]) for camera in dict.fromkeys(cameras)}
        self._Ts_world_camera = np.array([sighting.T_world_camera for sighting in sightings])
        self._lost = np.array([2.0 * sighting.image_size.sum() for sighting in sightings])
        self._seen_between = np.full((len(sightings), len(BETWEEN)), np.nan)
        for row, sighting in enumerate(sightings):
            if sighting.outline is not None and not sighting.is_amodal:
                self._seen_between[row] = _furthest_inside(sighting, sighting.outline)

    @property
    def has_outlines(self) -> bool:
        """Whether any sighting tells more than its box."""
        return bool(np.isfinite(self._seen_between).any())

    @property
    def sizes(self) -> Float[np.ndarray, "n"]:
        """Of what was seen, pixels: the root of each box's area."""
        return np.sqrt(np.prod(self._seen[:, 2:] - self._seen[:, :2], axis=1))

    def labelled(
        self, Ts_world_box: Float[np.ndarray, "b 4 4"], sizes: Float[np.ndarray, "b 3"]
    ) -> Float[np.ndarray, "b n 4"]:
        """The labels of boxes as the sightings were made, of the part in the image or of the whole; where no part of a
        box is in the image, of the whole; NaN where it is behind the camera."""
        found = np.empty((len(sizes), len(self._sightings), 4))
        for camera, rows in self._rows.items():
            Ts = self._Ts_world_camera[rows]
            labels = labels_of_stacked(camera, Ts, Ts_world_box, sizes, tolerance=TOLERANCE)
            whole = self._is_amodal[rows, None, None] | np.isnan(labels.bbox)
            found[:, rows] = np.where(whole, labels.bbox_amodal, labels.bbox).swapaxes(0, 1)
        return found

    def off(
        self, Ts_world_box: Float[np.ndarray, "b 4 4"], sizes: Float[np.ndarray, "b 3"]
    ) -> Float[np.ndarray, "b n 4"]:
        """How far each side of a label lies to the right of, or below, where it was seen, pixels. A side that the
        image's border cuts is off only where the label does not reach it. NaN where there is no label."""
        off = self.labelled(Ts_world_box, sizes) - self._seen
        short = np.concatenate([np.maximum(off[..., :2], 0.0), np.minimum(off[..., 2:], 0.0)], axis=-1)
        return np.where(self._cut, short, off)

    def off_between(
        self, Ts_world_box: Float[np.ndarray, "b 4 4"], sizes: Float[np.ndarray, "b 3"]
    ) -> Float[np.ndarray, "b n 12"]:
        """How far boxes reach further than the outlines in the directions BETWEEN, pixels; 0 where nothing is known,
        NaN where no part of the box is in the image."""
        b = len(sizes)
        found = np.zeros((b, len(self._sightings), len(BETWEEN)))
        known = np.isfinite(self._seen_between)
        for camera, all_rows in self._rows.items():
            rows = all_rows[known[all_rows].any(axis=1)]
            if not len(rows):
                continue
            wanted = np.ones((len(rows), b), dtype=bool)
            Ts = self._Ts_world_camera[rows]
            points, offsets = outlines_of_stacked(camera, Ts, Ts_world_box, sizes, wanted, tolerance=TOLERANCE)
            reach = _furthest_of_rings(points, offsets).reshape(len(rows), b, -1).swapaxes(0, 1)
            found[:, rows] = np.where(known[rows], reach - self._seen_between[rows], 0.0)
        return found

    def misfits(
        self, Ts_world_box: Float[np.ndarray, "b 4 4"], sizes: Float[np.ndarray, "b 3"], *, by_outline: bool
    ) -> Float[np.ndarray, "b m"]:
        """All that is off for each box, in a row; finite also where a box is not to be seen, and then large."""
        rows = [self.off(Ts_world_box, sizes)]
        if by_outline:
            rows.append(self.off_between(Ts_world_box, sizes))
        rows = [np.where(np.isfinite(row), row, self._lost[:, None]) for row in rows]
        return np.concatenate([row.reshape(len(sizes), -1) for row in rows], axis=1)


def _furthest_inside(sighting: Sighting, outline: Float[np.ndarray, "k 2"]) -> Float[np.ndarray, "12"]:
    """How far an outline reaches in the directions BETWEEN; NaN where it is the image's border that it reaches."""
    along = outline @ BETWEEN.T
    furthest = outline[np.argmax(along, axis=0)]
    at_border = (furthest < AT_BORDER) | (furthest > sighting.image_size - AT_BORDER)
    return np.where(at_border.any(axis=1), np.nan, along.max(axis=0))


def _furthest_of_rings(points: Float[np.ndarray, "k 2"], offsets: np.ndarray) -> Float[np.ndarray, "r 12"]:
    """How far each of r rings reaches in the directions BETWEEN; NaN for an empty one."""
    reach = np.full((len(offsets) - 1, len(BETWEEN)), np.nan)
    there = np.flatnonzero(np.diff(offsets) > 0)
    if len(there):
        reach[there] = np.maximum.reduceat(points @ BETWEEN.T, offsets[there], axis=0)
    return reach
