"""A report's facts beside a slow count, and its page."""

import re
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from ars_web.datasets.options import ExportOptions
from ars_web.datasets.samples import frame_labels
from ars_web.datasets.splits import SPLITS, assign
from ars_web.errors import BadInput
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.polygon import Polygon
from ars_web.sessions.model import (
    FrameTable,
    Mask,
    ObjectClass,
    SessionSnapshot,
    SessionState,
    SessionSummary,
    VirtualBox,
)
from ars_web.studies import planned_labels, session_study
from ars_web.studies import session_report as session_reports
from ars_web.studies.report_facts import SessionReport
from ars_web.studies.report_page import session_page
from ars_web.studies.session_report import session_report
from ars_web.studies.session_study import SessionStudy, study_session

CAMERA = Camera(64, 48, 50.0, 51.0, 31.0, 24.5, "brown", (-0.2, 0.05, 0.001, -0.001, 0.0))
NOW = datetime(2026, 1, 1, tzinfo=UTC)

OBJECTS = [
    (0, "near", (0.0, 0.0, 0.0), (0.2, 0.15, 0.1)),
    (0, "beside", (0.35, 0.0, 0.0), (0.2, 0.15, 0.2)),
    (1, "behind", (-0.3, 0.3, 0.0), (0.1, 0.1, 0.3)),
    (1, "small", (0.1, 0.2, 0.0), (0.02, 0.02, 0.02)),
]


