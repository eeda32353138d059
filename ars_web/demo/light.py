"""Light: the window and the room, and what of them falls on every surface.

The scene and its light stand still, so what light falls on each surface is worked out once, on a grid of its
(u, v): from the window (an area light, hence soft shadows) and from all round (the room, the desk and the other
objects, hence darker corners and a tint of the neighbours' colours). Colours are linear red, green, blue.
"""

import math

import numpy as np
from jaxtyping import Float, Shaped

from ars_web.demo.compiled import compiled, copied_in
from ars_web.demo.shapes import MISS, Vector, along, dot, surface_point, unit
from ars_web.demo.world import World, blocked, buried, light_grid, three, trace, turned

WINDOW = (-1.65, 1.05, 1.75)
"""The middle of the window that lights the desk, metres."""
WINDOW_HALF = 0.30
WINDOW_LIGHT = (1.95, 1.80, 1.58)
"""What it adds to a white surface that faces it from the desk's middle."""
WINDOW_SEEN = 5.0
"""How bright it is in a mirror."""


def _unit_vector(values: Float[np.ndarray, "3"]) -> Vector:
    x, y, z = (values / np.linalg.norm(values)).tolist()
    return x, y, z


INWARD = _unit_vector(-np.array(WINDOW))
SIDE = _unit_vector(np.cross((0.0, 0.0, 1.0), INWARD))
UP = _unit_vector(np.cross(INWARD, SIDE))
"""The window's axes: towards the desk's middle, and along its two sides."""
DISTANCE2 = dot(WINDOW, WINDOW)

FLOOR, RAIL, ROOM = -0.74, 0.12, 3.2
"""Heights of the floor and of the rail on the walls, from the desk's top, and half the room's width."""


@copied_in
def room(origin: Vector, direction: Vector) -> Vector:
    """The colour of what lies behind everything, out of focus: a floor, and walls with a panel up to a rail."""
    t = MISS
    for axis in range(2):
        if abs(direction[axis]) > 1e-9:
            wall = ROOM if direction[axis] > 0 else -ROOM
            t = min(t, (wall - origin[axis]) / direction[axis])
    height = origin[2] + t * direction[2] if t < MISS else (-10.0 if direction[2] < 0 else 10.0)
    if height < FLOOR:
        x, y, _ = along(origin, direction, (FLOOR - origin[2]) / direction[2])
        glow = 0.16 + 0.20 * math.exp(-((x + 1.6) ** 2 + (y - 1.1) ** 2) / 2.2)
        glow *= 1 - 0.75 * math.exp(-(x * x + y * y) / 1.1)  # the desk's shadow
        return 1.06 * glow, 0.80 * glow, 0.62 * glow
    x, y, _ = along(origin, direction, t)
    shade = 0.80 + 0.55 * math.exp(-((x + 2.6) ** 2 + (y - 1.8) ** 2) / 3.0)
    shade *= 0.35 + 0.65 * _soft_step(height, FLOOR + 0.12, 0.06)
    rail = _soft_step(height, RAIL - 0.05, 0.03) - _soft_step(height, RAIL + 0.05, 0.03)
    upper = _soft_step(height, RAIL, 0.05)
    r, g, b = 0.46 + upper * (0.24 - 0.46), 0.44 + upper * (0.34 - 0.44), 0.40 + upper * (0.37 - 0.40)
    return shade * (r + rail * (0.55 - r)), shade * (g + rail * (0.54 - g)), shade * (b + rail * (0.51 - b))


@copied_in
def _soft_step(x: float, edge: float, soft: float) -> float:
    """0 well below the edge, 1 well above."""
    return min(max(0.5 + (x - edge) / (2 * soft), 0.0), 1.0)


@copied_in
def _sky(direction: Vector) -> Vector:
    """All-round light from the room in a direction, brighter from above and from the window's side."""
    up = 0.5 + 0.5 * direction[2]
    side = 0.5 - 0.5 * dot(direction, INWARD)
    bright = 0.06 + 0.26 * up * up + 0.20 * side * side
    return 0.94 * bright, 0.98 * bright, 1.08 * bright


@compiled
def window_in_mirror(origin: Vector, direction: Vector) -> float:
    """How bright the window is along a ray: two panes by two, soft at their borders."""
    towards = -dot(direction, INWARD)
    if towards < 0.05:
        return 0.0
    to = (WINDOW[0] - origin[0], WINDOW[1] - origin[1], WINDOW[2] - origin[2])
    t = -dot(to, INWARD) / towards
    off = (t * direction[0] - to[0], t * direction[1] - to[1], t * direction[2] - to[2])
    a, c = abs(dot(off, SIDE)), abs(dot(off, UP))
    soft = 0.045
    pane = min(max((WINDOW_HALF - max(a, c)) / soft, 0.0), 1.0)
    bars = min(max((min(a, c) - 0.015) / soft, 0.0), 1.0)
    return WINDOW_SEEN * pane * (0.25 + 0.75 * bars)


