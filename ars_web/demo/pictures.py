"""What is printed on things: small pictures drawn in numpy, sRGB colours 0 to 255, row 0 at the top.

`PICTURES` names them all but the desk's top, which is large and drawn in `desk_top.py`.
"""

import math
from collections.abc import Callable

import numpy as np
from jaxtyping import Float

Picture = Float[np.ndarray, "h w 3"]
Colour = tuple[int, int, int]

GLYPH_ROWS = {
    "A": (14, 17, 17, 31, 17, 17, 17),
    "C": (14, 17, 16, 16, 16, 17, 14),
    "D": (30, 17, 17, 17, 17, 17, 30),
    "E": (31, 16, 16, 30, 16, 16, 31),
    "F": (31, 16, 16, 30, 16, 16, 16),
    "H": (17, 17, 17, 31, 17, 17, 17),
    "I": (14, 4, 4, 4, 4, 4, 14),
    "L": (16, 16, 16, 16, 16, 16, 31),
    "M": (17, 27, 21, 21, 17, 17, 17),
    "N": (17, 25, 21, 19, 17, 17, 17),
    "O": (14, 17, 17, 17, 17, 17, 14),
    "R": (30, 17, 17, 30, 20, 18, 17),
    "S": (15, 16, 16, 14, 1, 1, 30),
    "T": (31, 4, 4, 4, 4, 4, 4),
}
"""Five by seven letters, one number a row, the leftmost dot in bit 4."""

DOT_STROKE = 0.62
"""Half the width of a letter's stroke, in dots."""


class _Sheet:
    """A picture being drawn on; lengths are in units of its width, x to the right and y down from the top left."""

    def __init__(self, width: int, height: int, colour: Colour) -> None:
        self.pixels: Picture = np.empty((height, width, 3))
        self.pixels[:] = colour
        self.aspect = height / width
        self._texel = 1.0 / width
        self.x, self.y = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / width)

    def _window(self, x0: float, y0: float, x1: float, y1: float) -> tuple[slice, slice]:
        """The pixels of a rectangle and two more on each side: nothing is drawn beyond a figure's border."""
        height, width = self.x.shape
        x0, y0, x1, y1 = (value / self._texel for value in (x0, y0, x1, y1))
        return (
            slice(max(math.floor(y0) - 2, 0), min(max(math.ceil(y1) + 2, 0), height)),
            slice(max(math.floor(x0) - 2, 0), min(max(math.ceil(x1) + 2, 0), width)),
        )

    def fill(
        self,
        distance: Float[np.ndarray, "a b"],
        colour: Colour,
        *,
        window: tuple[slice, slice] = (slice(None), slice(None)),
        opacity: float = 1.0,
    ) -> None:
        """Paint where the distance to a figure's border is negative, its edge one texel soft."""
        cover = np.clip(0.5 - distance / self._texel, 0, 1)[..., None] * opacity
        self.pixels[window] += cover * (np.array(colour) - self.pixels[window])

    def rectangle(
        self, x0: float, y0: float, x1: float, y1: float, colour: Colour, *, corner: float = 0.0, opacity: float = 1.0
    ) -> None:
        window = self._window(x0, y0, x1, y1)
        dx = np.abs(self.x[window] - (x0 + x1) / 2) - (x1 - x0) / 2 + corner
        dy = np.abs(self.y[window] - (y0 + y1) / 2) - (y1 - y0) / 2 + corner
        outside = np.hypot(np.maximum(dx, 0), np.maximum(dy, 0)) + np.minimum(np.maximum(dx, dy), 0)
        self.fill(outside - corner, colour, window=window, opacity=opacity)

    def disc(self, x: float, y: float, radius: float, colour: Colour, *, squash: float = 1.0, turn: float = 0) -> None:
        """A disc, or an ellipse: `radius` along `turn`, `squash` times that across."""
        window = self._window(x - radius, y - radius, x + radius, y + radius)
        dx, dy = self.x[window] - x, self.y[window] - y
        c, s = math.cos(turn), math.sin(turn)
        along, across = c * dx + s * dy, (c * dy - s * dx) / squash
        self.fill((np.hypot(along, across) - radius) * squash, colour, window=window)

    def text(self, words: str, x: float, y: float, height: float, colour: Colour) -> None:
        """One line of words, centred on (x, y)."""
        dot = height / 7
        left = x - dot * (6 * len(words) - 1) / 2
        for letter in words:
            if letter != " ":
                self._letter(GLYPH_ROWS[letter], left, y - height / 2, dot, colour)
            left += 6 * dot

    def _letter(self, rows: tuple[int, ...], left: float, top: float, dot: float, colour: Colour) -> None:
        """One glyph: every dot joined to its neighbours by strokes with round ends."""
        window = self._window(left - dot, top - dot, left + 6 * dot, top + 8 * dot)
        nearest = np.full_like(self.x[window], np.inf)
        dots = {(i, j) for i, row in enumerate(rows) for j in range(5) if row >> (4 - j) & 1}
        for i, j in dots:
            straight = [(0, 0), (0, 1), (1, 0)]
            # A slanting stroke only where no straight ones join the two dots already.
            slanting = [(1, d) for d in (-1, 1) if (i, j + d) not in dots and (i + 1, j) not in dots]
            px, py = self.x[window] - (left + (j + 0.5) * dot), self.y[window] - (top + (i + 0.5) * dot)
            for di, dj in straight + slanting:
                if (i + di, j + dj) in dots:
                    bx, by = dj * dot, di * dot
                    t = np.clip((px * bx + py * by) / max(bx * bx + by * by, 1e-12), 0, 1)
                    np.minimum(nearest, np.hypot(px - t * bx, py - t * by), out=nearest)
        self.fill(nearest - DOT_STROKE * dot, colour, window=window)

    def barcode(self, x: float, y: float, width: float, height: float) -> None:
        self.rectangle(x, y, x + width, y + height, (250, 250, 247), corner=0.01)
        bars = np.random.default_rng(7).random(38) < 0.5
        step = width * 0.86 / len(bars)
        for i in np.flatnonzero(bars):
            left = x + 0.07 * width + i * step
            self.rectangle(left, y + 0.12 * height, left + step, y + 0.88 * height, (25, 25, 28))

    def small_print(self, x: float, y: float, width: float, lines: int, colour: Colour) -> None:
        for i, share in enumerate(np.random.default_rng(lines).uniform(0.6, 1.0, lines)):
            top = y + i * 0.038
            self.rectangle(x, top, x + width * share, top + 0.016, colour, corner=0.007, opacity=0.75)


