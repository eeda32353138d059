"""The compass dataset: bins and angles that the original's own tool decodes to the same, and what is told."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from ars_web.datasets.jobs import plan_export, run_export
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.planned import ExportPlan
from ars_web.datasets.readback.comparison import compare, heading_error
from ars_web.datasets.samples import LabelTable, label_table
from ars_web.datasets.writers import yolo
from ars_web.datasets.writers.compass import WRITER, compass_rows
from ars_web.errors import BadInput
from ars_web.geometry.camera import Camera
from ars_web.geometry.heading import headings
from ars_web.geometry.symmetry import NO_SYMMETRY, Symmetry
from ars_web.sessions.model import SessionSnapshot

Make = Callable[..., SessionSnapshot]

ROUND = Symmetry("continuous", axis=(0.0, 0.0, 1.0))
HALVES = Symmetry("discrete", rotations=(((0.0, 0.0, 1.0), 2),))


def plan_of(snapshot: SessionSnapshot, out: Path, **changes: object) -> ExportPlan:
    options = ExportOptions.model_validate({"images": "none", **changes})
    return plan_export([snapshot], format="compass", options=options, out=out, frames_per_shard=5)


def with_symmetry(plan: ExportPlan, *symmetries: Symmetry) -> ExportPlan:
    classes = (replace(c, symmetry=s) for c, s in zip(plan.classes, symmetries, strict=True))
    return replace(plan, classes=tuple(classes))


def rows_of(folder: Path) -> dict[int, list[list[str]]]:
    return {int(p.stem): [row.split() for row in p.read_text().splitlines()] for p in (folder / "labels").iterdir()}


def test_rows_are_yolos_with_a_heading_in_the_class_or_behind() -> None:
    random = np.random.default_rng(4)
    bbox = (np.sort(random.random((5, 3, 2, 2)), axis=2) * [64, 48]).reshape(5, 3, 4)
    table = LabelTable(bbox, bbox, np.zeros((5, 3)), np.ones((5, 3)))
    keep, sizes, classes = random.random((5, 3)) < 0.7, np.tile([64, 48], (5, 1)), np.array([0, 12, 3])
    heading = random.random((5, 3)) * 2 * np.pi
    heading.ravel()[:4] = 0.0, np.nextafter(2 * np.pi, 0), np.pi, 2 * np.pi / 18

    def texts(buffer: np.ndarray, starts: np.ndarray) -> list[list[list[str]]]:
        frames = [buffer[a:b].tobytes().decode() for a, b in pairwise(starts.tolist())]
        return [[row.split() for row in frame.splitlines()] for frame in frames]

    plain = texts(*yolo.rows(bbox, keep, sizes, classes))
    binned = texts(*compass_rows(table, keep, heading, sizes, classes, bins=18))
    valued = texts(*compass_rows(table, keep, heading, sizes, classes, bins=0))
    for frame in range(5):
        angles = heading[frame, keep[frame]].tolist()
        for row, with_bin, with_value, angle in zip(plain[frame], binned[frame], valued[frame], angles, strict=True):
            assert with_bin == [str(int(row[0]) * 18 + int(angle / (2 * np.pi) * 18)), *row[1:]]
            assert with_value[:5] == row
            assert float(with_value[5]) == pytest.approx(angle, abs=5.1e-7)


def test_the_originals_tool_finds_class_and_angle(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot, discretization = make_snapshot(12, one_camera=True), 10
    run_export(plan_of(snapshot, tmp_path / "bins", heading_bins=36))
    run_export(plan_of(snapshot, tmp_path / "angles", heading_bins=0))
    binned, valued = rows_of(tmp_path / "bins"), rows_of(tmp_path / "angles")
    table, compared = label_table(snapshot, range(12)), 0
    for frame in range(12):
        columns = np.flatnonzero(~np.isnan(table.bbox[frame, :, 0])).tolist()
        for column, row, with_value in zip(columns, binned[frame], valued[frame], strict=True):
            box, T = snapshot.state.boxes[column + 1].box, snapshot.frames.Ts_world_camera[[frame]]
            (truth,) = headings(snapshot.cameras[0], T, box, NO_SYMMETRY)
            # As its `verify_compass.py` decodes them.
            max_angle_class = int(360.0 / discretization)
            label, angle_class = divmod(int(row[0]), max_angle_class)
            angle = (angle_class * discretization + discretization * 0.5) * np.pi / 180.0
            assert label == int(with_value[0]) == column % 2
            assert abs(angle - truth) <= np.pi / max_angle_class + 1e-9
            assert float(with_value[5]) == pytest.approx(truth, abs=1e-6)
            compared += 1
    assert compared > 20
    assert (tmp_path / "bins" / "ids" / "00003.txt").read_text() == "recording-s1!0003.jpg\n"


@pytest.mark.parametrize("bins", [0, 7, 360])
def test_sets_of_any_number_of_bins_agree_with_their_session(make_snapshot: Make, tmp_path: Path, bins: int) -> None:
    plan = with_symmetry(plan_of(make_snapshot(12), tmp_path / "d", heading_bins=bins), HALVES, ROUND)
    told = run_export(plan).losses
    assert len(told) == (3 if bins else 2)
    found = compare(plan, plan.out)
    assert found.agrees, (found.largest_error, found.where)
    rows = [row for rows in rows_of(tmp_path / "d").values() for row in rows]
    of_round = [row for row in rows if int(row[0]) // max(bins, 1) == 1]
    assert len(of_round) > 5
    assert {row[0] if bins else row[5] for row in of_round} == {str(bins) if bins else "0.000000"}


def test_a_heading_that_is_off_is_measured_at_the_edges_end(make_snapshot: Make, tmp_path: Path) -> None:
    plan = plan_of(make_snapshot(12), tmp_path / "d", heading_bins=0)
    run_export(plan)
    path = next(path for path in sorted((tmp_path / "d" / "labels").iterdir()) if path.read_text())
    first, *rest = path.read_text().splitlines()
    words = first.split()
    path.write_text("\n".join([" ".join([*words[:5], f"{float(words[5]) + 0.1:.6f}"]), *rest]) + "\n")
    found = compare(plan, plan.out)
    assert (found.differing, found.agrees) == (0, False)
    camera, edge = Camera(640, 480, 500.0, 500.0, 319.5, 239.5), np.array([[[0.0, 0.0, 1.0], [0.2, 0.0, 1.0]]])
    # A hundred pixels long.
    assert heading_error(camera, np.eye(4), (0.1, 0.1), edge) == pytest.approx(200 * np.sin(0.05))
    assert heading_error(camera, np.eye(4), (6.0, 6.5), edge) == 0.0
    assert heading_error(camera, np.eye(4), (1.0, 1.0), edge[:0]) == np.inf
    assert heading_error(camera, np.eye(4), (1.0, 1.0), edge * [1.0, 1.0, -1.0]) == 0.0


def test_what_headings_lose_is_told_with_its_numbers(make_snapshot: Make, tmp_path: Path) -> None:
    plan = plan_of(make_snapshot(3), tmp_path / "d")
    assert list(WRITER.losses(plan)) == ["headings: told in 18 bins of 20 degrees"]
    told = WRITER.losses(with_symmetry(plan, HALVES, ROUND))
    assert told[1].startswith("heading of class 'cube': it looks the same after each of 2 turns")
    assert told[2].startswith("heading of class 'tall one': it looks the same from all around")
    with pytest.raises(BadInput, match="none has a heading; export to ars"):
        WRITER.losses(with_symmetry(plan, ROUND, ROUND))
