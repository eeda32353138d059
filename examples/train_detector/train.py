"""Train the small detector on an exported set.

    python -m examples.train_detector.train datasets/desk --out desk.pt

The same set, options and number of threads give the same weights on the same machine.
"""

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import torch
from jaxtyping import Float, Int, UInt8

from ars_web.errors import ArsError, BadInput
from examples.train_detector.dataset import Dataset, load_image, read_dataset
from examples.train_detector.network import Detector, heat_loss, save, sides_loss
from examples.train_detector.targets import STRIDE, encode

LEAST_LEFT = 0.4
"""Share of a box that is still in a shifted image; one with less is no label any more."""


@dataclass(frozen=True)
class Options:
    """How to train.

    Attributes:
        size: width and height that images are scaled to, multiples of 4.
        iterations: steps of the optimiser.
        batch: images a step.
        rate: the highest learning rate.
        seed: of the first weights, the order of images and how they are changed.
        threads: that PyTorch uses.
    """

    size: tuple[int, int] = (160, 120)
    iterations: int = 400
    batch: int = 16
    rate: float = 4e-3
    seed: int = 0
    threads: int = 1

    def __post_init__(self) -> None:
        """Raises BadInput for what cannot be."""
        if any(side < 16 or side % STRIDE for side in self.size):
            raise BadInput(f"width and height must be multiples of {STRIDE}, 16 at least, not {self.size}")
        for name in ("iterations", "batch", "threads"):
            if getattr(self, name) < 1:
                raise BadInput(f"{name} must be at least 1, not {getattr(self, name)}")


def train(dataset: Dataset, options: Options, *, tell: Callable[[int, float], None] | None = None) -> Detector:
    """A detector trained on a set; `tell` is given the steps done and the loss, some twenty times."""
    torch.set_num_threads(options.threads)
    torch.manual_seed(options.seed)
    rng = np.random.default_rng(options.seed)
    images = np.stack([load_image(picture.file, size=options.size) for picture in dataset.pictures])
    count = len(dataset.class_names)
    detector = Detector(count).to(memory_format=torch.channels_last).train()
    optimiser = torch.optim.AdamW(detector.parameters(), lr=options.rate, weight_decay=0.02)
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimiser, options.rate, total_steps=options.iterations, pct_start=0.15
    )
    order = _order(len(images), options.iterations * options.batch, rng)
    for step in range(options.iterations):
        drawn = [
            _changed(images[i], dataset.pictures[i].boxes * (options.size * 2), dataset.pictures[i].classes, rng)
            for i in order[step * options.batch : (step + 1) * options.batch]
        ]
        wanted = [encode(boxes, classes, count=count, size=options.size) for _, boxes, classes in drawn]
        heat, sides = detector(as_input(np.stack([image for image, _, _ in drawn])))
        loss = heat_loss(heat, torch.from_numpy(np.stack([one.heat for one in wanted]))) + 2 * sides_loss(
            sides,
            torch.from_numpy(np.stack([one.sides for one in wanted])),
            torch.from_numpy(np.stack([one.weights for one in wanted])),
        )
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(detector.parameters(), 10.0)
        optimiser.step()
        schedule.step()
        if tell is not None and ((step + 1) % max(options.iterations // 20, 1) == 0):
            tell(step + 1, loss.item())
    return detector.eval()


def as_input(images: Float[np.ndarray, "n h w 3"]) -> torch.Tensor:
    """Images, values 0 to 255, as the network takes them."""
    planes = torch.from_numpy(np.ascontiguousarray(images, dtype=np.float32)).permute(0, 3, 1, 2)
    return (planes / 127.5 - 1).contiguous(memory_format=torch.channels_last)


def _order(images: int, wanted: int, rng: np.random.Generator) -> Int[np.ndarray, "wanted"]:
    """Every image once in random order, then again."""
    return np.concatenate([rng.permutation(images) for _ in range(-(-wanted // images))])[:wanted]


def _changed(
    image: UInt8[np.ndarray, "h w 3"],
    boxes: Float[np.ndarray, "k 4"],
    classes: Int[np.ndarray, "k"],
    rng: np.random.Generator,
) -> tuple[Float[np.ndarray, "h w 3"], Float[np.ndarray, "k 4"], Int[np.ndarray, "k"]]:
    """An image a little larger or smaller, shifted, brighter or darker, with its boxes. Never mirrored: a mirrored
    object may be another one."""
    height, width = image.shape[:2]
    scale = float(np.exp(rng.uniform(-0.22, 0.22)))
    shift = rng.uniform(-0.12, 0.12, 2) * (width, height) + (1 - scale) / 2 * np.array([width, height])
    light = rng.uniform(0.75, 1.25) * rng.uniform(0.93, 1.07, 3)
    # Image coordinates are the pixels' indices and a half.
    offset = shift + (scale - 1) / 2
    matrix = np.array([[scale, 0, offset[0]], [0, scale, offset[1]]])
    moved = cv2.warpAffine(image, matrix, (width, height), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT_101)
    bright = np.clip(moved * light + rng.uniform(-12, 12), 0, 255).astype(np.float32)
    whole = boxes * scale + np.tile(shift, 2)
    cut = np.clip(whole, 0, [width, height] * 2)
    sides, left = whole[:, 2:] - whole[:, :2], cut[:, 2:] - cut[:, :2]
    kept = left.prod(axis=1) >= LEAST_LEFT * sides.prod(axis=1)
    return bright, cut[kept], classes[kept]


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.partition("x")
    return int(width), int(height)


def main(arguments: Sequence[str] | None = None) -> int:
    """The command line."""
    usual = Options()
    parser = argparse.ArgumentParser(description="Train a small detector on a set exported as coco or yolo.")
    parser.add_argument("dataset", type=Path, help="the folder that ars-web export wrote")
    parser.add_argument("--out", type=Path, required=True, help="the file that the weights are written to")
    parser.add_argument("--split", default="train", help="which split to train on")
    parser.add_argument("--size", type=_size, default=usual.size, help="WIDTHxHEIGHT that images are scaled to")
    parser.add_argument("--iterations", type=int, default=usual.iterations, help="steps of the optimiser")
    parser.add_argument("--batch", type=int, default=usual.batch, help="images a step")
    parser.add_argument("--seed", type=int, default=usual.seed, help="another number trains another way")
    asked = parser.parse_args(arguments)
    try:
        options = Options(size=asked.size, iterations=asked.iterations, batch=asked.batch, seed=asked.seed)
        dataset = read_dataset(asked.dataset, split=asked.split)
        labels = sum(len(picture.classes) for picture in dataset.pictures)
        print(f"{len(dataset.pictures)} images, {labels} labels of {', '.join(dataset.class_names)}")
        begun = time.perf_counter()

        def tell(done: int, loss: float) -> None:
            taken = time.perf_counter() - begun
            print(f"{done:5d} of {options.iterations}  loss {loss:.3f}  {taken:.0f} s", flush=True)

        detector = train(dataset, options, tell=tell)
        save(detector, asked.out, class_names=dataset.class_names, size=options.size)
    except ArsError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    print(f"weights   {asked.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
