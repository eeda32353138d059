"""The desk's top, drawn in numpy: wooden boards, a cutting mat and two sheets of paper. Metres from its middle."""

import math
from collections.abc import Callable
from concurrent.futures import Executor

import numpy as np
from jaxtyping import Float, Float32, UInt8

Line = Float32[np.ndarray, "n"]
Plane = Float32[np.ndarray, "h w"]
Top = UInt8[np.ndarray, "h w 3"]

BOARD_WIDTH, BOARD_LENGTH = 0.145, 1.15
WOOD, MAT, MAT_INK, PAPER, INK = (198, 150, 104), (36, 96, 82), (196, 214, 186), (236, 236, 230), (58, 70, 104)
MAT_HALF, MAT_TURN = (0.30, 0.225), 0.12
PAPER_HALF = (0.105, 0.1485)


def draw(half_x: float, half_y: float, *, texel: float, executor: Executor) -> Top:
    """The desk's top at `texel` metres a texel, sRGB; row 0 is at y = half_y, column 0 at x = -half_x."""
    width, height = round(2 * half_x / texel), round(2 * half_y / texel)
    x = (half_x * (2 * (np.arange(width) + 0.5) / width - 1)).astype(np.float32)
    y = (half_y * (1 - 2 * (np.arange(height) + 0.5) / height)).astype(np.float32)
    out = np.empty((height, width, 3), dtype=np.uint8)
    rows = range(math.floor(-half_y / BOARD_WIDTH), math.ceil(half_y / BOARD_WIDTH))
    for job in [executor.submit(_draw_boards, out, x, y, row) for row in rows]:
        job.result()
    _draw_mat(out, x, y, texel)
    _draw_sheet(out, x, y, texel, place=(-0.52, 0.17, 0.35), ink=_writing)
    _draw_sheet(out, x, y, texel, place=(0.62, -0.40, -0.5), ink=_plot)
    return out


def _noise(x: Line, y: Line, seed: int) -> Plane:
    """Smooth noise in [0, 1] at every (x, y): random values on the integer lattice, blended between."""
    (j, along), (i, down) = _cells(x), _cells(y)
    lattice = np.random.default_rng(seed).random((i.max() + 2, j.max() + 2), dtype=np.float32)
    rows = lattice[i] + down[:, None] * (lattice[i + 1] - lattice[i])
    left = rows[:, j]
    return left + along * (rows[:, j + 1] - left)


def _cells(x: Line) -> tuple[np.ndarray, Line]:
    """The lattice cell that each coordinate lies in, counted from the first, and how far into it, eased."""
    cell = np.floor(x)
    share = x - cell
    return (cell - cell.min()).astype(np.intp), share * share * (3 - 2 * share)


def _cover(distance: Plane, width: float, texel: float) -> Plane:
    """How much of a texel a line of half width `width` covers at this distance from its middle."""
    return np.clip(0.5 + (width - np.abs(distance)) / texel, 0, 1)


def _blend(under: Float32[np.ndarray, "h w 3"], cover: Plane, colour: Float[np.ndarray, "*h_w 3"]) -> None:
    under += cover[..., None] * (np.asarray(colour, dtype=np.float32) - under)


def _draw_boards(out: Top, x: Line, y: Line, row: int) -> None:
    """The boards between y = row and row + 1 times BOARD_WIDTH, each of its own tone, with rings, fibres, pores."""
    inside = np.flatnonzero(np.floor(y / BOARD_WIDTH) == row)
    if not len(inside):
        return
    rows = slice(int(inside[0]), int(inside[-1]) + 1)
    across = y[rows] - row * BOARD_WIDTH
    shift = BOARD_LENGTH * float(np.random.default_rng(row + 100).random())
    columns = np.floor((x + shift) / BOARD_LENGTH)
    for column in np.unique(columns):
        inside = np.flatnonzero(columns == column)
        window = rows, slice(int(inside[0]), int(inside[-1]) + 1)
        along = x[window[1]] + shift - column * BOARD_LENGTH
        out[window] = _wood(along, across, seed=int(1000 + 40 * row + column))


def _wood(along: Line, across: Line, *, seed: int) -> Top:
    """One board; `along` and `across` are metres from its corner."""
    own_tone, own_ring = np.random.default_rng(seed).random(2)
    wander = 0.03 * _noise(along * 2.2, across * 9, seed) + 0.006 * _noise(along * 9, across * 40, seed + 1)
    ring = (across[:, None] + wander) * 55 + 6 * np.float32(own_ring)
    ring -= np.floor(ring)
    band = np.minimum(ring, (1 - ring) * 4)
    fibre = 0.6 * _noise(along * 26, across * 1400, seed + 2) + 0.4 * _noise(along * 70, across * 2600, seed + 3)
    pore = _noise(along * 110, across * 2300, seed + 4) > 0.83
    tone = 0.90 + 0.16 * np.float32(own_tone) + 0.10 * (_noise(along * 3, across * 4, seed + 5) - 0.5)
    tone *= 1.0 - 0.17 * band + 0.12 * (fibre - 0.5) - 0.06 * pore
    side = np.minimum(across, BOARD_WIDTH - across)[:, None]
    end = np.minimum(along, BOARD_LENGTH - along)
    tone *= 1.0 - 0.55 * np.clip(1.5 - np.minimum(side, end) / 0.0008, 0, 1)
    colour = np.empty((*tone.shape, 3), dtype=np.float32)
    for channel, (value, dry) in enumerate(zip(WOOD, (0.0, 0.02, 0.06), strict=True)):
        colour[..., channel] = value * tone * (1 - dry + dry * fibre)
    return _as_bytes(colour)


