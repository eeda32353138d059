"""`tf.train.Example` in protobuf's wire format, and the records that TFRecord files are made of, without TensorFlow.

    message Example   { Features features = 1; }
    message Features  { map<string, Feature> feature = 1; }
    message Feature   { oneof kind { BytesList bytes_list = 1; FloatList float_list = 2; Int64List int64_list = 3; } }

each list being `repeated value = 1`, numbers packed; from tensorflow/core/example. Features are written in the order of
their names, so that equal examples have equal bytes.
"""

import importlib.util
from collections.abc import Iterable, Mapping

import numpy as np
from jaxtyping import Float

from ars_web.errors import BadInput

_BYTES_LIST, _FLOAT_LIST, _INT64_LIST = 1, 2, 3

_MASK_DELTA = 0xA282EAD8


def check_crc32c() -> None:
    """Raises BadInput where google-crc32c is not installed."""
    if importlib.util.find_spec("google_crc32c") is None:
        raise BadInput("format 'tfrecord' needs google-crc32c, which is not installed: pip install 'ars-web[tfrecord]'")


def bytes_feature(values: Iterable[bytes]) -> bytes:
    """A `Feature` of byte strings."""
    return _field(_BYTES_LIST, b"".join(_field(1, value) for value in values))


def float_feature(values: Float[np.ndarray, "n"]) -> bytes:
    """A `Feature` of numbers, which become single precision."""
    packed = values.astype("<f4").tobytes()
    return _field(_FLOAT_LIST, _field(1, packed) if packed else b"")


def int64_feature(values: Iterable[int]) -> bytes:
    """A `Feature` of integers of at least 0."""
    packed = b"".join(map(_varint, values))
    return _field(_INT64_LIST, _field(1, packed) if packed else b"")


def example(features: Mapping[str, bytes]) -> bytes:
    """An `Example` of the features by name."""
    entries = (_field(1, _field(1, name.encode()) + _field(2, features[name])) for name in sorted(features))
    return _field(1, b"".join(entries))


def record(content: bytes) -> tuple[bytes, bytes, bytes]:
    """What comes before a record's bytes in a TFRecord file, the bytes, and what comes after: its length and masked
    checksums."""
    length = len(content).to_bytes(8, "little")
    return length + _masked_crc(length), content, _masked_crc(content)


def _masked_crc(content: bytes) -> bytes:
    """CRC-32C, turned right by 15 bits and moved, so that checksums of checksums differ (tensorflow/core/lib/hash)."""
    # An extra, which only those who write TFRecords need.
    import google_crc32c

    crc = google_crc32c.value(content)
    masked = (((crc >> 15) | (crc << 17)) + _MASK_DELTA) & 0xFFFFFFFF
    return masked.to_bytes(4, "little")


def _field(number: int, content: bytes) -> bytes:
    """A field with a length before its content."""
    return _varint(number << 3 | 2) + _varint(len(content)) + content


def _varint(value: int) -> bytes:
    """Seven bits a byte, the lowest first."""
    if value < 0x80:
        return bytes((value,))
    found = bytearray()
    while value >= 0x80:
        found.append(value & 0x7F | 0x80)
        value >>= 7
    found.append(value)
    return bytes(found)
