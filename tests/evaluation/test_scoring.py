"""Scores: against numbers worked by hand, against pycocotools, and against a slow oracle."""

import importlib.util
import json
from contextlib import redirect_stdout
from dataclasses import astuple, replace
from io import StringIO
from pathlib import Path

import numpy as np
import pytest

from ars_web.errors import BadInput
from ars_web.evaluation.detections import Predictions, Truth
from ars_web.evaluation.prediction_reading import read_predictions
from ars_web.evaluation.scores import Evaluation
from ars_web.evaluation.scoring import COCO_THRESHOLDS, evaluate
from ars_web.evaluation.truth_reading import read_truth

Case = tuple[Truth, Predictions]


@pytest.fixture(scope="module")
def slow():
    spec = importlib.util.spec_from_file_location("slow_scores", Path(__file__).with_name("slow_scores.py"))
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def scored(crowded: Case) -> Evaluation:
    return evaluate(crowded[0], [crowded[1]], iou=0.4)


def test_averages_of_a_case_worked_by_hand(tiny: Case) -> None:
    detector = evaluate(tiny[0], [tiny[1]]).detectors[0]
    a, b = (one.averages for one in detector.classes)
    # A at 0.5: right, wrong, right; recall 1/2, 1/2, 1 and precision 1, 1/2, 2/3. Recalls 0, 0.01 … 0.5 are 51.
    upper = (51 * 1 + 50 * 2 / 3) / 101
    assert a.at_50 == a.at_30 == a.at_75 == pytest.approx(upper, abs=1e-12)
    # The second is right up to 0.8, the 7th of ten thresholds; then recall 1/2 is all there is.
    assert a.coco == pytest.approx((7 * upper + 3 * 51 / 101) / 10, abs=1e-12)
    assert a.voc_50 == pytest.approx(1 / 2 * 1 + 1 / 2 * 2 / 3, abs=1e-12)
    # Recalls 0, 0.1 … 0.5 are 6 of 11.
    assert a.voc07_50 == pytest.approx((6 * 1 + 5 * 2 / 3) / 11, abs=1e-12)
    # B at 0.5: wrong, right; precision 1/2 at every recall. Right at 0.5, 0.55 and 0.6, never beyond.
    assert b.at_30 == b.at_50 == b.voc_50 == b.voc07_50 == pytest.approx(1 / 2, abs=1e-12)
    assert b.at_75 == 0
    assert b.coco == pytest.approx(3 / 10 * 1 / 2, abs=1e-12)
    assert detector.averages.at_50 == pytest.approx((upper + 1 / 2) / 2, abs=1e-12)
    assert detector.coco is not None
    assert detector.coco.ap_50 == pytest.approx((upper + 1 / 2) / 2, abs=1e-9)


def test_counts_of_a_case_worked_by_hand(tiny: Case) -> None:
    detector = evaluate(tiny[0], [tiny[1]]).detectors[0]
    # F1 = 2 TP / (kept + 3 labels) after each: 2/4, 2/5, 4/6, 4/7, 6/8.
    assert (detector.best.score, detector.best.f1) == (0.6, 6 / 8)
    assert (detector.counts.tp, detector.counts.fp, detector.counts.fn) == (3, 2, 0)
    assert detector.counts.precision == 3 / 5
    assert detector.counts.recall == 1
    assert detector.counts.mean_iou == pytest.approx((1 + 0.82 + 0.62) / 3, abs=1e-12)
    # Of A alone: 2/3, 2/4, 4/5. Of B alone: 0, 2/3.
    assert [(one.best.score, one.best.f1) for one in detector.classes] == [(0.7, 4 / 5), (0.6, 2 / 3)]
    assert detector.confusion.tolist() == [[2, 0, 0], [0, 1, 0], [1, 1, 0]]
    curve, scores = detector.classes[0].precision, detector.classes[0].scores
    assert curve is not None
    assert scores is not None
    assert [curve[0], curve[50], curve[51], curve[100]] == [1, 1, 2 / 3, 2 / 3]
    assert [scores[0], scores[50], scores[51], scores[100]] == [0.9, 0.9, 0.7, 0.7]


def test_a_higher_threshold_makes_misses(tiny: Case) -> None:
    detector = evaluate(tiny[0], [tiny[1]], iou=0.75).detectors[0]
    assert detector.averages.at_iou == detector.averages.at_75
    # 2/4, 2/5, 4/6, 4/7, 4/8: from 0.7 on.
    assert (detector.best.score, detector.counts.tp, detector.counts.fp, detector.counts.fn) == (0.7, 2, 1, 1)
    assert detector.confusion.tolist() == [[2, 0, 0], [0, 0, 1], [1, 0, 0]]
    assert detector.is_found.tolist() == [True, True, False]


