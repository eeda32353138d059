from collections.abc import Callable

import numpy as np
import pytest

from ars_web.datasets.options import ExportOptions
from ars_web.datasets.samples import (
    LabelTable,
    frame_labels,
    kept,
    label_table,
    labels_in_frames,
    outlines_in_frames,
)
from ars_web.errors import BadInput, NotFound
from ars_web.geometry import labels as geometry
from ars_web.geometry.box import Box
from ars_web.sessions.model import SessionSnapshot

Make = Callable[..., SessionSnapshot]


def test_a_table_over_two_cameras_is_each_frames_own_labels(make_snapshot: Make) -> None:
    snapshot = make_snapshot(12)
    order = [9, 4, 0, 3, 11]
    table = label_table(snapshot, order)
    boxes = [b.box for b in snapshot.state.boxes.values()]
    for row, index in enumerate(order):
        camera = snapshot.cameras[int(snapshot.frames.camera_ids[index])]
        alone = geometry.labels_of_boxes(camera, snapshot.frames.Ts_world_camera[index : index + 1], boxes)
        assert np.array_equal(table.bbox[row], alone.bbox[0], equal_nan=True)
        assert np.array_equal(table.bbox_amodal[row], alone.bbox_amodal[0], equal_nan=True)
        assert np.array_equal(table.truncated[row], alone.truncated[0])


def test_outlines_over_two_cameras_are_each_labels_own(make_snapshot: Make) -> None:
    snapshot = make_snapshot(12)
    frames, boxes = snapshot.frames, [b.box for b in snapshot.state.boxes.values()]
    wanted = np.random.default_rng(0).random((12, len(boxes))) < 0.6
    found = outlines_in_frames(snapshot.cameras, frames.camera_ids, frames.Ts_world_camera, boxes, wanted)
    for row in range(12):
        camera = snapshot.cameras[int(frames.camera_ids[row])]
        for column, box in enumerate(boxes):
            at = row * len(boxes) + column
            ring = found.points[found.starts[at] : found.starts[at + 1]]
            alone = geometry.outline(camera, frames.Ts_world_camera[row], box)
            assert np.array_equal(ring, alone if wanted[row, column] else np.zeros((0, 2)))


def test_labels_of_a_frame_are_the_tables(make_snapshot: Make) -> None:
    snapshot = make_snapshot(12)
    for index in (0, 4, 11):
        table = label_table(snapshot, [index])
        for column, label in enumerate(frame_labels(snapshot, index)):
            assert label.box_id == column + 1
            assert label.class_id == column % 2
            if label.bbox is None:
                assert np.isnan(table.bbox[0, column]).all()
                assert (label.visible, label.truncated, len(label.outline), label.wireframe) == (0.0, 1.0, 0, [])
            else:
                assert label.bbox == tuple(table.bbox[0, column])
                assert label.visible == table.visible[0, column]
                assert np.abs(label.outline.min(axis=0) - label.bbox[:2]).max() < 0.2
                assert np.abs(label.outline.max(axis=0) - label.bbox[2:]).max() < 0.2
                assert 1 <= len(label.wireframe) <= 12


def test_a_frame_that_looks_away_has_labels_without_boxes(make_snapshot: Make) -> None:
    labels = frame_labels(make_snapshot(12), 11)
    assert len(labels) == 3
    assert all(label.bbox is None for label in labels)


def test_a_frame_that_is_not_there_is_named(make_snapshot: Make) -> None:
    snapshot = make_snapshot(3)
    for index in (-1, 3):
        with pytest.raises(NotFound, match=f"no frame {index}; its frames are 0 to 2"):
            frame_labels(snapshot, index)


def test_shapes_without_a_source_are_refused(make_snapshot: Make) -> None:
    snapshot = make_snapshot(1)
    with pytest.raises(BadInput, match="needs a mesh"):
        frame_labels(snapshot, 0, shape="mesh")
    with pytest.raises(BadInput, match="unknown"):
        frame_labels(snapshot, 0, shape="sphere")
    assert len(frame_labels(snapshot, 0, shape="hull")) == 3


def test_visible_fractions_are_spared_where_not_asked_for(make_snapshot: Make) -> None:
    snapshot = make_snapshot(4)
    boxes: list[Box] = [b.box for b in snapshot.state.boxes.values()]
    frames = snapshot.frames
    table = labels_in_frames(snapshot.cameras, frames.camera_ids, frames.Ts_world_camera, boxes, with_visible=False)
    assert np.isnan(table.visible).all()
    assert not np.isnan(label_table(snapshot, [0]).visible).all()


def one_row(bbox: list[list[float]], truncated: list[float], visible: list[float]) -> LabelTable:
    boxes = np.array(bbox, dtype=float)[None]
    return LabelTable(boxes, boxes, np.array(truncated)[None], np.array(visible)[None])


def test_each_rule_drops_what_it_says_and_the_first_that_applies_counts() -> None:
    nan = float("nan")
    table = one_row(
        [[0, 0, 10, 10], [nan] * 4, [0, 0, 1, 3], [0, 0, 10, 10], [0, 0, 10, 10], [0, 0, 0, 10]],
        [0.0, 1.0, 0.9, 0.9, 0.5, 0.0],
        [1.0, nan, 0.1, 0.1, 0.1, 1.0],
    )
    keep, dropped = kept(table, ExportOptions(min_visible=0.2, max_truncated=0.5))
    assert keep[0].tolist() == [True, False, False, False, False, False]
    assert dropped == {"not_in_image": 1, "area": 2, "truncation": 1, "visibility": 1}


def test_limits_themselves_are_kept() -> None:
    table = one_row([[0, 0, 2, 2]], [0.5], [0.5])
    keep, _ = kept(table, ExportOptions(min_visible=0.5, max_truncated=0.5, min_area_px=4.0))
    assert keep.all()


def test_a_box_without_an_area_is_never_kept() -> None:
    table = one_row([[5, 5, 5, 9], [5, 5, 9, 5]], [0.0, 0.0], [1.0, 1.0])
    keep, dropped = kept(table, ExportOptions(min_area_px=0.0))
    assert not keep.any()
    assert dropped["area"] == 2
