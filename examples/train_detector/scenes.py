"""What the study films: the demo's objects on its desk, arranged anew for each scene, and from where."""

import math
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from ars_web.demo import scene
from ars_web.demo.scene import Thing
from ars_web.geometry import rigid_transform
from ars_web.geometry.rigid_transform import Transform

NAMES = ("tea", "chocolate", "beach ball", "cola", "tomatoes", "mug", "parcel tape")
"""The objects; each is a class of its own."""

APART = 0.215
"""Metres between neighbouring places on the desk: no two objects reach into each other, whichever stand there."""

SECTOR_MIDDLE = 0.0
"""The azimuth that cameras of a sector stand round; the window is at the other side, at 148 degrees."""


def arrange(seed: int, *, turned: float) -> tuple[Thing, ...]:
    """The objects at seven places of the desk, dealt out by the seed, each turned about its vertical by at most
    `turned` radians from how the demo has it."""
    rng = np.random.default_rng(seed)
    corners = [(APART * math.cos(a), APART * math.sin(a)) for a in np.arange(6) * math.pi / 3 + rng.uniform(0, 1)]
    places = rng.permutation(np.array([(0.0, 0.0), *corners]))
    found = {thing.name: thing for thing in scene.things()}
    return tuple(
        replace(_moved(found[name], place, rng.uniform(-turned, turned)), class_name=name)
        for name, place in zip(NAMES, places, strict=True)
    )


def _moved(thing: Thing, place: Float[np.ndarray, "2"], turn: float) -> Thing:
    T = thing.T_world_build.copy()
    T[:3, :3] = rigid_transform.rotation_about_z(turn) @ T[:3, :3]
    T[:2, 3] = place
    return replace(thing, T_world_build=T)


def even_views(count: int, *, degrees: float, seed: int) -> Float[np.ndarray, "n 4 4"]:
    """`Ts_world_camera` of cameras spread evenly over so many degrees of azimuth, and over heights and distances.

    Any first few of them are spread as evenly as all are: they follow the R4 sequence, whose members keep off each
    other (Roberts 2018), so that the first N frames of a recording are the N of its views to train on.
    """
    golden = 1.16730397826142  # the root of x^5 = x + 1
    shares = (0.5 + np.outer(np.arange(count) + 1 + 1000 * seed, golden ** -np.arange(1.0, 5.0))) % 1
    rng = np.random.default_rng(seed)
    return np.array([_view(*share, degrees=degrees, rng=rng) for share in shares.tolist()])


def random_views(count: int, *, seed: int) -> Float[np.ndarray, "n 4 4"]:
    """`Ts_world_camera` of cameras anywhere round the desk, independent of each other."""
    rng = np.random.default_rng(seed)
    return np.array([_view(*rng.random(4).tolist(), degrees=360.0, rng=rng) for _ in range(count)])


def _view(around: float, up: float, away: float, roll: float, *, degrees: float, rng: np.random.Generator) -> Transform:
    """A camera by shares, each 0 to 1, of the ranges it may be in; it looks at a place near the desk's middle."""
    azimuth = SECTOR_MIDDLE + math.radians(degrees) * (around - 0.5)
    elevation = math.radians(18 + 47 * up)
    distance = 0.50 + 0.40 * away
    target = np.array([*rng.uniform(-0.10, 0.10, 2), 0.04])
    outward = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
    eye = target + distance * (math.cos(elevation) * outward + np.array([0.0, 0.0, math.sin(elevation)]))
    forward = (target - eye) / distance
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    upright = np.column_stack([right, np.cross(forward, right), forward])
    turn = rigid_transform.rotation_about_z(math.radians(12) * (roll - 0.5))
    return rigid_transform.from_rotation(upright @ turn, eye)