def _by_pycocotools(truth: Truth, found: Predictions, thresholds: np.ndarray):
    from pycocotools.coco import COCO
    from pycocotools.cocoeval import COCOeval

    def rows(bbox: np.ndarray, image: np.ndarray, class_: np.ndarray) -> list[dict]:
        sides = bbox[:, 2:] - bbox[:, :2]
        return [
            {
                "id": i + 1,
                "image_id": int(image[i]),
                "category_id": int(class_[i]),
                "bbox": [*bbox[i, :2].tolist(), *sides[i].tolist()],
                "area": float(sides[i].prod()),
                "iscrowd": 0,
            }
            for i in range(len(bbox))
        ]

    with redirect_stdout(StringIO()):
        labels = COCO()
        labels.dataset = {
            "images": [{"id": i} for i in range(len(truth.images))],
            "categories": [{"id": i, "name": name} for i, name in enumerate(truth.classes)],
            "annotations": [
                {**row, "iscrowd": int(truth.ignored[i])}
                for i, row in enumerate(rows(truth.bbox, truth.image, truth.class_))
            ],
        }
        labels.createIndex()
        results = labels.loadRes(
            [{**row, "score": found.score[i]} for i, row in enumerate(rows(found.bbox, found.image, found.class_))]
        )
        evaluation = COCOeval(labels, results, "bbox")
        evaluation.params.iouThrs = thresholds
        evaluation.evaluate()
        evaluation.accumulate()
    return evaluation.eval["precision"][:, :, :, 0, 2]


def test_averages_and_curves_are_those_of_pycocotools(crowded: Case) -> None:
    truth, found = crowded
    # pycocotools knows crowds, and no label that is ignored otherwise.
    truth = replace(truth, crowd=truth.ignored)
    detector = evaluate(truth, [found], iou=0.4).detectors[0]
    thresholds = np.array([0.3, 0.4, *COCO_THRESHOLDS])
    precision = _by_pycocotools(truth, found, thresholds)
    labelled = [place for place, one in enumerate(detector.classes) if one.labels]
    assert labelled == [0, 1, 2, 4]
    for place in labelled:
        one = detector.classes[place]
        of_class = precision[:, :, place].mean(axis=1)
        ours = [one.averages.at_30, one.averages.at_iou, one.averages.at_50, one.averages.at_75, one.averages.coco]
        theirs = [of_class[0], of_class[1], of_class[2], of_class[7], of_class[2:].mean()]
        assert ours == pytest.approx(theirs, abs=1e-6)
        assert one.precision == pytest.approx(precision[1, :, place], abs=1e-6)
    assert (precision[:, :, 3] == -1).all()
    means = precision[:, :, labelled].mean(axis=(1, 2))
    assert detector.averages.at_30 == pytest.approx(means[0], abs=1e-6)
    assert detector.averages.at_50 == pytest.approx(means[2], abs=1e-6)
    assert detector.averages.coco == pytest.approx(means[2:].mean(), abs=1e-6)
    assert 0.1 < detector.averages.coco < 0.9


def test_files_are_scored_as_pycocotools_scores_them(crowded: Case, tmp_path: Path) -> None:
    """Images stand in the file in any order of ids, and categories too; of predictions of one score pycocotools takes
    first what is in the image of the lower id."""
    from pycocotools.coco import COCO
    from pycocotools.cocoeval import COCOeval

    truth, found = crowded
    random = np.random.default_rng(3)
    image_ids, class_ids = random.permutation(len(truth.images)) + 1, np.array([7, 3, 90, 4, 11])

    def rows(of: Truth | Predictions) -> list[dict[str, object]]:
        sides = np.concatenate([of.bbox[:, :2], of.bbox[:, 2:] - of.bbox[:, :2]], axis=1).tolist()
        return [
            {"image_id": int(image_ids[image]), "category_id": int(class_ids[class_]), "bbox": bbox}
            for image, class_, bbox in zip(of.image, of.class_, sides, strict=True)
        ]

    labels = {
        "images": [
            {"id": int(id_), "file_name": image.name, "width": 640, "height": 480}
            for id_, image in zip(image_ids, truth.images, strict=True)
        ],
        "categories": [{"id": int(id_), "name": name} for id_, name in zip(class_ids, truth.classes, strict=True)],
        "annotations": [
            # Of an outline, less than of the rectangle.
            {**row, "id": i, "iscrowd": int(truth.crowd[i - 1]), "area": float(truth.area[i - 1] * 0.7)}
            for i, row in enumerate(rows(truth), start=1)
        ],
    }
    results = [{**row, "score": score} for row, score in zip(rows(found), found.score.tolist(), strict=True)]
    (tmp_path / "labels.json").write_text(json.dumps(labels))
    (tmp_path / "results.json").write_text(json.dumps(results))
    with redirect_stdout(StringIO()):
        theirs = COCO(str(tmp_path / "labels.json"))
        evaluation = COCOeval(theirs, theirs.loadRes(str(tmp_path / "results.json")), "bbox")
        evaluation.evaluate()
        evaluation.accumulate()
        evaluation.summarize()
    read = read_truth(tmp_path / "labels.json")
    detector = evaluate(read, [read_predictions(tmp_path / "results.json", read)]).detectors[0]
    assert detector.coco is not None
    assert astuple(detector.coco) == pytest.approx(evaluation.stats, abs=1e-6)
    ours = (detector.averages.coco, detector.averages.at_50, detector.averages.at_75)
    assert ours == pytest.approx(evaluation.stats[:3], abs=1e-6)


