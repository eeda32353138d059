"""The ground's grid, and the axes of the world on it."""

import math

import numpy as np
import viser

from ars_web.scene.extent import Extent


def add_ground(scene: viser.SceneApi, extent: Extent) -> None:
    """Add the grid under the recording, with about twenty cells across, and the world's axes at its origin."""
    cell = grid_cell(extent.radius)
    half = math.ceil(1.6 * extent.radius / cell) * cell
    # Lines lie on whole cells of the world, so that they can be counted from its axes.
    middle = np.round(extent.focus[:2] / (5 * cell)) * (5 * cell)
    scene.add_grid(
        "/ground",
        width=2 * half,
        height=2 * half,
        plane="xy",
        cell_size=cell,
        section_size=5 * cell,
        cell_color=(110, 120, 133),
        section_color=(128, 140, 155),
        cell_thickness=0.6,
        section_thickness=1.0,
        fade_distance=12 * extent.radius,
        fade_strength=1.0,
        shadow_opacity=0.0,
        position=(float(middle[0]), float(middle[1]), extent.ground),
    )
    length = 2 * cell
    ends = np.eye(3, dtype=np.float32) * length
    scene.add_line_segments(
        "/axes",
        np.stack([np.zeros_like(ends), ends], axis=1),
        colors=np.repeat(np.array(AXIS_COLORS, dtype=np.uint8)[:, None], 2, axis=1),
        thickness=3.0,
        thickness_units="screen",
    )


AXIS_COLORS = ((232, 72, 85), (79, 178, 92), (64, 132, 240))
"""X, Y, Z."""


def grid_cell(radius: float) -> float:
    """A cell's size: 1, 2 or 5 times a power of ten, in metres; about twenty go across what is seen."""
    rough = radius / 7
    power = 10.0 ** math.floor(math.log10(rough))
    return next(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= rough)
