"""Frames and their truth, pixel by pixel: which object each pixel's centre sees, and what colour it has."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int16, Shaped, UInt8

from ars_web.demo import noise
from ars_web.demo.compiled import compiled, copied_in
from ars_web.demo.shading import UNKNOWN, colour_along
from ars_web.demo.shapes import MISS, Vector, dot, unit
from ars_web.demo.world import World, enter_part, from_middle
from ars_web.geometry.camera import Camera, normalised_from_pixels
from ars_web.geometry.rigid_transform import Transform

SUBPIXELS = 3
"""A pixel on an edge is the mean of so many by so many rays."""


def ray_table(camera: Camera) -> Float[np.ndarray, "h w 2"]:
    """(x/z, y/z) of the ray through every pixel's centre."""
    u, v = np.meshgrid(np.arange(camera.width, dtype=np.float64), np.arange(camera.height, dtype=np.float64))
    return normalised_from_pixels(camera, np.stack([u, v], axis=-1))


def compile_kernels(world: World) -> None:
    """Compile what `look` and `paint` run, by a picture of no use: done while the light is baked."""
    rays = np.zeros((2, 2, 2))
    paint(world, rays, np.eye(4), look(world.parts, rays, np.eye(4)), seed=0)


@dataclass(frozen=True, eq=False)
class Sight:
    """What each pixel's centre sees.

    Attributes:
        objects: (h, w) index of the object, -1 for none.
        surfaces: (h, w) number of the surface, -1 for none.
        depths: (h, w) metres along the ray, infinite for none.
        alone: (b, h, w) whether it would see object b if there were nothing else.
    """

    objects: Int16[np.ndarray, "h w"]
    surfaces: Int16[np.ndarray, "h w"]
    depths: Float[np.ndarray, "h w"]
    alone: Bool[np.ndarray, "b h w"]


def look(parts: Shaped[np.ndarray, "p"], rays: Float[np.ndarray, "h w 2"], T_world_camera: Transform) -> Sight:
    """Cast a ray through every pixel's centre, at every object; `parts` as building.place gives them."""
    shape = rays.shape[:2]
    count = int(parts["owner"].max()) + 1
    sight = Sight(
        objects=np.empty(shape, dtype=np.int16),
        surfaces=np.empty(shape, dtype=np.int16),
        depths=np.empty(shape),
        alone=np.zeros((count, *shape), dtype=np.bool_),
    )
    _look(
        parts,
        rays,
        np.ascontiguousarray(T_world_camera),
        sight.objects,
        sight.surfaces,
        sight.depths,
        sight.alone,
    )
    return sight


@compiled
def _look(
    parts: Shaped[np.ndarray, "p"],
    rays: Float[np.ndarray, "h w 2"],
    T: Transform,
    objects: Int16[np.ndarray, "h w"],
    surfaces: Int16[np.ndarray, "h w"],
    depths: Float[np.ndarray, "h w"],
    alone: Bool[np.ndarray, "b h w"],
) -> None:
    origin = (T[0, 3], T[1, 3], T[2, 3])
    # All rays start at one place, from which most of them pass by most parts: that is asked first, and quickly.
    to_middles, gaps = np.empty((len(parts), 3)), np.empty(len(parts))
    for k in range(len(parts)):
        x, y, z = from_middle(parts[k], origin)
        to_middles[k, 0], to_middles[k, 1], to_middles[k, 2] = -x, -y, -z
        gaps[k] = x * x + y * y + z * z - parts[k].reach ** 2
    for i in range(rays.shape[0]):
        for j in range(rays.shape[1]):
            direction = _world_ray(T, rays[i, j, 0], rays[i, j, 1])
            nearest, owner, number = MISS, -1, -1
            for k in range(len(parts)):
                towards = dot((to_middles[k, 0], to_middles[k, 1], to_middles[k, 2]), direction)
                if gaps[k] > 0 and (towards < 0 or towards * towards < gaps[k]):
                    continue
                t, surface = enter_part(parts[k], origin, direction)
                if t < MISS and parts[k].owner >= 0:
                    alone[parts[k].owner, i, j] = True
                if t < nearest:
                    nearest, owner, number = t, parts[k].owner, surface
            objects[i, j], surfaces[i, j], depths[i, j] = owner, number, nearest


@compiled
def _world_ray(T: Transform, x: float, y: float) -> Vector:
    return unit(
        (
            T[0, 0] * x + T[0, 1] * y + T[0, 2],
            T[1, 0] * x + T[1, 1] * y + T[1, 2],
            T[2, 0] * x + T[2, 1] * y + T[2, 2],
        )
    )


