"""A small dataset in each format, and what it should hold."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from ars_web.datasets.jobs import plan_export, run_export
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.report import ExportReport
from ars_web.datasets.samples import kept, label_table
from ars_web.datasets.splits import SPLITS
from ars_web.sessions.model import SessionSnapshot


@dataclass(frozen=True)
class Expected:
    """A dataset's folder, its report, and per frame's stem the kept boxes (x0, y0, x1, y1) and their classes."""

    folder: Path
    report: ExportReport
    boxes: dict[str, np.ndarray]
    classes: dict[str, list[int]]
    splits: dict[str, str]


@pytest.fixture
def export(make_snapshot: Callable[..., SessionSnapshot], tmp_path: Path) -> Callable[..., Expected]:
    """Exports twelve frames of one size in a format."""

    def make(kind: str, **changes: object) -> Expected:
        snapshot = make_snapshot(12, one_camera=True)
        options = ExportOptions.model_validate(changes)
        plan = plan_export([snapshot], format=kind, options=options, out=tmp_path / kind, frames_per_shard=5)
        report = run_export(plan)
        table = label_table(snapshot, range(12))
        keep, _ = kept(table, options)
        stems = plan.frames.stems
        return Expected(
            folder=tmp_path / kind,
            report=report,
            boxes={stem: table.bbox[i, keep[i]] for i, stem in enumerate(stems)},
            classes={stem: [column % 2 for column in np.flatnonzero(keep[i]).tolist()] for i, stem in enumerate(stems)},
            splits={stem: SPLITS[split] for stem, split in zip(stems, plan.frames.split.tolist(), strict=True)},
        )

    return make
