import numpy as np
import pytest
import trimesh

from ars_web.errors import BadInput
from ars_web.geometry.mesh import Mesh

CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def test_each_edge_knows_its_two_faces_and_the_longest_comes_first():
    mesh = Mesh(CORNERS * [3, 2, 1], TETRAHEDRON)
    assert len(mesh.edges) == 6
    for start, end, there, back in mesh.edges.tolist():
        assert (start, end) in zip(mesh.faces[there], np.roll(mesh.faces[there], -1), strict=True)
        assert (end, start) in zip(mesh.faces[back], np.roll(mesh.faces[back], -1), strict=True)
    lengths = np.linalg.norm(np.diff(mesh.vertices_world[mesh.edges[:, :2]], axis=1)[:, 0], axis=1)
    assert (np.diff(lengths) <= 0).all()


def test_a_plane_tells_how_far_outside_a_point_is():
    mesh = Mesh(np.concatenate([CORNERS, [[0.5, 0, 0]]]), np.concatenate([TETRAHEDRON, [[0, 1, 4], [4, 1, 0]]]))
    outside = mesh.planes @ [2.0, 2.0, 2.0, 1.0]
    np.testing.assert_allclose(outside[:4], [-2, -2, -2, 5 / np.sqrt(3)])
    # Faces without an area have every point inside.
    assert (outside[4:] == -np.inf).all()


def test_all_vertices_lie_in_the_sphere():
    mesh = Mesh(CORNERS, TETRAHEDRON)
    centre, radius = mesh.sphere
    assert (np.linalg.norm(mesh.vertices_world - centre, axis=1) <= radius).all()


def test_a_convex_mesh_is_known_by_its_faces():
    assert Mesh(CORNERS, TETRAHEDRON).is_convex
    dented = trimesh.creation.icosphere(subdivisions=2)
    assert Mesh(dented.vertices, dented.faces).is_convex
    vertices = dented.vertices.copy()
    vertices[0] *= 0.9
    assert not Mesh(vertices, dented.faces).is_convex


def test_an_edge_of_four_faces_is_allowed():
    # Two tetrahedra that share one edge.
    other = CORNERS * [1, -1, -1]
    faces = np.concatenate([TETRAHEDRON, np.array([[0, 5, 1], [0, 1, 4], [0, 4, 5], [1, 5, 4]])[:, ::-1]])
    mesh = Mesh(np.concatenate([CORNERS, other[2:]]), faces)
    assert len(mesh.edges) == 12


@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        (CORNERS, TETRAHEDRON[:3], "closed.*between vertices 1 and 2|closed"),
        (CORNERS, np.concatenate([TETRAHEDRON[:3], TETRAHEDRON[3:, ::-1]]), "turned the same way"),
        (CORNERS, np.zeros((0, 3), int), "at least one face"),
        (CORNERS[:, :2], TETRAHEDRON, r"not vertices \[4, 2\]"),
        (CORNERS * np.nan, TETRAHEDRON, "finite"),
        (CORNERS, TETRAHEDRON + 1, "vertex 4; its vertices are 0 to 3"),
    ],
)
def test_what_is_no_closed_mesh_is_refused(vertices, faces, message):
    with pytest.raises(BadInput, match=message):
        Mesh(vertices, faces)


def test_the_convex_hulls_vertices_reach_as_far_as_all_vertices_in_every_direction():
    random = np.random.default_rng(0)
    ball = random.normal(size=(300, 3)) @ random.normal(size=(3, 3)) * 0.01 + [500, -20, 3]
    flat = np.column_stack([random.normal(size=(300, 2)), np.ones(300)]) @ random.normal(size=(3, 3))
    directions = random.normal(size=(200, 3))
    can = (
        np.array(trimesh.creation.cylinder(0.03, 0.1, sections=150).vertices)[:300]
        + random.normal(size=(300, 3)) * 1e-5
    )
    for points, most in ((ball, 100), (can, 300), (flat, 300)):
        # Any faces, once each way round, that have all vertices but the last, which belongs to none.
        faces = np.arange(300).reshape(-1, 3)
        mesh = Mesh(np.concatenate([points, [[1e4, 0, 0]]]), np.concatenate([faces, faces[:, ::-1]]))
        found = mesh.hull_vertices_world
        assert len(found) <= most
        reach = np.abs((points @ directions.T).max(axis=0) - (found @ directions.T).max(axis=0))
        assert reach.max() < 1e-9 * np.ptp(points, axis=0).max()
