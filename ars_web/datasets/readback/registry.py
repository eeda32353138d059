"""How each format is read back. Adding one is one file and one line here."""

from ars_web.datasets.readback import (
    ars,
    bop,
    coco,
    compass,
    cvat,
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
from ars_web.datasets.readback.reader import Reader
from ars_web.errors import BadInput

READERS: dict[str, Reader] = {
    reader.format: reader
    for reader in (
        yolo.READER,
        yolo_seg.READER,
        yolo_obb.READER,
        yolo_pose.READER,
        coco.READER,
        voc.READER,
        kitti.READER,
        bop.READER,
        dope.READER,
        cvat.READER,
        cvat.POLYGONS,
        cvat.TRACKS,
        parquet.READER,
        masks.READER,
        compass.READER,
        ars.READER,
    )
}
"""By the format's key in `datasets/registry.py`."""


def reader_of(format: str) -> Reader:  # noqa: A002 - the contract's name
    """How a format is read back; BadInput names those that can be."""
    if format not in READERS:
        raise BadInput(f"format {format!r} cannot be read back; those that can are {', '.join(READERS)}")
    return READERS[format]
