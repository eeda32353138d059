"""Drawing labels on an image with OpenCV: smooth lines with a dark halo, tags that keep out of each other's way."""

import math
import unicodedata
from collections.abc import Sequence

import cv2
import numpy as np
from jaxtyping import Float, UInt8

Color = tuple[int, int, int]
"""Blue, green, red, 0 to 255."""

_SHIFT = 4
"""OpenCV takes coordinates as integers of 1/16 pixel."""

_COMFORTABLE = 1280
"""Pixels of the longer side that a picture should have: smaller images are enlarged by a whole number."""

_FONT = cv2.FONT_HERSHEY_DUPLEX
_HALO: Color = (18, 18, 18)
_WHITE: Color = (255, 255, 255)
_DARK: Color = (24, 24, 24)
_LONGEST_NAME = 28


def color_of(hexadecimal: str) -> Color:
    """The colour `#rrggbb`."""
    red, green, blue = bytes.fromhex(hexadecimal.removeprefix("#"))
    return blue, green, red


def readable_on(color: Color) -> Color:
    """Dark or white, whichever has the stronger contrast with `color` (WCAG 2.2's relative luminance)."""
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in (v / 255 for v in color)]
    luminance = 0.0722 * linear[0] + 0.7152 * linear[1] + 0.2126 * linear[2]
    return _DARK if (luminance + 0.05) / (0.0089 + 0.05) > 1.05 / (luminance + 0.05) else _WHITE


def plain(text: str) -> str:
    """`text` in the letters that OpenCV's fonts have: accents are dropped, what is left over becomes `?`."""
    if len(text) > _LONGEST_NAME:
        text = text[: _LONGEST_NAME - 3] + "..."
    decomposed = unicodedata.normalize("NFKD", text)
    kept = (c for c in decomposed if not unicodedata.combining(c))
    return "".join(c if " " <= c <= "~" else "?" for c in kept)


