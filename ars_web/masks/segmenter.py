"""What every segmenter is: a photograph and a few hints in, the pixels of one object out."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from jaxtyping import Bool, Float, UInt8

from ars_web.errors import BadInput

WIDEST_STROKE = 1000.0
"""Pixels."""


@dataclass(frozen=True, eq=False)
class Stroke:
    """A brush drawn over a photograph.

    Attributes:
        points: (k, 2) its middle line, k >= 1, image coordinates; one point is a dab.
        width: of the brush, pixels.
    """

    points: Float[np.ndarray, "k 2"]
    width: float = 6.0

    def __post_init__(self) -> None:
        """Raises BadInput for no point, points that are not finite, or a width that no brush has."""
        points = np.array(self.points, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 2 or len(points) < 1 or not np.isfinite(points).all():
            raise BadInput(f"a stroke needs one or more points of two finite numbers, not {points.tolist()!r:.100}")
        if not 0 < self.width <= WIDEST_STROKE:
            raise BadInput(f"a brush is more than 0 and at most {WIDEST_STROKE:g} px wide, not {self.width:g}")
        points.flags.writeable = False
        object.__setattr__(self, "points", points)


@dataclass(frozen=True, eq=False)
class SegmentPrompt:
    """What a person says of an object in a photograph; at least one of the rectangle, `inside` and `start`.

    Attributes:
        rectangle: roughly round the object, (x0, y0, x1, y1), image coordinates, x0 < x1, y0 < y1; what lies outside
            of it is not the object.
        inside: strokes that lie on the object.
        outside: strokes that lie beside it.
        start: (h, w) a mask to begin from, such as the last answer.
    """

    rectangle: tuple[float, float, float, float] | None = None
    inside: tuple[Stroke, ...] = ()
    outside: tuple[Stroke, ...] = ()
    start: Bool[np.ndarray, "h w"] | None = None

    def __post_init__(self) -> None:
        """Raises BadInput where there is nothing to go by, or the rectangle is none."""
        if self.rectangle is None and not self.inside and (self.start is None or not self.start.any()):
            raise BadInput("nothing says where the object is: give a rectangle round it, or a stroke on it")
        if self.rectangle is not None:
            x0, y0, x1, y1 = self.rectangle
            if not (np.isfinite(self.rectangle).all() and x0 < x1 and y0 < y1):
                raise BadInput(
                    f"a rectangle is x0, y0, x1, y1 with x0 < x1 and y0 < y1, not {list(self.rectangle)};"
                    " drag it from one corner to the opposite one"
                )


class Segmenter(Protocol):
    """Finds the pixels of an object. The same photograph and prompt give the same answer."""

    def segment(self, image: UInt8[np.ndarray, "h w 3"], prompt: SegmentPrompt) -> Bool[np.ndarray, "h w"]:
        """The object's pixels in a photograph, blue green red; at least one of them.

        Raises:
            BadInput: the prompt does not fit the photograph, or nothing was found; the message says what to try.
        """
        ...