def _tea_front() -> Picture:
    s = _Sheet(420, 550, (28, 92, 84))
    s.rectangle(0.05, 0.05, 0.95, s.aspect - 0.05, (236, 226, 198), corner=0.05)
    s.rectangle(0.07, 0.07, 0.93, s.aspect - 0.07, (28, 92, 84), corner=0.04)
    s.disc(0.5, 0.50, 0.31, (236, 226, 198))
    for turn in (-1.15, -0.25, 0.65):
        middle = (0.5 + 0.15 * math.cos(turn - 0.6), 0.60 + 0.17 * math.sin(turn - 0.6))
        s.disc(*middle, 0.16, (88, 140, 60), squash=0.36, turn=turn - 0.6)
        s.disc(*middle, 0.15, (52, 104, 48), squash=0.05, turn=turn - 0.6)
    s.rectangle(0.07, 0.90, 0.93, 1.13, (196, 84, 44))
    s.text("TEA", 0.5, 1.015, 0.15, (250, 240, 214))
    s.text("FINE", 0.5, 0.145, 0.06, (236, 226, 198))
    return s.pixels


def _tea_side() -> Picture:
    s = _Sheet(210, 550, (28, 92, 84))
    s.rectangle(0.0, 1.8, 1.0, 2.26, (196, 84, 44))
    s.text("TEA", 0.5, 2.03, 0.2, (250, 240, 214))
    s.rectangle(0.12, 0.15, 0.88, 1.1, (236, 226, 198), corner=0.05)
    s.small_print(0.2, 0.26, 0.6, 19, (60, 70, 66))
    s.barcode(0.18, 1.25, 0.64, 0.4)
    return s.pixels


def _tea_end() -> Picture:
    s = _Sheet(420, 210, (24, 80, 73))
    s.rectangle(0.0, 0.24, 1.0, 0.26, (16, 58, 53))
    s.disc(0.5, 0.25, 0.1, (236, 226, 198))
    s.disc(0.5, 0.25, 0.07, (88, 140, 60), squash=0.4, turn=-0.7)
    return s.pixels


