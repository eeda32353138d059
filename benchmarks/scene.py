"""The scene of the benchmarks: a camera with Brown distortion circling a table for 36,000 frames, and 20 boxes."""

import numpy as np
from jaxtyping import Float

from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera


def camera() -> Camera:
    """1280 x 720 with the distortion of a cheap wide lens."""
    return Camera(1280, 720, 920.0, 918.0, 640.5, 362.0, "brown", (-0.28, 0.09, 0.0008, -0.0005, -0.012))


def poses(n: int = 36_000) -> Float[np.ndarray, "n 4 4"]:
    """`Ts_world_camera` (n, 4, 4) of a camera that winds round the table, near and far, high and low."""
    s = np.linspace(0.0, 1.0, n)
    azimuth, elevation = 2 * np.pi * 60 * s, np.radians(25 + 50 * np.abs(np.sin(2 * np.pi * 7 * s)))
    distance = 0.65 + 0.35 * np.sin(2 * np.pi * 11 * s)
    centre = np.column_stack(
        [
            distance * np.cos(elevation) * np.cos(azimuth),
            distance * np.cos(elevation) * np.sin(azimuth),
            distance * np.sin(elevation) + 0.05,
        ]
    )
    target = np.column_stack([0.25 * np.sin(2 * np.pi * 40 * s), 0.2 * np.cos(2 * np.pi * 31 * s), np.full(n, 0.05)])
    z = target - centre
    z /= np.linalg.norm(z, axis=1, keepdims=True)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return rigid_transform.from_rotation(np.stack([x, np.cross(z, x), z], axis=-1), centre)


def boxes(n: int = 20) -> list[Box]:
    """n boxes of 5 to 22 cm on the table, some of them reaching into each other."""
    random = np.random.default_rng(0)
    found: list[Box] = []
    for _ in range(n):
        size = random.uniform(0.05, 0.22, 3)
        place = np.array([random.uniform(-0.55, 0.55), random.uniform(-0.35, 0.35), size[2] / 2])
        turn = rigid_transform.rotation_about_z(random.uniform(0, 2 * np.pi))
        found.append(Box(rigid_transform.from_rotation(turn, place), size))
    return found
