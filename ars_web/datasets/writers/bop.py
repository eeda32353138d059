"""BOP's scene-wise format: `{train,val}/000000/` for each session, with `rgb/`, `scene_camera.json`, `scene_gt.json`
and `scene_gt_info.json`, `mask/` and `mask_visib/`; `models/`; targets of validation and test images.

Millimetres; rotations row by row; a model's origin is its box's centre. Images are numbered through the whole
dataset. Cameras are matrices alone: what a lens bends is not in them.
"""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import orjson
from jaxtyping import Bool, Float, Int, UInt8
from numba import njit

from ars_web.datasets.planned import ExportPlan
from ars_web.datasets.shapes import PosedShapes
from ars_web.datasets.writers.bop_info import BopInfo, info_of_outlines
from ars_web.datasets.writers.bop_masks import write_masks
from ars_web.datasets.writers.bop_models import write_models
from ars_web.datasets.writers.bop_objects import object_ids, objects_of
from ars_web.datasets.writers.digits import Buffer, put_bytes, put_decimal, put_integer, scaled
from ars_web.datasets.writers.joining import Joined, join_files
from ars_web.datasets.writers.posed import Ts_camera_box, classes_without_boxes, lens_losses
from ars_web.datasets.writers.writer import Dataset, FileDigests, Shard, Writer
from ars_web.geometry import rigid_transform
from ars_web.geometry.camera import rectified

SEEN_ENOUGH = 0.1
"""Visible share from which an object is a target, as in the BOP challenges."""

_DOCUMENTS = ("scene_camera", "scene_gt", "scene_gt_info")

_GT_BYTES = 320
"""More than an object's pose: nine numbers of 14 characters, three of 17, the names and the id."""

_INFO_BYTES = 320
"""More than what is said of an object: eleven integers and a share, and the names."""

_IMAGE_BYTES = 32
"""A line's beginning and end."""


SECONDS_OF_MASKS = 0.05
"""Rough work on one core of a frame whose masks are written."""


def _text(text: str) -> UInt8[np.ndarray, "size"]:
    return np.frombuffer(text.encode(), dtype=np.uint8)


_INDENT = _text('  "')
_OPEN = _text('": [')
_COMMA = _text(", ")
_NEXT_LINE = _text(",\n")
_ROTATION = _text('{"cam_R_m2c": [')
_TRANSLATION = _text('], "cam_t_m2c": [')
_OBJECT = _text('], "obj_id": ')
_BBOX_OBJ = _text('{"bbox_obj": [')
_BBOX_VISIB = _text('], "bbox_visib": [')
_PX_ALL = _text('], "px_count_all": ')
_PX_VALID = _text(', "px_count_valid": ')
_PX_VISIB = _text(', "px_count_visib": ')
_FRACTION = _text(', "visib_fract": ')


def poses(
    Ts: Float[np.ndarray, "n b 4 4"],
    keep: Bool[np.ndarray, "n b"],
    ids: Int[np.ndarray, "b"],
    images: Int[np.ndarray, "n"],
) -> UInt8[np.ndarray, "size"]:
    """The lines of `scene_gt.json`, a frame each, commas between them.

    `Ts` are in metres, `ids` the boxes' objects, `images` the frames' numbers. Rotations have nine decimals,
    translations five of a millimetre, rounded halves up.
    """
    buffer = np.empty(len(keep) * _IMAGE_BYTES + int(keep.sum()) * _GT_BYTES, dtype=np.uint8)
    return buffer[: _poses(Ts, keep, ids.astype(np.int64), images.astype(np.int64), buffer)]