def _as_bytes(colour: Float32[np.ndarray, "h w 3"]) -> Top:
    return (np.clip(colour, 0, 255) + 0.5).astype(np.uint8)


def _around(x: Line, y: Line, place: tuple[float, float, float], reach: float) -> tuple[slice, slice, Plane, Plane]:
    """The rows and columns within `reach` of a place (x, y, turn), and their coordinates in its turned frame."""
    x0, y0, turn = place
    columns, rows = np.flatnonzero(np.abs(x - x0) < reach), np.flatnonzero(np.abs(y - y0) < reach)
    window = slice(int(rows[0]), int(rows[-1]) + 1), slice(int(columns[0]), int(columns[-1]) + 1)
    c, s = np.float32(math.cos(turn)), np.float32(math.sin(turn))
    dx, dy = x[window[1]][None, :] - np.float32(x0), y[window[0]][:, None] - np.float32(y0)
    return *window, c * dx + s * dy, c * dy - s * dx


def _squares(u: Plane, v: Plane, spacing: float, width: float, texel: float) -> Plane:
    """The lines of a square grid."""
    from_u, from_v = u - spacing * np.rint(u / spacing), v - spacing * np.rint(v / spacing)
    return _cover(np.minimum(np.abs(from_u), np.abs(from_v)), width, texel)


def _draw_mat(out: Top, x: Line, y: Line, texel: float) -> None:
    """A green cutting mat with its squares of one and five centimetres."""
    rows, columns, u, v = _around(x, y, (0.0, 0.0, MAT_TURN), math.hypot(*MAT_HALF))
    corner = 0.012
    beyond_u, beyond_v = np.abs(u) - MAT_HALF[0] + corner, np.abs(v) - MAT_HALF[1] + corner
    outside = np.hypot(np.maximum(beyond_u, 0), np.maximum(beyond_v, 0)) - corner
    ink = 0.28 * _squares(u, v, 0.01, 0.00018, texel)
    np.maximum(ink, 0.62 * _squares(u, v, 0.05, 0.00045, texel), out=ink)
    for slant in ((u - v) * 0.7071, (u + 0.5 * v) * 0.8944):
        np.maximum(ink, 0.5 * _cover(slant, 0.0003, texel), out=ink)
    border = np.maximum(np.abs(u) - 0.285, np.abs(v) - 0.21)
    ink = np.where(border < 0, ink, 0)
    np.maximum(ink, 0.8 * _cover(border, 0.0006, texel), out=ink)
    grain = 6 * (_noise(x[columns] * 900, y[rows] * 900, 21) - 0.5) + 5 * (
        _noise(x[columns] * 60, y[rows] * 60, 22) - 0.5
    )
    mat = np.array(MAT, dtype=np.float32) + grain[..., None]
    _blend(mat, ink, np.array(MAT_INK))
    under = out[rows, columns].astype(np.float32)
    _blend(under, np.clip(0.5 - outside / texel, 0, 1), mat)
    out[rows, columns] = _as_bytes(under)


def _draw_sheet(
    out: Top,
    x: Line,
    y: Line,
    texel: float,
    *,
    place: tuple[float, float, float],
    ink: Callable[[Plane, Plane, float], Plane],
) -> None:
    """A sheet of A4 paper and the thin shadow round it."""
    rows, columns, u, v = _around(x, y, place, math.hypot(*PAPER_HALF))
    outside = np.maximum(np.abs(u) - PAPER_HALF[0], np.abs(v) - PAPER_HALF[1])
    under = out[rows, columns] * (0.72 + 0.28 * np.clip(outside / 0.004, 0, 1))[..., None]
    paper = np.array(PAPER, dtype=np.float32) + 5 * (_noise(x[columns] * 300, y[rows] * 300, 31) - 0.5)[..., None]
    _blend(paper, ink(u, v, texel), np.array(INK))
    _blend(under, np.clip(0.5 - outside / texel, 0, 1), paper)
    out[rows, columns] = _as_bytes(under)


def _writing(u: Plane, v: Plane, texel: float) -> Plane:
    """Lines of words, ragged at the right, an empty one after every seven."""
    line = np.floor((0.128 - v) / 0.008).astype(np.intp)
    written = (line >= 0) & (line < 31) & (line % 8 != 7)
    rng = np.random.default_rng(32)
    # Each word is a stretch of letters: high where ink is, along a line 0.17 long.
    words = rng.random((31, 34)) > 0.22
    waves = rng.uniform(-1, 1, (31, 400)).astype(np.float32)
    reach = 0.085 - 0.05 * rng.random(31) * np.where(np.arange(31) % 8 == 6, 1.0, 0.25)
    row = np.clip(line, 0, 30)
    written &= (u > -0.085) & (u < reach[row])
    written &= words[row, np.clip((u + 0.085) * 200, 0, 33).astype(np.intp)]
    wave = 0.0008 * waves[row, np.clip((u + 0.085) * 2350, 0, 399).astype(np.intp)]
    middle = (0.128 - v) - (line + 0.5).astype(np.float32) * 0.008
    return np.where(written, 0.7 * _cover(middle + wave, 0.0011, texel), 0).astype(np.float32)


def _plot(u: Plane, v: Plane, texel: float) -> Plane:
    """Squared paper with two axes and a curve."""
    ink = 0.35 * _squares(u, v, 0.005, 0.00012, texel)
    curve = v - 0.05 * np.sin(u * 42) * np.exp(-6 * np.abs(u)) - 0.02
    np.maximum(ink, 0.85 * _cover(curve * 0.5, 0.0005, texel), out=ink)
    for axis in (u + 0.08, v + 0.09):
        np.maximum(ink, 0.8 * _cover(axis, 0.0004, texel), out=ink)
    return ink
