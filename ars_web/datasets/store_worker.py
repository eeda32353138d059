"""One shard of an export whose dataset lies on an object store: what a worker process runs.

Below `<dataset>.partial/` lie the plan and, for each shard, `shards/NNNNN/`:

    begun-*       an empty file for each try
    files         the names, in the dataset, of the files that the shard uploads, written before the first of them
    fragments/    what is joined later
    shard.json    its report; written last, it says that the shard is whole
"""

import secrets
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory

from ars_web.datasets.plan_files import FILES as PLAN_FILES
from ars_web.datasets.plan_files import read_plan
from ars_web.datasets.planned import ExportPlan
from ars_web.datasets.worker import fill_shard, watch
from ars_web.recordings.stores import StoreFolder, store_folder

REPORT = "shard.json"
FILES = "files"
FRAGMENTS = "fragments"
BEGUN = "begun-"

_LOOK_EVERY = 1.0
"""Seconds between looks whether to stop; each is a request."""


def partial_of(target: StoreFolder) -> StoreFolder:
    """Where the work of an export to `target` lies until it is done."""
    return StoreFolder(f"{target.address}.partial")


def shard_name(number: int) -> str:
    """A shard's folder in the partial one."""
    return f"shards/{number:05d}"


def cancel_name(run: str) -> str:
    """A file of this name in the partial folder asks the workers of one run of an export to stop."""
    return f"cancel-{run}"


def export_stored_shard(target: str, number: int, digest: str, run: str) -> int:
    """Make shard `number` of the plan that lies beside `target`, and upload it; its count of frames.

    The files of its frames go to their places in the dataset: whoever makes them, their bytes are the same.

    Raises:
        BadFile: a source image cannot be exported.
        Cancelled: the workers of this run were asked to stop.
        OSError: the store, or the disk for temporary files, cannot be used.
    """
    dataset = store_folder(target)
    partial = partial_of(dataset)
    plan, name = _plan(target, digest), shard_name(number)
    check = watch(lambda: partial.has(cancel_name(run)), every=_LOOK_EVERY)
    check()
    partial.write(f"{name}/{BEGUN}{secrets.token_hex(6)}", b"")
    with TemporaryDirectory(prefix="ars-web-shard-") as folder:
        tmp = Path(folder)
        frames = fill_shard(plan, number, tmp, check)
        files = files_below(tmp / "files")
        partial.write(f"{name}/{FILES}", "".join(f"{file}\n" for _, file in files).encode())
        check()
        dataset.upload(files)
        partial.upload([(path, f"{name}/{FRAGMENTS}/{file}") for path, file in files_below(tmp / "fragments")])
        check()
        partial.write(f"{name}/{REPORT}", (tmp / "shard.json").read_bytes())
    return frames


def files_below(folder: Path) -> list[tuple[Path, str]]:
    """Every file below a folder with its name from there, in order."""
    found = ((path, path.relative_to(folder).as_posix()) for path in folder.rglob("*") if path.is_file())
    return sorted(found, key=lambda file: file[1])


@lru_cache(maxsize=1)
def _plan(target: str, digest: str) -> ExportPlan:
    """The plan, read once a process; the digest is in the key because another plan may take its place."""
    with TemporaryDirectory(prefix="ars-web-plan-") as folder:
        partial_of(store_folder(target)).download(PLAN_FILES, Path(folder))
        # What is mapped of it stays for as long as it is used.
        return read_plan(Path(folder), out=Path(folder))
