"""The recording round a ball with the ball in the pictures: red before blue tiles, in some of them half hidden."""

from pathlib import Path
from types import ModuleType

import cv2
import numpy as np

HIDDEN = (3, 7)
"""Frames in which something green stands before the left half of the ball."""


def picture(ring: ModuleType, frame: int) -> np.ndarray:
    """(h, w, 3) a frame's photograph, blue green red."""
    random = np.random.default_rng(frame)
    tiles = random.integers(0, 2, (ring.HEIGHT // 20, ring.WIDTH // 20, 1)) * np.array([60, 50, 40]) + [150, 90, 60]
    image = cv2.resize(tiles.astype(np.uint8), (ring.WIDTH, ring.HEIGHT), interpolation=cv2.INTER_NEAREST)
    outline = ring.outline(frame)
    # Pixel centres are at integers here, and coordinates have four binary places.
    corners = np.rint((outline - 0.5) * 16).astype(np.int32)
    cv2.fillPoly(image, [corners], (40, 30, 190), cv2.LINE_AA, 4)
    x0, y0, x1, y1 = *outline.min(axis=0), *outline.max(axis=0)
    middle, size = ((x0 + x1) / 2, (y0 + y1) / 2), (x1 - x0, y1 - y0)
    cv2.circle(image, (round(middle[0]), round(middle[1])), round(size[0] / 5), (40, 150, 220), -1, cv2.LINE_AA)
    if frame in HIDDEN:
        image[:, round(x0) - 8 : round(middle[0])] = (60, 170, 40)
    noisy = image + random.normal(0, 3, image.shape)
    return noisy.clip(0, 255).astype(np.uint8)


def write(ring: ModuleType, folder: Path) -> Path:
    """The recording as an ARS scene."""
    ring.write(folder)
    for frame in range(ring.FRAMES):
        path = folder / "images" / f"{frame:05d}.jpg"
        assert cv2.imwrite(str(path), picture(ring, frame), [cv2.IMWRITE_JPEG_QUALITY, 95])
    return folder
