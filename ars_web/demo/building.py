"""From the scene to its arrays: pictures drawn and halved, light baked, shapes placed."""

import math
import os
import signal
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import numpy as np
from jaxtyping import Float, Shaped, UInt8

from ars_web.demo import desk_top, scene, shapes
from ars_web.demo.light import bake_rows
from ars_web.demo.pictures import PICTURES, Picture
from ars_web.demo.scene import Thing
from ars_web.demo.world import LEVEL_COUNT, PART, SURFACE, World

DESK_TEXEL = 0.00056
"""Metres of the desk's top that one texel of its picture shows."""
DESK_LIGHT_CELL = 0.004
"""Metres a cell of the grid of light on the desk's top, where the shadows are."""
BAKED_ROWS = 20
"""Rows of a grid of light that one job works out."""
LIGHT_GRIDS = {shapes.BOX: (36, 36), shapes.BALL: (36, 72), shapes.CYLINDER: (32, 72), shapes.TUBE: (28, 72)}
"""Rows and columns of the grid of light on each surface of a kind of shape."""
HANDLE_LIGHT_GRID = (16, 48)


def place(things: Sequence[Thing], *, desk: Thing) -> Shaped[np.ndarray, "p"]:
    """The shapes of the desk and of the things on it, as records of PART."""
    records: list[tuple[object, ...]] = []
    first_surface = 0
    for owner, thing in [(-1, desk), *enumerate(things)]:
        for part in thing.parts:
            R, middle = thing.T_world_build[:3, :3] @ part.rolled, _middle_world(thing, part)
            size = [*part.size, 0.0, 0.0][:3]
            records.append((part.kind, size, R, middle, _reach(part.kind, part.size), owner, first_surface))
            first_surface += len(part.looks)
    return np.array(records, dtype=PART)


def build_world(things: Sequence[Thing], *, desk: Thing, executor: Executor) -> World:
    """The scene as arrays, with its pictures drawn, and still in the dark."""
    parts = [part for thing in (desk, *things) for part in thing.parts]
    looks = [(number, i, *look) for number, part in enumerate(parts) for i, look in enumerate(part.looks)]
    pyramids = {name: _pyramid(_draw(name, executor)) for name in dict.fromkeys(name for _, _, name, _ in looks)}
    tables: dict[str, list[list[int]]] = {}
    texels = 0
    for name, pyramid in pyramids.items():
        tables[name] = []
        for level in pyramid:
            height, width, _ = level.shape
            tables[name].append([texels, height, width])
            texels += height * width
    surfaces = np.zeros(len(looks), dtype=SURFACE)
    cells = 0
    for surface, (number, own_number, name, finish) in enumerate(looks):
        part, pyramid = parts[number], pyramids[name]
        rows, columns = _light_grid(part, name)
        surfaces[surface] = (
            number,
            tables[name],
            pyramid[0].shape[1] / _width(part, own_number),
            _wraps(part.kind, own_number),
            (pyramid[-1].reshape(-1, 3).mean(axis=0) / 255.0) ** 2,
            finish.mirror,
            finish.gloss,
            finish.sharpness,
            finish.metal,
            (cells, rows, columns),
        )
        cells += rows * columns
    return World(
        parts=place(things, desk=desk),
        surfaces=surfaces,
        texels=np.concatenate([level.reshape(-1, 3) for pyramid in pyramids.values() for level in pyramid]),
        lights=np.zeros((cells, 5)),
    )


def lit_world(things: Sequence[Thing], *, desk: Thing, executor: Executor, meanwhile: Callable[[World], None]) -> World:
    """The scene as arrays with the light worked out on every surface.

    `meanwhile` is called with the world while another process is at it.
    """
    # Another process, since in this one numba compiles one thing after the other, and that is half the time of a
    # first run. Spawned, never forked: numba's and OpenCV's threads do not survive a fork.
    with ProcessPoolExecutor(
        max_workers=1,
        mp_context=get_context("spawn"),
        initializer=signal.signal,
        initargs=(signal.SIGINT, signal.SIG_IGN),  # Ctrl-C is this process's to answer
    ) as baker:
        baker.submit(_loaded)  # it loads what it needs while the pictures are drawn
        world = build_world(things, desk=desk, executor=executor)
        lights = baker.submit(_baked, world)
        meanwhile(world)
        world.lights[:] = lights.result()
    return world