def _chocolate_top() -> Picture:
    s = _Sheet(640, 320, (92, 30, 48))
    s.rectangle(0.02, 0.02, 0.98, 0.48, (202, 160, 84), corner=0.015)
    s.rectangle(0.027, 0.027, 0.973, 0.473, (92, 30, 48), corner=0.012)
    s.text("CHOCOLATE", 0.38, 0.17, 0.068, (238, 204, 136))
    s.small_print(0.12, 0.28, 0.42, 3, (222, 182, 116))
    for i in range(2):
        for j in range(3):
            x, y = 0.70 + 0.085 * j, 0.15 + 0.115 * i
            s.rectangle(x, y, x + 0.075, y + 0.1, (66, 36, 22), corner=0.012)
            s.rectangle(x + 0.012, y + 0.012, x + 0.063, y + 0.086, (104, 60, 38), corner=0.01)
    return s.pixels


def _chocolate_side() -> Picture:
    s = _Sheet(640, 92, (78, 24, 40))
    s.rectangle(0.0, 0.066, 1.0, 0.074, (202, 160, 84))
    s.text("CHOCOLATE", 0.5, 0.066, 0.04, (238, 204, 136))
    return s.pixels


def _chocolate_end() -> Picture:
    s = _Sheet(320, 92, (78, 24, 40))
    s.barcode(0.28, 0.04, 0.44, 0.2)
    return s.pixels


def _die(count: int) -> Callable[[], Picture]:
    places = {
        1: ((0, 0),),
        2: ((-1, -1), (1, 1)),
        3: ((-1, -1), (0, 0), (1, 1)),
        4: ((-1, -1), (1, 1), (-1, 1), (1, -1)),
        5: ((-1, -1), (1, 1), (-1, 1), (1, -1), (0, 0)),
        6: ((-1, -1), (1, 1), (-1, 1), (1, -1), (-1, 0), (1, 0)),
    }

    def draw() -> Picture:
        s = _Sheet(192, 192, (188, 176, 152))
        s.rectangle(0.03, 0.03, 0.97, 0.97, (240, 230, 206), corner=0.1)
        for x, y in places[count]:
            s.disc(0.5 + 0.26 * x, 0.5 + 0.26 * y, 0.095, (186, 42, 38) if count == 1 else (34, 36, 52))
        return s.pixels

    return draw


def _cola() -> Picture:
    s = _Sheet(1024, 560, (190, 22, 34))
    wave = s.y - 0.37 - 0.035 * np.sin(4 * math.pi * s.x)
    s.fill(np.abs(wave) - 0.028, (244, 242, 238))
    s.fill(np.abs(wave - 0.052) - 0.008, (244, 206, 120))
    for x in (0.25, 0.75):
        s.text("COLA", x, 0.2, 0.15, (250, 246, 240))
    s.barcode(0.45, 0.43, 0.1, 0.075)
    for y0, y1 in ((0.0, 0.022), (0.528, 0.547)):
        s.rectangle(0, y0, 1, y1, (198, 200, 204))
    return s.pixels


def _can_end() -> Picture:
    s = _Sheet(256, 256, (196, 198, 202))
    for radius, shade in ((0.46, 150), (0.445, 214), (0.40, 176), (0.385, 204)):
        s.disc(0.5, 0.5, radius, (shade, shade + 2, shade + 5))
    s.disc(0.5, 0.36, 0.13, (168, 170, 174), squash=0.8)
    s.disc(0.5, 0.47, 0.14, (222, 224, 228), squash=0.62, turn=math.pi / 2)
    s.disc(0.5, 0.53, 0.06, (150, 152, 156), squash=0.8)
    return s.pixels


def _tin_end() -> Picture:
    s = _Sheet(256, 256, (188, 186, 180))
    for i, radius in enumerate(np.linspace(0.47, 0.12, 9)):
        shade = 166 if i % 2 else 208
        s.disc(0.5, 0.5, float(radius), (shade, shade, shade - 4))
    return s.pixels


