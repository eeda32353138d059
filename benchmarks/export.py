"""Exports of 36,000 frames x 20 boxes beside the naive loop, datumaro and supervision, in one run.

    python benchmarks/export.py [--frames 36000] [--folder DIR]

The images are tiny JPEG files, made first, on the disk that DIR is on: what is measured is labels, files and links,
not pixels. Every program starts from the same poses and boxes, and computing the labels is part of ours only: the
naive loop and the peers are handed finished boxes. Slow ones get a part of the frames; their time is scaled up, and
the table says so. Each is run once, after a small warm-up; `ours` includes the start of its processes. Nothing is
deleted before the end, and nothing large should have been just before the start: ext4 does not use an inode again
within minutes of its deletion, and creating a file can take thirty times longer while it looks for others.
"""

import argparse
import json
import os
import tempfile
import time
import warnings
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import cv2
import numpy as np
import scene

from ars_web.datasets.jobs import plan_export, run_export
from ars_web.datasets.label_functions import Marks
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.samples import LabelTable, Outlines, labels_in_frames, outlines_in_frames
from ars_web.datasets.writers import coco
from ars_web.geometry.camera import Camera
from ars_web.geometry.rings import one_ring_each
from ars_web.sessions.model import FrameTable, ObjectClass, SessionSnapshot, SessionState, VirtualBox

SMALL = 400
"""Frames of the warm-up."""


