"""COCO files: what an annotation is, as a file made by hand says, and what is refused."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pycocotools import mask as coco_masks

from ars_web.annotations.registry import read_labels
from ars_web.annotations.run_masks import mask_from_columns, outline_of
from ars_web.errors import BadFile, BadInput
from ars_web.geometry.mask_regions import mask_from_polygons, region

FILE = Path(__file__).parent / "files" / "instances.json"


@pytest.fixture
def changed(tmp_path: Path) -> Callable[[Callable[[Any], object]], Path]:
    def write(change: Callable[[Any], object]) -> Path:
        content = json.loads(FILE.read_text())
        change(content)
        file = tmp_path / "instances.json"
        file.write_text(json.dumps(content))
        return file

    return write


def test_a_file_by_hand() -> None:
    found = read_labels(FILE)
    assert found.format == "coco"
    assert [(image.name, image.size) for image in found.images] == [("00000.jpg", (8, 6)), ("00001.jpg", None)]
    assert [(o.image, o.class_name, o.instance) for o in found.outlines] == [
        (0, "cup", "track_id 7"),
        (0, "book", None),
        (0, "book", "instance_id b"),
    ]
    np.testing.assert_array_equal(found.outlines[0].polygons[0].outer, [[1, 2], [4, 2], [4, 4], [1, 4]])
    (rectangle,) = found.rectangles
    assert (rectangle.image, rectangle.class_name, rectangle.bbox.tolist()) == (1, "book", [1.5, 2, 4.5, 6])
    assert [(one.where, one.reason.split(",")[0]) for one in found.left_out] == [
        ("annotation 5", "it is marked as a crowd (iscrowd)"),
        ("annotation 6", "it has neither an outline nor a rectangle"),
        ("annotation 7", "its mask is empty"),
    ]


def test_polygons_of_one_annotation_are_pieces_not_holes() -> None:
    pieces = read_labels(FILE).outlines[1].polygons
    assert region(pieces).area == pytest.approx(4 + 4 - 1)


def test_runs_go_down_the_columns() -> None:
    """Eight pixels outside are the first column and two of the second: rows 2 and 3 of columns 1 and 2 follow."""
    (polygon,) = read_labels(FILE).outlines[2].polygons
    mask = mask_from_polygons([polygon], 8, 6)
    assert mask[2:4, 1:3].all()
    assert mask.sum() == 4


@pytest.mark.parametrize("seed", range(20))
def test_masks_are_what_cocos_own_tools_wrote(seed: int) -> None:
    random = np.random.default_rng(seed)
    mask = random.random((random.integers(1, 40), random.integers(1, 400))) > random.choice([0.1, 0.6, 0.99])
    height, width = mask.shape
    written = coco_masks.encode(np.asfortranarray(mask.astype(np.uint8)))
    np.testing.assert_array_equal(mask_from_columns(written["counts"].decode(), width=width, height=height), mask)


def test_an_outline_is_where_its_mask_is() -> None:
    mask = np.zeros((400, 700), dtype=bool)
    mask[30:200, 50:600] = True
    (polygon,) = outline_of(mask)
    assert region([polygon]).bounds == (50, 30, 600, 200)
    (polygon,) = outline_of(mask[30:200, 50:600], left=50, top=30)
    assert region([polygon]).bounds == (50, 30, 600, 200)


@pytest.mark.parametrize("text", ["P", "\x00", "~~~", "0" * 10 + "n", "ooooooooooooo1", "O"])
def test_runs_that_are_none_are_refused(text: str) -> None:
    with pytest.raises(BadInput):
        mask_from_columns(text, width=8, height=6)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda c: c["annotations"][0].update(image_id=99), "annotation 1: there is no image 99"),
        (lambda c: c["annotations"][0].update(category_id=9), "annotation 1: there is no category 9"),
        (lambda c: c["annotations"][0].pop("image_id"), "annotations[0].image_id: Field required"),
        (lambda c: c["images"][0].update(id=12), "image id 12 is there twice; ids tell images apart"),
        (lambda c: c["annotations"][0].update(segmentation=[[1, 2, 3, 4]]), "three corners at least"),
        (lambda c: c["annotations"][0].update(segmentation=[[1, 2, 3, 4, 5, 6, 7]]), "x and y of each"),
        (lambda c: c["annotations"][0].update(segmentation=[[1, 2, 3, float("nan"), 5, 6]]), "a list of numbers"),
        (lambda c: c["annotations"][0].update(segmentation=[[1, 2, 3, 10**400, 5, 6]]), "a list of numbers"),
        (lambda c: c["annotations"][0].update(segmentation="x"), "a list of polygons, or a mask"),
        (lambda c: c["annotations"][3].update(bbox=[1, 2, 0, 4]), "annotation 4 in 00001.jpg: a bbox is x, y"),
        (lambda c: c["annotations"][2]["segmentation"].update(counts=[8, 2]), "add up to 10 pixels, not to 8 x 6"),
        (lambda c: c["annotations"][2]["segmentation"].update(counts=[50, -2]), "none negative"),
        (lambda c: c["annotations"][2]["segmentation"].update(counts=[1.5, 46.5]), "must be whole numbers"),
        (lambda c: c["annotations"][2]["segmentation"].update(size=[8, 6]), "its mask has 6 x 8 pixels, its image 8"),
        (lambda c: c["annotations"][2]["segmentation"].update(size=[6]), "its height and width, not [6]"),
        (lambda c: c["annotations"][6]["segmentation"].update(size=[10**6, 10**6]), "cannot be one of an image"),
    ],
)
def test_damage_is_named_with_its_annotation(changed, change: Callable[[Any], object], said: str) -> None:
    file = changed(change)
    with pytest.raises(BadFile) as refused:
        read_labels(file)
    assert str(refused.value).startswith(f"{file}: ")
    assert said in str(refused.value)


def test_broken_json_is_named_with_its_line(tmp_path: Path) -> None:
    file = tmp_path / "instances.json"
    file.write_text(FILE.read_text()[:-5] + "]]")
    with pytest.raises(BadFile, match=r"instances\.json:\d+: "):
        read_labels(file)


def test_parts_of_a_set_are_one(tmp_path: Path) -> None:
    (tmp_path / "annotations").mkdir()
    for part in ("train", "val"):
        (tmp_path / "annotations" / f"instances_{part}.json").write_text(FILE.read_text())
    found = read_labels(tmp_path)
    assert (len(found.images), len(found.outlines), len(found.rectangles)) == (4, 6, 2)
    assert [one.image for one in found.outlines] == [0, 0, 0, 2, 2, 2]
    assert found.left_out[3].where == "instances_val.json, annotation 5"
    (tmp_path / "annotations" / "captions.json").write_text(FILE.read_text())
    with pytest.raises(BadInput, match=r"holds several: annotations/captions\.json \(coco\)"):
        read_labels(tmp_path)
