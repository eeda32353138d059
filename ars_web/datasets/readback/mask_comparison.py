"""Masks that were read beside those of the session's shapes."""

import numpy as np
from jaxtyping import Bool

from ars_web.datasets.readback.reader import ReadLabel, ReadMask
from ars_web.datasets.shapes import PosedShapes
from ars_web.geometry.instance_masks import InstanceMasks, instance_masks


def has_mask(label: ReadLabel) -> bool:
    """Whether a label holds pixels."""
    return label.mask is not None or label.visible_mask is not None


def masks_of_frame(shapes: PosedShapes, frame: int) -> InstanceMasks:
    """The true masks of the shapes in one of the frames."""
    camera = shapes.cameras[int(shapes.camera_ids[frame])]
    return instance_masks(camera, shapes.Ts_world_camera[frame], shapes.boxes, shapes.meshes)


def wrong_pixels(masks: InstanceMasks, column: int, label: ReadLabel) -> int:
    """How many pixels of a label's masks are in one and not in the other."""
    whole = masks.silhouettes[column]
    pairs: list[tuple[ReadMask, Bool[np.ndarray, "h w"]]] = []
    if label.mask is not None:
        pairs.append((label.mask, whole.mask))
    if label.visible_mask is not None:
        pairs.append((label.visible_mask, masks.visible_of(column).mask))
    wrong = 0
    for read, true in pairs:
        image = np.zeros((2, *masks.visible.shape), dtype=np.bool_)
        for layer, row, place, pixels in (
            (image[0], read.row, read.column, read.pixels),
            (image[1], whole.row, whole.column, true),
        ):
            layer[row : row + pixels.shape[0], place : place + pixels.shape[1]] = pixels
        wrong += int((image[0] != image[1]).sum())
    return wrong
