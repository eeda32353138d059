"""Rectangles cut out of images, in whole pixels."""

import math
import re
from dataclasses import dataclass

from ars_web.errors import BadInput

LEAST_MARGIN = 8
"""Pixels round a box, at least."""

MARGIN = 0.1
"""Of the box's longer side."""

UNIT = (32, 24)
"""What a crop round a box is a multiple of: 4 to 3, and in blocks of 8 pixels, in which JPEGs are decoded smaller."""

LEAST_UNITS = 3

BLOCK = 8


@dataclass(frozen=True)
class Crop:
    """The part of an image from (x0, y0) up to (x1, y1), image coordinates."""

    x0: int
    y0: int
    x1: int
    y1: int

    @property
    def width(self) -> int:
        """In pixels."""
        return self.x1 - self.x0

    def is_of_blocks(self, size: int) -> bool:
        """Whether it is made of whole squares of `size` pixels that are counted from the image's corner."""
        return not any(side % size for side in (self.x0, self.y0, self.x1, self.y1))


def crop_from_text(text: str, *, width: int, height: int) -> Crop:
    """The crop `x0,y0,x1,y1` of an image of that size.

    Raises:
        BadInput: it is not four whole numbers, is empty, or reaches beyond the image.
    """
    # Digits as ASCII knows them, and not more than any image has.
    if not re.fullmatch(r"[0-9]{1,6}(,[0-9]{1,6}){3}", text):
        raise BadInput(f"crop {text[:60]!r} must be four whole numbers x0,y0,x1,y1 in pixels, such as 0,0,320,240")
    x0, y0, x1, y1 = map(int, text.split(","))
    if x0 >= x1 or y0 >= y1:
        raise BadInput(f"crop {text} is empty; x1 must be more than x0, and y1 more than y0")
    if x1 > width or y1 > height:
        raise BadInput(f"crop {text} reaches beyond the image, which is {width} x {height} pixels")
    return Crop(x0, y0, x1, y1)


def crop_round(bbox: tuple[float, float, float, float], *, width: int, height: int) -> Crop:
    """What to show of an image of that size to see a box in it: the box with a margin, 4 to 3 where the image is large
    enough for that. `bbox` is in the image."""
    x0, y0, x1, y1 = bbox
    margin = max(MARGIN * max(x1 - x0, y1 - y0), LEAST_MARGIN)
    units = max((x1 - x0 + 2 * margin) / UNIT[0], (y1 - y0 + 2 * margin) / UNIT[1], LEAST_UNITS)
    wide, high = min(math.ceil(units) * UNIT[0], width), min(math.ceil(units) * UNIT[1], height)
    left = _start((x0 + x1) / 2, wide, width)
    top = _start((y0 + y1) / 2, high, height)
    return Crop(left, top, left + wide, top + high)


def _start(middle: float, length: int, whole: int) -> int:
    """Where a stretch of a length begins that has the middle in its middle, as far as the whole lets it."""
    return min(max(round((middle - length / 2) / BLOCK) * BLOCK, 0), whole - length)
