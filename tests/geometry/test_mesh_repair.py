"""Surfaces are made closed meshes whose faces look outward, whatever way their faces were turned before."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ars_web.geometry.mesh import Mesh
from ars_web.geometry.mesh_repair import repaired

TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
CORNERS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


def volume(vertices: np.ndarray, faces: np.ndarray) -> float:
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    return float((np.cross(a, b) * c).sum() / 6)


def soup(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Each face with corners of its own, as stl files have them."""
    return vertices[faces].reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3)


def ball(rows: int = 6) -> tuple[np.ndarray, np.ndarray]:
    """A ball of two poles and `rows` rings."""
    count = 9
    polar, azimuth = np.pi * np.arange(1, rows + 1) / (rows + 1), 2 * np.pi * np.arange(count) / count
    ring = np.stack([np.cos(azimuth), np.sin(azimuth)], axis=1)
    points = [[0, 0, 1], [0, 0, -1], *(np.append(np.sin(p) * xy, np.cos(p)) for p in polar for xy in ring)]
    faces: list[list[int]] = []
    for k in range(count):
        j = (k + 1) % count
        faces.append([0, 2 + k, 2 + j])
        last = 2 + (rows - 1) * count
        faces.append([1, last + j, last + k])
        for row in range(rows - 1):
            a, b = 2 + row * count, 2 + (row + 1) * count
            faces += [[a + k, b + k, b + j], [a + k, b + j, a + j]]
    return np.array(points, dtype=np.float64), np.array(faces)


def test_what_is_closed_and_faces_outward_stays_as_it_is():
    vertices, faces = ball()
    mesh = repaired(vertices, faces)
    assert np.array_equal(mesh.vertices, vertices)
    assert np.array_equal(mesh.faces, faces)
    assert (mesh.dropped, mesh.turned, mesh.open_edges) == (0, 0, 0)
    # So does one with a hollow, whose faces look into it.
    hollow = np.concatenate([faces, faces[:, ::-1] + len(vertices)])
    kept = repaired(np.concatenate([vertices, vertices / 2]), hollow)
    assert np.array_equal(kept.faces, hollow)


@settings(max_examples=30)
@given(st.lists(st.booleans(), min_size=108, max_size=108), st.integers(0, 2**16))
def test_whatever_way_faces_are_turned_they_look_outward_in_the_end(flips: list[bool], seed: int):
    vertices, faces = ball()
    assert len(faces) == len(flips)
    flipped = np.where(np.array(flips)[:, None], faces[:, ::-1], faces)
    flipped = flipped[np.random.default_rng(seed).permutation(len(flipped))]
    mesh = repaired(*soup(vertices, flipped))
    Mesh(mesh.vertices, mesh.faces)  # which refuses what is not closed
    assert (len(mesh.vertices), len(mesh.faces), mesh.open_edges, mesh.dropped) == (len(vertices), len(faces), 0, 0)
    assert volume(mesh.vertices, mesh.faces) == pytest.approx(volume(vertices, faces))
    assert mesh.turned == sum(flips)


def test_each_piece_is_turned_outward_for_itself():
    vertices = np.concatenate([CORNERS, CORNERS + 5.0])
    inward = TETRAHEDRON[:, ::-1]
    faces = np.concatenate([inward, np.concatenate([inward[:1, ::-1], inward[1:]]) + 4])
    mesh = repaired(vertices, faces)
    assert volume(mesh.vertices, mesh.faces) == pytest.approx(2 / 6)
    assert (mesh.turned, mesh.open_edges) == (4 + 3, 0)


def test_a_surface_that_ends_somewhere_is_seen_from_both_sides():
    mesh = repaired(CORNERS, TETRAHEDRON[:3])
    assert len(mesh.faces) == 6
    assert mesh.open_edges == 3
    Mesh(mesh.vertices, mesh.faces)
    assert volume(mesh.vertices, mesh.faces) == pytest.approx(0.0)
    one = repaired(CORNERS, TETRAHEDRON[:1])
    assert one.faces.tolist() == [[0, 2, 1], [0, 1, 2]]
    assert len(one.vertices) == 3
    # That is what it is then.
    assert repaired(one.vertices, one.faces).open_edges == 0


def test_a_surface_with_but_one_side_is_seen_from_both():
    around = 12
    angles = np.pi * np.arange(around) / around
    rim = [
        [(2 + s * np.cos(a)) * np.cos(2 * a), (2 + s * np.cos(a)) * np.sin(2 * a), s * np.sin(a)]
        for a in angles
        for s in (-1, 1)
    ]
    faces: list[list[int]] = []
    for k in range(around):
        a, b = 2 * k, 2 * k + 1
        c, d = (2 * k + 2, 2 * k + 3) if k < around - 1 else (1, 0)
        faces += [[a, b, c], [b, d, c]]
    mesh = repaired(np.array(rim), np.array(faces))
    assert len(mesh.faces) == 4 * around
    Mesh(mesh.vertices, mesh.faces)


def test_faces_that_say_nothing_are_dropped_and_corners_shared():
    vertices = np.concatenate([CORNERS, CORNERS, [[7.0, 7.0, 7.0]]])
    faces = np.concatenate([TETRAHEDRON[:2], TETRAHEDRON[2:] + 4, [[0, 0, 1], [0, 4, 2]], TETRAHEDRON[:1]])
    mesh = repaired(vertices, faces)
    assert mesh.vertices.tolist() == CORNERS.tolist()
    assert mesh.faces.tolist() == TETRAHEDRON.tolist()
    assert (mesh.dropped, mesh.turned, mesh.open_edges) == (3, 0, 0)
    nothing = repaired(vertices, np.array([[0, 0, 1], [1, 5, 2]]))
    assert (nothing.faces.shape, nothing.dropped) == ((0, 3), 2)
