"""Open surfaces, such as scans with a border, made closed: every face has a back."""

import numpy as np
from jaxtyping import Float, Int

from ars_web.geometry.mesh import Mesh


def two_sided(vertices_world: Float[np.ndarray, "v 3"], faces: Int[np.ndarray, "f 3"]) -> Mesh:
    """The surface of any triangles, however they are turned, as it is seen from both sides.

    Faces that name a vertex twice have no area and are left out. All fronts come before all backs, in one order: where
    an edge has four faces, `Mesh.edges` then pairs the two fronts and the two backs, so that an edge within a surface
    is on no contour, and at a border a front with its back.

    Raises:
        BadInput: what `Mesh` refuses; there is no face left.
    """
    a, b, c = faces.T
    fronts = faces[(a != b) & (b != c) & (c != a)]
    # A back begins with the vertex that its front begins with: their planes are then each other's to the last bit.
    return Mesh(vertices_world, np.concatenate([fronts, fronts[:, [0, 2, 1]]]))
