"""DOPE's training data in NDDS JSON: `{train,val}/NAME.json` beside each image, `_camera_settings.json` and
`_object_settings.json` in each of the folders.

Centimetres; quaternions x y z w; OpenCV's camera axes; the object's axes are its box's and its origin the box's
centre. Image points are OpenCV's pixels, as the intrinsics beside them mean: a pixel's centre is at integers. A
`bounding_box` has y before x, as NDDS does.
"""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import orjson
from jaxtyping import Bool, Float, Int, UInt8
from numba import njit

from ars_web.datasets.planned import ExportPlan, PlannedSession
from ars_web.datasets.writers.bop_models import symmetry_entries
from ars_web.datasets.writers.bop_objects import ALIKE
from ars_web.datasets.writers.digits import Buffer, put_bytes, put_decimal
from ars_web.datasets.writers.joining import join_files
from ars_web.datasets.writers.posed import Ts_camera_box, lens_losses
from ars_web.datasets.writers.small_files import write_files
from ars_web.datasets.writers.writer import Dataset, FileDigests, Shard, Writer
from ars_web.geometry.camera import Camera, pixels_from_camera_points, pixels_from_image, rectified
from ars_web.geometry.rigid_transform import transform_points, wxyz_from_rotation
from ars_web.geometry.symmetry import canonical_rotation

CORNER_ORDER = np.array(
    [[1, -1, 1], [-1, -1, 1], [-1, 1, 1], [1, 1, 1], [1, -1, -1], [-1, -1, -1], [-1, 1, -1], [1, 1, -1]],
    dtype=np.float64,
)
"""Signs of the corners along the object's x, y and z, in the order of NDDS, of NVISII's generator, and of the cuboid
that DOPE's solver fits. DOPE's BlenderProc generator had another order from June 2024 (22a2468) to August 2025
(2dfe657), where y is the other way round; sets made by it then must not be mixed with others."""

UNSEEN_POINT = -100.0
"""Both coordinates of points that are behind the camera or beyond what the lens can show: DOPE's loader has its
own absent points there, off every image."""

_CM = 100.0

_FARTHEST = 1e7
"""Pixels. A corner that nears the camera's plane is no further away."""

_QUATERNION, _ROTATION, _LENGTH, _PIXEL, _SHARE = 9, 9, 6, 4, 4
"""Decimals."""


def _layout() -> tuple[list[str], list[int]]:
    """Of a label: the text before each of its numbers and at its end, and the numbers' decimals."""
    texts: list[str] = []
    decimals: list[int] = []

    def numbers(before: str, count: int, digits: int) -> None:
        texts.extend([before, *[","] * (count - 1)])
        decimals.extend([digits] * count)

    numbers(',"visibility":', 1, _SHARE)
    numbers(',"location":[', 3, _LENGTH)
    numbers('],"quaternion_xyzw":[', 4, _QUATERNION)
    for row in range(4):
        numbers('],"pose_transform":[[' if row == 0 else "],[", 3, _LENGTH if row == 3 else _ROTATION)
        numbers(",", 1, 0)
    numbers(']],"cuboid_centroid":[', 3, _LENGTH)
    numbers('],"projected_cuboid_centroid":[', 2, _PIXEL)
    numbers('],"bounding_box":{"top_left":[', 2, _PIXEL)
    numbers('],"bottom_right":[', 2, _PIXEL)
    for corner in range(8):
        numbers(']},"cuboid":[[' if corner == 0 else "],[", 3, _LENGTH)
    for corner in range(8):
        numbers(']],"projected_cuboid":[[' if corner == 0 else "],[", 2, _PIXEL)
    return [*texts, "]]}"], decimals


_TEXTS, _COLUMN_DECIMALS = _layout()
_DECIMALS = np.array(_COLUMN_DECIMALS, dtype=np.int64)
_PIECES = np.frombuffer("".join(_TEXTS).encode(), dtype=np.uint8)
_PIECE_EDGES = np.cumsum([0, *map(len, _TEXTS)], dtype=np.int64)

_NUMBER_BYTES = 21
"""The longest integer of 64 bits, a sign and a point."""


