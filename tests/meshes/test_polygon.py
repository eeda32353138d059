"""Planar polygons become meshes of both their sides, of the same area, that stay in their plane."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ars_web.errors import BadInput
from ars_web.geometry.mesh import Mesh
from ars_web.geometry.rigid_transform import rotation_from_wxyz
from ars_web.meshes.polygon import polygon_mesh

# The letter L, 3 m2.
RING = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]])
FLAT = np.column_stack([RING, np.zeros(6)])


@given(
    st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1),
    st.tuples(*[st.floats(-5, 5)] * 3),
    st.booleans(),
)
def test_a_polygon_keeps_its_place_and_area(wxyz: tuple[float, ...], place: tuple[float, ...], backwards: bool):
    corners = FLAT[:: -1 if backwards else 1] @ rotation_from_wxyz(np.array(wxyz)).T + place
    vertices, faces = polygon_mesh(corners)
    assert vertices == pytest.approx(corners, abs=1e-9)
    Mesh(vertices, faces)
    front = faces[: len(faces) // 2]
    assert len(front) == 4
    a, b, c = (vertices[front[:, i]] for i in range(3))
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2 == pytest.approx(3.0)


def test_corners_a_little_off_are_moved_into_the_plane():
    bent = FLAT + [0.0, 0.0, 1.0] * np.array([[0.01], [-0.01], [0.01], [-0.01], [0.01], [-0.01]])
    vertices, _ = polygon_mesh(bent)
    assert np.linalg.svd(vertices - vertices.mean(axis=0))[1][2] < 1e-12
    assert np.abs(vertices - bent).max() < 0.02


@pytest.mark.parametrize(
    ("corners", "message"),
    [
        (FLAT[:2], "3 to 10000 corners of three numbers"),
        (RING, "3 to 10000 corners of three numbers"),
        (FLAT * np.nan, "must be finite"),
        (FLAT * 1e-6, "one point or on one line"),
        (np.outer(np.arange(4.0), [1.0, 2.0, 3.0]), "one point or on one line"),
        (np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0.5], [0, 1, 0]]), "not flat: a corner is .* mm off"),
        (FLAT[[0, 1, 4, 5, 2]], "must not cross itself"),
    ],
)
def test_what_is_no_polygon_is_refused(corners: np.ndarray, message: str):
    with pytest.raises(BadInput, match=message):
        polygon_mesh(corners)
