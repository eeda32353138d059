"""The symmetry of an object: the turns about its box's centre that leave it looking the same."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from ars_web.errors import BadInput
from ars_web.geometry.rigid_transform import rotation_from_wxyz

SymmetryKind = Literal["none", "discrete", "continuous"]
Axis = tuple[float, float, float]

SYMMETRY_KINDS: tuple[SymmetryKind, ...] = ("none", "discrete", "continuous")

MOST_ROTATIONS = 72
"""Of a discrete symmetry. An icosahedron has 60; a wheel with 36 teeth that looks alike from both sides has 72."""

_SAME = 1e-4
"""Entries of two rotations that are one. Those of a group of MOST_ROTATIONS differ by a twentieth and more, axes typed
in with five digits by less than this."""

_TIE = 1e-9
"""Traces of two rotations that are as close to the identity as each other."""

_WEIGHTS = np.array([1.0, 0.7548777, 0.5698403, 0.4301597, 0.3247180, 0.2451223, 0.1850375, 0.1396806, 0.1054388])
"""Of the entries of a rotation, so that no two of a tie weigh the same: powers of a number that is no ratio."""


@dataclass(frozen=True)
class Symmetry:
    """How an object looks the same, in its box's frame; all its axes run through the box's centre.

    Attributes:
        kind: none, a finite number of turns, or any turn about one axis.
        rotations: of a discrete one: (axis, order) generators, each a turn by 1 / order of a circle; together with
            whatever follows from them. ((0, 0, 1), 4): a quarter turn about z.
        axis: of a continuous one; of unit length.
        flip: of a continuous one: whether a half turn across the axis changes nothing either, as for a cylinder whose
            ends look alike.
    """

    kind: SymmetryKind = "none"
    rotations: tuple[tuple[Axis, int], ...] = ()
    axis: Axis | None = None
    flip: bool = False

    def __post_init__(self) -> None:
        """Raises BadInput for an axis without a direction, an order below 2, what does not go with the kind, and for
        generators that lead to more than MOST_ROTATIONS rotations."""
        if self.kind not in SYMMETRY_KINDS:
            raise BadInput(f"a symmetry must be one of {', '.join(SYMMETRY_KINDS)}, not {self.kind!r}")
        if (self.kind == "discrete") != bool(self.rotations):
            raise BadInput(
                "a discrete symmetry needs at least one rotation, such as axis (0, 0, 1) and order 4"
                if self.kind == "discrete"
                else f"a symmetry of kind {self.kind!r} has no rotations of an order; say discrete, or leave them out"
            )
        if (self.kind == "continuous") != (self.axis is not None):
            raise BadInput(
                "a continuous symmetry needs the axis about which any turn changes nothing"
                if self.kind == "continuous"
                else f"a symmetry of kind {self.kind!r} has no single axis; say continuous, or leave it out"
            )
        if self.flip and self.kind != "continuous":
            raise BadInput(f"only a continuous symmetry can have a flip, not one of kind {self.kind!r}")
        rotations = tuple((_checked_axis(axis), _checked_order(order)) for axis, order in self.rotations)
        object.__setattr__(self, "rotations", rotations)
        object.__setattr__(self, "axis", None if self.axis is None else _checked_axis(self.axis))
        if rotations:
            _group(rotations)


NO_SYMMETRY = Symmetry()


def rotations_of(symmetry: Symmetry) -> Float[np.ndarray, "m 3 3"]:
    """All turns, in the box's frame, that a symmetry's generators lead to: a group, the identity first.

    Of a continuous one they are those beside its turns about the axis: the identity, and with a flip one half turn
    across the axis.
    """
    if symmetry.kind == "discrete":
        return _group(symmetry.rotations)
    if symmetry.axis is not None and symmetry.flip:
        return np.stack([np.eye(3), turn_about(_across(np.array(symmetry.axis)), np.pi)])
    return np.eye(3)[None]


def canonical_rotation(
    R_camera_box: Float[np.ndarray, "*batch 3 3"], symmetry: Symmetry
) -> Float[np.ndarray, "*batch 3 3"]:
    """Of the rotations that the object cannot be told apart in, the one that turns least: nearest to the identity.

    Poses that are alike under the symmetry give the same one, up to rounding; `R_camera_box.T @` it is one of the
    symmetry's turns. Where two turn equally little, a fixed rule takes one.
    """
    R = np.asarray(R_camera_box, dtype=np.float64)
    if symmetry.kind == "none":
        return R.copy()
    if symmetry.axis is not None:
        axis = np.array(symmetry.axis)
        points = R @ axis
        if symmetry.flip:
            ahead = points @ axis
            # Across the axis neither end is nearer; the weights then say which.
            ahead = np.where(np.abs(ahead) > _TIE, ahead, points @ _WEIGHTS[:3])
            points = np.where((ahead < 0.0)[..., None], -points, points)
        return _shortest_turns(axis, points)
    candidates = R[..., None, :, :] @ rotations_of(symmetry)
    traces = np.trace(candidates, axis1=-2, axis2=-1)
    weights = candidates.reshape(*traces.shape, 9) @ _WEIGHTS
    nearest = traces >= traces.max(axis=-1, keepdims=True) - _TIE
    chosen = np.where(nearest, weights, -np.inf).argmax(axis=-1)
    return np.take_along_axis(candidates, chosen[..., None, None, None], axis=-3)[..., 0, :, :]


def turn_about(axis: Float[np.ndarray, "3"], angle: float) -> Float[np.ndarray, "3 3"]:
    """Rotation by `angle` radians about an axis of unit length; zeros and ones are exact."""
    half = angle / 2
    R = rotation_from_wxyz(np.array([np.cos(half), *(np.sin(half) * axis)]))
    whole = np.round(R)
    return np.where(np.abs(R - whole) < 1e-12, whole, R) + 0.0


def _group(rotations: Sequence[tuple[Axis, int]]) -> Float[np.ndarray, "m 3 3"]:
    """The rotations that are products of the generators, in the order in which they are met, breadth first.

    Raises:
        BadInput: they are more than MOST_ROTATIONS.
    """
    generators = [turn_about(np.array(axis), 2 * np.pi / order) for axis, order in rotations]
    found = [np.eye(3)]
    for R in found:  # which grows meanwhile
        for generator in generators:
            product = R @ generator
            if np.abs(np.array(found) - product).max(axis=(1, 2)).min() < _SAME:
                continue
            if len(found) == MOST_ROTATIONS:
                said = ", ".join(f"{order} about {list(axis)}" for axis, order in rotations)
                raise BadInput(
                    f"the rotations {said} lead to more than {MOST_ROTATIONS}: no object has them all. Give axes that"
                    " fit each other, to six digits, or a continuous symmetry"
                )
            whole = np.round(product)
            found.append(np.where(np.abs(product - whole) < 1e-12, whole, product) + 0.0)
    return np.stack(found)


def _shortest_turns(
    axis: Float[np.ndarray, "3"], points: Float[np.ndarray, "*batch 3"]
) -> Float[np.ndarray, "*batch 3 3"]:
    """The smallest rotations that lead `axis` to `points`, all of unit length."""
    cosines = points @ axis
    # (1 + cos, sin * axis of the turn) is twice the quaternion times its w; for a half turn it vanishes.
    wxyz = np.concatenate([1.0 + cosines[..., None], np.cross(axis, points)], axis=-1)
    behind = cosines < -1.0 + 1e-14
    return rotation_from_wxyz(np.where(behind[..., None], np.array([0.0, *_across(axis)]), wxyz))


def _across(axis: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    """A direction perpendicular to `axis`: as near as can be to that of x, y, z that is the most across."""
    start = np.eye(3)[int(np.argmin(np.abs(axis)))]
    across = start - (start @ axis) * axis
    return across / np.linalg.norm(across) + 0.0


def _checked_axis(axis: Sequence[float]) -> Axis:
    """`axis` with unit length. One that has it stays as it is, digit by digit, so that it can be stored and read."""
    direction = np.asarray(axis, dtype=np.float64)
    if direction.shape != (3,) or not np.isfinite(direction).all():
        raise BadInput(f"a symmetry's axis must be three finite numbers, not {axis!r}")
    length = float(np.linalg.norm(direction))
    if not 1e-9 <= length <= 1e9:
        raise BadInput(f"a symmetry's axis must have a direction: {direction.tolist()} has none")
    if abs(length - 1.0) > 1e-12:
        direction = direction / length
    x, y, z = (direction + 0.0).tolist()
    return x, y, z


def _checked_order(order: int) -> int:
    if isinstance(order, bool) or not isinstance(order, int) or not 2 <= order <= MOST_ROTATIONS:  # pyright: ignore[reportUnnecessaryIsInstance]: from a file
        raise BadInput(f"the order of a rotation must be a whole number from 2 to {MOST_ROTATIONS}, not {order!r}")
    return order
