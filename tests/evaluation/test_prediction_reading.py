"""Predictions read, in every format against every layout of truth, and what is wrong with them."""

import csv
import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ars_web import evaluation
from ars_web.errors import BadFile, BadInput
from ars_web.evaluation import prediction_reading, scoring, truth_reading
from ars_web.evaluation.detections import Predictions, Truth
from ars_web.evaluation.prediction_reading import read_predictions
from ars_web.evaluation.scoring import evaluate
from ars_web.evaluation.truth_reading import read_truth

GOLDEN = Path(__file__).parents[1] / "datasets" / "golden"
SIZE = (64, 48)
CLASSES = ("cube", 'a "tall" & <odd> one: #1')


def write_coco(truth: Truth, path: Path) -> Path:
    results: list[dict] = []
    for image, class_, bbox in zip(truth.image, truth.class_, truth.bbox.tolist(), strict=True):
        one = truth.images[image]
        results.append(
            {
                "image_id": one.name if one.coco_id is None else one.coco_id,
                "category_id": int(class_) if truth.category_ids is None else truth.category_ids[class_],
                "bbox": [bbox[0], bbox[1], bbox[2] - bbox[0], bbox[3] - bbox[1]],
                "score": 0.75,
            }
        )
    path.write_text(json.dumps(results, indent=1))
    return path


def write_csv(truth: Truth, path: Path) -> Path:
    with path.open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow("score,image,class,x0,y0,x1,y1,ignored column".split(","))
        for image, class_, bbox in zip(truth.image, truth.class_, truth.bbox.tolist(), strict=True):
            rows.writerow([0.75, truth.images[image].name, truth.classes[class_], *bbox, "x"])
    return path


def write_yolo(truth: Truth, path: Path) -> Path:
    path.mkdir()
    for place, image in enumerate(truth.images):
        rows = []
        for row in np.flatnonzero(truth.image == place):
            size = (image.size if truth.in_pixels else None) or (1, 1)
            shares = truth.bbox[row] / np.array([*size, *size])
            centre, side = (shares[:2] + shares[2:]) / 2, shares[2:] - shares[:2]
            rows.append(f"{truth.class_[row]} {' '.join(map(repr, map(float, [*centre, *side])))} 0.75\n")
        (path / f"{Path(image.name).stem}.txt").write_text("".join(rows))
    return path


WRITERS: dict[str, Callable[[Truth, Path], Path]] = {"coco": write_coco, "csv": write_csv, "yolo": write_yolo}


@pytest.mark.parametrize("format_", WRITERS)
@pytest.mark.parametrize("kind", ["coco", "yolo", "yolo-seg", "yolo-pose", "yolo-obb", "voc", "cvat", "ars"])
def test_labels_as_predictions_are_all_right(tmp_path: Path, kind: str, format_: str) -> None:
    truth = read_truth(GOLDEN / kind, split="all", image_size=SIZE)
    found = read_predictions(WRITERS[format_](truth, tmp_path / "found"), truth)
    assert found.format == format_
    taken = ["the truth is not COCO, so category_id is taken as a class's number (0: cube, 1: a "] * (kind != "coco")
    assert [line for line in found.warnings if not any(said in line for said in taken)] == []
    assert len(found.warnings) == (format_ == "coco" and kind != "coco")
    assert np.abs(np.sort(found.bbox, axis=0) - np.sort(truth.bbox, axis=0)).max() < 1e-9
    detector = evaluate(truth, [found]).detectors[0]
    averages = detector.averages
    assert detector.coco is not None
    assert (averages.coco, averages.at_30, averages.voc_50, averages.voc07_50) == (1, 1, 1, 1)
    assert detector.coco.ap == pytest.approx(1)
    assert (detector.counts.tp, detector.counts.fp, detector.counts.fn) == (12, 0, 0)
    assert detector.counts.mean_iou == pytest.approx(1)


def test_shares_meet_shares_where_no_size_is_known(tmp_path: Path) -> None:
    truth = read_truth(GOLDEN / "yolo")
    found = read_predictions(write_yolo(truth, tmp_path / "found"), truth)
    assert evaluate(truth, [found]).detectors[0].averages.coco == 1
    for write in (write_csv, write_coco):
        with pytest.raises(BadFile, match="has no images, so its labels are shares of them"):
            read_predictions(write(truth, tmp_path / write.__name__), truth)


@pytest.fixture
def truth() -> Truth:
    return read_truth(GOLDEN / "coco", split="all")


