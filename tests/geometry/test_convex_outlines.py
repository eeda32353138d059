"""Convex outlines against shapely's hulls of many rays that meet the shape, and against the joined outlines."""

import dataclasses

import numpy as np
import pytest
import shapely
from numpy.testing import assert_allclose, assert_array_equal

from ars_web.errors import BadInput
from ars_web.geometry import camera as cameras
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.convex_outlines import convex_outlines, convex_outlines_of_boxes
from ars_web.geometry.labels import NEAR, labels_of_boxes, outline
from ars_web.geometry.mesh import Mesh
from ars_web.geometry.mesh_labels import labels_of_meshes
from ars_web.geometry.mesh_outlines import mesh_outline

PINHOLE = Camera(640, 480, 500.0, 500.0, 319.5, 239.5)
BROWN = Camera(640, 480, 500.0, 505.0, 300.0, 250.0, "brown", (-0.28, 0.09, 0.0011, -0.0009, -0.01))
FISHEYE = Camera(640, 480, 320.0, 322.0, 330.0, 235.0, "fisheye", (0.02, -0.01, 0.003, -0.0005))
IDENTITY = np.eye(4)
ONE = np.ones((1, 1), dtype=bool)


def placed(solid: Mesh, box: Box) -> Mesh:
    """A solid a unit across, stretched over a box."""
    return Mesh(rigid_transform.transform_points(box.T_world_box, solid.vertices_world * box.size), solid.faces)


def upright(x: float, y: float, z: float, size: tuple[float, float, float]) -> Box:
    return Box(rigid_transform.from_rotation(np.eye(3), np.array([x, y, z], dtype=float)), np.array(size, dtype=float))


def convex(camera: Camera, T_world_camera: np.ndarray, shape: Mesh | Box) -> np.ndarray:
    of = convex_outlines_of_boxes if isinstance(shape, Box) else convex_outlines
    ring, offsets = of(camera, T_world_camera[None], [shape], ONE)
    assert offsets.tolist() == [0, len(ring)]
    return ring


def check_form(ring: np.ndarray, camera: Camera) -> None:
    """Convex, counter-clockwise as seen, from its leftmost corner, and in the image."""
    assert len(ring) >= 3
    assert ((ring >= 0) & (ring <= [camera.width, camera.height])).all()
    a, b = np.roll(ring, -1, axis=0) - ring, np.roll(ring, -2, axis=0) - np.roll(ring, -1, axis=0)
    assert (a[:, 1] * b[:, 0] - a[:, 0] * b[:, 1] > -1e-9).all()
    assert ring[0].tolist() == min(ring.tolist())


def by_rays(camera: Camera, T_world_camera: np.ndarray, mesh: Mesh, mesh_oracle, bbox: np.ndarray) -> np.ndarray:
    """Points of the image whose rays meet a mesh."""
    points = np.random.default_rng(0).uniform(bbox[:2], bbox[2:], (3000, 2))
    vertices = rigid_transform.transform_points(rigid_transform.invert(T_world_camera), mesh.vertices_world)
    rays = cameras.normalised_from_pixels(camera, cameras.pixels_from_image(points))
    return points[mesh_oracle.rays_meet(rays, vertices[mesh.faces], near=NEAR)]


@pytest.mark.parametrize("first", range(0, 120, 40))
def test_it_is_the_hull_of_the_outline_and_holds_all_rays_that_meet_the_mesh(
    first: int, mesh_oracle, random_scene, solids
):
    seen = 0
    for seed in range(first, first + 40):
        camera, T_world_camera, box = random_scene(seed)
        mesh = placed(list(solids.values())[seed % len(solids)], box)
        bbox = labels_of_meshes(camera, T_world_camera[None], [mesh]).bbox[0, 0]
        ring = convex(camera, T_world_camera, mesh)
        if np.isnan(bbox[0]):
            assert len(ring) == 0
            continue
        check_form(ring, camera)
        assert_allclose([*ring.min(axis=0), *ring.max(axis=0)], bbox, atol=0.11, err_msg=f"scene {seed}")
        if min(bbox[2] - bbox[0], bbox[3] - bbox[1]) < 4:
            continue
        hull, want = shapely.Polygon(ring), shapely.MultiPoint(mesh_outline(camera, T_world_camera, mesh)).convex_hull
        # Both may be off by their tolerance.
        assert shapely.hausdorff_distance(hull, want) < 0.21, f"scene {seed}"
        if seed % 4 == 0:
            met = by_rays(camera, T_world_camera, mesh, mesh_oracle, bbox)
            assert shapely.distance(hull, shapely.points(met)).max() < 0.1, f"scene {seed}"
        seen += 1
    assert seen >= 12


def test_a_boxs_hull_is_the_hull_of_its_outline(random_scene):
    concave = 0
    for seed in range(150):
        camera, T_world_camera, box = random_scene(seed)
        ring, whole = convex(camera, T_world_camera, box), outline(camera, T_world_camera, box)
        assert (len(ring) == 0) == (len(whole) == 0)
        if len(ring) == 0:
            continue
        check_form(ring, camera)
        bbox = labels_of_boxes(camera, T_world_camera[None], [box]).bbox[0, 0]
        assert_allclose([*ring.min(axis=0), *ring.max(axis=0)], bbox, atol=0.11, err_msg=f"scene {seed}")
        want = shapely.MultiPoint(whole).convex_hull
        assert shapely.hausdorff_distance(shapely.Polygon(ring), want) < 1e-4, f"scene {seed}"
        concave += want.area > shapely.make_valid(shapely.Polygon(whole)).area + 2
    assert concave >= 3


