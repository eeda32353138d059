"""One shard of an export, done from the partial folder alone: what a worker process runs."""

import os
import shutil
import signal
import threading
import time
from collections.abc import Callable
from functools import lru_cache
from multiprocessing import connection, parent_process
from pathlib import Path
from tempfile import mkdtemp

import numpy as np
from jaxtyping import Int

from ars_web.datasets.counting import select_labels, split_counts
from ars_web.datasets.file_names import safe
from ars_web.datasets.images import image_name, place_image
from ars_web.datasets.label_functions import label_function
from ars_web.datasets.plan_files import read_plan
from ars_web.datasets.planned import ExportPlan
from ars_web.datasets.registry import writer_of
from ars_web.datasets.report import ShardReport
from ars_web.datasets.samples import outlines_of_shapes
from ars_web.datasets.splits import SPLITS
from ars_web.datasets.writers.writer import Shard, Writer
from ars_web.errors import Cancelled

CANCEL = "cancel"
"""A file of this name in the partial folder asks the workers to stop."""

_LOOK_EVERY = 0.25
"""Seconds between looks for it."""


def start_worker() -> None:
    """Make this process a good worker: one thread, deaf to Ctrl-C, gone when its parent is.

    Without the last, a worker whose parent was killed would wait for work for ever.
    """
    import cv2
    import numba

    cv2.setNumThreads(1)
    numba.set_num_threads(1)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()
    if parent is not None:
        threading.Thread(target=_exit_after, args=(parent.sentinel,), daemon=True).start()


def _exit_after(sentinel: int) -> None:
    connection.wait([sentinel])
    os._exit(1)


def shard_folder(partial: Path, number: int) -> Path:
    """Where a whole shard lies."""
    return partial / "shards" / f"{number:05d}"


def new_folder(partial: Path, number: int) -> Path:
    """A folder of its own for one try at a shard: whoever renames it has written all of it.

    With one name for all tries, a worker that was thought dead could give a later worker's half the shard's name.
    """
    return Path(mkdtemp(dir=partial / "shards", prefix=f"{number:05d}.", suffix=".tmp"))


def begun_folders(partial: Path, number: int) -> list[Path]:
    """The folders of tries at a shard that have not ended well."""
    return list((partial / "shards").glob(f"{number:05d}.*.tmp"))


def export_shard(partial: str, number: int, digest: str) -> int:
    """Write shard `number` of the plan in the folder `partial`, which has this digest; its count of frames.

    All of it is written beside its place and renamed there when whole: a shard is there, or it is not.

    Raises:
        BadFile: a source image cannot be exported.
        Cancelled: someone asked the workers to stop.
        OSError: the shard cannot be written.
    """
    plan, folder = _plan(partial, digest), Path(partial)
    check = watch((folder / CANCEL).exists)
    check()
    tmp = new_folder(folder, number)
    frames = fill_shard(plan, number, tmp, check)
    check()
    whole = shard_folder(folder, number)
    # A try that was given up may have ended well after all. Its bytes are the same.
    if not whole.is_dir():
        tmp.rename(whole)
    return frames


def fill_shard(plan: ExportPlan, number: int, tmp: Path, check: Callable[[], None]) -> int:
    """Write shard `number` into the empty folder `tmp`: `files`, `fragments` and `shard.json`; its count of frames.

    `check` is called often and may raise to end it.
    """
    for name in ("files", "fragments"):
        (tmp / name).mkdir()
    writer = writer_of(plan.format)
    # Images that the writer puts into its own files are no part of the dataset by themselves.
    images = tmp / ("files" if writer.image_folder is not None else "images")
    shard, dropped = _shard(plan, number, images)
    check()
    if plan.options.images != "none":
        _place_images(plan, number, shard, check)
    digests = writer.write(shard, tmp / "files", tmp / "fragments")
    if writer.image_folder is None:
        shutil.rmtree(images, ignore_errors=True)
    counts = split_counts(shard.splits, shard.keep, shard.class_of_box.tolist(), shard.class_names)
    report = ShardReport(splits=counts, dropped=dropped, digests=digests)
    (tmp / "shard.json").write_text(report.model_dump_json(), encoding="utf-8")
    return len(shard.stems)


