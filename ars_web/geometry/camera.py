"""Cameras: pinhole, Brown (k1 k2 p1 p2 k3) and OpenCV's fisheye (k1 k2 k3 k4).

Three kinds of image points occur, and only here:

`normalised`  (x/z, y/z) of a point in camera coordinates, before distortion
`pixels`      OpenCV's: a pixel's centre is at integers; what `fx, fy, cx, cy` refer to
`image`       image coordinates, `pixels + 0.5`: (0, 0) is the image's top left corner, (W, H) its bottom right

Every model is used only where it is one-to-one. A distortion polynomial folds back beyond a radius; a point out
there would be projected to a wrong place that looks right, so it is not projected at all (`valid_radius`).
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float

from ars_web.errors import BadInput

Model = Literal["pinhole", "brown", "fisheye"]

DISTORTION_NAMES: dict[Model, tuple[str, ...]] = {
    "pinhole": (),
    "brown": ("k1", "k2", "p1", "p2", "k3"),
    "fisheye": ("k1", "k2", "k3", "k4"),
}

WIDEST_ANGLE = math.radians(89.5)
"""Half the widest field of view that is labelled: beyond it z nears zero, where (x/z, y/z) has no use."""


@dataclass(frozen=True)
class Camera:
    """A camera's image size, intrinsics and distortion. Immutable and hashable.

    Attributes:
        width, height: in pixels.
        fx, fy, cx, cy: in pixels, OpenCV's convention (the top left pixel's centre is at (0, 0)).
        model: which distortion applies.
        distortion: its coefficients, in the order of DISTORTION_NAMES[model].
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    model: Model = "pinhole"
    distortion: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Raises BadInput where a number cannot be a camera's."""
        if self.model not in DISTORTION_NAMES:
            raise BadInput(f"camera model {self.model!r} is unknown; known are {', '.join(DISTORTION_NAMES)}")
        if self.width < 1 or self.height < 1:
            raise BadInput(f"a camera's image must be at least 1 x 1 pixels, not {self.width} x {self.height}")
        if not all(math.isfinite(v) for v in (self.fx, self.fy, self.cx, self.cy, *self.distortion)):
            raise BadInput(f"a camera's numbers must be finite: {self}")
        if self.fx <= 0 or self.fy <= 0:
            raise BadInput(f"focal lengths must be positive, not fx {self.fx}, fy {self.fy}")
        names = DISTORTION_NAMES[self.model]
        if len(self.distortion) != len(names):
            raise BadInput(
                f"a {self.model} camera has {len(names)} distortion coefficients ({' '.join(names) or 'none'}),"
                f" not {len(self.distortion)}"
            )

    @property
    def K(self) -> Float[np.ndarray, "3 3"]:
        """OpenCV's camera matrix."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    @cached_property
    def valid_radius(self) -> float:
        """Radius in the normalised plane up to which the distortion is one-to-one; tan(WIDEST_ANGLE) at most.

        Brown: the smallest positive root of 1 + 3 k1 r^2 + 5 k2 r^4 + 7 k3 r^6 - 6 |p| r, p = (p1, p2): where the
        slope of the radial polynomial is too small for what the tangential terms may take off it. Up to there the
        distortion's Jacobian, which is symmetric, is positive definite, and no two points meet. (1 + k1 r^2 + ...,
        the stretch across, must hold out as well.) Fisheye: the slope likewise, in the angle,
        1 + 3 k1 t^2 + 5 k2 t^4 + 7 k3 t^6 + 9 k4 t^8.
        """
        widest = math.tan(WIDEST_ANGLE)
        if self.model == "pinhole":
            return widest
        if self.model == "brown":
            k1, k2, p1, p2, k3 = self.distortion
            bent = -6 * math.hypot(p1, p2)
            along = _first_root([1.0, bent, 3 * k1, 0.0, 5 * k2, 0.0, 7 * k3])
            across = _first_root([1.0, bent, k1, 0.0, k2, 0.0, k3])
            return min(along, across, widest)
        k1, k2, k3, k4 = self.distortion
        along = _first_root([1.0, 0.0, 3 * k1, 0.0, 5 * k2, 0.0, 7 * k3, 0.0, 9 * k4])
        return math.tan(min(along, WIDEST_ANGLE))


def _first_root(coefficients: list[float]) -> float:
    """The smallest r > 0 with sum coefficients[i] r^i = 0, infinity where there is none."""
    roots = np.polynomial.polynomial.polyroots(np.trim_zeros(coefficients, "b"))
    real = roots.real[(np.abs(roots.imag) < 1e-9 * np.maximum(1.0, np.abs(roots))) & (roots.real > 0)]
    return float(real.min()) if real.size else math.inf


def image_from_pixels(pixels: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
    """Image coordinates of OpenCV pixels: the half pixel between the two conventions, added."""
    return pixels + 0.5


def pixels_from_image(image: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
    """OpenCV pixels of image coordinates: the half pixel between the two conventions, taken off."""
    return image - 0.5


def distorted_from_normalised(camera: Camera, normalised: Float[np.ndarray, "*n 2"]) -> Float[np.ndarray, "*n 2"]:
    """Where the lens moves points of the normalised plane; NaN beyond the valid radius.

    Equations: OpenCV, "Camera Calibration and 3D Reconstruction" and "Fisheye camera model".
    """
    points = normalised.reshape(-1, 2)
    x, y = points[:, 0], points[:, 1]
    r2 = x * x + y * y
    if camera.model == "pinhole":
        out = np.array(points, dtype=np.float64)
    elif camera.model == "brown":
        k1, k2, p1, p2, k3 = camera.distortion
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        out = np.stack(
            [x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y],
            axis=-1,
        )
    else:
        r = np.sqrt(r2)
        scale = np.where(r > 1e-12, _fisheye_angle(camera, np.arctan(r)) / np.maximum(r, 1e-12), 1.0)
        out = points * scale[:, None]
    out[~(r2 <= camera.valid_radius**2)] = np.nan
    return out.reshape(normalised.shape)


def _fisheye_angle(camera: Camera, theta: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
    k1, k2, k3, k4 = camera.distortion
    t2 = theta * theta
    return theta * (1 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4))))


def pixels_from_normalised(camera: Camera, normalised: Float[np.ndarray, "*n 2"]) -> Float[np.ndarray, "*n 2"]:
    """Pixels (..., 2) of points of the normalised plane; NaN beyond the valid radius."""
    return distorted_from_normalised(camera, normalised) * [camera.fx, camera.fy] + [camera.cx, camera.cy]


def pixels_from_camera_points(camera: Camera, points_camera: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 2"]:
    """Pixels (..., 2) of points (..., 3) in camera coordinates, metres; NaN behind the camera or beyond the
    valid radius."""
    z = points_camera[..., 2:]
    in_front = z[..., 0] > 0
    normalised = points_camera[..., :2] / np.where(z > 0, z, 1.0)
    pixels = pixels_from_normalised(camera, normalised)
    pixels[~in_front] = np.nan
    return pixels


def normalised_from_pixels(camera: Camera, pixels: Float[np.ndarray, "*n 2"]) -> Float[np.ndarray, "*n 2"]:
    """Points of the normalised plane (x/z, y/z) that the lens maps to the pixels; NaN where there is none.

    The radial part is inverted first, by bisection on its monotone branch, then Newton's method on both
    coordinates takes in the tangential part. The residual of what is returned is below 1e-9 in the
    normalised plane.
    """
    distorted = (np.asarray(pixels, dtype=np.float64) - [camera.cx, camera.cy]) / [camera.fx, camera.fy]
    if camera.model == "pinhole":
        out = distorted.copy()
        out[~(np.linalg.norm(out, axis=-1) <= camera.valid_radius)] = np.nan
        return out
    r_d = np.linalg.norm(distorted, axis=-1)
    r = _undistorted_radius(camera, r_d)
    out = distorted * (r / np.maximum(r_d, 1e-12))[..., None]
    if camera.model == "fisheye":
        return out
    _, _, p1, p2, _ = camera.distortion
    if p1 == 0.0 and p2 == 0.0:
        return out
    # The bisection answers NaN only where the pure radial model has no preimage; the tangential part may give
    # one just beyond, so those start from the rim.
    lost = np.isnan(out).any(axis=-1) & np.isfinite(r_d)
    out = np.where(lost[..., None], distorted * (0.999 * camera.valid_radius / np.maximum(r_d, 1e-12))[..., None], out)
    for _ in range(20):
        residual, jacobian = distorted_with_jacobian(camera, out)
        residual -= distorted
        det = jacobian[..., 0, 0] * jacobian[..., 1, 1] - jacobian[..., 0, 1] * jacobian[..., 1, 0]
        det = np.where(np.abs(det) < 1e-12, 1e-12, det)
        step_x = (jacobian[..., 1, 1] * residual[..., 0] - jacobian[..., 0, 1] * residual[..., 1]) / det
        step_y = (jacobian[..., 0, 0] * residual[..., 1] - jacobian[..., 1, 0] * residual[..., 0]) / det
        out = out - np.clip(np.stack([step_x, step_y], axis=-1), -0.1, 0.1)
        if np.max(np.abs(residual), where=np.isfinite(residual), initial=0.0) < 1e-14:
            break
    bad = ~(np.abs(distorted_from_normalised(camera, out) - distorted).max(axis=-1) < 1e-9)
    out[bad] = np.nan
    return out


def _undistorted_radius(camera: Camera, r_d: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
    """The radius (..., ) that the radial distortion maps to `r_d`; NaN beyond the model's rim."""

    def radius(r: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
        if camera.model == "fisheye":
            return _fisheye_angle(camera, r)
        k1, k2, _, _, k3 = camera.distortion
        r2 = r * r
        return r * (1 + r2 * (k1 + r2 * (k2 + r2 * k3)))

    # For the fisheye the unknown is the angle, not its tangent: well scaled up to the rim.
    rim = math.atan(camera.valid_radius) if camera.model == "fisheye" else camera.valid_radius
    low, high = np.zeros_like(r_d), np.full_like(r_d, rim)
    for _ in range(60):
        middle = 0.5 * (low + high)
        below = radius(middle) < r_d
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    r = 0.5 * (low + high)
    r = np.where(r_d <= radius(np.full_like(r_d, rim)), r, np.nan)
    return np.tan(r) if camera.model == "fisheye" else r


def distorted_with_jacobian(
    camera: Camera, normalised: Float[np.ndarray, "*n 2"]
) -> tuple[Float[np.ndarray, "*n 2"], Float[np.ndarray, "*n 2 2"]]:
    """Where the lens's equations move points (..., 2) of the normalised plane, and the derivative (..., 2, 2) of that,
    which is symmetric. The valid radius is not asked about: beyond it they are moved to where none belongs."""
    x, y = normalised[..., 0], normalised[..., 1]
    r2 = x * x + y * y
    if camera.model == "pinhole":
        value = np.array(normalised, dtype=np.float64)
        along_x, along_y, cross = np.ones_like(x), np.ones_like(x), np.zeros_like(x)
    elif camera.model == "brown":
        k1, k2, p1, p2, k3 = camera.distortion
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        slope = 2 * (k1 + r2 * (2 * k2 + r2 * 3 * k3))  # d radial / d r2, times 2
        value = np.stack(
            [x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y],
            axis=-1,
        )
        along_x = radial + x * x * slope + 2 * p1 * y + 6 * p2 * x
        along_y = radial + y * y * slope + 6 * p1 * y + 2 * p2 * x
        cross = x * y * slope + 2 * p1 * x + 2 * p2 * y
    else:
        k1, k2, k3, k4 = camera.distortion
        r = np.sqrt(r2)
        theta = np.arctan(r)
        t2 = theta * theta
        far = r > 1e-12
        across = np.where(far, _fisheye_angle(camera, theta) / np.where(far, r, 1.0), 1.0)
        outwards = (1 + t2 * (3 * k1 + t2 * (5 * k2 + t2 * (7 * k3 + t2 * 9 * k4)))) / (1 + r2)
        # Stretched by `outwards` along the radius and by `across` at right angles to it.
        more = np.where(far, (outwards - across) / np.where(far, r2, 1.0), 0.0)
        value = normalised * across[..., None]
        along_x, along_y, cross = across + more * x * x, across + more * y * y, more * x * y
    jacobian = np.stack([np.stack([along_x, cross], axis=-1), np.stack([cross, along_y], axis=-1)], axis=-2)
    return value, jacobian


def image_border_pixels(camera: Camera, *, samples: int = 64) -> Float[np.ndarray, "n 2"]:
    """Pixels (4 * samples, 2) along the image's border, its corners included, clockwise from the top left."""
    W, H = float(camera.width), float(camera.height)
    t = np.linspace(0.0, 1.0, samples, endpoint=False)[:, None]
    corners = np.array([[0.0, 0.0], [W, 0.0], [W, H], [0.0, H]])
    sides = [corners[i] + t * (corners[(i + 1) % 4] - corners[i]) for i in range(4)]
    return pixels_from_image(np.concatenate(sides))


def in_image(camera: Camera, pixels: Float[np.ndarray, "*n 2"]) -> Bool[np.ndarray, "*n"]:
    """Whether pixels lie on the image, its border included; NaN does not."""
    u, v = pixels[..., 0], pixels[..., 1]
    return (u >= -0.5) & (u <= camera.width - 0.5) & (v >= -0.5) & (v <= camera.height - 0.5)


WIDEST_RECTIFIED_ANGLE = math.radians(60)
"""A rectified image of a wider view would be nearly all stretched border."""


def rectified(camera: Camera) -> Camera:
    """The pinhole camera of the same size and position that shows as much of the image as it can without a
    pixel that the original has not seen.

    That is the largest axis-parallel rectangle within the undistorted border, each side at most
    WIDEST_RECTIFIED_ANGLE off the optical axis, its corners within the valid radius.

    Raises:
        BadInput: there is none, because the principal point is far outside the image.
    """
    if camera.model == "pinhole":
        return camera
    sides = normalised_from_pixels(camera, image_border_pixels(camera, samples=256)).reshape(4, -1, 2)
    # Each side with the corner at its end, which is the first point of the next.
    top, right, bottom, left = (np.concatenate([sides[i], sides[(i + 1) % 4, :1]]) for i in range(4))
    widest = math.tan(WIDEST_RECTIFIED_ANGLE)
    # Where a side's ray does not exist, the image reaches beyond the widest angle there.
    x0, y0 = _innermost(left[:, 0], limit=-widest), _innermost(top[:, 1], limit=-widest)
    x1, y1 = -_innermost(-right[:, 0], limit=-widest), -_innermost(-bottom[:, 1], limit=-widest)
    corner = math.hypot(max(-x0, x1), max(-y0, y1))
    shrink = min(1.0, 0.999 * camera.valid_radius / corner)
    x0, x1, y0, y1 = (shrink * side for side in (x0, x1, y0, y1))
    if x0 < x1 and y0 < y1:
        fx, fy = camera.width / (x1 - x0), camera.height / (y1 - y0)
        flat = Camera(camera.width, camera.height, fx, fy, -0.5 - fx * x0, -0.5 - fy * y0)
        border = pixels_from_normalised(camera, normalised_from_pixels(flat, image_border_pixels(flat)))
        half = np.array([camera.width, camera.height]) / 2
        if (np.abs(image_from_pixels(border) - half) < half + 0.1).all():
            return flat
    raise BadInput(f"no rectified image can be cut out of this camera's: {camera}")


def _innermost(side: Float[np.ndarray, "n"], *, limit: float) -> float:
    """The largest finite coordinate along the left (or top) side, but no further out than `limit`."""
    return max(float(np.max(side, where=np.isfinite(side), initial=-np.inf)), limit)