HEADER = "image,class,x0,y0,x1,y1,score\n"


def read_csv(truth: Truth, folder: Path, rows: str, header: str = HEADER) -> Predictions:
    file = folder / "found.csv"
    file.write_text(header + rows)
    return read_predictions(file, truth)


def test_images_are_named_by_path_name_or_stem(truth: Truth, tmp_path: Path) -> None:
    rows = "".join(
        f"{image},cube,1,2,3,4,0.5\n"
        for image in ("0009.jpg", "0009", "/set/images/0009.jpg", r"C:\set\0009.jpg", "val/0009")
    )
    place = [image.name for image in truth.images].index("0009.jpg")
    assert read_csv(truth, tmp_path, rows).image.tolist() == [place] * 5


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ("0009.jpg,cube,1,2,3,4\n", "2: has 6 values; the header has 7"),
        ("0009.jpg,cube,1,2,3,4,0.5\n0009.jpg,cube,1,2,x,4,0.5\n", "3: 'x' is not a finite number"),
        ("0009.jpg,cube,1,2,nan,4,0.5\n", "2: 'nan' is not a finite number"),
        ("0009.jpg,cube,1,2,1e12,4,0.5\n", "2: the rectangle 1, 2, 1e.12, 4 is not finite"),
        ("0009.jpg,cube,1,2,0,4,0.5\n", "2: the rectangle 1, 2 to 0, 4 has a negative size"),
        ("0009.jpg,cube,1,2,3,4,inf\n", "2: 'inf' is not a finite number"),
        ("0009.jpg,cube,1,2,3,4,97\n", "2: the score 97 is not between 0 and 1"),
        ("0009.jpg,cube,1,2,3,4,-0.1\n", "2: the score -0.1 is not between 0 and 1"),
        ("0009.jpg,cone,1,2,3,4,0.5\n", "2: class 'cone' is none of the truth's: cube, a "),
        ("0010.jpg,cube,1,2,3,4,0.5\n", r"2: image '0010\.jpg' is not among the truth's 4 \(0000\.jpg, .*--split"),
        ('0009.jpg,"cube,1,2,3,4,0.5\n', "2: unexpected end of data"),
    ],
)
def test_a_bad_row_is_named(truth: Truth, tmp_path: Path, rows: str, said: str) -> None:
    with pytest.raises(BadFile, match=rf"found\.csv:{said}"):
        read_csv(truth, tmp_path, rows)


def test_a_header_that_lacks_a_column_is_named(truth: Truth, tmp_path: Path) -> None:
    with pytest.raises(BadFile, match=r"found\.csv:1: the header has no class, score; it is image,class,x0"):
        read_csv(truth, tmp_path, "", "image,label,x0,y0,x1,y1,confidence\n")
    (tmp_path / "found.csv").write_bytes(HEADER.encode() + b"\xff,cube,1,2,3,4,0.5\n")
    with pytest.raises(BadFile, match="is not UTF-8"):
        read_predictions(tmp_path / "found.csv", truth)


def test_what_is_odd_is_told(truth: Truth, tmp_path: Path) -> None:
    row = "0009.jpg,cube,0.1,0.2,0.3,0.4,0.5\n"
    said = "\n".join(read_csv(truth, tmp_path, row + row + "0009.jpg,cube,0.1,0.2,0.1,0.4,0.5\n").warnings)
    assert "predictions that repeat another in everything: 1;" in said
    assert "predictions without an area: 1;" in said
    assert "no rectangle reaches beyond 1" in said
    assert "holds no prediction" in read_csv(truth, tmp_path, "").warnings[0]


