"""How large a recording is, and where a person would stand to see it.

World coordinates, metres, z up.
"""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

SAMPLES = 2000
"""How many of the frames are looked at."""

FIELD_OF_VIEW = math.radians(50)
"""Vertical, of the free camera."""

ELEVATION = math.radians(32)
ASIDE = math.radians(38)
"""The free camera starts above the recorded cameras' side of the objects, and this far round from it, so that the
path is seen from the side."""


MARGIN = 1.15
ASPECT = 1.3
"""Width over height of the window that everything should fit; wider ones have room to spare."""

CENTRINGS = 6


@dataclass(frozen=True, eq=False)
class Extent:
    """The size of a recording.

    Attributes:
        focus: (3,) what the cameras look at, or their middle where they do not look at one place.
        radius: of the sphere round `focus` that holds nearly all cameras.
        ground: z of the ground's plane.
        towards_cameras: azimuth of the cameras as seen from the focus, about z.
        frustum_depth: how deep a camera's frustum is drawn.
    """

    focus: Float[np.ndarray, "3"]
    radius: float
    ground: float
    towards_cameras: float
    frustum_depth: float


@dataclass(frozen=True, eq=False)
class Viewpoint:
    """Where the free camera stands and what it looks at, (3,) each, in the world."""

    position: Float[np.ndarray, "3"]
    look_at: Float[np.ndarray, "3"]


@dataclass(frozen=True)
class Lens:
    """The free camera's vertical field of view, radians, and the nearest and farthest that it shows, metres."""

    fov: float
    near: float
    far: float


def free_lens(extent: Extent) -> Lens:
    """The free camera's lens for a recording of this size."""
    return Lens(FIELD_OF_VIEW, near=min(0.01, 0.002 * extent.radius), far=max(1000.0, 200 * extent.radius))


def recording_extent(Ts_world_camera: Float[np.ndarray, "n 4 4"]) -> Extent:
    """The extent of a recording of at least one frame."""
    step = max(1, len(Ts_world_camera) // SAMPLES)
    Ts = Ts_world_camera[::step]
    centres, forwards = Ts[:, :3, 3], Ts[:, :3, 2]
    middle = np.median(centres, axis=0)
    spread = float(np.percentile(np.linalg.norm(centres - middle, axis=1), 95))
    ground = min(0.0, float(Ts_world_camera[:, 2, 3].min()))
    focus = _common_focus(centres, forwards, spread)
    if focus is None:
        ahead = forwards.mean(axis=0)
        focus = middle + ahead * _sight(float(middle[2]) - ground, -float(ahead[2]), spread)
    radius = max(float(np.percentile(np.linalg.norm(centres - focus, axis=1), 95)), 1e-3)
    outwards = centres.mean(axis=0)[:2] - focus[:2]
    return Extent(
        focus=focus,
        radius=radius,
        ground=ground,
        towards_cameras=math.atan2(outwards[1], outwards[0]) if np.hypot(*outwards) > 0.05 * radius else -math.pi / 2,
        frustum_depth=0.08 * radius,
    )


def _common_focus(
    centres: Float[np.ndarray, "n 3"], forwards: Float[np.ndarray, "n 3"], spread: float
) -> Float[np.ndarray, "3"] | None:
    """The point nearest to all optical axes in the least-squares sense, where most cameras do look at it.

    It solves sum (I - f f^T) (p - c) = 0.
    """
    across = np.eye(3) - forwards[:, :, None] * forwards[:, None, :]
    normal = across.mean(axis=0)
    if np.linalg.eigvalsh(normal)[0] < PARALLEL:
        return None
    point = np.linalg.solve(normal, np.einsum("nij,nj->i", across, centres) / len(centres))
    distance = np.linalg.norm(point - centres, axis=1)
    ahead = np.einsum("ni,ni->n", point - centres, forwards)
    looked_at = (ahead > LOOKED_AT * distance) & (distance < FARTHEST * spread)
    return point if looked_at.mean() > 0.7 else None


PARALLEL = 1e-5
"""The mean square of the sines between optical axes, below which they have no common point worth the name."""

LOOKED_AT = math.cos(math.radians(22))
FARTHEST = 100.0
"""What cameras look at is this near to their optical axes, and nearer than that many times the path's extent."""


def _sight(height: float, downwards: float, spread: float) -> float:
    """How far ahead of cameras, which are `height` above the ground, to expect what they were taken for.

    The ground a little below the picture's middle, but not within the path's own extent, nor ten times that far.
    """
    angle = math.asin(min(max(downwards, -1.0), 1.0)) + 0.25
    near = max(spread, 0.5 * height, 1e-3) if spread > 0 or height > 0 else 1.0
    return min(max(height / math.sin(angle), near), 10 * near) if 0 < angle < math.pi / 2 and height > 0 else near


def overview(
    extent: Extent, centres_world: Float[np.ndarray, "n 3"], corners_world: Float[np.ndarray, "m 3"]
) -> Viewpoint:
    """A three-quarter view of the whole recording, n >= 1 cameras, with its boxes, m corners, which may be none."""
    step = max(1, len(centres_world) // SAMPLES)
    sampled = centres_world[::step]
    # A camera or a box that is far away by mistake must not make everything else a dot.
    points = np.concatenate([sampled, corners_world, extent.focus[None]])
    return _three_quarter(extent, points[np.linalg.norm(points - extent.focus, axis=1) <= 3 * extent.radius])


def close_up(extent: Extent, corners_world: Float[np.ndarray, "n 3"]) -> Viewpoint:
    """A three-quarter view of one thing with its surroundings."""
    middle = corners_world.mean(axis=0)
    return _three_quarter(extent, np.concatenate([corners_world, middle + 2.0 * (corners_world - middle)]))


def behind_camera(extent: Extent, T_world_camera: Float[np.ndarray, "4 4"]) -> Viewpoint:
    """A view over the shoulder of a camera, at its frustum and what it looks at."""
    centre, (right, down, forward) = T_world_camera[:3, 3], T_world_camera[:3, :3].T
    back = centre - 5.0 * extent.frustum_depth * forward - 2.2 * extent.frustum_depth * down
    position = back + 1.4 * extent.frustum_depth * right
    return Viewpoint(position=position, look_at=centre + 2.0 * extent.frustum_depth * forward)


def _three_quarter(extent: Extent, points: Float[np.ndarray, "n 3"]) -> Viewpoint:
    """As near as all the points are seen, with a margin, in a window a little wider than high."""
    azimuth = extent.towards_cameras + ASIDE
    away = np.array(
        [math.cos(ELEVATION) * math.cos(azimuth), math.cos(ELEVATION) * math.sin(azimuth), math.sin(ELEVATION)]
    )
    right = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
    axes = np.stack([right, np.cross(away, right), away])
    half_height = math.tan(FIELD_OF_VIEW / 2) / MARGIN
    slopes = np.array([ASPECT * half_height, half_height])
    target = axes @ points.mean(axis=0)
    seen = points @ axes.T
    distance = 0.0
    for _ in range(CENTRINGS):
        around = seen - target
        distance = float((np.abs(around[:, :2]) / slopes + around[:, 2:]).max())
        # What is nearer looks larger: the middle of the picture is not that of the points.
        shown = around[:, :2] / (distance - around[:, 2:])
        target[:2] += (shown.min(axis=0) + shown.max(axis=0)) / 2 * distance
    distance = max(distance, 4 * extent.frustum_depth)
    look_at = target @ axes
    return Viewpoint(position=look_at + distance * away, look_at=look_at)
