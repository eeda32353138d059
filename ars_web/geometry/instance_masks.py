"""Masks of all shapes in one frame, exact to the pixel: what is seen of each, and each whole."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float, Int16

from ars_web.geometry import camera as cameras
from ars_web.geometry import raster_kernels
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.labels import NEAR
from ars_web.geometry.lens import lens_tables
from ars_web.geometry.mesh import Mesh
from ars_web.geometry.raster_records import Shapes
from ars_web.geometry.rigid_transform import Transform
from ars_web.geometry.shape_occlusion import view_of
from ars_web.geometry.shape_stack import kernel_shapes, stack_shapes

TILE = 96
"""Pixels along the sides of the squares that are drawn at once: their depths stay in the processor's cache."""

EDGES: tuple[tuple[np.ufunc, float], ...] = ((np.minimum, np.inf), (np.maximum, -np.inf))
"""How the least and the largest of rays are found, and what stands for a ray that there is not."""


@dataclass(frozen=True, eq=False)
class Silhouette:
    """A part of an image, no larger than what is in it.

    Attributes:
        row, column: of the image's pixel that is the part's first.
        mask: (k, l) the pixels whose middles the shape covers; (0, 0) where it covers none.
    """

    row: int
    column: int
    mask: Bool[np.ndarray, "k l"]


@dataclass(frozen=True, eq=False)
class InstanceMasks:
    """The b shapes of one frame.

    Attributes:
        visible: (h, w) the number of the shape that is nearest at the middle of each pixel; -1 where there is none.
        silhouettes: each shape's own in the image, its hidden parts included.
    """

    visible: Int16[np.ndarray, "h w"]
    silhouettes: tuple[Silhouette, ...]

    def visible_of(self, number: int) -> Silhouette:
        """What is seen of one shape, in the same part of the image as its silhouette."""
        whole = self.silhouettes[number]
        rows, columns = whole.mask.shape
        part = self.visible[whole.row : whole.row + rows, whole.column : whole.column + columns]
        return Silhouette(whole.row, whole.column, part == number)


def instance_masks(
    camera: Camera, T_world_camera: Transform, boxes: Sequence[Box], meshes: Sequence[Mesh | None]
) -> InstanceMasks:
    """Which shape is seen at each pixel of a frame, and where each would be seen without the others.

    Shape i is `meshes[i]`, and where that is None `boxes[i]`. As in the labels shapes are cut off at NEAR, and nothing
    is seen beyond the lens's valid radius. A shape with the camera inside is met at its far side, and is seen only
    where no other shape is. Of surfaces that lie in each other the first shape's is seen.

    Raises:
        BadInput: there are not as many meshes as boxes.
    """
    shapes = _shapes(tuple(boxes), tuple(meshes))
    visible, crops = np.empty((camera.height, camera.width), np.int16), np.empty((len(boxes), 5), np.int64)
    T = np.array(T_world_camera, dtype=np.float64, order="C")
    lens, (rays, bounds) = lens_tables(camera).lens, rays_of_pixels(camera)
    pixels = raster_kernels.instances(T, lens, view_of(camera), shapes, NEAR, rays, bounds, TILE, visible, crops)
    silhouettes = [
        Silhouette(row, column, pixels[start : start + rows * columns].reshape(rows, columns))
        for row, column, rows, columns, start in crops.tolist()
    ]
    return InstanceMasks(visible, tuple(silhouettes))


@lru_cache(maxsize=4)
def _shapes(boxes: tuple[Box, ...], meshes: tuple[Mesh | None, ...]) -> Shapes:
    return kernel_shapes(stack_shapes(boxes, meshes))


@lru_cache(maxsize=2)
def rays_of_pixels(camera: Camera) -> tuple[Float[np.ndarray, "2 h w"], Float[np.ndarray, "4 k l"]]:
    """Points of the normalised plane at the pixels' middles, NaN beyond the lens's valid radius, and for each tile of
    them the least and largest x, and the least and largest y; kept for the next frame."""
    rows, columns = np.mgrid[: camera.height, : camera.width]
    rays = cameras.normalised_from_pixels(camera, np.stack([columns, rows], axis=-1).astype(np.float64))
    rays = np.ascontiguousarray(np.moveaxis(rays, -1, 0))
    low, high = (_over_tiles(edge, np.where(np.isnan(rays), empty, rays)) for edge, empty in EDGES)
    return rays, np.ascontiguousarray(np.stack([low[0], high[0], low[1], high[1]]))


def _over_tiles(edge: np.ufunc, rays: Float[np.ndarray, "2 h w"]) -> Float[np.ndarray, "2 k l"]:
    """The least or the largest of each tile."""
    _, height, width = rays.shape
    rows = edge.reduceat(rays, np.arange(0, height, TILE), axis=1)
    return edge.reduceat(rows, np.arange(0, width, TILE), axis=2)
