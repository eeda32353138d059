"""A camera made ready for the compiled loops: its numbers, and how much it bends straight lines where."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float

from ars_web.geometry import camera as cameras
from ars_web.geometry.camera import Camera
from ars_web.geometry.lens_kernels import Lens

BINS = 256
"""Of the bend tables, evenly spread over the logarithm of the radius, from rim * RADIUS_RANGE to the rim."""

RADIUS_RANGE = 1e-5

BEND_MARGIN = 1.1
"""The bounds come from samples; between two of them the bend is larger by less than this."""


@dataclass(frozen=True, eq=False)
class LensTables:
    """A camera as `lens_kernels` reads it.

    Attributes:
        lens: its numbers.
        bends: (2, BINS) bounds on the second derivative of the lens, in pixels: over radii up to the end of a bin,
            and over radii from its start to the rim. Bin i ends at rim * exp((i + 1 - BINS) / lens.bins_per_e).
        image_corners: (4, 2) the image's corners (0, 0), (W, 0), (0, H), (W, H) in the normalised plane, NaN where
            no ray of the lens ends in one.
    """

    lens: Lens
    bends: Float[np.ndarray, "2 bins"]
    image_corners: Float[np.ndarray, "4 2"]


@lru_cache(maxsize=64)
def lens_tables(camera: Camera) -> LensTables:
    """The camera made ready; kept for the next call."""
    centre = cameras.image_from_pixels(np.array([camera.cx, camera.cy]))
    width, height = float(camera.width), float(camera.height)
    corners = np.array([[0.0, 0.0], [width, 0.0], [0.0, height], [width, height]])
    k1, k2, k3, k4, p1, p2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if camera.model == "brown":
        k1, k2, p1, p2, k3 = camera.distortion
    elif camera.model == "fisheye":
        k1, k2, k3, k4 = camera.distortion
    scale = max(camera.fx, camera.fy)
    lens = Lens(
        fisheye=camera.model == "fisheye",
        width=width,
        height=height,
        fx=float(camera.fx),
        fy=float(camera.fy),
        cx=float(centre[0]),
        cy=float(centre[1]),
        k1=float(k1),
        k2=float(k2),
        k3=float(k3),
        k4=float(k4),
        p1=float(p1),
        p2=float(p2),
        rim=camera.valid_radius,
        rim_bend=scale * _rim_bend(camera),
        bins_per_e=BINS / -math.log(RADIUS_RANGE),
    )
    bends = scale * _bends_in_bins(camera)
    return LensTables(
        lens,
        np.stack([np.maximum.accumulate(bends), np.maximum.accumulate(bends[::-1])[::-1]]),
        np.ascontiguousarray(cameras.normalised_from_pixels(camera, cameras.pixels_from_image(corners))),
    )


def _bends_in_bins(camera: Camera) -> Float[np.ndarray, "bins"]:
    """Bound on the second derivative of the distorted point along any straight line, over each bin of radii."""
    samples = 8
    steps = np.linspace(0.0, 1.0, BINS * samples + 1)
    radii = camera.valid_radius * RADIUS_RANGE ** (1.0 - steps)
    bend = _bend(camera, radii)
    within = np.stack([bend[i : i + BINS * samples : samples] for i in range(samples + 1)])
    return BEND_MARGIN * within.max(axis=0)


def _bend(camera: Camera, r: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
    """Largest length of the second derivative of f(x) = x g(|x|) at radius r over all directions.

    With rho(r) = r g(r) and a direction at the angle a to the radius, its radial part is
    cos^2 a rho'' + sin^2 a g' and its tangential part 2 sin a cos a g'. Brown's tangential terms add at most 6 |p|.
    """
    _, slope, second = _radial(camera, r)
    g_slope = slope / r - _radial(camera, r)[0] / r**2
    if camera.model != "fisheye":
        # rho / r - rho' is a difference of two numbers near 1, so the polynomial's own derivative is taken.
        k1, k2, k3 = _brown_radial(camera)
        g_slope = 2 * r * (k1 + r**2 * (2 * k2 + r**2 * 3 * k3))
    angle = np.linspace(0.0, np.pi / 2, 33)[:, None]
    c, s = np.cos(angle), np.sin(angle)
    return np.hypot(c * c * second + s * s * g_slope, 2 * s * c * g_slope).max(axis=0) + 6 * _tangential(camera)


def _rim_bend(camera: Camera) -> float:
    """Bound on the second derivative of the distorted rim by its angle: |f''| r^2 + |f'| r."""
    r = np.array([camera.valid_radius])
    rho, slope, _ = _radial(camera, r)
    stretch = np.maximum(np.abs(rho / r), np.abs(slope)) + 6 * _tangential(camera) * r
    return float((_bend(camera, r) * r**2 + stretch * r)[0])


def _radial(
    camera: Camera, r: Float[np.ndarray, "n"]
) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"], Float[np.ndarray, "n"]]:
    """The distorted radius of undistorted radii, and its first and second derivative."""
    if camera.model == "fisheye":
        theta, cos2 = np.arctan(r), 1.0 / (1.0 + r * r)
        polynomial = np.polynomial.Polynomial([0.0, 1.0, *np.ravel([[0.0, k] for k in camera.distortion])])
        slope = polynomial.deriv()(theta)
        return polynomial(theta), slope * cos2, (polynomial.deriv(2)(theta) - 2 * r * slope) * cos2**2
    k1, k2, k3 = _brown_radial(camera)
    polynomial = np.polynomial.Polynomial([0.0, 1.0, 0.0, k1, 0.0, k2, 0.0, k3])
    return polynomial(r), polynomial.deriv()(r), polynomial.deriv(2)(r)


def _brown_radial(camera: Camera) -> tuple[float, float, float]:
    """k1, k2, k3; zeros for a pinhole."""
    return (camera.distortion[0], camera.distortion[1], camera.distortion[4]) if camera.distortion else (0.0, 0.0, 0.0)


def _tangential(camera: Camera) -> float:
    """The length of (p1, p2)."""
    return math.hypot(camera.distortion[2], camera.distortion[3]) if camera.model == "brown" else 0.0
