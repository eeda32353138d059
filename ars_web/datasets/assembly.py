"""From finished shards to a published dataset. Killed anywhere, it can be done again from its beginning."""

import os
import shutil
from pathlib import Path

from ars_web.datasets.planned import ExportPlan
from ars_web.datasets.registry import writer_of
from ars_web.datasets.report import ExportReport, ShardReport, report_of, used_splits
from ars_web.datasets.worker import shard_folder
from ars_web.datasets.writers.writer import Dataset

DOCUMENT = "dataset.json"

_BEGUN = "assembling"
"""A file of this name in the partial folder says that files have been moved out of the shards."""


def finished_shards(plan: ExportPlan, partial: Path) -> list[int]:
    """Numbers of the shards that are whole."""
    return [number for number in range(len(plan.shards)) if shard_folder(partial, number).is_dir()]


def assemble(plan: ExportPlan, partial: Path) -> ExportReport:
    """Make the dataset in the partial folder out of its shards, all of them being whole.

    Files that belong to one frame are moved; files that span shards are joined from fragments, which stay. So what
    a killed assembly has done is found done, and the rest follows.
    """
    dataset, writer = _dataset_folder(partial), writer_of(plan.format)
    dataset.mkdir(exist_ok=True)
    (partial / _BEGUN).touch()
    shards = [shard_folder(partial, number) for number in range(len(plan.shards))]
    for shard in shards:
        _move_files(str(shard / "files"), str(dataset))
    joined = writer.join(description_of(plan), [shard / "fragments" for shard in shards], dataset)
    counted = (ShardReport.model_validate_json((shard / "shard.json").read_bytes()) for shard in shards)
    report = report_of(plan, counted, joined)
    (dataset / DOCUMENT).write_bytes(report.as_file())
    return report


def description_of(plan: ExportPlan) -> Dataset:
    """What a writer needs to join the plan's shards."""
    return Dataset(
        splits=used_splits(plan),
        classes=plan.classes,
        sessions=plan.sessions,
        options=plan.options,
        description="Labels of virtual boxes, by ARS Web",
    )


def publish(plan: ExportPlan, partial: Path) -> None:
    """Give the dataset its name, by one rename of a folder whose bytes are on the disk."""
    os.sync()
    _dataset_folder(partial).rename(plan.out)
    remove_folder(partial)


def is_published(partial: Path) -> bool:
    """Whether what was assembled here has left already: the shards have no files any more and are of no use."""
    return (partial / _BEGUN).exists() and not _dataset_folder(partial).exists()


def remove_folder(folder: Path) -> None:
    """Remove a folder and all that is in it."""
    shutil.rmtree(folder)


def _dataset_folder(partial: Path) -> Path:
    return partial / "dataset"


def _move_files(source: str, target: str) -> None:
    """Move every file below `source` to its place below `target`."""
    with os.scandir(source) as entries:
        for entry in entries:
            place = f"{target}/{entry.name}"
            if entry.is_dir():
                os.makedirs(place, exist_ok=True)  # noqa: PTH103 - as strings, this runs once an image
                _move_files(entry.path, place)
            else:
                os.rename(entry.path, place)  # noqa: PTH104
