"""From the scene to its arrays: pictures drawn and halved, light baked, shapes placed."""

import math
from collections.abc import Sequence
from concurrent.futures import Executor

import numpy as np
from jaxtyping import UInt8

from ars_web.demo import desk_top, scene, shapes
from ars_web.demo.light import bake_rows
from ars_web.demo.pictures import PICTURES, Picture
from ars_web.demo.scene import Thing
from ars_web.demo.world import LEVEL_COUNT, PART, SURFACE, World
from ars_web.geometry.rigid_transform import Transform

DESK_TEXEL = 0.00056
"""Metres of the desk's top that one texel of its picture shows."""
DESK_LIGHT_CELL = 0.003
"""Metres a cell of the grid of light on the desk's top, where the shadows are."""
LIGHT_GRIDS = {shapes.BOX: (36, 36), shapes.BALL: (36, 72), shapes.CYLINDER: (32, 72), shapes.TUBE: (28, 72)}
"""Rows and columns of the grid of light on each surface of a kind of shape."""
HANDLE_LIGHT_GRID = (16, 48)


def build_world(things: Sequence[Thing], *, desk: Thing, executor: Executor) -> World:
    """The scene as arrays, with its pictures drawn and its light baked."""
    owned = [(-1, desk, part) for part in desk.parts]
    owned += [(i, thing, part) for i, thing in enumerate(things) for part in thing.parts]
    parts = [part for _, _, part in owned]
    looks = [look for part in parts for look in part.looks]
    names = list(dict.fromkeys(name for name, _ in looks))
    pyramids = [_pyramid(_draw(name, executor)) for name in names]
    starts = np.cumsum([0] + [sum(len(level.reshape(-1, 3)) for level in pyramid) for pyramid in pyramids])
    surfaces = np.zeros(len(looks), dtype=SURFACE)
    texels = 0
    placed = [(part, i, *look) for part in parts for i, look in enumerate(part.looks)]
    for number, (part, surface, name, finish) in enumerate(placed):
        pyramid = pyramids[names.index(name)]
        rows, columns = _light_grid(part, name)
        surfaces[number] = (
            _level_table(pyramid, int(starts[names.index(name)])),
            pyramid[0].shape[1] / _width(part, surface),
            _wraps(part.kind, surface),
            (pyramid[-1].reshape(-1, 3).mean(axis=0) / 255.0) ** 2,
            finish.mirror,
            finish.gloss,
            finish.sharpness,
            finish.metal,
            (texels, rows, columns),
        )
        texels += rows * columns
    counts = [len(part.looks) for part in parts]
    firsts = np.cumsum([0, *counts[:-1]])
    records = np.zeros(len(parts), dtype=PART)
    for i, (owner, thing, part) in enumerate(owned):
        T = thing.T_world_build @ _shifted(part.middle)
        size = [*part.size, 0.0, 0.0][:3]
        records[i] = (part.kind, size, T[:3, :3], T[:3, 3], _reach(part.kind, part.size), owner, firsts[i])
    world = World(
        parts=records,
        surfaces=surfaces,
        texels=np.concatenate([level.reshape(-1, 3) for pyramid in pyramids for level in pyramid]),
        lights=np.zeros((texels, 5)),
    )
    jobs = []
    for part, count in enumerate(counts):
        for surface in range(count):
            rows = int(surfaces["light_grid"][firsts[part] + surface, 1])
            for first in range(0, rows, 20):
                jobs.append(executor.submit(bake_rows, world, part, surface, first, min(first + 20, rows)))
    for job in jobs:
        job.result()
    return world


def _shifted(middle: tuple[float, float, float]) -> Transform:
    T = np.eye(4)
    T[:3, 3] = middle
    return T


def _draw(name: str, executor: Executor) -> Picture | UInt8[np.ndarray, "h w 3"]:
    if name != "desk":
        return PICTURES[name]()
    half_x, half_y, _ = scene.DESK_HALF_SIZE
    out = np.empty((round(2 * half_y / DESK_TEXEL), round(2 * half_x / DESK_TEXEL), 3), dtype=np.uint8)
    rows = range(0, len(out), 128)
    jobs = [
        executor.submit(desk_top.draw_rows, out, first, min(first + 128, len(out)), half_x, half_y) for first in rows
    ]
    for job in jobs:
        job.result()
    return out


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


def _level_table(pyramid: list[UInt8[np.ndarray, "h w 3"]], start: int) -> list[list[int]]:
    table: list[list[int]] = []
    for level in pyramid:
        table.append([start, level.shape[0], level.shape[1]])
        start += level.shape[0] * level.shape[1]
    return table


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
