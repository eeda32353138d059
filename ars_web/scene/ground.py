"""The ground's grid, and the axes of the world on it.

The grid is lines: viser's own is a shader over every pixel below the horizon, which costs half a second a frame where
there is no graphics card.
"""

import math

import numpy as np
import viser
from jaxtyping import Float

from ars_web.scene.extent import Extent

CELL_COLOR = (96, 106, 120)
SECTION_COLOR = (118, 130, 146)

GROUND = "/ground"
AXES = "/axes"

AXIS_COLORS = ((232, 72, 85), (79, 178, 92), (64, 132, 240))
"""X, Y, Z."""

SECTION = 5
"""Cells from one stronger line to the next."""


def add_ground(scene: viser.SceneApi, extent: Extent) -> None:
    """Add the grid under the recording, with about twenty cells across, and the world's axes at its origin."""
    cell = grid_cell(extent.radius)
    half = math.ceil(1.6 * extent.radius / (SECTION * cell)) * SECTION
    # Lines lie on whole cells of the world, so that they can be counted from its axes.
    x, y = np.round(extent.focus[:2] / (SECTION * cell)) * (SECTION * cell)
    scene.add_frame(GROUND, show_axes=False, position=(float(x), float(y), extent.ground))
    steps = np.arange(-half, half + 1)
    for name, chosen, color in (
        ("cells", steps % SECTION != 0, CELL_COLOR),
        ("sections", steps % SECTION == 0, SECTION_COLOR),
    ):
        lines = grid_lines(steps[chosen] * cell, half=half * cell)
        scene.add_line_segments(f"{GROUND}/{name}", lines, color, thickness=1.0, thickness_units="screen")
    scene.add_frame(AXES, show_axes=False)
    for axis, color in enumerate(AXIS_COLORS):
        line = np.stack([np.zeros(3), np.eye(3)[axis] * 2 * cell])[None]
        scene.add_line_segments(
            f"{AXES}/{'xyz'[axis]}", line.astype(np.float32), color, thickness=3.0, thickness_units="screen"
        )


def grid_lines(stations: Float[np.ndarray, "n"], *, half: float) -> Float[np.ndarray, "m 2 3"]:
    """Lines along y at each station on x, then along x at each on y, m = 2 n, all `half` long either way; z is 0."""
    ends = np.array([-half, half])
    along_y = np.stack(np.broadcast_arrays(stations[:, None], ends[None, :], 0.0), axis=-1)
    return np.concatenate([along_y, along_y[..., [1, 0, 2]]]).astype(np.float32)


def grid_cell(radius: float) -> float:
    """A cell's size: 1, 2 or 5 times a power of ten, in metres; about twenty go across what is seen."""
    rough = radius / 7
    power = 10.0 ** math.floor(math.log10(rough))
    return next(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= rough)
