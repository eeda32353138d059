"""YOLO: `data.yaml`, `images/{train,val}`, `labels/{train,val}`; rows `class cx cy w h` as shares of the image.

Class ids start at 0, in the sessions' order. A frame without labels has an empty file and stays a negative.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from numba import njit

from ars_web.datasets.writers.digits import Buffer, put_decimal, put_integer, scaled
from ars_web.datasets.writers.small_files import write_files
from ars_web.datasets.writers.writer import Dataset, FileDigests, Shard, Writer

ROW_BYTES = 20 + 4 * 9
"""The longest row: a class id of 19 digits, four times ` 0.000000`, and the line's end."""


def rows(
    bbox: Float[np.ndarray, "n b 4"],
    keep: Bool[np.ndarray, "n b"],
    sizes: Int[np.ndarray, "n 2"],
    class_of_box: Int[np.ndarray, "b"],
) -> tuple[UInt8[np.ndarray, "size"], Int[np.ndarray, "k"]]:
    """The text of all frames' label files in one buffer, and (n + 1,) where each begins.

    Shares are rounded to millionths, halves up, within [0, 1]; a width or height is never written as 0.
    """
    buffer = np.empty(int(keep.sum()) * ROW_BYTES, dtype=np.uint8)
    starts = np.zeros(len(bbox) + 1, dtype=np.int64)
    end = _rows(bbox, keep, sizes.astype(np.int64), class_of_box.astype(np.int64), buffer, starts)
    return buffer[:end], starts


@njit(cache=True)
def _rows(
    bbox: Float[np.ndarray, "n b 4"],
    keep: Bool[np.ndarray, "n b"],
    sizes: Int[np.ndarray, "n 2"],
    class_of_box: Int[np.ndarray, "b"],
    buffer: UInt8[np.ndarray, "size"],
    starts: Int[np.ndarray, "k"],
) -> int:
    place = 0
    for frame in range(bbox.shape[0]):
        starts[frame] = place
        width, height = sizes[frame, 0], sizes[frame, 1]
        for box in range(bbox.shape[1]):
            if not keep[frame, box]:
                continue
            place = put_integer(buffer, place, class_of_box[box])
            place = put_shares(buffer, place, bbox[frame, box], width, height)
            buffer[place] = 10
            place += 1
    starts[bbox.shape[0]] = place
    return place


@njit(cache=True)
def put_shares(buffer: Buffer, place: int, bbox: Float[np.ndarray, "4"], width: int, height: int) -> int:
    """` cx cy w h` of a box, as `rows` rounds them; the place after the last byte."""
    x0, y0, x1, y1 = bbox
    for value, least in (
        ((x0 + x1) / (2 * width), 0),
        ((y0 + y1) / (2 * height), 0),
        ((x1 - x0) / width, 1),
        ((y1 - y0) / height, 1),
    ):
        buffer[place] = 32
        millionths = min(max(scaled(value, 1e6), least), 1_000_000)
        place = put_decimal(buffer, place + 1, millionths, 6)
    return place


def _write(shard: Shard, files: Path, fragments: Path) -> FileDigests:
    buffer, starts = rows(shard.table.bbox, shard.keep, shard.sizes, shard.class_of_box)
    folders = [f"labels/{split}" for split in shard.splits]
    return write_files(files, folders, [f"{stem}.txt" for stem in shard.stems], buffer.data, starts)


def write_layout(dataset: Dataset, fragments: Sequence[Path], folder: Path) -> FileDigests:
    """The folders of each split, and `data.yaml`."""
    return write_layout_with(dataset, folder, ())


def write_layout_with(dataset: Dataset, folder: Path, more: Sequence[str]) -> FileDigests:
    """The same with further lines at the end of `data.yaml`."""
    for split in dataset.splits:
        (folder / "images" / split).mkdir(parents=True, exist_ok=True)
        (folder / "labels" / split).mkdir(parents=True, exist_ok=True)
    lines = ["path: .", *(f"{split}: images/{split}" for split in dataset.splits)]
    lines += ["names:", *(f"  {i}: {quoted(name)}" for i, name in enumerate(dataset.class_names))]
    if not dataset.class_names:
        lines[-1] = "names: {}"
    (folder / "data.yaml").write_text("\n".join([*lines, *more]) + "\n", encoding="utf-8")
    return {}


def quoted(text: str) -> str:
    """`text` as a double-quoted YAML scalar: quotes, colons, line ends and other scripts survive."""

    def escaped(character: str) -> str:
        if character in '"\\':
            return f"\\{character}"
        return character if character.isprintable() else f"\\U{ord(character):08X}"

    return f'"{"".join(map(escaped, text))}"'


WRITER = Writer(
    format="yolo",
    title="YOLO (Ultralytics)",
    description=(
        "To train Ultralytics YOLO: images and labels in a folder for each split, and the data.yaml that names them."
    ),
    label_folder="labels",
    image_folder=lambda split: f"images/{split}",
    write=_write,
    join=write_layout,
)
