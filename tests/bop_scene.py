"""A BOP dataset of the ring of cameras, written by hand from known boxes: the models' origins are off their centres."""

import json
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import cv2
import numpy as np

from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box

MODELS: dict[str, dict[str, Any]] = {
    "1": {
        "diameter": 112.2,
        **{"min_x": -10.0, "min_y": -20.0, "min_z": 0.0, "size_x": 60.0, "size_y": 40.0, "size_z": 80.0},
        # Half a turn about the box's own z, which runs through (20, 0).
        "symmetries_discrete": [[-1, 0, 0, 40, 0, -1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]],
    },
    "7": {
        "diameter": 50.0,
        **{"min_x": -15.0, "min_y": -15.0, "min_z": -20.0, "size_x": 30.0, "size_y": 30.0, "size_z": 40.0},
        "symmetries_continuous": [{"axis": [0, 0, 1], "offset": [0, 0, 0]}],
    },
}


CENTRED: dict[str, dict[str, Any]] = {
    "1": {
        "diameter": 112.2,
        **{"min_x": -30.0, "min_y": -20.0, "min_z": -40.0, "size_x": 60.0, "size_y": 40.0, "size_z": 80.0},
        "symmetries_discrete": [[-1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]],
    },
    "7": MODELS["7"],
}
"""The same with their origins at their boxes' centres, as this program writes them."""


def box(obj_id: int, x: float, y: float, turn: float, tilt: float = 0.0) -> Box:
    """Where an object of a model is, as we say it."""
    model = MODELS[str(obj_id)]
    size = np.array([model["size_x"], model["size_y"], model["size_z"]]) / 1000
    c, s = np.cos(tilt), np.sin(tilt)
    R = rigid_transform.rotation_about_z(turn) @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    return Box(rigid_transform.from_rotation(R, np.array([x, y, 0.05])), size)


OBJECTS: tuple[tuple[int, Box], ...] = (
    (1, box(1, -0.05, 0.02, 0.3)),
    (1, box(1, 0.06, -0.03, 1.1, 0.2)),
    (7, box(7, 0.0, 0.09, -0.4)),
)


def truth_of(
    T_world_camera: np.ndarray, obj_id: int, T_world_box: np.ndarray, models: dict[str, dict[str, Any]] = MODELS
) -> dict[str, Any]:
    """An object as scene_gt.json has it."""
    model = models[str(obj_id)]
    lowest = np.array([model["min_x"], model["min_y"], model["min_z"]])
    centre = lowest + np.array([model["size_x"], model["size_y"], model["size_z"]]) / 2
    T_world_model = T_world_box @ rigid_transform.from_rotation(np.eye(3), -centre / 1000)
    T = rigid_transform.invert(T_world_camera) @ T_world_model
    return {
        "cam_R_m2c": T[:3, :3].ravel().tolist(),
        "cam_t_m2c": (1000 * T[:3, 3]).tolist(),
        "obj_id": obj_id,
    }


def write(
    ring: ModuleType,
    folder: Path,
    *,
    frames: int = 6,
    objects: Sequence[tuple[int, Box]] = OBJECTS,
    with_world: bool = True,
    images: bool = True,
    models: dict[str, dict[str, Any]] = MODELS,
) -> Path:
    """The dataset in `folder`; its scene's folder. A symmetric object is turned as it likes from image to image."""
    scene = folder / "test" / "000001"
    scene.mkdir(parents=True)
    (folder / "models").mkdir()
    (folder / "models" / "models_info.json").write_text(json.dumps(models, indent=1))
    cameras: dict[str, Any] = {}
    truth: dict[str, Any] = {}
    picture = np.full((ring.HEIGHT, ring.WIDTH, 3), 90, dtype=np.uint8)
    for i, T in enumerate(ring.poses()[:frames]):
        c = ring.CAMERA
        cameras[str(i)] = {"cam_K": [c.fx, 0.0, c.cx, 0.0, c.fy, c.cy, 0.0, 0.0, 1.0], "depth_scale": 0.1}
        if with_world:
            T_camera_world = rigid_transform.invert(T)
            cameras[str(i)]["cam_R_w2c"] = T_camera_world[:3, :3].ravel().tolist()
            cameras[str(i)]["cam_t_w2c"] = (1000 * T_camera_world[:3, 3]).tolist()
        truth[str(i)] = []
        for obj_id, one in objects:
            alike = rigid_transform.rotation_about_z(np.pi * (i % 2) if obj_id == 1 else 0.7 * i)
            T_world_box = one.T_world_box @ rigid_transform.from_rotation(alike, np.zeros(3))
            truth[str(i)].append(truth_of(T, obj_id, T_world_box, models))
        if images:
            (scene / "rgb").mkdir(exist_ok=True)
            assert cv2.imwrite(str(scene / "rgb" / f"{i:06d}.png"), picture)
    (scene / "scene_camera.json").write_text(json.dumps(cameras, indent=1))
    (scene / "scene_gt.json").write_text(json.dumps(truth, indent=1))
    return scene
