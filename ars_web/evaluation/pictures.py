"""Pictures of the images where a detector goes wrong most, labels and predictions drawn into them."""

from dataclasses import dataclass

import cv2
import numpy as np

from ars_web.errors import BadFile, TooLarge
from ars_web.evaluation.mistakes import ImageMistakes, images_by_mistakes
from ars_web.evaluation.scores import DetectorScore, Evaluation
from ars_web.recordings.images import read_reduced
from ars_web.reporting.jpeg import jpeg

WIDTH = 520
"""Pixels that a picture is wide at most."""

COLOURS = {
    "label, found": "#009e73",
    "label, missed": "#d55e00",
    "prediction, right": "#0072b2",
    "prediction, wrong": "#cc79a7",
}
"""What is drawn, and how."""

_FINE = 4


@dataclass(frozen=True)
class Picture:
    """One image.

    Attributes:
        name: the image's.
        mistakes: what is right and wrong in it.
        jpeg: None where there is no image.
        why: there is none, in words; empty where there is one.
    """

    name: str
    mistakes: ImageMistakes
    jpeg: bytes | None
    why: str = ""


def worst_pictures(evaluation: Evaluation, detector: DetectorScore, *, most: int = 6) -> tuple[Picture, ...]:
    """The images with the most mistakes, none of those that have none."""
    worst = [one for one in images_by_mistakes(evaluation.truth, detector)[:most] if one.fp + one.fn]
    return tuple(_picture(evaluation, detector, one) for one in worst)


def _picture(evaluation: Evaluation, detector: DetectorScore, mistakes: ImageMistakes) -> Picture:
    image = evaluation.truth.images[mistakes.image]
    if image.file is None or image.size is None:
        return Picture(image.name, mistakes, None, "the image is not there")
    try:
        pixels = read_reduced(image.file, width=WIDTH)
    except (BadFile, TooLarge) as error:
        # Reports are passed on: where the images lie is nobody's business.
        return Picture(image.name, mistakes, None, str(error).replace(str(image.file), image.name))
    _draw(pixels, evaluation, detector, mistakes.image, pixels.shape[1] / image.size[0])
    return Picture(image.name, mistakes, jpeg(pixels))


def _draw(pixels: np.ndarray, evaluation: Evaluation, detector: DetectorScore, image: int, scale: float) -> None:
    truth, found = evaluation.truth, detector.predictions
    rows = np.flatnonzero((truth.image == image) & ~truth.ignored)
    for row in rows[np.argsort(~detector.is_found[rows], kind="stable")]:
        kind = "label, found" if detector.is_found[row] else "label, missed"
        _rectangle(pixels, truth.bbox[row] * scale, COLOURS[kind], 2)
        if not detector.is_found[row]:
            _text(pixels, truth.bbox[row] * scale, truth.classes[truth.class_[row]], COLOURS[kind], above=True)
    for row in np.flatnonzero((found.image == image) & detector.kept):
        if detector.matches.right[row]:
            _rectangle(pixels, found.bbox[row] * scale, COLOURS["prediction, right"], 1)
        elif detector.matches.wrong[row]:
            colour = COLOURS["prediction, wrong"]
            _rectangle(pixels, found.bbox[row] * scale, colour, 2)
            said = f"{truth.classes[found.class_[row]]} {found.score[row]:.2f}"
            _text(pixels, found.bbox[row] * scale, said, colour, above=False)


def _rectangle(pixels: np.ndarray, bbox: np.ndarray, colour: str, thickness: int) -> None:
    # Image coordinates: a pixel's centre is half a pixel beyond its index. Far outside, cv2's numbers would overflow.
    height, width = pixels.shape[:2]
    corners = np.clip(bbox - 0.5, -10, [width + 10, height + 10] * 2)
    x0, y0, x1, y1 = np.rint(corners * (1 << _FINE)).astype(int).tolist()
    cv2.rectangle(pixels, (x0, y0), (x1, y1), _bgr(colour), thickness, cv2.LINE_AA, _FINE)


def _text(pixels: np.ndarray, bbox: np.ndarray, said: str, colour: str, *, above: bool) -> None:
    # cv2's letters are ASCII.
    said = said.encode("ascii", "replace").decode()[:30]
    (wide, high), _ = cv2.getTextSize(said, cv2.FONT_HERSHEY_SIMPLEX, 0.4, 1)
    height, width = pixels.shape[:2]
    x = int(np.clip(bbox[0], 0, max(width - wide - 4, 0)))
    y = int(np.clip(bbox[1] - 2 if above else bbox[3] + high + 6, high + 4, height - 2))
    cv2.rectangle(pixels, (x, y - high - 4), (x + wide + 4, y + 2), _bgr(colour), -1)
    cv2.putText(pixels, said, (x + 2, y - 1), cv2.FONT_HERSHEY_SIMPLEX, 0.4, (255, 255, 255), 1, cv2.LINE_AA)


def _bgr(colour: str) -> tuple[int, int, int]:
    return int(colour[5:7], 16), int(colour[3:5], 16), int(colour[1:3], 16)
