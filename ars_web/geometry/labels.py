"""Labels of boxes in images: the one place that decides where a virtual box appears in a frame."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.rigid_transform import Transform

NEAR = 0.01
"""Metres. Edges are clipped here before they are projected."""


@dataclass(frozen=True, eq=False)
class BoxLabels:
    """Labels of b boxes in n frames of one camera, image coordinates (x0, y0, x1, y1).

    Attributes:
        bbox: (n, b, 4) of the part in the image; NaN where no part is in it.
        bbox_amodal: (n, b, 4) of all that is in front of the camera and within the lens's valid radius,
            unclipped; NaN where nothing is.
        truncated: (n, b) share of the amodal outline's area that lies outside the image; 1 where bbox is NaN.
    """

    bbox: Float[np.ndarray, "n b 4"]
    bbox_amodal: Float[np.ndarray, "n b 4"]
    truncated: Float[np.ndarray, "n b"]


def labels_of_boxes(
    camera: Camera, Ts_world_camera: Float[np.ndarray, "n 4 4"], boxes: list[Box], *, tolerance: float = 0.05
) -> BoxLabels:
    """Labels of every box in every frame, exact to `tolerance` pixels."""
    raise NotImplementedError


def outline(camera: Camera, T_world_camera: Transform, box: Box, *, tolerance: float = 0.1) -> Float[np.ndarray, "k 2"]:
    """The ring round the part of a box that lies in the image, image coordinates; (0, 2) where none does.

    Counter-clockwise as seen in the image (y down), not closed; clipped to the image.
    """
    raise NotImplementedError


def wireframe(
    camera: Camera, T_world_camera: Transform, box: Box, *, tolerance: float = 0.1
) -> list[Float[np.ndarray, "k 2"]]:
    """The box's edges as polylines within the image, image coordinates: an edge bends with the lens, and is cut
    where it leaves the image, passes behind the camera or beyond the valid radius."""
    raise NotImplementedError
