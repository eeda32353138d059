import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ars_web.datasets.samples import LabelTable, Outlines
from ars_web.datasets.writers.polygon_rows import polygon_rows


def slow_rows(
    bbox: np.ndarray, keep: np.ndarray, rings: Outlines, sizes: np.ndarray, class_of_box: np.ndarray, *, within: bool
) -> list[str]:
    """The readable twin of `polygon_rows`: the text of each frame's file."""
    files: list[str] = []
    for frame, (width, height) in enumerate(sizes.tolist()):
        lines: list[str] = []
        for box in np.flatnonzero(keep[frame]).tolist():
            at = frame * keep.shape[1] + box
            ring = rings.points[rings.starts[at] : rings.starts[at + 1]].tolist()
            if len(ring) < 3:
                x0, y0, x1, y1 = bbox[frame, box].tolist()
                ring = [[x0, y0], [x0, y1], [x1, y1], [x1, y0]]
            millionths = [math.floor(v * 1e6 + 0.5) for x, y in ring for v in (x / width, y / height)]
            if within:
                millionths = [min(max(m, 0), 10**6) for m in millionths]
            shares = [f"{'-' if m < 0 else ''}{abs(m) // 10**6}.{abs(m) % 10**6:06d}" for m in millionths]
            lines.append(" ".join([str(class_of_box[box]), *shares]))
        files.append("".join(f"{line}\n" for line in lines))
    return files


@pytest.mark.parametrize("within", [False, True])
@settings(deadline=None)
@given(seed=st.integers(0, 2**32), n=st.integers(0, 6), b=st.integers(0, 12))
def test_fast_and_readable_rows_agree(within: bool, seed: int, n: int, b: int) -> None:
    random = np.random.default_rng(seed)
    sizes = random.choice([1, 7, 4096], (n, 2))
    keep = random.random((n, b)) < 0.7
    bbox = (np.sort(random.random((n, b, 2, 2)), axis=2) * sizes[:, None, None, :]).reshape(n, b, 4)
    lengths = np.where(keep, random.integers(0, 10, (n, b)), 0).ravel()
    starts = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)
    rings = Outlines((random.random((int(starts[-1]), 2)) - 0.3) * 5000, starts)
    class_of_box = random.integers(0, 200, b)
    table = LabelTable(bbox, bbox, np.zeros((n, b)), np.ones((n, b)))
    buffer, edges = polygon_rows(table, keep, rings, sizes, class_of_box, within=within)
    assert edges[-1] == len(buffer)
    found = [buffer[a:b].tobytes().decode() for a, b in pairwise(edges.tolist())]
    assert found == slow_rows(bbox, keep, rings, sizes, class_of_box, within=within)
