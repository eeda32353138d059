"""A photograph cut to the surroundings of one object, at limited resolution, and points of the world seen in it."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
import shapely
from jaxtyping import Bool, Float, Int, UInt8

from ars_web.geometry import rigid_transform
from ars_web.geometry.camera import Camera, image_from_pixels, pixels_from_camera_points
from ars_web.geometry.mask_regions import mask_from_polygons, polygons_from_mask, polygons_of
from ars_web.geometry.polygon import Polygon
from ars_web.geometry.rigid_transform import Transform

LONGEST_SIDE = 360
"""Pixels of a close-up; a larger part of a photograph is made smaller."""

MARGIN = 0.3
"""How far a close-up reaches beyond the object, of the root of the object's area: what is behind it."""

OUTSIDE_IMAGE, OUTSIDE_CLOSE_UP = -1, -2
"""In place of a pixel's index: a point that the photograph does not show, and one that it shows further off."""


@dataclass(frozen=True, eq=False)
class CloseUp:
    """A part of a frame's photograph.

    Attributes:
        frame: its index.
        x0, y0: the part's top left corner, image coordinates.
        scale: its pixels for one of the photograph's, at most 1.
        lab: (h, w, 3) its pixels, as OpenCV has CIE L*a*b* in 8 bits.
        points: (n, 3) of the world, that are looked up in it.
    """

    frame: int
    camera: Camera
    T_world_camera: Transform
    x0: int
    y0: int
    scale: float
    lab: UInt8[np.ndarray, "h w 3"]
    points: Float[np.ndarray, "n 3"]

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width in pixels."""
        height, width = self.lab.shape[:2]
        return height, width

    def raster(self, polygons: Iterable[Polygon]) -> Bool[np.ndarray, "h w"]:
        """Which pixels lie inside polygons of the photograph."""
        height, width = self.shape
        return mask_from_polygons([self._mapped(polygon) for polygon in polygons], width, height)

    def polygons(self, mask: Bool[np.ndarray, "h w"], *, grow: float) -> tuple[Polygon, ...]:
        """The outline of a mask in the photograph, `grow` of its pixels wider, simplified to half a pixel, cut to the
        photograph."""
        found = [
            Polygon(
                polygon.outer / self.scale + (self.x0, self.y0),
                tuple(hole / self.scale + (self.x0, self.y0) for hole in polygon.holes),
            )
            for polygon in polygons_from_mask(mask)
        ]
        areas = shapely.union_all([shapely.make_valid(shapely.Polygon(p.outer, p.holes)) for p in found])
        image = shapely.box(0, 0, self.camera.width, self.camera.height)
        return polygons_of(areas.buffer(grow, join_style="mitre").intersection(image), tolerance=0.5)

    def _mapped(self, polygon: Polygon) -> Polygon:
        corner = np.array([self.x0, self.y0])
        return Polygon((polygon.outer - corner) * self.scale, tuple((h - corner) * self.scale for h in polygon.holes))

    @cached_property
    def _places(self) -> tuple[Float[np.ndarray, "n 2"], Bool[np.ndarray, "n"], Float[np.ndarray, "n"]]:
        """Where the points are, in pixels of the close-up; whether the photograph shows them; and their depths."""
        seen = rigid_transform.transform_points(rigid_transform.invert(self.T_world_camera), self.points)
        image = image_from_pixels(pixels_from_camera_points(self.camera, seen))
        # NaN is within nothing.
        shown = np.all((image >= 0) & (image < (self.camera.width, self.camera.height)), axis=1)
        return (image - (self.x0, self.y0)) * self.scale, shown, seen[:, 2]

    @cached_property
    def _pixels(self) -> Int[np.ndarray, "n"]:
        """Of each point, its pixel's index in the close-up, OUTSIDE_IMAGE or OUTSIDE_CLOSE_UP."""
        return _indices(*self._places[:2], self.shape)

    def within(self, mask: Bool[np.ndarray, "h w"]) -> Bool[np.ndarray, "n"]:
        """Which points a mask leaves possible: those in it, and those that the photograph does not show."""
        return np.concatenate([mask.ravel(), [False, True]])[self._pixels]

    def cells(self, spacing: float) -> "Cells":
        """The close-up in squares so large that points `spacing` metres apart leave none of them out."""
        places, shown, depths = self._places
        near = max(float(np.median(depths[shown])) if shown.any() else 1.0, 1e-6)
        size = max(1.0, 1.25 * spacing * max(self.camera.fx, self.camera.fy) * self.scale / near)
        height, width = self.shape
        shape = (int(height / size) + 1, int(width / size) + 1)
        return Cells(self.shape, shape, size, _indices(places / size, shown, shape))


