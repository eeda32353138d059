"""Scoring detections beside pycocotools and supervision, on the same labels and predictions, in one run and one table.

    python benchmarks/evaluate.py [--images 10000] [--labels 10] [--classes 10] [--part 1000] [--folder DIR]

Labels and predictions are made up: three predictions for two labels, scores of three digits, so that many tie. Ours
does more than its peers, curves, VOC's averages, counts and confusions; reading is timed alone, from COCO files.
supervision gets a part of the images; its time is scaled up, and the table says so. CPU time is of the process. The
first run of ours compiles or loads its loops, and is not timed.
"""

import argparse
import tempfile
import time
from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import TypeVar

import numpy as np
import orjson

from ars_web.evaluation.coco_numbers import coco_numbers
from ars_web.evaluation.detections import Predictions, Truth, TruthImage
from ars_web.evaluation.prediction_reading import read_predictions
from ars_web.evaluation.scoring import evaluate
from ars_web.evaluation.truth_reading import read_truth

Result = TypeVar("Result")


def made_up(images: int, labels: int, classes: int) -> tuple[Truth, Predictions]:
    random = np.random.default_rng(6)
    count = images * labels
    corners = random.uniform(0, 500, (count, 2))
    bbox = np.concatenate([corners, corners + random.uniform(8, 150, (count, 2))], axis=1).round(2)
    image, class_ = np.repeat(np.arange(images), labels), random.integers(0, classes, count)
    none = np.zeros(count, dtype=bool)
    truth = Truth(
        "made up",
        tuple(f"class {i}" for i in range(classes)),
        tuple(TruthImage(f"{i:06d}.jpg", (640, 480), coco_id=i + 1) for i in range(images)),
        image,
        class_,
        bbox,
        none,
        none,
        (bbox[:, 2:] - bbox[:, :2]).prod(axis=1),
        category_ids=tuple(range(1, classes + 1)),
    )
    rows = random.permutation(np.concatenate([np.arange(count), random.integers(0, count, count // 2)]))
    moved = bbox[rows] + random.normal(0, 4, (len(rows), 4))
    moved[:, 2:] = np.maximum(moved[:, 2:], moved[:, :2] + 1)
    guess = np.where(random.uniform(size=len(rows)) < 0.9, class_[rows], random.integers(0, classes, len(rows)))
    score = random.uniform(size=len(rows)).round(3)
    return truth, Predictions("detector", image[rows], guess, moved.round(2), score)


def first_images(truth: Truth, found: Predictions, count: int) -> tuple[Truth, Predictions]:
    """Those alone."""
    labels, rows = truth.image < count, found.image < count
    names = ("image", "class_", "bbox", "ignored", "crowd", "area")
    few = replace(truth, images=truth.images[:count], **{name: getattr(truth, name)[labels] for name in names})
    columns = {name: getattr(found, name)[rows] for name in ("image", "class_", "bbox", "score")}
    return few, replace(found, **columns)


def write(truth: Truth, found: Predictions, folder: Path) -> tuple[Path, Path]:
    """Both as COCO files."""

    def sides(bbox: np.ndarray) -> list[list[float]]:
        return np.concatenate([bbox[:, :2], bbox[:, 2:] - bbox[:, :2]], axis=1).round(2).tolist()

    def rows(of: Truth | Predictions) -> list[dict[str, object]]:
        columns = zip(of.image.tolist(), of.class_.tolist(), sides(of.bbox), strict=True)
        return [{"image_id": i + 1, "category_id": c + 1, "bbox": bbox} for i, c, bbox in columns]

    labels = {
        "images": [{"id": one.coco_id, "file_name": one.name, "width": 640, "height": 480} for one in truth.images],
        "categories": [{"id": i, "name": name} for i, name in enumerate(truth.classes, start=1)],
        "annotations": [{"id": i, **row} for i, row in enumerate(rows(truth), start=1)],
    }
    results = [{**row, "score": score} for row, score in zip(rows(found), found.score.tolist(), strict=True)]
    files = folder / "instances.json", folder / "results.json"
    for file, content in zip(files, (labels, results), strict=True):
        file.write_bytes(orjson.dumps(content))
    return files


def timed(work: Callable[[], Result]) -> tuple[Result, float, float]:
    """What it answers, wall and CPU seconds."""
    wall, cpu = time.perf_counter(), time.process_time()
    result = work()
    return result, time.perf_counter() - wall, time.process_time() - cpu


def by_supervision(truth: Truth, found: Predictions, images: int) -> float:
    """mAP at 0.5:0.95 of the first images."""
    import supervision
    from supervision.metrics import MeanAveragePrecision

    def split(of: Truth | Predictions, confidence: np.ndarray | None) -> list[supervision.Detections]:
        order = np.argsort(of.image, kind="stable")
        parts = np.split(order, np.searchsorted(of.image[order], np.arange(1, len(truth.images))))
        return [
            supervision.Detections(
                xyxy=of.bbox[rows],
                class_id=of.class_[rows],
                confidence=None if confidence is None else confidence[rows],
            )
            for rows in parts[:images]
        ]

    metric = MeanAveragePrecision()
    with redirect_stdout(StringIO()):
        result = metric.update(split(found, found.score), split(truth, None)).compute()
    return float(result.map50_95)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--images", type=int, default=10_000)
    parser.add_argument("--labels", type=int, default=10)
    parser.add_argument("--classes", type=int, default=10)
    parser.add_argument("--part", type=int, default=1_000)
    parser.add_argument("--folder", type=Path)
    given = parser.parse_args()

    truth, found = made_up(given.images, given.labels, given.classes)
    part = min(given.part, given.images)
    few_truth, few = first_images(truth, found, part)
    evaluate(few_truth, [few], coco=False)
    print(f"{given.images} images, {len(truth.bbox)} labels, {len(found.bbox)} predictions, {given.classes} classes")
    print(f"{'':44}{'wall s':>9}{'CPU s':>9}{'mAP 0.5:0.95':>16}")

    def row(what: str, wall: float, cpu: float, value: float | None) -> None:
        print(f"{what:44}{wall:9.2f}{cpu:9.2f}{'' if value is None else f'{value:16.9f}'}", flush=True)

    with tempfile.TemporaryDirectory(dir=given.folder) as folder:
        labels_file, results_file = write(truth, found, Path(folder))
        read, wall, cpu = timed(lambda: read_truth(labels_file))
        row("ours, the labels read", wall, cpu, None)
        _, wall, cpu = timed(lambda: read_predictions(results_file, read))
        row("ours, the predictions read", wall, cpu, None)
    evaluation, wall, cpu = timed(lambda: evaluate(truth, [found], coco=False))
    row("ours, all of it", wall, cpu, evaluation.detectors[0].averages.coco)
    numbers, wall, cpu = timed(lambda: coco_numbers(truth, found))
    row("pycocotools", wall, cpu, numbers.ap)
    value, wall, cpu = timed(lambda: by_supervision(truth, found, part))
    scale = given.images / part
    scaled = "" if scale == 1 else f", scaled from {part} images"
    row(f"supervision{scaled}", wall * scale, cpu * scale, value if scale == 1 else None)
    if scale != 1:
        row(f"  its {part} images", wall, cpu, value)
        evaluation_of_few, wall, cpu = timed(lambda: evaluate(few_truth, [few], coco=False))
        row("  ours of those", wall, cpu, evaluation_of_few.detectors[0].averages.coco)
    print(f"difference of ours to pycocotools: {abs(evaluation.detectors[0].averages.coco - (numbers.ap or 0)):.1e}")


if __name__ == "__main__":
    main()