def timed(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def line(name: str, seconds: float, note: str = "") -> None:
    print(f"{name:<58} {seconds:9.2f} s   {note}", flush=True)


def make_images(folder: Path, n: int, camera: Camera) -> list[Path]:
    """n JPEG files of the camera's size, one grey: some 3 kB each, so that 36,000 of them are made in seconds."""
    folder.mkdir(parents=True)
    ok, content = cv2.imencode(".jpg", np.full((camera.height, camera.width, 3), 90, np.uint8))
    assert ok
    paths = [folder / f"{i:06d}.jpg" for i in range(n)]
    for path in paths:
        path.write_bytes(content.data)
    return paths


def snapshot_of(paths: list[Path], camera: Camera, Ts: np.ndarray, *, boxes: int) -> SessionSnapshot:
    names = tuple(path.name for path in paths)
    classes = {i: ObjectClass(i, f"class {i}", "#e6194b", 1) for i in range(5)}
    virtual = {i: VirtualBox(i, i % 5, f"box {i}", box, 1) for i, box in enumerate(scene.boxes(boxes), start=1)}
    state = SessionState(1, "benchmark", classes, virtual, 5, boxes + 1)
    frames = FrameTable(names, tuple(paths), np.zeros(len(paths), dtype=np.int64), Ts)
    return SessionSnapshot("bench", state, {0: camera}, frames)


def export(snapshot: SessionSnapshot, folder: Path, kind: str, images: str) -> float:
    options = ExportOptions.model_validate({"images": images})

    def work() -> None:
        run_export(plan_export([snapshot], format=kind, options=options, out=folder))

    return timed(work)


def naive_yolo(folder: Path, paths: list[Path], bbox: np.ndarray, camera: Camera) -> None:
    """One file after the other, one number after the other; images linked."""
    for name in ("images", "labels"):
        (folder / name).mkdir(parents=True)
    for i, path in enumerate(paths):
        os.link(path, folder / "images" / path.name)
        with (folder / "labels" / f"{path.stem}.txt").open("w") as file:
            for j, (x0, y0, x1, y1) in enumerate(bbox[i]):
                if not np.isnan(x0):
                    cx, cy = (x0 + x1) / 2 / camera.width, (y0 + y1) / 2 / camera.height
                    w, h = (x1 - x0) / camera.width, (y1 - y0) / camera.height
                    file.write(f"{j % 5} {cx:.6f} {cy:.6f} {w:.6f} {h:.6f}\n")


def naive_coco(folder: Path, paths: list[Path], table: LabelTable, camera: Camera) -> None:
    """Dictionaries and json.dump, without outlines."""
    folder.mkdir(parents=True)
    images, found = [], []
    for i, path in enumerate(paths):
        images.append({"id": i + 1, "file_name": path.name, "width": camera.width, "height": camera.height})
        for j, (x0, y0, x1, y1) in enumerate(table.bbox[i]):
            if not np.isnan(x0):
                bbox = [round(float(v), 2) for v in (x0, y0, x1 - x0, y1 - y0)]
                found.append(
                    {"id": len(found) + 1, "image_id": i + 1, "category_id": j % 5 + 1, "bbox": bbox,
                     "area": bbox[2] * bbox[3], "iscrowd": 0}
                )  # fmt: skip
    categories = [{"id": i + 1, "name": f"class {i}"} for i in range(5)]
    with (folder / "instances.json").open("w") as file:
        json.dump({"images": images, "annotations": found, "categories": categories}, file)


def with_datumaro(folder: Path, paths: list[Path], bbox: np.ndarray, camera: Camera, kind: str) -> None:
    """Build a dataset and export it, images not written: its own way of copying them would be the larger part."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import datumaro as dm

    size = (camera.height, camera.width)
    items = []
    for i, path in enumerate(paths):
        labels = [
            dm.Bbox(x0, y0, x1 - x0, y1 - y0, label=j % 5)
            for j, (x0, y0, x1, y1) in enumerate(bbox[i].tolist())
            if x0 == x0
        ]
        image = dm.Image.from_file(path=str(path), size=size)
        items.append(dm.DatasetItem(id=path.stem, subset="train", media=image, annotations=labels))
    dataset = dm.Dataset.from_iterable(items, categories=[f"class {i}" for i in range(5)], media_type=dm.Image)
    dataset.export(str(folder), kind, save_media=False)


def with_supervision(folder: Path, paths: list[Path], bbox: np.ndarray, kind: str) -> None:
    """Build a dataset and write its annotations; it reads every image to know its size."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import supervision as sv

    found = {}
    for i, path in enumerate(paths):
        seen = np.flatnonzero(~np.isnan(bbox[i, :, 0]))
        found[str(path)] = sv.Detections(xyxy=bbox[i, seen].astype(np.float32), class_id=seen % 5)
    dataset = sv.DetectionDataset(
        classes=[f"class {i}" for i in range(5)], images=[str(path) for path in paths], annotations=found
    )
    folder.mkdir(parents=True)
    if kind == "yolo":
        dataset.as_yolo(annotations_directory_path=str(folder / "labels"), data_yaml_path=str(folder / "data.yaml"))
    else:
        dataset.as_coco(annotations_path=str(folder / "instances.json"))


def write_coco(folder: Path, table: LabelTable, keep: np.ndarray, outlines: Outlines, classes: np.ndarray) -> None:
    # Without keypoints, which the peers are not handed either.
    nothing = one_ring_each(np.zeros((0, 2)), np.zeros(keep.size + 1, dtype=np.int64))
    marks = Marks(nothing, np.zeros((*keep.shape, 0, 2)), np.zeros((*keep.shape, 0), dtype=np.int64))
    none = np.zeros(keep.shape[1], dtype=np.int64)
    content = coco.annotations(table, keep, outlines, classes, marks, none, first=0, most_boxes=keep.shape[1])
    with (folder / "annotations.json").open("wb") as file:
        file.write(content.data)
        file.flush()
        os.fsync(file.fileno())


def benchmark_coco_writing(folder: Path, camera: Camera, Ts: np.ndarray, table: LabelTable) -> None:
    """Format and write annotations of given labels, with and without outlines."""
    n, b = table.truncated.shape
    keep = ~np.isnan(table.bbox[..., 0])
    # As many frames as hold half a million annotations.
    n = min(n, int(np.searchsorted(np.cumsum(keep.sum(axis=1)), 500_000)) + 1)
    table = LabelTable(table.bbox[:n], table.bbox_amodal[:n], table.truncated[:n], table.visible[:n])
    keep, classes = keep[:n], np.arange(b) % 5
    count = int(keep.sum())
    boxes = scene.boxes(b)
    found: list[Outlines] = []
    seconds = timed(
        lambda: found.append(outlines_in_frames({0: camera}, np.zeros(n, dtype=np.int64), Ts[:n], boxes, keep))
    )
    none = Outlines(np.zeros((0, 2)), np.zeros(n * b + 1, dtype=np.int64))
    for name, outlines in (("boxes", none), ("outlines", found[0])):
        seconds_writing = timed(lambda: write_coco(folder, table, keep, outlines, classes))  # noqa: B023
        size = (folder / "annotations.json").stat().st_size / 1e6
        note = f"{size:.0f} MB, {len(outlines.points):,} points, fsync included"
        line(f"COCO, {count:,} annotations of given labels, {name}", seconds_writing, note)
    line("  computing those outlines", seconds)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=36_000)
    parser.add_argument("--folder", type=Path, default=Path.cwd(), help="where to make a temporary folder, on a disk")
    arguments = parser.parse_args()
    n, camera = arguments.frames, scene.camera()
    Ts = scene.poses(n)
    with tempfile.TemporaryDirectory(prefix="export-benchmark-", dir=arguments.folder) as made:
        folder = Path(made)
        print(f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
        paths = make_images(folder / "images", n, camera)
        os.sync()
        snapshot = snapshot_of(paths, camera, Ts, boxes=20)
        few = snapshot_of(paths[:SMALL], camera, Ts[:SMALL], boxes=20)
        for kind in ("yolo", "coco"):
            export(few, folder / f"warm-{kind}", kind, "link")
        boxes = [b.box for b in snapshot.state.boxes.values()]
        cameras, ids = {0: camera}, np.zeros(n, dtype=np.int64)
        found: list[LabelTable] = []
        seconds = timed(lambda: found.append(labels_in_frames(cameras, ids, Ts, boxes)))
        table = found[0]
        labels = int((~np.isnan(table.bbox[..., 0])).sum())
        print(f"{n:,} frames of {camera.width}x{camera.height}, 20 boxes, {labels:,} labels\n")
        line("labels and visible fractions, in this process", seconds)
        for kind, images, computed in (
            ("yolo", "link", "labels"),
            ("yolo", "none", "labels"),
            ("coco", "link", "labels, outlines, visible"),
            ("voc", "link", "labels, visible"),
            ("ars", "link", "labels"),
        ):
            seconds = export(snapshot, folder / f"ours-{kind}-{images}", kind, images)
            line(f"ours: {kind.upper()}, whole export, images: {images}", seconds, f"{computed} computed")
        seconds = timed(lambda: naive_yolo(folder / "naive", paths, table.bbox, camera))
        line("naive loop: YOLO, images: link", seconds, "labels given")
        seconds = timed(lambda: naive_coco(folder / "naive-coco", paths, table, camera))
        line("naive dicts and json.dump: COCO, images: none", seconds, "labels given, no outlines")
        part = min(n, 3_000)
        scale, note = n / part, f"labels given, {part:,} frames, scaled x{n / part:.0f}"
        some, rows = paths[:: n // part][:part], table.bbox[:: n // part][:part]
        for kind in ("yolo", "coco"):
            start = time.perf_counter()
            with_datumaro(folder / f"datumaro-{kind}", some, rows, camera, kind)
            line(f"datumaro: {kind.upper()}, images: none", scale * (time.perf_counter() - start), note)
            start = time.perf_counter()
            with_supervision(folder / f"supervision-{kind}", some, rows, kind)
            line(f"supervision: {kind.upper()}, images: none", scale * (time.perf_counter() - start), note)
        print()
        benchmark_coco_writing(folder, camera, Ts, table)


if __name__ == "__main__":
    main()
