"""TFRecord files, read as TensorFlow's own documents of the format say; checksums are checked."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ars_web.datasets.readback.dataset_json import class_names
from ars_web.datasets.readback.reader import Reader, ReadFrame, ReadLabel, Sizes
from ars_web.datasets.readback.yolo import own_reading
from ars_web.datasets.writers.tfrecord import FOLDER
from ars_web.errors import BadFile

_Values = list[bytes] | list[int] | Float[np.ndarray, "n"]


def records_of(path: Path) -> Iterator[bytes]:
    """The records of a file, one at a time; BadFile where a length or a checksum is wrong."""
    number = 0
    with path.open("rb") as file:
        while head := file.read(12):
            length = int.from_bytes(head[:8], "little")
            if len(head) < 12 or head[8:] != _masked(head[:8]):
                raise BadFile(path, f"record {number} has no sound length")
            content, crc = file.read(length), file.read(4)
            if len(content) < length or crc != _masked(content):
                raise BadFile(path, f"record {number} is damaged: its checksum is another")
            yield content
            number += 1


def _masked(content: bytes) -> bytes:
    import google_crc32c

    crc = google_crc32c.value(content)
    turned = (crc >> 15 | crc << 17) & 0xFFFFFFFF
    return ((turned + 0xA282EAD8) % 2**32).to_bytes(4, "little")


def features_of(content: bytes) -> dict[str, _Values]:
    """The features of a `tf.train.Example` by name; ValueError where the bytes are none."""
    found: dict[str, _Values] = {}
    for features in _fields(content):
        for entry in _fields(features[1]):
            parts = dict(_fields(entry[1]))
            found[parts[1].decode()] = _values(parts[2])
    return found


def _values(feature: bytes) -> _Values:
    ((kind, content),) = _fields(feature)
    values = [value for _, value in _fields(content)]
    if kind == 1:
        return values
    packed = b"".join(values)
    if kind == 2:
        return np.frombuffer(packed, dtype="<f4").astype(np.float64)
    integers: list[int] = []
    place = 0
    while place < len(packed):
        integer, place = _varint(packed, place)
        integers.append(integer)
    return integers


def _fields(content: bytes) -> list[tuple[int, bytes]]:
    """The fields of a message, all of which have a length before their content."""
    found: list[tuple[int, bytes]] = []
    place = 0
    while place < len(content):
        key, place = _varint(content, place)
        length, place = _varint(content, place)
        if key & 7 != 2 or place + length > len(content):
            raise ValueError(f"no field of a tf.train.Example begins at byte {place}")
        found.append((key >> 3, content[place : place + length]))
        place += length
    return found


def _varint(content: bytes, place: int) -> tuple[int, int]:
    value = shift = 0
    while place < len(content):
        byte = content[place]
        value |= (byte & 0x7F) << shift
        place, shift = place + 1, shift + 7
        if byte < 0x80:
            return value, place
    raise ValueError("an integer goes on beyond the end")


def _read(folder: Path, sizes: Sizes) -> Iterator[ReadFrame]:
    names = class_names(folder)
    for path in sorted((folder / FOLDER).glob("*.record")):
        split = path.name.partition("-")[0]
        for number, content in enumerate(records_of(path)):
            place = f"{path}, record {number}"
            try:
                features = features_of(content)
                yield _frame(place, split, features, names)
            except (ValueError, KeyError, IndexError) as error:
                raise BadFile(path, f"record {number} is no tf.train.Example of images: {error}") from error


def _frame(place: str, split: str, features: Mapping[str, _Values], names: list[str]) -> ReadFrame:
    (width,), (height,) = features["image/width"], features["image/height"]
    (name,) = features["image/filename"]
    sides = [features[f"image/object/bbox/{side}"] for side in ("xmin", "ymin", "xmax", "ymax")]
    bbox = np.column_stack(sides) * [width, height, width, height]
    texts, ids = features["image/object/class/text"], features["image/object/class/label"]
    labels: list[ReadLabel] = []
    for box, text, class_id in zip(bbox, texts, ids, strict=True):
        class_name = bytes(text).decode()
        if names[int(class_id) - 1] != class_name:
            raise ValueError(f"class {class_id} is called {class_name!r}, but {names[int(class_id) - 1]!r} elsewhere")
        labels.append(ReadLabel(class_name, bbox=box))
    return ReadFrame(Path(bytes(name).decode()).stem, split, place, tuple(labels), image_size=(int(width), int(height)))


def _rounding(longer: int) -> float:
    # Single precision of a share of at most 1.
    return longer * 2.0**-24


READER = Reader(format="tfrecord", library=own_reading, read=_read, rounding=_rounding)
