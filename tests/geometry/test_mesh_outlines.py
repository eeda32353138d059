"""Outlines of meshes against rays, against those of boxes, and by hand where a hand can."""

from types import ModuleType

import numpy as np
import pytest
import shapely
from numpy.testing import assert_allclose, assert_array_equal

from ars_web.errors import BadInput
from ars_web.geometry import camera as cameras
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.labels import NEAR, outline
from ars_web.geometry.mesh import Mesh
from ars_web.geometry.mesh_labels import labels_of_meshes
from ars_web.geometry.mesh_outlines import joined, mesh_outline, mesh_outlines, mesh_regions
from ars_web.geometry.mesh_silhouette import silhouette

PINHOLE = Camera(640, 480, 500.0, 500.0, 319.5, 239.5)
IDENTITY = np.eye(4)


def placed(solid: Mesh, box: Box) -> Mesh:
    """A solid a unit across, stretched over a box."""
    return Mesh(rigid_transform.transform_points(box.T_world_box, solid.vertices_world * box.size), solid.faces)


def upright(x: float, y: float, z: float, size: tuple[float, float, float]) -> Box:
    return Box(rigid_transform.from_rotation(np.eye(3), np.array([x, y, z], dtype=float)), np.array(size, dtype=float))


def cuboid(x: float, y: float, z: float, size: tuple[float, float, float]) -> Mesh:
    """The twelve triangles of a box."""
    corners = np.array([[i, j, k] for i in (-0.5, 0.5) for j in (-0.5, 0.5) for k in (-0.5, 0.5)])
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = np.array([[q[0], q[i], q[i + 1]] for q in quads for i in (1, 2)])
    return placed(Mesh(corners, faces), upright(x, y, z, size))


def area(ring: np.ndarray) -> float:
    """Positive counter-clockwise as seen, y down."""
    x, y = ring.T
    return float((y * np.roll(x, -1) - np.roll(y, -1) * x).sum() / 2)


@pytest.mark.parametrize("first", range(0, 60, 15))
def test_a_ring_holds_those_points_whose_rays_meet_the_mesh(first: int, mesh_oracle: ModuleType, random_scene, solids):
    seen = 0
    for seed in range(first, first + 15):
        camera, T_world_camera, box = random_scene(seed)
        mesh = placed(list(solids.values())[seed % len(solids)], box)
        label = labels_of_meshes(camera, T_world_camera[None], [mesh])
        ring = mesh_outline(camera, T_world_camera, mesh)
        if np.isnan(label.bbox[0, 0, 0]):
            assert len(ring) == 0
            continue
        assert (ring >= 0).all()
        assert (ring <= [camera.width, camera.height]).all()
        bbox = label.bbox[0, 0]
        if min(bbox[2] - bbox[0], bbox[3] - bbox[1]) < 4:
            continue
        assert_allclose([*ring.min(axis=0), *ring.max(axis=0)], bbox, atol=0.11, err_msg=f"scene {seed}")
        region = shapely.make_valid(shapely.Polygon(ring))
        assert area(ring) == pytest.approx(region.area, rel=1e-6, abs=1e-6), f"scene {seed}"
        points = np.random.default_rng(seed).uniform(bbox[:2], bbox[2:], (400, 2))
        points = points[shapely.distance(region.boundary, shapely.points(points)) > 0.11]
        vertices = rigid_transform.transform_points(rigid_transform.invert(T_world_camera), mesh.vertices_world)
        rays = cameras.normalised_from_pixels(camera, cameras.pixels_from_image(points))
        met = mesh_oracle.rays_meet(rays, vertices[mesh.faces], near=NEAR)
        assert_array_equal(shapely.contains_xy(region, points), met, err_msg=f"scene {seed}")
        seen += 1
    assert seen >= 5


def test_a_mesh_that_is_a_box_has_the_boxs_outline(random_scene):
    corners = cuboid(0, 0, 0, (1, 1, 1))
    for seed in range(60):
        camera, T_world_camera, box = random_scene(seed)
        want = shapely.make_valid(shapely.Polygon(ring)) if len(ring := outline(camera, T_world_camera, box)) else None
        found = mesh_outline(camera, T_world_camera, placed(corners, box))
        if want is None or want.area < 1:
            assert abs(area(found)) < 1.1 if len(found) else True
            continue
        apart = shapely.make_valid(shapely.Polygon(found)).symmetric_difference(want).area
        assert apart < 0.2 * want.length, f"scene {seed}"


