"""Parquet tables as pandas sees them, and the same bytes whatever the shards."""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from ars_web.datasets.jobs import partial_folder, plan_export, run_export
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.readback.comparison import compare
from ars_web.datasets.writers import parquet_tables
from ars_web.errors import BadFile, BadInput
from ars_web.geometry import rigid_transform
from ars_web.sessions.model import SessionSnapshot

Make = Callable[..., SessionSnapshot]
NONE = ExportOptions.model_validate({"images": "none"})


def matrix(held: dict) -> np.ndarray:
    return rigid_transform.from_position_wxyz(np.array(held["position"]), np.array(held["wxyz"]))


def test_by_pandas(export: Callable[..., object]) -> None:
    expected = export("parquet")
    labels = pd.read_parquet(expected.folder / "tables" / "labels.parquet")
    frames = pd.read_parquet(expected.folder / "tables" / "frames.parquet")
    assert frames["frame"].tolist() == list(range(12))
    assert frames["labels"].sum() == len(labels) == sum(map(len, expected.boxes.values()))
    assert (frames["labels"] == 0).any()
    for row in frames.to_dict("records"):
        stem = Path(row["image"]).stem
        assert (expected.folder / row["image"]).is_file()
        assert row["split"] == expected.splits[stem]
        of_frame = labels[labels["frame"] == row["frame"]]
        assert of_frame["class_id"].tolist() == expected.classes[stem]
        assert of_frame["class"].tolist() == [("cube", "tall one")[i] for i in expected.classes[stem]]
        if len(of_frame):
            assert np.abs(np.stack(of_frame["bbox"].tolist()) - expected.boxes[stem]).max() <= 6e-5
        for label in of_frame.to_dict("records"):
            assert label["image"] == row["image"]
            T = matrix(label["T_world_camera"]) @ matrix(label["T_camera_box"])
            assert np.abs(T - matrix(label["T_world_box"])).max() < 1e-8
            assert label["box_name"] == f"box {label['box_id']}"
            ring = np.array(label["outline"][0]).reshape(-1, 2)
            assert np.abs(np.concatenate([ring.min(axis=0), ring.max(axis=0)]) - label["bbox"]).max() < 0.2
            assert [point["name"] for point in label["keypoints"]][:2] == ["centre", "corner 0"]
            assert len(label["keypoints"]) == 9


def test_groups_and_bytes_do_not_depend_on_the_shards(
    make_snapshot: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(parquet_tables, "ROW_GROUP", 7)
    snapshots = [make_snapshot(12), make_snapshot(5, sid="s2")]
    found: set[tuple[bytes, ...]] = set()
    for shard in (1, 4, 12):
        out = tmp_path / str(shard)
        run_export(plan_export(snapshots, format="parquet", options=NONE, out=out, frames_per_shard=shard))
        found.add(tuple((out / "tables" / f"{name}.parquet").read_bytes() for name in ("frames", "labels")))
    assert len(found) == 1
    held = pq.ParquetFile(tmp_path / "1" / "tables" / "labels.parquet").metadata
    rows = [held.row_group(i).num_rows for i in range(held.num_row_groups)]
    assert set(rows[:-1]) == {7}
    assert sum(rows) == held.num_rows > 21


def test_what_cannot_be_shown_of_a_keypoint_is_null(make_snapshot: Make, tmp_path: Path) -> None:
    plan = plan_export([make_snapshot(12)], format="parquet", options=NONE, out=tmp_path / "d")
    run_export(plan)
    columns = pq.read_table(tmp_path / "d" / "tables" / "labels.parquet").to_pydict()
    points = [point for label in columns["keypoints"] for point in label]
    assert all((point["x"] is None) == (point["y"] is None) for point in points)
    assert {point["state"] for point in points} <= {0, 1, 2}
    assert not any(point["state"] for point in points if point["x"] is None)


def test_a_session_without_boxes_has_tables_without_rows(make_snapshot: Make, tmp_path: Path) -> None:
    run_export(plan_export([make_snapshot(2, objects=[])], format="parquet", options=NONE, out=tmp_path / "d"))
    labels = pq.read_table(tmp_path / "d" / "tables" / "labels.parquet")
    assert labels.num_rows == 0
    assert labels.schema.field("bbox").type == pa.list_(pa.float64(), 4)
    assert pq.read_table(tmp_path / "d" / "tables" / "frames.parquet").column("labels").to_pylist() == [0, 0]


def test_without_pyarrow_nothing_is_begun(make_snapshot: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(BadInput, match=r"pip install 'ars-web\[parquet\]'"):
        plan_export([make_snapshot(2)], format="parquet", options=NONE, out=tmp_path / "d")
    assert not (tmp_path / "d").exists()
    assert not partial_folder(tmp_path / "d").exists()


def test_damage_is_found(make_snapshot: Make, tmp_path: Path) -> None:
    plan = plan_export([make_snapshot(4)], format="parquet", options=NONE, out=tmp_path / "d")
    run_export(plan)
    path = tmp_path / "d" / "tables" / "labels.parquet"
    whole = pq.read_table(path)
    pq.write_table(whole.slice(1), path)
    with pytest.raises(BadFile, match="has 2 rows, not 3"):
        compare(plan, plan.out)
    pq.write_table(pa.concat_tables([whole, whole.slice(0, 1)]), path)
    with pytest.raises(BadFile, match="is not among the frames, or twice"):
        compare(plan, plan.out)
    path.write_bytes(path.read_bytes()[:-9])
    with pytest.raises(BadFile, match="no whole Parquet file"):
        compare(plan, plan.out)