def paint(
    world: World, rays: Float[np.ndarray, "h w 2"], T_world_camera: Transform, sight: Sight, *, seed: int
) -> UInt8[np.ndarray, "h w 3"]:
    """The photograph, blue green red, with a sensor's noise; `sight` tells where its edges are."""
    out = np.empty((*rays.shape[:2], 3), dtype=np.uint8)
    _paint(world, rays, np.ascontiguousarray(T_world_camera), sight.surfaces, sight.depths, _TONES, seed, out)
    return out


_BRIGHTEST = 4.0


def _tone_table() -> Float[np.ndarray, "4096"]:
    """sRGB values, 0 to 255, of linear light 0 to _BRIGHTEST: a soft shoulder, so that highlights do not clip."""
    linear = 1 - np.exp(-1.45 * np.linspace(0, _BRIGHTEST, 4096))
    return 255 * np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


_TONES = _tone_table()


@compiled
def _paint(
    world: World,
    rays: Float[np.ndarray, "h w 2"],
    T: Transform,
    surfaces: Int16[np.ndarray, "h w"],
    depths: Float[np.ndarray, "h w"],
    tones: Float[np.ndarray, "n"],
    seed: int,
    out: UInt8[np.ndarray, "h w 3"],
) -> None:
    height, width = surfaces.shape
    origin = (T[0, 3], T[1, 3], T[2, 3])
    pixel = abs(rays[height // 2, width // 2, 0] - rays[height // 2, width // 2 - 1, 0])
    for i in range(height):
        for j in range(width):
            rays_across = SUBPIXELS if _on_edge(surfaces, depths, i, j) else 1
            r, g, b = 0.0, 0.0, 0.0
            for k in range(rays_across * rays_across):
                if rays_across == 1:
                    x, y, t, surface = rays[i, j, 0], rays[i, j, 1], depths[i, j], surfaces[i, j]
                else:
                    x, y = _ray_within_pixel(rays, i, j, k % rays_across, k // rays_across)
                    t, surface = 0.0, UNKNOWN
                red, green, blue = colour_along(world, origin, _world_ray(T, x, y), t, surface, pixel)
                # No brighter than the picture can show, or one glint would spoil the mean.
                r, g, b = r + min(red, 1.6), g + min(green, 1.6), b + min(blue, 1.6)
            share = 1.0 / (rays_across * rays_across)
            r, g, b = r * share, g * share, b * share
            across, down = (j + 0.5) / width - 0.5, (i + 0.5) / height - 0.5
            vignette = 1 - 0.42 * (across * across + down * down)
            for channel, light in enumerate((b, g, r)):
                light *= vignette
                # Shot noise grows with the root of the light, read noise is always there.
                light += math.sqrt(4e-5 * light + 4e-6) * noise.bell(3 * j + channel, i, seed)
                index = min(max(light / _BRIGHTEST, 0.0), 1.0) * (len(tones) - 1)
                low = min(int(index), len(tones) - 2)
                tone = tones[low] + (index - low) * (tones[low + 1] - tones[low])
                out[i, j, channel] = int(tone + 0.5)


@copied_in
def _on_edge(surfaces: Int16[np.ndarray, "h w"], depths: Float[np.ndarray, "h w"], i: int, j: int) -> bool:
    for di, dj in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        y, x = i + di, j + dj
        if 0 <= y < surfaces.shape[0] and 0 <= x < surfaces.shape[1]:
            if surfaces[y, x] != surfaces[i, j]:
                return True
            if surfaces[i, j] >= 0 and abs(depths[y, x] - depths[i, j]) > 0.03 * depths[i, j]:
                return True
    return False


@copied_in
def _ray_within_pixel(rays: Float[np.ndarray, "h w 2"], i: int, j: int, column: int, row: int) -> tuple[float, float]:
    """(x/z, y/z) of one of SUBPIXELS x SUBPIXELS rays, from the slope of the table of rays round the pixel."""
    height, width = rays.shape[0], rays.shape[1]
    left, right, above, below = max(j - 1, 0), min(j + 1, width - 1), max(i - 1, 0), min(i + 1, height - 1)
    a = ((column + 0.5) / SUBPIXELS - 0.5) / (right - left)
    c = ((row + 0.5) / SUBPIXELS - 0.5) / (below - above)
    x = rays[i, j, 0] + a * (rays[i, right, 0] - rays[i, left, 0]) + c * (rays[below, j, 0] - rays[above, j, 0])
    y = rays[i, j, 1] + a * (rays[i, right, 1] - rays[i, left, 1]) + c * (rays[below, j, 1] - rays[above, j, 1])
    return x, y
