"""The desk's top, drawn row by row in numba: wooden boards, a cutting mat and two sheets of paper."""

import math
from math import floor

import numpy as np
from jaxtyping import UInt8

from ars_web.demo import noise
from ars_web.demo.compiled import compiled


@compiled
def _line(distance: float, width: float, blur: float) -> float:
    """How much of a texel a line of half width `width` covers at this distance from its middle."""
    return min(max(0.5 + (width - abs(distance)) / blur, 0.0), 1.0)


@compiled
def _rules(u: float, v: float, spacing: float, width: float, blur: float) -> float:
    """How much of a texel the lines of a square grid cover."""
    from_u, from_v = u - spacing * floor(u / spacing + 0.5), v - spacing * floor(v / spacing + 0.5)
    return _line(min(abs(from_u), abs(from_v)), width, blur)


@compiled
def _wood(x: float, y: float) -> tuple[float, float, float]:
    """Boards along x, each of its own tone, with rings, fibres and pores."""
    board_width = 0.145
    row = floor(y / board_width)
    across = y - row * board_width
    shift = 0.9 * noise.uniform(row, 0, 5)
    length = 1.15
    column = floor((x + shift) / length)
    end = x + shift - column * length
    own = row * 7 + column * 3
    wander = 0.03 * noise.smooth(x * 2.2, y * 9, own) + 0.006 * noise.smooth(x * 9, y * 40, own + 1)
    ring = (across + wander) * 55 + 6 * noise.uniform(own, 1, 6)
    ring = ring - floor(ring)
    band = ring if ring < 0.8 else (1 - ring) * 4
    fibre = 0.6 * noise.smooth(x * 26, y * 1400, 11) + 0.4 * noise.smooth(x * 70, y * 2600, 12)
    pore = 1.0 if noise.smooth(x * 110, y * 2300, 13) > 0.83 else 0.0
    tone = 0.90 + 0.16 * noise.uniform(own, 2, 7) + 0.10 * (noise.smooth(x * 3, y * 4, 14) - 0.5)
    tone *= 1.0 - 0.17 * band + 0.12 * (fibre - 0.5) - 0.06 * pore
    gap = max(_line(min(across, board_width - across), 0.0009, 0.0008), _line(min(end, length - end), 0.0008, 0.0008))
    tone *= 1.0 - 0.55 * gap
    return 198 * tone, 150 * tone * (0.98 + 0.02 * fibre), 104 * tone * (0.94 + 0.06 * fibre)


@compiled
def _desk_colour(x: float, y: float, blur: float) -> tuple[float, float, float]:
    """The desk's top at (x, y) metres from its middle: boards, a cutting mat, and two sheets of paper."""
    r, g, b = _wood(x, y)
    # The cutting mat, 0.60 x 0.45, turned a little.
    c, s = math.cos(0.12), math.sin(0.12)
    u, v = c * x + s * y, c * y - s * x
    corner = 0.012
    du, dv = max(abs(u) - 0.30 + corner, 0.0), max(abs(v) - 0.225 + corner, 0.0)
    cover = min(max(0.5 + (corner - math.sqrt(du * du + dv * dv)) / blur, 0.0), 1.0)
    if cover > 0:
        grain = 6 * (noise.smooth(x * 900, y * 900, 21) - 0.5) + 5 * (noise.smooth(x * 60, y * 60, 22) - 0.5)
        inside = abs(u) < 0.285 and abs(v) < 0.21
        fine = max(
            _line(u - 0.01 * floor(u / 0.01 + 0.5), 0.00018, blur),
            _line(v - 0.01 * floor(v / 0.01 + 0.5), 0.00018, blur),
        )
        bold = max(
            _line(u - 0.05 * floor(u / 0.05 + 0.5), 0.00045, blur),
            _line(v - 0.05 * floor(v / 0.05 + 0.5), 0.00045, blur),
        )
        frame = max(_line(abs(u) - 0.285, 0.0006, blur), _line(abs(v) - 0.21, 0.0006, blur))
        slant = max(_line((u - v) * 0.7071, 0.0003, blur), _line((u + 0.5 * v) * 0.8944, 0.0003, blur))
        ink = max(0.28 * fine, 0.62 * bold, 0.5 * slant) if inside else 0.0
        if abs(u) < 0.286 and abs(v) < 0.211:
            ink = max(ink, 0.8 * frame)
        red, green, blue = 36 + grain, 96 + grain, 82 + grain
        red, green, blue = red + ink * (196 - red), green + ink * (214 - green), blue + ink * (186 - blue)
        r, g, b = r + cover * (red - r), g + cover * (green - g), b + cover * (blue - b)
    for sheet in range(2):
        x0, y0, turn = (-0.52, 0.17, 0.35) if sheet == 0 else (0.62, -0.40, -0.5)
        c, s = math.cos(turn), math.sin(turn)
        u, v = c * (x - x0) + s * (y - y0), c * (y - y0) - s * (x - x0)
        outside = max(abs(u) - 0.105, abs(v) - 0.1485)
        shadow = min(max(outside / 0.004, 0.0), 1.0)
        if shadow < 1:
            dim = 0.72 + 0.28 * shadow
            r, g, b = r * dim, g * dim, b * dim
        cover = min(max(0.5 - outside / blur, 0.0), 1.0)
        if cover > 0:
            paper = 236 + 5 * (noise.smooth(x * 300, y * 300, 31) - 0.5)
            ink = 0.0
            row = floor((0.128 - v) / 0.008)
            if sheet == 0:
                # Written lines, ragged at the right, with gaps between words.
                reach = 0.085 - 0.05 * noise.uniform(row, 3, 32) * (1.0 if row % 7 == 6 else 0.3)
                word = noise.smooth((u + 0.2) * 170 + 31 * row, 0.5, 33)
                middle = (0.128 - v) - (row + 0.5) * 0.008
                if 0 <= row < 31 and row % 8 != 7 and -0.085 < u < reach and word > 0.3:
                    ink = 0.7 * _line(middle + 0.0012 * (noise.smooth(u * 1300, row * 3.0, 34) - 0.5), 0.0011, blur)
            else:
                grid = _rules(u, v, 0.005, 0.00012, blur)
                curve = v - 0.05 * math.sin(u * 42) * math.exp(-6 * abs(u)) - 0.02
                axes = max(_line(u + 0.08, 0.0004, blur), _line(v + 0.09, 0.0004, blur))
                ink = max(0.35 * grid, 0.85 * _line(curve * 0.5, 0.0005, blur), 0.8 * axes)
            red, green, blue = paper + ink * (58 - paper), paper + ink * (70 - paper), paper - 6 + ink * (104 - paper)
            r, g, b = r + cover * (red - r), g + cover * (green - g), b + cover * (blue - b)
    return r, g, b


@compiled
def draw_rows(out: UInt8[np.ndarray, "h w 3"], first: int, last: int, half_x: float, half_y: float) -> None:
    """Draw rows [first, last) of the desk's top, `out` being all of it; row 0 is at y = half_y."""
    h, w = out.shape[0], out.shape[1]
    texel = 2 * half_x / w
    for i in range(first, last):
        y = half_y * (1 - 2 * (i + 0.5) / h)
        for j in range(w):
            r, g, b = _desk_colour(half_x * (2 * (j + 0.5) / w - 1), y, texel)
            out[i, j, 0] = int(min(max(r, 0.0), 255.0) + 0.5)
            out[i, j, 1] = int(min(max(g, 0.0), 255.0) + 0.5)
            out[i, j, 2] = int(min(max(b, 0.0), 255.0) + 0.5)
