"""`ars-web evaluate`: a dataset of this program, and what detectors found in it."""

import json
from pathlib import Path

import pytest

from ars_web.cli import run

TRUTH = Path(__file__).parent / "datasets" / "golden" / "coco"


@pytest.fixture
def found(tmp_path: Path) -> Path:
    """All labels of the split `val`, the last of them as the other class."""
    content = json.loads((TRUTH / "annotations" / "instances_val.json").read_text())
    results = [
        {"image_id": one["image_id"], "category_id": one["category_id"], "bbox": one["bbox"], "score": 0.9 - 0.1 * i}
        for i, one in enumerate(content["annotations"])
    ]
    results[-1]["category_id"] = 3 - results[-1]["category_id"]
    file = tmp_path / "net.json"
    file.write_text(json.dumps(results))
    return file


def evaluate(*arguments: str | Path) -> int:
    return run(["evaluate", "--truth", str(TRUTH), *map(str, arguments)])


def test_tables_are_printed(found: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert evaluate("--predictions", found) == 0
    out, err = capsys.readouterr()
    assert f"{TRUTH} (split val): 1 images, 3 labels of 2 classes (coco)" in out
    lines = [line.split() for line in out.splitlines()]
    assert ["detector", "AP", "0.5:0.95", "AP", "0.3", "AP", "0.5", "AP", "0.75", "VOC", "0.5", "VOC07", "0.5"] in lines
    # One of two cubes is right, the other is called otherwise: 51 recalls of 101; the other class is right first.
    assert ["net", *["0.752"] * 4, "0.750", "0.773"] in lines
    assert "COCO's numbers, by pycocotools" in out
    assert "net: classes; counts at score 0.800 and IoU 0.5" in out
    assert err == ""


def test_two_detectors_stand_side_by_side_under_their_names(found: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert (
        evaluate("--predictions", found, "--predictions", f"other one={found}", "--json", "--no-coco", "--iou", 0.4)
        == 0
    )
    record = json.loads(capsys.readouterr().out)
    assert [one["name"] for one in record["detectors"]] == ["net", "other one"]
    assert record["iou"] == 0.4
    first, second = record["detectors"]
    assert first["average_precision"] == second["average_precision"]
    assert first["coco"] is None
    assert first["counts"] == {
        **{"tp": 2, "fp": 0, "fn": 1, "mean_iou": 1.0, "precision": 1.0},
        **{"recall": pytest.approx(2 / 3), "f1": 0.8},
    }
    assert len(first["precision"]) == len(record["recalls"]) == 101
    assert first["images"] == [{"name": "0009.jpg", "tp": 2, "fp": 0, "fn": 1}]
    assert evaluate("--predictions", found, "--predictions", f"net={found}") == 1
    assert "two detectors are called 'net'; name them apart, as NAME=FILE" in capsys.readouterr().err


def test_a_report_is_written_into_a_folder(found: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "deep" / "report"
    assert evaluate("--predictions", found, "--out", out) == 0
    assert sorted(file.name for file in out.iterdir()) == [
        *("classes.png", "evaluation.json", "pr-classes.png", "pr.png", "report.html", "sizes.png"),
    ]
    assert json.loads((out / "evaluation.json").read_text())["detectors"][0]["name"] == "net"
    assert f"the report in {out / 'report.html'}" in capsys.readouterr().err


def test_a_path_with_an_equals_sign_is_a_path(found: Path, capsys: pytest.CaptureFixture[str]) -> None:
    odd = found.rename(found.with_name("run=3.json"))
    assert evaluate("--predictions", odd, "--json", "--no-coco") == 0
    assert json.loads(capsys.readouterr().out)["detectors"][0]["name"] == "run=3"


def test_other_splits_sizes_and_classes_can_be_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "found").mkdir()
    (tmp_path / "found" / "0000.txt").write_text("1 0.5 0.5 0.2 0.2 0.9\n")
    arguments = ["--truth", str(TRUTH.parent / "yolo"), "--predictions", str(tmp_path / "found"), "--no-coco"]
    assert run(["evaluate", *arguments, "--split", "test", "--classes", "none,cube"]) == 1
    assert "class 'none' is none of the truth's" in capsys.readouterr().err
    said = ["--split", "test", "--image-size", "64x48", "--truth-format", "yolo", "--format", "yolo"]
    assert run(["evaluate", *arguments, *said]) == 0
    assert "(split test): 1 images, 3 labels" in capsys.readouterr().out
    assert run(["evaluate", *arguments]) == 1
    assert "image '0000' is not among the truth's 1" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "status", "said"),
    [
        (["--image-size", "64"], 2, "'64' is not WIDTHxHEIGHT"),
        (["--classes", "a,,b"], 2, "has an empty item"),
        (["--iou", "1.5"], 1, "iou must be above 0 and at most 1, not 1.5"),
        (["--split", "all", "--format", "csv"], 1, "the header has no image, class"),
        (["--truth-format", "voc"], 1, "holds no Annotations"),
        (["--predictions", "nothing.json"], 1, "nothing.json: is missing"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(
    found: Path, options: list[str], status: int, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert evaluate("--predictions", found, *options) == status
    out, err = capsys.readouterr()
    assert out == ""
    assert said in err
    assert "Traceback" not in err
