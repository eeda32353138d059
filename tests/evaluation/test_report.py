"""The page of an evaluation, its plots and pictures."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from ars_web.evaluation.detections import Predictions, Truth
from ars_web.evaluation.pictures import COLOURS, WIDTH, worst_pictures
from ars_web.evaluation.report import write_report
from ars_web.evaluation.scoring import evaluate

Case = tuple[Truth, Predictions]


@pytest.fixture
def photographed(tiny: Case, tmp_path: Path) -> Case:
    """The tiny case with its first image on the disk, grey and twice as wide as pictures are; the second is damaged."""
    first, second = tmp_path / "0000.png", tmp_path / "0001.png"
    assert cv2.imwrite(str(first), np.full((2 * WIDTH, 2 * WIDTH, 3), 128, np.uint8))
    second.write_bytes(first.read_bytes()[:2000])
    truth, found = tiny
    images = tuple(
        replace(image, file=file, size=(2 * WIDTH, 2 * WIDTH))
        for image, file in zip(truth.images, (first, second), strict=True)
    )
    truth = replace(truth, images=images, classes=("<A>", "B$_x$"), bbox=truth.bbox * 8)
    return truth, replace(found, bbox=found.bbox * 8)


def test_a_page_holds_everything_and_the_same_bytes_again(photographed: Case, tmp_path: Path) -> None:
    truth, found = photographed
    evaluation = evaluate(
        truth, [found, replace(found, name="<other> & worse", score=found.score[::-1].copy())], iou=0.75
    )
    file = tmp_path / "made" / "report.html"
    assert write_report(evaluation, file) == {file: "the report"}
    page = file.read_text()
    assert page.count("data:image/png") == 4
    assert page.count("data:image/jpeg") == 2
    assert "truncated" in page
    assert "&lt;other&gt; &amp; worse" in page
    assert "<other>" not in page
    assert "&lt;A&gt;" in page
    assert "<script" not in page
    assert "http:" not in page
    first = file.read_bytes()
    write_report(evaluation, file)
    assert file.read_bytes() == first
    assert [one.name for one in file.parent.iterdir()] == ["report.html"]


def test_a_folder_gets_the_plots_too(tiny: Case, tmp_path: Path) -> None:
    evaluation = evaluate(tiny[0], [tiny[1]], coco=False)
    written = write_report(evaluation, tmp_path / "out")
    assert sorted(file.name for file in written) == [
        "classes.png",
        "pr-classes.png",
        "pr.png",
        "report.html",
        "sizes.png",
    ]
    for file in written:
        assert file.is_file()
        if file.suffix == ".png":
            assert min(cv2.imread(str(file)).shape[:2]) > 100
    page = (tmp_path / "out" / "report.html").read_text()
    assert "by pycocotools" not in page
    assert "the image is not there" in page


def test_many_classes_have_no_matrix_but_their_confusions(tiny: Case, tmp_path: Path) -> None:
    truth, found = tiny
    truth = replace(truth, classes=tuple(f"class {i}" for i in range(40)), in_pixels=False)
    confused = replace(found, class_=np.array([7, 0, 0, 1, 1]))
    page = tmp_path / "report.html"
    write_report(evaluate(truth, [confused], coco=False), page)
    text = page.read_text()
    assert "predictions of nothing" not in text
    assert '<td>class 0</td><td>class 7</td><td class="number">1</td>' in text
    assert "Sizes of what is missed" not in text


def test_what_is_perfect_has_no_worst_images(make_truth, make_predictions, tmp_path: Path) -> None:
    truth = make_truth([(0, 0, (0, 0, 10, 10))], classes=[f"class {i}" for i in range(40)])
    write_report(evaluate(truth, [make_predictions([(0, 0, (0, 0, 10, 10), 1.0)])], coco=False), tmp_path / "a.html")
    page = (tmp_path / "a.html").read_text()
    assert "No image has a mistake." in page
    assert "No label was taken for another class." in page


def test_labels_and_predictions_are_drawn_where_they_are(photographed: Case) -> None:
    truth, found = photographed
    evaluation = evaluate(truth, [found], coco=False)
    detector = evaluation.detectors[0]
    worst = worst_pictures(evaluation, detector)
    assert [(one.name, one.mistakes.fp, one.mistakes.fn) for one in worst] == [("0000.jpg", 2, 0)]
    assert worst[0].jpeg is not None
    drawn = cv2.imdecode(np.frombuffer(worst[0].jpeg, np.uint8), cv2.IMREAD_COLOR).astype(int)
    assert drawn.shape == (WIDTH, WIDTH, 3)
    # The wrong A lies at 400 to 480 of 1040, which are shown 520 wide: its right side at 240.
    wrong = COLOURS["prediction, wrong"]
    bgr = [int(wrong[i : i + 2], 16) for i in (5, 3, 1)]
    assert np.abs(drawn[220, 239:241] - bgr).max(axis=1).min() < 40
    assert np.abs(drawn[300:, 300:] - 128).max() < 8


def test_a_picture_that_is_not_there_says_so(tiny: Case) -> None:
    evaluation = evaluate(tiny[0], [tiny[1]], coco=False)
    assert [(one.jpeg, one.why) for one in worst_pictures(evaluation, evaluation.detectors[0])] == [
        (None, "the image is not there")
    ]


def test_a_picture_that_cannot_be_read_says_so_without_where_it_lies(photographed: Case, tmp_path: Path) -> None:
    truth, found = photographed
    broken = tmp_path / "0000.jpg"
    broken.write_bytes(b"no image")
    truth = replace(truth, images=tuple(replace(one, file=broken) for one in truth.images))
    evaluation = evaluate(truth, [found], coco=False)
    (worst,) = worst_pictures(evaluation, evaluation.detectors[0])
    assert worst.jpeg is None
    assert worst.why.startswith("0000.jpg: ")
    assert str(tmp_path) not in worst.why
