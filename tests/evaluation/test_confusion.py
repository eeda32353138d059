"""Which classes are taken for which, and where."""

import pytest

from ars_web.evaluation.mistakes import images_by_mistakes, sizes
from ars_web.evaluation.scoring import evaluate


@pytest.fixture
def mixed(make_truth, make_predictions):
    """In image 0 an A that is called B, in image 1 one that is called both, in image 2 a B that is missed."""
    truth = make_truth(
        [(0, 0, (0, 0, 10, 10)), (1, 0, (0, 0, 10, 10)), (2, 1, (0, 0, 40, 40)), (3, 1, (0, 0, 40, 40))], images=4
    )
    found = make_predictions(
        [
            (0, 1, (0, 0, 10, 10), 0.9),
            (1, 0, (0, 0, 10, 10), 0.9),
            (1, 1, (0, 0, 10, 10), 0.9),
            (2, 0, (100, 0, 110, 10), 0.9),
            (3, 1, (0, 0, 40, 40), 0.9),
            (3, 1, (0, 0, 40, 40), 0.1),
        ]
    )
    return truth, evaluate(truth, [found], coco=False).detectors[0]


def test_what_is_right_stays_right_and_the_rest_are_pairs(mixed) -> None:
    # The A of image 1 is found by an A, so the B on it is a prediction of nothing.
    assert mixed[1].confusion.tolist() == [[1, 1, 0], [0, 1, 1], [1, 1, 0]]


def test_the_diagonal_and_the_sums_are_the_counts(crowded) -> None:
    truth, found = crowded
    detector = evaluate(truth, [found], coco=False).detectors[0]
    matrix = detector.confusion
    for place, one in enumerate(detector.classes):
        assert matrix[place, place] == one.counts.tp
        assert matrix[place].sum() == one.labels
        assert matrix[:, place].sum() == one.counts.tp + one.counts.fp
    assert matrix[:-1, :-1].sum() > detector.counts.tp


def test_images_come_by_their_mistakes(mixed) -> None:
    order = [(one.image, one.tp, one.fp, one.fn) for one in images_by_mistakes(*mixed)]
    assert order == [(0, 0, 1, 1), (2, 0, 1, 1), (1, 1, 1, 0), (3, 1, 0, 0)]


def test_labels_are_counted_by_their_size(mixed) -> None:
    counted = sizes(*mixed)
    # Sides of 10 and of 40: 2 ** 3 = 8 to 11.3, and 2 ** 5 = 32 to 45.3.
    assert counted.edges == pytest.approx([2 ** (i / 2) for i in range(6, 12)])
    assert counted.found.tolist() == [1, 0, 0, 0, 1]
    assert counted.missed.tolist() == [1, 0, 0, 0, 1]
