"""What the demo's objects truly look like in its images, for outlines that are drawn like them."""

from collections.abc import Callable

import numpy as np
import pytest
from jaxtyping import Bool, Float

from ars_web.demo import building, rendering, scene
from ars_web.demo.truth import DemoTruth
from ars_web.geometry.mask_regions import polygons_from_mask

Alone = Callable[[int, int], Bool[np.ndarray, "h w"]]


@pytest.fixture
def alone(demo_recording: DemoTruth) -> Alone:
    """`alone(frame, b)`: (h, w) the pixels of object b, what others hide included."""
    parts = building.place(scene.things(), desk=scene.desk())
    rays = rendering.ray_table(demo_recording.camera)

    def of(frame: int, b: int) -> Bool[np.ndarray, "h w"]:
        return rendering.look(parts, rays, demo_recording.Ts_world_camera[frame]).alone[b]

    return of


def outline(mask: Bool[np.ndarray, "h w"], *, tolerance: float = 1.5) -> Float[np.ndarray, "k 2"]:
    """The corners of a mask's largest piece, as a careful person would click them; image coordinates."""
    return polygons_from_mask(mask, tolerance=tolerance)[0].outer
