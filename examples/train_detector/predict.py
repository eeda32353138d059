"""What a trained detector finds in a split of an exported set, as COCO results.

    python -m examples.train_detector.predict desk.pt datasets/desk --split val --out predictions.json

`ars-web evaluate` reads them.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import torch

from ars_web.errors import ArsError, BadInput
from examples.train_detector.dataset import Dataset, load_image, read_dataset
from examples.train_detector.network import Detector, load
from examples.train_detector.results import Result, write_results
from examples.train_detector.targets import decode
from examples.train_detector.train import as_input

LEAST_SCORE = 0.02
"""Fainter boxes are not written: they come after all others, where they change no curve that is looked at."""

BATCH = 16


def predict(detector: Detector, dataset: Dataset, *, size: tuple[int, int]) -> list[Result]:
    """What the detector finds in the images of a set, in their order; its classes are the set's."""
    results: list[Result] = []
    pictures = dataset.pictures
    for first in range(0, len(pictures), BATCH):
        some = pictures[first : first + BATCH]
        with torch.inference_mode():
            heat, sides = detector(as_input(np.stack([load_image(picture.file, size=size) for picture in some])))
        planes = zip(some, torch.sigmoid(heat).numpy(), sides.numpy(), strict=True)
        for picture, own_heat, own_sides in planes:
            found = decode(own_heat, own_sides, least=LEAST_SCORE)
            boxes = found.boxes / (size * 2) * (_size_of(picture.file) * 2)
            for (x0, y0, x1, y1), class_, score in zip(boxes.tolist(), found.classes, found.scores, strict=True):
                bbox = (round(x0, 2), round(y0, 2), round(x1 - x0, 2), round(y1 - y0, 2))
                category = dataset.categories[class_]
                results.append(Result(image_id=picture.id, category_id=category, bbox=bbox, score=round(score, 4)))
    return results


def _size_of(file: Path) -> tuple[int, int]:
    height, width = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE).shape
    return width, height


def main(arguments: Sequence[str] | None = None) -> int:
    """The command line."""
    parser = argparse.ArgumentParser(description="Find objects in a split of a set exported as coco or yolo.")
    parser.add_argument("weights", type=Path, help="the file that train.py wrote")
    parser.add_argument("dataset", type=Path, help="the folder that ars-web export wrote")
    parser.add_argument("--split", default="val", help="which split to look at")
    parser.add_argument("--out", type=Path, required=True, help="the JSON file that is written")
    asked = parser.parse_args(arguments)
    try:
        detector, class_names, size = load(asked.weights)
        dataset = read_dataset(asked.dataset, split=asked.split)
        if class_names != dataset.class_names:
            known, held = ", ".join(class_names), ", ".join(dataset.class_names)
            raise BadInput(f"{asked.weights} finds {known}, and {asked.dataset} has {held}; train on such a set")
        results = predict(detector, dataset, size=size)
        write_results(results, asked.out)
    except ArsError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    print(f"{len(results)} boxes in {len(dataset.pictures)} images")
    print(f"results   {asked.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
