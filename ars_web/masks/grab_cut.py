"""GrabCut (Rother, Kolmogorov and Blake 2004, by OpenCV) round a rough rectangle or from scribbles.

It works on the part of the photograph round the prompt, at a limited resolution, so that it takes the same time for
a photograph of any size.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, UInt8

from ars_web.errors import BadInput
from ars_web.geometry.mask_regions import mask_from_polygons, stroke
from ars_web.masks.segmenter import SegmentPrompt, Stroke

LONGEST_SIDE = 240
"""Pixels of the part that is worked on; a larger part is made smaller first."""

MARGIN = 0.15
"""How far the part reaches beyond the prompt, of the prompt's longer side: what is behind the object. What lies
further off is something else as often as not."""

LEAST_MARGIN = 8
"""Pixels."""

ITERATIONS = 5

CERTAIN = 0.5
LIKELY = 0.9
"""Of a rectangle round the object: within ellipses so large, it certainly is and is likely to be the object."""

SMALLEST_PIECE = 0.02
"""Of the largest piece's area. What is smaller is a fleck of the same colour."""

REACH_OF_STROKES = 120
"""Pixels round scribbles within which the object is looked for, where there is no rectangle."""


@dataclass(frozen=True)
class _Part:
    """A part of a photograph, [x0, x1) x [y0, y1) pixels, at `scale` times its size."""

    x0: int
    y0: int
    x1: int
    y1: int
    scale: float

    @property
    def shape(self) -> tuple[int, int]:
        return (
            max(1, round((self.y1 - self.y0) * self.scale)),
            max(1, round((self.x1 - self.x0) * self.scale)),
        )


class GrabCutSegmenter:
    """The segmenter that needs no weights."""

    def segment(self, image: UInt8[np.ndarray, "h w 3"], prompt: SegmentPrompt) -> Bool[np.ndarray, "h w"]:
        """As `Segmenter.segment`."""
        height, width = image.shape[:2]
        check_prompt(prompt, width=width, height=height)
        reach = _reach(prompt, width=width, height=height)
        part = _part(reach, width=width, height=height)
        rows, columns = part.shape
        window = image[part.y0 : part.y1, part.x0 : part.x1]
        small = np.ascontiguousarray(cv2.resize(window, (columns, rows), interpolation=cv2.INTER_AREA))
        trimap = _trimap(prompt, reach, part)
        if not ((trimap == cv2.GC_FGD) | (trimap == cv2.GC_PR_FGD)).any():
            raise BadInput("the strokes beside the object leave nothing of it: take some back, or draw one on it")
        if not ((trimap == cv2.GC_BGD) | (trimap == cv2.GC_PR_BGD)).any():
            raise BadInput("nothing beside the object is left in the photograph: draw a stroke where it is not")
        cut(small, trimap)
        found = (trimap == cv2.GC_FGD) | (trimap == cv2.GC_PR_FGD)
        found = without_flecks(found, kept=trimap == cv2.GC_FGD)
        if not found.any():
            raise BadInput(
                "no object was found there: draw the rectangle a little larger than the object,"
                " or a stroke on the object and one beside it"
            )
        mask = np.zeros((height, width), dtype=np.bool_)
        mask[part.y0 : part.y1, part.x0 : part.x1] = _full_size(found, window.shape[:2])
        return mask


def check_prompt(prompt: SegmentPrompt, *, width: int, height: int) -> None:
    """Raises BadInput for a prompt that lies outside an image of `width` x `height` pixels."""
    if prompt.rectangle is not None:
        x0, y0, x1, y1 = prompt.rectangle
        if min(x1, width) - max(x0, 0) < 2 or min(y1, height) - max(y0, 0) < 2:
            raise BadInput(
                f"the rectangle {[round(side, 1) for side in prompt.rectangle]} lies outside the image, which is"
                f" {width} x {height} pixels, or covers less than 2 of them; draw it round the object"
            )
    if prompt.start is not None and prompt.start.shape != (height, width):
        raise BadInput(f"the mask to begin from must be {width} x {height} pixels as the image is")
    for drawn in prompt.inside:
        if not ((drawn.points >= 0) & (drawn.points <= (width, height))).all(axis=1).any():
            raise BadInput(
                f"a stroke on the object, from {drawn.points[0].tolist()}, lies outside the image, which is"
                f" {width} x {height} pixels"
            )


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


