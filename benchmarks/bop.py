"""BOP and VOC of 36,000 frames x 20 boxes beside the BOP toolkit and datumaro, in one run and one table.

    python benchmarks/bop.py --toolkit DIR [--frames 36000] [--folder DIR]

DIR is a checkout of https://github.com/thodan/bop_toolkit (MIT), from which only `bop_toolkit_lib/inout.py` and what it
imports is used. No images and no masks are written by anyone. Computing the labels is part of ours only: the peers are
handed finished poses, boxes and counts, and each is timed twice, with and without putting those into the dictionaries
or items that it takes. Each is run once, ours after a small warm-up; ours includes the start of its processes. CPU time
is of all processes.
"""

import argparse
import os
import resource
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from types import ModuleType

import numpy as np
import scene
from export import snapshot_of

from ars_web.datasets.jobs import plan_export, run_export
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.samples import LabelTable, labels_in_frames
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import stack
from ars_web.geometry.camera import Camera
from ars_web.sessions.model import SessionSnapshot

SMALL = 400
"""Frames of the warm-up."""


def cpu_seconds() -> float:
    own, children = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return own.ru_utime + own.ru_stime + children.ru_utime + children.ru_stime


def timed(work: Callable[[], object]) -> tuple[float, float]:
    """Wall and CPU seconds."""
    start, cpu = time.perf_counter(), cpu_seconds()
    work()
    return time.perf_counter() - start, cpu_seconds() - cpu


def line(name: str, seconds: tuple[float, float], note: str = "") -> None:
    print(f"{name:<58} {seconds[0]:8.2f} s wall {seconds[1]:8.2f} s CPU   {note}", flush=True)


def export(snapshot: SessionSnapshot, folder: Path, kind: str) -> None:
    options = ExportOptions.model_validate({"images": "none"} | ({"masks": "none"} if kind == "bop" else {}))
    run_export(plan_export([snapshot], format=kind, options=options, out=folder))


def size(folder: Path) -> str:
    found = [path.stat().st_size for path in folder.rglob("*") if path.is_file()]
    return f"{sum(found) / 1e6:.0f} MB in {len(found):,} files"


def toolkit(checkout: Path) -> ModuleType:
    """The toolkit's `inout`. It asks for pypng, which it writes depth images with and nothing here."""
    sys.path.insert(0, str(checkout))
    sys.modules.setdefault("png", ModuleType("png"))
    from bop_toolkit_lib import inout  # pyright: ignore[reportMissingImports]: in the checkout

    return inout


def by_toolkit(inout: ModuleType, folder: Path, camera: Camera, Ts: np.ndarray, table: LabelTable) -> None:
    """`scene_camera.json`, `scene_gt.json` and `scene_gt_info.json`, the last by its own JSON writer."""
    folder.mkdir(parents=True)
    cameras: dict[int, dict[str, object]] = {}
    gts: dict[int, list[dict[str, object]]] = {}
    infos: dict[int, list[dict[str, object]]] = {}

    def build() -> None:
        Ts_camera_world = rigid_transform.invert(Ts)
        Ts_world_box, _ = stack(scene.boxes(table.bbox.shape[1]))
        for i, T in enumerate(Ts_camera_world):
            cameras[i] = {"cam_K": camera.K, "cam_R_w2c": T[:3, :3], "cam_t_w2c": T[:3, 3:] * 1000, "depth_scale": 1.0}
            Ts_camera_box = T @ Ts_world_box
            gts[i], infos[i] = [], []
            for j in np.flatnonzero(~np.isnan(table.bbox[i, :, 0])).tolist():
                gts[i].append(
                    {
                        "cam_R_m2c": Ts_camera_box[j, :3, :3],
                        "cam_t_m2c": Ts_camera_box[j, :3, 3:] * 1000,
                        "obj_id": j + 1,
                    }
                )
                x0, y0, x1, y1 = (int(v) for v in table.bbox[i, j])
                box, count = [x0, y0, x1 - x0, y1 - y0], (x1 - x0) * (y1 - y0)
                infos[i].append(
                    {
                        "bbox_obj": box, "bbox_visib": box, "px_count_all": count, "px_count_valid": count,
                        "px_count_visib": count, "visib_fract": float(table.visible[i, j]),
                    }
                )  # fmt: skip

    def save() -> None:
        inout.save_scene_camera(folder / "scene_camera.json", cameras)
        inout.save_scene_gt(folder / "scene_gt.json", gts)
        inout.save_json(folder / "scene_gt_info.json", infos)

    built, saved = timed(build), timed(save)
    line("BOP toolkit: its inout alone, from dictionaries", saved, f"labels given; {size(folder)}")
    line("BOP toolkit: with building the dictionaries", (built[0] + saved[0], built[1] + saved[1]), "labels given")


