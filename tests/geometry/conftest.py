"""Scenes for the geometry's tests: cameras of every model, and boxes anywhere round them."""

import importlib.util
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import shapely
import trimesh

from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.mesh import Mesh

Scene = tuple[Camera, np.ndarray, Box]


@pytest.fixture(scope="session")
def oracle() -> ModuleType:
    """`label_oracle.py`, the slow readable version of the labels."""
    return _beside("label_oracle")


@pytest.fixture(scope="session")
def mesh_oracle() -> ModuleType:
    """`mesh_oracle.py`, the slow readable version of the labels of meshes."""
    return _beside("mesh_oracle")


@pytest.fixture(scope="session")
def shape_oracle() -> ModuleType:
    """`shape_oracle.py`, the slow readable version of visibility among shapes."""
    return _beside("shape_oracle")


@pytest.fixture(scope="session")
def hulls() -> ModuleType:
    """`hull_oracle.py`, the slow readable version of the visual hull, with shapes and cameras round them."""
    return _beside("hull_oracle")


def _beside(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, Path(__file__).parent / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def solids() -> dict[str, Mesh]:
    """Closed meshes about the origin, a unit across: convex, bent, with a tunnel, in two pieces, and hollow."""
    ell = shapely.Polygon([(0, 0), (1, 0), (1, 0.3), (0.3, 0.3), (0.3, 1), (0, 1)])
    hollow = trimesh.creation.box((0.9, 0.9, 0.9))
    hollow.invert()
    shapes = {
        "ball": trimesh.creation.icosphere(1, 0.5),
        "torus": trimesh.creation.torus(0.37, 0.13, major_sections=14, minor_sections=8),
        "L": trimesh.creation.extrude_polygon(ell, 0.4),
        "can": trimesh.creation.cylinder(0.4, 1.0, sections=14),
        "two": trimesh.util.concatenate(
            [trimesh.creation.box((0.3, 0.3, 0.3)), trimesh.creation.icosphere(0, 0.3).apply_translation([0.7, 0.1, 0])]
        ),
        "hollow": trimesh.util.concatenate([trimesh.creation.box((1.0, 1.0, 1.0)), hollow]),
    }
    return {
        name: Mesh(np.array(shape.vertices) - shape.bounds.mean(axis=0), np.array(shape.faces))
        for name, shape in shapes.items()
    }


def random_camera(random: np.random.Generator) -> Camera:
    """A small camera of any model, its principal point anywhere, bent as strongly as lenses are and more."""
    width, height = int(random.integers(120, 320)), int(random.integers(100, 260))
    fx = random.uniform(0.4, 1.5) * width
    fy = fx * random.uniform(0.9, 1.1)
    cx, cy = width * random.uniform(0.2, 0.8), height * random.uniform(0.2, 0.8)
    model = random.integers(3)
    if model == 0:
        return Camera(width, height, fx, fy, cx, cy)
    if model == 1:
        k1, k2, k3 = random.uniform([-0.4, -0.1, -0.05], [0.3, 0.15, 0.05])
        p1, p2 = random.uniform(-0.01, 0.01, 2)
        return Camera(width, height, fx, fy, cx, cy, "brown", (k1, k2, p1, p2, k3))
    return Camera(width, height, 0.6 * fx, 0.6 * fy, cx, cy, "fisheye", tuple(random.uniform(-0.05, 0.05, 4)))


def random_rotation(random: np.random.Generator) -> np.ndarray:
    return rigid_transform.rotation_from_wxyz(random.normal(size=4))


@pytest.fixture(scope="session")
def random_scene() -> Callable[[int], Scene]:
    """A camera, its `T_world_camera` and a box before, behind, beside or round it; the same for the same seed."""

    def make(seed: int) -> Scene:
        random = np.random.default_rng(seed)
        camera = random_camera(random)
        T_world_camera = rigid_transform.from_rotation(random_rotation(random), random.normal(size=3))
        spread = random.uniform(0, 1.2) ** 2
        centre_camera = random.normal(size=3) * [0.5, 0.4, 0.3] * spread + [0, 0, random.uniform(-0.1, 0.8)]
        T_camera_box = rigid_transform.from_rotation(random_rotation(random), centre_camera)
        size = np.exp(random.uniform(np.log(0.02), np.log(0.6), 3))
        return camera, T_world_camera, Box(T_world_camera @ T_camera_box, size)

    return make
