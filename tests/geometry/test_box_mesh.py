import numpy as np
import pytest
import trimesh
from numpy.testing import assert_allclose, assert_array_equal

from ars_web.geometry import rigid_transform
from ars_web.geometry.box import CORNER_SIGNS, Box
from ars_web.geometry.box_mesh import box_mesh


def test_a_boxs_mesh_has_its_corners_and_its_volume():
    turn = rigid_transform.rotation_from_wxyz(np.array([0.5, 0.1, -0.7, 0.3]))
    box = Box(rigid_transform.from_rotation(turn, np.array([1.0, -2, 3])), np.array([0.1, 0.2, 0.5]))
    mesh = box_mesh(box)
    assert_array_equal(mesh.vertices_world, box.corners_world)
    solid = trimesh.Trimesh(mesh.vertices_world, mesh.faces, process=False)
    assert solid.is_watertight
    # Negative where faces are turned inwards.
    assert solid.volume == pytest.approx(box.volume)


def test_its_sides_face_along_the_boxs_axes():
    mesh = box_mesh(Box(np.eye(4), np.array([1.0, 2, 3])))
    normals = mesh.planes[:, :3]
    want = np.repeat([[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]], 2, axis=0)
    assert_allclose(normals, want, atol=1e-12)
    assert_allclose((CORNER_SIGNS * [0.5, 1, 1.5])[mesh.faces].mean(axis=1)[::2].sum(axis=0), 0, atol=1)
