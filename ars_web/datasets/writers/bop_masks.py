"""BOP's masks, `mask/IMAGE_LABEL.png` and `mask_visib/IMAGE_LABEL.png`, and what is counted on them."""

from itertools import chain
from pathlib import Path

import numpy as np

from ars_web.datasets.writers.bop_info import BopInfo, pixel_box, whole_pixels
from ars_web.datasets.writers.mask_png import mask_png
from ars_web.datasets.writers.small_files import write_files
from ars_web.datasets.writers.writer import Shard
from ars_web.geometry.instance_masks import Silhouette, instance_masks


def write_masks(shard: Shard, info: BopInfo, files: Path) -> BopInfo:
    """Write the masks of the kept labels of a shard, and what `info` is by them. A frame's masks are in memory at
    once, not a shard's.

    Objects whose labels are dropped hide others all the same. `bbox_obj` stays for objects that the image cuts.
    """
    shapes, (n, b) = shard.shapes, shard.keep.shape
    inside = pixel_box(shard.table.bbox, shard.sizes, canvas=0)
    seen = np.full((n, b, 4), -1)
    counts = np.zeros((2, n, b), dtype=np.int64)
    for frame, camera_id in enumerate(shapes.camera_ids.tolist()):
        columns = np.flatnonzero(shard.keep[frame]).tolist()
        if not columns:
            continue
        camera = shapes.cameras[camera_id]
        masks = instance_masks(camera, shapes.Ts_world_camera[frame], shapes.boxes, shapes.meshes)
        contents: list[bytes] = []
        for column in columns:
            whole, visible = masks.silhouettes[column], masks.visible_of(column)
            counts[:, frame, column] = whole.mask.sum(), visible.mask.sum()
            if counts[0, frame, column]:
                inside[frame, column] = _box_of(whole)
            if counts[1, frame, column]:
                seen[frame, column] = _box_of(visible)
            contents += [
                mask_png(part.mask, row=part.row, column=part.column, width=camera.width, height=camera.height)
                for part in (whole, visible)
            ]
        scene = f"{shard.splits[frame]}/{shard.session_number:06d}"
        names = [f"{shard.stems[frame]}_{label:06d}.png" for label in range(len(columns))]
        write_files(
            files,
            [f"{scene}/{folder}" for _ in columns for folder in ("mask", "mask_visib")],
            list(chain.from_iterable((name, name) for name in names)),
            memoryview(b"".join(contents)),
            np.cumsum([0, *map(len, contents)]),
        )
    return BopInfo(
        # What is cut by one side of the image may reach furthest along the others outside of it, too.
        bbox_obj=np.where((shard.table.truncated > 0)[..., None], info.bbox_obj, inside),
        bbox_visib=seen,
        px_all=whole_pixels(counts[0], shard.table.truncated, shard.sizes),
        px_valid=counts[0],
        px_visib=counts[1],
    )


def _box_of(part: Silhouette) -> tuple[int, int, int, int]:
    """BOP's x, y, width, height of the pixels of a mask that has some."""
    rows, columns = np.flatnonzero(part.mask.any(axis=1)), np.flatnonzero(part.mask.any(axis=0))
    x, y = part.column + int(columns[0]), part.row + int(rows[0])
    return x, y, int(columns[-1] - columns[0]), int(rows[-1] - rows[0])
