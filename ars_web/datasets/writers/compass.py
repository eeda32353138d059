"""The original tool's compass dataset: as `ars`, with the heading of each object in the image.

With bins, a row is `class cx cy w h` and its class is `class * bins + bin`, bin i of n being the headings from i / n to
(i + 1) / n of a turn. Without, a row is `class cx cy w h heading`, in radians from 0 to a turn. Which direction the
heading is says `geometry/heading.py`.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from numba import njit

from ars_web.datasets.planned import ExportPlan
from ars_web.datasets.samples import LabelTable
from ars_web.datasets.writers import ars, yolo
from ars_web.datasets.writers.digits import Buffer, put_decimal, put_integer, scaled
from ars_web.datasets.writers.writer import FileDigests, Shard, Writer
from ars_web.errors import BadInput
from ars_web.geometry.box import Box
from ars_web.geometry.heading import heading_edges, headings
from ars_web.geometry.symmetry import Symmetry, rotations_of

_UNIT = Box(np.eye(4), np.ones(3))

_HEADING_BYTES = 9
"""` 0.000000`"""


def headings_of(shard: Shard) -> Float[np.ndarray, "n b"]:
    """Of every box in every frame, radians in [0, 2 pi)."""
    shapes = shard.shapes
    found = np.zeros(shard.keep.shape)
    for camera, rows in shapes.by_camera():
        for column, (box, place) in enumerate(zip(shapes.boxes, shard.class_of_box.tolist(), strict=True)):
            symmetry = shard.classes[place].symmetry
            found[rows, column] = headings(camera, shapes.Ts_world_camera[rows], box, symmetry)
    return found


def compass_rows(
    table: LabelTable,
    keep: Bool[np.ndarray, "n b"],
    heading: Float[np.ndarray, "n b"],
    sizes: Int[np.ndarray, "n 2"],
    class_of_box: Int[np.ndarray, "b"],
    *,
    bins: int,
) -> tuple[UInt8[np.ndarray, "size"], Int[np.ndarray, "k"]]:
    """The text of all frames' label files in one buffer, and (n + 1,) where each begins.

    Boxes are rounded as `yolo.rows` does; with 0 bins headings to millionths of a radian, halves up.
    """
    buffer = np.empty(int(keep.sum()) * (yolo.ROW_BYTES + _HEADING_BYTES), dtype=np.uint8)
    starts = np.zeros(len(keep) + 1, dtype=np.int64)
    end = _rows(table.bbox, keep, heading, sizes.astype(np.int64), class_of_box.astype(np.int64), bins, buffer, starts)
    return buffer[:end], starts


@njit(cache=True)
def _rows(
    bbox: Float[np.ndarray, "n b 4"],
    keep: Bool[np.ndarray, "n b"],
    heading: Float[np.ndarray, "n b"],
    sizes: Int[np.ndarray, "n 2"],
    class_of_box: Int[np.ndarray, "b"],
    bins: int,
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
            number = class_of_box[box]
            if bins > 0:
                number = number * bins + min(int(heading[frame, box] / (2 * np.pi) * bins), bins - 1)
            place = put_integer(buffer, place, number)
            place = yolo.put_shares(buffer, place, bbox[frame, box], width, height)
            if bins == 0:
                buffer[place] = 32
                place = put_decimal(buffer, place + 1, scaled(heading[frame, box], 1e6), 6)
            buffer[place] = 10
            place += 1
    starts[keep.shape[0]] = place
    return place


def _write(shard: Shard, files: Path, fragments: Path) -> FileDigests:
    buffer, starts = compass_rows(
        shard.table, shard.keep, headings_of(shard), shard.sizes, shard.class_of_box, bins=shard.options.heading_bins
    )
    return ars.write_rows(shard, buffer, starts, files, fragments)


def _losses(plan: ExportPlan) -> Sequence[str]:
    used = sorted({place for session in plan.sessions for place in session.class_of_box})
    classes = [plan.classes[place] for place in used]
    if classes and not any(_has_heading(a_class.symmetry) for a_class in classes):
        raise BadInput(
            "compass: every class that has objects looks the same from all around, so none has a heading; export to ars"
        )
    bins = plan.options.heading_bins
    found = [f"headings: told in {bins} bins of {360 / bins:g} degrees"] if bins else []
    for a_class in classes:
        turns = len(rotations_of(a_class.symmetry))
        if not _has_heading(a_class.symmetry):
            found.append(f"heading of class {a_class.name!r}: it looks the same from all around, so 0 is written")
        elif turns > 1:
            found.append(
                f"heading of class {a_class.name!r}: it looks the same after each of {turns} turns, so the smallest of"
                f" their {turns} headings is written"
            )
    return found


def _has_heading(symmetry: Symmetry) -> bool:
    return len(heading_edges(_UNIT, symmetry)) > 0


WRITER = Writer(
    format="compass",
    title="ARS compass dataset",
    description=(
        "The original ARS's boxes with headings: which way each object's x axis points in the image, as a bin of the"
        " class or in radians."
    ),
    label_folder="labels",
    image_folder=lambda split: "images",
    write=_write,
    join=ars.write_layout,
    losses=_losses,
    own_options=("heading_bins",),
    numbered=True,
    only_jpeg=True,
)