def _reach(prompt: SegmentPrompt, *, width: int, height: int) -> tuple[float, float, float, float]:
    """Within which the object lies: x0, y0, x1, y1, image coordinates, inside the image."""
    if prompt.rectangle is not None:
        x0, y0, x1, y1 = prompt.rectangle
    else:
        corners = [drawn.points for drawn in prompt.inside]
        margin = REACH_OF_STROKES
        if prompt.start is not None and prompt.start.any():
            rows, columns = np.flatnonzero(prompt.start.any(axis=1)), np.flatnonzero(prompt.start.any(axis=0))
            corners.append(np.array([[columns[0], rows[0]], [columns[-1] + 1, rows[-1] + 1]], dtype=np.float64))
            margin = max(LEAST_MARGIN, MARGIN * float(np.ptp(corners[-1], axis=0).max()))
        points = np.concatenate(corners)
        (x0, y0), (x1, y1) = points.min(axis=0) - margin, points.max(axis=0) + margin
    return max(float(x0), 0.0), max(float(y0), 0.0), min(float(x1), float(width)), min(float(y1), float(height))


def _part(reach: tuple[float, float, float, float], *, width: int, height: int) -> _Part:
    x0, y0, x1, y1 = reach
    margin = max(LEAST_MARGIN, MARGIN * max(x1 - x0, y1 - y0))
    left, top = max(0, int(x0 - margin)), max(0, int(y0 - margin))
    right, bottom = min(width, int(np.ceil(x1 + margin))), min(height, int(np.ceil(y1 + margin)))
    return _Part(left, top, right, bottom, min(1.0, LONGEST_SIDE / max(right - left, bottom - top)))


def _trimap(prompt: SegmentPrompt, reach: tuple[float, float, float, float], part: _Part) -> UInt8[np.ndarray, "h w"]:
    """What is known of each pixel of the part, as GrabCut takes it."""
    rows, columns = part.shape
    # Pixel centres, image coordinates.
    y = part.y0 + (np.arange(rows)[:, None] + 0.5) * (part.y1 - part.y0) / rows
    x = part.x0 + (np.arange(columns) + 0.5) * (part.x1 - part.x0) / columns
    x0, y0, x1, y1 = reach
    within = (x >= x0) & (x <= x1) & (y >= y0) & (y <= y1)
    trimap = np.where(within, cv2.GC_PR_BGD, cv2.GC_BGD).astype(np.uint8)
    if prompt.start is not None:
        cropped = prompt.start[part.y0 : part.y1, part.x0 : part.x1].astype(np.uint8) * 255
        likely = cv2.resize(cropped, (columns, rows), interpolation=cv2.INTER_AREA) > 127
        trimap[likely & within] = cv2.GC_PR_FGD
    elif prompt.rectangle is not None:
        # The corners of a rectangle round most objects show what is behind them.
        out = 2 * np.hypot((x - (x0 + x1) / 2) / (x1 - x0), (y - (y0 + y1) / 2) / (y1 - y0))
        trimap[within & (out <= LIKELY)] = cv2.GC_PR_FGD
        trimap[within & (out <= CERTAIN)] = cv2.GC_FGD
    for strokes, value in ((prompt.inside, cv2.GC_FGD), (prompt.outside, cv2.GC_BGD)):
        for drawn in strokes:
            trimap[_painted(drawn, part)] = value
    return trimap


def _painted(drawn: Stroke, part: _Part) -> Bool[np.ndarray, "h w"]:
    rows, columns = part.shape
    scale = np.array([columns / (part.x1 - part.x0), rows / (part.y1 - part.y0)])
    # A brush finer than a pixel of the part still marks what it passes.
    width = max(drawn.width * part.scale, 1.5)
    return mask_from_polygons(stroke((drawn.points - (part.x0, part.y0)) * scale, width), columns, rows)


def _full_size(found: Bool[np.ndarray, "r c"], shape: tuple[int, ...]) -> Bool[np.ndarray, "h w"]:
    """A mask at the photograph's own resolution."""
    if found.shape == shape:
        return found
    height, width = shape[:2]
    return cv2.resize(found.astype(np.float32), (width, height), interpolation=cv2.INTER_LINEAR) >= 0.5
