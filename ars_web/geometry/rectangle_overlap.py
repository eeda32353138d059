"""How far rectangles in an image share their area."""

import numpy as np
from jaxtyping import Float


def pairwise_iou(first: Float[np.ndarray, "n 4"], second: Float[np.ndarray, "m 4"]) -> Float[np.ndarray, "n m"]:
    """Intersection over union of every rectangle (x0, y0, x1, y1) of one list with every one of another.

    It is 0 where both are empty.
    """
    return _iou(first[:, None], second[None])


def row_iou(first: Float[np.ndarray, "n 4"], second: Float[np.ndarray, "n 4"]) -> Float[np.ndarray, "n"]:
    """Intersection over union of each rectangle of one list with that of its row in another.

    It is 0 where both are empty, NaN where either is.
    """
    return _iou(first, second)


def _iou(first: Float[np.ndarray, "*n 4"], second: Float[np.ndarray, "*m 4"]) -> Float[np.ndarray, "*k"]:
    sides = np.minimum(first[..., 2:], second[..., 2:]) - np.maximum(first[..., :2], second[..., :2])
    common = np.clip(sides, 0.0, None).prod(axis=-1)
    union = _areas(first) + _areas(second) - common
    return np.divide(common, union, out=np.zeros_like(common), where=union != 0)


def _areas(rectangles: Float[np.ndarray, "*n 4"]) -> Float[np.ndarray, "*n"]:
    return np.clip(rectangles[..., 2:] - rectangles[..., :2], 0.0, None).prod(axis=-1)
