"""Labels and predictions as columns: what is read from files, or filled by a program, and scored."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int

from ars_web.errors import BadInput


@dataclass(frozen=True)
class TruthImage:
    """An image that has labels, or none of what is looked for.

    Attributes:
        name: its path or name as the truth has it.
        size: width and height in pixels; None: not known.
        file: where its pixels are; None: they are not there.
        coco_id: its id in a COCO file, its number in a CVAT video; None in other formats.
    """

    name: str
    size: tuple[int, int] | None = None
    file: Path | None = None
    coco_id: int | None = None


@dataclass(frozen=True, eq=False)
class Truth:
    """The labels that predictions are judged by.

    Attributes:
        source: where they come from, for messages.
        classes: names, no two alike.
        images: those without a label included.
        image, class_: (n,) each label's place in `images` and in `classes`.
        bbox: (n, 4) x0, y0, x1, y1, image coordinates; shares of width and height where `in_pixels` is False.
        ignored: (n,) labels that count for nothing, neither found nor missed.
        crowd: (n,) ignored ones that stand for many objects: any number of predictions may lie in them.
        area: (n,) by which labels are small, medium or large, square pixels.
        in_pixels: False where no image's size is known.
        numbers: each class's number in files that have no names, and `category_ids` in COCO results; None: the truth
            does not say.
        split: which part was read; None: the whole.
        warnings: what is odd, and what to do.
    """

    source: str
    classes: tuple[str, ...]
    images: tuple[TruthImage, ...]
    image: Int[np.ndarray, " n"]
    class_: Int[np.ndarray, " n"]
    bbox: Float[np.ndarray, "n 4"]
    ignored: Bool[np.ndarray, " n"]
    crowd: Bool[np.ndarray, " n"]
    area: Float[np.ndarray, " n"]
    in_pixels: bool = True
    numbers: tuple[int, ...] | None = None
    category_ids: tuple[int, ...] | None = None
    format: str = "own"
    split: str | None = None
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Predictions:
    """What one detector found.

    Attributes:
        name: what it is called in tables.
        image, class_: (n,) places in the truth's `images` and `classes`.
        bbox: (n, 4) as the truth's.
        score: (n,) within [0, 1], the surer the higher.
        source: where they come from, for messages.
        warnings: what is odd, and what to do.
    """

    name: str
    image: Int[np.ndarray, " n"]
    class_: Int[np.ndarray, " n"]
    bbox: Float[np.ndarray, "n 4"]
    score: Float[np.ndarray, " n"]
    source: str = "predictions"
    format: str = "own"
    warnings: tuple[str, ...] = ()


def check_truth(truth: Truth) -> None:
    """Refuse labels that cannot be scored.

    Raises:
        BadInput: columns of different lengths, places that are not there, rectangles that are none, or no label at all.
    """
    count = len(truth.bbox)
    _check_columns(
        truth.source,
        count,
        image=truth.image,
        class_=truth.class_,
        ignored=truth.ignored,
        crowd=truth.crowd,
        area=truth.area,
    )
    _check_places(truth.source, truth, truth.image, truth.class_, truth.bbox)
    if not truth.images:
        raise BadInput(f"{truth.source} holds no image; there is nothing to score")
    if truth.ignored.all():
        what = f"holds no label in its {len(truth.images)} images"
        what = what if count == 0 else f"holds {count} labels, all of them ignored (crowds, difficult)"
        raise BadInput(f"{truth.source} {what}; nothing can be found there, so nothing can be scored")
    if (truth.crowd & ~truth.ignored).any():
        raise BadInput(f"{truth.source}: a crowd is not ignored; what stands for many objects cannot be found once")


def check_predictions(found: Predictions, truth: Truth) -> None:
    """Refuse predictions that cannot be scored.

    Raises:
        BadInput: as of labels, or a score that is not within [0, 1].
    """
    source = f"{found.source} ({found.name})"
    _check_columns(source, len(found.bbox), image=found.image, class_=found.class_, score=found.score)
    _check_places(source, truth, found.image, found.class_, found.bbox)
    wrong = np.flatnonzero(~((found.score >= 0) & (found.score <= 1)))
    if len(wrong):
        raise BadInput(f"{source}: prediction {wrong[0]}: the score {found.score[wrong[0]]:g} is not between 0 and 1")


def _check_columns(source: str, count: int, **columns: np.ndarray) -> None:
    for name, column in columns.items():
        if column.shape != (count,):
            raise BadInput(f"{source}: {name} has shape {column.shape}; there are {count} rectangles")


def _check_places(source: str, truth: Truth, image: np.ndarray, class_: np.ndarray, bbox: np.ndarray) -> None:
    for what, places, count in (("image", image, len(truth.images)), ("class", class_, len(truth.classes))):
        wrong = np.flatnonzero((places < 0) | (places >= count))
        if len(wrong):
            raise BadInput(f"{source}: rectangle {wrong[0]}: there is no {what} {places[wrong[0]]}; there are {count}")
    wrong = np.flatnonzero(~(np.isfinite(bbox).all(axis=1) & (bbox[:, 2:] >= bbox[:, :2]).all(axis=1)))
    if len(wrong):
        shown = ", ".join(f"{value:g}" for value in bbox[wrong[0]])
        raise BadInput(f"{source}: rectangle {wrong[0]}: {shown} is not x0, y0, x1, y1 with x0 <= x1 and y0 <= y1")