def test_of_one_score_voc_takes_a_files_rows_in_their_order(make_truth, make_predictions) -> None:
    truth = make_truth([(1, 0, (0, 0, 10, 10))])
    right, wrong = (1, 0, (0, 0, 10, 10), 0.5), (0, 0, (0, 0, 10, 10), 0.5)
    for rows, expected in (([right, wrong], 1.0), ([wrong, right], 0.5)):
        averages = evaluate(truth, [make_predictions(rows)], coco=False).detectors[0].averages
        assert (averages.voc_50, averages.voc07_50) == (expected, expected)
        # COCO's rule takes the first image first, whatever the file's order.
        assert averages.at_50 == 0.5


def test_cocos_numbers_agree_with_ours_where_labels_are_ignored_without_being_crowds(scored: Evaluation) -> None:
    detector = scored.detectors[0]
    assert detector.coco is not None
    ours = (detector.averages.coco, detector.averages.at_50, detector.averages.at_75)
    assert astuple(detector.coco)[:3] == pytest.approx(ours, abs=1e-6)
    assert all(0 <= value <= 1 for value in astuple(detector.coco))


@pytest.mark.parametrize("class_", [0, 1, 2, 4])
def test_averages_are_those_of_the_slow_oracle(crowded: Case, scored: Evaluation, slow, class_: int) -> None:
    truth, found = crowded
    one = scored.detectors[0].classes[class_]
    hundred, ten = [i / 100 for i in range(101)], [i / 10 for i in range(11)]

    def coco(threshold: float) -> float:
        return slow.average_precision(slow.coco_outcomes(truth, found, class_, threshold), one.labels, hundred)

    voc = slow.voc_outcomes(truth, found, class_, 0.5)
    assert one.averages.at_30 == pytest.approx(coco(0.3), abs=1e-9)
    assert one.averages.at_75 == pytest.approx(coco(0.75), abs=1e-9)
    assert one.averages.voc_50 == pytest.approx(slow.average_precision(voc, one.labels, None), abs=1e-9)
    assert one.averages.voc07_50 == pytest.approx(slow.average_precision(voc, one.labels, ten), abs=1e-9)


def test_what_lies_in_an_ignored_label_is_neither_right_nor_wrong(make_truth, make_predictions) -> None:
    rows = [(0, 0, (0, 0, 10, 10)), (0, 0, (100, 100, 200, 200)), (1, 0, (0, 0, 10, 10))]
    in_crowd = [(0, 0, (110, 110, 120, 120), 0.9), (0, 0, (150, 150, 170, 170), 0.8)]
    found = make_predictions([*in_crowd, (1, 0, (0, 0, 10, 10), 0.7), (0, 0, (0, 0, 10, 10), 0.6)])
    detector = evaluate(make_truth(rows, crowd=[1]), [found]).detectors[0]
    # Both lie whole in the crowd, which any number may.
    assert (detector.counts.tp, detector.counts.fp, detector.counts.fn) == (2, 0, 0)
    assert detector.averages.at_50 == 1
    # Without being a crowd it overlaps neither by half: both are wrong, and first.
    detector = evaluate(make_truth(rows, ignored=[1]), [found]).detectors[0]
    assert (detector.counts.tp, detector.counts.fp, detector.counts.fn) == (2, 2, 0)


