"""The heading of an object in an image: which way its box's x axis points there.

As the original tool has it (De Gregorio et al., ARS, its compass dataset): the direction from the corner (-, -, +) of
the box to (+, -, +) as they are seen, the angle counted from the image's x axis towards its y axis, so clockwise.
"""

import numpy as np
from jaxtyping import Float

from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.projected_points import project_points
from ars_web.geometry.rigid_transform import transform_points
from ars_web.geometry.symmetry import Symmetry, rotations_of

_ALONG = 1e-6
"""Of the part across x of a symmetry's axis that still runs along x."""


def heading_edges(box: Box, symmetry: Symmetry) -> Float[np.ndarray, "m 2 3"]:
    """Start and end, in the world, of each line that the heading may be read from: one, or one for each turn of the
    object that leaves it looking the same; none where any turn of its x axis does.

    Of an object that is round about its x axis it is that axis.
    """
    x, y, z = box.size / 2
    edge = np.array([[-x, -y, z], [x, -y, z]])
    if symmetry.axis is not None:
        if np.hypot(symmetry.axis[1], symmetry.axis[2]) > _ALONG:
            return np.zeros((0, 2, 3))
        edge = np.array([[-x, 0.0, 0.0], [x, 0.0, 0.0]])
    edges = edge @ rotations_of(symmetry).swapaxes(1, 2)
    return transform_points(box.T_world_box, edges.reshape(-1, 3)).reshape(-1, 2, 3)


def headings(
    camera: Camera, Ts_world_camera: Float[np.ndarray, "n 4 4"], box: Box, symmetry: Symmetry
) -> Float[np.ndarray, "n"]:
    """Radians in [0, 2 pi), as each camera sees the box; 0 where it has no heading.

    Of several lines it is the smallest: the same for all poses that cannot be told apart. Where an end of a line is
    behind the camera or beyond what the lens can show, it is the direction of the straight line in the image without
    the lens's distortion.
    """
    edges = heading_edges(box, symmetry)
    if len(edges) == 0:
        return np.zeros(len(Ts_world_camera))
    seen = project_points(camera, Ts_world_camera, edges)
    across = seen[:, :, 1] - seen[:, :, 0]
    R_world_camera, centres = Ts_world_camera[:, None, :3, :3], Ts_world_camera[:, None, :3, 3]
    start = ((edges[:, 0] - centres)[..., None, :] @ R_world_camera)[..., 0, :]
    along = ((edges[:, 1] - edges[:, 0])[None, :, None, :] @ R_world_camera)[..., 0, :]
    # The image of start + t * along, derived by t and scaled by the depth squared: it points one way for all t.
    straight = along[..., :2] * start[..., 2:] - start[..., :2] * along[..., 2:]
    direction = np.where(np.isnan(across), straight * [camera.fx, camera.fy], across)
    angles = np.arctan2(direction[..., 1], direction[..., 0]) % (2 * np.pi)
    # Just below 0 is rounded to a whole turn.
    return np.where(angles < 2 * np.pi, angles, 0.0).min(axis=1)
