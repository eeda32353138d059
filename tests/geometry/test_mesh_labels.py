"""Labels of meshes against the slow oracle, against those of boxes, and by hand where a hand can."""

import numpy as np
import pytest
import trimesh

from ars_web.errors import BadInput
from ars_web.geometry import camera as cameras
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.labels import NEAR, labels_of_boxes
from ars_web.geometry.mesh import Mesh
from ars_web.geometry.mesh_labels import labels_of_meshes

PINHOLE = Camera(640, 480, 500.0, 500.0, 319.5, 239.5)
BROWN = Camera(640, 480, 500.0, 505.0, 300.0, 250.0, "brown", (-0.28, 0.09, 0.0011, -0.0009, -0.01))
FISHEYE = Camera(640, 480, 320.0, 322.0, 330.0, 235.0, "fisheye", (0.02, -0.01, 0.003, -0.0005))
LENSES = pytest.mark.parametrize("camera", [PINHOLE, BROWN, FISHEYE], ids=lambda camera: camera.model)
IDENTITY = np.eye(4)


def placed(solid: Mesh, box: Box) -> Mesh:
    """A solid a unit across, stretched over a box."""
    return Mesh(rigid_transform.transform_points(box.T_world_box, solid.vertices_world * box.size), solid.faces)


def block(box: Box) -> Mesh:
    shape = trimesh.creation.box((1.0, 1.0, 1.0))
    return placed(Mesh(np.array(shape.vertices), np.array(shape.faces)), box)


def box_at(x: float, y: float, z: float, size: tuple[float, float, float] = (0.2, 0.2, 0.2)) -> Box:
    return Box(rigid_transform.from_rotation(np.eye(3), np.array([x, y, z], dtype=float)), np.array(size, dtype=float))


def label(camera: Camera, mesh: Mesh, T_world_camera: np.ndarray = IDENTITY) -> tuple[np.ndarray, np.ndarray, float]:
    found = labels_of_meshes(camera, T_world_camera[None], [mesh])
    return found.bbox[0, 0], found.bbox_amodal[0, 0], float(found.truncated[0, 0])


def far_tolerance(amodal: np.ndarray) -> float:
    """What a mesh that reaches far beyond the image may be off (labels.labels_of_boxes), twice."""
    distance = np.abs(np.nan_to_num(amodal)).max()
    return 2 * distance * min(2e-5 * (1 + 1e-4 * distance), 1e-3)


# Against the oracle


@pytest.mark.parametrize("first", range(0, 30, 6))
def test_labels_equal_the_oracle(first: int, mesh_oracle, random_scene, solids):
    for seed in range(first, first + 6):
        camera, T_world_camera, box = random_scene(seed)
        mesh = placed(list(solids.values())[seed % len(solids)], box)
        bbox, amodal, truncated = label(camera, mesh, T_world_camera)
        want = mesh_oracle.label(camera, T_world_camera, mesh, near=NEAR)
        far = far_tolerance(want.bbox_amodal)
        np.testing.assert_allclose(bbox, want.bbox, atol=0.1, rtol=0, err_msg=f"bbox of scene {seed}")
        np.testing.assert_allclose(amodal, want.bbox_amodal, atol=0.1 + far, rtol=0, err_msg=f"amodal, scene {seed}")
        assert truncated == pytest.approx(want.truncated, abs=0.01), f"truncation of scene {seed}"


def test_a_mesh_that_is_a_box_is_labelled_as_the_box(random_scene):
    kinds = set()
    for seed in range(200):
        camera, T_world_camera, box = random_scene(seed)
        want = labels_of_boxes(camera, T_world_camera[None], [box])
        bbox, amodal, truncated = label(camera, block(box), T_world_camera)
        far = far_tolerance(amodal)
        np.testing.assert_allclose(bbox, want.bbox[0, 0], atol=0.1, rtol=0, err_msg=f"scene {seed}")
        np.testing.assert_allclose(amodal, want.bbox_amodal[0, 0], atol=0.1 + far, rtol=0, err_msg=f"scene {seed}")
        assert truncated == pytest.approx(want.truncated[0, 0], abs=0.004), f"scene {seed}"
        corners = rigid_transform.transform_points(rigid_transform.invert(T_world_camera), box.corners_world)
        straddles = bool((corners[:, 2] < NEAR).any() and (corners[:, 2] > NEAR).any())
        place = (
            "nowhere" if np.isnan(amodal[0]) else "outside" if np.isnan(bbox[0]) else "cut" if truncated else "whole"
        )
        kinds.add((camera.model, place, straddles))
    models = ("pinhole", "brown", "fisheye")
    assert {(model, place, False) for model in models for place in ("whole", "cut", "outside")} <= kinds
    assert {(model, "cut", True) for model in models} <= kinds


# By hand


