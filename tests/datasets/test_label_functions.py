"""Label functions: each beside what it must be, over boxes, hulls and meshes, in frames of a bent lens."""

from collections.abc import Callable

import cv2
import numpy as np
import pytest
import shapely

from ars_web.datasets.frame_marks import frame_marks, frame_shapes
from ars_web.datasets.label_functions import HIDDEN, LABEL_FUNCTIONS, SEEN, UNSEEN
from ars_web.datasets.samples import frame_labels
from ars_web.errors import BadInput, NotFound
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import CORNER_SIGNS, Box
from ars_web.geometry.keypoints import Keypoint
from ars_web.sessions.hull_mesh import HullMesh
from ars_web.sessions.model import SessionSnapshot
from ars_web.sessions.object_mesh import ObjectMesh

Make = Callable[..., SessionSnapshot]


@pytest.fixture
def snapshot(make_snapshot: Make, octahedron: HullMesh) -> SessionSnapshot:
    """Three boxes: the second has a hull, the third a mesh that is smaller than its box."""
    return make_snapshot(
        12,
        hulls={2: octahedron},
        meshes={3: ObjectMesh(octahedron.vertices * 0.1, octahedron.faces)},
        keypoints={1: (Keypoint("tip", (0.0, 0.0, 0.5)), Keypoint("foot", (0.0, 0.0, -0.5)))},
    )


@pytest.mark.parametrize("shape", ["box", "hull", "mesh"])
@pytest.mark.parametrize("index", range(0, 12, 2))
def test_rings_lie_as_their_definitions_say(snapshot: SessionSnapshot, index: int, shape: str) -> None:
    labels = frame_labels(snapshot, index, shape=shape)
    drawn = {name: frame_marks(snapshot, index, function=name, shape=shape) for name in LABEL_FUNCTIONS}
    for column, label in enumerate(labels):
        if label.bbox is None:
            assert all(len(marks[column].rings) == 0 for marks in drawn.values())
            continue
        outline = shapely.Polygon(label.outline).buffer(0)
        box, convex, silhouette, rectangle = (
            shapely.Polygon(drawn[name][column].rings[0]) for name in ("box", "convex", "silhouette", "rectangle")
        )
        assert box.bounds == pytest.approx(label.bbox, abs=1e-9)
        assert shapely.hausdorff_distance(convex, outline.convex_hull) < 0.2
        assert silhouette.symmetric_difference(outline).area < 0.2 * outline.length + 1e-6
        assert rectangle.area == pytest.approx(outline.minimum_rotated_rectangle.area, rel=0.02, abs=0.5)
        assert convex.difference(rectangle.buffer(0.3)).area < 1e-6


def test_keypoints_are_the_centre_and_the_corners_unless_the_class_names_others(snapshot: SessionSnapshot) -> None:
    index = 1
    camera = snapshot.cameras[int(snapshot.frames.camera_ids[index])]
    T_camera_world = rigid_transform.invert(snapshot.frames.Ts_world_camera[index])
    marks = frame_marks(snapshot, index, function="keypoints")
    for mark, (_, virtual) in zip(marks, sorted(snapshot.state.boxes.items()), strict=True):
        box: Box = virtual.box
        places = np.vstack([np.zeros(3), CORNER_SIGNS / 2])
        names = ["centre", *(f"corner {i}" for i in range(8))]
        if virtual.class_id == 1:
            places, names = np.array([[0, 0, 0.5], [0, 0, -0.5]]), ["tip", "foot"]
        points = rigid_transform.transform_points(T_camera_world @ box.T_world_box, places * box.size)
        pixels, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), camera.K, np.array(camera.distortion))
        assert [point.name for point in mark.points] == names
        for point, pixel, depth in zip(mark.points, pixels[:, 0] + 0.5, points[:, 2], strict=True):
            assert point.at is None or (depth > 0 and np.abs(np.array(point.at) - pixel).max() < 1e-6)
            inside = point.at is not None and (0 <= pixel).all() and (pixel <= [camera.width, camera.height]).all()
            assert (point.state == UNSEEN) == (not inside or not mark.points)


def test_a_keypoint_on_the_far_side_is_hidden(snapshot: SessionSnapshot) -> None:
    """Of a box seen from outside, three to seven corners are in sight, and the centre never is."""
    seen_corners: list[int] = []
    for index in range(0, 10, 3):
        for mark in frame_marks(snapshot, index, function="keypoints", shape="box"):
            states = [point.state for point in mark.points]
            if len(states) == 9 and UNSEEN not in states:
                assert states[0] == HIDDEN
                seen_corners.append(states.count(SEEN))
    assert seen_corners
    assert all(1 <= count <= 7 for count in seen_corners)


def test_marks_of_what_is_not_wanted_are_none(snapshot: SessionSnapshot) -> None:
    found = frame_shapes(snapshot, 11)
    for name, function in LABEL_FUNCTIONS.items():
        marks = function.draw(found.shapes, found.table, np.zeros((1, 3), dtype=np.bool_))
        assert len(marks.rings.points) == 0, name
        assert marks.rings.label_starts.tolist() == [0, 0, 0, 0]
        assert not marks.states.any()


def test_what_is_not_there_is_refused(snapshot: SessionSnapshot, make_snapshot: Make) -> None:
    with pytest.raises(BadInput, match="label function 'oval' is unknown; known are box, convex"):
        frame_marks(snapshot, 0, function="oval")
    with pytest.raises(NotFound, match="no frame 12; its frames are 0 to 11"):
        frame_marks(snapshot, 12, function="box")
    with pytest.raises(BadInput, match="shape 'mesh' needs a mesh, and no class or box here has one"):
        frame_marks(make_snapshot(3, sid="s2"), 0, function="box", shape="mesh")
