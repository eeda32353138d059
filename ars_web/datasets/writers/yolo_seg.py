"""YOLO with outlines: as `yolo`, but rows `class x1 y1 x2 y2 ...`, one ring each.

A row cannot hold several rings: where an outline has pieces or holes, its ring goes there and back on one line, which
encloses nothing. Ultralytics' own converters join rings in this way.
"""

from collections.abc import Sequence
from pathlib import Path

from ars_web.datasets.planned import ExportPlan
from ars_web.datasets.writers import yolo
from ars_web.datasets.writers.polygon_rows import polygon_rows
from ars_web.datasets.writers.small_files import write_files
from ars_web.datasets.writers.writer import FileDigests, Shard, Writer


def _write(shard: Shard, files: Path, fragments: Path) -> FileDigests:
    buffer, starts = polygon_rows(shard.table, shard.keep, shard.outlines, shard.sizes, shard.class_of_box, within=True)
    folders = [f"labels/{split}" for split in shard.splits]
    return write_files(files, folders, [f"{stem}.txt" for stem in shard.stems], buffer.data, starts)


def _losses(plan: ExportPlan) -> Sequence[str]:
    shapes = sum(mesh is not None and not mesh.is_convex for session in plan.sessions for mesh in session.meshes)
    if not shapes:
        return ()
    return (
        f"pieces and holes that outlines of {shapes} object{'s' if shapes > 1 else ''} may have: a row holds one ring,"
        " which goes there and back on one line",
    )


WRITER = Writer(
    format="yolo-seg",
    title="YOLO, outlines",
    description="To train Ultralytics YOLO for instance segmentation: each object's outline in the image, one ring.",
    label_folder="labels",
    image_folder=lambda split: f"images/{split}",
    write=_write,
    join=yolo.write_layout,
    shows=("outline",),
    losses=_losses,
    with_outlines=True,
)
