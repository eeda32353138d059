"""A synthetic recording for the exports: small images, a bent lens, boxes near, far, beside and behind the camera."""

import hashlib
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.keypoints import Keypoint
from ars_web.geometry.symmetry import NO_SYMMETRY, Symmetry
from ars_web.sessions.hull_mesh import HullMesh
from ars_web.sessions.model import FrameTable, ObjectClass, SessionSnapshot, SessionState, VirtualBox
from ars_web.sessions.object_mesh import ObjectMesh

BENT = Camera(64, 48, 50.0, 51.0, 31.0, 24.5, "brown", (-0.2, 0.05, 0.001, -0.001, 0.0))
FLAT = Camera(48, 64, 50.0, 50.0, 23.5, 31.5)


def circling(n: int) -> np.ndarray:
    """`Ts_world_camera` (n, 4, 4) of a camera that circles the origin half a turn, looking at it but for the last
    sixth of the frames, which look away."""
    angle = np.linspace(0.0, np.pi, n)
    centre = np.column_stack([np.cos(angle), np.sin(angle), np.full(n, 0.5)])
    z = -centre / np.linalg.norm(centre, axis=1, keepdims=True)
    z[n - n // 6 :] *= -1
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return rigid_transform.from_rotation(np.stack([x, np.cross(z, x), z], axis=-1), centre)


def boxes(n: int = 3) -> list[Box]:
    """n boxes in a row; the outer ones leave the image in some frames."""
    return [
        Box(
            rigid_transform.from_rotation(
                rigid_transform.rotation_about_z(0.4 * i), np.array([0.25 * i - 0.7 * (i == 0), 0, 0])
            ),
            np.array([0.2, 0.15, 0.1 + 0.05 * i]),
        )
        for i in range(n)
    ]


def write_images(folder: Path, names: list[str], sizes: list[tuple[int, int]]) -> list[Path]:
    """An image for each name, no two alike."""
    paths: list[Path] = []
    for i, (name, (width, height)) in enumerate(zip(names, sizes, strict=True)):
        image = np.full((height, width, 3), (i * 37 % 256, i * 11 % 256, 90), dtype=np.uint8)
        image[: height // 2, : width // 2] = 255 - image[: height // 2, : width // 2]
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        assert cv2.imwrite(str(path), image)
        paths.append(path)
    return paths


@pytest.fixture
def make_snapshot(tmp_path: Path) -> Callable[..., SessionSnapshot]:
    """Makes sessions of n frames with images on the disk, every fifth frame from a second camera; `hulls` and `meshes`
    by box, `keypoints` and `symmetries` by class."""

    def make(
        n: int = 12,
        *,
        sid: str = "s1",
        classes: tuple[str, ...] = ("cube", "tall one"),
        objects: list[Box] | None = None,
        suffix: str = ".jpg",
        one_camera: bool = False,
        revision: int = 3,
        hulls: dict[int, HullMesh] | None = None,
        meshes: dict[int, ObjectMesh] | None = None,
        keypoints: dict[int, tuple[Keypoint, ...]] | None = None,
        symmetries: dict[int, Symmetry] | None = None,
    ) -> SessionSnapshot:
        hulls, meshes, keypoints, symmetries = hulls or {}, meshes or {}, keypoints or {}, symmetries or {}
        names = [f"{i:04d}{suffix}" for i in range(n)]
        camera_ids = np.zeros(n, dtype=np.int64) if one_camera else (np.arange(n) % 5 == 4).astype(np.int64)
        sizes = [(FLAT.width, FLAT.height) if i else (BENT.width, BENT.height) for i in camera_ids.tolist()]
        objects = boxes() if objects is None else objects
        state = SessionState(
            revision=revision,
            name=f"session {sid}",
            classes={
                i: ObjectClass(
                    i,
                    name,
                    "#e6194b",
                    1,
                    symmetry=symmetries.get(i, NO_SYMMETRY),
                    keypoints=keypoints.get(i, ()),
                )
                for i, name in enumerate(classes)
            },
            boxes={
                i: VirtualBox(
                    i,
                    (i - 1) % len(classes),
                    f"box {i}",
                    box,
                    1,
                    hull=hulls[i].digest if i in hulls else None,
                    mesh=meshes[i].digest if i in meshes else None,
                )
                for i, box in enumerate(objects, 1)
            },
            next_class_id=len(classes),
            next_box_id=len(objects) + 1,
        )
        images = tuple(write_images(tmp_path / f"recording-{sid}" / "images", names, sizes))
        frames = FrameTable(tuple(names), images, camera_ids, circling(n))
        return SessionSnapshot(
            sid,
            state,
            {0: BENT, 1: FLAT},
            frames,
            {hull.digest: hull for hull in hulls.values()},
            {mesh.digest: mesh for mesh in meshes.values()},
        )

    return make


@pytest.fixture(scope="session")
def octahedron() -> HullMesh:
    """A hull that touches all six faces of its box, and is a sixth of it."""
    tips = np.concatenate([np.eye(3), -np.eye(3)]) / 2
    faces = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    return HullMesh(tips, np.array(faces))


@pytest.fixture
def tree() -> Callable[[Path], dict[str, str]]:
    """The SHA-256 of every file below a folder, by relative path; folders end in `/`."""

    def digests(folder: Path) -> dict[str, str]:
        return {
            f"{path.relative_to(folder)}{'/' if path.is_dir() else ''}": ""
            if path.is_dir()
            else hashlib.sha256(path.read_bytes()).hexdigest()
            for path in sorted(folder.rglob("*"))
        }

    return digests
