"""Truths and predictions for the tests: a tiny one, worked by hand, and large ones at random."""

from collections.abc import Sequence

import numpy as np
import pytest

from ars_web.evaluation.detections import Predictions, Truth, TruthImage

Row = tuple[int, int, Sequence[float]]


def truth_of(
    rows: Sequence[Row],
    *,
    classes: Sequence[str] = ("A", "B"),
    images: int = 2,
    ignored: Sequence[int] = (),
    crowd: Sequence[int] = (),
) -> Truth:
    """Labels as (image, class, rectangle); places of those that are ignored, and of those that are crowds, too."""
    bbox = np.array([row[2] for row in rows], dtype=np.float64).reshape(-1, 4)
    places = np.arange(len(rows))
    return Truth(
        "truth",
        tuple(classes),
        tuple(TruthImage(f"{i:04d}.jpg", (640, 480)) for i in range(images)),
        np.array([row[0] for row in rows], dtype=np.int64),
        np.array([row[1] for row in rows], dtype=np.int64),
        bbox,
        np.isin(places, [*ignored, *crowd]),
        np.isin(places, list(crowd)),
        (bbox[:, 2:] - bbox[:, :2]).prod(axis=1),
        numbers=tuple(range(len(classes))),
    )


def predictions_of(rows: Sequence[tuple[int, int, Sequence[float], float]], name: str = "detector") -> Predictions:
    """Predictions as (image, class, rectangle, score)."""
    return Predictions(
        name,
        np.array([row[0] for row in rows], dtype=np.int64),
        np.array([row[1] for row in rows], dtype=np.int64),
        np.array([row[2] for row in rows], dtype=np.float64).reshape(-1, 4),
        np.array([row[3] for row in rows], dtype=np.float64),
    )


@pytest.fixture(scope="session")
def make_truth():
    return truth_of


@pytest.fixture(scope="session")
def make_predictions():
    return predictions_of


@pytest.fixture(scope="session")
def tiny(make_truth, make_predictions) -> tuple[Truth, Predictions]:
    """Two images with two labels of A and one of B; what a detector found, by falling score:

    0.90  A in image 0, where it is                        overlap 1
    0.80  A in image 0, where nothing is
    0.70  A in image 1, 8.2 of 10 high                     overlap 82 / 100 = 0.82
    0.65  B in image 0, where A is
    0.60  B in image 1, 6.2 of 10 high                     overlap 62 / 100 = 0.62
    """
    truth = make_truth([(0, 0, (0, 0, 10, 10)), (1, 0, (0, 0, 10, 10)), (1, 1, (20, 20, 30, 30))])
    found = make_predictions(
        [
            (0, 0, (0, 0, 10, 10), 0.9),
            (0, 0, (50, 50, 60, 60), 0.8),
            (1, 0, (0, 0, 10, 8.2), 0.7),
            (0, 1, (0, 0, 10, 10), 0.65),
            (1, 1, (20, 20, 30, 26.2), 0.6),
        ]
    )
    return truth, found


@pytest.fixture(scope="session")
def crowded(make_truth, make_predictions) -> tuple[Truth, Predictions]:
    """A set on which every rule matters: whole pixels, so that overlaps are equal and on thresholds; few scores, so
    that they tie; crowds and ignored labels; an image with more predictions of a class than COCO looks at; a class that
    is never labelled, and one that is never found."""
    random = np.random.default_rng(7)
    rows: list[Row] = []
    found: list[tuple[int, int, Sequence[float], float]] = []
    for image in range(40):
        for _ in range(int(random.integers(0, 9))):
            x, y = random.integers(0, 400, 2)
            w, h = random.integers(4, 140, 2)
            class_ = int(random.choice([0, 1, 2, 4]))
            rows.append((image, class_, (x, y, x + w, y + h)))
            for _ in range(int(random.integers(0, 4))):
                dx, dy, dw, dh = random.integers(-3, 4, 4)
                guess = class_ if random.uniform() < 0.9 else int(random.integers(0, 4))
                if guess != 4:
                    box = (x + dx, y + dy, x + dx + max(w + dw, 1), y + dy + max(h + dh, 1))
                    found.append((image, guess, box, round(float(random.uniform()), 1)))
    for _ in range(130):
        x, y = random.integers(0, 400, 2)
        found.append((3, 0, (x, y, x + 40, y + 40), round(float(random.uniform()), 1)))
    order = random.permutation(len(found))
    places = random.permutation(len(rows))
    truth = make_truth(
        rows,
        classes=("a", "b", "c", "never labelled", "never found"),
        images=40,
        ignored=places[:12],
        crowd=places[6:16],
    )
    return truth, make_predictions([found[i] for i in order])