RESULT = {"image_id": 1, "category_id": 1, "bbox": [1, 2, 3, 4], "score": 0.5}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"image_id": 99}, r":9: result 1: image_id 99 is not among the truth's 4"),
        ({"image_id": "0010.jpg"}, r":9: result 1: image '0010\.jpg' is not among"),
        ({"category_id": 7}, r":10: result 1: category_id 7 is none of the truth's \(1: cube, 2: .*--classes"),
        ({"category_id": "cone"}, ":10: result 1: class 'cone' is none"),
        ({"bbox": [1, 2, -3, 4]}, ":11: result 1: bbox is x, y, width and height, the last two not negative"),
        ({"bbox": [1, 2, float("nan"), 4]}, ":11: result 1: bbox is x, y, width and height"),
        ({"bbox": [float("inf"), 2, 3, 4]}, ":11: result 1: the rectangle"),
        ({"bbox": [1, 2, 3]}, ":11: result 1 bbox: "),
        ({"image_id": 9}, r":9: result 1: image_id 9 .* not the numbers in their names: 0009\.jpg is \d"),
        ({"image_id": "9"}, r":9: result 1: image '9' is not among"),
        ({"score": float("nan")}, ":12: result 1: the score nan is not between 0 and 1"),
        ({"score": 1.5}, ":12: result 1: the score 1.5 is not between 0 and 1"),
        ({"score": "high"}, ":12: result 1 score: Input should be a valid number"),
        ({"score": None}, ":12: result 1 score: "),
    ],
)
def test_a_bad_result_is_named(truth: Truth, tmp_path: Path, change: dict, said: str) -> None:
    results = [RESULT, {**RESULT, **change}]
    # One key a line, a box in one.
    text = ",\n".join(
        "{\n" + ",\n".join(f"{json.dumps(key)}: {json.dumps(value)}" for key, value in one.items()) + "\n}"
        for one in results
    )
    (tmp_path / "found.json").write_text("[\n" + text + "\n]")
    with pytest.raises(BadFile, match=r"found\.json:?" + said):
        read_predictions(tmp_path / "found.json", truth)


def test_what_a_result_lacks_is_named_with_the_line_on_which_it_begins(truth: Truth, tmp_path: Path) -> None:
    file = tmp_path / "found.json"
    for key in RESULT:
        rows = [RESULT, {**RESULT, "more": ["},{", {"bbox": 1}]}, {k: v for k, v in RESULT.items() if k != key}]
        file.write_text("[\n" + ",\n".join(map(json.dumps, rows)) + "]")
        with pytest.raises(BadFile, match=rf"found\.json:4: result 2 has no {key}; a result needs .*"):
            read_predictions(file, truth)


def test_results_as_other_programs_write_them(truth: Truth, tmp_path: Path) -> None:
    """Ids as texts or with a point, numbers as texts, masks and whatever else beside the rectangle, a UTF-8 mark."""
    file, numbered = tmp_path / "found.json", truth.images[1].coco_id
    changes = [
        {"image_id": str(numbered)},
        {"image_id": float(numbered or 0), "category_id": "1", "bbox": ["1", "2.0", 3.0, 4]},
        {"image_id": truth.images[1].name, "category_id": "cube", "segmentation": {"size": [1, 1], "counts": "0"}},
    ]
    file.write_text(json.dumps([{**RESULT, **change} for change in changes]), encoding="utf-8-sig")
    found = read_predictions(file, truth)
    assert (found.image.tolist(), found.class_.tolist()) == ([1] * 3, [0] * 3)
    assert found.bbox.tolist() == [[1, 2, 4, 6]] * 3


def test_a_table_as_spreadsheets_write_it(truth: Truth, tmp_path: Path) -> None:
    file = tmp_path / "found.csv"
    name = '"a ""tall"" & <odd> one: #1"'
    for content in (
        HEADER + f"0009.jpg,{name},1,2,3,4,0.5\n\n   \n,,,,,,\n",
        f'Score, X1, Y1, X0, Y0, Image, Class\n0.5, 3, 4, 1, 2, "0009.jpg", {name}\n',
        HEADER.replace(",", ";") + f"0009.jpg;{name};1;2;3;4;0.5\n;;;;;;\n",
        HEADER.replace(",", "\t") + f"0009.jpg\t{name}\t1\t2\t3\t4\t0.5\n",
        HEADER.replace(",", '","').replace("image", '"image').replace("score", 'score"') + f"0009,{name},1,2,3,4,.5",
    ):
        file.write_bytes(b"\xef\xbb\xbf" + content.replace("\n", "\r\n").encode())
        found = read_predictions(file, truth)
        assert (found.class_.tolist(), found.bbox.tolist(), found.score.tolist()) == ([1], [[1, 2, 3, 4]], [0.5])
    file.write_text(HEADER.replace("y1", "Y1,y1"))
    with pytest.raises(BadFile, match=r"found\.csv:1: the header has y1 twice"):
        read_predictions(file, truth)


def test_class_numbers_in_a_table_must_be_said(truth: Truth, tmp_path: Path) -> None:
    with pytest.raises(BadFile, match=r"found\.csv:2: class '1' is none .*; say by --classes what the numbers"):
        read_csv(truth, tmp_path, "0009.jpg,1,1,2,3,4,0.5\n")
    found = read_predictions(tmp_path / "found.csv", truth, class_names=CLASSES)
    assert found.class_.tolist() == [1]


