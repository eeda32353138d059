"""One synthetic camera path, written in every format by code that shares nothing with the readers."""

import json
import struct
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ars_web.geometry.camera import Camera

W, H = 64, 48


def pose(rng: np.random.Generator) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = Rotation.random(random_state=rng.integers(1 << 31)).as_matrix()
    T[:3, 3] = rng.normal(size=3)
    return T


def spelled(values: object) -> str:
    return " ".join(repr(float(value)) for value in np.ravel(values))


def xyz_xyzw(T: np.ndarray) -> np.ndarray:
    return np.concatenate([T[:3, 3], Rotation.from_matrix(T[:3, :3]).as_quat()])


def wxyz_xyz(T: np.ndarray) -> np.ndarray:
    return np.concatenate([Rotation.from_matrix(T[:3, :3]).as_quat()[[3, 0, 1, 2]], T[:3, 3]])


def write_image(path: Path, size: tuple[int, int] = (W, H)) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    noise = np.random.default_rng(len(path.name)).integers(0, 255, (size[1], size[0], 3), dtype=np.uint8)
    assert cv2.imwrite(str(path), noise)
    return path


@dataclass
class Truth:
    camera: Camera
    Ts: np.ndarray
    T_wrist_camera: np.ndarray
    names: list[str]

    def numbers(self) -> str:
        c = self.camera
        return spelled([c.width, c.height, c.fx, c.fy, c.cx, c.cy, *c.distortion])

    @property
    def Ts_world_wrist(self) -> np.ndarray:
        return self.Ts @ np.linalg.inv(self.T_wrist_camera)

    def images(self, folder: Path) -> None:
        for name in self.names:
            write_image(folder / name)

    def ars(self, root: Path) -> Path:
        self.images(root / "images")
        (root / "robot_poses.txt").write_text("\n".join(spelled(xyz_xyzw(T)) for T in self.Ts_world_wrist) + "\n")
        (root / "camera_extrinsics.txt").write_text(spelled(xyz_xyzw(self.T_wrist_camera)))
        (root / "camera_intrinsics.txt").write_text(self.numbers())
        return root

    def manifest(self, scene_path: str) -> dict[str, object]:
        c = self.camera
        names = ["width", "height", "fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"]
        values = [c.width, c.height, c.fx, c.fy, c.cx, c.cy, *c.distortion]
        return {
            "_type": "__import__('os').abort()",
            "scene_path": scene_path,
            "images_path": "images",
            "image_filenames_lists": list(self.names),
            "robot_poses": [xyz_xyzw(T).tolist() for T in self.Ts_world_wrist],
            "robot_to_camera_pose": xyz_xyzw(self.T_wrist_camera).tolist(),
            "camera_params": {"_type": "TrainingCamera", **dict(zip(names, values, strict=True))},
            "classes": {},
        }

    def roars(self, root: Path) -> Path:
        self.images(root / "scene" / "images")
        file = root / "scene.roars"
        file.write_text(json.dumps(self.manifest("scene")))
        return file

    def tum(self, root: Path) -> Path:
        self.images(root / "images")
        (root / "camera_intrinsics.txt").write_text(self.numbers())
        lines = [f"{1000 + i / 30:.6f} {spelled(xyz_xyzw(T))}" for i, T in enumerate(self.Ts)]
        (root / "trajectory.txt").write_text("# timestamp tx ty tz qx qy qz qw\n" + "\n".join(lines))
        return root

    def poses(self, root: Path) -> Path:
        self.images(root / "images")
        (root / "camera_intrinsics.txt").write_text(self.numbers())
        (root / "poses.txt").write_text("\n".join(spelled(T) for T in self.Ts))
        return root

    def transforms(self) -> dict[str, object]:
        c = self.camera
        k1, k2, p1, p2, k3 = c.distortion
        flip = np.diag([1.0, -1.0, -1.0, 1.0])
        return {
            **{"w": c.width, "h": c.height, "fl_x": c.fx, "fl_y": c.fy, "cx": c.cx + 0.5, "cy": c.cy + 0.5},
            **{"camera_model": "OPENCV", "k1": k1, "k2": k2, "p1": p1, "p2": p2, "k3": k3},
            "frames": [
                {"file_path": f"images/{name}", "transform_matrix": (T @ flip).tolist()}
                for name, T in zip(self.names, self.Ts, strict=True)
            ],
        }

    def nerfstudio(self, root: Path) -> Path:
        self.images(root / "images")
        (root / "transforms.json").write_text(json.dumps(self.transforms(), indent=1))
        return root

    def full_opencv(self) -> list[float]:
        c = self.camera
        k1, k2, p1, p2, k3 = c.distortion
        return [c.fx, c.fy, c.cx + 0.5, c.cy + 0.5, k1, k2, p1, p2, k3, 0.0, 0.0, 0.0]

    def colmap_text(self, root: Path) -> Path:
        """An old model: no rigs. Ids neither begin at 0 nor follow the names."""
        self.images(root / "images")
        model = root / "sparse" / "0"
        model.mkdir(parents=True)
        (model / "cameras.txt").write_text(f"# Cameras\n7 FULL_OPENCV {W} {H} {spelled(self.full_opencv())}\n")
        lines = ["# Images"]
        for i in reversed(range(len(self.Ts))):
            lines.append(f"{40 - i} {spelled(wxyz_xyz(np.linalg.inv(self.Ts[i])))} 7 {self.names[i]}")
            lines.append("1.5 2.5 -1 3.5 4.5 12" if i % 2 else "")
        (model / "images.txt").write_text("\n".join(lines) + "\n")
        (model / "points3D.txt").write_text("")
        return root

    def colmap_binary(self, root: Path) -> Path:
        self.images(root / "images")
        model = root / "sparse" / "0"
        model.mkdir(parents=True)
        (model / "cameras.bin").write_bytes(struct.pack("<QIiQQ12d", 1, 7, 6, W, H, *self.full_opencv()))
        data = struct.pack("<Q", len(self.Ts))
        for i in reversed(range(len(self.Ts))):
            data += struct.pack("<I7dI", 40 - i, *wxyz_xyz(np.linalg.inv(self.Ts[i])), 7)
            data += self.names[i].encode() + b"\0" + struct.pack("<Q", i) + struct.pack("<ddq", 1.5, 2.5, -1) * i
        (model / "images.bin").write_bytes(data)
        (model / "points3D.bin").write_bytes(struct.pack("<Q", 0))
        return root


