"""What BOP says of each label beyond its pose: its boxes in pixels, and of how many pixels it is and is seen."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numba import njit

from ars_web.datasets.samples import LabelTable, Outlines

_CANVAS = 1
"""Images on each side of the image: what the toolkit renders silhouettes on, so nothing is told beyond."""


@dataclass(frozen=True, eq=False)
class BopInfo:
    """Of b objects in n frames; what is said of one that is not in the image means nothing.

    Attributes:
        bbox_obj: (n, b, 4) x, y, width, height of the whole silhouette; as the toolkit has them, x and y are the first
            pixel's index, width and height the last pixel's less that.
        bbox_visib: (n, b, 4) the same of what is seen; -1 four times where nothing is.
        px_all, px_valid, px_visib: (n, b) pixels of the whole silhouette, of it in the image, and seen.
    """

    bbox_obj: Int[np.ndarray, "n b 4"]
    bbox_visib: Int[np.ndarray, "n b 4"]
    px_all: Int[np.ndarray, "n b"]
    px_valid: Int[np.ndarray, "n b"]
    px_visib: Int[np.ndarray, "n b"]


def info_of_outlines(table: LabelTable, outlines: Outlines, sizes: Int[np.ndarray, "n 2"]) -> BopInfo:
    """Without masks: counts are the outlines' areas; `bbox_visib` is the box of what is in the image, hidden or not."""
    bbox = np.nan_to_num(table.bbox)
    areas = _areas(outlines.points, outlines.starts).reshape(bbox.shape[:2])
    # A thread of an object has no ring.
    areas = np.where(areas > 0, areas, (bbox[..., 2] - bbox[..., 0]) * (bbox[..., 3] - bbox[..., 1]))
    px_valid = np.maximum(np.rint(areas), 1).astype(np.int64)
    px_visib = np.rint(areas * np.nan_to_num(table.visible)).astype(np.int64)
    bbox_visib = np.where((px_visib > 0)[..., None], pixel_box(table.bbox, sizes, canvas=0), -1)
    return BopInfo(
        bbox_obj=pixel_box(table.bbox_amodal, sizes, canvas=_CANVAS),
        bbox_visib=bbox_visib,
        px_all=whole_pixels(px_valid, table.truncated, sizes),
        px_valid=px_valid,
        px_visib=np.minimum(px_visib, px_valid),
    )


def pixel_box(
    bbox: Float[np.ndarray, "n b 4"], sizes: Int[np.ndarray, "n 2"], *, canvas: int
) -> Int[np.ndarray, "n b 4"]:
    """BOP's x, y, width, height of the pixels whose centres lie in boxes (x0, y0, x1, y1) of image coordinates, at
    least one; within the image and `canvas` images round it."""
    last = sizes[:, None, :] * (canvas + 1) - 1
    low = -sizes[:, None, :] * canvas
    # A box that nears the camera's plane is as large as can be.
    edges = np.clip(np.nan_to_num(bbox), -1e9, 1e9)
    first = np.clip(np.ceil(edges[..., :2] - 0.5).astype(np.int64), low, last)
    end = np.clip(np.floor(edges[..., 2:] - 0.5).astype(np.int64), first, last)
    return np.concatenate([first, end - first], axis=-1)


def whole_pixels(
    px_valid: Int[np.ndarray, "n b"], truncated: Float[np.ndarray, "n b"], sizes: Int[np.ndarray, "n 2"]
) -> Int[np.ndarray, "n b"]:
    """Pixels of whole silhouettes of which `truncated` is the share outside the image."""
    most = (2 * _CANVAS + 1) ** 2 * sizes[:, 0] * sizes[:, 1]
    found = px_valid / np.maximum(1.0 - truncated, 1e-9)
    return np.maximum(np.rint(np.minimum(found, most[:, None])).astype(np.int64), px_valid)


@njit(cache=True)
def _areas(points: Float[np.ndarray, "m 2"], starts: Int[np.ndarray, "k"]) -> Float[np.ndarray, "labels"]:
    """The shoelace formula, from each ring's first point; 0 without a ring."""
    found = np.zeros(len(starts) - 1)
    for label in range(len(found)):
        ring = points[starts[label] : starts[label + 1]]
        twice = 0.0
        for i in range(1, len(ring) - 1):
            ax, ay = ring[i, 0] - ring[0, 0], ring[i, 1] - ring[0, 1]
            bx, by = ring[i + 1, 0] - ring[0, 0], ring[i + 1, 1] - ring[0, 1]
            twice += ax * by - ay * bx
        found[label] = abs(twice) / 2
    return found