def numbers(shard: Shard) -> Int[np.ndarray, "n b c"]:
    """(n, b, c) each label's numbers in their order, scaled to integers by their decimals; of labels that are not kept
    they mean nothing.

    Of poses that the object's symmetry leaves alike, the one nearest to the camera's axes is written, so that equal
    images have equal corners.
    """
    Ts, sizes = Ts_camera_box(shard.shapes), np.array([box.size for box in shard.shapes.boxes]).reshape(-1, 3)
    for place, a_class in enumerate(shard.classes):
        columns = np.flatnonzero(shard.class_of_box == place)
        if a_class.symmetry.kind != "none" and len(columns):
            Ts[:, columns, :3, :3] = canonical_rotation(Ts[:, columns, :3, :3], a_class.symmetry)
    n, b = Ts.shape[:2]
    R, centre = Ts[..., :3, :3], Ts[..., :3, 3]
    corners = transform_points(Ts, CORNER_ORDER * sizes[:, None] / 2)
    pixels = _pixels(shard, np.concatenate([centre[..., None, :], corners], axis=2))
    wxyz = wxyz_from_rotation(R)
    # NDDS keeps it transposed, with the axes of the Unreal engine: z, x and -y of OpenCV's.
    pose = np.zeros((n, b, 4, 4))
    pose[..., 0, :3], pose[..., 1, :3], pose[..., 2, :3] = R[..., 2], R[..., 0], -R[..., 1]
    pose[..., 3, :3], pose[..., 3, 3] = centre * _CM, 1.0
    bbox = pixels_from_image(np.nan_to_num(shard.table.bbox))
    columns = [
        np.nan_to_num(shard.table.visible)[..., None],
        centre * _CM,
        wxyz[..., [1, 2, 3, 0]],
        pose.reshape(n, b, 16),
        centre * _CM,
        pixels[:, :, 0],
        bbox[..., [1, 0, 3, 2]],
        corners.reshape(n, b, 24) * _CM,
        pixels[:, :, 1:].reshape(n, b, 16),
    ]
    return np.floor(np.concatenate(columns, axis=-1) * 10.0**_DECIMALS + 0.5).astype(np.int64)


def _pixels(shard: Shard, points: Float[np.ndarray, "n b k 3"]) -> Float[np.ndarray, "n b k 2"]:
    found = np.full((*points.shape[:3], 2), np.nan)
    for camera, rows in shard.shapes.by_camera():
        found[rows] = pixels_from_camera_points(camera, points[rows])
    there = np.isfinite(found).all(axis=-1, keepdims=True)
    return np.where(there, np.clip(np.nan_to_num(found), -_FARTHEST, _FARTHEST), UNSEEN_POINT)


def documents(
    values: Int[np.ndarray, "n b c"], keep: Bool[np.ndarray, "n b"], heads: Sequence[bytes], names: Sequence[bytes]
) -> tuple[UInt8[np.ndarray, "size"], Int[np.ndarray, "k"]]:
    """The text of all frames' files in one buffer, and (n + 1,) where each begins; `heads` begin the frames' files,
    `names` the boxes' labels."""
    longest = max((len(name) for name in names), default=0)
    label = longest + len(_PIECES) + len(_DECIMALS) * _NUMBER_BYTES + 1
    size = sum(map(len, heads)) + len(heads) * len(_END) + int(keep.sum()) * label
    buffer, starts = np.empty(size, dtype=np.uint8), np.zeros(len(keep) + 1, dtype=np.int64)
    end = _documents(values, keep, *_packed(heads), *_packed(names), buffer, starts)
    return buffer[:end], starts


def _packed(texts: Sequence[bytes]) -> tuple[UInt8[np.ndarray, "size"], Int[np.ndarray, "k"]]:
    return np.frombuffer(b"".join(texts), dtype=np.uint8), np.cumsum([0, *map(len, texts)], dtype=np.int64)


_END = np.frombuffer(b"]}\n", dtype=np.uint8)


@njit(cache=True)
def _documents(
    values: Int[np.ndarray, "n b c"],
    keep: Bool[np.ndarray, "n b"],
    heads: Buffer,
    head_edges: Int[np.ndarray, "n+1"],
    names: Buffer,
    name_edges: Int[np.ndarray, "b+1"],
    buffer: Buffer,
    starts: Int[np.ndarray, "k"],
) -> int:
    place = 0
    for frame in range(keep.shape[0]):
        starts[frame] = place
        place = put_bytes(buffer, place, heads[head_edges[frame] : head_edges[frame + 1]])
        begun = False
        for box in range(keep.shape[1]):
            if not keep[frame, box]:
                continue
            if begun:
                buffer[place] = 44  # ","
                place += 1
            begun = True
            place = put_bytes(buffer, place, names[name_edges[box] : name_edges[box + 1]])
            for column in range(len(_DECIMALS)):
                place = put_bytes(buffer, place, _PIECES[_PIECE_EDGES[column] : _PIECE_EDGES[column + 1]])
                if _DECIMALS[column] == 0:
                    # The last column of a transform: zeros and a one.
                    buffer[place] = 48 + values[frame, box, column]
                    place += 1
                else:
                    place = put_decimal(buffer, place, values[frame, box, column], _DECIMALS[column])
            place = put_bytes(buffer, place, _PIECES[_PIECE_EDGES[len(_DECIMALS)] :])
        place = put_bytes(buffer, place, _END)
    starts[keep.shape[0]] = place
    return place


