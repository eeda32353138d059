"""GrabCut (Rother, Kolmogorov and Blake 2004, by OpenCV) round a rough rectangle or from scribbles.

It works on the part of the photograph round the prompt, at a limited resolution, so that it takes the same time for
a photograph of any size.
"""

import cv2
import numpy as np
from jaxtyping import Bool, UInt8

from ars_web.errors import BadInput
from ars_web.masks.prompt_part import PromptPart, prompt_part
from ars_web.masks.segmenter import SegmentPrompt

LONGEST_SIDE = 240
"""Pixels of the part that is worked on; a larger part is made smaller first."""

ITERATIONS = 5

CERTAIN = 0.5
LIKELY = 0.9
"""Of a rectangle round the object: within ellipses so large, it certainly is and is likely to be the object."""

SMALLEST_PIECE = 0.02
"""Of the largest piece's area. What is smaller is a fleck of the same colour."""


class GrabCutSegmenter:
    """The segmenter that needs no weights."""

    def segment(self, image: UInt8[np.ndarray, "h w 3"], prompt: SegmentPrompt) -> Bool[np.ndarray, "h w"]:
        """As `Segmenter.segment`."""
        height, width = image.shape[:2]
        part = prompt_part(prompt, width=width, height=height, longest_side=LONGEST_SIDE)
        trimap = _trimap(prompt, part)
        if not ((trimap == cv2.GC_FGD) | (trimap == cv2.GC_PR_FGD)).any():
            raise BadInput("the strokes beside the object leave nothing of it: take some back, or draw one on it")
        if not ((trimap == cv2.GC_BGD) | (trimap == cv2.GC_PR_BGD)).any():
            raise BadInput("nothing beside the object is left in the photograph: draw a stroke where it is not")
        cut(part.of(image), trimap)
        found = (trimap == cv2.GC_FGD) | (trimap == cv2.GC_PR_FGD)
        found = without_flecks(found, kept=trimap == cv2.GC_FGD)
        return part.in_photograph(found, width=width, height=height)


def cut(image: UInt8[np.ndarray, "h w 3"], trimap: UInt8[np.ndarray, "h w"], *, iterations: int = ITERATIONS) -> None:
    """Run GrabCut from a trimap, which becomes the answer."""
    # Its mixtures of colours begin from random centres: the same for the same question.
    cv2.setRNGSeed(0)
    # In Lab, shade and light on one surface differ in one channel of three.
    image = cv2.cvtColor(image, cv2.COLOR_BGR2LAB)
    background, foreground = np.zeros((1, 65)), np.zeros((1, 65))
    cv2.grabCut(image, trimap, (0, 0, 1, 1), background, foreground, iterations, cv2.GC_INIT_WITH_MASK)


def without_flecks(
    mask: Bool[np.ndarray, "h w"], *, kept: Bool[np.ndarray, "h w"] | None = None
) -> Bool[np.ndarray, "h w"]:
    """A mask without the pieces that are small beside its largest one; pieces that touch `kept` stay."""
    _, pieces, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    areas = stats[:, cv2.CC_STAT_AREA]
    stays = areas >= SMALLEST_PIECE * areas[1:].max(initial=1)
    if kept is not None:
        stays[np.unique(pieces[kept])] = True
    stays[0] = False
    _, holes, hole_stats, _ = cv2.connectedComponentsWithStats((~stays[pieces]).astype(np.uint8), connectivity=4)
    small = hole_stats[:, cv2.CC_STAT_AREA] < SMALLEST_PIECE * areas[1:].max(initial=1) / 4
    small[0] = False
    return stays[pieces] | small[holes]


def _trimap(prompt: SegmentPrompt, part: PromptPart) -> UInt8[np.ndarray, "h w"]:
    """What is known of each pixel of the part, as GrabCut takes it."""
    x0, y0, x1, y1 = part.reach
    x, y = part.centres
    within = part.within_reach
    trimap = np.where(within, cv2.GC_PR_BGD, cv2.GC_BGD).astype(np.uint8)
    likely = within & part.of_mask(prompt.start) if prompt.start is not None else np.zeros_like(within)
    if likely.any():
        trimap[likely] = cv2.GC_PR_FGD
    elif prompt.rectangle is not None:
        # The corners of a rectangle round most objects show what is behind them.
        out = 2 * np.hypot((x - (x0 + x1) / 2) / (x1 - x0), (y - (y0 + y1) / 2) / (y1 - y0))
        trimap[within & (out <= LIKELY)] = cv2.GC_PR_FGD
        trimap[within & (out <= CERTAIN)] = cv2.GC_FGD
    for strokes, value in ((prompt.inside, cv2.GC_FGD), (prompt.outside, cv2.GC_BGD)):
        for drawn in strokes:
            trimap[part.painted(drawn)] = value
    return trimap
