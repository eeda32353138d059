"""Datasets read by the formats' own libraries and by peers: same counts, coordinates within half a pixel."""

import json
import warnings
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from pycocotools.coco import COCO

# Peers warn of their own dependencies while they are imported; warnings are errors here.
with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    import datumaro as dm
    import supervision as sv

Export = Callable[..., object]


def assert_same(found: dict[str, tuple[np.ndarray, list[int]]], expected, split: str | None = None) -> None:
    """`found` is boxes and classes by stem."""
    stems = {stem for stem, of in expected.splits.items() if split in (None, of)}
    assert set(found) == stems
    for stem in stems:
        boxes, classes = found[stem]
        assert len(boxes) == len(expected.boxes[stem])
        if len(boxes):
            assert np.abs(np.asarray(boxes) - expected.boxes[stem]).max() <= 0.5
        assert list(classes) == expected.classes[stem]


@pytest.mark.filterwarnings("ignore:__array__ implementation doesn't accept a copy:DeprecationWarning")  # its own
def test_coco_by_pycocotools(export: Export, capsys: pytest.CaptureFixture[str]) -> None:
    expected = export("coco")
    for split in ("train", "val"):
        coco = COCO(expected.folder / "annotations" / f"instances_{split}.json")
        found: dict[str, tuple[np.ndarray, list[int]]] = {}
        for image in coco.loadImgs(coco.getImgIds()):
            assert cv2.imread(str(expected.folder / "images" / image["file_name"])).shape[:2] == (
                image["height"],
                image["width"],
            )
            annotations = coco.loadAnns(coco.getAnnIds(image["id"]))
            boxes = np.array([a["bbox"] for a in annotations]).reshape(-1, 4)
            boxes[:, 2:] += boxes[:, :2]
            found[Path(image["file_name"]).stem] = boxes, [a["category_id"] - 1 for a in annotations]
            for annotation in annotations:
                # A mask of whole pixels: its area is the outline's within a pixel round it.
                area, (_, _, w, h) = coco.annToMask(annotation).sum(), annotation["bbox"]
                assert abs(area - annotation["area"]) <= 2 * (w + h) + 4
        assert_same(found, expected, split)
        assert [c["name"] for c in coco.loadCats(coco.getCatIds())] == ["cube", "tall one"]
        assert expected.report.splits[split].labels == len(coco.getAnnIds())


def test_coco_boxes_are_within_their_amodal_boxes_and_hold_their_outlines(export: Export) -> None:
    expected = export("coco")
    document = json.loads((expected.folder / "annotations" / "instances_train.json").read_bytes())
    assert document["annotations"]
    for annotation in document["annotations"]:
        x, y, w, h = annotation["bbox"]
        ax, ay, aw, ah = annotation["amodal_bbox"]
        assert ax <= x + 0.02
        assert ay <= y + 0.02
        assert ax + aw >= x + w - 0.02
        assert ay + ah >= y + h - 0.02
        ring = np.array(annotation["segmentation"][0]).reshape(-1, 2)
        assert np.abs(ring.min(axis=0) - [x, y]).max() < 0.2
        assert np.abs(ring.max(axis=0) - [x + w, y + h]).max() < 0.2
        assert annotation["area"] <= w * h + 0.01
        assert 0 <= annotation["visible"] <= 1
        assert 0 <= annotation["truncated"] <= 1


def test_yolo_by_supervision(export: Export) -> None:
    expected = export("yolo")
    for split in ("train", "val"):
        dataset = sv.DetectionDataset.from_yolo(
            images_directory_path=str(expected.folder / "images" / split),
            annotations_directory_path=str(expected.folder / "labels" / split),
            data_yaml_path=str(expected.folder / "data.yaml"),
        )
        assert dataset.classes == ["cube", "tall one"]
        found = {Path(path).stem: (d.xyxy, d.class_id.tolist()) for path, d in dataset.annotations.items()}
        assert_same(found, expected, split)


