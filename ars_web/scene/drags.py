"""What a box becomes while it is moved, turned or resized. Pure; all of it from where the drag began, in float64.

A drag holds its start and answers for each pose or pointer what the box is now and what to say beside the pointer.
Nothing adds up: a drag that comes back to its start ends with the very box that it began with.
"""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ars_web.geometry import rigid_transform
from ars_web.geometry.box import LARGEST_SIZE, Box
from ars_web.geometry.rigid_transform import Transform
from ars_web.scene.snapping import snapped, snapped_change, snapped_size

AXES = ("X", "Y", "Z")

MINUS = "\u2212"

LEAST_SIZE = 1e-3
"""Metres: no side is dragged to less, so that its handles stay apart; a smaller one can be typed."""

STILL = 1e-9
"""Radians: what the gizmo's pose is turned by in the browser's rounding."""

STEEPEST = math.sin(math.radians(6))
"""A face that looks at the viewer within 6 degrees cannot be dragged: a pixel would be many times its length."""


@dataclass(frozen=True, eq=False)
class Dragging:
    """Where a drag has got to."""

    box: Box
    text: str


@dataclass(frozen=True, eq=False)
class Move:
    """A box moved by a gizmo.

    Attributes:
        box: at the start.
        T_world_gizmo: the gizmo's pose at the start; it moves along its own axes.
        snap: metres, of the distance along each axis; 0: none.
    """

    box: Box
    T_world_gizmo: Transform
    snap: float = 0.0

    def to(self, T_world_gizmo: Transform) -> Dragging:
        """The box when the gizmo has got there."""
        R = self.T_world_gizmo[:3, :3]
        along = snapped_change(R.T @ (T_world_gizmo[:3, 3] - self.T_world_gizmo[:3, 3]), step=self.snap)
        T = self.box.T_world_box.copy()
        if along.any():
            T[:3, 3] += R @ along
        # The gizmo's other axes drift by the rounding of the browser's arithmetic.
        told = [(axis, mm) for axis, mm in zip(AXES, along * 1e3, strict=True) if abs(mm) >= 0.05]
        return Dragging(Box(T, self.box.size), "  ".join(f"{axis} {_signed(mm)} mm" for axis, mm in told) or "0.0 mm")


@dataclass(frozen=True, eq=False)
class Turn:
    """A box turned about its centre by a gizmo.

    Attributes:
        box: at the start.
        T_world_gizmo: the gizmo's pose at the start; it turns about one of its own axes at a time.
        snap: radians, of the angle; 0: none.
        upright: turn about the world's z axis only, whatever the gizmo does.
    """

    box: Box
    T_world_gizmo: Transform
    snap: float = 0.0
    upright: bool = False

    def to(self, T_world_gizmo: Transform) -> Dragging:
        """The box when the gizmo has got there."""
        start = self.T_world_gizmo[:3, :3]
        vector = _rotation_vector(start.T @ rigid_transform.nearest_rotation(T_world_gizmo[:3, :3]))
        if self.upright:
            vector, start = start @ vector, np.eye(3)
            axis = 2
        else:
            axis = int(np.argmax(np.abs(vector)))
        angle = snapped(float(vector[axis]), step=self.snap)
        text = f"{AXES[axis]} {_signed(math.degrees(angle))}°"
        if abs(angle) < STILL:
            return Dragging(self.box, text)
        R = start @ _about(axis, angle) @ start.T @ self.box.T_world_box[:3, :3]
        T = rigid_transform.from_rotation(rigid_transform.nearest_rotation(R), self.box.T_world_box[:3, 3])
        return Dragging(Box(T, self.box.size), text)


@dataclass(frozen=True, eq=False)
class Resize:
    """A box of which one face is dragged; the opposite face stays.

    Attributes:
        box: at the start.
        axis: 0, 1 or 2, of the box.
        side: 1: the face towards +axis, -1: the other.
        grip: metres along the axis, from the box's centre to where the face was taken.
        snap: metres, of the side's length; 0: none.
    """

    box: Box
    axis: int
    side: int
    grip: float
    snap: float = 0.0

    def to(self, eye: Float[np.ndarray, "3"], pointer: Float[np.ndarray, "3"]) -> Dragging | None:
        """The box when the pointer is on the ray from `eye` to `pointer`, both in the world; None where the ray runs
        so nearly along the axis that it says nothing."""
        reached = along_axis(self.box, axis=self.axis, eye=eye, pointer=pointer)
        if reached is None:
            return None
        before = float(self.box.size[self.axis])
        wanted = min(before + self.side * (reached - self.grip), LARGEST_SIZE)
        length = snapped_size(wanted, start=before, step=self.snap, least=min(LEAST_SIZE, before))
        text = f"Size {AXES[self.axis]} {length * 1e3:.1f} mm"
        if length == before:
            return Dragging(self.box, text)
        size, T = self.box.size.copy(), self.box.T_world_box.copy()
        size[self.axis] = length
        T[:3, 3] += T[:3, self.axis] * (self.side * (length - before) / 2)
        return Dragging(Box(T, size), text)


def along_axis(box: Box, *, axis: int, eye: Float[np.ndarray, "3"], pointer: Float[np.ndarray, "3"]) -> float | None:
    """How far along a box's axis, metres from its centre, the axis comes nearest to the ray from `eye` to `pointer`.

    With the ray p + t d, |d| = 1, the axis c + s n and w = c - p: s = ((n . d)(d . w) - n . w) / (1 - (n . d)^2).
    None where the two are too nearly parallel, or the pointer is at the eye.
    """
    ray = pointer - eye
    distance = float(np.linalg.norm(ray))
    if distance == 0.0:
        return None
    d, n, w = ray / distance, box.T_world_box[:3, axis], box.T_world_box[:3, 3] - eye
    cosine = float(n @ d)
    if 1.0 - cosine**2 < STEEPEST**2:
        return None
    return (cosine * float(d @ w) - float(n @ w)) / (1.0 - cosine**2)


def _rotation_vector(R: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "3"]:
    """Axis times angle, in (-pi, pi]."""
    w, *xyz = rigid_transform.wxyz_from_rotation(R)
    sine = float(np.linalg.norm(xyz))
    if sine == 0.0:
        return np.zeros(3)
    return np.array(xyz) / sine * (2.0 * math.atan2(sine, float(w)))


def _about(axis: int, angle: float) -> Float[np.ndarray, "3 3"]:
    """Rotation by an angle about an axis of the frame."""
    turned = rigid_transform.rotation_about_z(angle)
    # z to the wanted axis, and the others in turn
    order = [(i - axis - 1) % 3 for i in range(3)]
    return turned[np.ix_(order, order)]


def _signed(value: float) -> str:
    rounded = round(value, 1)
    return f"{'+' if rounded > 0 else MINUS if rounded < 0 else ''}{abs(rounded):.1f}"
