"""A recording whose camera goes round an object that is not in the pictures, and that object's true outlines."""

import base64
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import shapely

from ars_web.geometry import camera as cameras
from ars_web.geometry import rigid_transform
from ars_web.geometry.camera import Camera

WIDTH, HEIGHT = 320, 240
FRAMES = 12
CAMERA = Camera(WIDTH, HEIGHT, 600.0, 600.0, 159.5, 119.5, "brown", (-0.1, 0.01, 0.0, 0.0, 0.0))
CENTRE = (0.0, 0.0, 0.05)
"""What every frame looks at. Frame i stands i / FRAMES of a turn round it, half a metre away."""


def poses(frames: int = FRAMES) -> np.ndarray:
    """(n, 4, 4) T_world_camera: low and high in turn."""
    found: list[np.ndarray] = []
    for i in range(frames):
        round_, up = 2 * np.pi * i / frames, np.deg2rad(20.0 if i % 2 else 45.0)
        away = np.array([np.cos(up) * np.cos(round_), np.cos(up) * np.sin(round_), np.sin(up)])
        z = -away
        x = np.cross(z, [0.0, 0.0, 1.0])
        x /= np.linalg.norm(x)
        R = np.column_stack([x, np.cross(z, x), z])
        found.append(rigid_transform.from_rotation(R, np.array(CENTRE) + 0.5 * away))
    return np.array(found)


def write(folder: Path, *, frames: int = FRAMES) -> Path:
    """The recording as an ARS scene."""
    (folder / "images").mkdir(parents=True)
    image = np.full((HEIGHT, WIDTH, 3), 90, dtype=np.uint8)
    for i in range(frames):
        assert cv2.imwrite(str(folder / "images" / f"{i:05d}.jpg"), image)
    rows: list[str] = []
    for T in poses(frames):
        w, x, y, z = rigid_transform.wxyz_from_rotation(T[:3, :3])
        rows.append(" ".join(repr(float(v)) for v in (*T[:3, 3], x, y, z, w)))
    (folder / "robot_poses.txt").write_text("\n".join(rows) + "\n")
    (folder / "camera_extrinsics.txt").write_text("0 0 0 0 0 0 1\n")
    k1, k2, p1, p2, _ = CAMERA.distortion
    line = f"{WIDTH} {HEIGHT} {CAMERA.fx} {CAMERA.fy} {CAMERA.cx} {CAMERA.cy} {k1} {k2} {p1} {p2}"
    (folder / "camera_intrinsics.txt").write_text(line + "\n")
    return folder


def outline(frame: int, *, radius: float = 0.04, centre: tuple[float, float, float] = CENTRE) -> np.ndarray:
    """(k, 2) image coordinates of a ball's outline, to about a tenth of a pixel, also beyond the image's border."""
    n = 4000
    i = np.arange(n) + 0.5
    up, turn = np.arccos(1 - 2 * i / n), np.pi * (1 + 5**0.5) * i  # Fibonacci's lattice
    ball = np.column_stack([np.cos(turn) * np.sin(up), np.sin(turn) * np.sin(up), np.cos(up)])
    T_camera_world = rigid_transform.invert(poses()[frame])
    points = rigid_transform.transform_points(T_camera_world, np.array(centre) + radius * ball)
    seen = cameras.image_from_pixels(cameras.pixels_from_camera_points(CAMERA, points))
    return np.array(shapely.MultiPoint(seen).convex_hull.exterior.coords)[:-1]


def polygons(frame: int, **ball: Any) -> list[dict[str, Any]]:
    """The ball's outline as JSON."""
    return [{"outer": outline(frame, **ball).round(3).tolist(), "holes": []}]


def png(frame: int, **ball: Any) -> str:
    """The ball's outline as a PNG mask in base64: pixels whose centre is inside it."""
    mask = np.zeros((HEIGHT, WIDTH), np.uint8)
    ys, xs = np.mgrid[:HEIGHT, :WIDTH]
    mask[shapely.contains_xy(shapely.Polygon(outline(frame, **ball)), xs + 0.5, ys + 0.5)] = 255
    return base64.b64encode(cv2.imencode(".png", mask)[1].tobytes()).decode()
