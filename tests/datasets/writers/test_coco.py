import json
import math
from itertools import pairwise

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from ars_web.datasets.samples import LabelTable, Outlines
from ars_web.datasets.writers.coco import annotations


def decimal(value: int, decimals: int) -> str:
    whole, fraction = divmod(abs(value), 10**decimals)
    return f"{'-' if value < 0 else ''}{whole}.{fraction:0{decimals}d}"


def hundredths(value: float) -> int:
    return math.floor(value * 100 + 0.5)


def box_text(bbox: list[float]) -> str:
    x0, y0, x1, y1 = map(hundredths, bbox)
    return ",".join(decimal(v, 2) for v in (x0, y0, x1 - x0, y1 - y0))


def slow_annotations(
    table: LabelTable, keep: np.ndarray, outlines: Outlines, class_of_box: np.ndarray, *, first: int, most_boxes: int
) -> str:
    """The readable twin of `annotations`."""
    found: list[str] = []
    for frame, box in np.argwhere(keep).tolist():
        x0, y0, x1, y1 = table.bbox[frame, box].tolist()
        at = frame * keep.shape[1] + box
        ring = outlines.points[outlines.starts[at] : outlines.starts[at + 1]].tolist()
        if len(ring) < 3:
            ring = [[x0, y0], [x0, y1], [x1, y1], [x1, y0]]
        (ox, oy), twice = ring[0], 0.0
        for (ax, ay), (bx, by) in pairwise(ring[1:]):
            twice += (ax - ox) * (by - oy) - (ay - oy) * (bx - ox)
        found.append(
            f'{{"id":{(first + frame) * most_boxes + box + 1},"image_id":{first + frame + 1}'
            f',"category_id":{class_of_box[box] + 1},"bbox":[{box_text([x0, y0, x1, y1])}]'
            f',"area":{decimal(hundredths(abs(twice) / 2), 2)},"iscrowd":0'
            f',"segmentation":[[{",".join(decimal(hundredths(v), 2) for point in ring for v in point)}]]'
            f',"amodal_bbox":[{box_text(table.bbox_amodal[frame, box].tolist())}]'
            f',"visible":{decimal(math.floor(table.visible[frame, box] * 1e4 + 0.5), 4)}'
            f',"truncated":{decimal(math.floor(table.truncated[frame, box] * 1e4 + 0.5), 4)}}}'
        )
    return ",".join(found)


def random_labels(seed: int, n: int, b: int) -> tuple[LabelTable, np.ndarray, Outlines]:
    """Labels with rings of no to nine points, amodal boxes far out, and boxes of no width."""
    random = np.random.default_rng(seed)
    bbox = (np.sort(random.random((n, b, 2, 2)), axis=2) * random.choice([3, 700, 99_999], (n, b, 1, 1))).reshape(
        n, b, 4
    )
    flat = random.random((n, b)) < 0.2
    bbox[flat, 2] = bbox[flat, 0]
    amodal = bbox + random.choice([-1e7, -3, 0, 0.005, 1e7], (n, b, 4))
    table = LabelTable(bbox, amodal, random.random((n, b)), random.random((n, b)))
    keep = random.random((n, b)) < 0.7
    lengths = np.where(keep, random.integers(0, 10, (n, b)), 0).ravel()
    starts = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)
    return table, keep, Outlines(random.random((int(starts[-1]), 2)) * 1000, starts)


@settings(deadline=None)
@given(seed=st.integers(0, 2**32), n=st.integers(0, 6), b=st.integers(0, 12), first=st.integers(0, 10**6))
def test_fast_and_readable_annotations_agree(seed: int, n: int, b: int, first: int) -> None:
    table, keep, outlines = random_labels(seed, n, b)
    class_of_box = np.random.default_rng(seed).integers(0, 30, b)
    fast = annotations(table, keep, outlines, class_of_box, first=first, most_boxes=b + 2)
    assert fast.tobytes().decode() == slow_annotations(
        table, keep, outlines, class_of_box, first=first, most_boxes=b + 2
    )


def test_annotations_are_json_and_close_to_what_they_say() -> None:
    table, keep, outlines = random_labels(3, 40, 7)
    fast = annotations(table, keep, outlines, np.arange(7), first=100, most_boxes=9)
    found = json.loads(b"[" + fast.tobytes() + b"]")
    frames, boxes = np.nonzero(keep)
    assert [a["image_id"] for a in found] == (frames + 101).tolist()
    assert [a["category_id"] for a in found] == (boxes + 1).tolist()
    assert len({a["id"] for a in found}) == len(found)
    x, y, w, h = np.array([a["bbox"] for a in found]).T
    assert np.abs(np.stack([x, y, x + w, y + h], axis=-1) - table.bbox[keep]).max() < 0.0051
    assert np.abs(np.array([a["visible"] for a in found]) - table.visible[keep]).max() < 5.1e-5
    assert np.abs(np.array([a["truncated"] for a in found]) - table.truncated[keep]).max() < 5.1e-5
    assert all(len(ring) >= 6 for a in found for ring in a["segmentation"])
