"""Parquet tables, read by pyarrow."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from ars_web.datasets.readback.reader import Reader, ReadFrame, ReadLabel, Sizes
from ars_web.datasets.writers.parquet import TABLES, check_pyarrow
from ars_web.errors import BadFile
from ars_web.geometry import rigid_transform
from ars_web.geometry.rigid_transform import Transform

_ROWS = 1024
"""That are read at once."""


def _library() -> str:
    return "pyarrow"


def _rows(path: Path) -> Iterator[dict[str, Any]]:
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        for batch in pq.ParquetFile(str(path)).iter_batches(batch_size=_ROWS):
            yield from batch.to_pylist()
    except (pa.ArrowException, OSError) as error:
        raise BadFile(path, f"is no whole Parquet file: {error}") from error


def _read(folder: Path, sizes: Sizes) -> Iterator[ReadFrame]:
    check_pyarrow()
    path = folder / TABLES / "labels.parquet"
    labels = _rows(path)
    label = next(labels, None)
    for row in _rows(folder / TABLES / "frames.parquet"):
        key = row["session"], row["frame"]
        found: list[ReadLabel] = []
        # Labels follow each other as their frames do.
        while label is not None and (label["session"], label["frame"]) == key:
            found.append(_label(label))
            label = next(labels, None)
        if len(found) != row["labels"]:
            raise BadFile(path, f"frame {key[1]} of session {key[0]} has {len(found)} rows, not {row['labels']}")
        place = f"{path}, frame {key[1]} of session {key[0]}"
        yield ReadFrame(
            Path(row["image"]).stem, row["split"], place, tuple(found), image_size=(row["width"], row["height"])
        )
    if label is not None:
        raise BadFile(path, f"frame {label['frame']} of session {label['session']} is not among the frames, or twice")


def _label(row: dict[str, Any]) -> ReadLabel:
    points = [(np.nan, np.nan) if point["x"] is None else (point["x"], point["y"]) for point in row["keypoints"]]
    keypoints: Float[np.ndarray, "k 2"] = np.array(points).reshape(-1, 2)
    return ReadLabel(
        row["class"],
        bbox=np.array(row["bbox"]),
        bbox_amodal=np.array(row["bbox_amodal"]),
        rings=tuple(np.array(ring).reshape(-1, 2) for ring in row["outline"]),
        points=keypoints,
        T_camera_box=_transform(row["T_camera_box"]),
        size=np.array(row["size"]),
        visible=row["visible"],
        truncated=row["truncated"],
    )


def _transform(held: dict[str, Any]) -> Transform:
    return rigid_transform.from_position_wxyz(np.array(held["position"]), np.array(held["wxyz"]))


def _rounding(longer: int) -> float:
    # Four decimals, and outlines are in single precision.
    return 0.0001 + longer * 2.0**-24


READER = Reader(format="parquet", library=_library, read=_read, rounding=_rounding, ring_function="silhouette")