FORMS: dict[str, Callable[[Truth, Path], Path]] = {
    "ars": Truth.ars,
    "roars": Truth.roars,
    "tum": Truth.tum,
    "colmap": Truth.colmap_text,
    "colmap_binary": Truth.colmap_binary,
    "nerfstudio": Truth.nerfstudio,
    "poses": Truth.poses,
}


@pytest.fixture
def truth() -> Truth:
    rng = np.random.default_rng(7)
    camera = Camera(W, H, 61.25, 60.5, 30.75, 24.125, "brown", (-0.2, 0.05, 0.001, -0.002, 0.01))
    return Truth(camera, np.array([pose(rng) for _ in range(6)]), pose(rng), [f"frame_{i:03d}.png" for i in range(6)])


@pytest.fixture(params=FORMS)
def form(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def written(truth: Truth, tmp_path: Path) -> Callable[[str], Path]:
    """Writes the truth in a form and answers what to give to the reader."""

    def write(form: str) -> Path:
        root = tmp_path / form
        root.mkdir()
        return FORMS[form](truth, root)

    return write


@pytest.fixture
def image_writer() -> Callable[..., Path]:
    return write_image


@pytest.fixture
def random_pose() -> Callable[[np.random.Generator], np.ndarray]:
    return pose


@pytest.fixture
def colmap_pose() -> Callable[[np.ndarray], np.ndarray]:
    """qw qx qy qz tx ty tz of a transform."""
    return wxyz_xyz
