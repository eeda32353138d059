"""Flat polygons against their borders, sampled, and by hand."""

import numpy as np
import pytest
import shapely
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from ars_web.errors import BadInput
from ars_web.geometry import camera as cameras
from ars_web.geometry import rigid_transform
from ars_web.geometry.camera import Camera
from ars_web.geometry.convex_outlines import convex_outlines
from ars_web.geometry.flat_mesh import flat_mesh
from ars_web.geometry.labels import NEAR
from ars_web.geometry.mesh import Mesh
from ars_web.geometry.mesh_labels import labels_of_meshes
from ars_web.geometry.mesh_outlines import mesh_outline, mesh_regions

PINHOLE = Camera(640, 480, 500.0, 500.0, 319.5, 239.5)
BROWN = Camera(640, 480, 500.0, 505.0, 300.0, 250.0, "brown", (-0.28, 0.09, 0.0011, -0.0009, -0.01))
FISHEYE = Camera(640, 480, 320.0, 322.0, 330.0, 235.0, "fisheye", (0.02, -0.01, 0.003, -0.0005))
LENSES = pytest.mark.parametrize("camera", [PINHOLE, BROWN, FISHEYE], ids=lambda camera: camera.model)
IDENTITY = np.eye(4)
ONE = np.ones((1, 1), dtype=bool)

ARROW = np.array([[0.0, -1], [0.8, 0], [0.3, 0], [0.3, 1], [-0.3, 1], [-0.3, 0], [-0.8, 0]])
"""Not convex, and with corners in a row."""


def placed(outline: np.ndarray, turn: np.ndarray, centre: list[float], scale: float = 0.3) -> np.ndarray:
    """Corners (k, 3) of a polygon (k, 2) in space."""
    return np.column_stack([outline * scale, np.zeros(len(outline))]) @ turn.T + centre


def sampled_region(camera: Camera, corners_camera: np.ndarray) -> shapely.Geometry:
    """The image, not cut, of a polygon in camera coordinates: its ring cut at the near plane, and many points of it."""
    ring = []
    for a, b in zip(corners_camera, np.roll(corners_camera, -1, axis=0), strict=True):
        if a[2] >= NEAR:
            ring.append(a)
        if (a[2] >= NEAR) != (b[2] >= NEAR):
            ring.append(a + (NEAR - a[2]) / (b[2] - a[2]) * (b - a))
    t = np.linspace(0, 1, 800, endpoint=False)[:, None]
    # Even steps in the image, more or less: by the normalised plane.
    flat = [point[:2] / point[2] for point in ring]
    dense = np.concatenate([a + t * (b - a) for a, b in zip(flat, [*flat[1:], flat[0]], strict=True)])
    image = cameras.image_from_pixels(cameras.pixels_from_normalised(camera, dense))
    assert np.isfinite(image).all()
    return shapely.make_valid(shapely.Polygon(image))


def check(camera: Camera, corners_camera: np.ndarray) -> str:
    """All that is told of a polygon, seen from either side, against its samples; where it is in the image."""
    whole = sampled_region(camera, corners_camera)
    part = whole.intersection(shapely.box(0, 0, camera.width, camera.height))
    for corners in (corners_camera, corners_camera[::-1]):
        mesh = flat_mesh(corners)
        label = labels_of_meshes(camera, IDENTITY[None], [mesh])
        ring = mesh_outline(camera, IDENTITY, mesh)
        hull, _ = convex_outlines(camera, IDENTITY[None], [mesh], ONE)
        assert_allclose(label.bbox_amodal[0, 0], whole.bounds, atol=0.1, rtol=1e-4)
        if part.area == 0:
            assert np.isnan(label.bbox[0, 0]).all()
            assert len(ring) == 0
            assert len(hull) == 0
            continue
        assert_allclose(label.bbox[0, 0], part.bounds, atol=0.1)
        assert label.truncated[0, 0] == pytest.approx(1 - part.area / whole.area, abs=2e-3)
        found = shapely.make_valid(shapely.Polygon(ring))
        assert found.symmetric_difference(part).area < 0.15 * part.length
        assert shapely.hausdorff_distance(shapely.Polygon(hull), part.convex_hull) < 0.2
        assert all(len(one) >= 3 for one in mesh_regions(camera, IDENTITY[None], [mesh], ONE).of(0))
    return "outside" if part.area == 0 else "whole" if label.truncated[0, 0] == 0 else "cut"


@LENSES
def test_a_polygon_is_seen_from_both_sides_where_its_border_is(camera: Camera):
    random = np.random.default_rng(4)
    places = []
    for _ in range(16):
        turn = rigid_transform.rotation_from_wxyz(random.normal(size=4))
        places.append(check(camera, placed(ARROW, turn, random.uniform([-0.8, -0.6, 0.6], [0.8, 0.6, 1.5]).tolist())))
    assert {"whole", "cut"} <= set(places)


