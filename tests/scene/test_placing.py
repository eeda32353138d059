"""New boxes stand where the view looks, as large as their class usually is."""

from typing import Any

import numpy as np
import pytest

from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera, pixels_from_camera_points
from ars_web.scene.extent import Extent
from ars_web.scene.placing import frame_sight, free_sight, placed, usual_size
from ars_web.sessions.model import ObjectClass, VirtualBox

EXTENT = Extent(focus=np.array([0.0, 0.0, 0.1]), radius=1.0, ground=0.0, towards_cameras=0.0, frustum_depth=0.08)
SIZE = np.array([0.1, 0.2, 0.3])


def box_at(*centre: float, size: Any = (0.1, 0.1, 0.1)) -> Box:
    return Box(rigid_transform.from_rotation(np.eye(3), np.array(centre, dtype=float)), np.array(size))


def test_a_view_of_the_ground_puts_the_box_on_it() -> None:
    box = placed(free_sight(np.array([1.0, 0.0, 1.0]), np.array([0.1, 0.0, 0.1])), size=SIZE, ground=0.0)
    assert box.T_world_box[:3, 3] == pytest.approx([0.0, 0.0, 0.15])
    assert np.array_equal(box.T_world_box[:3, :3], np.eye(3))
    sunk = placed(free_sight(np.array([1.0, 0.0, 1.0]), np.array([0.1, 0.0, 0.1])), size=SIZE, ground=-0.5)
    assert sunk.corners_world[:, 2].min() == pytest.approx(-0.5)


@pytest.mark.parametrize("look_at", [(0.0, 0.0, 1.0), (0.0, 0.0, 1.5), (0.0, 0.0, 0.99)])
def test_a_view_of_the_horizon_puts_it_where_the_camera_turns_about(look_at: tuple[float, ...]) -> None:
    box = placed(free_sight(np.array([1.0, 0.0, 1.0]), np.array(look_at)), size=SIZE, ground=0.0)
    assert box.T_world_box[:3, 3] == pytest.approx(look_at)


def frame_looking(direction: np.ndarray) -> np.ndarray:
    z = direction / np.linalg.norm(direction)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    return rigid_transform.from_rotation(np.stack([x, np.cross(z, x), z], axis=-1), np.array([1.0, 0.0, 0.5]))


def test_a_frames_sight_is_the_photos_middle_not_the_optical_axis() -> None:
    camera = Camera(640, 480, 500.0, 500.0, 400.0, 200.0)
    T = frame_looking(np.array([-1.0, 0.0, -0.5]))
    box = placed(frame_sight(camera, T, boxes=[], extent=EXTENT), size=SIZE, ground=0.0)
    on_ground = box.T_world_box[:3, 3] - [0, 0, SIZE[2] / 2]
    pixel = pixels_from_camera_points(
        camera, rigid_transform.transform_points(rigid_transform.invert(T), on_ground[None])
    )
    assert pixel[0] == pytest.approx([319.5, 239.5])


def test_a_frame_that_sees_no_ground_puts_it_as_far_as_other_boxes_or_the_focus() -> None:
    camera = Camera(640, 480, 500.0, 500.0, 319.5, 239.5)
    T = frame_looking(np.array([-1.0, 0.0, 0.0]))
    alone = placed(frame_sight(camera, T, boxes=[], extent=EXTENT), size=SIZE, ground=0.0)
    assert alone.T_world_box[:3, 3] == pytest.approx([0.0, 0.0, 0.5])
    others = [box_at(0.5, 0.1, 0.2), box_at(0.3, -0.1, 0.2), box_at(-2.0, 0.0, 0.1), box_at(3.0, 0.0, 0.2)]
    among = placed(frame_sight(camera, T, boxes=others, extent=EXTENT), size=SIZE, ground=0.0)
    assert among.T_world_box[:3, 3] == pytest.approx([0.3, 0.0, 0.5])  # 0.7 m off, the median of those before it


def test_a_class_says_its_size_or_its_boxes_do_or_the_recording() -> None:
    mug = ObjectClass(0, "mug", "#56b4e9", 1)
    boxes = [
        VirtualBox(i, 0, "mug", box_at(0.0, 0.0, 0.0, size=(0.1 * i, 0.2, 0.3)), 1) for i in (1, 2, 9)
    ]  # fmt: skip
    stated = ObjectClass(0, "mug", "#56b4e9", 1, default_size=(0.085, 0.085, 0.12))
    assert usual_size(stated, boxes, extent=EXTENT).tolist() == [0.085, 0.085, 0.12]
    assert usual_size(mug, boxes, extent=EXTENT) == pytest.approx([0.2, 0.2, 0.3])
    other = ObjectClass(1, "die", "#e69f00", 1)
    assert usual_size(other, boxes, extent=EXTENT).tolist() == [0.1, 0.1, 0.1]
    huge = Extent(EXTENT.focus, 400.0, 0.0, 0.0, 1.0)
    assert usual_size(other, [], extent=huge).tolist() == [60.0, 60.0, 60.0]
