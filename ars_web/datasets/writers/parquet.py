"""Parquet: `tables/labels.parquet` with a row an object a frame, `tables/frames.parquet` with a row a frame, `images/`.

What a column means is in docs/formats.md. Pixels have four decimals, metres nine, quaternions twelve, shares six;
outlines are in single precision. Rows lie in groups of a fixed size, whatever the shards, and are compressed by zstd at
a fixed level; the file names the version of pyarrow that wrote it.
"""

import hashlib
import importlib.util
from collections.abc import Sequence
from pathlib import Path

from ars_web.datasets.planned import ExportPlan
from ars_web.datasets.splits import SPLITS
from ars_web.datasets.writers.writer import Dataset, FileDigests, Shard, Writer
from ars_web.errors import BadInput

TABLES = "tables"


def check_pyarrow() -> None:
    """Raises BadInput where pyarrow is not installed."""
    if importlib.util.find_spec("pyarrow") is None:
        raise BadInput("format 'parquet' needs pyarrow, which is not installed: pip install 'ars-web[parquet]'")


def _image_folder(split: str) -> str:
    return f"images/{split}"


def _write(shard: Shard, files: Path, fragments: Path) -> FileDigests:
    check_pyarrow()
    from ars_web.datasets.writers.parquet_tables import tables_of, write_piece

    frames, labels = tables_of(shard, {split: _image_folder(split) for split in SPLITS})
    write_piece(frames, fragments / "frames.arrow")
    write_piece(labels, fragments / "labels.arrow")
    return {}


def _join(dataset: Dataset, fragments: Sequence[Path], folder: Path) -> FileDigests:
    from ars_web.datasets.writers.parquet_tables import FRAMES, LABELS, join_pieces

    for split in dataset.splits:
        (folder / _image_folder(split)).mkdir(parents=True, exist_ok=True)
    (folder / TABLES).mkdir(exist_ok=True)
    digests: FileDigests = {}
    for name, schema in (("frames", FRAMES), ("labels", LABELS)):
        path = f"{TABLES}/{name}.parquet"
        join_pieces([fragment / f"{name}.arrow" for fragment in fragments], schema, folder / path)
        with (folder / path).open("rb") as file:
            digests[path] = hashlib.file_digest(file, "sha256").hexdigest()
    return digests


def _losses(plan: ExportPlan) -> Sequence[str]:
    check_pyarrow()
    return ()


WRITER = Writer(
    format="parquet",
    title="Parquet tables",
    description=(
        "For pandas, Polars, DuckDB and Spark: one row an object a frame with its pose, box, outline and keypoints, and"
        " one row a frame with its camera."
    ),
    label_folder=TABLES,
    image_folder=_image_folder,
    write=_write,
    join=_join,
    shows=("box", "silhouette", "keypoints"),
    label_functions=("silhouette", "keypoints"),
    losses=_losses,
    with_visible=True,
)