def _loaded() -> None:
    """That a process has this module, and with it numba."""


def _baked(world: World) -> Float[np.ndarray, "m 5"]:
    """The light on every surface, worked out by a thread a core."""
    bake_rows(world, 0, 0, 0, 0)  # compiled here, before many threads want it
    with ThreadPoolExecutor(os.cpu_count()) as executor:
        jobs = [
            executor.submit(bake_rows, world, index, surface, first, min(first + BAKED_ROWS, rows))
            for index, part in enumerate(world.parts)
            for surface in range(shapes.SURFACE_COUNTS[part["kind"]])
            for rows in [int(world.surfaces["light_grid"][part["first_surface"] + surface, 1])]
            for first in range(0, rows, BAKED_ROWS)
        ]
        for job in jobs:
            job.result()
    return world.lights


def _middle_world(thing: Thing, part: scene.Part) -> Float[np.ndarray, "3"]:
    return thing.T_world_build[:3, :3] @ np.array(part.middle) + thing.T_world_build[:3, 3]


def _draw(name: str, executor: Executor) -> Picture | UInt8[np.ndarray, "h w 3"]:
    if name != "desk":
        return PICTURES[name]()
    half_x, half_y, _ = scene.DESK_HALF_SIZE
    return desk_top.draw(half_x, half_y, texel=DESK_TEXEL, executor=executor)


def _pyramid(picture: Picture | UInt8[np.ndarray, "h w 3"]) -> list[UInt8[np.ndarray, "h w 3"]]:
    """The picture and its halvings, as square roots of linear colours times 255: LEVEL_COUNT of them, the last
    repeated where there is nothing left to halve."""
    srgb = np.arange(256) / 255.0
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    table = np.rint(255 * np.sqrt(linear)).astype(np.uint8)
    level = table[np.rint(np.clip(picture, 0, 255)).astype(np.uint8)]
    out = [level]
    while len(out) < LEVEL_COUNT:
        h, w = level.shape[0] // 2 * 2, level.shape[1] // 2 * 2
        if h >= 2 and w >= 2:
            total = np.zeros((h // 2, w // 2, 3), dtype=np.uint16)
            for i in (0, 1):
                for j in (0, 1):
                    total += level[i:h:2, j:w:2]
            level = ((total + 2) // 4).astype(np.uint8)
        out.append(level)
    return out


def _width(part: scene.Part, surface: int) -> float:
    """Metres that u = 0 to 1 spans on a surface."""
    a = part.size
    if part.kind == shapes.BOX:
        return 2 * a[1] if surface in (0, 1) else 2 * a[0]
    if part.kind == shapes.CYLINDER and surface in (1, 2):
        return 2 * a[0]
    return 2 * math.pi * a[0]


def _wraps(kind: int, surface: int) -> bool:
    return not (kind == shapes.BOX or (kind == shapes.CYLINDER and surface in (1, 2)))


def _light_grid(part: scene.Part, picture: str) -> tuple[int, int]:
    if picture == "desk":
        return round(2 * part.size[1] / DESK_LIGHT_CELL), round(2 * part.size[0] / DESK_LIGHT_CELL)
    return LIGHT_GRIDS.get(part.kind, HANDLE_LIGHT_GRID)


def _reach(kind: int, size: tuple[float, ...]) -> float:
    if kind == shapes.BOX:
        return math.hypot(*size[:3])
    if kind == shapes.BALL:
        return size[0]
    if kind == shapes.CYLINDER:
        return math.hypot(size[0], size[1])
    if kind == shapes.TUBE:
        return math.hypot(size[0], size[2])
    return size[0] + size[1]
