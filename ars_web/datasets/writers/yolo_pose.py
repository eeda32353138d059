"""YOLO with keypoints: as `yolo`, but rows `class cx cy w h` and then `x y v` of each named point.

All rows of a dataset hold as many points as the class with the most; what a class has not is `0 0 0`, and so is a
point outside the image. v is 1 for a point that something hides, 2 for one in sight.

`data.yaml` has no `flip_idx`. It would say which points change places in a mirrored image, and that supposes an object
that is its own mirror image, of which a session knows nothing: a mirrored box with a front is another object.
Without it Ultralytics trains without mirrored images.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from numba import njit

from ars_web.datasets.planned import ExportPlan, PlannedClass
from ars_web.datasets.samples import LabelTable
from ars_web.datasets.writers import yolo
from ars_web.datasets.writers.digits import Buffer, put_decimal, put_integer, scaled
from ars_web.datasets.writers.small_files import write_files
from ars_web.datasets.writers.writer import Dataset, FileDigests, Shard, Writer
from ars_web.errors import BadInput
from ars_web.geometry.keypoints import DEFAULT_KEYPOINTS

_POINT_BYTES = 2 * 9 + 2
"""Twice ` 0.000000`, and a space and a digit."""


def points_a_row(classes: Sequence[PlannedClass]) -> int:
    """How many points each row of a dataset of these classes holds."""
    return max((len(a_class.keypoints) for a_class in classes), default=len(DEFAULT_KEYPOINTS))


def pose_rows(
    table: LabelTable,
    keep: Bool[np.ndarray, "n b"],
    points: Float[np.ndarray, "n b k 2"],
    states: Int[np.ndarray, "n b k"],
    sizes: Int[np.ndarray, "n 2"],
    class_of_box: Int[np.ndarray, "b"],
    *,
    count: int,
) -> tuple[UInt8[np.ndarray, "size"], Int[np.ndarray, "k"]]:
    """The text of all frames' label files in one buffer, and (n + 1,) where each begins.

    Every row has `count` points; those beyond k are `0 0 0`. Boxes are rounded as `yolo.rows` does, points to
    millionths, halves up, within [0, 1].
    """
    buffer = np.empty(int(keep.sum()) * (yolo.ROW_BYTES + count * _POINT_BYTES), dtype=np.uint8)
    starts = np.zeros(len(keep) + 1, dtype=np.int64)
    end = _rows(
        table.bbox,
        keep,
        points,
        states.astype(np.int64),
        sizes.astype(np.int64),
        class_of_box.astype(np.int64),
        count,
        buffer,
        starts,
    )
    return buffer[:end], starts


@njit(cache=True)
def _rows(
    bbox: Float[np.ndarray, "n b 4"],
    keep: Bool[np.ndarray, "n b"],
    points: Float[np.ndarray, "n b k 2"],
    states: Int[np.ndarray, "n b k"],
    sizes: Int[np.ndarray, "n 2"],
    class_of_box: Int[np.ndarray, "b"],
    count: int,
    buffer: Buffer,
    starts: Int[np.ndarray, "k"],
) -> int:
    place = 0
    for frame in range(keep.shape[0]):
        starts[frame] = place
        width, height = sizes[frame, 0], sizes[frame, 1]
        for box in range(keep.shape[1]):
            if not keep[frame, box]:
                continue
            place = put_integer(buffer, place, class_of_box[box])
            place = yolo.put_shares(buffer, place, bbox[frame, box], width, height)
            for point in range(count):
                x, y, state = 0, 0, 0
                if point < states.shape[2] and states[frame, box, point] > 0:
                    state = states[frame, box, point]
                    x = min(max(scaled(points[frame, box, point, 0] / width, 1e6), 0), 1_000_000)
                    y = min(max(scaled(points[frame, box, point, 1] / height, 1e6), 0), 1_000_000)
                buffer[place] = 32
                place = put_decimal(buffer, place + 1, x, 6)
                buffer[place] = 32
                place = put_decimal(buffer, place + 1, y, 6)
                buffer[place] = 32
                place = put_integer(buffer, place + 1, state)
            buffer[place] = 10
            place += 1
    starts[keep.shape[0]] = place
    return place


def _write(shard: Shard, files: Path, fragments: Path) -> FileDigests:
    marks = shard.marks["keypoints"]
    buffer, starts = pose_rows(
        shard.table,
        shard.keep,
        marks.points,
        marks.states,
        shard.sizes,
        shard.class_of_box,
        count=points_a_row(shard.classes),
    )
    folders = [f"labels/{split}" for split in shard.splits]
    return write_files(files, folders, [f"{stem}.txt" for stem in shard.stems], buffer.data, starts)


def _join(dataset: Dataset, fragments: Sequence[Path], folder: Path) -> FileDigests:
    count = points_a_row(dataset.classes)
    lines = [f"kpt_shape: [{count}, 3]"]
    if dataset.classes:
        lines.append("kpt_names:")
    for i, a_class in enumerate(dataset.classes):
        # Ultralytics calls points without a name by their number.
        names = [point.name for point in a_class.keypoints]
        names += [str(number) for number in range(len(names), count)]
        lines.append(f"  {i}: [{', '.join(map(yolo.quoted, names))}]")
    return yolo.write_layout_with(dataset, folder, lines)


def _losses(plan: ExportPlan) -> Sequence[str]:
    count = points_a_row(plan.classes)
    if count == 0:
        raise BadInput("no class has keypoints, so there is nothing for yolo-pose; name some, or export to yolo")
    found = [
        f"rows hold {count} points each: of class {a_class.name!r}, which has {len(a_class.keypoints)}, the others are"
        " written as not labelled"
        for a_class in plan.classes
        if len(a_class.keypoints) < count
    ]
    found += [
        f"symmetry: class {a_class.name!r} looks the same after a turn; its keypoints are those of the box all the same"
        for a_class in plan.classes
        if a_class.symmetry.kind != "none"
    ]
    return found


WRITER = Writer(
    format="yolo-pose",
    title="YOLO, keypoints",
    description=(
        "To train Ultralytics YOLO-Pose: boxes with the named points of each object, by default its centre and corners."
    ),
    label_folder="labels",
    image_folder=lambda split: f"images/{split}",
    write=_write,
    join=_join,
    shows=("box", "keypoints"),
    label_functions=("keypoints",),
    losses=_losses,
)
