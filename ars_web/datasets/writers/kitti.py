"""KITTI object detection: `training/` with `image_2/`, `label_2/` and `calib/`, and `ImageSets/`.

A row is `type truncated occluded alpha left top right bottom height width length x y z rotation_y`, as the devkit's
readme says: pixels are indices from 0; x y z is the bottom's centre before the camera (x right, y down, z forward),
in metres; objects stand upright and are turned about y alone.
"""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from numba import njit

from ars_web.datasets.planned import ExportPlan
from ars_web.datasets.writers.digits import Buffer, put_bytes, put_decimal, put_integer
from ars_web.datasets.writers.joining import join_files
from ars_web.datasets.writers.posed import Ts_camera_box, lens_losses
from ars_web.datasets.writers.small_files import write_files
from ars_web.datasets.writers.upright import TiltCounts, count_tilts, upright
from ars_web.datasets.writers.writer import Dataset, FileDigests, Shard, Writer
from ars_web.geometry.camera import Camera

PARTLY, LARGELY = 0.95, 0.5
"""Visible shares below which an object is partly (1) and largely (2) occluded; the devkit names no numbers."""

TILTED = 1.0
"""Degrees off upright from which a label is told to be tilted."""

_RESERVED = "DontCare"
"""KITTI's name for regions that are no object."""

_DECIMALS = np.array([2, 0, 6, 2, 2, 2, 2, 6, 6, 6, 6, 6, 6, 6])
"""Of each number of a row. KITTI's own have two, which for objects on a table would be several pixels."""

_NUMBERS_BYTES = 14 * 20
"""More than a row without its name."""


def kitti_names(names: Sequence[str]) -> list[str]:
    """The classes' names without spaces, none of them twice and none reserved."""
    found: list[str] = []
    taken = {_RESERVED.lower()}
    for name in names:
        plain = re.sub(r"\s", "_", "".join(c if c.isprintable() or c.isspace() else "_" for c in name))
        candidate, number = plain, 2
        while candidate.lower() in taken:
            candidate, number = f"{plain}_{number}", number + 1
        taken.add(candidate.lower())
        found.append(candidate)
    return found


def numbers(shard: Shard) -> Int[np.ndarray, "n b 14"]:
    """(n, b, 14) a row's numbers, scaled to integers by their decimals; of labels that are not kept they mean
    nothing."""
    table, sizes = shard.table, np.array([box.size for box in shard.shapes.boxes]).reshape(-1, 3)
    boxes = upright(Ts_camera_box(shard.shapes), sizes)
    # Indices: a pixel's centre is at integers, the last one's at the size less one.
    last = (shard.sizes - 1)[:, None, :].repeat(2, axis=1).reshape(-1, 1, 4)
    pixels = np.clip(np.nan_to_num(table.bbox) - 0.5, 0.0, last)
    visible = np.nan_to_num(table.visible, nan=1.0)
    occluded = np.where(visible < LARGELY, 2, np.where(visible < PARTLY, 1, 0))
    x, z = boxes.bottom[..., 0], boxes.bottom[..., 2]
    alpha = _wrapped(boxes.yaw - np.arctan2(x, z))
    parts = [table.truncated[..., None], occluded[..., None], alpha[..., None], pixels]
    rows = np.concatenate([*parts, boxes.height_width_length, boxes.bottom, boxes.yaw[..., None]], axis=-1)
    return np.floor(rows * 10.0**_DECIMALS + 0.5).astype(np.int64)


def _wrapped(angle: Float[np.ndarray, "n b"]) -> Float[np.ndarray, "n b"]:
    """Within -pi to pi."""
    return np.arctan2(np.sin(angle), np.cos(angle))


def rows(
    values: Int[np.ndarray, "n b 14"], keep: Bool[np.ndarray, "n b"], names: Sequence[bytes]
) -> tuple[UInt8[np.ndarray, "size"], Int[np.ndarray, "k"]]:
    """The text of all frames' label files in one buffer, and (n + 1,) where each begins; `names` are the boxes'."""
    longest = max((len(name) for name in names), default=0)
    buffer = np.empty(int(keep.sum()) * (longest + _NUMBERS_BYTES), dtype=np.uint8)
    starts = np.zeros(len(keep) + 1, dtype=np.int64)
    text = np.frombuffer(b"".join(names), dtype=np.uint8)
    edges = np.cumsum([0, *map(len, names)], dtype=np.int64)
    return buffer[: _rows(values, keep, text, edges, _DECIMALS, buffer, starts)], starts


