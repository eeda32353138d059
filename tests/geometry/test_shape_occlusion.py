"""Visible shares of boxes and meshes against rays through every other pixel, against those of boxes, and by hand."""

import numpy as np
import pytest
import shapely
import trimesh
from numpy.testing import assert_allclose, assert_array_equal

from ars_web.errors import BadInput
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.labels import NEAR, labels_of_boxes
from ars_web.geometry.mesh import Mesh
from ars_web.geometry.mesh_labels import labels_of_meshes
from ars_web.geometry.occlusion import visible_fractions
from ars_web.geometry.shape_occlusion import visible_shares
from ars_web.geometry.shape_stack import mesh_of_box

IDENTITY = np.eye(4)
PINHOLE = Camera(640, 480, 500.0, 500.0, 319.5, 239.5)


def upright(x: float, y: float, z: float, size: tuple[float, float, float]) -> Box:
    place = np.array([x, y, z], dtype=np.float64)
    return Box(rigid_transform.from_rotation(np.eye(3), place), np.array(size, dtype=np.float64))


def stretched(solid: Mesh, box: Box) -> Mesh:
    """A solid a unit across, stretched over a box."""
    return Mesh(rigid_transform.transform_points(box.T_world_box, solid.vertices_world * box.size), solid.faces)


def flat(outline: list[tuple[float, float]], z: float) -> Mesh:
    """A polygon at the depth z, seen from both sides."""
    corners, triangles = trimesh.creation.triangulate_polygon(shapely.Polygon(outline), engine="manifold")
    vertices = np.column_stack([corners, np.full(len(corners), z)])
    return Mesh(vertices, np.concatenate([triangles, np.array(triangles)[:, ::-1]]))


def turned(mesh: Mesh, angle: float, *, z: float) -> Mesh:
    """A mesh turned about the image's vertical through (0, 0, z)."""
    c, s = np.cos(angle), np.sin(angle)
    R, pivot = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]), np.array([0, 0, z])
    return Mesh((mesh.vertices_world - pivot) @ R.T + pivot, mesh.faces)


def bboxes(camera: Camera, T: np.ndarray, boxes: list[Box], meshes: list[Mesh | None]) -> np.ndarray:
    solids = [mesh_of_box(box) if mesh is None else mesh for box, mesh in zip(boxes, meshes, strict=True)]
    return labels_of_meshes(camera, T[None], solids).bbox


def shares(
    camera: Camera, boxes: list[Box], meshes: list[Mesh | None], *, T: np.ndarray = IDENTITY, step: int = 8
) -> np.ndarray:
    return visible_shares(camera, T[None], boxes, meshes, bboxes(camera, T, boxes, meshes), step=step)[0]


def scattered(T_world_camera: np.ndarray, seed: int, n: int) -> list[Box]:
    """Boxes anywhere before the camera, some of them in each other."""
    random = np.random.default_rng(seed)
    places = random.normal(size=(n, 3)) * 0.3 + [0, 0, 0.7]
    turns = random.normal(size=(n, 4))
    sizes = random.uniform(0.05, 0.5, (n, 3))
    Ts = T_world_camera @ rigid_transform.from_position_wxyz(places, turns)
    return [Box(T, size) for T, size in zip(Ts, sizes, strict=True)]


# Against the oracle


def test_shares_follow_rays_through_every_other_pixel(shape_oracle, random_scene, solids):
    errors = []
    for seed in range(6):
        camera, T, _ = random_scene(seed)
        boxes = scattered(T, seed, 5)
        meshes = [stretched(solid, box) for solid, box in zip(list(solids.values())[:4], boxes, strict=False)]
        kinds = [*meshes, None]
        rays = shape_oracle.pixel_rays(camera, spacing=2)
        solid = [*meshes, mesh_of_box(boxes[4])]
        want, pixels = shape_oracle.shares([shape_oracle.layer(rays, T, mesh, near=NEAR) for mesh in solid])
        found = shares(camera, boxes, kinds, T=T, step=4)
        clear = pixels > 15
        errors += list(np.abs(found - want)[clear])
    assert len(errors) > 15
    assert np.mean(errors) < 0.01
    assert np.max(errors) < 0.12


