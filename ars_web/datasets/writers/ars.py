"""The original tool's raw dataset: `images/00000.jpg`, `labels/00000.txt`, `ids/00000.txt`.

A label row is `class cx cy w h` as in YOLO; an id is `sceneFolder!imageFile`. The layout has no place for splits,
so they are lists of images beside it: `train.txt`, `val.txt` and, where there is one, `test.txt`.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Int, UInt8

from ars_web.datasets.writers import yolo
from ars_web.datasets.writers.joining import join_files
from ars_web.datasets.writers.small_files import write_files
from ars_web.datasets.writers.writer import Dataset, FileDigests, Shard, Writer


def _write(shard: Shard, files: Path, fragments: Path) -> FileDigests:
    buffer, starts = yolo.rows(shard.table.bbox, shard.keep, shard.sizes, shard.class_of_box)
    return write_rows(shard, buffer, starts, files, fragments)


def write_rows(
    shard: Shard, rows: UInt8[np.ndarray, "size"], starts: Int[np.ndarray, "k"], files: Path, fragments: Path
) -> FileDigests:
    """The files of a shard whose rows lie in one buffer, those of frame i from `starts[i]` to `starts[i + 1]`."""
    names = [f"{stem}.txt" for stem in shard.stems]
    digests = write_files(files, ["labels"] * len(names), names, rows.data, starts)
    identities = [f"{identity}\n".encode() for identity in shard.identities]
    id_starts = np.cumsum([0, *map(len, identities)])
    write_files(files, ["ids"] * len(names), names, memoryview(b"".join(identities)), id_starts)
    for split in sorted(set(shard.splits)):
        lines = (f"images/{n}\n" for n, s in zip(shard.image_names, shard.splits, strict=True) if s == split)
        (fragments / f"{split}.txt").write_text("".join(lines), encoding="utf-8")
    return digests


def write_layout(dataset: Dataset, fragments: Sequence[Path], folder: Path) -> FileDigests:
    """The folders, and the list of each split."""
    for name in ("images", "labels", "ids"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    for split in dataset.splits:
        join_files([f / f"{split}.txt" for f in fragments], folder / f"{split}.txt")
    return {}


WRITER = Writer(
    format="ars",
    title="ARS raw dataset",
    description=(
        "The layout of the original ARS: numbered images, YOLO rows, and for each image which recording it came from."
    ),
    label_folder="labels",
    image_folder=lambda split: "images",
    write=_write,
    join=write_layout,
    numbered=True,
    only_jpeg=True,
)
