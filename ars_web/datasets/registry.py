"""The dataset formats by name. Adding one is one file and one line here."""

from ars_web.datasets.writers import (
    ars,
    bop,
    coco,
    compass,
    cvat,
    cvat_video,
    dope,
    kitti,
    masks,
    parquet,
    voc,
    yolo,
    yolo_obb,
    yolo_pose,
    yolo_seg,
)
from ars_web.datasets.writers.writer import Writer
from ars_web.errors import BadInput

WRITERS: dict[str, Writer] = {
    writer.format: writer
    for writer in (
        yolo.WRITER,
        yolo_seg.WRITER,
        yolo_obb.WRITER,
        yolo_pose.WRITER,
        coco.WRITER,
        voc.WRITER,
        kitti.WRITER,
        bop.WRITER,
        dope.WRITER,
        cvat.WRITER,
        cvat.POLYGONS,
        cvat_video.WRITER,
        parquet.WRITER,
        masks.WRITER,
        compass.WRITER,
        ars.WRITER,
    )
}
"""In the order in which they are offered."""


def writer_of(format: str) -> Writer:  # noqa: A002 - the contract's name
    """The writer of a format; BadInput names the known ones."""
    if format not in WRITERS:
        raise BadInput(f"export format {format!r} is unknown; known are {', '.join(WRITERS)}")
    return WRITERS[format]
