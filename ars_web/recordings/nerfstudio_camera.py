"""The camera that a `transforms.json` gives: for all frames, for one of them, or half and half."""

import math

import numpy as np
from pydantic import BaseModel, ConfigDict

from ars_web.errors import BadInput
from ars_web.geometry.camera import Camera, pixels_from_image
from ars_web.recordings.intrinsics import camera_from

# All of these are one model with some coefficients zero: nerfstudio reads k1 k2 p1 p2 k3 whichever is named.
_PERSPECTIVE = ("OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "RADIAL", "SIMPLE_RADIAL", "PERSPECTIVE")
_FISHEYE = ("OPENCV_FISHEYE", "FISHEYE")


class Intrinsics(BaseModel):
    """The names that may stand beside `frames`, in each frame, or in both, where the frame's own count."""

    model_config = ConfigDict(extra="ignore", frozen=True)

    w: float | None = None
    h: float | None = None
    fl_x: float | None = None
    fl_y: float | None = None
    cx: float | None = None
    cy: float | None = None
    camera_angle_x: float | None = None
    camera_angle_y: float | None = None
    camera_model: str | None = None
    is_fisheye: bool | None = None
    k1: float | None = None
    k2: float | None = None
    k3: float | None = None
    k4: float | None = None
    p1: float | None = None
    p2: float | None = None

    def overridden(self, frame: "Intrinsics") -> "Intrinsics":
        """These, but the frame's own where it has any."""
        own = {name: getattr(frame, name) for name in frame.model_fields_set & _NAMES}
        given = {name: value for name, value in own.items() if value is not None}
        return self.model_copy(update=given) if given else self

    def key(self) -> tuple[object, ...]:
        """What tells one camera from another."""
        return tuple(getattr(self, name) for name in Intrinsics.model_fields)

    def size(self) -> tuple[float, float] | None:
        """Width and height, where both are given."""
        return None if self.w is None or self.h is None else (self.w, self.h)


_NAMES = frozenset(Intrinsics.model_fields)


def camera_of(given: Intrinsics, size: tuple[float, float]) -> Camera:
    """Our camera.

    Raises:
        BadInput: there is no focal length, the model cannot be expressed, or a number cannot be a camera's.
    """
    width, height = size
    fx = given.fl_x if given.fl_x is not None else _focal(given.camera_angle_x, width)
    if fx is None:
        raise BadInput("there is neither fl_x nor camera_angle_x")
    fy = given.fl_y if given.fl_y is not None else _focal(given.camera_angle_y, height)
    # Without a principal point it is the image's middle, in nerfstudio's own reader too.
    middle = np.array([width / 2 if given.cx is None else given.cx, height / 2 if given.cy is None else given.cy])
    cx, cy = pixels_from_image(middle).tolist()
    k1, k2, k3, k4, p1, p2 = (value or 0.0 for value in (given.k1, given.k2, given.k3, given.k4, given.p1, given.p2))
    name = given.camera_model or ("OPENCV_FISHEYE" if given.is_fisheye else "OPENCV")
    focal, centre = (fx, fx if fy is None else fy), (cx, cy)
    if name in _FISHEYE:
        if p1 or p2:
            raise BadInput(f"a fisheye camera with p1 {p1:g} and p2 {p2:g} cannot be expressed exactly")
        return camera_from(
            width, height, focal=focal, centre_pixels=centre, model="fisheye", distortion=(k1, k2, k3, k4)
        )
    if name not in _PERSPECTIVE:
        raise BadInput(
            f"camera_model {name!r} cannot be expressed exactly; known are {', '.join(_PERSPECTIVE + _FISHEYE)}"
        )
    if k4:
        raise BadInput(f"an {name} camera with k4 {k4:g} cannot be expressed exactly")
    return camera_from(width, height, focal=focal, centre_pixels=centre, model="brown", distortion=(k1, k2, p1, p2, k3))


def _focal(angle: float | None, length: float) -> float | None:
    """The focal length by which `length` pixels span `angle` radians."""
    if angle is None:
        return None
    if not 0 < angle < math.pi:
        raise BadInput(f"a camera angle must be between 0 and pi radians, not {angle:g}")
    return length / (2 * math.tan(angle / 2))