def by_datumaro(folder: Path, camera: Camera, bbox: np.ndarray) -> None:
    """Build a dataset and export it as VOC; its images are named and not there."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import datumaro as dm

    found: list[object] = []

    def build() -> None:
        for i in range(len(bbox)):
            labels = [
                dm.Bbox(x0, y0, x1 - x0, y1 - y0, label=j % 5)
                for j, (x0, y0, x1, y1) in enumerate(bbox[i].tolist())
                if x0 == x0
            ]
            image = dm.Image.from_file(path=f"{i:06d}.jpg", size=(camera.height, camera.width))
            found.append(dm.DatasetItem(id=f"{i:06d}", subset="train", media=image, annotations=labels))

    def save() -> None:
        dataset = dm.Dataset.from_iterable(found, categories=[f"class {i}" for i in range(5)], media_type=dm.Image)
        dataset.export(str(folder), "voc", save_media=False)

    built, saved = timed(build), timed(save)
    line("datumaro: VOC, its export alone, from items", saved, f"labels given; {size(folder)}")
    line("datumaro: VOC, with building the items", (built[0] + saved[0], built[1] + saved[1]), "labels given")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--toolkit", type=Path, required=True, help="a checkout of the BOP toolkit")
    parser.add_argument("--frames", type=int, default=36_000)
    parser.add_argument("--folder", type=Path, default=Path.cwd(), help="where to make a temporary folder, on a disk")
    arguments = parser.parse_args()
    n, camera = arguments.frames, scene.camera()
    Ts, inout = scene.poses(n), toolkit(arguments.toolkit)
    paths = [Path(f"/nowhere/images/{i:06d}.jpg") for i in range(n)]
    snapshot = snapshot_of(paths, camera, Ts, boxes=20)
    few = snapshot_of(paths[:SMALL], camera, Ts[:SMALL], boxes=20)
    with tempfile.TemporaryDirectory(prefix="bop-benchmark-", dir=arguments.folder) as made:
        folder = Path(made)
        print(f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
        for kind in ("bop", "voc"):
            export(few, folder / f"warm-{kind}", kind)
        boxes = [b.box for b in snapshot.state.boxes.values()]
        table = labels_in_frames({0: camera}, np.zeros(n, dtype=np.int64), Ts, boxes)
        labels = int((~np.isnan(table.bbox[..., 0])).sum())
        print(f"{n:,} frames of {camera.width}x{camera.height}, 20 boxes, {labels:,} labels\n")
        for kind in ("bop", "voc"):
            seconds = timed(lambda: export(snapshot, folder / f"ours-{kind}", kind))  # noqa: B023
            line(f"ours: {kind.upper()}, whole export", seconds, f"labels computed; {size(folder / f'ours-{kind}')}")
            if kind == "bop":
                by_toolkit(inout, folder / "toolkit", camera, Ts, table)
            else:
                by_datumaro(folder / "datumaro", camera, table.bbox)


if __name__ == "__main__":
    main()
