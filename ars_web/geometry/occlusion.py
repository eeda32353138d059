"""How much of a box can be seen behind nearer boxes: rays against slabs."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from jaxtyping import Float, Int

from ars_web.errors import BadInput
from ars_web.geometry import camera as cameras
from ars_web.geometry import ray_kernels
from ars_web.geometry.box import Box, stack
from ars_web.geometry.camera import Camera
from ars_web.geometry.frame_blocks import over_blocks
from ars_web.geometry.labels import NEAR

FEWEST_RAYS = 10
"""Along each side of a box's grid, however small the box: 100 rays tell shares of a hundredth apart."""

RAY_SPACING = 8
"""Pixels between the rays that are computed; the others lie between them, off by less than 0.01 px."""

BLOCK = 64
"""Frames that a thread takes at once."""


def visible_fractions(
    camera: Camera,
    Ts_world_camera: Float[np.ndarray, "n 4 4"],
    boxes: Sequence[Box],
    bbox: Float[np.ndarray, "n b 4"],
    *,
    step: int = 8,
) -> Float[np.ndarray, "n b"]:
    """Share of each box's in-image outline that no nearer box hides; NaN where `bbox` is NaN.

    `bbox` is `BoxLabels.bbox`. Rays are cast on a grid of `step` pixels over each box, finer for boxes too small for
    it; which of two boxes is nearer is decided ray by ray. A box with the camera inside hides nothing, and is itself
    hidden by what lies before its far side. A box too thin for any ray counts as seen.

    Raises:
        BadInput: `step` is below 1.
    """
    if step < 1:
        raise BadInput(f"the step between rays must be at least 1 pixel, not {step}")
    n, b = len(Ts_world_camera), len(boxes)
    visible = np.empty((n, b))
    Ts_world_box, sizes = stack(list(boxes))
    rays, beyond = rays_of_camera(camera), beyond_faces(Ts_world_box, sizes)

    def look(frames: slice) -> None:
        # Copies, so that the compiled loop never meets an array of another order or one that may only be read.
        Ts = np.array(Ts_world_camera[frames], dtype=np.float64, order="C")
        seen = np.array(bbox[frames], dtype=np.float64, order="C")
        ray_kernels.visible_shares(
            Ts,
            Ts_world_box,
            sizes / 2,
            beyond,
            NEAR,
            rays,
            float(RAY_SPACING),
            seen,
            float(step),
            FEWEST_RAYS,
            visible[frames],
        )

    over_blocks(look, n, block=BLOCK)
    return visible


@lru_cache(maxsize=16)
def rays_of_camera(camera: Camera) -> Float[np.ndarray, "2 h w"]:
    """Points of the normalised plane at every RAY_SPACING-th image coordinate, the image's far borders included."""
    u = np.arange(0, camera.width + RAY_SPACING, RAY_SPACING, dtype=np.float64)
    v = np.arange(0, camera.height + RAY_SPACING, RAY_SPACING, dtype=np.float64)
    image = np.stack(np.meshgrid(u, v), axis=-1)
    rays = cameras.normalised_from_pixels(camera, cameras.pixels_from_image(image))
    return np.ascontiguousarray(np.moveaxis(rays, -1, 0))


def beyond_faces(Ts_world_box: Float[np.ndarray, "b 4 4"], sizes: Float[np.ndarray, "b 3"]) -> Int[np.ndarray, "b b"]:
    """For each box and each other one, beyond which of its six faces all of the other lies: bit 2 i for the face at
    the positive end of axis i, bit 2 i + 1 for that at the negative end."""
    axes, centres = Ts_world_box[:, :3, :3], Ts_world_box[:, :3, 3]
    turned = np.einsum("bki,ckj->bcij", axes, axes)
    place = np.einsum("bki,bck->bci", axes, centres[None, :] - centres[:, None])
    reach = np.einsum("bcij,cj->bci", np.abs(turned), sizes / 2)
    bits = 1 << np.arange(6)
    above, below = place - reach >= sizes[:, None] / 2, place + reach <= -sizes[:, None] / 2
    return above @ bits[0::2] + below @ bits[1::2]
