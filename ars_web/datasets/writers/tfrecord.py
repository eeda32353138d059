"""TFRecord files with the features of TensorFlow's Object Detection API: `records/train-00000-of-00029.record`,
`records/label_map.pbtxt`.

Boxes are the part in the image in shares of its size, class labels count from 1, and `truncated` follows VOC, as
TensorFlow's own converter of VOC does: more than 15 % of the object outside. `area` is the box's in pixels. An image's
`source_id` is its place in the dataset from 1, which is COCO's image id. `image/encoded` holds the image's file as it
is; where no images are exported it is left out, and so are its format and key.
"""

import hashlib
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from ars_web.datasets.planned import ExportPlan
from ars_web.datasets.writers.sample_files import (
    Layout,
    Sample,
    file_count,
    join_samples,
    split_sizes,
    write_samples,
)
from ars_web.datasets.writers.tf_example import (
    bytes_feature,
    check_crc32c,
    example,
    float_feature,
    int64_feature,
    record,
)
from ars_web.datasets.writers.voc import TRUNCATED_BEYOND
from ars_web.datasets.writers.writer import Dataset, FileDigests, Shard, Writer

FOLDER = "records"


def _samples(shard: Shard) -> Iterator[Sample]:
    names = [shard.class_names[place].encode() for place in shard.class_of_box.tolist()]
    # Rounding must not lead out of the image.
    shares = np.clip(shard.table.bbox / shard.sizes[:, [0, 1, 0, 1]][:, None, :], 0.0, 1.0)
    sides = shard.table.bbox[..., 2:] - shard.table.bbox[..., :2]
    truncated = shard.table.truncated > TRUNCATED_BEYOND
    for i, image in enumerate(shard.image_names):
        columns = np.flatnonzero(shard.keep[i])
        width, height = shard.sizes[i].tolist()
        box = shares[i, columns]
        none = [0] * len(columns)
        features = {
            "image/filename": bytes_feature([image.encode()]),
            "image/source_id": bytes_feature([str(shard.first + i + 1).encode()]),
            "image/height": int64_feature([height]),
            "image/width": int64_feature([width]),
            "image/object/bbox/xmin": float_feature(box[:, 0]),
            "image/object/bbox/ymin": float_feature(box[:, 1]),
            "image/object/bbox/xmax": float_feature(box[:, 2]),
            "image/object/bbox/ymax": float_feature(box[:, 3]),
            "image/object/class/text": bytes_feature(names[column] for column in columns.tolist()),
            "image/object/class/label": int64_feature((shard.class_of_box[columns] + 1).tolist()),
            "image/object/area": float_feature(sides[i, columns].prod(axis=1)),
            "image/object/truncated": int64_feature(truncated[i, columns].astype(np.int64).tolist()),
            "image/object/difficult": int64_feature(none),
            "image/object/is_crowd": int64_feature(none),
        }
        if shard.image_files:
            content = shard.image_files[i].read_bytes()
            kind = b"png" if shard.image_files[i].suffix == ".png" else b"jpeg"
            features |= {
                "image/encoded": bytes_feature([content]),
                "image/format": bytes_feature([kind]),
                "image/key/sha256": bytes_feature([hashlib.sha256(content).hexdigest().encode()]),
            }
        yield Sample(record(example(features)))


def _path(split: str, number: int, count: int) -> str:
    return f"{FOLDER}/{split}-{number:05d}-of-{count:05d}.record"


_LAYOUT = Layout(path=_path)


def _write(shard: Shard, files: Path, fragments: Path) -> FileDigests:
    return write_samples(shard, _samples(shard), _LAYOUT, files, fragments)


def _join(dataset: Dataset, fragments: Sequence[Path], folder: Path) -> FileDigests:
    (folder / FOLDER).mkdir(exist_ok=True)
    digests = join_samples(fragments, _LAYOUT, folder)
    sizes = split_sizes(fragments)
    written = {_path(split, 0, file_count(0)): b"" for split in dataset.splits if split not in sizes}
    written[f"{FOLDER}/label_map.pbtxt"] = label_map(dataset.class_names).encode()
    for path, content in written.items():
        (folder / path).write_bytes(content)
        digests[path] = hashlib.sha256(content).hexdigest()
    return digests


def label_map(class_names: Sequence[str]) -> str:
    """A `StringIntLabelMap` in protobuf's text format; ids count from 1, because 0 is the background."""
    return "".join(f"item {{\n  id: {i}\n  name: {_quoted(name)}\n}}\n" for i, name in enumerate(class_names, start=1))


def _quoted(text: str) -> str:
    """A string of protobuf's text format: bytes that are no printable ASCII as three octal digits."""
    escaped = (chr(byte) if 0x20 <= byte < 0x7F and byte not in b'"\\' else f"\\{byte:03o}" for byte in text.encode())
    return f'"{"".join(escaped)}"'


def _losses(plan: ExportPlan) -> Sequence[str]:
    check_crc32c()
    if plan.options.images != "none":
        return ()
    return ("the records hold labels alone, because no images are exported; TensorFlow's own reader wants images",)


WRITER = Writer(
    format="tfrecord",
    title="TFRecord",
    description=(
        "For TensorFlow's Object Detection API and its relatives: images and boxes together in record files, with a"
        " label map."
    ),
    label_folder=FOLDER,
    image_folder=None,
    write=_write,
    join=_join,
    losses=_losses,
)
