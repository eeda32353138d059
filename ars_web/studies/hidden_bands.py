"""What hiding costs: how far pairs overlap by how much nearer objects leave to see."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ars_web.geometry.rectangle_overlap import row_iou
from ars_web.studies.compared_frames import Sides

HIDDEN_BANDS: tuple[tuple[float, float], ...] = ((0.95, 1.0), (0.75, 0.95), (0.5, 0.75), (0.0, 0.5))
"""Visible shares, from and below (1 itself belongs to the first), the least hidden first."""


@dataclass(frozen=True)
class HiddenBand:
    """Pairs whose automatic label has a visible share between two bounds.

    Attributes:
        lowest, highest: the bounds.
        matched: pairs, by the rectangles in the image.
        in_image: mean IoU of those; None where there is none.
        visible: mean IoU of the same manual labels with the rectangles round what is seen; None where there is none.
    """

    lowest: float
    highest: float
    matched: int
    in_image: float | None
    visible: float | None


def hidden_bands(sides: Sides, visible: Float[np.ndarray, "m"]) -> tuple[HiddenBand, ...]:
    """The pairs of HIDDEN_BANDS, by the visible shares (m,) of the automatic labels."""
    pairs = sides.found.pairs
    shares = visible[pairs.second]
    around_seen = row_iou(sides.manual.bbox[pairs.first], sides.visible[pairs.second])
    bands: list[HiddenBand] = []
    for lowest, highest in HIDDEN_BANDS:
        inside = (shares >= lowest) & ((shares < highest) | (highest == 1.0))
        seen = inside & ~np.isnan(around_seen)
        bands.append(HiddenBand(lowest, highest, int(inside.sum()), _mean(pairs.iou[inside]), _mean(around_seen[seen])))
    return tuple(bands)


def _mean(values: Float[np.ndarray, "m"]) -> float | None:
    return float(values.mean()) if len(values) else None
