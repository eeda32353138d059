"""Sets of masks: of each image which object, and which class, is seen at each pixel.

`masks/instances/NAME.png` has 16 bits a pixel, the id of the box whose object is nearest there, and
`masks/classes/NAME.png` has 8, the class's id + 1. 0 is the background. Which object is nearest is decided among all:
one whose label is dropped still hides what is behind it, and is background itself. `masks/{train,val}.json` lists the
labels of each image, those of objects that are wholly hidden too, and `classes.json` says what the values of classes
mean.

PNG stores both as grey values, which every reader gives back as they are; a palette is turned into colours by some.
"""

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Bool, Int, UInt8, UInt16

from ars_web.datasets.planned import ExportPlan
from ars_web.datasets.writers.joining import join_files
from ars_web.datasets.writers.writer import Dataset, FileDigests, Shard, Writer
from ars_web.errors import BadInput
from ars_web.geometry.instance_masks import InstanceMasks, instance_masks

MOST_CLASSES = 255
LARGEST_BOX_ID = 65535

_PNG = [cv2.IMWRITE_PNG_COMPRESSION, 1, cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_RLE]
"""Runs alone are looked for: masks are little else, and such files are half as large."""


SECONDS_OF_MASKS = 0.1
"""Rough work on one core of a frame: its masks, and two PNG files."""


def instance_ids(
    masks: InstanceMasks, keep: Bool[np.ndarray, "b"], box_ids: Sequence[int]
) -> UInt16[np.ndarray, "h w"]:
    """The id of the box that is seen at each pixel, 0 where none is or its label is not kept."""
    return _values(keep, box_ids).astype(np.uint16)[masks.visible]


def class_values(
    masks: InstanceMasks, keep: Bool[np.ndarray, "b"], class_of_box: Int[np.ndarray, "b"]
) -> UInt8[np.ndarray, "h w"]:
    """The id of its class + 1, and 0 where the other has 0."""
    return _values(keep, (class_of_box + 1).tolist()).astype(np.uint8)[masks.visible]


def _values(keep: Bool[np.ndarray, "b"], of_box: Sequence[int]) -> Int[np.ndarray, "k"]:
    """What stands for each box, and last for none: the place -1."""
    return np.append(np.where(keep, np.array(of_box, dtype=np.int64), 0), 0)


def _write(shard: Shard, files: Path, fragments: Path) -> FileDigests:
    for name in ("instances", "classes"):
        (files / "masks" / name).mkdir(parents=True, exist_ok=True)
    shapes, digests = shard.shapes, FileDigests()
    images: dict[str, list[str]] = {split: [] for split in shard.splits}
    for i, stem in enumerate(shard.stems):
        camera = shapes.cameras[int(shapes.camera_ids[i])]
        found = instance_masks(camera, shapes.Ts_world_camera[i], shapes.boxes, shapes.meshes)
        keep, seen = shard.keep[i], np.bincount(found.visible.ravel() + 1, minlength=len(shapes.boxes) + 1)[1:]
        written = {
            "instances": instance_ids(found, keep, shard.session.box_ids),
            "classes": class_values(found, keep, shard.class_of_box),
        }
        for name, values in written.items():
            path = f"masks/{name}/{stem}.png"
            ok, content = cv2.imencode(".png", values, _PNG)
            assert ok, f"OpenCV cannot encode {path}"
            (files / path).write_bytes(content.data)
            digests[path] = hashlib.sha256(content.data).hexdigest()
        objects = [
            {
                "id": shard.session.box_ids[column],
                "class": int(shard.class_of_box[column]) + 1,
                "pixels": int(seen[column]),
            }
            for column in np.flatnonzero(keep).tolist()
        ]
        line = {"image": shard.image_names[i], "masks": f"{stem}.png", "objects": objects}
        images[shard.splits[i]].append(json.dumps(line))
    for split, lines in images.items():
        (fragments / f"{split}.json").write_text(",\n".join(lines), encoding="utf-8")
    return digests


def _join(dataset: Dataset, fragments: Sequence[Path], folder: Path) -> FileDigests:
    for name in ("images", "masks/instances", "masks/classes"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    digests = FileDigests()
    for split in dataset.splits:
        path = f"masks/{split}.json"
        parts = [f / f"{split}.json" for f in fragments]
        digests[path] = join_files(parts, folder / path, head=b"[\n", between=b",\n", tail=b"\n]\n")
    classes = [
        {"value": value, "name": name, "color": color(value)} for value, name in enumerate(dataset.class_names, start=1)
    ]
    lines = ",\n".join(json.dumps(a_class) for a_class in classes)
    (folder / "classes.json").write_text(f"[\n{lines}\n]\n", encoding="utf-8")
    return digests


def color(value: int) -> list[int]:
    """Red, green and blue for a class, by the rule of VOC's segmentations: its bits, spread over the three."""
    found = [0, 0, 0]
    for place in range(8):
        for channel in range(3):
            found[channel] |= (value >> (3 * place + channel) & 1) << (7 - place)
    return found


def _losses(plan: ExportPlan) -> Sequence[str]:
    if len(plan.classes) > MOST_CLASSES:
        raise BadInput(
            f"masks: classes are written in 8 bits, so a dataset has at most {MOST_CLASSES}, not {len(plan.classes)};"
            " export to coco, or remove classes"
        )
    largest = max((box_id for session in plan.sessions for box_id in session.box_ids), default=0)
    if largest > LARGEST_BOX_ID:
        raise BadInput(
            f"masks: ids of boxes are written in 16 bits, up to {LARGEST_BOX_ID}, and one is {largest}; export to coco"
        )
    return ("the hidden parts of objects: a pixel holds the nearest alone",)


WRITER = Writer(
    format="masks",
    title="Mask sets",
    description="For each image which object and which class is seen at each pixel, as grey values of two PNG files.",
    label_folder="masks",
    image_folder=lambda split: "images",
    write=_write,
    join=_join,
    shows=("mask",),
    losses=_losses,
    seconds_per_frame=lambda options: SECONDS_OF_MASKS,
)