def _tomato() -> Picture:
    s = _Sheet(1024, 450, (244, 236, 214))
    s.rectangle(0, 0.0, 1, 0.022, (190, 188, 182))
    s.rectangle(0, 0.418, 1, 0.44, (190, 188, 182))
    s.rectangle(0, 0.05, 1, 0.14, (44, 110, 62))
    s.rectangle(0, 0.36, 1, 0.39, (44, 110, 62))
    for x in (0.25, 0.75):
        s.text("TOMATO", x, 0.095, 0.055, (250, 244, 226))
        s.disc(x, 0.25, 0.085, (206, 48, 34), squash=0.9)
        s.disc(x - 0.03, 0.22, 0.02, (236, 120, 96), squash=0.6, turn=-0.6)
        for turn in np.linspace(0, 2 * math.pi, 5, endpoint=False):
            s.disc(
                x + 0.022 * math.cos(turn),
                0.186 + 0.012 * math.sin(turn),
                0.024,
                (58, 128, 56),
                squash=0.3,
                turn=float(turn),
            )
    s.small_print(0.45, 0.18, 0.1, 4, (70, 70, 66))
    return s.pixels


def _tennis() -> Picture:
    s = _Sheet(512, 256, (196, 212, 58))
    fuzz = np.random.default_rng(3).normal(0, 9, (256, 512, 1))
    s.pixels += fuzz
    azimuth, polar = 2 * math.pi * s.x, 2 * math.pi * s.y
    # The seam: the curve on the unit ball with x = a cos t + b cos 3t, y = a sin t - b sin 3t, z = c sin 2t.
    point = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], axis=-1)
    t = np.linspace(0, 2 * math.pi, 240, endpoint=False)
    a, b = 0.75, 0.25
    seam = np.stack(
        [a * np.cos(t) + b * np.cos(3 * t), a * np.sin(t) - b * np.sin(3 * t), 2 * math.sqrt(a * b) * np.sin(2 * t)],
        axis=-1,
    )
    closest = np.max(point.astype(np.float32) @ seam.T.astype(np.float32), axis=-1).astype(np.float64)
    s.fill((np.arccos(np.clip(closest, -1, 1)) - 0.055) / (2 * math.pi), (236, 238, 222))
    return s.pixels


def _beach() -> Picture:
    s = _Sheet(768, 384, (244, 242, 236))
    colours = ((222, 62, 48), (244, 242, 236), (38, 108, 176), (244, 242, 236), (240, 186, 48), (244, 242, 236))
    for i, colour in enumerate(colours):
        s.rectangle(i / 6, 0, (i + 1) / 6, s.aspect, colour)
    s.rectangle(0, 0, 1, 0.05, (244, 242, 236))
    s.rectangle(0, s.aspect - 0.05, 1, s.aspect, (244, 242, 236))
    return s.pixels


def _mug_outside() -> Picture:
    s = _Sheet(1024, 380, (46, 92, 142))
    s.rectangle(0, 0, 1, 0.018, (232, 228, 216))
    s.rectangle(0, 0.27, 1, 0.292, (232, 228, 216))
    for i in range(16):
        s.disc((i + 0.5) / 16, 0.15, 0.02, (232, 228, 216))
        s.disc((i + 0.5) / 16, 0.15, 0.011, (212, 120, 62))
        s.disc(i / 16, 0.21, 0.008, (232, 228, 216))
        s.disc(i / 16, 0.09, 0.008, (232, 228, 216))
    return s.pixels


def _tape_ring() -> Picture:
    s = _Sheet(256, 64, (206, 164, 96))
    turns = np.random.default_rng(5).normal(0, 7, (64, 1, 1))
    s.pixels += turns
    s.rectangle(0, 0, 1, 0.05, (166, 132, 92))
    return s.pixels


def _plain(colour: Colour) -> Callable[[], Picture]:
    return lambda: _Sheet(8, 8, colour).pixels


PICTURES: dict[str, Callable[[], Picture]] = {
    "tea front": _tea_front,
    "tea side": _tea_side,
    "tea end": _tea_end,
    "chocolate top": _chocolate_top,
    "chocolate side": _chocolate_side,
    "chocolate end": _chocolate_end,
    **{f"die {count}": _die(count) for count in range(1, 7)},
    "cola": _cola,
    "can end": _can_end,
    "tomato": _tomato,
    "tin end": _tin_end,
    "tennis": _tennis,
    "beach": _beach,
    "mug outside": _mug_outside,
    "mug inside": _plain((232, 228, 216)),
    "mug handle": _plain((46, 92, 142)),
    "coffee": _plain((58, 34, 20)),
    "tape outside": _plain((206, 160, 88)),
    "tape inside": _plain((172, 138, 98)),
    "tape ring": _tape_ring,
    "desk side": _plain((122, 84, 54)),
}