@dataclass(frozen=True, eq=False)
class Cells:
    """A close-up in squares, and the square that each point is seen in.

    Attributes:
        close_up: height and width of the close-up in pixels.
        shape: rows and columns of squares.
        size: of a square in pixels of the close-up.
        indices: of each point, its square's index, OUTSIDE_IMAGE or OUTSIDE_CLOSE_UP.
    """

    close_up: tuple[int, int]
    shape: tuple[int, int]
    size: float
    indices: Int[np.ndarray, "n"]

    def of_points(self, kept: Bool[np.ndarray, "n"]) -> Bool[np.ndarray, "r c"]:
        """The squares that points are seen in."""
        found = np.zeros(self.shape[0] * self.shape[1], dtype=np.bool_)
        indices = self.indices[kept]
        found[indices[indices >= 0]] = True
        return found.reshape(self.shape)

    def of_mask(self, mask: Bool[np.ndarray, "h w"]) -> Bool[np.ndarray, "r c"]:
        """The squares that lie mostly inside a mask."""
        rows, columns = self.shape
        padded = np.zeros((round(rows * self.size), round(columns * self.size)), dtype=np.uint8)
        height, width = min(mask.shape[0], padded.shape[0]), min(mask.shape[1], padded.shape[1])
        padded[:height, :width] = mask[:height, :width] * 255
        return cv2.resize(padded, (columns, rows), interpolation=cv2.INTER_AREA) > 127

    def pixels(self, squares: Bool[np.ndarray, "r c"]) -> Bool[np.ndarray, "h w"]:
        """The pixels of squares, and of those next to them."""
        grown = cv2.dilate(squares.astype(np.uint8), np.ones((3, 3), np.uint8))
        rows = np.minimum((np.arange(self.close_up[0]) / self.size).astype(np.int64), self.shape[0] - 1)
        columns = np.minimum((np.arange(self.close_up[1]) / self.size).astype(np.int64), self.shape[1] - 1)
        return grown[rows[:, None], columns] > 0


def close_up(
    image: UInt8[np.ndarray, "h w 3"],
    *,
    frame: int,
    camera: Camera,
    T_world_camera: Transform,
    region: shapely.Geometry,
    points: Float[np.ndarray, "n 3"],
) -> CloseUp:
    """The part of a photograph, blue green red, round a region of it that lies at least partly inside."""
    height, width = image.shape[:2]
    left, top, right, bottom = shapely.intersection(region, shapely.box(0, 0, width, height)).bounds
    pad = MARGIN * np.sqrt((right - left) * (bottom - top)) + 6
    x0, y0 = max(0, int(left - pad)), max(0, int(top - pad))
    x1, y1 = min(width, int(np.ceil(right + pad))), min(height, int(np.ceil(bottom + pad)))
    part = image[y0:y1, x0:x1]
    scale = min(1.0, LONGEST_SIDE / max(part.shape[:2]))
    if scale < 1.0:
        # One scale along both sides: a side's last fraction of a pixel is cut off.
        smaller = np.array([[scale, 0.0, scale / 2 - 0.5], [0.0, scale, scale / 2 - 0.5]])
        size = (max(1, int(part.shape[1] * scale)), max(1, int(part.shape[0] * scale)))
        blurred = cv2.GaussianBlur(part, (0, 0), 0.4 / scale)
        part = cv2.warpAffine(blurred, smaller, size, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    lab = cv2.cvtColor(np.ascontiguousarray(part), cv2.COLOR_BGR2LAB)
    return CloseUp(frame, camera, T_world_camera, x0, y0, scale, lab, points)


def _indices(
    places: Float[np.ndarray, "n 2"], shown: Bool[np.ndarray, "n"], shape: tuple[int, int]
) -> Int[np.ndarray, "n"]:
    pixels = np.floor(np.where(shown[:, None], places, -1.0)).astype(np.int64)
    within = shown & ((pixels >= 0) & (pixels < (shape[1], shape[0]))).all(axis=1)
    indices = np.where(within, pixels[:, 1] * shape[1] + pixels[:, 0], OUTSIDE_CLOSE_UP)
    indices[~shown] = OUTSIDE_IMAGE
    return indices
