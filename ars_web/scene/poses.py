"""Places of scene nodes, set to the last digit.

viser's setters take a pose that is within 1e-5 of its size of the old one for the same, and send nothing. Ten metres
from the origin that is a tenth of a millimetre: a nudge would be lost.
"""

import numpy as np
import viser

from ars_web.geometry import rigid_transform
from ars_web.geometry.rigid_transform import Transform


def place(handle: viser.SceneNodeHandle, T_parent_node: Transform) -> None:
    """Put a node where `T_parent_node` (4, 4) says; call it within `atomic()` of the node's server or client."""
    position, wxyz = T_parent_node[:3, 3], rigid_transform.wxyz_from_rotation(T_parent_node[:3, :3])
    if not np.array_equal(handle.position, position):
        if np.allclose(handle.position, position):
            handle.position = position + 1.0 + np.abs(position)  # replaced in the queue by what follows
        handle.position = position
    if not np.array_equal(handle.wxyz, wxyz):
        if np.allclose(handle.wxyz, wxyz):
            handle.wxyz = -wxyz
        handle.wxyz = wxyz
