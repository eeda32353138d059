"""Datasets that hold labels and are not read as truth: what they are, and what to give instead.

KITTI, TFRecord, WebDataset and Parquet would each need a reader of their own, and what they hold of rectangles a COCO
file of the same export holds, too.
"""

from pathlib import Path

from ars_web.evaluation.truth_layout import own_format

READ = ("coco", "yolo", "yolo-seg", "yolo-obb", "yolo-pose", "voc", "cvat", "cvat-polygons", "cvat-video", "ars")
"""Formats of this program's datasets that are truths; `compass` has numbers of bins for classes."""

_MARKS = {
    "KITTI": ("label_2/*.txt", "training/label_2/*.txt"),
    "TFRecord": ("*.tfrecord*", "*/*.tfrecord*"),
    "WebDataset": ("*.tar", "*/*.tar"),
    "Parquet": ("*.parquet", "*/*.parquet"),
    "BOP": ("scene_gt.json", "*/scene_gt.json", "*/*/scene_gt.json"),
}
"""Of other programs' folders."""

_TAKEN = "evaluate takes coco, yolo, voc, cvat and ars as truth"


def own_unread(path: Path) -> str | None:
    """Of a dataset that this program wrote in such a format, what it is and what to do; None of all else."""
    own = own_format(path if path.is_dir() else path.parent)
    if own is None or own in READ:
        return None
    return (
        f"{path} is a dataset of the format {own}; {_TAKEN}. Export the same session with the same options and"
        " --format coco --images none beside it, and give that as --truth"
    )


def foreign_unread(path: Path) -> str | None:
    """Of a folder that looks like another program's in such a format, what it is and what to do; None of all else."""
    for title, marks in _MARKS.items():
        if path.is_dir() and any(next(path.glob(mark), None) is not None for mark in marks):
            return f"{path} looks like {title}; {_TAKEN}. Convert it to a COCO file, and give that as --truth"
    return None