def test_boxes_as_meshes_are_seen_as_boxes(random_scene):
    """Whatever lies in whatever, the camera's own place included."""
    inside, off = 0, []
    for seed in range(80):
        camera, T, box = random_scene(seed)
        boxes = [box, *scattered(T, seed, 4)]
        if seed % 4 == 0:
            boxes[0] = Box(T, box.size)
        bbox = labels_of_boxes(camera, T[None], boxes).bbox
        want = visible_fractions(camera, T[None], boxes, bbox)[0]
        found = visible_shares(camera, T[None], boxes, [mesh_of_box(box) for box in boxes], bbox)[0]
        assert_array_equal(np.isnan(found), np.isnan(want), err_msg=f"scene {seed}")
        off += list(np.abs(found - want)[~np.isnan(want)])
        centre = rigid_transform.invert(boxes[0].T_world_box) @ T[:, 3]
        inside += bool((np.abs(centre[:3]) < boxes[0].size / 2).all() and not np.isnan(found[0]))
    assert inside > 3
    assert np.mean(off) < 5e-4
    # A ray that passes at a border may be told to be on either side.
    assert np.quantile(off, 0.99) < 0.025
    assert np.max(off) < 0.06


def test_without_meshes_boxes_are_looked_at(random_scene):
    camera, T, _ = random_scene(3)
    boxes = scattered(T, 3, 6)
    bbox = labels_of_boxes(camera, T[None], boxes).bbox
    assert_array_equal(
        visible_shares(camera, T[None], boxes, [None] * 6, bbox), visible_fractions(camera, T[None], boxes, bbox)
    )


# By hand


def test_half_of_a_shape_is_behind_another():
    far, near = upright(0, 0, 1.0, (0.2, 0.2, 1e-3)), upright(0.05, 0, 0.5, (0.1, 0.2, 1e-3))
    for meshes in ([mesh_of_box(far), None], [None, mesh_of_box(near)]):
        assert_allclose(shares(PINHOLE, [far, near], meshes), [0.5, 1.0], atol=0.05)


def test_one_sees_through_the_hole_of_a_ring(solids):
    ring = upright(0, 0, 0.5, (0.2, 0.2, 0.2))
    behind = upright(0, 0, 1.0, (0.1, 0.1, 0.1))
    assert_array_equal(shares(PINHOLE, [ring, behind], [stretched(solids["torus"], ring), None]), [1, 1])
    assert shares(PINHOLE, [ring, behind], [None, mesh_of_box(behind)])[1] == 0


def test_a_flat_polygon_hides_and_is_hidden_from_either_side():
    square = flat([(-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1)], 1.0)
    bound, near = upright(0, 0, 1.0, (0.2, 0.2, 1e-6)), upright(0.05, 0, 0.5, (0.1, 0.2, 1e-3))
    for angle in (0.0, np.pi):
        mesh = turned(square, angle, z=1.0)
        assert_allclose(shares(PINHOLE, [bound, near], [mesh, None]), [0.5, 1.0], atol=0.05)
    behind = upright(0.0, 0, 2.0, (0.8, 0.4, 1e-3))
    assert_allclose(shares(PINHOLE, [bound, behind], [square, None]), [1.0, 0.5], atol=0.05)


def test_a_flat_polygon_edge_on_hides_nothing_and_counts_as_seen():
    square = turned(flat([(-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1)], 1.0), np.pi / 2, z=1.0)
    bound, behind = upright(0, 0, 1.0, (1e-6, 0.2, 0.2)), upright(0, 0, 2.0, (0.4, 0.4, 0.1))
    bbox = np.array([[[319.9, 180.0, 320.1, 300.0], [220.0, 140.0, 420.0, 340.0]]])
    assert_array_equal(visible_shares(PINHOLE, IDENTITY[None], [bound, behind], [square, None], bbox), [[1, 1]])