def circling(n: int) -> np.ndarray:
    """Cameras on half a circle that look at the origin, the last sixth of them away from it."""
    angle = np.linspace(0.0, np.pi, n)
    centre = np.column_stack([np.cos(angle), np.sin(angle), np.full(n, 0.5)])
    z = -centre / np.linalg.norm(centre, axis=1, keepdims=True)
    z[n - n // 6 :] *= -1
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return rigid_transform.from_rotation(np.stack([x, np.cross(z, x), z], axis=-1), centre)


def make(
    folder: Path,
    n: int = 24,
    *,
    classes: tuple[str, ...] = ("cube", "rod"),
    objects: list[tuple[int, str, tuple[float, float, float], tuple[float, float, float]]] = OBJECTS,
) -> SessionSnapshot:
    """A session whose images are named, and not written."""
    boxes = {
        i: VirtualBox(i, class_id, name, Box(rigid_transform.from_rotation(np.eye(3), np.array(at)), np.array(size)), 1)
        for i, (class_id, name, at, size) in enumerate(objects, start=1)
    }
    named = {i: ObjectClass(i, name, "#e6194b", 1) for i, name in enumerate(classes)}
    state = SessionState(3, "a session", named, boxes, len(classes), len(boxes) + 1)
    names = tuple(f"{i:04d}.jpg" for i in range(n))
    frames = FrameTable(names, tuple(folder / name for name in names), np.zeros(n, dtype=np.int64), circling(n))
    return SessionSnapshot("s1", state, {0: CAMERA}, frames)


def looked_at(snapshot: SessionSnapshot, **given: Any) -> tuple[SessionStudy, SessionReport]:
    study = study_session(snapshot, ExportOptions.model_validate(given))
    count = len(snapshot.frames)
    recorded = SessionSummary(snapshot.id, snapshot.state.name, 3, "tum", "/somewhere", count, 2, 4, 5, NOW, NOW)
    return study, session_report(study, recorded)


@pytest.mark.parametrize(
    "given",
    [
        {},
        {"frames": {"step": 3, "start": 1, "stop": 20}, "split": {"train": 0.5, "val": 0.25, "test": 0.25}},
        {"min_visible": 0.6, "max_truncated": 0.3, "min_area_px": 30.0, "split": {"by": "frame", "seed": 4}},
    ],
)
def test_the_facts_are_those_of_a_slow_count(tmp_path: Path, given: dict[str, Any]) -> None:
    snapshot = make(tmp_path)
    options = ExportOptions.model_validate(given)
    _, report = looked_at(snapshot, **given)
    chosen = range(options.frames.start, options.frames.stop or 24, options.frames.step)
    splits = [SPLITS[i] for i in assign([len(chosen)], options.split)]
    dropped: Counter[str] = Counter()
    kept: list[tuple[int, str, Any, float]] = []
    in_image: Counter[int] = Counter()
    for index, split in zip(chosen, splits, strict=True):
        for label in frame_labels(snapshot, index):
            if label.bbox is None:
                dropped["not_in_image"] += 1
                continue
            in_image[label.box_id] += 1
            x0, y0, x1, y1 = label.bbox
            area = (x1 - x0) * (y1 - y0)
            if area < options.min_area_px:
                dropped["area"] += 1
            elif label.truncated > options.max_truncated:
                dropped["truncation"] += 1
            elif label.visible < options.min_visible:
                dropped["visibility"] += 1
            else:
                kept.append((index, split, label, area**0.5))
    assert kept
    assert +Counter(report.dropped) == dropped
    assert report.labels == len(kept)
    labelled = {index for index, *_ in kept}
    assert (report.frames.recorded, report.frames.chosen) == (24, len(chosen))
    assert (report.frames.labelled, report.frames.negatives) == (len(labelled), len(chosen) - len(labelled))
    for name, split in report.splits.items():
        assert split.counts.images == splits.count(name)
        assert split.counts.labels == sum(one == name for _, one, *_ in kept)
    for one in report.classes:
        own = [(split, label, side) for _, split, label, side in kept if label.class_id == one.id]
        assert one.labels == len(own)
        assert +Counter(one.splits) == Counter(split for split, *_ in own)
        assert one.objects == 2
        if not own:
            continue
        assert one.sizes and one.visible and one.truncated and one.views  # noqa: PT018 - all are there or none
        sides = [side for *_, side in own]
        assert one.sizes.median_px == pytest.approx(np.median(sides), rel=1e-5)
        assert (one.sizes.tiny, one.sizes.small) == (sum(s < 16 for s in sides), sum(s < 32 for s in sides))
        assert one.sizes.small + one.sizes.medium + one.sizes.large == sum(one.sizes.histogram.counts) == len(own)
        for facts, values in (
            (one.visible, [label.visible for _, label, _ in own]),
            (one.truncated, [label.truncated for _, label, _ in own]),
        ):
            tenths = Counter(min(int(10 * np.float32(value) + 1e-6), 9) for value in values)
            assert facts.histogram.counts == [tenths[i] for i in range(10)]
            assert facts.median == pytest.approx(np.median(values), abs=1e-6)
        assert one.views.views == len(own)
    for box in report.boxes:
        assert box.in_image == in_image[box.id]
        assert box.labels == sum(label.box_id == box.id for *_, label, _ in kept)
    assert report.visibility.every
    assert (report.recording.format, report.recording.skipped) == ("tum", 5)
    # Half a circle in 23 steps.
    assert report.recording.path_m == pytest.approx(23 * 2 * np.sin(np.pi / 46), rel=1e-6)


def test_visible_shares_of_some_frames_stand_for_all(tmp_path: Path) -> None:
    snapshot = make(tmp_path)
    study = study_session(snapshot, ExportOptions.model_validate({}), visible_frames=6)
    assert study.labels.looked_at.tolist() == [2, 6, 10, 14, 18, 22]
    every = study_session(snapshot, ExportOptions.model_validate({}))
    assert np.array_equal(study.labels.visible, every.labels.visible[study.labels.looked_at], equal_nan=True)
    _, report = looked_at(snapshot)
    fewer = report.model_copy(update={"visibility": report.visibility.model_copy(update={"frames": 6, "every": False})})
    said = "Visible shares are of 6 frames spread evenly, not of all 24"
    assert said in session_page(study, fewer)
    assert said not in session_page(every, report)


def test_the_command_is_that_of_the_export(tmp_path: Path) -> None:
    given = {"shape": "box", "min_visible": 0.25, "frames": {"list": [1, 2, 5]}, "split": {"by": "frame", "seed": 3}}
    _, report = looked_at(make(tmp_path), **given)
    assert report.command == (
        "ars-web export s1 --format yolo --out dataset --frames-list 1,2,5 --shape box --min-visible 0.25"
        " --split-by frame --split-seed 3"
    )


class Reader(HTMLParser):
    """What a browser would make of a page: its elements, and its text."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.elements: Counter[str] = Counter()
        self.attributes: list[tuple[str, str | None]] = []
        self.text = ""
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements[tag] += 1
        self.attributes += attrs

    def handle_data(self, data: str) -> None:
        self.text += data


def test_names_are_shown_as_they_are_and_nothing_is_fetched(tmp_path: Path) -> None:
    evil = "<script>alert(1)</script>\"'&"
    objects = [(class_id, evil, at, size) for class_id, _, at, size in OBJECTS]
    snapshot = make(tmp_path, classes=(evil, "rod"), objects=objects)
    snapshot = replace(snapshot, state=replace(snapshot.state, name=evil))
    study, report = looked_at(snapshot)
    page = session_page(study, report)
    read = Reader(page)
    assert read.elements["script"] == 0
    assert evil in read.text
    assert read.elements["img"] == 0
    assert read.elements["section"] == 2 + 4
    for name, value in read.attributes:
        assert not name.startswith("on")
        if name in ("src", "href"):
            assert str(value).startswith(("data:", "#"))
    assert not re.search(r"url\(|@import", page)


def test_the_same_session_has_the_same_page_and_a_broken_image_is_told(tmp_path: Path) -> None:
    snapshot = make(tmp_path)
    for i, path in enumerate(snapshot.frames.images):
        assert isinstance(path, Path)
        cv2.imwrite(str(path), np.full((48, 64, 3), 10 * i, dtype=np.uint8))
    study, report = looked_at(snapshot)
    whole = session_page(study, report)
    assert whole == session_page(*looked_at(snapshot))
    assert Reader(whole).elements["img"] == 6
    (tmp_path / "0001.jpg").write_bytes(b"\xff\xd8 no more than that")
    (tmp_path / "0005.jpg").unlink()
    page = session_page(study, report)
    assert Reader(page).elements["img"] == 4
    assert page.count("This frame cannot be drawn. 0") == 2
    assert str(tmp_path) not in page


def test_only_what_is_written_is_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study, report = looked_at(make(tmp_path), min_area_px=60.0)
    drawn: list[tuple[int, list[int]]] = []

    def draw(snapshot: SessionSnapshot, index: int, *, shape: str | None, only: list[int]) -> np.ndarray:
        drawn.append((index, only))
        return np.zeros((8, 8, 3), dtype=np.uint8)

    monkeypatch.setattr("ars_web.studies.report_page.draw_frame", draw)
    session_page(study, report)
    assert len(drawn) == 6
    for index, only in drawn:
        assert only == (np.flatnonzero(study.labels.keep[index]) + 1).tolist()
        assert 4 not in only


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda folder: make(folder, objects=[], classes=()), "The session has no boxes, so there is nothing to label"),
        (
            lambda folder: make(folder, objects=[(0, "away", (0.0, 0.0, 50.0), (0.1, 0.1, 0.1))]),
            "No object, of 1, is labelled in any of the 24 chosen frames",
        ),
    ],
)
def test_a_session_without_labels_says_so(tmp_path: Path, change: Callable[[Path], SessionSnapshot], says: str) -> None:
    study, report = looked_at(change(tmp_path))
    assert report.labels == 0
    assert report.warnings[0].grave
    read = Reader(session_page(study, report))
    assert says in read.text
    assert "No object is labelled in any of the 24 frames." in read.text
    # A frame is shown all the same.
    assert "0 labels" in read.text


def test_what_no_export_could_be_is_refused(tmp_path: Path) -> None:
    for given, says in (
        ({"frames": {"start": 24}}, "no frame is chosen"),
        ({"frames": {"list": [24]}}, "frame 24 is listed"),
        ({"shape": "mesh"}, "needs a mesh"),
        ({"split": {"by": "session"}}, "a split by session needs"),
    ):
        with pytest.raises(BadInput, match=says):
            looked_at(make(tmp_path), **given)


def test_distances_and_neighbours_are_of_what_is_labelled(tmp_path: Path) -> None:
    snapshot = make(tmp_path, 60)
    study, report = looked_at(snapshot, min_area_px=60.0, split={"train": 0.5, "val": 0.5, "by": "frame"})
    centres = snapshot.frames.Ts_world_camera[:, :3, 3]
    boxes = np.array([box.box.T_world_box[:3, 3] for _, box in sorted(snapshot.state.boxes.items())])
    keep, split = study.labels.keep, study.labels.plan.frames.split
    away = np.linalg.norm(centres[:, None] - boxes, axis=2)
    assert study.distances == pytest.approx(np.where(keep, away, np.inf).min(axis=1))
    assert np.isinf(study.distances).any()
    labelled = keep.any(axis=1)
    near = study.neighbours["val"]
    assert near.rows.tolist() == np.flatnonzero(labelled & (split == 1)).tolist()
    assert (labelled & (split == 0))[near.nearest].all()
    told = report.splits["val"].neighbours
    assert told is not None
    rotations = snapshot.frames.Ts_world_camera[:, :3, :3]
    between = rotations[near.rows].transpose(0, 2, 1) @ rotations[near.nearest]
    turns = np.degrees(np.arccos(np.clip((np.trace(between, axis1=1, axis2=2) - 1) / 2, -1, 1)))
    assert told.median_turn == pytest.approx(np.median(turns), abs=1e-4)
    moves = np.linalg.norm(centres[near.rows] - centres[near.nearest], axis=1) / study.distances[near.rows]
    assert told.median_move == pytest.approx(np.median(moves), abs=1e-6)
    assert report.splits["train"].neighbours is None


def test_where_no_labelled_frame_trains_there_is_no_neighbour(tmp_path: Path) -> None:
    # The last frames look away: all of those that train do.
    study, _ = looked_at(make(tmp_path), frames={"list": [0, 1, 20, 21, 22, 23]}, split={"train": 0.6, "val": 0.4})
    split = study.labels.plan.frames.split
    empty = replace(study.labels, keep=study.labels.keep & (split != 0)[:, None])
    assert session_study._across_splits(empty, study.distances) == {}


def test_sizes_and_shares_on_a_limit_belong_to_what_begins_there() -> None:
    found = session_reports._sizes(np.array([15.9, 16.0, 31.9, 32.0, 95.9, 96.0], dtype=np.float32))
    assert found is not None
    assert (found.tiny, found.small, found.medium, found.large) == (1, 3, 2, 1)
    assert found.histogram.counts == [0, 0, 1, 1, 1, 1, 0, 1, 1, *[0] * 7]
    for dtype in (np.float32, np.float64):
        shares = session_reports._shares(np.arange(11, dtype=dtype) / dtype(10))
        assert shares is not None
        assert shares.histogram.counts == [1, 1, 1, 1, 1, 1, 1, 1, 1, 2]


def test_masks_that_nobody_accepted_are_not_counted(tmp_path: Path) -> None:
    snapshot = make(tmp_path)
    ring = Polygon(np.array([[1.0, 1.0], [5.0, 1.0], [5.0, 5.0]]))
    masks = {
        i: Mask(i, 2, frame, 0, (ring,), "smart" if i < 3 else "proposed", i < 3, 1)
        for i, frame in enumerate((4, 5, 6), start=1)
    }
    snapshot = replace(snapshot, state=replace(snapshot.state, masks=masks))
    _, report = looked_at(snapshot)
    assert [box.masks for box in report.boxes] == [0, 2, 0, 0]


def test_blocks_of_labels_add_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    snapshot = make(tmp_path)
    given: dict[str, Any] = {"min_visible": 0.6, "max_truncated": 0.3, "min_area_px": 30.0}
    whole, report = looked_at(snapshot, **given)
    monkeypatch.setattr(planned_labels, "LABELS_AT_ONCE", 20)
    parts, of_parts = looked_at(snapshot, **given)
    assert of_parts == report
    assert sum(report.dropped.values()) + report.labels == 24 * 4
    assert np.array_equal(parts.labels.side, whole.labels.side, equal_nan=True)
