"""The colour that a ray sees: pictures looked up with their blur, times the baked light, and shine on top.

Colours are linear red, green, blue.
"""

import math

import numpy as np
from jaxtyping import Float, UInt8

from ars_web.demo.compiled import compiled, copied_in
from ars_web.demo.light import WINDOW, WINDOW_LIGHT, room, window_in_mirror
from ars_web.demo.shapes import Vector, along, dot, surface_coordinates, unit
from ars_web.demo.world import (
    LEVEL_COUNT,
    PartRecord,
    SurfaceRecord,
    World,
    from_middle,
    light_grid,
    three,
    trace,
    turned,
    turned_back,
)

UNKNOWN = -2
"""In place of a surface's number: not traced yet."""


@compiled
def _cell(position: float, count: int, wraps: bool) -> tuple[int, int, float]:
    """The two neighbours that a position in [0, 1] lies between on a row of cells, and the share of the second."""
    x = position * count - 0.5
    i = math.floor(x)
    share = x - i
    if wraps:
        return i % count, (i + 1) % count, share
    return min(max(i, 0), count - 1), min(max(i + 1, 0), count - 1), share


@copied_in
def _texel(texels: UInt8[np.ndarray, "n 3"], surface: SurfaceRecord, level: int, u: float, v: float) -> Vector:
    """A picture at (u, v) on one level, between its four nearest texels, still square roots times 255."""
    table = surface.levels
    start, height, width = table[level, 0], table[level, 1], table[level, 2]
    i0, i1, fy = _cell(v, height, False)
    j0, j1, fx = _cell(u, width, surface.wraps)
    a, b = start + i0 * width + j0, start + i0 * width + j1
    c, d = start + i1 * width + j0, start + i1 * width + j1
    wa, wb, wc, wd = (1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy
    return (
        wa * texels[a, 0] + wb * texels[b, 0] + wc * texels[c, 0] + wd * texels[d, 0],
        wa * texels[a, 1] + wb * texels[b, 1] + wc * texels[c, 1] + wd * texels[d, 1],
        wa * texels[a, 2] + wb * texels[b, 2] + wc * texels[c, 2] + wd * texels[d, 2],
    )


@copied_in
def _picture(texels: UInt8[np.ndarray, "n 3"], surface: SurfaceRecord, u: float, v: float, footprint: float) -> Vector:
    """Linear colour of a surface at (u, v), blurred over `footprint` metres: between two levels (mipmaps)."""
    level = min(max(math.log2(footprint * surface.density), 0.0), LEVEL_COUNT - 1.001)
    low = int(level)
    share = level - low
    r, g, b = 0.0, 0.0, 0.0
    for step in range(2):
        weight = share if step else 1 - share
        if weight > 0:
            red, green, blue = _texel(texels, surface, low + step, u, v)
            r, g, b = r + weight * red, g + weight * green, b + weight * blue
    return r * r / 65025.0, g * g / 65025.0, b * b / 65025.0


@copied_in
def _light(lights: Float[np.ndarray, "m 5"], surface: SurfaceRecord, u: float, v: float) -> tuple[Vector, float]:
    """The baked light at (u, v), and the share of the window that is seen from there."""
    start, height, width = light_grid(surface)
    i0, i1, fy = _cell(v, height, False)
    j0, j1, fx = _cell(u, width, surface.wraps)
    window, r, g, b, seen = 0.0, 0.0, 0.0, 0.0, 0.0
    for i, j, weight in (
        (i0, j0, (1 - fx) * (1 - fy)),
        (i0, j1, fx * (1 - fy)),
        (i1, j0, (1 - fx) * fy),
        (i1, j1, fx * fy),
    ):
        cell = start + i * width + j
        window += weight * lights[cell, 0]
        r += weight * lights[cell, 1]
        g += weight * lights[cell, 2]
        b += weight * lights[cell, 3]
        seen += weight * lights[cell, 4]
    return (WINDOW_LIGHT[0] * window + r, WINDOW_LIGHT[1] * window + g, WINDOW_LIGHT[2] * window + b), seen


@compiled
def _matt(
    world: World, part: PartRecord, number: int, point: Vector, direction: Vector, footprint: float
) -> tuple[Vector, Vector, Vector, float]:
    """A surface at a point: its picture's colour, the light on it, its normal, the share of the window it sees."""
    surface = world.surfaces[number]
    u, v, normal = surface_coordinates(
        part.kind, three(part.size), number - part.first_surface, turned_back(part, from_middle(part, point))
    )
    normal = turned(part, normal)
    # Seen at a slant, a pixel covers more of the surface: halfway between its short and its long side.
    slant = math.sqrt(max(abs(dot(normal, direction)), 0.05))
    colour = _picture(world.texels, surface, u, v, footprint / slant)
    light, seen = _light(world.lights, surface, u, v)
    return colour, light, normal, seen


@compiled
def colour_along(world: World, origin: Vector, direction: Vector, t: float, surface: int, pixel: float) -> Vector:
    """The colour that a ray sees.

    `t` and `surface` say what it hits first (surface -1: nothing), where that is known; surface UNKNOWN where it
    is not. `pixel` is the angle between neighbouring rays.
    """
    r, g, b = 0.0, 0.0, 0.0
    keep = (1.0, 1.0, 1.0)
    walked, seen = 0.0, 1.0
    for bounce in range(2):
        if surface == UNKNOWN:
            t, surface = trace(world.parts, origin, direction)
        if surface < 0:
            red, green, blue = room(origin, direction)
            if bounce > 0:
                glow = window_in_mirror(origin, direction) * min(1.0, 0.3 + seen)
                red, green, blue = red + glow, green + glow, blue + glow
            r, g, b = r + keep[0] * red, g + keep[1] * green, b + keep[2] * blue
            break
        look = world.surfaces[surface]
        part = world.parts[int(look.part)]
        point = along(origin, direction, t)
        # What a curved mirror shows is squeezed: its picture is read four times as coarse.
        walked += t if bounce == 0 else 4 * t
        colour, light, normal, seen = _matt(world, part, surface, point, direction, pixel * walked)
        facing = min(max(-dot(normal, direction), 0.0), 1.0)
        share = 0.0
        if look.mirror > 0 and bounce == 0:
            # Schlick's approximation, a little less of it: nothing here is polished.
            share = look.mirror + 0.7 * (1 - look.mirror) * (1 - facing) ** 5
        shine = _highlight(look, point, normal, direction) * seen
        r += keep[0] * ((1 - share) * colour[0] * light[0] + shine * WINDOW_LIGHT[0])
        g += keep[1] * ((1 - share) * colour[1] * light[1] + shine * WINDOW_LIGHT[1])
        b += keep[2] * ((1 - share) * colour[2] * light[2] + shine * WINDOW_LIGHT[2])
        if share == 0:
            break
        keep = (share * colour[0], share * colour[1], share * colour[2]) if look.metal else (share, share, share)
        origin, direction = along(point, normal, 1e-4), along(direction, normal, 2 * facing)
        surface = UNKNOWN
    return r, g, b


@copied_in
def _highlight(look: SurfaceRecord, point: Vector, normal: Vector, direction: Vector) -> float:
    """Blinn and Phong's highlight of the window."""
    if look.gloss == 0:
        return 0.0
    to = unit((WINDOW[0] - point[0], WINDOW[1] - point[1], WINDOW[2] - point[2]))
    half = unit((to[0] - direction[0], to[1] - direction[1], to[2] - direction[2]))
    facing = dot(normal, half)
    # Below this the power is under 0.001, and taking it would cost more than all the rest.
    if facing < 1 - 7 / look.sharpness:
        return 0.0
    return look.gloss * facing**look.sharpness