@njit(cache=True)
def _poses(
    Ts: Float[np.ndarray, "n b 4 4"],
    keep: Bool[np.ndarray, "n b"],
    ids: Int[np.ndarray, "b"],
    images: Int[np.ndarray, "n"],
    buffer: Buffer,
) -> int:
    place = 0
    for frame in range(keep.shape[0]):
        place = _begin(buffer, place, images[frame])
        begun = False
        for box in range(keep.shape[1]):
            if not keep[frame, box]:
                continue
            if begun:
                place = put_bytes(buffer, place, _COMMA)
            begun = True
            place = put_bytes(buffer, place, _ROTATION)
            for i in range(9):
                if i > 0:
                    place = put_bytes(buffer, place, _COMMA)
                place = put_decimal(buffer, place, scaled(Ts[frame, box, i // 3, i % 3], 1e9), 9)
            place = put_bytes(buffer, place, _TRANSLATION)
            for i in range(3):
                if i > 0:
                    place = put_bytes(buffer, place, _COMMA)
                # Millimetres with five decimals.
                place = put_decimal(buffer, place, scaled(Ts[frame, box, i, 3], 1e8), 5)
            place = put_bytes(buffer, place, _OBJECT)
            place = put_integer(buffer, place, ids[box])
            buffer[place] = 125  # "}"
            place += 1
        buffer[place] = 93  # "]"
        place += 1
    return place


@njit(cache=True)
def _begin(buffer: Buffer, place: int, image: int) -> int:
    if place > 0:
        place = put_bytes(buffer, place, _NEXT_LINE)
    place = put_bytes(buffer, place, _INDENT)
    place = put_integer(buffer, place, image)
    return put_bytes(buffer, place, _OPEN)


def infos(
    info: BopInfo, keep: Bool[np.ndarray, "n b"], images: Int[np.ndarray, "n"], rows: Int[np.ndarray, "m"]
) -> UInt8[np.ndarray, "size"]:
    """The lines of `scene_gt_info.json` of some rows of frames, one each, commas between them; shares have six
    decimals."""
    buffer = np.empty(len(rows) * _IMAGE_BYTES + int(keep[rows].sum()) * _INFO_BYTES, dtype=np.uint8)
    boxes, counts = (info.bbox_obj[rows], info.bbox_visib[rows]), (info.px_all[rows], info.px_valid[rows])
    return buffer[: _infos(*boxes, *counts, info.px_visib[rows], keep[rows], images[rows].astype(np.int64), buffer)]


@njit(cache=True)
def _infos(
    bbox_obj: Int[np.ndarray, "n b 4"],
    bbox_visib: Int[np.ndarray, "n b 4"],
    px_all: Int[np.ndarray, "n b"],
    px_valid: Int[np.ndarray, "n b"],
    px_visib: Int[np.ndarray, "n b"],
    keep: Bool[np.ndarray, "n b"],
    images: Int[np.ndarray, "n"],
    buffer: Buffer,
) -> int:
    place = 0
    for frame in range(keep.shape[0]):
        place = _begin(buffer, place, images[frame])
        begun = False
        for box in range(keep.shape[1]):
            if not keep[frame, box]:
                continue
            if begun:
                place = put_bytes(buffer, place, _COMMA)
            begun = True
            place = put_bytes(buffer, place, _BBOX_OBJ)
            place = _put_box(buffer, place, bbox_obj[frame, box])
            place = put_bytes(buffer, place, _BBOX_VISIB)
            place = _put_box(buffer, place, bbox_visib[frame, box])
            place = put_bytes(buffer, place, _PX_ALL)
            place = put_integer(buffer, place, px_all[frame, box])
            place = put_bytes(buffer, place, _PX_VALID)
            place = put_integer(buffer, place, px_valid[frame, box])
            place = put_bytes(buffer, place, _PX_VISIB)
            place = put_integer(buffer, place, px_visib[frame, box])
            place = put_bytes(buffer, place, _FRACTION)
            share = px_visib[frame, box] / max(px_all[frame, box], 1)
            place = put_decimal(buffer, place, scaled(share, 1e6), 6)
            buffer[place] = 125  # "}"
            place += 1
        buffer[place] = 93  # "]"
        place += 1
    return place


@njit(cache=True)
def _put_box(buffer: Buffer, place: int, box: Int[np.ndarray, "4"]) -> int:
    for i in range(4):
        if i > 0:
            place = put_bytes(buffer, place, _COMMA)
        place = put_integer(buffer, place, box[i])
    return place


def cameras(shapes: PosedShapes, images: Int[np.ndarray, "n"]) -> list[str]:
    """The lines of `scene_camera.json`, one a frame. There is no depth to scale."""
    matrices = {
        camera_id: "[" + ", ".join(repr(float(v)) for v in camera.K.ravel()) + "]"
        for camera_id, camera in shapes.cameras.items()
    }
    Ts_camera_world = rigid_transform.invert(shapes.Ts_world_camera)
    # Adding zero turns a negative zero, which rounding leaves, into one without a sign.
    rotations = (np.round(Ts_camera_world[:, :3, :3].reshape(-1, 9), 9) + 0.0).tolist()
    translations = (np.round(Ts_camera_world[:, :3, 3] * 1000.0, 5) + 0.0).tolist()
    return [
        f'  "{image}": {{"cam_K": {matrices[camera_id]}, "cam_R_w2c": [{_listed(R, 9)}],'
        f' "cam_t_w2c": [{_listed(t, 5)}], "depth_scale": 1.0}}'
        for image, camera_id, R, t in zip(
            images.tolist(), shapes.camera_ids.tolist(), rotations, translations, strict=True
        )
    ]


def _listed(values: Sequence[float], digits: int) -> str:
    return ", ".join([f"{value:.{digits}f}" for value in values])


def _targets(shard: Shard, rows: Int[np.ndarray, "m"], info: BopInfo, ids: Int[np.ndarray, "b"]) -> list[str]:
    """The lines of a split's targets: how many of each object are seen enough in each image."""
    enough = shard.keep & (info.px_visib >= SEEN_ENOUGH * info.px_all) & (info.px_visib > 0)
    return [
        f'  {{"im_id": {shard.first + row}, "inst_count": {count}, "obj_id": {object_id},'
        f' "scene_id": {shard.session_number}}}'
        for row in rows.tolist()
        for object_id, count in sorted(Counter(ids[enough[row]].tolist()).items())
    ]


def _write(shard: Shard, files: Path, fragments: Path) -> FileDigests:
    ids = object_ids(objects_of(shard.sessions), shard.session_number, len(shard.shapes.boxes))
    info = info_of_outlines(shard.table, shard.outlines, shard.sizes)
    if shard.options.masks == "write":
        info = write_masks(shard, info, files)
    Ts = Ts_camera_box(shard.shapes)
    of_frame = np.array(shard.splits)
    images = shard.first + np.arange(len(of_frame))
    lines_of_cameras = cameras(shard.shapes, images)
    lines = [f"{stem} {name}\n" for stem, name in zip(shard.stems, shard.identities, strict=True)]
    (fragments / "frames.txt").write_text("".join(lines), encoding="utf-8")
    for split in sorted(set(shard.splits)):
        rows = np.flatnonzero(of_frame == split)
        for name, content in (
            ("scene_camera", ",\n".join([lines_of_cameras[row] for row in rows.tolist()]).encode()),
            ("scene_gt", poses(Ts[rows], shard.keep[rows], ids, images[rows]).data),
            ("scene_gt_info", infos(info, shard.keep, images, rows).data),
        ):
            (fragments / f"{split}.{shard.session_number}.{name}").write_bytes(content)
        if split != "train":
            targets = _targets(shard, rows, info, ids)
            (fragments / f"{split}.targets").write_text(",\n".join(targets), encoding="ascii")
    return {}


def _join(dataset: Dataset, fragments: Sequence[Path], folder: Path) -> FileDigests:
    digests: FileDigests = {}
    for split in dataset.splits:
        (folder / split).mkdir(parents=True, exist_ok=True)
        for session in range(len(dataset.sessions)):
            sources = [f for f in fragments if (f / f"{split}.{session}.scene_gt").exists()]
            for name in _DOCUMENTS if sources else ():
                path = f"{split}/{session:06d}/{name}.json"
                (folder / path).parent.mkdir(exist_ok=True)
                with Joined(folder / path) as joined:
                    joined.add(b"{\n")
                    joined.add_files([f / f"{split}.{session}.{name}" for f in sources], between=b",\n")
                    joined.add(b"\n}\n")
                digests[path] = joined.sha256
        if split != "train":
            sources = [f / f"{split}.targets" for f in fragments]
            target = folder / f"{split}_targets_bop19.json"
            join_files(sources, target, head=b"[\n", between=b",\n", tail=b"\n]\n")
    join_files([f / "frames.txt" for f in fragments], folder / "frames.txt")
    write_models(dataset, objects_of(dataset.sessions), folder)
    (folder / "camera.json").write_bytes(_camera(dataset))
    return digests


def _camera(dataset: Dataset) -> bytes:
    """`camera.json`: the first camera, for renderers; each image's is in its scene."""
    camera = next(iter(dataset.sessions[0].cameras.values()))
    if dataset.options.images == "rectify":
        camera = rectified(camera)
    content = {
        "cx": camera.cx, "cy": camera.cy, "depth_scale": 1.0, "fx": camera.fx, "fy": camera.fy,
        "height": camera.height, "width": camera.width,
    }  # fmt: skip
    return orjson.dumps(content, option=orjson.OPT_INDENT_2) + b"\n"


def _losses(plan: ExportPlan) -> list[str]:
    found = lens_losses(plan, exact="the poses themselves, and boxes and counts of pixels, are right")
    if plan.options.masks == "none":
        found.append(
            "masks, which were not asked for; counts of pixels, and what of an object is hidden, are estimates"
        )
    names = classes_without_boxes(plan)
    if names:
        found.append(f"classes without a box, which have no model: {', '.join(names)}")
    several = Counter(o.class_place for o in objects_of(plan.sessions))
    split = [f"{plan.class_names[place]} ({count})" for place, count in sorted(several.items()) if count > 1]
    if split:
        found.append(
            "one object a class, where its boxes differ by more than 0.1 mm: an object of BOP has one geometry, so"
            f" there are several of {', '.join(split)}; objects.json says which is which"
        )
    return found


WRITER = Writer(
    format="bop",
    title="BOP scenes",
    description=(
        "To train and evaluate 6D poses: each object's pose and model in millimetres, its symmetries, and what of it"
        " is seen, in the layout of the BOP challenge."
    ),
    label_folder="*/*/scene_*.json",
    image_folder=lambda split: f"{split}/{{session:06d}}/rgb",
    write=_write,
    join=_join,
    shows=("silhouette",),
    losses=_losses,
    seconds_per_frame=lambda options: SECONDS_OF_MASKS if options.masks == "write" else 0.0,
    own_options=("masks",),
    with_visible=True,
    with_outlines=True,
    numbered=True,
    digits=6,
)