def test_a_ring_is_counter_clockwise_as_seen():
    ring = mesh_outline(PINHOLE, IDENTITY, cuboid(0, 0, 1.1, (0.2, 0.2, 0.2)))
    start = np.argmin(ring.sum(axis=1))
    assert_allclose(np.roll(ring, -start, axis=0), [[270, 190], [270, 290], [370, 290], [370, 190]], atol=1e-6)


def test_a_mesh_over_a_corner_of_the_image_has_that_corner():
    # The front face spans -80 to 20 and 430 to 530 px.
    ring = mesh_outline(PINHOLE, IDENTITY, cuboid((-30 - 320) / 500, (480 - 240) / 500, 1.0, (0.2, 0.2, 1e-8)))
    assert_allclose(sorted(ring.round(3).tolist()), [[0, 430], [0, 480], [20, 430], [20, 480]])


def test_a_hole_is_left_out_of_the_one_ring(solids):
    torus = placed(solids["torus"], upright(0, 0, 1, (0.2, 0.2, 0.2)))
    ring = mesh_outline(PINHOLE, IDENTITY, torus)
    region = shapely.make_valid(shapely.Polygon(ring))
    assert area(ring) == pytest.approx(region.area)
    assert not shapely.contains_xy(region, 320, 240)
    assert shapely.contains_xy(region, 320 + 0.37 * 100, 240)
    # The way to the hole is gone back on: its ends are in the ring twice.
    _, counts = np.unique(ring, axis=0, return_counts=True)
    assert sorted(counts)[-3:] == [1, 2, 2]


def test_two_pieces_are_one_ring():
    boxes = [cuboid(-0.2, 0, 1, (0.1, 0.1, 0.01)), cuboid(0.2, 0, 1, (0.2, 0.1, 0.01))]
    both = Mesh(
        np.concatenate([one.vertices_world for one in boxes]), np.concatenate([boxes[0].faces, boxes[1].faces + 8])
    )
    ring = mesh_outline(PINHOLE, IDENTITY, both)
    alone = [mesh_outline(PINHOLE, IDENTITY, one) for one in boxes]
    assert area(ring) == pytest.approx(sum(map(area, alone)))
    assert len(ring) == sum(map(len, alone)) + 2


def test_rings_are_joined_where_they_are_nearest():
    square = np.array([[0.0, 0], [0, 10], [10, 10], [10, 0]])
    hole = np.array([[4.0, 4], [6, 4], [6, 6], [4, 6]])
    far = square + np.array([20.0, 0.0])
    ring = joined([hole, far, square])
    assert area(ring) == pytest.approx(100 + 100 - 4)
    assert len(ring) == 12 + 4
    assert joined([]).shape == (0, 2)


def test_all_outlines_at_once_are_the_single_ones(random_scene, solids):
    camera, T_world_camera, _ = random_scene(3)
    meshes = []
    for seed, solid in enumerate(solids.values()):
        _, T_world_other, box = random_scene(seed)
        T_world_box = T_world_camera @ rigid_transform.invert(T_world_other) @ box.T_world_box
        meshes.append(placed(solid, Box(T_world_box, box.size)))
    b = len(meshes)
    turns = np.array([rigid_transform.rotation_about_z(angle) for angle in np.linspace(0, 6, 30)])
    Ts = T_world_camera @ rigid_transform.from_rotation(turns, np.zeros((30, 3)))
    wanted = ~np.isnan(labels_of_meshes(camera, Ts, meshes).bbox[..., 0])
    wanted[::7] = False
    points, offsets = mesh_outlines(camera, Ts, meshes, wanted)
    assert offsets.shape == (30 * b + 1,)
    assert offsets[-1] == len(points)
    assert wanted.any(axis=0).sum() >= 3
    for i in range(30):
        for j, mesh in enumerate(meshes):
            ring = points[offsets[i * b + j] : offsets[i * b + j + 1]]
            assert_array_equal(ring, mesh_outline(camera, Ts[i], mesh) if wanted[i, j] else np.zeros((0, 2)))


