"""A scene as arrays, and the rays through it; vectors are tuples of three floats, lengths are metres."""

from typing import NamedTuple, Protocol

import numpy as np
from jaxtyping import Float, Int, Shaped, UInt8

from ars_web.demo.compiled import compiled, copied_in
from ars_web.demo.shapes import MISS, Vector, dot, enter, holds

PART = np.dtype(
    [
        ("kind", np.int64),
        ("size", np.float64, 3),
        ("rotation", np.float64, (3, 3)),
        ("middle", np.float64, 3),
        ("reach", np.float64),
        ("owner", np.int64),
        ("first_surface", np.int64),
    ],
    align=True,
)
"""A part of an object: its shape; `T_world_part` in two pieces; radius of the ball round its middle that holds it;
index of the object that it belongs to, -1 for the desk; number of its first surface among all. Records, because
numba counts references of every array it is handed, which costs more than a ray does."""


class PartRecord(Protocol):
    """One of PART, for the type checker."""

    kind: int
    size: Float[np.ndarray, "3"]
    rotation: Float[np.ndarray, "3 3"]
    middle: Float[np.ndarray, "3"]
    reach: float
    owner: int
    first_surface: int


LEVEL_COUNT = 12
"""Levels of a picture, each half as wide and high as the one before."""

SURFACE = np.dtype(
    [
        ("part", np.int64),
        ("levels", np.int64, (LEVEL_COUNT, 3)),
        ("density", np.float64),
        ("wraps", np.bool_),
        ("mean", np.float64, 3),
        ("mirror", np.float64),
        ("gloss", np.float64),
        ("sharpness", np.float64),
        ("metal", np.bool_),
        ("light_grid", np.int64, 3),
    ],
    align=True,
)
"""A surface: number of its part; first texel, height and width of each level of its picture; texels a metre at level 0;
whether u = 0 and u = 1 are the same place; mean linear colour; its finish, as scene.Finish; first row in `lights`,
height and width of its grid of light."""


class SurfaceRecord(Protocol):
    """One of SURFACE, for the type checker."""

    part: int
    levels: Int[np.ndarray, "l 3"]
    density: float
    wraps: bool
    mean: Float[np.ndarray, "3"]
    mirror: float
    gloss: float
    sharpness: float
    metal: bool
    light_grid: Int[np.ndarray, "3"]


class World(NamedTuple):
    """A scene as arrays.

    Attributes:
        parts: (p,) of PART; the desk first, then the objects in order.
        surfaces: (s,) of SURFACE.
        texels: (n, 3) all pictures with all their levels: square roots of linear colours, times 255.
        lights: (m, 5) light of the window, all-round light r g b, share of the window that is seen.
    """

    parts: Shaped[np.ndarray, "p"]
    surfaces: Shaped[np.ndarray, "s"]
    texels: UInt8[np.ndarray, "n 3"]
    lights: Float[np.ndarray, "m 5"]


@copied_in
def three(row: Float[np.ndarray, "3"]) -> Vector:
    return row[0], row[1], row[2]


@copied_in
def light_grid(surface: SurfaceRecord) -> tuple[int, int, int]:
    """First row in `lights`, height and width of a surface's grid of light."""
    grid = surface.light_grid
    return grid[0], grid[1], grid[2]


@compiled
def from_middle(part: PartRecord, point: Vector) -> Vector:
    """A point of the world relative to a part's middle, axes still the world's."""
    m = part.middle
    return point[0] - m[0], point[1] - m[1], point[2] - m[2]


@compiled
def turned_back(part: PartRecord, direction: Vector) -> Vector:
    """A direction of the world in a part's frame."""
    R = part.rotation
    x, y, z = direction
    return (
        R[0, 0] * x + R[1, 0] * y + R[2, 0] * z,
        R[0, 1] * x + R[1, 1] * y + R[2, 1] * z,
        R[0, 2] * x + R[1, 2] * y + R[2, 2] * z,
    )


@compiled
def turned(part: PartRecord, direction: Vector) -> Vector:
    """A direction in a part's frame as one of the world."""
    R = part.rotation
    x, y, z = direction
    return (
        R[0, 0] * x + R[0, 1] * y + R[0, 2] * z,
        R[1, 0] * x + R[1, 1] * y + R[1, 2] * z,
        R[2, 0] * x + R[2, 1] * y + R[2, 2] * z,
    )


@compiled
def enter_part(part: PartRecord, origin: Vector, direction: Vector) -> tuple[float, int]:
    """Distance to where a ray enters a part, MISS where it does not, and the number of the surface among all."""
    away = from_middle(part, origin)
    b = dot(away, direction)
    c = dot(away, away) - part.reach * part.reach
    if c > 0 and (b > 0 or b * b < c):
        return MISS, 0
    t, surface = enter(part.kind, three(part.size), turned_back(part, away), turned_back(part, direction))
    return t, part.first_surface + surface


@compiled
def trace(parts: Shaped[np.ndarray, "p"], origin: Vector, direction: Vector) -> tuple[float, int]:
    """The nearest hit of a ray: distance and number of the surface; MISS and -1 for none."""
    nearest, hit = MISS, -1
    for i in range(len(parts)):
        t, surface = enter_part(parts[i], origin, direction)
        if t < nearest:
            nearest, hit = t, surface
    return nearest, hit


@copied_in
def blocked(parts: Shaped[np.ndarray, "p"], origin: Vector, direction: Vector, distance: float) -> bool:
    for i in range(len(parts)):
        t, _ = enter_part(parts[i], origin, direction)
        if t < distance:
            return True
    return False


@copied_in
def buried(parts: Shaped[np.ndarray, "p"], point: Vector) -> bool:
    for i in range(len(parts)):
        part = parts[i]
        if holds(part.kind, three(part.size), turned_back(part, from_middle(part, point))):
            return True
    return False
