"""Poses as files give them, made rigid in one batch; what is wrong with a pose is said row by row."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ars_web.geometry import rigid_transform

QUATERNION_TOLERANCE = 1e-2
"""How far a quaternion's length may be from 1: more than rounding leaves, less than a mixed-up column gives."""

FARTHEST = 1e8
"""Metres. Map coordinates reach 1e7; a position beyond this is damage."""


@dataclass(frozen=True, eq=False)
class CheckedPoses:
    """Poses of which some may be unusable.

    Attributes:
        Ts: (n, 4, 4); the identity where a pose is unusable.
        problems: what is wrong, by row.
    """

    Ts: Float[np.ndarray, "n 4 4"]
    problems: dict[int, str]


def poses_from_quaternions(position: Float[np.ndarray, "n 3"], wxyz: Float[np.ndarray, "n 4"]) -> CheckedPoses:
    """Poses from positions and quaternions that should be of unit length, and are made so."""
    problems = _position_problems(position)
    with np.errstate(over="ignore", invalid="ignore"):
        length = np.linalg.norm(wxyz, axis=1)
    for row in np.flatnonzero(~np.isfinite(wxyz).all(axis=1)):
        problems.setdefault(int(row), "its quaternion is not finite")
    for row in np.flatnonzero(~(np.abs(length - 1) <= QUATERNION_TOLERANCE)):
        problems.setdefault(int(row), f"its quaternion has length {length[row]:.6g}, not 1")
    bad = list(problems)
    position, wxyz = position.copy(), wxyz.copy()
    position[bad] = 0.0
    wxyz[bad] = [1.0, 0.0, 0.0, 0.0]
    return CheckedPoses(rigid_transform.from_position_wxyz(position, wxyz), problems)


def poses_from_matrices(Ts: Float[np.ndarray, "n 4 4"]) -> CheckedPoses:
    """Poses from matrices whose rotations should be orthonormal, and are made exactly so."""
    problems = _position_problems(Ts[:, :3, 3])
    for row in np.flatnonzero(~np.isfinite(Ts).all(axis=(1, 2))):
        problems.setdefault(int(row), "its matrix has an entry that is not finite")
    finite = Ts.copy()
    finite[list(problems)] = np.eye(4)
    for row in np.flatnonzero(np.abs(finite[:, 3] - [0, 0, 0, 1]).max(axis=1) > 1e-6):
        problems[int(row)] = f"its matrix's last row must be 0 0 0 1, not {finite[row, 3].tolist()}"
    R = finite[:, :3, :3]
    with np.errstate(over="ignore", invalid="ignore"):
        error = np.abs(np.swapaxes(R, 1, 2) @ R - np.eye(3)).max(axis=(1, 2))
        determinant = np.linalg.det(R)
    for row in np.flatnonzero(~(error <= rigid_transform.ROTATION_TOLERANCE)):
        reason = f"not a rotation: R^T R is off the identity by {error[row]:.3g} (is there a scale in it?)"
        problems.setdefault(int(row), reason)
    for row in np.flatnonzero(determinant < 0):
        problems.setdefault(int(row), "not a rotation but a reflection (is an axis mirrored?)")
    finite[list(problems)] = np.eye(4)
    rotations = rigid_transform.nearest_rotation(finite[:, :3, :3])
    return CheckedPoses(rigid_transform.from_rotation(rotations, finite[:, :3, 3]), problems)


def _position_problems(position: Float[np.ndarray, "n 3"]) -> dict[int, str]:
    problems: dict[int, str] = {}
    for row in np.flatnonzero(~(np.abs(position) <= FARTHEST).all(axis=1)):
        shown = " ".join(f"{value:g}" for value in position[row])
        finite = bool(np.isfinite(position[row]).all())
        problems[int(row)] = f"its position {shown} is " + ("beyond all maps" if finite else "not finite")
    return problems
