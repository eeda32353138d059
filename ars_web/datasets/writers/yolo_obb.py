"""YOLO with turned boxes: as `yolo`, but rows `class x1 y1 x2 y2 x3 y3 x4 y4`.

The four corners are those of the rectangle of the smallest area round the part in the image, one after the other
round it. They may lie outside the image, and are not cut: four points cut to the image are no rectangle any more.
"""

from collections.abc import Sequence
from pathlib import Path

from ars_web.datasets.planned import ExportPlan
from ars_web.datasets.writers import yolo
from ars_web.datasets.writers.polygon_rows import first_rings, polygon_rows
from ars_web.datasets.writers.small_files import write_files
from ars_web.datasets.writers.writer import FileDigests, Shard, Writer


def _write(shard: Shard, files: Path, fragments: Path) -> FileDigests:
    rectangles = first_rings(shard.marks["rectangle"].rings)
    buffer, starts = polygon_rows(shard.table, shard.keep, rectangles, shard.sizes, shard.class_of_box, within=False)
    folders = [f"labels/{split}" for split in shard.splits]
    return write_files(files, folders, [f"{stem}.txt" for stem in shard.stems], buffer.data, starts)


def _losses(plan: ExportPlan) -> Sequence[str]:
    return (
        "headings: a turned rectangle is the same after half a turn, so which end is an object's front is not kept",
    )


WRITER = Writer(
    format="yolo-obb",
    title="YOLO, turned boxes",
    description="To train Ultralytics YOLO-OBB: the four corners of the smallest rectangle, turned as it may be.",
    label_folder="labels",
    image_folder=lambda split: f"images/{split}",
    write=_write,
    join=yolo.write_layout,
    shows=("rectangle",),
    label_functions=("rectangle",),
    losses=_losses,
)
