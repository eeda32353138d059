"""Hidden points against segments that try every triangle, and by hand."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from ars_web.errors import BadInput
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.hidden_points import CLEARANCE, hidden
from ars_web.geometry.mesh import Mesh
from ars_web.geometry.shape_stack import mesh_of_box

IDENTITY = np.eye(4)


def upright(x: float, y: float, z: float, size: tuple[float, float, float]) -> Box:
    place = np.array([x, y, z], dtype=np.float64)
    return Box(rigid_transform.from_rotation(np.eye(3), place), np.array(size, dtype=np.float64))


def of_box(box: Box, others: list[Box], *, T: np.ndarray = IDENTITY) -> np.ndarray:
    """Of the box's corners."""
    boxes = [box, *others]
    return hidden(T[None], box.corners_world[None], boxes, [None] * len(boxes), np.array([0]))[0, 0]


def test_points_are_hidden_where_any_triangle_is_before_them(shape_oracle, solids):
    random = np.random.default_rng(0)
    Ts = rigid_transform.from_position_wxyz(random.normal(size=(6, 3)) * 0.4, random.normal(size=(6, 4)))
    boxes = [Box(T, random.uniform(0.1, 0.6, 3)) for T in Ts]
    meshes = []
    for solid, box in zip(solids.values(), boxes, strict=True):
        points = rigid_transform.transform_points(box.T_world_box, solid.vertices_world * box.size)
        meshes.append(Mesh(points, solid.faces))
    points = random.normal(size=(6, 40, 3)) * 0.5
    cameras = rigid_transform.from_position_wxyz(random.normal(size=(12, 3)) * 0.9, random.normal(size=(12, 4)))
    owners = np.arange(6)
    found = hidden(cameras, points, boxes, [*meshes[:5], None], owners)
    meshes[5] = mesh_of_box(boxes[5])
    spans = []
    for box, mesh in zip(boxes, meshes, strict=True):
        own = rigid_transform.transform_points(rigid_transform.invert(box.T_world_box), mesh.vertices_world)
        spans.append(np.linalg.norm(np.ptp(own, axis=0)))
    clear = CLEARANCE * np.array(spans)
    want = np.zeros_like(found)
    for n, T in enumerate(cameras):
        centre = T[:3, 3]
        away = points - centre
        lengths = np.linalg.norm(away, axis=2)
        reach = np.maximum(1 - clear[owners, None] / lengths, 0)
        for mesh in meshes:
            triangles = mesh.vertices_world[mesh.faces]
            if shape_oracle.is_inside(centre, triangles):
                continue
            at, entering = shape_oracle.hits(centre, away.reshape(-1, 3), triangles)
            first = np.where(entering, at, np.inf).min(axis=1).reshape(6, 40)
            want[n] |= first <= reach
    assert 0.1 < want.mean() < 0.9
    assert_array_equal(found, want)


def test_a_box_hides_its_own_far_corners():
    # Seen from before and above, three faces are turned to the camera: all but one of their corners.
    box = upright(0.3, 0.4, 1.0, (0.2, 0.2, 0.2))
    assert of_box(box, []).sum() == 1
    # Seen straight on, the four corners of the face before; those behind are hidden by it.
    assert_array_equal(of_box(upright(0, 0, 1.0, (0.2, 0.2, 0.2)), []), [False, True] * 4)


def test_another_shape_hides_what_is_behind_it_and_not_what_is_before():
    box = upright(0, 0, 1.0, (0.2, 0.2, 0.2))
    assert of_box(box, [upright(0, 0, 0.5, (0.3, 0.3, 0.1))]).all()
    assert_array_equal(of_box(box, [upright(0, 0, 2.0, (3, 3, 0.1))]), of_box(box, []))


def test_a_point_on_a_surface_is_not_hidden_by_rounding(solids):
    ball = solids["ball"]
    box = upright(0, 0, 0, (1, 1, 1))
    corners = ball.vertices_world[ball.faces]
    weights = np.random.default_rng(0).dirichlet(np.ones(3), size=len(corners))
    points = np.einsum("fk,fki->fi", weights, corners)
    T = rigid_transform.from_rotation(np.eye(3), np.array([3.0, -2.0, 4.0]))
    found = hidden(T[None], points[None], [box], [ball], np.array([0]))[0, 0]
    towards = ball.planes[:, :3] @ T[:3, 3] + ball.planes[:, 3]
    assert not found[towards > 0.01].any()
    # Those on the far side are, but for where what is before them is thinner than what is not looked at.
    assert found[towards < -0.01].mean() > 0.95


def test_a_shape_round_the_camera_hides_nothing():
    room, thing = upright(0, 0, 0, (8, 8, 8)), upright(0, 0, 2.0, (0.4, 0.4, 0.4))
    assert_array_equal(of_box(thing, [room]), of_box(thing, []))
    assert not hidden(IDENTITY[None], np.array([[[0.0, 0.0, 0.0]]]), [thing], [None], np.array([0])).any()


def test_flat_meshes_hide_from_either_side():
    corners = np.array([[-0.2, -0.2, 1.0], [0.2, -0.2, 1.0], [0.2, 0.2, 1.0], [-0.2, 0.2, 1.0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    mesh = Mesh(corners, np.concatenate([faces, faces[:, ::-1]]))
    bound, thing = upright(0, 0, 1.0, (0.4, 0.4, 1e-6)), upright(0, 0, 1.5, (0.2, 0.2, 0.2))
    other_side = rigid_transform.from_rotation(np.eye(3), np.array([0.0, 0.0, 3.0]))
    points = np.array([[[0.05, 0.02, 1.5]], [[0.05, 0.02, 0.5]]])
    found = hidden(np.stack([IDENTITY, other_side]), points, [bound, thing], [mesh, None], np.array([0, 0]))
    assert_array_equal(found[..., 0], [[True, False], [True, True]])


def test_wrong_input_is_refused():
    box, points = upright(0, 0, 1, (1, 1, 1)), np.zeros((1, 2, 3))
    with pytest.raises(BadInput, match="belong to shape 3"):
        hidden(IDENTITY[None], points, [box], [None], np.array([3]))
    with pytest.raises(BadInput, match="1 boxes and 0 meshes"):
        hidden(IDENTITY[None], points, [box], [], np.array([0]))
    # Which sizes belong together is told by the annotations, and checked here for who calls without the tests.
    assert hidden(IDENTITY[None], np.zeros((0, 2, 3)), [], [], np.zeros(0, np.int64)).shape == (1, 0, 2)
