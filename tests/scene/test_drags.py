"""What a drag makes of a box: exact, without drift, and back to where it began."""

import math
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.scene.drags import MINUS, Move, Resize, Turn, along_axis

angles = st.floats(-3, 3)
vectors = st.tuples(*[st.floats(-2, 2)] * 3).map(np.array)


def rotation(vector: Any) -> np.ndarray:
    return cv2.Rodrigues(np.asarray(vector, dtype=float))[0]


def box_at(vector: Any = (0.3, -0.2, 0.9), centre: Any = (1.25, -0.4, 0.31)) -> Box:
    T = rigid_transform.from_rotation(rotation(vector), np.array(centre, dtype=float))
    return Box(T, np.array([0.085, 0.12, 0.2]))


def assert_same(a: Box, b: Box, tolerance: float = 1e-12) -> None:
    assert np.abs(a.T_world_box - b.T_world_box).max() <= tolerance
    assert np.abs(a.size - b.size).max() <= tolerance


@given(vectors, vectors, vectors, st.sampled_from([0.0, 0.001, 0.01]))
def test_a_box_moves_by_multiples_along_the_gizmos_axes_and_back(turn: Any, grip: Any, by: Any, snap: float) -> None:
    box = box_at()
    gizmo = rigid_transform.from_rotation(rotation(turn), box.T_world_box[:3, 3])
    drag = Move(box, gizmo, snap=snap)
    there = gizmo.copy()
    there[:3, 3] += gizmo[:3, :3] @ by
    moved = drag.to(there).box
    along = gizmo[:3, :3].T @ (moved.T_world_box[:3, 3] - box.T_world_box[:3, 3])
    wanted = by if snap == 0 else np.round(by / snap) * snap
    assert np.abs(along - wanted).max() <= max(1e-9, 0 if snap == 0 else snap * 1.001 * (np.abs(by) % snap > 0).any())
    assert np.array_equal(moved.size, box.size)
    # Whatever was in between: the drag began there, and ends there.
    assert_same(drag.to(gizmo).box, box, 0.0)


def test_a_move_says_what_changed_in_millimetres() -> None:
    box = box_at((0, 0, 0))
    gizmo = box.T_world_box
    there = gizmo.copy()
    there[0, 3] += 0.0123
    assert Move(box, gizmo, snap=0.001).to(there).text == "X +12.0 mm"
    there[2, 3] -= 0.0042
    assert Move(box, gizmo).to(there).text == f"X +12.3 mm  Z {MINUS}4.2 mm"
    assert Move(box, gizmo).to(gizmo).text == "0.0 mm"


@given(vectors, st.sampled_from([0, 1, 2]), angles, st.sampled_from([0.0, math.radians(1), math.radians(15)]))
def test_a_box_turns_about_its_centre_by_multiples_and_back(turn: Any, axis: int, angle: float, snap: float) -> None:
    box = box_at()
    gizmo = rigid_transform.from_rotation(rotation(turn), box.T_world_box[:3, 3])
    about = np.zeros(3)
    about[axis] = angle
    there = gizmo.copy()
    there[:3, :3] = gizmo[:3, :3] @ rotation(about)
    drag = Turn(box, gizmo, snap=snap)
    turned = drag.to(there)
    kept = angle if snap == 0 else round(angle / snap) * snap
    wanted = gizmo[:3, :3] @ rotation(about / angle * kept if angle else about) @ gizmo[:3, :3].T
    expected = wanted @ box.T_world_box[:3, :3]
    near_half = snap > 0 and abs(abs(angle / snap) % 1 - 0.5) < 1e-6
    assert near_half or np.abs(turned.box.T_world_box[:3, :3] - expected).max() < 1e-8
    R = turned.box.T_world_box[:3, :3]
    assert np.abs(R.T @ R - np.eye(3)).max() < 1e-14
    assert np.array_equal(turned.box.T_world_box[:3, 3], box.T_world_box[:3, 3])
    assert_same(drag.to(gizmo).box, box, 0.0)


def test_an_upright_box_turns_about_the_worlds_z_only_whatever_the_gizmo_does() -> None:
    box = box_at((0, 0, 0.4))
    gizmo = rigid_transform.from_rotation(np.eye(3), box.T_world_box[:3, 3])
    there = gizmo.copy()
    there[:3, :3] = rotation((0.02, -0.01, math.radians(31.4)))
    turned = Turn(box, gizmo, snap=math.radians(1), upright=True).to(there)
    assert np.abs(turned.box.T_world_box[2, :3] - [0, 0, 1]).max() < 1e-15
    assert turned.text == "Z +31.0°"


def seen_from(box: Box, axis: int, at: float) -> tuple[np.ndarray, np.ndarray]:
    """An eye beside the box, and a pointer on its ray to the point `at` metres along the box's axis."""
    R, centre = box.T_world_box[:3, :3], box.T_world_box[:3, 3]
    eye = centre + R[:, (axis + 1) % 3] * 1.5 + R[:, (axis + 2) % 3] * 0.4
    on_axis = centre + R[:, axis] * at
    return eye, eye + (on_axis - eye) * 0.7


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("side", [1, -1])
def test_a_face_is_dragged_to_exact_snaps_and_the_opposite_face_stays(axis: int, side: int) -> None:
    box = box_at()
    half = box.size[axis] / 2
    drag = Resize(box, axis, side, grip=side * half, snap=0.001)
    reached = drag.to(*seen_from(box, axis, side * (half + 0.0233)))
    assert reached is not None
    assert reached.box.size[axis] == pytest.approx(box.size[axis] + 0.023, abs=1e-15)
    others = [i for i in range(3) if i != axis]
    assert np.array_equal(reached.box.size[others], box.size[others])

    def opposite(of: Box) -> np.ndarray:
        return of.T_world_box[:3, 3] - of.T_world_box[:3, axis] * (side * of.size[axis] / 2)

    assert np.abs(opposite(reached.box) - opposite(box)).max() < 1e-15
    assert reached.text == f"Size {'XYZ'[axis]} {(box.size[axis] + 0.023) * 1e3:.1f} mm"
    back = drag.to(*seen_from(box, axis, side * half))
    assert back is not None
    assert_same(back.box, box, 0.0)


def test_a_face_pushed_through_the_box_leaves_the_least_size() -> None:
    box = box_at()
    reached = Resize(box, 0, 1, grip=box.size[0] / 2, snap=0.0).to(*seen_from(box, 0, -3.0))
    assert reached is not None
    assert reached.box.size[0] == 1e-3


def test_a_face_that_looks_at_the_eye_says_nothing() -> None:
    box = box_at()
    R, centre = box.T_world_box[:3, :3], box.T_world_box[:3, 3]
    eye = centre + R[:, 0] * 2
    assert along_axis(box, axis=0, eye=eye, pointer=centre + R[:, 1] * 0.01) is None
    assert Resize(box, 0, 1, grip=0.04).to(eye, centre) is None
    assert along_axis(box, axis=0, eye=eye, pointer=eye) is None
