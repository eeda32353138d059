import json
import math
from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import replace
from io import StringIO
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

from ars_web.datasets.jobs import plan_export, run_export
from ars_web.datasets.label_functions import Marks
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.samples import LabelTable, Outlines
from ars_web.datasets.writers.coco import annotations
from ars_web.geometry.box import EDGES
from ars_web.geometry.keypoints import Keypoint
from ars_web.geometry.rings import one_ring_each
from ars_web.sessions.model import SessionSnapshot


def decimal(value: int, decimals: int) -> str:
    whole, fraction = divmod(abs(value), 10**decimals)
    return f"{'-' if value < 0 else ''}{whole}.{fraction:0{decimals}d}"


def hundredths(value: float) -> int:
    return math.floor(value * 100 + 0.5)


def box_text(bbox: list[float]) -> str:
    x0, y0, x1, y1 = map(hundredths, bbox)
    return ",".join(decimal(v, 2) for v in (x0, y0, x1 - x0, y1 - y0))


def slow_annotations(
    table: LabelTable,
    keep: np.ndarray,
    outlines: Outlines,
    class_of_box: np.ndarray,
    marks: Marks,
    counts: np.ndarray,
    *,
    first: int,
    most_boxes: int,
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
        keypoints: list[str] = []
        for point, state in zip(marks.points[frame, box], marks.states[frame, box], strict=True):
            indices = [decimal(hundredths(v - 0.5) if state else 0, 2) for v in point.tolist()]
            keypoints += [*indices, str(state)]
        keypoints = keypoints[: 3 * counts[box]]
        found.append(
            f'{{"id":{(first + frame) * most_boxes + box + 1},"image_id":{first + frame + 1}'
            f',"category_id":{class_of_box[box] + 1},"bbox":[{box_text([x0, y0, x1, y1])}]'
            f',"area":{decimal(hundredths(abs(twice) / 2), 2)},"iscrowd":0'
            f',"segmentation":[[{",".join(decimal(hundredths(v), 2) for point in ring for v in point)}]]'
            f',"keypoints":[{",".join(keypoints)}],"num_keypoints":{sum(v != "0" for v in keypoints[2::3])}'
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


def random_keypoints(seed: int, n: int, b: int, k: int) -> tuple[Marks, np.ndarray]:
    """Points within and without the image, in every state, and how many each box has."""
    random = np.random.default_rng(seed)
    points, states = random.choice([0.0, 0.25, 0.5, 99_999.125], (n, b, k, 2)), random.integers(0, 3, (n, b, k))
    points[states == 0] = np.nan
    none = one_ring_each(np.zeros((0, 2)), np.zeros(n * b + 1, dtype=np.int64))
    return Marks(none, points, states), random.integers(0, k + 1, b)


@settings(deadline=None)
@given(seed=st.integers(0, 2**32), n=st.integers(0, 6), b=st.integers(0, 12), first=st.integers(0, 10**6))
def test_fast_and_readable_annotations_agree(seed: int, n: int, b: int, first: int) -> None:
    table, keep, outlines = random_labels(seed, n, b)
    class_of_box = np.random.default_rng(seed).integers(0, 30, b)
    given_all = (table, keep, outlines, class_of_box, *random_keypoints(seed, n, b, seed % 4))
    fast = annotations(*given_all, first=first, most_boxes=b + 2)
    assert fast.tobytes().decode() == slow_annotations(*given_all, first=first, most_boxes=b + 2)


def test_annotations_are_json_and_close_to_what_they_say() -> None:
    table, keep, outlines = random_labels(3, 40, 7)
    fast = annotations(table, keep, outlines, np.arange(7), *random_keypoints(3, 40, 7, 9), first=100, most_boxes=9)
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


@pytest.fixture
def written(make_snapshot: Callable[..., SessionSnapshot], tmp_path: Path) -> Callable[..., Path]:
    """Writes twelve frames into one file, whose path it answers; with other keypoints of the second class."""

    def write(keypoints: tuple[Keypoint, ...] | None = None) -> Path:
        options = ExportOptions.model_validate({"images": "none", "split": {"train": 1.0, "val": 0.0}})
        snapshot = make_snapshot(12, one_camera=True)
        plan = plan_export([snapshot], format="coco", options=options, out=tmp_path / "d", frames_per_shard=5)
        if keypoints is not None:
            plan = replace(plan, classes=(plan.classes[0], replace(plan.classes[1], keypoints=keypoints)))
        run_export(plan)
        return tmp_path / "d" / "annotations" / "instances_train.json"

    return write


@pytest.mark.filterwarnings("ignore:__array__ implementation doesn't accept a copy:DeprecationWarning")  # its own
def test_its_own_keypoints_are_perfect_in_cocos_evaluation(written: Callable[..., Path]) -> None:
    with redirect_stdout(StringIO()):
        truth = COCO(written())
        found = [
            {key: annotation[key] for key in ("image_id", "category_id", "keypoints")} | {"score": 1.0}
            for annotation in truth.anns.values()
        ]
        evaluation = COCOeval(truth, truth.loadRes(found), "keypoints")
        evaluation.params.kpt_oks_sigmas = np.full(9, 0.05)
        # The images are small: all of their objects count, whatever COCO calls medium and large.
        evaluation.params.areaRng, evaluation.params.areaRngLbl = [[0, 1e10]] * 3, ["all", "medium", "large"]
        evaluation.evaluate()
        evaluation.accumulate()
        evaluation.summarize()
    assert evaluation.stats.tolist() == [1.0] * 10


def test_keypoints_are_indices_of_pixels(
    written: Callable[..., Path], make_snapshot: Callable[..., SessionSnapshot]
) -> None:
    document, snapshot = json.loads(written().read_bytes()), make_snapshot(12, one_camera=True)
    camera, compared = snapshot.cameras[0], 0
    for annotation in document["annotations"]:
        frame, box = divmod(annotation["id"] - 1, 3)
        corners = snapshot.state.boxes[box + 1].box.corners_world
        T_camera_world = np.linalg.inv(snapshot.frames.Ts_world_camera[frame])
        # OpenCV's pixels: a pixel's centre is a whole number.
        pixels, _ = cv2.projectPoints(
            corners @ T_camera_world[:3, :3].T + T_camera_world[:3, 3],
            np.zeros(3),
            np.zeros(3),
            camera.K,
            np.array(camera.distortion),
        )
        found = np.array(annotation["keypoints"]).reshape(9, 3)[1:]
        held = found[:, 2] > 0
        np.testing.assert_allclose(found[held, :2], pixels[held, 0], atol=0.0051)
        inside = ((pixels[:, 0] >= -0.5) & (pixels[:, 0] <= np.array([camera.width, camera.height]) - 0.5)).all(axis=1)
        assert (held == inside).all()
        assert not found[~held].any()
        compared += int(held.sum())
    assert compared > 100


def test_categories_tell_their_keypoints_and_edges(written: Callable[..., Path]) -> None:
    own = (Keypoint('nose "front"', (0.5, 0.0, 0.0)), Keypoint("tail", (-0.5, 0.0, 0.0)))
    document = json.loads(written(own).read_bytes())
    usual, named = document["categories"]
    assert usual["keypoints"] == ["centre", *(f"corner {i}" for i in range(8))]
    # Counted from 1, the centre being the first.
    assert usual["skeleton"] == [[i + 2, j + 2] for i, j in EDGES.tolist()]
    assert len(usual["skeleton"]) == 12
    assert (named["keypoints"], named["skeleton"]) == (['nose "front"', "tail"], [])
    for annotation in document["annotations"]:
        points = np.array(annotation["keypoints"]).reshape(-1, 3)
        assert len(points) == {1: 9, 2: 2}[annotation["category_id"]]
        assert annotation["num_keypoints"] == (points[:, 2] > 0).sum()
