"""Tiny networks as ONNX files, written as the format has them: protocol buffers, no package needed."""

from pathlib import Path

import numpy as np

from ars_web.masks.onnx_segmenter import DEVIATION, MEAN

FLOAT, INTS = 1, 7


def varint(value: int) -> bytes:
    out = b""
    while value > 0x7F:
        out += bytes([value & 0x7F | 0x80])
        value >>= 7
    return out + bytes([value])


def field(number: int, value: int | str | bytes) -> bytes:
    """One field of a protocol buffer."""
    if isinstance(value, int):
        return varint(number << 3) + varint(value)
    data = value.encode() if isinstance(value, str) else value
    return varint(number << 3 | 2) + varint(len(data)) + data


def tensor(name: str, values: np.ndarray) -> bytes:
    dims = b"".join(field(1, size) for size in values.shape)
    return dims + field(2, FLOAT) + field(8, name) + field(9, values.astype("<f4").tobytes())


def value_info(name: str, shape: tuple[int, ...]) -> bytes:
    dims = b"".join(field(1, field(1, size)) for size in shape)
    return field(1, name) + field(2, field(1, field(1, FLOAT) + field(2, dims)))


def node(kind: str, inputs: list[str], output: str, attributes: bytes = b"") -> bytes:
    return (
        b"".join(field(1, name) for name in inputs) + field(2, output) + field(3, output) + field(4, kind) + attributes
    )


def write(path: Path, *, weights: np.ndarray, bias: np.ndarray, channels: int = 3) -> Path:
    """A network of one convolution and a sigmoid; the convolution's weights are (out, in, rows, columns)."""
    kernel = field(1, "kernel_shape") + b"".join(field(8, size) for size in weights.shape[2:]) + field(20, INTS)
    graph = (
        field(1, node("Conv", ["photo", "weights", "bias"], "score", field(5, kernel)))
        + field(1, node("Sigmoid", ["score"], "likely"))
        + field(2, "tiny")
        + field(5, tensor("weights", weights))
        + field(5, tensor("bias", bias))
        + field(11, value_info("photo", (1, channels, 320, 320)))
        + field(12, value_info("likely", (1, len(weights), 320 - weights.shape[2] + 1, 320 - weights.shape[3] + 1)))
    )
    path.write_bytes(field(1, 7) + field(7, graph) + field(8, field(1, "") + field(2, 11)))
    return path


def redness(path: Path) -> Path:
    """A network that finds what is more than half red: RGB 0 to 1, put right for ImageNet's mean and deviation."""
    weights = np.array([DEVIATION[0], 0.0, 0.0]).reshape(1, 3, 1, 1) * 50
    return write(path, weights=weights, bias=np.array([50 * (MEAN[0] - 0.5)]))
