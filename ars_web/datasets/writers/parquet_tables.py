"""The tables of the Parquet format. Imported only where pyarrow is wanted, which is an extra."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from jaxtyping import Float, Int

from ars_web.datasets.writers.writer import Shard
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import stack
from ars_web.geometry.rings import Rings

ROW_GROUP = 16_384
"""Rows of a group, whatever the shards: what is in memory at once where the tables are joined, and what a reader skips
or takes as a whole."""

POSITION_DECIMALS, QUATERNION_DECIMALS, PIXEL_DECIMALS, SHARE_DECIMALS = 9, 12, 4, 6
"""Of what is computed: beyond these, two machines may differ."""

_THREE, _FOUR = pa.list_(pa.float64(), 3), pa.list_(pa.float64(), 4)
_TRANSFORM = pa.struct([("position", _THREE), ("wxyz", _FOUR)])
_CAMERA = pa.struct(
    [
        ("id", pa.int32()),
        ("model", pa.string()),
        ("fx", pa.float64()),
        ("fy", pa.float64()),
        ("cx", pa.float64()),
        ("cy", pa.float64()),
        ("distortion", pa.list_(pa.float64())),
    ]
)
_KEYPOINT = pa.struct([("name", pa.string()), ("x", pa.float64()), ("y", pa.float64()), ("state", pa.int8())])

_OF_FRAME = [
    ("session", pa.string()),
    ("frame", pa.int32()),
    ("frame_name", pa.string()),
    ("image", pa.string()),
    ("split", pa.string()),
    ("width", pa.int32()),
    ("height", pa.int32()),
    ("camera", _CAMERA),
    ("T_world_camera", _TRANSFORM),
]

FRAMES: Any = pa.schema([*_OF_FRAME, ("labels", pa.int32())])
"""One row a frame, those without a label included."""

LABELS: Any = pa.schema(
    [
        *_OF_FRAME,
        ("class_id", pa.int32()),
        ("class", pa.string()),
        ("box_id", pa.int32()),
        ("box_name", pa.string()),
        ("T_world_box", _TRANSFORM),
        ("T_camera_box", _TRANSFORM),
        ("size", _THREE),
        ("bbox", _FOUR),
        ("bbox_amodal", _FOUR),
        ("truncated", pa.float64()),
        ("visible", pa.float64()),
        ("outline", pa.list_(pa.list_(pa.float32()))),
        ("keypoints", pa.list_(_KEYPOINT)),
    ]
)
"""One row a label: an object in a frame."""

_OF_MANY_ROWS = [
    *("session", "frame_name", "image", "split", "class", "box_name"),
    *("camera.model", "keypoints.list.element.name"),
]
"""Columns of few values: only these are looked up in a dictionary, which numbers are seldom worth."""


def tables_of(shard: Shard, image_folder: dict[str, str]) -> tuple[Any, Any]:
    """The frames and the labels of a shard; `image_folder` is where the images of a split are."""
    n = len(shard.stems)
    frames = _frame_columns(shard, image_folder)
    rows, columns = np.nonzero(shard.keep)
    of_label = [column.take(pa.array(rows)) for column in frames]
    counts = pa.array(shard.keep.sum(axis=1), pa.int32()) if n else pa.array([], pa.int32())
    labels = [*of_label, *_label_columns(shard, rows, columns)]
    return pa.Table.from_arrays([*frames, counts], schema=FRAMES), pa.Table.from_arrays(labels, schema=LABELS)


def _frame_columns(shard: Shard, image_folder: dict[str, str]) -> list[Any]:
    n = len(shard.stems)
    images = [f"{image_folder[s]}/{name}" for s, name in zip(shard.splits, shard.image_names, strict=True)]
    ids: list[int] = shard.shapes.camera_ids.tolist()
    places = {camera_id: place for place, camera_id in enumerate(shard.shapes.cameras)}
    cameras = pa.array(
        [
            {
                "id": camera_id,
                "model": camera.model,
                "fx": camera.fx,
                "fy": camera.fy,
                "cx": camera.cx,
                "cy": camera.cy,
                "distortion": list(camera.distortion),
            }
            for camera_id, camera in shard.shapes.cameras.items()
        ],
        _CAMERA,
    )
    return [
        pa.array([shard.session.id] * n, pa.string()),
        pa.array(shard.frame_indices, pa.int32()),
        pa.array(shard.frame_names, pa.string()),
        pa.array(images, pa.string()),
        pa.array(shard.splits, pa.string()),
        pa.array(shard.sizes[:, 0], pa.int32()),
        pa.array(shard.sizes[:, 1], pa.int32()),
        cameras.take(pa.array([places[camera_id] for camera_id in ids], pa.int64())),
        _transforms(shard.shapes.Ts_world_camera),
    ]


def _label_columns(shard: Shard, rows: Int[np.ndarray, "m"], columns: Int[np.ndarray, "m"]) -> list[Any]:
    session, table = shard.session, shard.table
    class_ids = shard.class_of_box[columns]
    Ts_world_box, sizes = stack(list(shard.shapes.boxes))
    Ts_camera_world = rigid_transform.invert(shard.shapes.Ts_world_camera)
    return [
        pa.array(class_ids, pa.int32()),
        _texts(shard.class_names, class_ids),
        pa.array(np.array(session.box_ids, dtype=np.int64)[columns], pa.int32()),
        _texts(session.box_names, columns),
        _transforms(Ts_world_box[columns]),
        _transforms(Ts_camera_world[rows] @ Ts_world_box[columns]),
        _fixed(sizes[columns], _THREE, POSITION_DECIMALS),
        _fixed(table.bbox[rows, columns], _FOUR, PIXEL_DECIMALS),
        _fixed(table.bbox_amodal[rows, columns], _FOUR, PIXEL_DECIMALS),
        _numbers(table.truncated[rows, columns], SHARE_DECIMALS),
        _numbers(table.visible[rows, columns], SHARE_DECIMALS),
        _rings(shard.marks["silhouette"].rings, np.flatnonzero(shard.keep.ravel())),
        _keypoints(shard, rows, columns),
    ]


def _texts(texts: Sequence[str], places: Int[np.ndarray, "m"]) -> Any:
    return pa.array(list(texts), pa.string()).take(pa.array(places, pa.int64()))


def _numbers(values: Float[np.ndarray, "*m"], decimals: int) -> Any:
    # A zero has no sign, whichever way it was rounded.
    rounded = np.round(values.ravel(), decimals) + 0.0
    return pa.array(rounded, pa.float64(), mask=np.isnan(rounded))


def _fixed(values: Float[np.ndarray, "m k"], kind: Any, decimals: int) -> Any:
    return pa.FixedSizeListArray.from_arrays(_numbers(values, decimals), type=kind)


def _transforms(Ts: Float[np.ndarray, "m 4 4"]) -> Any:
    position = _fixed(Ts[:, :3, 3], _THREE, POSITION_DECIMALS)
    wxyz = _fixed(rigid_transform.wxyz_from_rotation(Ts[:, :3, :3]), _FOUR, QUATERNION_DECIMALS)
    return pa.StructArray.from_arrays([position, wxyz], fields=list(_TRANSFORM))


def _rings(rings: Rings, kept: Int[np.ndarray, "m"]) -> Any:
    """Of each kept label its rings, `x y x y ...`; labels that are not kept have none."""
    flat = pa.array(np.round(rings.points.ravel(), PIXEL_DECIMALS).astype(np.float32), pa.float32())
    each = pa.ListArray.from_arrays(pa.array(2 * rings.ring_starts, pa.int32()), flat)
    starts = np.concatenate([rings.label_starts[:-1][kept], rings.label_starts[-1:]])
    return pa.ListArray.from_arrays(pa.array(starts, pa.int32()), each)


def _keypoints(shard: Shard, rows: Int[np.ndarray, "m"], columns: Int[np.ndarray, "m"]) -> Any:
    """Of each label the named points of its class; x and y are null where a point cannot be shown."""
    marks = shard.marks["keypoints"]
    counts = np.array([len(a_class.keypoints) for a_class in shard.classes], dtype=np.int64)[
        shard.class_of_box[columns]
    ]
    held = np.arange(marks.points.shape[2]) < counts[:, None]
    points, states = marks.points[rows, columns][held], marks.states[rows, columns][held]
    names = pa.array([keypoint.name for a_class in shard.classes for keypoint in a_class.keypoints], pa.string())
    first = np.cumsum([0, *(len(a_class.keypoints) for a_class in shard.classes)])[shard.class_of_box[columns]]
    places = (first[:, None] + np.arange(held.shape[1]))[held]
    coordinates = [_numbers(points[:, axis], PIXEL_DECIMALS) for axis in (0, 1)]
    each = pa.StructArray.from_arrays(
        [names.take(pa.array(places, pa.int64())), *coordinates, pa.array(states, pa.int8())], fields=list(_KEYPOINT)
    )
    return pa.ListArray.from_arrays(pa.array(np.cumsum([0, *counts]), pa.int32()), each)


def write_piece(table: Any, path: Path) -> None:
    """Keep a shard's table until the shards are joined."""
    with pa.OSFile(str(path), "wb") as file, pa.ipc.new_stream(file, table.schema) as stream:
        stream.write_table(table, max_chunksize=ROW_GROUP)


def join_pieces(pieces: Sequence[Path], schema: Any, target: Path) -> None:
    """Write the shards' rows as one Parquet file, a group at a time."""
    dictionaries: Any = [name for name in _OF_MANY_ROWS if name.partition(".")[0] in schema.names]
    with pq.ParquetWriter(
        str(target),
        schema,
        compression="zstd",
        compression_level=3,
        use_dictionary=dictionaries,
    ) as writer:
        waiting = schema.empty_table()
        for batch in _batches(pieces):
            waiting = pa.concat_tables([waiting, pa.Table.from_batches([batch])])
            while waiting.num_rows >= ROW_GROUP:
                _write_group(writer, waiting.slice(0, ROW_GROUP))
                waiting = waiting.slice(ROW_GROUP)
        if waiting.num_rows:
            _write_group(writer, waiting)


def _batches(pieces: Sequence[Path]) -> Iterator[Any]:
    for piece in pieces:
        with pa.OSFile(str(piece), "rb") as file, pa.ipc.open_stream(file) as stream:
            yield from stream


def _write_group(writer: Any, table: Any) -> None:
    # Pages follow the table's chunks, and those are the shards'.
    writer.write_table(table.combine_chunks(), row_group_size=ROW_GROUP)