def test_an_empty_file_is_named(truth: Truth, tmp_path: Path) -> None:
    for name in ("found.csv", "found.json"):
        (tmp_path / name).touch()
        with pytest.raises(BadFile, match=rf"{name}: is empty"):
            read_predictions(tmp_path / name, truth)


def test_a_file_that_is_no_list_of_results_is_named(truth: Truth, tmp_path: Path) -> None:
    file = tmp_path / "found.json"
    for content, said in (
        ("[1, 2]", "result 0 "),
        ('[{"image_id": 1}]', "result 0 has no category_id; a result needs image_id, category_id"),
        ('[{"image_id": 1', "is no JSON"),
    ):
        file.write_text(content)
        with pytest.raises(BadFile, match=said):
            read_predictions(file, truth)
    file.write_text('{"annotations": []}')
    with pytest.raises(BadInput, match="holds no predictions that are known"):
        read_predictions(file, truth)
    with pytest.raises(BadFile, match="COCO results are a JSON list"):
        read_predictions(file, truth, format="coco")
    file.write_text("[]")
    assert "holds no prediction" in read_predictions(file, truth).warnings[0]


def read_yolo(truth: Truth, folder: Path, rows: str, name: str = "0009", **options) -> Predictions:
    (folder / "found").mkdir()
    (folder / "found" / f"{name}.txt").write_text(rows)
    return read_predictions(folder / "found", truth, **options)


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ("0 0.5 0.5 0.2 0.2\n", r"0009\.txt:1: has 4 numbers after the class; .* \(save_conf\)"),
        ("0 0.5 0.5 0.2\n", r"0009\.txt:1: has 3 numbers after the class; a row is class cx cy w h confidence"),
        ("0 0.5 0.5 0.2 0.2 0.9\n5 0.5 0.5 0.2 0.2 0.9\n", r"0009\.txt:2: class 5 is none of 0: cube, 1: a "),
        ("0 0.5 0.5 0.2 -0.2 0.9\n", r"0009\.txt:1: width 0\.2 and height -0\.2 must not be negative"),
        ("0 0.5 0.5 0.2 0.2 90\n", r"0009\.txt:1: the score 90 is not between 0 and 1"),
        ("0 0.5 0.5 0.2 0.2 nan\n", r"0009\.txt:1: 'nan' is no number"),
        ("cube 0.5 0.5 0.2 0.2 0.9\n", r"0009\.txt:1: 'cube' is no class number; they are whole, from 0"),
        ("0 0.5 0.5 0.2 0.2 0.9\xff\n", r"0009\.txt:1: '0\.9.' is no number"),
        ("0 32 24 12 10 0.9\n", r"0009\.txt:1: 32 is no share of .*; divide pixels by them"),
    ],
)
def test_a_bad_row_of_yolo_is_named(truth: Truth, tmp_path: Path, rows: str, said: str) -> None:
    with pytest.raises(BadFile, match=said):
        read_yolo(truth, tmp_path, rows)


def test_a_file_of_no_image_is_named(truth: Truth, tmp_path: Path) -> None:
    with pytest.raises(BadFile, match=r"0010\.txt: image '0010' is not among the truth's 4"):
        read_yolo(truth, tmp_path, "", "0010")
    (tmp_path / "found" / "0010.txt").unlink()
    with pytest.raises(BadInput, match="holds no predictions that are known"):
        read_predictions(tmp_path / "found", truth)
    with pytest.raises(BadFile, match="holds no text file"):
        read_predictions(tmp_path / "found", truth, format="yolo")


def test_a_detectors_folder_is_taken_as_it_is(truth: Truth, tmp_path: Path) -> None:
    """Label files in labels/, beside pictures and a README."""
    (tmp_path / "run" / "labels").mkdir(parents=True)
    (tmp_path / "run" / "README.txt").write_text("by a detector")
    (tmp_path / "run" / "labels" / "0009.txt").write_text("0 0.5 0.5 0.2 0.2 0.9\r\n")
    renamed = replace(truth, images=tuple(replace(one, name=f"images/val/{one.name}") for one in truth.images))
    for name in ("0009", "val/0009"):
        target = tmp_path / "run" / "labels" / f"{name}.txt"
        target.parent.mkdir(exist_ok=True)
        (tmp_path / "run" / "labels" / "0009.txt").rename(target)
        found = read_predictions(tmp_path / "run", renamed)
        assert [renamed.images[place].name for place in found.image] == ["images/val/0009.jpg"]
    (tmp_path / "run" / "0009.txt").write_text("")
    with pytest.raises(BadFile, match=r"0009\.txt: is of the same image as .*0009\.txt; give the folder of one"):
        read_predictions(tmp_path / "run", renamed)