def test_the_near_plane_cuts_it():
    # A narrow strip below the camera, from behind it to before it.
    strip = np.array([[-0.004, -1.0], [0.004, -1.0], [0.004, 1.0], [-0.004, 1.0]])
    turn = np.array([[1.0, 0, 0], [0, 0, 1], [0, 1, 0]])
    assert check(PINHOLE, placed(strip, turn, [0.001, 0.005, 0.2], scale=1.0)) == "cut"


@LENSES
@pytest.mark.parametrize("depth", [1.0, 0.1], ids=["before", "across the near plane"])
def test_exactly_from_its_edge_it_is_nothing_or_a_line(camera: Camera, depth: float):
    corners = placed(ARROW, np.array([[1.0, 0, 0], [0, 0, 1], [0, 1, 0]]), [0, 0, depth])
    mesh = flat_mesh(corners)
    label = labels_of_meshes(camera, IDENTITY[None], [mesh])
    # Tangential distortion bends the line a little, so that its hull has some area.
    if not np.isnan(label.bbox[0, 0, 0]):
        assert np.diff(label.bbox[0, 0].reshape(2, 2), axis=0).min() < 0.5
    ring, hull = mesh_outline(camera, IDENTITY, mesh), convex_outlines(camera, IDENTITY[None], [mesh], ONE)[0]
    assert len(ring) == 0 or shapely.Polygon(ring).buffer(0).area < 0.01
    assert len(hull) == 0 or np.ptp(hull, axis=0).min() < 0.5


@given(st.integers(0, 2**32 - 1), st.integers(3, 30), st.floats(1e-3, 1e3))
def test_its_triangles_are_the_polygon(seed: int, k: int, scale: float):
    random = np.random.default_rng(seed)
    # A star about its centre never crosses itself.
    angles = np.sort(random.uniform(0, 2 * np.pi, k))
    if np.diff(angles, append=angles[0] + 2 * np.pi).max() > 3:
        angles = np.linspace(0, 2 * np.pi, k, endpoint=False)
    outline = (random.uniform(0.3, 1, k) * np.array([np.cos(angles), np.sin(angles)])).T * random.choice(
        [1, -1], (1, 2)
    )
    corners = placed(outline, rigid_transform.rotation_from_wxyz(random.normal(size=4)), [5.0, -3, 2], scale)
    mesh = flat_mesh(corners)
    assert_allclose(mesh.vertices_world, corners, atol=1e-9 * (scale + 5))
    assert len(mesh.faces) == 2 * (k - 2)
    solid = trimesh.Trimesh(mesh.vertices_world, mesh.faces, process=False)
    assert solid.area == pytest.approx(2 * shapely.Polygon(outline * scale).area, rel=1e-6)
    # Edges within it pair triangles of one side, those along its border one of each.
    sides = (mesh.edges[:, 2:] >= k - 2).sum(axis=1)
    assert (sides == 1).sum() == k
    assert np.isin(np.abs(mesh.edges[sides == 1, 0] - mesh.edges[sides == 1, 1]), [1, k - 1]).all()


def test_corners_a_little_off_are_moved_onto_the_plane():
    corners = placed(ARROW, np.eye(3), [0, 0, 1]) + np.array([0, 0, 4e-4]) * ((-1.0) ** np.arange(7))[:, None]
    mesh = flat_mesh(corners)
    assert isinstance(mesh, Mesh)
    spread = np.linalg.svd(mesh.vertices_world - mesh.vertices_world.mean(axis=0))[1]
    assert spread[2] < 1e-12
    assert np.abs(mesh.vertices_world - corners).max() < 7e-4
    with pytest.raises(BadInput, match=r"in one plane to 0\.0001 m: corner \d is 0\.000\d+ m off"):
        flat_mesh(corners, tolerance=1e-4)


SQUARE = np.array([[0.0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])


@pytest.mark.parametrize(
    ("corners", "message"),
    [
        (SQUARE[:2], r"at least three corners \(k, 3\), not shape \[2, 3\]"),
        (SQUARE * np.nan, "finite and within"),
        (SQUARE * 1e8, "finite and within"),
        (SQUARE[[0, 1, 1, 2]], "corners 1 and 2 of a polygon are one point"),
        (SQUARE[[0, 1, 2, 0]], "corners 3 and 0 of a polygon are one point"),
        (SQUARE + np.outer([0, 0, 0, 0.1], [0, 0, 1]), r"corner \d is 0\.02\d+ m off the plane"),
        (SQUARE[[0, 2, 1, 3]], r"must not cross or touch itself; this one of 4 corners does \(self-intersection\)"),
        (np.linspace([0.0, 0, 0], [1.0, 2, 3], 5), "its 5 corners lie in a row"),
        (SQUARE[[0, 1, 0, 1]], "lie in a row"),
    ],
)
def test_what_is_no_flat_polygon_is_refused(corners: np.ndarray, message: str):
    with pytest.raises(BadInput, match=message):
        flat_mesh(corners)
