"""A point of the world from where it is seen in two frames or more."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ars_web.errors import BadInput
from ars_web.geometry import camera as cameras
from ars_web.geometry.camera import Camera
from ars_web.geometry.projection_jacobian import pixels_with_jacobian
from ars_web.geometry.rigid_transform import Transform

MOST_STEPS = 20
"""Of Gauss and Newton. Three are usual; more where the rays are nearly parallel."""

STALLED = 1.0 - 1e-9
"""A step that leaves more than this of the squared error is the last."""

SMALLEST_ANGLE = 1e-4
"""Radians between two rays. Below it, a thousandth of a pixel moves the point by more than its distance."""


CLOSEST_PLACES = 1e-6
"""Metres. Cameras that are nearer to each other are at one place."""


@dataclass(frozen=True, eq=False)
class Observation:
    """Where a point is seen in a frame.

    Attributes:
        frame: its index, for messages.
        image: (2,) image coordinates in the original image.
    """

    frame: int
    camera: Camera
    T_world_camera: Transform
    image: Float[np.ndarray, "2"]


@dataclass(frozen=True, eq=False)
class TriangulatedPoint:
    """A point from its observations.

    Attributes:
        point_world: (3,) metres.
        residuals_px: (n,) how far from each observation the point is seen.
        angle: radians, the largest between any two of the rays.
    """

    point_world: Float[np.ndarray, "3"]
    residuals_px: Float[np.ndarray, "n"]
    angle: float


def ray_of_observation(observation: Observation) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """Where an observation's ray starts in the world, and its direction, of unit length.

    Raises:
        BadInput: the observation is not in the image, or the lens's model has no ray there.
    """
    camera, pixels = observation.camera, cameras.pixels_from_image(observation.image[None])
    u, v = observation.image.tolist()
    if not cameras.in_image(camera, pixels).all():
        raise BadInput(
            f"({u:g}, {v:g}) is not in the image of frame {observation.frame}, which is {camera.width} x"
            f" {camera.height} pixels"
        )
    normalised = cameras.normalised_from_pixels(camera, pixels)
    if np.isnan(normalised).any():
        raise BadInput(
            f"the lens's calibration does not reach ({u:g}, {v:g}) in frame {observation.frame}; choose a place nearer"
            " to the image's middle"
        )
    T = observation.T_world_camera
    direction = T[:3, :3] @ np.append(normalised[0], 1.0)
    return T[:3, 3], direction / np.linalg.norm(direction)


def triangulate(observations: Sequence[Observation]) -> TriangulatedPoint:
    """The point whose images are nearest to the observations, in the sum of squared pixels.

    Hartley and Zisserman, 12.2 and 12.3: the linear solution, then Gauss and Newton's steps on what it is off in the
    images.

    Raises:
        BadInput: fewer than two observations, an observation without a ray, rays that are parallel, or a point that is
            behind a camera or beyond what its lens shows; the message names the frame.
    """
    if len(observations) < 2:
        raise BadInput(f"a point needs to be seen in two frames at least, not {len(observations)}")
    rays = [ray_of_observation(observation) for observation in observations]
    centres, directions = np.array([centre for centre, _ in rays]), np.array([direction for _, direction in rays])
    angle = _widest_angle(directions)
    if angle < SMALLEST_ANGLE:
        raise BadInput(
            f"the rays of frames {_listed(observations)} are parallel, so that they meet nowhere; choose a frame that"
            " shows the point from another side"
        )
    if float(np.ptp(centres, axis=0).max()) < CLOSEST_PLACES:
        raise BadInput(
            f"frames {_listed(observations)} were taken at one place, so that they do not tell how far the point is;"
            " choose a frame from another side"
        )
    point = _linear(centres, directions)
    for observation, centre, direction in zip(observations, centres, directions, strict=True):
        # Written so that a point that is not finite is refused, too.
        if not (point - centre) @ direction > 0:
            raise BadInput(
                f"the rays of frames {_listed(observations)} meet behind the camera of frame {observation.frame}: the"
                " places do not belong to one point; choose them again"
            )
    return _refined(observations, point, angle)


def _listed(observations: Sequence[Observation]) -> str:
    frames = [str(observation.frame) for observation in observations]
    return f"{', '.join(frames[:-1])} and {frames[-1]}"


def _widest_angle(directions: Float[np.ndarray, "n 3"]) -> float:
    """Radians between the two directions that are furthest apart; exact for small ones, where a cosine is not."""
    apart = np.linalg.norm(directions[:, None] - directions[None], axis=-1)
    return float(2 * np.arcsin(np.minimum(apart.max() / 2, 1.0)))


def _linear(centres: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "3"]:
    """The DLT on rays: direction x (point - centre) = 0 for each, homogeneous, by its smallest singular vector.

    Metres are scaled so that the centres lie about one from their middle. With the rays of unit length instead of the
    image points of the book, rays far off a wide lens's axis count no more than others.
    """
    middle = centres.mean(axis=0)
    spread = float(np.linalg.norm(centres - middle, axis=1).max())
    moved = (centres - middle) / spread
    crossed = np.cross(directions[:, None, :], -np.eye(3)[None], axis=-1)
    rows = np.concatenate([crossed, -np.cross(directions, moved)[:, :, None]], axis=-1).reshape(-1, 4)
    x = np.linalg.svd(rows)[2][-1]
    with np.errstate(divide="ignore", invalid="ignore"):
        return middle + spread * x[:3] / x[3]


def _refined(observations: Sequence[Observation], point: Float[np.ndarray, "3"], angle: float) -> TriangulatedPoint:
    """The point moved to where its images are nearest to the observations."""
    off, jacobian = _offsets(observations, point)
    for row, observation in zip(off, observations, strict=True):
        if np.isnan(row).any():
            raise BadInput(
                f"the rays meet where the lens of frame {observation.frame} shows nothing: the places do not belong to"
                " one point; choose them again"
            )
    for _ in range(MOST_STEPS):
        step = np.linalg.lstsq(jacobian.reshape(-1, 3), -off.reshape(-1), rcond=None)[0]
        # Near the end of what the rays determine a whole step may overshoot; a part of it does not.
        for part in (1.0, 0.25, 0.0625):
            moved_off, moved_jacobian = _offsets(observations, point + part * step)
            if np.square(moved_off).sum() < STALLED * np.square(off).sum():
                point, off, jacobian = point + part * step, moved_off, moved_jacobian
                break
        else:
            break
    return TriangulatedPoint(point, np.linalg.norm(off, axis=1), angle)


def _offsets(
    observations: Sequence[Observation], point: Float[np.ndarray, "3"]
) -> tuple[Float[np.ndarray, "n 2"], Float[np.ndarray, "n 2 3"]]:
    """From each observation to the point's image, pixels, and the derivative of that by the point; NaN where the point
    has no image."""
    off, jacobian = np.empty((len(observations), 2)), np.empty((len(observations), 2, 3))
    for i, observation in enumerate(observations):
        R, centre = observation.T_world_camera[:3, :3], observation.T_world_camera[:3, 3]
        pixels, slope = pixels_with_jacobian(observation.camera, (point - centre) @ R)
        off[i] = cameras.image_from_pixels(pixels) - observation.image
        jacobian[i] = slope @ R.T
    return off, jacobian
