"""What an export would write is what it then writes."""

import os
from collections.abc import Callable
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import pytest

from ars_web.datasets import forecast as forecasts
from ars_web.datasets.forecast import forecast
from ars_web.datasets.jobs import plan_export, run_export
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.registry import WRITERS
from ars_web.errors import BadFile, BadInput, Cancelled
from ars_web.sessions.model import SessionSnapshot

Make = Callable[..., SessionSnapshot]

OPTIONS: list[dict[str, Any]] = [
    {},
    {"frames": {"step": 3, "start": 1, "stop": 20}, "split": {"train": 0.5, "val": 0.25, "test": 0.25}},
    {"min_visible": 0.6, "max_truncated": 0.3, "min_area_px": 30.0, "split": {"by": "frame", "seed": 4}},
    {"images": "rectify", "min_visible": 0.2},
    {"images": "none", "frames": {"list": [0, 5, 23]}},
    {"images": "copy", "sessions": ["s2"], "split": {"train": 0.5, "val": 0.5, "by": "session"}},
]


@pytest.mark.parametrize(("kind", "given"), list(product(WRITERS, OPTIONS)))
def test_the_numbers_are_those_of_the_report(
    make_snapshot: Make, tmp_path: Path, kind: str, given: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(forecasts, "LABELS_AT_ONCE", 12)
    options = ExportOptions.model_validate(given)
    snapshots = [make_snapshot(24), *(make_snapshot(9, sid=s, classes=("tall one", "cone")) for s in options.sessions)]
    plan = plan_export(snapshots, format=kind, options=options, out=tmp_path / "dataset")
    found = forecast(plan)
    assert not plan.out.exists()
    report = run_export(plan)
    assert (found.format, found.options) == (report.format, report.options)
    assert (found.splits, found.dropped) == (report.splits, report.dropped)
    assert (found.sessions, found.classes) == (report.sessions, report.classes)
    assert found.frames == sum(split.images for split in report.splits.values()) == len(plan.frames)
    images = [
        path for path in plan.out.rglob("*.*") if path.suffix in (".jpg", ".png") and "mask" not in str(path.parent)
    ]
    linked = [path for path in images if path.stat().st_nlink > 1]
    assert (found.images.linked, sum(found.images.model_dump().values())) == (len(linked), len(images))
    if found.images.encoded == 0:
        assert found.image_bytes == sum(path.stat().st_size for path in images)
        assert found.new_bytes == sum(path.stat().st_size for path in images if path not in linked)
    elif options.images == "rectify" and not WRITERS[kind].only_png:
        assert found.images.encoded == int((plan.frames.camera_id == 0).sum() + 0)
        assert found.new_bytes == found.image_bytes > 0


def test_images_in_another_encoding_than_the_formats_are_made_anew(make_snapshot: Make, tmp_path: Path) -> None:
    options = ExportOptions.model_validate({})
    for kind, encoded in (("ars", 6), ("yolo", 0)):
        plan = plan_export([make_snapshot(6, suffix=".png")], format=kind, options=options, out=tmp_path / kind)
        assert (forecast(plan).images.encoded, forecast(plan).images.linked) == (encoded, 6 - encoded)


def test_images_on_another_disk_are_copied(
    make_snapshot: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = plan_export([make_snapshot(6)], format="yolo", options=ExportOptions.model_validate({}), out=tmp_path / "d")
    look = os.stat

    def elsewhere(path: Any, *args: Any, **more: Any) -> os.stat_result:
        found = look(path, *args, **more)
        return os.stat_result((*found[:2], found.st_dev + 1, *found[3:])) if "recording-s1" in str(path) else found

    monkeypatch.setattr(forecasts.os, "stat", elsewhere)
    found = forecast(plan)
    assert found.images.model_dump() == {"linked": 0, "copied": 6, "encoded": 0}
    assert found.new_bytes == found.image_bytes > 0


def test_a_session_without_boxes_has_negatives_only(make_snapshot: Make, tmp_path: Path) -> None:
    plan = plan_export(
        [make_snapshot(5, objects=[])], format="coco", options=ExportOptions.model_validate({}), out=tmp_path / "d"
    )
    found = forecast(plan)
    assert sum(split.negatives for split in found.splits.values()) == 5
    assert found.splits == run_export(plan).splits


def test_it_stops_when_nobody_waits_any_more(
    make_snapshot: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(forecasts, "LABELS_AT_ONCE", 3)
    plan = plan_export([make_snapshot(12)], format="yolo", options=ExportOptions.model_validate({}), out=tmp_path / "d")
    asked: list[None] = []

    def left() -> bool:
        asked.append(None)
        return len(asked) == 4

    with pytest.raises(Cancelled):
        forecast(plan, cancelled=left)
    assert len(asked) == 4


def test_what_the_export_would_refuse_is_refused_now(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(4)
    snapshot.frames.images[2].unlink()
    with pytest.raises(BadFile, match="the image cannot be exported"):
        plan_export([snapshot], format="yolo", options=ExportOptions.model_validate({}), out=tmp_path / "d")
    none = ExportOptions.model_validate({"images": "none"})
    assert forecast(plan_export([snapshot], format="yolo", options=none, out=tmp_path / "d")).image_bytes == 0
    with pytest.raises(BadInput, match="no frame is chosen"):
        plan_export(
            [replace(snapshot)],
            format="yolo",
            options=ExportOptions.model_validate({"frames": {"start": 9}}),
            out=tmp_path / "d",
        )