def test_class_numbers_can_be_said(truth: Truth, tmp_path: Path) -> None:
    found = read_yolo(truth, tmp_path, "0 0.5 0.5 0.2 0.2 0.9\n", class_names=CLASSES[::-1])
    assert found.class_.tolist() == [1]
    (tmp_path / "found" / "0009.txt").write_text("1 0.5 0.5 0.2 0.2 0.9\n")
    assert read_predictions(tmp_path / "found", truth, class_names=["-", *CLASSES]).class_.tolist() == [0]
    with pytest.raises(BadInput, match="class 'cone' is none of the truth's"):
        read_predictions(tmp_path / "found", truth, class_names=["cone"])


def test_a_truth_that_does_not_number_its_classes_says_so(tmp_path: Path) -> None:
    (tmp_path / "Annotations").mkdir()
    source = (GOLDEN / "voc" / "Annotations" / "0009.xml").read_text()
    (tmp_path / "Annotations" / "0009.xml").write_text(source)
    truth = read_truth(tmp_path)
    with pytest.raises(BadFile, match=r"0009\.txt:1: class 0: the truth \(voc\) does not number .* --classes"):
        read_yolo(truth, tmp_path, "0 0.5 0.5 0.2 0.2 0.9\n")
    found = read_predictions(tmp_path / "found", truth, class_names=CLASSES)
    assert truth.classes[found.class_[0]] == "cube"


def test_image_ids_may_be_the_numbers_that_names_are(tmp_path: Path) -> None:
    truth = read_truth(GOLDEN / "voc", split="all")
    (tmp_path / "found.json").write_text(json.dumps([{**RESULT, "image_id": 9}, {**RESULT, "image_id": "0009"}]))
    found = read_predictions(tmp_path / "found.json", truth)
    assert [truth.images[place].name for place in found.image] == ["0009.jpg", "0009.jpg"]
    (tmp_path / "found.json").write_text(json.dumps([{**RESULT, "image_id": 8}]))
    with pytest.raises(BadFile, match="image_id 8: no image's name is that number"):
        read_predictions(tmp_path / "found.json", truth)


def test_predictions_of_a_class_that_is_labelled_nowhere_are_told(truth: Truth, tmp_path: Path) -> None:
    only_cubes = truth.class_ == 0
    few = Truth(
        truth.source,
        truth.classes,
        truth.images,
        truth.image[only_cubes],
        truth.class_[only_cubes],
        truth.bbox[only_cubes],
        truth.ignored[only_cubes],
        truth.crowd[only_cubes],
        truth.area[only_cubes],
        numbers=truth.numbers,
    )
    found = read_yolo(few, tmp_path, "1 0.5 0.5 0.2 0.2 0.9\n")
    assert "predictions of 'a \"tall\" & <odd> one: #1', which is labelled nowhere: 1;" in found.warnings[0]


def test_the_packages_example_runs_as_it_is_written(truth: Truth, tmp_path: Path, monkeypatch) -> None:
    shutil.copytree(GOLDEN / "coco", tmp_path / "dataset")
    write_coco(read_truth(GOLDEN / "coco"), tmp_path / "results.json")
    monkeypatch.chdir(tmp_path)
    example = [line.strip() for line in (evaluation.__doc__ or "").splitlines() if line.startswith("    ")]
    names: dict[str, object] = {"Path": Path}
    names |= {module.__name__.rsplit(".", 1)[-1]: module for module in (prediction_reading, scoring, truth_reading)}
    for line in example[:-1]:
        exec(line, names)
    assert eval(example[-1], names) == 1


def test_what_is_not_there_or_not_known_is_named(truth: Truth, tmp_path: Path) -> None:
    with pytest.raises(BadFile, match="is missing"):
        read_predictions(tmp_path / "nothing.csv", truth)
    with pytest.raises(BadInput, match="predictions of the format 'voc' are not read; read are auto, coco, csv, yolo"):
        read_predictions(tmp_path, truth, format="voc")
