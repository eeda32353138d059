"""Hulls are kept in units of their box, named by what they hold, and come back bit by bit."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ars_web.errors import BadInput
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.sessions.hull_mesh import HullMesh

FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
CORNERS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


def test_a_hull_stays_in_the_world_where_it_was_made(a_box: Callable[..., Box]):
    box = a_box(3.0)
    corners_world = rigid_transform.transform_points(box.T_world_box, (CORNERS - 0.5) * box.size)
    hull = HullMesh.of(corners_world, FACES, box)
    assert hull.vertices == pytest.approx(CORNERS - 0.5, abs=1e-6)
    vertices, faces = hull.in_world(box)
    assert vertices == pytest.approx(corners_world, abs=1e-7)
    assert faces.tolist() == FACES.tolist()


def test_a_hull_moves_turns_and_scales_with_its_box():
    hull = HullMesh(CORNERS - 0.5, FACES)
    R = rigid_transform.rotation_about_z(np.pi / 2)
    box = Box(rigid_transform.from_rotation(R, np.array([1.0, 2.0, 3.0])), np.array([0.2, 0.4, 0.6]))
    # The box's x is the world's y: its low corner at (-0.1, -0.2, -0.3) is turned to (0.2, -0.1, -0.3).
    assert hull.in_world(box)[0] == pytest.approx(
        np.array([[1.2, 1.9, 2.7], [1.2, 2.1, 2.7], [0.8, 1.9, 2.7], [1.2, 1.9, 3.3]])
    )


@given(st.lists(st.tuples(*[st.floats(-2, 2, width=32)] * 3), min_size=4, max_size=9), st.integers(0, 2**16))
def test_a_hull_comes_back_from_its_bytes_bit_by_bit(corners: list[tuple[float, ...]], seed: int):
    faces = np.random.default_rng(seed).permutation(len(corners))[FACES]
    hull = HullMesh(np.array(corners), faces)
    back = HullMesh.from_bytes(hull.vertex_bytes, hull.face_bytes)
    assert np.array_equal(back.vertices, hull.vertices)
    assert np.array_equal(back.faces, hull.faces)
    assert back.digest == hull.digest
    assert np.array_equal(HullMesh(np.array(corners), faces).vertices, np.array(corners))


def test_its_name_says_what_it_holds():
    hull = HullMesh(CORNERS, FACES)
    assert len(hull.digest) == 64
    assert HullMesh(CORNERS * -0.0 + CORNERS, FACES.astype(np.uint8)).digest == hull.digest
    assert HullMesh(CORNERS + 1e-12, FACES).digest != hull.digest
    assert HullMesh(CORNERS + 1.0 + 1e-12, FACES).digest == HullMesh(CORNERS + 1.0, FACES).digest
    assert HullMesh(CORNERS, FACES[::-1]).digest != hull.digest
    assert HullMesh(np.vstack([CORNERS, CORNERS]), FACES).digest != hull.digest


def test_nobody_can_change_it():
    corners, faces = CORNERS.copy(), FACES.copy()
    hull = HullMesh(corners, faces)
    corners[0, 0], faces[0, 0] = 9.0, 3
    assert (hull.vertices[0, 0], hull.faces[0, 0]) == (0.0, 0)
    with pytest.raises(ValueError, match="read-only"):
        hull.vertices[0, 0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        hull.in_world(Box(np.eye(4), np.ones(3)))[1][0, 0] = 1


@pytest.mark.parametrize(
    ("corners", "faces", "message"),
    [
        (CORNERS[:3], FACES, r"4 to 1000000 vertices of three numbers, not shape \[3, 3\]"),
        (CORNERS[:, :2], FACES, r"vertices of three numbers, not shape \[4, 2\]"),
        (CORNERS, FACES[:3], r"faces of three numbers, not shape \[3, 3\]"),
        (CORNERS, FACES[[0, 1, 2, 2]], "must be closed.* between vertices 0 and 2"),
        (CORNERS, FACES + 1, "whole numbers from 0 to 3"),
        (CORNERS, FACES - 1, "whole numbers from 0 to 3"),
        (CORNERS, FACES * 1.0, "whole numbers from 0 to 3"),
        (CORNERS * np.nan, FACES, "finite and within 1e"),
        (CORNERS * 1e300, FACES, "finite and within 1e"),
        (CORNERS * 2e6, FACES, "finite and within 1e"),
    ],
)
def test_what_is_no_mesh_is_refused(corners: np.ndarray, faces: np.ndarray, message: str):
    with pytest.raises(BadInput, match=message):
        HullMesh(corners, faces)


@pytest.mark.parametrize(("vertices", "faces"), [(b"\0" * 13, b"\0" * 48), (b"\0" * 48, b"\0" * 50), (b"", b"")])
def test_bytes_of_no_hull_are_refused(vertices: bytes, faces: bytes):
    with pytest.raises(BadInput, match="three numbers"):
        HullMesh.from_bytes(vertices, faces)
