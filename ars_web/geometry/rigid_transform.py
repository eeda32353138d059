"""Rigid transforms as (4, 4) float64 matrices; every function takes one or a batch of them.

A transform named `T_a_b` maps coordinates in frame b to frame a. Quaternions are `wxyz`, unit length, w >= 0.
"""

import numpy as np
from jaxtyping import Float

from ars_web.errors import BadInput

Transform = Float[np.ndarray, "4 4"]
Transforms = Float[np.ndarray, "*batch 4 4"]

ROTATION_TOLERANCE = 1e-3
"""How far R^T R may be from the identity, entry by entry, before a matrix read from a file is no rotation.
Files hold six to nine digits; a scaled or sheared matrix is off by far more."""


ROUNDING = 1e-14
"""R^T R of a rotation that is as exact as float64 can hold is off the identity by less."""


def from_rotation(
    rotation: Float[np.ndarray, "*#batch 3 3"], translation: Float[np.ndarray, "*#batch 3"]
) -> Float[np.ndarray, "... 4 4"]:
    """Transforms from rotation matrices (..., 3, 3) and translations (..., 3), which must broadcast."""
    batch = np.broadcast_shapes(rotation.shape[:-2], translation.shape[:-1])
    T = np.zeros((*batch, 4, 4))
    T[..., :3, :3] = rotation
    T[..., :3, 3] = translation
    T[..., 3, 3] = 1.0
    return T


def from_position_wxyz(position: Float[np.ndarray, "*batch 3"], wxyz: Float[np.ndarray, "*batch 4"]) -> Transforms:
    """Transforms from positions (..., 3) and quaternions (..., 4) of any length but zero.

    Raises:
        BadInput: a value is not finite or a quaternion has no length.
    """
    if not np.isfinite(position).all():
        raise BadInput(f"a position is not finite: {np.asarray(position).tolist()}")
    return from_rotation(rotation_from_wxyz(wxyz), np.asarray(position, dtype=np.float64))


def rotation_from_wxyz(wxyz: Float[np.ndarray, "*batch 4"]) -> Float[np.ndarray, "*batch 3 3"]:
    """Rotation matrices (..., 3, 3) of quaternions (..., 4), normalised first.

    Raises:
        BadInput: a quaternion is not finite or shorter than 1e-9.
    """
    q = np.asarray(wxyz, dtype=np.float64)
    length = np.linalg.norm(q, axis=-1, keepdims=True)
    if not np.isfinite(q).all() or (length < 1e-9).any():
        raise BadInput(f"a quaternion must be finite and not zero: {q.tolist()} (order w x y z)")
    w, x, y, z = np.moveaxis(q / length, -1, 0)
    # https://en.wikipedia.org/wiki/Rotation_matrix#Quaternion
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def wxyz_from_rotation(rotation: Float[np.ndarray, "*batch 3 3"]) -> Float[np.ndarray, "*batch 4"]:
    """Unit quaternions (..., 4) with w >= 0 of rotation matrices (..., 3, 3).

    Bar-Itzhack's symmetric matrix would need an eigenvector for each; this takes, as Shepperd does, the
    largest of the four components as pivot, so that no root of a small number is divided by.
    """
    R = np.asarray(rotation, dtype=np.float64)
    xx, yy, zz = R[..., 0, 0], R[..., 1, 1], R[..., 2, 2]
    a, b, c = R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]
    d, e, f = R[..., 0, 1] + R[..., 1, 0], R[..., 0, 2] + R[..., 2, 0], R[..., 1, 2] + R[..., 2, 1]
    # Row i is 4 q_i (w, x, y, z): all four are parallel to q, the longest is the best conditioned.
    candidates = np.stack(
        [
            np.stack([1 + xx + yy + zz, a, b, c], axis=-1),
            np.stack([a, 1 + xx - yy - zz, d, e], axis=-1),
            np.stack([b, d, 1 - xx + yy - zz, f], axis=-1),
            np.stack([c, e, f, 1 - xx - yy + zz], axis=-1),
        ],
        axis=-2,
    )
    pivot = np.argmax(np.stack([candidates[..., i, i] for i in range(4)], axis=-1), axis=-1)
    q = np.take_along_axis(candidates, pivot[..., None, None], axis=-2)[..., 0, :]
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return np.where(q[..., :1] < 0, -q, q) + 0.0


def invert(T: Transforms) -> Transforms:
    """The inverses: `invert(T_a_b)` is `T_b_a`."""
    R_inv = np.swapaxes(T[..., :3, :3], -1, -2)
    return from_rotation(R_inv, -(R_inv @ T[..., :3, 3:])[..., 0])


def transform_points(
    T_a_b: Float[np.ndarray, "*#batch 4 4"], points_b: Float[np.ndarray, "*#batch n 3"]
) -> Float[np.ndarray, "... n 3"]:
    """Points (..., n, 3) in frame b as points in frame a; batches broadcast."""
    return points_b @ np.swapaxes(T_a_b[..., :3, :3], -1, -2) + T_a_b[..., None, :3, 3]


def nearest_rotation(matrix: Float[np.ndarray, "*batch 3 3"]) -> Float[np.ndarray, "*batch 3 3"]:
    """The rotations nearest to the matrices in the Frobenius norm (SVD; Arun et al. 1987), never a reflection."""
    U, _, Vt = np.linalg.svd(matrix)
    flip = np.linalg.det(U @ Vt) < 0
    U = np.where(flip[..., None, None] & (np.arange(3) == 2), -U, U)
    return U @ Vt


def rotation_about_z(angle: float) -> Float[np.ndarray, "3 3"]:
    """Rotation by `angle` radians about z."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def checked(T: Float[np.ndarray, "4 4"]) -> Transform:
    """`T` with its rotation made exact, or an error that says what is wrong with it.

    Raises:
        BadInput: an entry is not finite, the last row is not 0 0 0 1, or the upper left is no rotation within
            ROTATION_TOLERANCE (scaled, sheared, mirrored).
    """
    T = np.asarray(T, dtype=np.float64)
    if T.shape != (4, 4):
        raise BadInput(f"a transform has 4 x 4 numbers, this one {' x '.join(map(str, T.shape))}")
    if not np.isfinite(T).all():
        raise BadInput("a transform has an entry that is not finite")
    if np.abs(T[3] - [0, 0, 0, 1]).max() > 1e-6:
        raise BadInput(f"a transform's last row must be 0 0 0 1, not {T[3].tolist()}")
    R = T[:3, :3]
    error = float(np.abs(R.T @ R - np.eye(3)).max())
    if error > ROTATION_TOLERANCE:
        raise BadInput(f"not a rotation: R^T R is off the identity by {error:.3g} (is there a scale in it?)")
    if np.linalg.det(R) < 0:
        raise BadInput("not a rotation but a reflection: its determinant is -1 (is an axis mirrored?)")
    # What is exact already stays as it is, bit by bit: a box that is stored and read again is the same box.
    return from_rotation(R if error < ROUNDING else nearest_rotation(R), T[:3, 3])