def test_voc_by_supervision(export: Export) -> None:
    expected = export("voc")
    dataset = sv.DetectionDataset.from_pascal_voc(
        images_directory_path=str(expected.folder / "JPEGImages"),
        annotations_directory_path=str(expected.folder / "Annotations"),
    )
    names = {name: number for number, name in enumerate(["cube", "tall one"])}
    found = {
        Path(path).stem: (d.xyxy, [names[dataset.classes[i]] for i in d.class_id.tolist()])
        for path, d in dataset.annotations.items()
    }
    assert_same(found, expected)


def by_datumaro(folder: Path, kind: str) -> dict[str, dict[str, tuple[np.ndarray, list[int]]]]:
    """Boxes and class names' places by stem, by subset."""
    dataset = dm.Dataset.import_from(str(folder), kind)
    labels = [label.name for label in dataset.categories()[dm.AnnotationType.label]]
    places = [["cube", "tall one"].index(name) if name in ("cube", "tall one") else -1 for name in labels]
    found: dict[str, dict[str, tuple[np.ndarray, list[int]]]] = {}
    for item in dataset:
        boxes = [a for a in item.annotations if a.type == dm.AnnotationType.bbox]
        found.setdefault(item.subset, {})[Path(item.id).name] = (
            np.array([a.points for a in boxes]).reshape(-1, 4),
            [places[a.label] for a in boxes],
        )
    return found


def test_yolo_by_datumaro(export: Export) -> None:
    expected = export("yolo")
    found = by_datumaro(expected.folder, "yolo")
    for split in ("train", "val"):
        assert_same(found[split], expected, split)


def test_voc_by_datumaro(export: Export) -> None:
    expected = export("voc")
    found = by_datumaro(expected.folder, "voc")
    for split in ("train", "val"):
        # Datumaro takes the numbers as they stand: counted from 1, the last pixel included.
        shifted = {stem: (boxes - np.array([1, 1, 0, 0]), classes) for stem, (boxes, classes) in found[split].items()}
        assert_same(shifted, expected, split)


def test_voc_flags_follow_its_guide(export: Export) -> None:
    expected = export("voc", max_truncated=1.0)
    texts = [path.read_text() for path in sorted((expected.folder / "Annotations").iterdir())]
    assert any("<occluded>1</occluded>" in text for text in texts)
    assert any("<occluded>0</occluded>" in text for text in texts)
    assert any("<truncated>1</truncated>" in text for text in texts)
    assert any("<truncated>0</truncated>" in text for text in texts)


def test_voc_lists_every_image_once(export: Export) -> None:
    expected = export("voc")
    lists = {p.stem: p.read_text().split() for p in (expected.folder / "ImageSets" / "Main").iterdir()}
    assert set(lists) == {"train", "val", "trainval"}
    assert lists["trainval"] == lists["train"] + lists["val"]
    assert sorted(lists["trainval"]) == sorted(expected.splits)
    assert dict.fromkeys(lists["val"], "val").items() <= expected.splits.items()


def test_the_original_layout_is_the_original_tools(export: Export) -> None:
    expected = export("ars")
    for i in range(12):
        name = f"{i:05d}"
        assert (expected.folder / "images" / f"{name}.jpg").is_file()
        assert (expected.folder / "ids" / f"{name}.txt").read_text() == f"recording-s1!{i:04d}.jpg\n"
        rows = (expected.folder / "labels" / f"{name}.txt").read_text().splitlines()
        assert [int(row.split()[0]) for row in rows] == expected.classes[name]
    train = (expected.folder / "train.txt").read_text().split()
    val = (expected.folder / "val.txt").read_text().split()
    assert sorted(train + val) == [f"images/{i:05d}.jpg" for i in range(12)]
    assert {f"images/{stem}.jpg" for stem, split in expected.splits.items() if split == "val"} == set(val)