def test_a_mesh_behind_the_camera_has_no_outline():
    assert mesh_outline(PINHOLE, IDENTITY, cuboid(0, 0, -1, (0.2, 0.2, 0.2))).shape == (0, 2)


def test_a_tolerance_too_fine_is_refused():
    with pytest.raises(BadInput, match=r"at least 0\.001 pixels"):
        mesh_outline(PINHOLE, IDENTITY, cuboid(0, 0, 1, (1, 1, 1)), tolerance=0.0)


# Rings with holes


def region_of(rings: list[np.ndarray]) -> shapely.Geometry:
    """What rings enclose: each that runs clockwise is a hole of the last before it that does not."""
    polygons: list[tuple[np.ndarray, list[np.ndarray]]] = []
    for ring in rings:
        if area(ring) > 0:
            polygons.append((ring, []))
        else:
            polygons[-1][1].append(ring)
    found = [shapely.Polygon(outer, holes) for outer, holes in polygons]
    assert all(shapely.area(shapely.Polygon(outer)) > 0 for outer, _ in polygons)
    assert all(polygon.buffer(1e-6).is_valid for polygon in found)
    return shapely.MultiPolygon(found)


def regions(camera: Camera, T_world_camera: np.ndarray, mesh: Mesh) -> list[np.ndarray]:
    found = mesh_regions(camera, T_world_camera[None], [mesh], np.ones((1, 1), dtype=bool))
    assert found.label_starts.tolist() == [0, len(found.ring_starts) - 1]
    return found.of(0)


def test_separate_rings_enclose_what_the_one_ring_does_and_what_the_silhouette_is(random_scene, solids):
    holes = 0
    for seed in range(60):
        camera, T_world_camera, box = random_scene(seed)
        mesh = placed(list(solids.values())[seed % len(solids)], box)
        rings, ring = regions(camera, T_world_camera, mesh), mesh_outline(camera, T_world_camera, mesh)
        assert bool(rings) == bool(len(ring))
        if not rings:
            continue
        holes += sum(area(one) < 0 for one in rings)
        region = region_of(rings)
        assert region.area == pytest.approx(area(ring), rel=1e-9), f"scene {seed}"
        image = shapely.box(0, 0, camera.width, camera.height)
        # Far beyond what is in these images.
        whole = silhouette(camera, T_world_camera, mesh.vertices_world, mesh.faces, reach=20.0)
        apart = region.buffer(0).symmetric_difference(shapely.make_valid(whole).intersection(image)).area
        assert apart < 0.2 * region.length + 1, f"scene {seed}"
    assert holes


def test_a_hole_follows_the_ring_that_it_is_in(solids):
    # A small torus beside a larger one, with a bead in the larger one's hole.
    large = placed(solids["torus"], upright(-0.1, 0, 1, (0.3, 0.3, 0.1)))
    small = placed(solids["torus"], upright(0.2, 0, 1, (0.2, 0.2, 0.1)))
    bead = cuboid(-0.1, 0, 1, (0.02, 0.02, 0.02))
    parts = [bead, small, large]
    starts = np.cumsum([0, *(len(part.vertices_world) for part in parts)])
    mesh = Mesh(
        np.concatenate([part.vertices_world for part in parts]),
        np.concatenate([part.faces + start for part, start in zip(parts, starts, strict=False)]),
    )
    rings = regions(PINHOLE, IDENTITY, mesh)
    assert [area(ring) > 0 for ring in rings] == [True, False, True, False, True]
    assert_allclose([ring.mean(axis=0)[0] for ring in rings], [270, 270, 420, 420, 270], atol=3)


def test_rings_of_many_labels_are_kept_apart(random_scene, solids):
    camera, T_world_camera, box = random_scene(3)
    meshes = [placed(solids["torus"], box), placed(solids["two"], box)]
    Ts = np.repeat(T_world_camera[None], 4, axis=0)
    wanted = np.array([[True, True], [False, True], [False, False], [True, False]])
    found = mesh_regions(camera, Ts, meshes, wanted)
    assert found.label_starts.shape == (9,)
    for label, asked in enumerate(wanted.ravel()):
        want = regions(camera, T_world_camera, meshes[label % 2]) if asked else []
        for one, other in zip(found.of(label), want, strict=True):
            assert_array_equal(one, other)
    assert mesh_regions(camera, Ts[:0], meshes, wanted[:0]).label_starts.tolist() == [0]
