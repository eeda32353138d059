"""Where a camera may be when it looks at objects: upright poses, and limits on distance, height and tilt."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from ars_web.errors import BadInput
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import FARTHEST, Box

CLEARANCE = 0.05
"""Metres that a camera stays away from boxes."""

HALF_SEEN = 0.5
"""Share of an object that a view shows at least, where nobody says more."""

_POLE = 1e-9
"""Of a viewing direction of unit length: a horizontal part that is none."""

_TURNED, _LEVEL = 0.05, 0.1
"""Mean squares: of how far the x axes of images leave one line at least, where cameras look many ways; and, as a share
of it, of how far they leave one plane at most, where they are held level."""

Range = tuple[float, float]
LimitName = Literal["distance", "height", "tilt"]


@dataclass(frozen=True)
class ViewLimits:
    """What a view must keep to.

    Attributes:
        distance: metres from the camera to the centre of the object looked at.
        height: z of the camera in the world, metres.
        tilt: of the camera's axis below the horizontal, radians; pi / 2 looks straight down.
        min_visible: share of an object that nothing nearer hides.
        clearance: metres from the camera to the nearest box.
    """

    distance: Range
    height: Range
    tilt: Range
    min_visible: float = HALF_SEEN
    clearance: float = CLEARANCE

    def __post_init__(self) -> None:
        """Raises BadInput for limits that nothing can keep to."""
        check_range("distance", self.distance)
        check_range("height", self.height)
        check_range("tilt", self.tilt)
        if not 0.0 <= self.min_visible <= 1.0:
            raise BadInput(f"the share that must be visible is from 0 to 1, not {self.min_visible}")
        if not (math.isfinite(self.clearance) and self.clearance >= 0):
            raise BadInput(f"the clearance must be 0 m or more, not {self.clearance}")


def check_range(name: LimitName, limits: Range) -> None:
    """Raises BadInput where nothing can keep to the limits of that name; a tilt is said in degrees, as people think of
    it."""
    unit = "metres" if name != "tilt" else "degrees"
    low, high = limits if name != "tilt" else (math.degrees(limits[0]), math.degrees(limits[1]))
    if not (math.isfinite(low) and math.isfinite(high)):
        raise BadInput(f"the limits of {name} must be finite numbers of {unit}, not {low:g} and {high:g}")
    if name == "tilt" and (low < -90.0 - 1e-7 or high > 90.0 + 1e-7):
        raise BadInput(f"a tilt lies between -90 degrees, straight up, and 90, straight down, not {low:g} to {high:g}")
    if max(abs(low), abs(high)) > FARTHEST:
        raise BadInput(f"the limits of {name} must be within {FARTHEST:g} {unit}, not {low:g} and {high:g}")
    if low > high:
        raise BadInput(f"the limits of {name} are the wrong way round: {low:g} is more than {high:g} {unit}")
    if name == "distance" and (low < 0 or high <= 0):
        raise BadInput(f"a distance must be more than 0 m, not {low:g} to {high:g}")


def looking_at(
    eyes_world: Float[np.ndarray, "m 3"], targets_world: Float[np.ndarray, "m 3"]
) -> Float[np.ndarray, "m 4 4"]:
    """`Ts_world_camera` (m, 4, 4) of upright cameras that have their targets on their axes.

    The image's x is horizontal and the world's z points up in the image. Looking straight up or down, the image's x
    runs along the world's. A target must not lie at its eye.
    """
    forward = targets_world - eyes_world
    forward = forward / np.linalg.norm(forward, axis=1, keepdims=True)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    level = np.linalg.norm(right, axis=1, keepdims=True)
    right = np.where(level > _POLE, right / np.maximum(level, _POLE), [1.0, 0.0, 0.0])
    down = np.cross(forward, right)
    down /= np.linalg.norm(down, axis=1, keepdims=True)
    return rigid_transform.from_rotation(np.stack([right, down, forward], axis=-1), eyes_world)


def tilts_of(Ts_world_camera: Float[np.ndarray, "m 4 4"]) -> Float[np.ndarray, "m"]:
    """How far each camera's axis points below the horizontal, radians."""
    return np.arcsin(np.clip(-Ts_world_camera[:, 2, 2], -1.0, 1.0))


def lean_of_world(Ts_world_camera: Float[np.ndarray, "n 4 4"]) -> float:
    """By how much the axis about which cameras are level is off the world's z, radians in [0, pi / 2].

    Cameras that are held level have the x of their images across what is up, whichever way they look. Where they look
    too few ways to tell, or are not held level, 0: then nothing speaks against z.
    """
    across = Ts_world_camera[:, :3, 0]
    spread, axes = np.linalg.eigh(across.T @ across / max(len(across), 1))
    if spread[1] < _TURNED or spread[0] > _LEVEL * spread[1]:
        return 0.0
    return float(np.arccos(min(abs(axes[2, 0]), 1.0)))


def check_room(limits: ViewLimits, boxes: Sequence[Box]) -> None:
    """Raises BadInput where no camera within the limits can look at any of the boxes, one or more; it says which limit
    is at fault, and what it would have to be."""
    (near, far), (low, high) = limits.distance, limits.height
    centres = np.array([box.T_world_box[2, 3] for box in boxes])
    # The camera is as high above the box as its tilt and its distance say.
    rises = np.sin(np.array(limits.tilt))
    products = [rise * distance for rise in rises for distance in (near, far)]
    lowest, highest = centres + min(products), centres + max(products)
    if ((lowest <= high) & (highest >= low)).any():
        return
    anywhere = ((centres - far <= high) & (centres + far >= low)).any()
    if not anywhere:
        raise BadInput(
            f"no camera is {low:.3g} to {high:.3g} m high and within {far:.3g} m of an object: their centres are at"
            f" heights of {centres.min():.3g} to {centres.max():.3g} m. Change the limits of height, or allow more"
            " distance"
        )
    tilts = [math.degrees(angle) for angle in limits.tilt]
    raise BadInput(
        f"tilts of {tilts[0]:.3g} to {tilts[1]:.3g} degrees at distances of {near:.3g} to {far:.3g} m put the camera"
        f" {lowest.min():.3g} to {highest.max():.3g} m high, and the limits of height are {low:.3g} to {high:.3g} m."
        " Widen one of the three"
    )