def test_two_on_one_label_count_by_the_rule(make_truth, make_predictions) -> None:
    # The surer overlaps 0.6, the other 1.
    truth = make_truth([(0, 0, (0, 0, 10, 10))], ignored=[])
    found = make_predictions([(0, 0, (0, 0, 10, 6), 0.9), (0, 0, (0, 0, 10, 10), 0.8)])
    one = evaluate(truth, [found]).detectors[0].classes[0].averages
    # At 0.5, 0.55 and 0.6 the surer has it, and AP is 1; beyond it is wrong, and comes first.
    assert one.coco == pytest.approx((3 * 1 + 7 * 0.5) / 10)
    assert one.voc_50 == 1
    # VOC excuses all that overlap a difficult label most, COCO's rule one of them.
    truth = make_truth([(0, 0, (0, 0, 10, 10)), (0, 0, (50, 50, 60, 60))], ignored=[0])
    found = make_predictions([(0, 0, (0, 0, 10, 9), 0.9), (0, 0, (0, 0, 10, 10), 0.8), (0, 0, (50, 50, 60, 60), 0.7)])
    one = evaluate(truth, [found]).detectors[0].classes[0].averages
    assert (one.at_50, one.voc_50) == (0.5, 1)


def test_a_class_never_labelled_is_in_no_mean(crowded: Case, scored: Evaluation) -> None:
    one = scored.detectors[0].classes[3]
    assert one.labels == 0
    assert one.predictions > 0
    assert set(astuple(one.averages)) == {None}
    assert one.precision is None
    of_others = [other.averages.at_50 for other in scored.detectors[0].classes if other.labels]
    assert scored.detectors[0].averages.at_50 == pytest.approx(np.mean([v for v in of_others if v is not None]))
    assert any("never labelled" in line for line in scored.warnings)


def test_a_detector_that_found_nothing_scores_nought(tiny: Case, make_predictions) -> None:
    detector = evaluate(tiny[0], [make_predictions([])]).detectors[0]
    assert detector.averages.at_50 == detector.averages.voc_50 == detector.averages.voc07_50 == 0
    assert detector.coco is not None
    assert detector.coco.ap == 0
    assert (detector.counts.tp, detector.counts.fp, detector.counts.fn) == (0, 0, 3)
    assert detector.counts.precision is None
    assert detector.counts.mean_iou is None
    assert detector.best.score == np.inf


def test_scores_that_tie_are_kept_together(make_truth, make_predictions) -> None:
    truth = make_truth([(0, 0, (0, 0, 10, 10)), (1, 0, (0, 0, 10, 10))])
    found = make_predictions([(0, 0, (0, 0, 10, 10), 0.5), (1, 0, (0, 0, 10, 10), 0.5), (0, 0, (50, 50, 60, 60), 0.5)])
    detector = evaluate(truth, [found], coco=False).detectors[0]
    # Two right ones would be F1 1; but the wrong one has their score.
    assert detector.best.f1 == 4 / 5
    assert detector.coco is None


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"score": np.array([0.9, 0.8, np.nan, 0.65, 0.6])}, "prediction 2: the score nan"),
        ({"score": np.array([0.9, 0.8, 1.7, 0.65, 0.6])}, "the score 1.7 is not between 0 and 1"),
        ({"class_": np.array([0, 0, 2, 1, 1])}, "rectangle 2: there is no class 2"),
        ({"image": np.array([0, -1, 1, 0, 1])}, "rectangle 1: there is no image -1"),
        ({"score": np.array([0.9])}, "score has shape"),
        ({"bbox": np.array([[0, 0, 10, 10]] * 4 + [[10, 0, 0, 10]], dtype=float)}, "rectangle 4: 10, 0, 0, 10"),
        ({"bbox": np.array([[0, 0, 10, 10]] * 4 + [[0, 0, np.inf, 10]], dtype=float)}, "rectangle 4: 0, 0, inf"),
    ],
)
def test_predictions_that_cannot_be_are_refused(tiny: Case, change: dict, said: str) -> None:
    with pytest.raises(BadInput, match=said):
        evaluate(tiny[0], [replace(tiny[1], **change)])


def test_what_cannot_be_scored_is_refused(tiny: Case, make_truth) -> None:
    truth, found = tiny
    with pytest.raises(BadInput, match="iou must be above 0"):
        evaluate(truth, [found], iou=0)
    with pytest.raises(BadInput, match="no predictions to score"):
        evaluate(truth, [])
    with pytest.raises(BadInput, match="two detectors are called 'detector'"):
        evaluate(truth, [found, found])
    with pytest.raises(BadInput, match="holds no label in its 2 images"):
        evaluate(make_truth([]), [found])
    with pytest.raises(BadInput, match="holds 1 labels, all of them ignored"):
        evaluate(make_truth([(0, 0, (0, 0, 1, 1))], ignored=[0]), [found])
    with pytest.raises(BadInput, match="holds no image"):
        evaluate(replace(make_truth([], images=0)), [found])
    with pytest.raises(BadInput, match="a crowd is not ignored"):
        evaluate(replace(truth, crowd=np.array([True, False, False])), [found])
