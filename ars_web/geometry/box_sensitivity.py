"""In which frames an error of a box would show most: how the drawn corners move with the box.

A box has nine parameters, all counted as lengths: three of position along its own axes, three of rotation about them,
an angle counting as the way that it moves a corner half a diagonal away, and three of size. A corner tells something
where it is before the camera, in the image and not behind the box itself.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from ars_web.errors import BadInput
from ars_web.geometry import camera as cameras
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import CORNER_SIGNS, Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.labels import NEAR
from ars_web.geometry.projection_jacobian import pixels_with_jacobian

PARAMETERS = 9

ENOUGH_CORNERS = 4
"""That a chosen frame shows, where there are frames enough that do: of what is nearly out of the image, or mostly
hidden by itself, a person sees too little to judge, however near it is."""

APART = math.radians(10)
"""Between the sides from which chosen frames show a box. Two frames from one side are off by much the same, as their
poses are, and a person sees the same in both."""

CLOSEST = 1e-3
"""Radians between sides that count as two; its cosine is still one of its own."""

BATCH = 256
"""Frames whose worth is looked at anew at once."""


@dataclass(frozen=True, eq=False)
class TellingFrame:
    """A frame that shows errors of a box.

    Attributes:
        frame: its index.
        px_per_metre: how far a corner of the box that is off is drawn from where it should be: the corner and the
            direction that show it most.
    """

    frame: int
    px_per_metre: float


@dataclass(frozen=True, eq=False)
class CornerSlopes:
    """How a box's corners are drawn in n frames of one camera.

    Attributes:
        seen: (n, 8) whether a corner is before the camera, in the image and not behind the box itself.
        by_place: (n, 8, 2, 3) how its pixel moves with the corner along the box's axes, px per metre; 0 where it is
            not seen.
    """

    seen: Bool[np.ndarray, "n 8"]
    by_place: Float[np.ndarray, "n 8 2 3"]


def telling_frames(
    by_id: Mapping[int, Camera],
    camera_ids: Int[np.ndarray, "n"],
    Ts_world_camera: Float[np.ndarray, "n 4 4"],
    box: Box,
    *,
    count: int,
) -> list[TellingFrame]:
    """At most `count` frames that together leave no error of the box unseen, the most telling first; fewer where fewer
    frames show a corner of it.

    Raises:
        BadInput: `count` is below 1.
    """
    if count < 1:
        raise BadInput(f"at least 1 frame must be asked for, not {count}")
    found = [
        (rows, corner_slopes(by_id[camera_id], Ts_world_camera[rows], box))
        for camera_id in np.unique(camera_ids).tolist()
        for rows in [np.flatnonzero(camera_ids == camera_id)]
    ]
    corners = np.bincount(np.concatenate([slopes.seen.sum(axis=1) for _, slopes in found]), minlength=9)
    enough = [least for least in range(1, ENOUGH_CORNERS + 1) if corners[least:].sum() >= count]
    shown = [slopes.seen.sum(axis=1) >= max(enough, default=1) for _, slopes in found]
    frames = np.concatenate([rows[some] for (rows, _), some in zip(found, shown, strict=True)])
    matrices = np.concatenate(
        [
            information(CornerSlopes(slopes.seen[some], slopes.by_place[some]), box)
            for (_, slopes), some in zip(found, shown, strict=True)
        ]
    )
    towards = Ts_world_camera[frames, :3, 3] - box.T_world_box[:3, 3]
    sides = towards / np.linalg.norm(towards, axis=1, keepdims=True)
    chosen = [int(frames[i]) for i in most_informative(matrices, prior(box), sides, count=count)]
    return [
        TellingFrame(i, largest_slope(corner_slopes(by_id[int(camera_ids[i])], Ts_world_camera[i][None], box)))
        for i in chosen
    ]


def corner_slopes(camera: Camera, Ts_world_camera: Float[np.ndarray, "n 4 4"], box: Box) -> CornerSlopes:
    """How the box's corners are drawn in frames of one camera."""
    Ts_camera_box = rigid_transform.invert(Ts_world_camera) @ box.T_world_box
    corners_camera = rigid_transform.transform_points(Ts_camera_box, CORNER_SIGNS * box.size / 2)
    corners_camera[corners_camera[..., 2] < NEAR] = np.nan
    pixels, jacobian = pixels_with_jacobian(camera, corners_camera)
    seen = cameras.in_image(camera, pixels) & _before_the_box(Ts_camera_box, box)
    by_place = jacobian.reshape(-1, 16, 3) @ Ts_camera_box[:, :3, :3]
    return CornerSlopes(seen, np.where(seen[..., None, None], by_place.reshape(-1, 8, 2, 3), 0.0))


