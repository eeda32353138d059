"""A camera made ready for the compiled loops: its numbers, and how much it bends straight lines where."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float, Int

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
        bends: (3, BINS) bounds on the second derivative of a straight line's image, in pixels: across its chords,
            over radii up to the end of a bin; the same over radii from its start to the rim; in any direction, over
            radii up to its end. Bin i ends at rim * exp((i + 1 - BINS) / lens.bins_per_e).
    """

    lens: Lens
    bends: Float[np.ndarray, "3 bins"]

    def bends_within(self, radii: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
        """Bounds on the second derivative of a straight line's image in any direction, for lines within these radii."""
        return self.bends[2, self._bins(radii)]

    def bends_across_within(self, radii: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
        """The same across the chords of the image."""
        return self.bends[0, self._bins(radii)]

    def _bins(self, radii: Float[np.ndarray, "n"]) -> Int[np.ndarray, "n"]:
        place = BINS + np.log(np.maximum(radii, 1e-30) / self.lens.rim) * self.lens.bins_per_e
        return np.clip(np.floor(place), 0, BINS - 1).astype(np.int64)


@lru_cache(maxsize=64)
def lens_tables(camera: Camera) -> LensTables:
    """The camera made ready; kept for the next call."""
    centre = cameras.image_from_pixels(np.array([camera.cx, camera.cy]))
    width, height = float(camera.width), float(camera.height)
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
    return LensTables(lens, np.ascontiguousarray(scale * _bends_in_bins(camera)))


def _bends_in_bins(camera: Camera) -> Float[np.ndarray, "3 bins"]:
    """The bounds of `LensTables.bends`, in the normalised plane.

    With f(x) = x g(|x|) and a direction d, f'' = 2 g' cos(a) d + (g' sin^2 a + r g'' cos^2 a) e, where e is the radial
    direction and a its angle to d. So |f''| <= 3 G with G = max(|g'|, |r g''|), and across a chord that is turned from
    d by the angle b it is at most (1 + 3 sin b) G. The two stretches of f, rho' and g, turn no direction by more than
    sin b = |rho' - g| / (rho' + g). Brown's tangential terms add at most 6 |p| to f'', and 8 |p| r to rho' - g.
    """
    samples = 8
    r = camera.valid_radius * RADIUS_RANGE ** (1.0 - np.linspace(0.0, 1.0, BINS * samples + 1))
    g, g_slope, g_second = _radial(camera, r)
    rho_slope, shear = g + r * g_slope, 8 * _tangential(camera) * r
    turn = np.abs(rho_slope - g) + shear
    turn = turn / np.maximum(rho_slope + g - shear, turn)
    steepest, turn = _largest_in_bins(np.maximum(np.abs(g_slope), np.abs(r * g_second))), _largest_in_bins(turn)
    bounds = [
        _up_to(steepest) * (1 + 3 * _up_to(turn)),
        _from_on(steepest) * (1 + 3 * _from_on(turn)),
        3 * _up_to(steepest),
    ]
    return BEND_MARGIN * np.stack(bounds) + 6 * _tangential(camera)


def _largest_in_bins(samples: Float[np.ndarray, "n"]) -> Float[np.ndarray, "bins"]:
    """The largest sample of each bin, both its ends included."""
    each = (len(samples) - 1) // BINS
    return np.stack([samples[i : i + BINS * each : each] for i in range(each + 1)]).max(axis=0)


def _up_to(bins: Float[np.ndarray, "bins"]) -> Float[np.ndarray, "bins"]:
    return np.maximum.accumulate(bins)


def _from_on(bins: Float[np.ndarray, "bins"]) -> Float[np.ndarray, "bins"]:
    return np.maximum.accumulate(bins[::-1])[::-1]


def _rim_bend(camera: Camera) -> float:
    """Bound on the second derivative of the distorted rim by its angle, in the normalised plane.

    Without tangential terms the rim's image is a circle of radius r g(r). They add (p2, p1) r^2, which is constant,
    and 2 x ((p2, p1) . x), which turns twice as fast as x: 4 times |p| r^2, twice.
    """
    r = camera.valid_radius
    g, _, _ = _radial(camera, np.array([r]))
    return float(r * g[0] + 8 * _tangential(camera) * r**2)


def _radial(
    camera: Camera, r: Float[np.ndarray, "n"]
) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"], Float[np.ndarray, "n"]]:
    """g(r), the factor by which the lens moves a point at the radius r, and its first two derivatives by r."""
    if camera.model == "fisheye":
        k1, k2, k3, k4 = camera.distortion
        theta, cos2 = np.arctan(r), 1.0 / (1.0 + r * r)
        polynomial = np.polynomial.Polynomial([0.0, 1.0, 0.0, k1, 0.0, k2, 0.0, k3, 0.0, k4])
        g, slope = polynomial(theta) / r, polynomial.deriv()(theta)
        g_slope = (slope * cos2 - g) / r
        return g, g_slope, ((polynomial.deriv(2)(theta) - 2 * r * slope) * cos2**2 - 2 * g_slope) / r
    k1, k2, _, _, k3 = camera.distortion or (0.0, 0.0, 0.0, 0.0, 0.0)
    g = np.polynomial.Polynomial([1.0, 0.0, k1, 0.0, k2, 0.0, k3])
    return g(r), g.deriv()(r), g.deriv(2)(r)


def _tangential(camera: Camera) -> float:
    """The length of (p1, p2)."""
    return math.hypot(camera.distortion[2], camera.distortion[3]) if camera.model == "brown" else 0.0