@compiled
def bake_rows(world: World, index: int, surface: int, first: int, last: int) -> None:
    """Work out the light on rows [first, last) of the grid of a part's surface (its own number), into `lights`."""
    parts, lights = world.parts, world.lights
    part = parts[index]
    number = int(part.first_surface + surface)
    start, height, width = light_grid(world.surfaces[number])
    for row in range(first, last):
        for column in range(width):
            point, normal = surface_point(
                part.kind, three(part.size), surface, (column + 0.5) / width, (row + 0.5) / height
            )
            normal = turned(part, normal)
            point = turned(part, point)
            m = part.middle
            # A tenth of a millimetre off the surface, lest a ray hits where it starts.
            origin = along((point[0] + m[0], point[1] + m[1], point[2] + m[2]), normal, 1e-4)
            cell = start + row * width + column
            if buried(parts, origin):
                lights[cell] = 0.0
                continue
            lights[cell, 0], lights[cell, 4] = _window_light(parts, origin, normal)
            lights[cell, 1], lights[cell, 2], lights[cell, 3] = _light_all_round(parts, world.surfaces, origin, normal)


@copied_in
def _window_light(parts: Shaped[np.ndarray, "p"], origin: Vector, normal: Vector) -> tuple[float, float]:
    """Irradiance from the window, 1 at the desk's middle facing it, and the share of the window that is seen."""
    n = 8
    total, seen = 0.0, 0
    for i in range(n):
        for j in range(n):
            a = WINDOW_HALF * (2 * (i + 0.5) / n - 1)
            b = WINDOW_HALF * (2 * (j + 0.5) / n - 1)
            to = (
                WINDOW[0] + a * SIDE[0] + b * UP[0] - origin[0],
                WINDOW[1] + a * SIDE[1] + b * UP[1] - origin[1],
                WINDOW[2] + a * SIDE[2] + b * UP[2] - origin[2],
            )
            distance = math.sqrt(dot(to, to))
            direction = unit(to)
            facing = dot(normal, direction)
            if facing > 0 and not blocked(parts, origin, direction, distance):
                total += facing * -dot(INWARD, direction) * DISTANCE2 / (distance * distance)
                seen += 1
    return total / (n * n), seen / (n * n)


@copied_in
def _light_all_round(
    parts: Shaped[np.ndarray, "p"], surfaces: Shaped[np.ndarray, "s"], origin: Vector, normal: Vector
) -> Vector:
    """Irradiance from everywhere but the window: rays spread by the cosine, one bounce off what they meet."""
    across = unit((0.0, -normal[2], normal[1]) if abs(normal[0]) < 0.7 else (-normal[2], 0.0, normal[0]))
    third = (
        normal[1] * across[2] - normal[2] * across[1],
        normal[2] * across[0] - normal[0] * across[2],
        normal[0] * across[1] - normal[1] * across[0],
    )
    rings, spokes = 6, 12
    r, g, b = 0.0, 0.0, 0.0
    for i in range(rings):
        # Equal shares of sin^2 are equal shares of the cosine's weight (Malley's method).
        sine = math.sqrt((i + 0.5) / rings)
        cosine = math.sqrt(1 - sine * sine)
        for j in range(spokes):
            angle = 2 * math.pi * (j + 0.5 * (i % 2)) / spokes
            x, y = sine * math.cos(angle), sine * math.sin(angle)
            direction = (
                x * across[0] + y * third[0] + cosine * normal[0],
                x * across[1] + y * third[1] + cosine * normal[1],
                x * across[2] + y * third[2] + cosine * normal[2],
            )
            t, surface = trace(parts, origin, direction)
            if surface < 0:
                red, green, blue = _sky(direction)
            else:
                # Where the ray met something near, that place is dark too.
                lit = 0.85 * t / (t + 0.035) if parts[int(surfaces[surface].part)].owner < 0 else 0.45 * t / (t + 0.012)
                mean = surfaces[surface].mean
                red, green, blue = lit * mean[0], lit * mean[1], lit * mean[2]
            r, g, b = r + red, g + green, b + blue
    return r / (rings * spokes), g / (rings * spokes), b / (rings * spokes)