class Canvas:
    """A picture that is being drawn on. Coordinates given to it are the image's own, whatever its enlargement."""

    def __init__(self, image: UInt8[np.ndarray, "h w 3"]) -> None:
        height, width = image.shape[:2]
        self._scale = math.ceil(_COMFORTABLE / max(height, width))
        size = (width * self._scale, height * self._scale)
        enlarged = cv2.resize(image, size, interpolation=cv2.INTER_CUBIC)
        self.pixels: UInt8[np.ndarray, "h w 3"] = np.ascontiguousarray(enlarged)
        # Everything is sized by the picture, so that it looks the same at any resolution.
        self._unit = max(size) / _COMFORTABLE
        self._taken: list[tuple[int, int, int, int]] = []

    def fill(self, ring: Float[np.ndarray, "k 2"], color: Color, *, opacity: float) -> None:
        """Tint the area within a ring."""
        if len(ring) < 3:
            return
        layer = self.pixels.copy()
        cv2.fillPoly(layer, [self._fixed(ring)], color, cv2.LINE_AA, _SHIFT)
        self._blend(layer, opacity)

    def fill_rings(self, rings: Sequence[Float[np.ndarray, "k 2"]], color: Color, *, opacity: float) -> None:
        """Tint the area within rings, holes left out (the even-odd rule)."""
        if not rings:
            return
        layer = self.pixels.copy()
        cv2.fillPoly(layer, [self._fixed(ring) for ring in rings], color, cv2.LINE_AA, _SHIFT)
        self._blend(layer, opacity)

    def dot(self, point: Float[np.ndarray, "2"], color: Color, *, hollow: bool) -> None:
        """Mark a point, with a ring where it is hollow."""
        x, y = self._fixed(point[None])[0].tolist()
        for radius, ink in ((5.0, _HALO), (4.0, color)) if not hollow else ((5.0, _HALO), (4.0, color), (2.2, _HALO)):
            size = round(radius * self._unit * (1 << _SHIFT))
            cv2.circle(self.pixels, (x, y), size, ink, -1, cv2.LINE_AA, _SHIFT)

    def lines(self, polylines: Sequence[Float[np.ndarray, "k 2"]], color: Color, *, width: float) -> None:
        """Draw polylines over their common halo."""
        fixed = [self._fixed(line) for line in polylines]
        layer = self.pixels.copy()
        cv2.polylines(layer, fixed, False, _HALO, self._width(width + 3.0), cv2.LINE_AA, _SHIFT)
        self._blend(layer, 0.55)
        cv2.polylines(self.pixels, fixed, False, color, self._width(width), cv2.LINE_AA, _SHIFT)

    def rectangle(self, bbox: tuple[float, float, float, float], color: Color) -> None:
        """Draw a bounding box, thinly."""
        x0, y0, x1, y1 = bbox
        ring = self._fixed(np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]]))
        layer = self.pixels.copy()
        cv2.polylines(layer, [ring], True, _HALO, self._width(3.0), cv2.LINE_AA, _SHIFT)
        self._blend(layer, 0.4)
        cv2.polylines(self.pixels, [ring], True, color, self._width(1.0), cv2.LINE_AA, _SHIFT)

    def tag(self, bbox: tuple[float, float, float, float], name: str, note: str, color: Color) -> None:
        """Write a name and a note on the colour, at a corner of the bounding box where nothing is written yet."""
        size, pad = 0.52 * self._unit, round(6 * self._unit)
        texts = [plain(name), *([note] if note else [])]
        widths = [cv2.getTextSize(text, _FONT, size, 1)[0][0] for text in texts]
        line = cv2.getTextSize("Ag", _FONT, size, 1)[0][1]
        width, height = sum(widths) + (1 + len(texts)) * pad, line + 2 * pad
        x, y = self._free_place(bbox, width, height)
        self._taken.append((x, y, x + width, y + height))
        cv2.rectangle(self.pixels, (x - 1, y - 1), (x + width, y + height), _HALO, -1)
        cv2.rectangle(self.pixels, (x, y), (x + width - 1, y + height - 1), color, -1)
        ink = readable_on(color)
        baseline = y + pad + line
        left = x + pad
        for text, wide in zip(texts, widths, strict=True):
            self._write(text, (left, baseline), size, ink)
            left += wide + pad

    def caption(self, left: str, right: str) -> None:
        """Write on a strip added below the image, where it hides nothing. Drawn last."""
        size, pad = 0.6 * self._unit, round(10 * self._unit)
        line = cv2.getTextSize("Ag", _FONT, size, 1)[0][1]
        strip = line + 2 * pad
        self.pixels = cv2.copyMakeBorder(self.pixels, 0, strip, 0, 0, cv2.BORDER_CONSTANT, value=_HALO)
        height, width = self.pixels.shape[:2]
        self._write(plain(left), (pad, height - pad), size, _WHITE)
        right_width = cv2.getTextSize(right, _FONT, size, 1)[0][0]
        self._write(right, (width - pad - right_width, height - pad), size, (200, 200, 200))

    def _free_place(self, bbox: tuple[float, float, float, float], width: int, height: int) -> tuple[int, int]:
        """The top left corner for a tag: above the box, below it, inside it; else beside the tags in its way."""
        high, wide = self.pixels.shape[:2]
        x0, y0, x1, y1 = (round(v * self._scale) for v in bbox)
        places = [(x0, y0 - height), (x1 - width, y0 - height), (x0, y1), (x1 - width, y1), (x0, y0), (x0, y1 - height)]
        places += [(x0, y0 + step * height) for step in range(1, 20)]
        inside = [(min(max(x, 0), wide - width), min(max(y, 0), high - height)) for x, y in places]
        return next((place for place in inside if self._is_free(place, width, height)), inside[0])

    def _is_free(self, place: tuple[int, int], width: int, height: int) -> bool:
        x, y = place
        return all(x >= x1 or x + width <= x0 or y >= y1 or y + height <= y0 for x0, y0, x1, y1 in self._taken)

    def _write(self, text: str, at: tuple[int, int], size: float, ink: Color) -> None:
        cv2.putText(self.pixels, text, at, _FONT, size, ink, max(1, round(self._unit)), cv2.LINE_AA)

    def _width(self, width: float) -> int:
        return max(1, round(width * self._unit))

    def _blend(self, layer: UInt8[np.ndarray, "h w 3"], opacity: float) -> None:
        cv2.addWeighted(layer, opacity, self.pixels, 1 - opacity, 0, dst=self.pixels)

    def _fixed(self, points: Float[np.ndarray, "k 2"]) -> np.ndarray:
        """Image coordinates as OpenCV's fixed-point pixels of the enlarged picture (a pixel's centre at integers)."""
        return np.round((points * self._scale - 0.5) * (1 << _SHIFT)).astype(np.int32)
