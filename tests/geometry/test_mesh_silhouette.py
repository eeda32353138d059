"""Silhouettes of meshes against the union of their triangles, each projected by many points along its edges."""

import numpy as np
import pytest
import shapely
import trimesh

from ars_web.geometry import camera as cameras
from ars_web.geometry import rigid_transform
from ars_web.geometry.camera import Camera
from ars_web.geometry.labels import NEAR
from ars_web.geometry.mesh_silhouette import silhouette
from ars_web.geometry.viewing_cone import seen_region


def union_of_triangles(camera: Camera, T_world_camera: np.ndarray, mesh: trimesh.Trimesh) -> shapely.Geometry:
    """Each triangle cut to what is before the near plane, by many points along its edges, and all joined."""
    points = rigid_transform.transform_points(rigid_transform.invert(T_world_camera), np.asarray(mesh.vertices))
    seen: list[shapely.Geometry] = []
    for triangle in points[mesh.faces]:
        ring = beyond_near(triangle)
        if len(ring) < 3:
            continue
        t = np.linspace(0, 1, 12, endpoint=False)[:, None]
        dense = np.concatenate([a + t * (b - a) for a, b in zip(ring, np.roll(ring, -1, axis=0), strict=True)])
        places = cameras.image_from_pixels(cameras.pixels_from_camera_points(camera, dense))
        assert np.isfinite(places).all()
        seen.append(shapely.make_valid(shapely.Polygon(places)))
    return shapely.union_all(seen)


def beyond_near(triangle: np.ndarray) -> np.ndarray:
    """Sutherland and Hodgman's clipping of a polygon, here by one plane."""
    kept: list[np.ndarray] = []
    for a, b in zip(triangle, np.roll(triangle, -1, axis=0), strict=True):
        if a[2] >= NEAR:
            kept.append(a)
        if (a[2] >= NEAR) != (b[2] >= NEAR):
            kept.append(a + (NEAR - a[2]) / (b[2] - a[2]) * (b - a))
    return np.array(kept)


def agree(one: shapely.Geometry, other: shapely.Geometry, *, px: float) -> bool:
    """Whether two regions differ nowhere by more than so many pixels."""
    return one.buffer(px).covers(other) and other.buffer(px).covers(one)


@pytest.mark.parametrize("lens", ["pinhole", "brown", "wide", "fisheye"])
@pytest.mark.parametrize("name", ["box", "torus", "L"])
def test_it_is_the_union_of_the_triangles(name: str, lens: str, hulls):
    camera, mesh = hulls.CAMERAS[lens], hulls.shape(name)
    if name == "torus":
        mesh = trimesh.creation.torus(0.038, 0.014, major_sections=20, minor_sections=10)
    for T in hulls.round_about(2, distance=0.25):
        found = silhouette(camera, T, np.asarray(mesh.vertices), np.asarray(mesh.faces))
        assert found.is_valid
        assert agree(found, union_of_triangles(camera, T, mesh), px=0.2)


def test_a_torus_from_above_has_a_hole(hulls):
    mesh = hulls.shape("torus")
    T = hulls.looking((0, 0, 0.4), up=(0, 1, 0))
    found = silhouette(hulls.CAMERAS["brown"], T, np.asarray(mesh.vertices), np.asarray(mesh.faces))
    assert len(found.geoms) == 1
    assert len(found.geoms[0].interiors) == 1


def test_two_balls_are_two_pieces_and_one_before_the_other_is_one(hulls):
    balls = trimesh.util.concatenate(
        [trimesh.creation.icosphere(2, 0.02).apply_translation([0, y, 0]) for y in (-0.06, 0.06)]
    )
    camera, arrays = hulls.CAMERAS["pinhole"], (np.asarray(balls.vertices), np.asarray(balls.faces))
    assert len(silhouette(camera, hulls.looking((0.4, 0, 0)), *arrays).geoms) == 2
    behind = silhouette(camera, hulls.looking((0, 0.4, 0)), *arrays)
    assert len(behind.geoms) == 1
    assert agree(behind, union_of_triangles(camera, hulls.looking((0, 0.4, 0)), balls), px=0.2)