def test_surfaces_that_lie_in_each_other_do_not_hide_each_other():
    block = upright(0, 0, 1.05, (0.2, 0.2, 0.1))
    sticker = flat([(-0.05, -0.05), (0.05, -0.05), (0.05, 0.05), (-0.05, 0.05)], 1.0)
    bound = upright(0, 0, 1.0, (0.1, 0.1, 1e-6))
    assert_array_equal(shares(PINHOLE, [block, bound], [None, sticker]), [1, 1])
    twin = mesh_of_box(block)
    assert_array_equal(shares(PINHOLE, [block, block], [twin, twin]), [1, 1])


def test_which_of_two_meshes_in_each_other_is_nearer_is_decided_ray_by_ray():
    slab = mesh_of_box(upright(0, 0, 1.0, (0.4, 0.3, 0.01)))
    boxes = [upright(0, 0, 1.0, (0.4, 0.4, 0.4))] * 2
    found = shares(PINHOLE, boxes, [turned(slab, 0.5, z=1.0), turned(slab, -0.5, z=1.0)], step=2)
    assert found[0] == pytest.approx(found[1], abs=0.02)
    assert 0.4 < found[0] < 0.7


def test_a_mesh_round_the_camera_hides_nothing_and_is_hidden_by_what_is_in_it(solids):
    room, thing = upright(0, 0, 0, (8, 8, 8)), upright(0, 0, 2.0, (0.4, 0.4, 0.4))
    found = shares(PINHOLE, [room, thing], [mesh_of_box(room), None])
    side = 0.4 * 500 / 1.8
    assert_allclose(found, [1 - side**2 / (640 * 480), 1.0], atol=0.01)
    # In the hollow of a shell the camera is outside of it, and sees nothing else.
    assert shares(PINHOLE, [room, upright(0, 0, 9.0, (1, 1, 1))], [stretched(solids["hollow"], room), None])[1] == 0


def test_a_mesh_behind_the_camera_is_nan_and_hides_nothing():
    behind, seen = upright(0, 0, -1, (0.5, 0.5, 0.5)), upright(0, 0, 1, (0.2, 0.2, 0.2))
    assert_array_equal(shares(PINHOLE, [behind, seen], [mesh_of_box(behind), None]), [np.nan, 1.0])


def test_a_mesh_that_the_near_plane_cuts_hides_what_is_behind_the_cut():
    table, thing = upright(0, 0.05, 1.0, (2.0, 0.02, 3.0)), upright(0, 0.2, 1.0, (0.1, 0.1, 0.1))
    assert_array_equal(shares(PINHOLE, [table, thing], [mesh_of_box(table), None]), [1.0, 0.0])


def test_a_mesh_of_five_pixels_has_a_meaningful_share():
    far, near = upright(0, 0, 10.0, (0.1, 0.1, 1e-3)), upright(0.025, 0, 5.0, (0.05, 0.2, 1e-3))
    assert shares(PINHOLE, [far, near], [mesh_of_box(far), mesh_of_box(near)])[0] == pytest.approx(0.5, abs=0.11)


def test_wrong_input_is_refused():
    box = upright(0, 0, 1, (0.2, 0.2, 0.2))
    with pytest.raises(BadInput, match="at least 1 pixel, not 0"):
        shares(PINHOLE, [box], [mesh_of_box(box)], step=0)
    with pytest.raises(BadInput, match="1 boxes and 0 meshes"):
        visible_shares(PINHOLE, IDENTITY[None], [box], [], np.zeros((1, 1, 4)))


def test_no_shapes_and_no_frames():
    assert visible_shares(PINHOLE, IDENTITY[None], [], [], np.zeros((1, 0, 4))).shape == (1, 0)
    box = upright(0, 0, 1, (0.2, 0.2, 0.2))
    assert visible_shares(PINHOLE, np.zeros((0, 4, 4)), [box], [mesh_of_box(box)], np.zeros((0, 1, 4))).shape == (0, 1)
