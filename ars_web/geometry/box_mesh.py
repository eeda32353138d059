"""Boxes as meshes, for what is told of meshes only."""

import numpy as np
from jaxtyping import Int

from ars_web.geometry.box import Box
from ars_web.geometry.mesh import Mesh

FACES: Int[np.ndarray, "12 3"] = np.array(
    [
        [corners[0], corners[i], corners[i + 1]]
        # Corners as box.CORNER_SIGNS numbers them, each face's counter-clockwise as seen from outside.
        for corners in ([0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3])
        for i in (1, 2)
    ]
)
"""Corners of the twelve triangles of a box, two a side: -x, +x, -y, +y, -z, +z."""


def box_mesh(box: Box) -> Mesh:
    """The box's surface; its vertices are the corners, in the order of box.CORNER_SIGNS."""
    return Mesh(box.corners_world, FACES)