def _before_the_box(Ts_camera_box: Float[np.ndarray, "n 4 4"], box: Box) -> Bool[np.ndarray, "n 8"]:
    """Whether the camera is on the outer side of one of the three faces that meet at a corner."""
    centres_box = -np.einsum("nji,nj->ni", Ts_camera_box[:, :3, :3], Ts_camera_box[:, :3, 3])
    return (centres_box[:, None, :] * CORNER_SIGNS > box.size / 2).any(axis=2)


def parameter_moves(box: Box) -> Float[np.ndarray, "8 3 9"]:
    """How each corner moves along the box's axes with each of the nine parameters; all are lengths."""
    corners = CORNER_SIGNS * box.size / 2
    half_diagonal = float(np.linalg.norm(box.size)) / 2
    turned = np.cross(np.eye(3)[None], corners[:, None, :]) / half_diagonal
    return np.concatenate(
        [
            np.broadcast_to(np.eye(3), (8, 3, 3)),
            np.swapaxes(turned, 1, 2),
            CORNER_SIGNS[:, :, None] * np.eye(3) / 2,
        ],
        axis=2,
    )


def information(slopes: CornerSlopes, box: Box) -> Float[np.ndarray, "n 9 9"]:
    """What each frame tells about the nine parameters, (px / m)^2: the sum over its corners of J^T J, where J (2, 9) is
    how a corner's pixel moves with the parameters.

    With J = G D, G the corner's slope and D its moves, that is the sum of D^T (G^T G) D. It is linear in the entries of
    G^T G, so that all frames are done by one product of matrices.
    """
    moves = parameter_moves(box)
    squares = np.einsum("nkra,nkrb->nkab", slopes.by_place, slopes.by_place)
    each = np.einsum("kai,kbj->kabij", moves, moves)
    n = len(squares)
    return (squares.reshape(n, 72) @ each.reshape(72, PARAMETERS**2)).reshape(n, PARAMETERS, PARAMETERS)


def prior(box: Box) -> Float[np.ndarray, "9 9"]:
    """What is known before any frame is looked at: each parameter to half a diagonal, where a corner is seen to a
    pixel."""
    return np.eye(PARAMETERS) * (2 / float(np.linalg.norm(box.size))) ** 2


def most_informative(
    matrices: Float[np.ndarray, "n 9 9"],
    known: Float[np.ndarray, "9 9"],
    sides: Float[np.ndarray, "n 3"],
    *,
    count: int,
    apart: float = APART,
) -> list[int]:
    """At most `count` rows, one after the other the one that with those before it makes the determinant of all that is
    known largest (greedy D-optimality; Joshi and Boyd 2009, "Sensor selection via convex optimization").

    Rows whose `sides`, of unit length, are less than `apart` radians from a chosen one's are left out, or, where then
    there are not enough, those less than half of that, and so on.

    What a row adds to the logarithm only shrinks as more is known, so what it added before bounds what it adds now,
    and few rows need be looked at anew (Minoux 1978, "Accelerated greedy algorithms").
    """
    chosen: list[int] = []
    bounds = np.full(len(matrices), np.inf)
    while len(chosen) < min(count, len(matrices)):
        cosine = np.cos(apart) if apart > 0 else np.inf
        free = np.all(sides @ sides[chosen].T < cosine, axis=1)
        rows = np.flatnonzero(free & (bounds > -np.inf))
        if len(rows) == 0:
            apart = apart / 2 if apart > CLOSEST else 0.0
            continue
        before = np.linalg.slogdet(known)[1]
        rows = rows[np.argsort(-bounds[rows], kind="stable")]
        batch = BATCH if chosen else len(rows)
        best = -1
        for first in range(0, len(rows), batch):
            some = rows[first : first + batch]
            if best >= 0 and bounds[some[0]] <= bounds[best]:
                break
            bounds[some] = np.linalg.slogdet(known + matrices[some])[1] - before
            top = int(some[np.argmax(bounds[some])])
            best = top if best < 0 or bounds[top] > bounds[best] else best
        chosen.append(best)
        known = known + matrices[best]
        bounds[best] = -np.inf
    return chosen


def largest_slope(slopes: CornerSlopes) -> float:
    """The most that a corner moves in the image as it moves in the world, px per metre: the largest singular value."""
    return float(np.linalg.svd(slopes.by_place.reshape(-1, 2, 3), compute_uv=False).max())