def test_before_a_pinhole_it_is_the_hull_of_the_corners(solids):
    torus = placed(solids["torus"], upright(0, 0, 1, (0.2, 0.2, 0.2)))
    ring = convex(PINHOLE, IDENTITY, torus)
    image = cameras.image_from_pixels(cameras.pixels_from_camera_points(PINHOLE, torus.vertices_world))
    want = shapely.MultiPoint(image).convex_hull
    check_form(ring, PINHOLE)
    assert shapely.hausdorff_distance(shapely.Polygon(ring), want) < 1e-6
    assert len(ring) == len(want.exterior.coords) - 1


def test_what_a_lens_bends_outwards_between_corners_is_in_the_hull(solids):
    # The upper side of the bar lies far above the centre: barrel distortion lifts its middle by several pixels.
    bar = upright(0, -0.38, 1.0, (1.0, 0.02, 0.02))
    block = placed(BLOCK, bar)
    for shape in (bar, block):
        ring = convex(BROWN, IDENTITY, shape)
        middle = cameras.image_from_pixels(cameras.pixels_from_camera_points(BROWN, np.array([[0.0, -0.39, 0.99]])))[0]
        ends = np.array([[-0.5, -0.39, 0.99], [0.5, -0.39, 0.99]])
        corners = cameras.image_from_pixels(cameras.pixels_from_camera_points(BROWN, ends))
        assert corners[:, 1].min() - middle[1] > 5
        assert shapely.Polygon(ring).exterior.distance(shapely.Point(middle)) < 0.1


CORNERS = np.array([[i, j, k] for i in (-0.5, 0.5) for j in (-0.5, 0.5) for k in (-0.5, 0.5)])
QUADS = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
BLOCK = Mesh(CORNERS, np.array([[q[0], q[i], q[i + 1]] for q in QUADS for i in (1, 2)]))


def test_only_the_part_in_the_image_counts():
    # An L whose upper arm alone is in the image: the hull of the whole, cut, would reach to the lower arm's corner.
    arm, foot = upright(0, 0, 1, (0.1, 0.1, 0.01)), upright(1.5, 0.0, 1, (2.0, 0.1, 0.01))
    both = Mesh(
        np.concatenate([placed(BLOCK, arm).vertices_world, placed(BLOCK, foot).vertices_world]),
        np.concatenate([BLOCK.faces, BLOCK.faces + 8]),
    )
    camera = dataclasses.replace(PINHOLE, width=550)
    assert_allclose(convex(camera, IDENTITY, both), convex(camera, IDENTITY, placed(BLOCK, arm)), atol=1e-9)


def test_round_the_camera_it_is_the_image(solids):
    ring = convex(PINHOLE, IDENTITY, placed(solids["ball"], upright(0, 0, 0, (3, 3, 3))))
    assert_allclose(ring, [[0, 0], [0, 480], [640, 480], [640, 0]])


def test_all_hulls_at_once_are_the_single_ones(random_scene, solids):
    camera, T_world_camera, _ = random_scene(3)
    meshes, boxes = [], []
    for seed, solid in enumerate(solids.values()):
        _, T_world_other, box = random_scene(seed)
        T_world_box = T_world_camera @ rigid_transform.invert(T_world_other) @ box.T_world_box
        boxes.append(Box(T_world_box, box.size))
        meshes.append(placed(solid, boxes[-1]))
    b, n = len(meshes), 270
    turns = np.array([rigid_transform.rotation_about_z(angle) for angle in np.linspace(0, 6, n)])
    Ts = T_world_camera @ rigid_transform.from_rotation(turns, np.zeros((n, 3)))
    wanted = np.ones((n, b), dtype=bool)
    wanted[::7] = False
    wanted[3, :2] = False
    for of, shapes in ((convex_outlines, meshes), (convex_outlines_of_boxes, boxes)):
        points, offsets = of(camera, Ts, shapes, wanted)
        assert offsets.shape == (n * b + 1,)
        assert offsets[-1] == len(points)
        assert (np.diff(offsets).reshape(n, b) > 0).any(axis=0).sum() >= 3
        assert (np.diff(offsets)[~wanted.ravel()] == 0).all()
        for i in (1, 3, 8, 100, 255, 256, 269):
            for j, shape in enumerate(shapes):
                ring = points[offsets[i * b + j] : offsets[i * b + j + 1]]
                if wanted[i, j]:
                    assert_array_equal(ring, convex(camera, Ts[i], shape))


def test_no_shapes_and_no_frames_give_no_rings(solids):
    for of, shape in ((convex_outlines, solids["ball"]), (convex_outlines_of_boxes, upright(0, 0, 1, (1, 1, 1)))):
        points, offsets = of(PINHOLE, np.zeros((0, 4, 4)), [shape], np.zeros((0, 1), dtype=bool))
        assert points.shape == (0, 2)
        assert offsets.tolist() == [0]
        points, offsets = of(PINHOLE, IDENTITY[None], [], np.zeros((1, 0), dtype=bool))
        assert offsets.tolist() == [0]
        points, offsets = of(PINHOLE, IDENTITY[None], [shape], ~ONE)
        assert offsets.tolist() == [0, 0]


def test_a_tolerance_too_fine_is_refused(solids):
    with pytest.raises(BadInput, match=r"at least 0\.001 pixels"):
        convex_outlines(PINHOLE, IDENTITY[None], [solids["ball"]], ONE, tolerance=0.0)
    with pytest.raises(BadInput, match=r"at least 0\.001 pixels"):
        convex_outlines_of_boxes(PINHOLE, IDENTITY[None], [upright(0, 0, 1, (1, 1, 1))], ONE, tolerance=0.0)