@njit(cache=True)
def _rows(
    values: Int[np.ndarray, "n b 14"],
    keep: Bool[np.ndarray, "n b"],
    text: Buffer,
    edges: Int[np.ndarray, "b+1"],
    decimals: Int[np.ndarray, "14"],
    buffer: Buffer,
    starts: Int[np.ndarray, "k"],
) -> int:
    place = 0
    for frame in range(keep.shape[0]):
        starts[frame] = place
        for box in range(keep.shape[1]):
            if not keep[frame, box]:
                continue
            place = put_bytes(buffer, place, text[edges[box] : edges[box + 1]])
            for column in range(len(decimals)):
                buffer[place] = 32
                value = values[frame, box, column]
                if decimals[column] == 0:
                    place = put_integer(buffer, place + 1, value)
                else:
                    place = put_decimal(buffer, place + 1, value, decimals[column])
            buffer[place] = 10
            place += 1
    starts[keep.shape[0]] = place
    return place


def _calibration(camera: Camera) -> bytes:
    """A frame's `calib` file: one camera four times, and no other sensor."""
    projection = np.concatenate([camera.K, np.zeros((3, 1))], axis=1)
    rigid = np.eye(3, 4)
    entries = [*((f"P{i}", projection) for i in range(4)), ("R0_rect", np.eye(3))]
    entries += [("Tr_velo_to_cam", rigid), ("Tr_imu_to_velo", rigid)]
    return "".join(f"{name}: {' '.join(f'{v:.12e}' for v in matrix.ravel())}\n" for name, matrix in entries).encode()


def _write(shard: Shard, files: Path, fragments: Path) -> FileDigests:
    plain = [name.encode() for name in kitti_names(shard.class_names)]
    buffer, starts = rows(numbers(shard), shard.keep, [plain[place] for place in shard.class_of_box.tolist()])
    names = [f"{stem}.txt" for stem in shard.stems]
    digests = write_files(files, ["training/label_2"] * len(names), names, buffer.data, starts)
    texts = {camera_id: _calibration(camera) for camera_id, camera in shard.shapes.cameras.items()}
    calibrations = [texts[camera_id] for camera_id in shard.shapes.camera_ids.tolist()]
    content = memoryview(b"".join(calibrations))
    write_files(files, ["training/calib"] * len(names), names, content, np.cumsum([0, *map(len, calibrations)]))
    for split in sorted(set(shard.splits)):
        lines = (f"{stem}\n" for stem, s in zip(shard.stems, shard.splits, strict=True) if s == split)
        (fragments / f"{split}.txt").write_text("".join(lines), encoding="ascii")
    lines = [f"{stem} {name}\n" for stem, name in zip(shard.stems, shard.identities, strict=True)]
    (fragments / "frames.txt").write_text("".join(lines), encoding="utf-8")
    return digests


def _join(dataset: Dataset, fragments: Sequence[Path], folder: Path) -> FileDigests:
    for name in ("image_2", "label_2", "calib"):
        (folder / "training" / name).mkdir(parents=True, exist_ok=True)
    lists = {split: [split] for split in dataset.splits} | {"trainval": ["train", "val"]}
    for name, members in lists.items():
        sources = [f / f"{split}.txt" for split in members for f in fragments]
        join_files(sources, folder / "ImageSets" / f"{name}.txt")
    join_files([f / "frames.txt" for f in fragments], folder / "frames.txt")
    return {}


def _losses(plan: ExportPlan) -> list[str]:
    found: list[str] = []
    tilts = count_tilts(plan, beyond=TILTED)
    if tilts.tilted:
        found.append(_tilt_loss(tilts))
    found += lens_losses(plan, exact="boxes in the image, and places before the camera, are right")
    changed = [
        f"{name!r} is {plain!r}"
        for name, plain in zip(plan.class_names, kitti_names(plan.class_names), strict=True)
        if name != plain
    ]
    if changed:
        found.append(f"names with spaces, reserved ones, and two that differ in case alone: {', '.join(changed)}")
    return found


def _tilt_loss(tilts: TiltCounts) -> str:
    return (
        f"tilted boxes, KITTI's being upright: of {tilts.count} boxes whose centres are in an image {tilts.tilted} are"
        f" tilted by more than {TILTED:g} degree against the camera's y axis, the median by {tilts.median:.1f} and the"
        f" worst by {tilts.most:.1f}; written is the nearest upright box with the same centre. Boxes in the image are"
        " exact"
    )


WRITER = Writer(
    format="kitti",
    title="KITTI object detection",
    description=(
        "One row an object: its box in the image, its size, its place before the camera and its turn about the"
        " camera's y axis. Images are PNG."
    ),
    label_folder="training/label_2",
    image_folder=lambda split: "training/image_2",
    write=_write,
    join=_join,
    losses=_losses,
    with_visible=True,
    numbered=True,
    digits=6,
    only_png=True,
)
