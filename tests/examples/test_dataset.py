"""Exported sets as the trainer reads them: the same images and boxes from both formats, and errors that say what is."""

import json
from pathlib import Path

import numpy as np
import pytest

from ars_web.errors import BadFile, BadInput
from examples.train_detector.dataset import load_image, read_dataset

SETS = ("coco", "yolo")


@pytest.mark.parametrize("name", SETS)
def test_a_split_is_read_with_its_images_and_boxes(exported: Path, name: str) -> None:
    read = read_dataset(exported / name, split="train")
    held = json.loads((exported / name / "dataset.json").read_bytes())
    assert read.class_names == tuple(one["name"] for one in held["classes"])
    assert len(read.pictures) == held["splits"]["train"]["images"]
    boxes = np.concatenate([picture.boxes for picture in read.pictures])
    assert len(boxes) == held["splits"]["train"]["labels"]
    assert (np.abs(boxes - 0.5) <= 0.5 + 1e-6).all()  # YOLO's six decimals
    assert load_image(read.pictures[0].file, size=(64, 48)).shape == (48, 64, 3)


def test_both_formats_say_the_same(exported: Path) -> None:
    coco, yolo = (read_dataset(exported / name, split="val") for name in SETS)
    assert [picture.file.stem for picture in coco.pictures] == [picture.file.stem for picture in yolo.pictures]
    for one, other in zip(coco.pictures, yolo.pictures, strict=True):
        assert one.classes.tolist() == other.classes.tolist()
        assert one.boxes == pytest.approx(other.boxes, abs=1e-4)
    assert coco.categories == tuple(range(1, 6))
    assert yolo.categories == yolo.class_names


def test_images_without_objects_are_there(exported: Path) -> None:
    read = [read_dataset(exported / name, split=split) for name in SETS for split in ("train", "val")]
    assert any(len(picture.boxes) == 0 for dataset in read for picture in dataset.pictures)


def test_an_image_keeps_its_colours(tmp_path: Path) -> None:
    import cv2

    cv2.imwrite(str(tmp_path / "red.png"), np.full((4, 4, 3), (0, 0, 250), dtype=np.uint8))
    assert load_image(tmp_path / "red.png", size=(2, 2))[0, 0].tolist() == [250, 0, 0]


def test_what_is_no_dataset_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="no dataset of the formats coco or yolo"):
        read_dataset(tmp_path, split="train")


@pytest.mark.parametrize("name", SETS)
def test_a_split_that_is_not_there_is_refused(exported: Path, name: str) -> None:
    with pytest.raises(BadInput, match=r"no such split|has no images"):
        read_dataset(exported / name, split="test")


def test_an_image_that_is_none_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.jpg").write_bytes(b"no image")
    with pytest.raises(BadFile, match=r"a\.jpg: cannot be read as an image"):
        load_image(tmp_path / "a.jpg", size=(8, 8))


@pytest.mark.parametrize(
    ("content", "said"),
    [("{", "is no JSON"), ("{}", "is not COCO"), ('{"images": 1, "annotations": [], "categories": []}', "is not COCO")],
)
def test_a_damaged_coco_file_is_refused(tmp_path: Path, content: str, said: str) -> None:
    (tmp_path / "annotations").mkdir()
    (tmp_path / "annotations" / "instances_train.json").write_text(content)
    with pytest.raises(BadFile, match=said):
        read_dataset(tmp_path, split="train")


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("0 0.5 0.5 0.1", r"a\.txt:1: is no 'class cx cy w h'"),
        ("7 0.5 0.5 0.1 0.1", r"a\.txt:1: is no 'class cx cy w h' of 1 classes"),
        ("0 0.5 half 0.1 0.1", "is no number"),
        (None, r"a\.txt: is missing"),
    ],
)
def test_a_damaged_yolo_label_is_refused(tmp_path: Path, line: str | None, said: str) -> None:
    (tmp_path / "data.yaml").write_text("path: .\n")
    (tmp_path / "dataset.json").write_text('{"classes": [{"name": "cube"}]}')
    for folder in ("images", "labels"):
        (tmp_path / folder / "train").mkdir(parents=True)
    (tmp_path / "images" / "train" / "a.jpg").write_bytes(b"")
    if line is not None:
        (tmp_path / "labels" / "train" / "a.txt").write_text(line)
    with pytest.raises(BadFile, match=said):
        read_dataset(tmp_path, split="train")
