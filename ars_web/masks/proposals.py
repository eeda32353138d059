"""Outlines of an object proposed in photographs where nobody drew one, by the colours of those where somebody did."""

from collections.abc import Sequence

import cv2
import numpy as np
from jaxtyping import Bool, UInt8

from ars_web.masks.close_up import CloseUp
from ars_web.masks.colour_models import MOST_PIXELS, ColourModels
from ars_web.masks.grab_cut import without_flecks

SMALLEST_AREA = 30
"""Pixels of a close-up. Fewer are no outline."""

CLEAR_STEP = 7.0
"""In one of the channels of 8-bit Lab, across an outline: what an edge is at least."""


class Palette:
    """The object's colours and those beside it, taken from close-ups in which its pixels are known."""

    def __init__(self, known: Sequence[tuple[CloseUp, Bool[np.ndarray, "h w"]]]) -> None:
        inside = [shot.lab[_shrunk(mask)] for shot, mask in known]
        if not any(len(pixels) for pixels in inside):
            inside = [shot.lab[mask] for shot, mask in known]
        self._foreground = np.concatenate(inside)
        share = MOST_PIXELS // (2 * max(1, len(known)))
        self._background = np.concatenate([_some(shot.lab[~_grown(mask, 2)], share) for shot, mask in known])

    def propose(self, shot: CloseUp, possible: Bool[np.ndarray, "h w"]) -> Bool[np.ndarray, "h w"] | None:
        """The object's pixels among the possible ones; None where there is no outline worth the name.

        What is impossible shows what is beside the object in this very photograph, and is learnt with the rest.
        """
        if np.count_nonzero(possible) < SMALLEST_AREA:
            return None
        beside = np.concatenate([self._background, _some(shot.lab[~possible], MOST_PIXELS // 2)])
        if len(beside) == 0 or len(self._foreground) == 0:
            return None
        models = ColourModels.learnt(self._foreground, beside)
        found = without_flecks(models.cut(shot.lab, possible)) & possible
        return found if np.count_nonzero(found) >= SMALLEST_AREA else None


def edge_agreement(shot: CloseUp, mask: Bool[np.ndarray, "h w"]) -> float:
    """The share of a mask's outline, where it is not the image's border, along which the photograph has an edge."""
    lab = shot.lab.astype(np.float32)
    across, down = cv2.Sobel(lab, cv2.CV_32F, 1, 0, scale=1 / 4), cv2.Sobel(lab, cv2.CV_32F, 0, 1, scale=1 / 4)
    step = cv2.dilate(np.hypot(across, down).max(axis=2), np.ones((3, 3), np.uint8))
    outline = mask & ~_shrunk(mask)
    outline[[0, -1]] = False
    outline[:, [0, -1]] = False
    return float((step[outline] >= CLEAR_STEP).mean()) if outline.any() else 1.0


def _shrunk(mask: Bool[np.ndarray, "h w"]) -> Bool[np.ndarray, "h w"]:
    return cv2.erode(mask.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0


def _grown(mask: Bool[np.ndarray, "h w"], pixels: int) -> Bool[np.ndarray, "h w"]:
    return cv2.dilate(mask.astype(np.uint8), np.ones((2 * pixels + 1,) * 2, np.uint8)) > 0


def _some(pixels: UInt8[np.ndarray, "n 3"], most: int) -> UInt8[np.ndarray, "m 3"]:
    """Every so many-th of the pixels, `most` of them at most."""
    return pixels[np.linspace(0, len(pixels) - 1, min(most, len(pixels))).astype(np.int64)]