@lru_cache(maxsize=1)
def _plan(partial: str, digest: str) -> ExportPlan:
    """The plan, read once a process; the digest is in the key because a folder's plan may be replaced."""
    return read_plan(Path(partial), out=Path(partial))


def watch(asked: Callable[[], bool], *, every: float = _LOOK_EVERY) -> Callable[[], None]:
    """A check that is cheap to call often and raises Cancelled once someone `asked` the workers to stop."""
    next_look = 0.0

    def check() -> None:
        nonlocal next_look
        now = time.monotonic()
        if now >= next_look:
            next_look = now + every
            if asked():
                raise Cancelled("the export was cancelled")

    return check


def _shard(plan: ExportPlan, number: int, images: Path) -> tuple[Shard, dict[str, int]]:
    """The shard's frames with their labels, and how many labels were dropped by reason; `images` is the folder below
    which its images lie while it is written."""
    start, stop = plan.shards[number]
    frames, writer = plan.frames, writer_of(plan.format)
    session_number = int(frames.session[start])
    session = plan.sessions[session_number]
    selection = select_labels(plan, slice(start, stop), with_visible=writer.with_visible)
    shapes, keep = selection.shapes, selection.keep
    sizes: Int[np.ndarray, "n 2"] = np.array(
        [(shapes.cameras[i].width, shapes.cameras[i].height) for i in shapes.camera_ids.tolist()], dtype=np.int64
    )
    splits = [SPLITS[i] for i in frames.split[start:stop].tolist()]
    sources, stems = frames.sources[start:stop], frames.stems[start:stop]
    names = [
        image_name(stem, source, only_jpeg=writer.only_jpeg, only_png=writer.only_png)
        for stem, source in zip(stems, sources, strict=True)
    ]
    has_images = plan.options.images != "none"
    folders = {split: images / _image_folder(writer, split, session_number) for split in set(splits)}
    files = [folders[split] / name for split, name in zip(splits, names, strict=True)]
    return (
        Shard(
            first=start,
            session_number=session_number,
            session=session,
            sessions=plan.sessions,
            options=plan.options,
            splits=splits,
            stems=stems,
            image_names=names,
            image_files=files if has_images else (),
            identities=[identity(name, source) for name, source in zip(frames.names[start:stop], sources, strict=True)],
            frame_names=frames.names[start:stop],
            frame_indices=frames.index[start:stop],
            sizes=sizes,
            classes=plan.classes,
            class_of_box=np.array(session.class_of_box, dtype=np.int64),
            most_boxes=max(len(s.boxes) for s in plan.sessions),
            shapes=shapes,
            table=selection.table,
            keep=keep,
            outlines=outlines_of_shapes(shapes, keep if writer.with_outlines else np.zeros_like(keep)),
            marks={name: label_function(name).draw(shapes, selection.table, keep) for name in writer.label_functions},
        ),
        selection.dropped,
    )


def _image_folder(writer: Writer, split: str, session: int) -> str:
    """Where images of a split lie below the folder of all files, or of those that are put into others."""
    return split if writer.image_folder is None else writer.image_folder(split).format(session=session)


def identity(name: str, source: str) -> str:
    """`sceneFolder!imageFile`: the folder that holds the recording's image folder, and the frame's name in it.

    Where the image folder is not called `images`, it is itself the scene's folder.
    """
    folder = Path(source).parents[name.count("/")]
    scene = folder.parent if folder.name == "images" else folder
    return f"{safe(scene.name)}!{name}"


def _place_images(plan: ExportPlan, number: int, shard: Shard, check: Callable[[], None]) -> None:
    start, _ = plan.shards[number]
    frames, cameras = plan.frames, shard.session.cameras
    for folder in sorted({file.parent for file in shard.image_files}):
        folder.mkdir(parents=True, exist_ok=True)
    stamps: list[tuple[int, int]] = list(map(tuple, frames.stamps[start : start + len(shard.stems)].tolist()))
    for i, (target, stamp) in enumerate(zip(shard.image_files, stamps, strict=True)):
        check()
        place_image(
            frames.sources[start + i],
            str(target),
            camera=cameras[int(frames.camera_id[start + i])],
            stamp=stamp,
            images=plan.options.images,
        )
