"""The part of a photograph that a segmenter looks at: round what was said of the object, at a limited resolution."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8

from ars_web.errors import BadInput
from ars_web.geometry.mask_regions import mask_from_polygons, stroke
from ars_web.masks.segmenter import SegmentPrompt, Stroke

MARGIN = 0.15
"""How far the part reaches beyond the prompt, of the prompt's longer side: what is behind the object. What lies
further off is something else as often as not."""

LEAST_MARGIN = 8
"""Pixels."""

LARGEST_SCALE = 2.0
"""A small part is enlarged, so that its outline can run between its pixels."""

REACH_OF_STROKES = 120
"""Pixels round scribbles within which the object is looked for, where there is no rectangle."""


@dataclass(frozen=True)
class PromptPart:
    """A part of a photograph, [x0, x1) x [y0, y1) pixels, made to a size of its own.

    Attributes:
        shape: rows and columns that it is looked at in.
        reach: within which the object lies: x0, y0, x1, y1, image coordinates of the photograph.
    """

    x0: int
    y0: int
    x1: int
    y1: int
    shape: tuple[int, int]
    reach: tuple[float, float, float, float]

    @property
    def scale(self) -> Float[np.ndarray, "2"]:
        """Columns for a pixel across, and rows for one down."""
        return np.array([self.shape[1] / (self.x1 - self.x0), self.shape[0] / (self.y1 - self.y0)])

    @property
    def centres(self) -> tuple[Float[np.ndarray, "1 w"], Float[np.ndarray, "h 1"]]:
        """x of the columns' middles and y of the rows', image coordinates of the photograph."""
        rows, columns = self.shape
        x = self.x0 + (np.arange(columns)[None, :] + 0.5) / self.scale[0]
        y = self.y0 + (np.arange(rows)[:, None] + 0.5) / self.scale[1]
        return x, y

    @property
    def within_reach(self) -> Bool[np.ndarray, "h w"]:
        """Where the object can be."""
        x, y = self.centres
        x0, y0, x1, y1 = self.reach
        return (x >= x0) & (x <= x1) & (y >= y0) & (y <= y1)

    def of(self, image: UInt8[np.ndarray, "h w 3"]) -> UInt8[np.ndarray, "r c 3"]:
        """The part of a photograph."""
        window = image[self.y0 : self.y1, self.x0 : self.x1]
        # What is enlarged stays sharp: colours between the object's and those beside it would count as the object's.
        smooth = cv2.INTER_AREA if self.scale[0] <= 1 else cv2.INTER_NEAREST
        return np.ascontiguousarray(cv2.resize(window, self.shape[::-1], interpolation=smooth))

    def of_mask(self, mask: Bool[np.ndarray, "h w"]) -> Bool[np.ndarray, "r c"]:
        """The part of a mask."""
        window = mask[self.y0 : self.y1, self.x0 : self.x1].astype(np.uint8) * 255
        return cv2.resize(window, self.shape[::-1], interpolation=cv2.INTER_AREA) > 127

    def painted(self, drawn: Stroke) -> Bool[np.ndarray, "r c"]:
        """What a brush covers."""
        # A brush finer than a pixel of the part still marks what it passes.
        width = max(drawn.width * float(self.scale.mean()), 1.5)
        path = (drawn.points - (self.x0, self.y0)) * self.scale
        return mask_from_polygons(stroke(path, width), self.shape[1], self.shape[0])

    def in_photograph(self, found: Bool[np.ndarray, "r c"], *, width: int, height: int) -> Bool[np.ndarray, "h w"]:
        """A mask of the part as one of the photograph.

        Raises:
            BadInput: it is empty.
        """
        mask = np.zeros((height, width), dtype=np.bool_)
        size = (self.x1 - self.x0, self.y1 - self.y0)
        mask[self.y0 : self.y1, self.x0 : self.x1] = (
            cv2.resize(found.astype(np.float32), size, interpolation=cv2.INTER_LINEAR) >= 0.5
        )
        if not mask.any():
            raise BadInput(
                "no object was found there: draw the rectangle a little larger than the object, or a stroke on the"
                " object and one beside it"
            )
        return mask


def prompt_part(
    prompt: SegmentPrompt, *, width: int, height: int, longest_side: int, square: bool = False
) -> PromptPart:
    """The part of an image of `width` x `height` pixels round a prompt; its longer side has up to `longest_side` rows
    or columns. `square`: both sides have that many, whatever the part's own.

    Raises:
        BadInput: the prompt lies outside the image.
    """
    check_prompt(prompt, width=width, height=height)
    reach = _reach(prompt, width=width, height=height)
    x0, y0, x1, y1 = reach
    margin = max(LEAST_MARGIN, MARGIN * max(x1 - x0, y1 - y0))
    left, top = max(0, int(x0 - margin)), max(0, int(y0 - margin))
    right, bottom = min(width, int(np.ceil(x1 + margin))), min(height, int(np.ceil(y1 + margin)))
    if square:
        return PromptPart(left, top, right, bottom, (longest_side, longest_side), reach)
    scale = min(LARGEST_SCALE, longest_side / max(right - left, bottom - top))
    shape = (max(1, round((bottom - top) * scale)), max(1, round((right - left) * scale)))
    return PromptPart(left, top, right, bottom, shape, reach)


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


def _reach(prompt: SegmentPrompt, *, width: int, height: int) -> tuple[float, float, float, float]:
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