def test_an_open_mesh_is_seen_from_both_sides(hulls):
    sheet = trimesh.Trimesh([[0, -0.05, -0.05], [0, 0.05, -0.05], [0, 0.05, 0.05]], [[0, 1, 2]], process=False)
    for x in (0.4, -0.4):
        found = silhouette(
            hulls.CAMERAS["pinhole"], hulls.looking((x, 0, 0)), np.asarray(sheet.vertices), np.asarray(sheet.faces)
        )
        assert found.area == pytest.approx(0.5 * (0.1 / 0.4) ** 2 * 500 * 510, rel=1e-3)


@pytest.mark.parametrize("lens", ["pinhole", "brown", "fisheye"])
def test_what_is_behind_the_camera_is_cut_off(lens: str, hulls):
    """A long beam beside the camera, from before it to behind it."""
    beam = trimesh.creation.box((1.0, 0.04, 0.04)).apply_translation([0.2, 0.1, 0.02])
    camera, T = hulls.CAMERAS[lens], hulls.looking((0, 0, 0), at=(1, 0, 0))
    found = silhouette(camera, T, np.asarray(beam.vertices), np.asarray(beam.faces))
    assert not found.is_empty
    image = shapely.box(0, 0, 640, 480)
    if lens == "pinhole":
        assert agree(found.intersection(image), union_of_triangles(camera, T, beam).intersection(image), px=0.2)
    # Where points of it are seen, and where none are.
    random = np.random.default_rng(1)
    points = random.uniform([-0.3, 0.08, 0.0], [0.7, 0.12, 0.04], (400, 3))
    points_camera = rigid_transform.transform_points(rigid_transform.invert(T), points)
    ahead = points_camera[points_camera[:, 2] > NEAR]
    places = cameras.image_from_pixels(cameras.pixels_from_camera_points(camera, ahead))
    places = places[np.isfinite(places).all(axis=1)]
    assert shapely.distance(found, shapely.points(places)).max() < 0.3


def test_round_the_camera_all_is_covered(hulls):
    room = trimesh.creation.box((4.0, 4.0, 4.0))
    for camera in hulls.CAMERAS.values():
        found = silhouette(camera, hulls.looking((0.3, 0, 0)), np.asarray(room.vertices), np.asarray(room.faces))
        assert found.buffer(0.2).covers(seen_region(camera))


def test_what_is_wholly_behind_is_nowhere(hulls):
    mesh = hulls.shape("box")
    T = hulls.looking((0.5, 0, 0), at=(1, 0, 0))
    assert silhouette(hulls.CAMERAS["brown"], T, np.asarray(mesh.vertices), np.asarray(mesh.faces)).is_empty
    none = silhouette(hulls.CAMERAS["brown"], T, np.asarray(mesh.vertices), np.zeros((0, 3), dtype=np.int64))
    assert none.is_empty


def test_beyond_the_valid_radius_nothing_is_drawn(hulls):
    """Brown's polynomial folds back: a point out there would be drawn where nothing of it is seen."""
    camera = Camera(640, 480, 300.0, 300.0, 320.0, 240.0, "brown", (-0.4, 0.0, 0.0, 0.0, 0.0))
    assert camera.valid_radius < 1
    plate = trimesh.creation.box((0.001, 6.0, 0.1))
    T = hulls.looking((0.5, 0, 0))
    found = silhouette(camera, T, np.asarray(plate.vertices), np.asarray(plate.faces))
    rim = camera.valid_radius * (1 - 0.4 * camera.valid_radius**2) * 300
    x0, _, x1, _ = found.bounds
    assert x1 - x0 == pytest.approx(2 * rim, rel=0.01)


def test_a_long_lens_loses_no_precision(hulls):
    camera = Camera(1000, 1000, 2e6, 2e6, 499.5, 499.5)
    mesh = trimesh.creation.box((0.1, 0.1, 0.1))
    T = hulls.looking((500, 0, 0))
    found = silhouette(camera, T, np.asarray(mesh.vertices), np.asarray(mesh.faces))
    side = 2e6 * 0.1 / (500 - 0.05)
    assert found.area == pytest.approx(side**2, rel=1e-6)
