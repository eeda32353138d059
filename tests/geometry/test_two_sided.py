"""Open surfaces against the silhouette of their triangles, which asks for no closed mesh."""

import numpy as np
import pytest
import shapely
import trimesh

from ars_web.errors import BadInput
from ars_web.geometry import rigid_transform
from ars_web.geometry.labels import NEAR
from ars_web.geometry.mesh_labels import labels_of_meshes
from ars_web.geometry.mesh_outlines import mesh_outline
from ars_web.geometry.mesh_silhouette import silhouette
from ars_web.geometry.two_sided import two_sided

ONE = np.array([[0, 1, 2]])


def bowl() -> tuple[np.ndarray, np.ndarray]:
    """Half a ball of radius 0.5 without a lid."""
    ball = trimesh.creation.icosphere(2, 0.5)
    open_above = ball.triangles_center[:, 2] < 0
    return np.array(ball.vertices), np.array(ball.faces)[open_above]


def test_each_face_has_a_back_in_the_same_place():
    vertices, faces = bowl()
    mesh = two_sided(vertices, faces)
    n = len(faces)
    np.testing.assert_array_equal(mesh.faces[:n], faces)
    np.testing.assert_array_equal(mesh.planes[:n], -mesh.planes[n:])


def test_edges_within_a_surface_pair_its_fronts_and_its_backs():
    vertices, faces = bowl()
    edges, n = two_sided(vertices, faces).edges, len(faces)
    sides = (edges[:, 2:] >= n).sum(axis=1)
    border = sides == 1
    assert (edges[border, 2] % n == edges[border, 3] % n).all()
    assert (edges[~border, 2] % n != edges[~border, 3] % n).all()
    once = trimesh.Trimesh(vertices, faces, process=False)
    assert border.sum() == len(trimesh.grouping.group_rows(once.edges_sorted, require_count=1))
    assert (~border).sum() == 2 * len(once.face_adjacency)


@pytest.mark.parametrize("first", range(0, 40, 20))
def test_a_bowl_is_seen_from_all_sides_as_its_triangles_are(first: int, random_scene, mesh_oracle):
    vertices, faces = bowl()
    seen = 0
    for seed in range(first, first + 20):
        camera, T_world_camera, box = random_scene(seed)
        placed = rigid_transform.transform_points(box.T_world_box, vertices * box.size)
        # Turned at random, as triangles of a soup are.
        turned = np.where(np.random.default_rng(seed).random((len(faces), 1)) < 0.3 * (seed % 2), faces[:, ::-1], faces)
        mesh = two_sided(placed, turned)
        ring = mesh_outline(camera, T_world_camera, mesh)
        image = shapely.box(0, 0, camera.width, camera.height)
        whole = silhouette(camera, T_world_camera, placed, faces, reach=20.0)
        want = shapely.make_valid(whole).intersection(image)
        found = shapely.make_valid(shapely.Polygon(ring)) if len(ring) else shapely.Polygon()
        assert found.symmetric_difference(want).area < 0.2 * (want.length + found.length) + 1, f"scene {seed}"
        if seed % 7 == 0:
            labels = labels_of_meshes(camera, T_world_camera[None], [mesh])
            label = mesh_oracle.label(camera, T_world_camera, mesh, near=NEAR)
            np.testing.assert_allclose(labels.bbox[0, 0], label.bbox, atol=0.1, rtol=0, err_msg=f"scene {seed}")
            assert labels.truncated[0, 0] == pytest.approx(label.truncated, abs=0.02), f"scene {seed}"
        seen += not want.is_empty
    assert seen >= 6


def test_faces_without_three_vertices_are_left_out():
    mesh = two_sided(np.eye(3), np.array([[0, 1, 2], [0, 0, 1], [2, 1, 2], [1, 1, 1]]))
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 1]]
    with pytest.raises(BadInput, match="at least one face"):
        two_sided(np.eye(3), np.array([[0, 0, 1]]))


def test_what_no_mesh_may_be_is_refused():
    with pytest.raises(BadInput, match="vertex 3"):
        two_sided(np.eye(3), ONE + 1)
    with pytest.raises(BadInput, match="finite"):
        two_sided(np.eye(3) * np.nan, ONE)
