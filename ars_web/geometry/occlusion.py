"""How much of a box can be seen behind nearer boxes: rays against slabs."""

import numpy as np
from jaxtyping import Float

from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera


def visible_fractions(
    camera: Camera,
    Ts_world_camera: Float[np.ndarray, "n 4 4"],
    boxes: list[Box],
    bbox: Float[np.ndarray, "n b 4"],
    *,
    step: int = 8,
) -> Float[np.ndarray, "n b"]:
    """Share of each box's in-image outline that no nearer box hides; NaN where `bbox` is NaN.

    `bbox` is `BoxLabels.bbox`. Rays are cast on a grid of `step` pixels, finer for boxes too small for it.
    """
    raise NotImplementedError
