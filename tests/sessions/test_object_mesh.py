"""Meshes of objects are kept in metres along their box's axes, named by what they hold, and come back bit by bit."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ars_web.errors import BadInput
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.sessions.object_mesh import MOST_FACES, ObjectMesh

FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
CORNERS = np.array([[0.0, 0.0, 0.0], [0.25, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 1.0]])


def test_a_mesh_moves_and_turns_with_its_box_and_does_not_scale_with_it():
    mesh = ObjectMesh(CORNERS, FACES)
    R = rigid_transform.rotation_about_z(np.pi / 2)
    T = rigid_transform.from_rotation(R, np.array([1.0, 2.0, 3.0]))
    # The box's x is the world's y.
    expected = np.array([[1.0, 2.0, 3.0], [1.0, 2.25, 3.0], [0.5, 2.0, 3.0], [1.0, 2.0, 4.0]])
    for size in ([0.2, 0.4, 0.6], [2.0, 1.0, 7.0]):
        vertices, faces = mesh.in_world(Box(T, np.array(size)))
        assert vertices == pytest.approx(expected)
        assert faces.tolist() == FACES.tolist()
    assert mesh.extent.tolist() == [0.25, 0.5, 1.0]


@given(st.lists(st.tuples(*[st.floats(-2, 2, width=32)] * 3), min_size=4, max_size=9), st.integers(0, 2**16))
def test_a_mesh_comes_back_from_its_bytes_bit_by_bit(corners: list[tuple[float, ...]], seed: int):
    faces = np.random.default_rng(seed).permutation(len(corners))[FACES]
    mesh = ObjectMesh(np.array(corners), faces)
    back = ObjectMesh.from_bytes(mesh.vertex_bytes, mesh.face_bytes)
    assert np.array_equal(back.vertices, mesh.vertices)
    assert np.array_equal(back.faces, mesh.faces)
    assert back.digest == mesh.digest


def test_its_name_says_what_it_holds():
    mesh = ObjectMesh(CORNERS, FACES)
    assert len(mesh.digest) == 64
    assert ObjectMesh(CORNERS * -0.0 + CORNERS, FACES.astype(np.uint8)).digest == mesh.digest
    assert ObjectMesh(CORNERS * 2, FACES).digest != mesh.digest
    assert ObjectMesh(CORNERS, FACES[::-1]).digest != mesh.digest


def test_a_flat_mesh_is_seen_from_both_sides():
    flat = ObjectMesh(CORNERS[:3], np.array([[0, 1, 2], [2, 1, 0]]))
    assert flat.extent.tolist() == [0.25, 0.5, 0.0]


def test_nobody_can_change_it():
    corners = CORNERS.copy()
    mesh = ObjectMesh(corners, FACES)
    corners[0, 0] = 9.0
    assert mesh.vertices[0, 0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        mesh.vertices[0, 0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        mesh.faces[0, 0] = 1


@pytest.mark.parametrize(
    ("corners", "faces", "message"),
    [
        (CORNERS[:2], FACES, r"3 vertices or more, of three numbers, not shape \[2, 3\]"),
        (CORNERS[:, :2], FACES, r"vertices or more, of three numbers, not shape \[4, 2\]"),
        (CORNERS, FACES[:1], r"2 faces or more, of three numbers, not shape \[1, 3\]"),
        (CORNERS, np.tile(FACES, (MOST_FACES // 4 + 1, 1)), "at most 200000 faces, not 200004: simplify it"),
        (CORNERS, FACES[[0, 1, 2, 2]], "must be closed.* between vertices 0 and 2"),
        (CORNERS, FACES + 1, "whole numbers from 0 to 3"),
        (CORNERS, FACES - 1, "whole numbers from 0 to 3"),
        (CORNERS, FACES * 1.0, "whole numbers from 0 to 3"),
        (CORNERS * np.nan, FACES, "finite and within 100 m"),
        (CORNERS * 1e300, FACES, "finite and within 100 m"),
        (CORNERS * 101, FACES, "finite and within 100 m"),
    ],
)
def test_what_is_no_mesh_is_refused(corners: np.ndarray, faces: np.ndarray, message: str):
    with pytest.raises(BadInput, match=message):
        ObjectMesh(corners, faces)


@pytest.mark.parametrize(("vertices", "faces"), [(b"\0" * 13, b"\0" * 48), (b"\0" * 48, b"\0" * 50), (b"", b"")])
def test_bytes_of_no_mesh_are_refused(vertices: bytes, faces: bytes):
    with pytest.raises(BadInput, match="three numbers"):
        ObjectMesh.from_bytes(vertices, faces)