def _heads(shard: Shard) -> list[bytes]:
    """The beginning of each frame's file: its camera and where it is in the world."""
    cameras = {
        camera_id: orjson.dumps(
            {
                "width": camera.width,
                "height": camera.height,
                "intrinsics": {"fx": camera.fx, "fy": camera.fy, "cx": camera.cx, "cy": camera.cy},
            }
        ).decode()[:-1]
        for camera_id, camera in shard.shapes.cameras.items()
    }
    Ts = shard.shapes.Ts_world_camera
    # Adding zero turns a negative zero, which rounding leaves, into one without a sign.
    places = (np.round(Ts[:, :3, 3] * _CM, _LENGTH) + 0.0).tolist()
    quaternions = (np.round(wxyz_from_rotation(Ts[:, :3, :3])[:, [1, 2, 3, 0]], _QUATERNION) + 0.0).tolist()
    return [
        (
            f'{{"camera_data":{cameras[camera_id]},"location_worldframe":[{_listed(place, _LENGTH)}],'
            f'"quaternion_xyzw_worldframe":[{_listed(xyzw, _QUATERNION)}]}},"objects":['
        ).encode()
        for camera_id, place, xyzw in zip(shard.shapes.camera_ids.tolist(), places, quaternions, strict=True)
    ]


def _listed(values: Sequence[float], digits: int) -> str:
    return ",".join([f"{value:.{digits}f}" for value in values])


def _write(shard: Shard, files: Path, fragments: Path) -> FileDigests:
    session = shard.session
    # Without the closing brace: the rest of the label follows.
    names = [
        orjson.dumps({"class": shard.class_names[place], "name": name, "instance_id": box_id})[:-1]
        for place, name, box_id in zip(session.class_of_box, session.box_names, session.box_ids, strict=True)
    ]
    buffer, starts = documents(numbers(shard), shard.keep, _heads(shard), names)
    return write_files(files, shard.splits, [f"{stem}.json" for stem in shard.stems], buffer.data, starts)


def _join(dataset: Dataset, fragments: Sequence[Path], folder: Path) -> FileDigests:
    rectify = dataset.options.images == "rectify"
    cameras = [
        _camera_entry(f"{session.id}_{camera_id}", rectified(camera) if rectify else camera)
        for session in dataset.sessions
        for camera_id, camera in session.cameras.items()
    ]
    sizes = _sizes(dataset.sessions)
    objects = [
        {
            "class": a_class.name,
            "segmentation_class_id": place + 1,
            "fixed_model_transform": np.eye(4, dtype=np.int64).tolist(),
            "cuboid_dimensions": [round(float(value) * _CM, _LENGTH) for value in sizes[place][0]],
            **symmetry_entries(a_class.symmetry),
        }
        for place, a_class in enumerate(dataset.classes)
        if place in sizes
    ]
    classes = [entry["class"] for entry in objects]
    digests: FileDigests = {}
    for split in dataset.splits:
        for name, content in (
            ("_camera_settings", {"camera_settings": cameras}),
            ("_object_settings", {"exported_object_classes": classes, "exported_objects": objects}),
        ):
            path = f"{split}/{name}.json"
            head = orjson.dumps(content, option=orjson.OPT_INDENT_2)
            digests[path] = join_files([], folder / path, head=head, tail=b"\n")
    return digests


def _camera_entry(name: str, camera: Camera) -> dict[str, Any]:
    return {
        "name": name,
        "horizontal_fov": round(math.degrees(2 * math.atan(camera.width / 2 / camera.fx)), _LENGTH),
        "intrinsic_settings": {
            "resX": camera.width, "resY": camera.height,
            "fx": camera.fx, "fy": camera.fy, "cx": camera.cx, "cy": camera.cy, "s": 0,
        },
        "captured_image_size": {"width": camera.width, "height": camera.height},
    }  # fmt: skip


def _sizes(sessions: Sequence[PlannedSession]) -> dict[int, list[Float[np.ndarray, "3"]]]:
    """Of each class that has boxes, its sizes in metres that differ, the first box's first."""
    found: dict[int, list[np.ndarray]] = {}
    for session in sessions:
        for box, place in zip(session.boxes, session.class_of_box, strict=True):
            sizes = found.setdefault(place, [])
            if not any(float(np.abs(box.size - size).max()) <= ALIKE for size in sizes):
                sizes.append(box.size)
    return found


def _losses(plan: ExportPlan) -> list[str]:
    found = lens_losses(plan, exact="points and boxes in the image are right")
    several = [
        f"{plan.class_names[place]} ({len(sizes)})"
        for place, sizes in sorted(_sizes(plan.sessions).items())
        if len(sizes) > 1
    ]
    if several:
        found.append(
            "one size a class: DOPE solves for poses with a cuboid of the class, and there are boxes of several sizes"
            f" of {', '.join(several)}; _object_settings.json has the first"
        )
    by_lower: dict[str, list[str]] = {}
    for name in plan.class_names:
        by_lower.setdefault(name.lower(), []).append(name)
    alike = [" and ".join(names) for names in by_lower.values() if len(names) > 1]
    if alike:
        found.append(f"names that differ in case alone, which are one class to DOPE: {', '.join(alike)}")
    return found


WRITER = Writer(
    format="dope",
    title="DOPE (NDDS)",
    description=(
        "To train Deep Object Pose: a JSON file beside each image, with every object's pose and cuboid in centimetres"
        " and its nine points in the image."
    ),
    label_folder="*/*.json",
    image_folder=lambda split: split,
    write=_write,
    join=_join,
    shows=("keypoints",),
    losses=_losses,
    with_visible=True,
)
