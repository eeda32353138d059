import math
from itertools import pairwise

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from ars_web.datasets.writers.yolo import quoted, rows


def slow_rows(bbox: np.ndarray, keep: np.ndarray, sizes: np.ndarray, class_of_box: np.ndarray) -> list[str]:
    """The readable twin of `rows`: the text of each frame's file."""
    files: list[str] = []
    for frame, (width, height) in enumerate(sizes.tolist()):
        lines: list[str] = []
        for box in np.flatnonzero(keep[frame]).tolist():
            x0, y0, x1, y1 = bbox[frame, box].tolist()
            shares = ((x0 + x1) / (2 * width), (y0 + y1) / (2 * height), (x1 - x0) / width, (y1 - y0) / height)
            millionths = [math.floor(share * 1e6 + 0.5) for share in shares]
            clipped = [min(max(m, least), 10**6) for m, least in zip(millionths, (0, 0, 1, 1), strict=True)]
            lines.append(" ".join([str(class_of_box[box]), *(f"{m // 10**6}.{m % 10**6:06d}" for m in clipped)]))
        files.append("".join(f"{line}\n" for line in lines))
    return files


def fast_rows(bbox: np.ndarray, keep: np.ndarray, sizes: np.ndarray, class_of_box: np.ndarray) -> list[str]:
    buffer, starts = rows(bbox, keep, sizes, class_of_box)
    assert starts[-1] == len(buffer)
    return [buffer[a:b].tobytes().decode() for a, b in pairwise(starts.tolist())]


@settings(deadline=None)
@given(seed=st.integers(0, 2**32), n=st.integers(0, 6), b=st.integers(0, 12), coarse=st.booleans())
def test_fast_and_readable_rows_agree(seed: int, n: int, b: int, coarse: bool) -> None:
    random = np.random.default_rng(seed)
    sizes = random.integers(1, 5000, (n, 2))
    corners = np.sort(random.random((n, b, 2, 2)), axis=2) * sizes[:, None, None, :]
    # Whole and half pixels of a few sizes fall on the roundings' edges.
    bbox = (np.round(corners * 2) / 2 if coarse else corners).reshape(n, b, 4)
    keep = random.random((n, b)) < 0.7
    bbox[~keep] = np.nan
    class_of_box = random.integers(0, 200, b)
    assert fast_rows(bbox, keep, sizes, class_of_box) == slow_rows(bbox, keep, sizes, class_of_box)


@pytest.mark.parametrize(
    ("bbox", "row"),
    [
        ((0, 0, 64, 48), "7 0.500000 0.500000 1.000000 1.000000\n"),
        ((0, 0, 0.00001, 0.00001), "7 0.000000 0.000000 0.000001 0.000001\n"),
        ((64, 48, 64, 48), "7 1.000000 1.000000 0.000001 0.000001\n"),
        ((16, 12, 48, 36), "7 0.500000 0.500000 0.500000 0.500000\n"),
        ((0, 0, 64 + 1e-9, 48 + 1e-9), "7 0.500000 0.500000 1.000000 1.000000\n"),
    ],
)
def test_boxes_at_the_edges_stay_within_0_and_1(bbox: tuple[float, ...], row: str) -> None:
    one = np.array(bbox, dtype=float).reshape(1, 1, 4)
    assert fast_rows(one, np.ones((1, 1), dtype=bool), np.array([[64, 48]]), np.array([7])) == [row]


def test_rows_read_back_are_the_boxes() -> None:
    random = np.random.default_rng(5)
    bbox = (np.sort(random.random((50, 4, 2, 2)), axis=2) * [640, 480]).reshape(50, 4, 4)
    texts = fast_rows(bbox, np.ones((50, 4), dtype=bool), np.tile([640, 480], (50, 1)), np.arange(4))
    values = np.array([[line.split() for line in text.splitlines()] for text in texts], dtype=float)
    centre, size = values[..., 1:3] * [640, 480], values[..., 3:] * [640, 480]
    read = np.concatenate([centre - size / 2, centre + size / 2], axis=-1)
    assert np.abs(read - bbox).max() < 1e-3


@given(st.text(st.characters(codec="utf-8"), max_size=30))
def test_any_class_name_survives_yaml(name: str) -> None:
    assert yaml.safe_load(f"names:\n  0: {quoted(name)}\n") == {"names": {0: name}}
