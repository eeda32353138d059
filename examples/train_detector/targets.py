"""What the network is to say of an image, and what it said, as boxes: heat where an object's middle is, and beside it
how far the box's sides are away (CenterNet's heat, FCOS's distances).

The network's planes are STRIDE times smaller than the image it is given. All boxes here are x0, y0, x1, y1 in that
image's coordinates: (0, 0) is its top left corner. Only numpy: nothing here needs PyTorch.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.ndimage import maximum_filter

STRIDE = 4
"""Pixels of the image that a cell of the planes stands for, across and down."""

NARROWEST = 0.6
"""Cells: the least standard deviation of the heat round a middle."""

MOST = 60
"""Boxes that are read from an image's planes."""

SAME = 0.5
"""IoU of two boxes of one class from which on the fainter is taken for the same object."""


@dataclass(frozen=True, eq=False)
class Targets:
    """What the network is to say of one image of h x w cells.

    Attributes:
        heat: (c, h, w) by class: 1 in the cell of an object's middle, falling off round it.
        sides: (4, h, w) pixels from the cell's centre to the left, upper, right and lower side of the box.
        weights: (h, w) how much `sides` count: 1 in the cell of the middle, less in its neighbours, 0 elsewhere.
    """

    heat: Float[np.ndarray, "c h w"]
    sides: Float[np.ndarray, "4 h w"]
    weights: Float[np.ndarray, "h w"]


@dataclass(frozen=True, eq=False)
class Found:
    """Boxes of one image, the surest first.

    Attributes:
        boxes: (k, 4).
        classes: (k,) from 0.
        scores: (k,) within 0 and 1.
    """

    boxes: Float[np.ndarray, "k 4"]
    classes: Int[np.ndarray, "k"]
    scores: Float[np.ndarray, "k"]


def encode(
    boxes: Float[np.ndarray, "k 4"], classes: Int[np.ndarray, "k"], *, count: int, size: tuple[int, int]
) -> Targets:
    """The targets of an image of `size` (width, height), both multiples of STRIDE, with `count` classes.

    Where two boxes claim a cell's sides, the smaller has them: it has fewer cells.
    """
    width, height = size[0] // STRIDE, size[1] // STRIDE
    heat = np.zeros((count, height, width), dtype=np.float32)
    sides = np.zeros((4, height, width), dtype=np.float32)
    weights = np.zeros((height, width), dtype=np.float32)
    columns, rows = np.arange(width), np.arange(height)
    for k in np.argsort(-np.prod(boxes[:, 2:] - boxes[:, :2], axis=1), kind="stable"):
        x0, y0, x1, y1 = boxes[k].tolist()
        column = min(max(int((x0 + x1) / 2 // STRIDE), 0), width - 1)
        row = min(max(int((y0 + y1) / 2 // STRIDE), 0), height - 1)
        along = np.exp(-0.5 * ((columns - column) / max((x1 - x0) / (6 * STRIDE), NARROWEST)) ** 2)
        down = np.exp(-0.5 * ((rows - row) / max((y1 - y0) / (6 * STRIDE), NARROWEST)) ** 2)
        bump = np.outer(down, along)
        heat[classes[k]] = np.maximum(heat[classes[k]], bump)
        for i in range(max(row - 1, 0), min(row + 2, height)):
            for j in range(max(column - 1, 0), min(column + 2, width)):
                x, y = (j + 0.5) * STRIDE, (i + 0.5) * STRIDE
                if (x0 < x < x1 and y0 < y < y1) or (i, j) == (row, column):
                    weights[i, j] = bump[i, j]
                    sides[:, i, j] = x - x0, y - y0, x1 - x, y1 - y
    return Targets(heat, sides, weights)


def decode(heat: Float[np.ndarray, "c h w"], sides: Float[np.ndarray, "4 h w"], *, least: float) -> Found:
    """The boxes that planes tell of, cut to the image: peaks of the heat of at least `least`, MOST at most."""
    height, width = heat.shape[1:]
    peaks = (heat == maximum_filter(heat, size=(1, 3, 3), mode="constant")) & (heat >= least)
    classes, rows, columns = np.nonzero(peaks)
    order = np.argsort(-heat[classes, rows, columns], kind="stable")[:MOST]
    classes, rows, columns = classes[order], rows[order], columns[order]
    x, y = (columns + 0.5) * STRIDE, (rows + 0.5) * STRIDE
    left, upper, right, lower = sides[:, rows, columns].astype(np.float64)
    boxes = np.stack([x - left, y - upper, x + right, y + lower], axis=1)
    boxes = np.clip(boxes, 0, [width * STRIDE, height * STRIDE] * 2)
    kept = _without_repeats(boxes, classes)
    return Found(boxes[kept], classes[kept], heat[classes, rows, columns][kept].astype(np.float64))


def _without_repeats(boxes: Float[np.ndarray, "k 4"], classes: Int[np.ndarray, "k"]) -> list[int]:
    kept: list[int] = []
    for k in range(len(boxes)):
        rivals = [j for j in kept if classes[j] == classes[k]]
        if not rivals or overlaps(boxes[k], boxes[rivals]).max() < SAME:
            kept.append(k)
    return kept


def overlaps(box: Float[np.ndarray, "4"], others: Float[np.ndarray, "k 4"]) -> Float[np.ndarray, "k"]:
    """IoU of one box with others."""
    low, high = np.maximum(box[:2], others[:, :2]), np.minimum(box[2:], others[:, 2:])
    shared = np.prod(np.maximum(high - low, 0), axis=1)
    areas = np.prod(others[:, 2:] - others[:, :2], axis=1) + np.prod(box[2:] - box[:2])
    return shared / np.maximum(areas - shared, 1e-12)
