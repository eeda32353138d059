"""Rectangles round what is seen of objects, nearer ones taken away."""

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Bool, Float

from ars_web.datasets.samples import LabelTable
from ars_web.datasets.shapes import PosedShapes
from ars_web.geometry.instance_masks import InstanceMasks, instance_masks


def visible_rectangles(
    shapes: PosedShapes, table: LabelTable, *, progress: Callable[[int, int], None] | None = None
) -> Float[np.ndarray, "n b 4"]:
    """(x0, y0, x1, y1) round the pixels of each shape that no nearer shape hides; image coordinates.

    A side that nothing hides is the label's own, exactly; one that something hides is a pixel's edge. NaN where the
    shape is not in the image, or wholly hidden. A shape so thin that it covers no pixel's middle counts as seen.

    Args:
        shapes: b in n frames; all of them hide what is behind them.
        table: their labels.
        progress: told (frames done, frames in all) after each.
    """
    found = np.full_like(table.bbox, np.nan)
    for row, (camera_id, T) in enumerate(zip(shapes.camera_ids.tolist(), shapes.Ts_world_camera, strict=True)):
        columns = np.flatnonzero(~np.isnan(table.bbox[row, :, 0])).tolist()
        if columns:
            masks = instance_masks(shapes.cameras[camera_id], T, shapes.boxes, shapes.meshes)
            found[row] = _of_frame(masks, columns, table.bbox[row])
        if progress is not None:
            progress(row + 1, len(found))
    return found


def _of_frame(masks: InstanceMasks, columns: Sequence[int], bbox: Float[np.ndarray, "b 4"]) -> Float[np.ndarray, "b 4"]:
    found = np.full_like(bbox, np.nan)
    for column in columns:
        whole = masks.silhouettes[column]
        if not whole.mask.any():
            found[column] = bbox[column]
            continue
        seen = masks.visible_of(column).mask
        if seen.any():
            edges, all_edges = _edges(seen), _edges(whole.mask)
            corner = np.tile([whole.column, whole.row], 2)
            found[column] = np.where(edges == all_edges, bbox[column], edges + corner)
    return found


def _edges(mask: Bool[np.ndarray, "k l"]) -> Float[np.ndarray, "4"]:
    """x0, y0, x1, y1 of the pixels that are set, in the mask's own image coordinates."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    return np.array([columns[0], rows[0], columns[-1] + 1, rows[-1] + 1], dtype=np.float64)