def test_a_ball_before_a_pinhole_is_its_tangent_cone():
    ball = trimesh.creation.icosphere(6, 0.1)
    mesh = Mesh(np.array(ball.vertices) + np.array([0.0, 0.0, 1.0]), np.array(ball.faces))
    bbox, amodal, truncated = label(PINHOLE, mesh)
    # A ball of 0.1 m at 1 m is seen under the angle asin(0.1).
    half = 500 * np.tan(np.arcsin(0.1))
    np.testing.assert_allclose(bbox, [320 - half, 240 - half, 320 + half, 240 + half], atol=0.1)
    np.testing.assert_array_equal(bbox, amodal)
    assert truncated == 0


@LENSES
def test_a_mesh_behind_the_camera_has_no_label(camera: Camera):
    bbox, amodal, truncated = label(camera, block(box_at(0.05, 0.02, -1.0)))
    assert np.isnan(bbox).all()
    assert np.isnan(amodal).all()
    assert truncated == 1


@LENSES
def test_from_inside_a_mesh_it_is_all_that_the_camera_sees(camera: Camera, solids):
    for solid in (solids["ball"], solids["can"]):
        bbox, _, truncated = label(camera, placed(solid, box_at(0.1, 0, 0, (3, 3, 3))))
        seen = cameras.image_from_pixels(cameras.image_border_pixels(camera, samples=400))
        np.testing.assert_allclose(bbox, [*seen.min(axis=0), *seen.max(axis=0)], atol=1e-9)
        assert 0 <= truncated < 1


def test_through_the_hole_of_a_torus_nothing_is_truncated_but_the_torus(solids):
    # The image lies within the hole: the torus runs round it, and no part of it is in the image.
    torus = placed(solids["torus"], box_at(0, 0, 1.0, (10, 10, 1)))
    bbox, amodal, truncated = label(PINHOLE, torus)
    assert np.isnan(bbox).all()
    assert (amodal[:2] < 0).all()
    assert (amodal[2:] > [640, 480]).all()
    assert truncated == 1


def test_where_a_mesh_covers_itself_its_area_counts_once():
    # Two equal cubes one behind the other, the nearer one hiding the other from the camera; half of both is outside.
    both = [block(box_at(-0.64 * z, 0, z, (0.2, 0.2 * z, 0.01))) for z in (1.0, 1.0001)]
    n = len(both[0].vertices_world)
    mesh = Mesh(np.concatenate([m.vertices_world for m in both]), np.concatenate([both[0].faces, both[1].faces + n]))
    _, _, alone = label(PINHOLE, both[0])
    _, _, truncated = label(PINHOLE, mesh)
    assert alone == pytest.approx(0.5, abs=0.01)
    assert truncated == pytest.approx(alone, abs=1e-3)


def test_where_the_lens_ends_within_the_image_the_mesh_ends_there(solids):
    # The radial polynomial turns at r = 1 / sqrt(3 * 0.4), which is 248 px here: nothing is seen outside that circle.
    camera = Camera(800, 800, 408.0, 408.0, 399.5, 399.5, "brown", (-0.4, 0.0, 0.0, 0.0, 0.0))
    rim = 408.0 * camera.valid_radius * (1 - 0.4 * camera.valid_radius**2)
    bbox, amodal, truncated = label(camera, placed(solids["ball"], box_at(0, 0, 60.0, (110, 110, 110))))
    np.testing.assert_allclose(bbox, [400 - rim, 400 - rim, 400 + rim, 400 + rim], atol=0.05)
    np.testing.assert_allclose(amodal, bbox)
    assert truncated == pytest.approx(0, abs=1e-9)


@LENSES
def test_many_meshes_in_many_frames_are_each_labelled_as_if_alone(camera: Camera, solids):
    random = np.random.default_rng(5)
    meshes = [placed(solid, box_at(*random.uniform([-0.5, -0.4, -0.2], [0.5, 0.4, 1.5]))) for solid in solids.values()]
    turns = [rigid_transform.rotation_about_z(angle) for angle in np.linspace(0, 3, 600)]
    Ts = rigid_transform.from_rotation(np.array(turns), random.normal(size=(600, 3)) * 0.2)
    found = labels_of_meshes(camera, Ts, meshes)
    for i in (0, 1, 31, 32, 255, 256, 599):
        for j, mesh in enumerate(meshes):
            bbox, amodal, truncated = label(camera, mesh, Ts[i])
            np.testing.assert_array_equal(found.bbox[i, j], bbox)
            np.testing.assert_array_equal(found.bbox_amodal[i, j], amodal)
            assert found.truncated[i, j] == truncated


def test_no_meshes_and_no_frames_give_empty_labels(solids):
    assert labels_of_meshes(PINHOLE, np.zeros((0, 4, 4)), [solids["ball"]]).bbox.shape == (0, 1, 4)
    assert labels_of_meshes(PINHOLE, IDENTITY[None], []).truncated.shape == (1, 0)


def test_a_tolerance_too_fine_is_refused(solids):
    with pytest.raises(BadInput, match=r"at least 0\.001 pixels"):
        labels_of_meshes(PINHOLE, IDENTITY[None], [solids["ball"]], tolerance=1e-4)
