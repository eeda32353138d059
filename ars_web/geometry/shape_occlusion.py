"""How much of a shape, a box or a mesh, can be seen behind nearer shapes: triangles on grids of rays."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from jaxtyping import Float

from ars_web.errors import BadInput
from ars_web.geometry import raster_kernels
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.frame_blocks import over_blocks
from ars_web.geometry.labels import NEAR
from ars_web.geometry.lens import lens_tables
from ars_web.geometry.mesh import Mesh
from ars_web.geometry.occlusion import BLOCK, FEWEST_RAYS, RAY_SPACING, rays_of_camera, visible_fractions
from ars_web.geometry.raster_records import MARGIN, View
from ars_web.geometry.shape_stack import kernel_shapes, stack_shapes


def visible_shares(
    camera: Camera,
    Ts_world_camera: Float[np.ndarray, "n 4 4"],
    boxes: Sequence[Box],
    meshes: Sequence[Mesh | None],
    bbox: Float[np.ndarray, "n b 4"],
    *,
    step: int = 8,
) -> Float[np.ndarray, "n b"]:
    """Share of each shape's in-image silhouette that no nearer shape hides; NaN where `bbox` is NaN.

    Shape i is `meshes[i]`, and where that is None `boxes[i]`; `bbox` is of its labels. Else as
    `occlusion.visible_fractions`, which it is where there are no meshes: rays a `step` apart, or closer for what is
    small; what is nearer is decided ray by ray; a shape with the camera inside hides nothing, and is itself hidden by
    what lies before its far side; a shape too thin for any ray counts as seen. Surfaces that lie in each other, as a
    flat mesh on a box's side, do not hide each other.

    Raises:
        BadInput: `step` is below 1, or there are not as many meshes as boxes.
    """
    stack = stack_shapes(boxes, meshes)
    if all(mesh is None for mesh in meshes):
        return visible_fractions(camera, Ts_world_camera, boxes, bbox, step=step)
    if step < 1:
        raise BadInput(f"the step between rays must be at least 1 pixel, not {step}")
    n, b = len(Ts_world_camera), len(boxes)
    visible, tables = np.empty((n, b)), lens_tables(camera)
    rays = rays_of_camera(camera)

    def look(frames: slice) -> None:
        # Copies, so that the compiled loop never meets an array of another order or one that may only be read.
        raster_kernels.visible_shares(
            np.array(Ts_world_camera[frames], dtype=np.float64, order="C"),
            tables.lens,
            view_of(camera),
            kernel_shapes(stack),
            stack.parting.copy(),
            NEAR,
            rays,
            float(RAY_SPACING),
            np.array(bbox[frames], dtype=np.float64, order="C"),
            float(step),
            FEWEST_RAYS,
            visible[frames],
        )

    over_blocks(look, n, block=BLOCK)
    return visible


@lru_cache(maxsize=16)
def view_of(camera: Camera) -> View:
    """What the camera shows of the normalised plane, as the kernels read it; kept for the next call."""
    rays, tables = rays_of_camera(camera), lens_tables(camera)
    x, y = rays[:, np.isfinite(rays).all(axis=0)]
    radius = float(np.hypot(x, y).max(initial=0.0))
    rim = (1 - 1e-9) * tables.lens.rim
    limit = min(MARGIN * radius, rim)
    bend, rim_bend = tables.bends_within(np.array([limit, rim])).tolist()
    # Between the rays there are others that go a little further.
    more = 0.05 * radius
    bounds = (x.min(initial=0.0), x.max(initial=0.0), y.min(initial=0.0), y.max(initial=0.0))
    sides = (float(side) + sign * more for side, sign in zip(bounds, (-1, 1, -1, 1), strict=True))
    return View(limit**2, bend, rim**2, rim_bend, *sides)
