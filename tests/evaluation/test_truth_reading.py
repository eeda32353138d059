"""Truths read: the datasets of this program exactly as they stand, those of others, and what is wrong with them."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import cv2
import numpy as np
import pytest

from ars_web.errors import BadFile, BadInput
from ars_web.evaluation.detections import Truth
from ars_web.evaluation.prediction_reading import read_predictions
from ars_web.evaluation.scoring import evaluate
from ars_web.evaluation.truth_reading import read_truth

GOLDEN = Path(__file__).parents[1] / "datasets" / "golden"
SIZE = (64, 48)


def rectangles(truth: Truth) -> list[tuple[str, str, list[float]]]:
    """Image, class and rectangle of each label."""
    names = [Path(image.name).stem for image in truth.images]
    return [
        (names[i], truth.classes[c], bbox.tolist())
        for i, c, bbox in zip(truth.image, truth.class_, truth.bbox, strict=True)
    ]


def test_coco_is_read_as_it_stands() -> None:
    truth = read_truth(GOLDEN / "coco", split="all")
    expected: list[tuple[str, str, list[float]]] = []
    areas: list[float] = []
    for split in ("train", "val", "test"):
        content = json.loads((GOLDEN / "coco" / "annotations" / f"instances_{split}.json").read_text())
        images = {image["id"]: image["file_name"].removesuffix(".jpg") for image in content["images"]}
        names = {category["id"]: category["name"] for category in content["categories"]}
        for one in content["annotations"]:
            x, y, w, h = one["bbox"]
            expected.append((images[one["image_id"]], names[one["category_id"]], [x, y, x + w, y + h]))
            areas.append(one["area"])
    assert rectangles(truth) == expected
    assert len(expected) == 12
    assert truth.area.tolist() == areas
    assert truth.category_ids == (1, 2)
    assert sorted(image.size for image in truth.images if image.size) == [(48, 64), SIZE, SIZE, SIZE]


@pytest.mark.parametrize("size", [SIZE, None])
def test_yolo_is_read_as_it_stands(size: tuple[int, int] | None) -> None:
    truth = read_truth(GOLDEN / "yolo", split="all", image_size=size)
    width, height = size or (1, 1)
    expected: list[tuple[str, str, list[float]]] = []
    for split in ("train", "val", "test"):
        for file in sorted((GOLDEN / "yolo" / "labels" / split).iterdir()):
            for row in file.read_text().splitlines():
                c, cx, cy, w, h = (float(word) for word in row.split())
                box = [(cx - w / 2) * width, (cy - h / 2) * height, (cx + w / 2) * width, (cy + h / 2) * height]
                expected.append((file.stem, ("cube", 'a "tall" & <odd> one: #1')[int(c)], box))
    assert rectangles(truth) == expected
    assert truth.in_pixels == (size is not None)
    assert any("say --image-size" in line for line in truth.warnings) == (size is None)


def test_voc_is_read_as_it_stands() -> None:
    truth = read_truth(GOLDEN / "voc", split="all")
    expected = [
        (file.stem, one.findtext("name"), [*(corner - (i < 2) for i, corner in enumerate(corners))])
        for file in sorted((GOLDEN / "voc" / "Annotations").iterdir())
        for one in ElementTree.parse(file).getroot().iter("object")
        for corners in [[float(one.findtext(f"bndbox/{side}") or "") for side in ("xmin", "ymin", "xmax", "ymax")]]
    ]
    assert rectangles(truth) == expected
    assert len(expected) == 12
    assert sorted(image.size for image in truth.images if image.size) == [(48, 64), SIZE, SIZE, SIZE]


@pytest.mark.parametrize(
    ("kind", "off"),
    [("yolo", 1e-4), ("yolo-pose", 1e-4), ("yolo-seg", 0.02), ("voc", 1.01), ("cvat", 0.01), ("ars", 1e-4)],
)
def test_all_formats_say_the_same_of_the_same_session(kind: str, off: float) -> None:
    coco, other = (read_truth(GOLDEN / name, split="all", image_size=SIZE) for name in ("coco", kind))
    numbers = {f"{i:05d}": f"{3 * i:04d}" for i in range(4)}  # of ars, which counts images

    def by_image(truth: Truth) -> list[tuple[str, str, list[float]]]:
        found = [(numbers.get(image, image), name, bbox) for image, name, bbox in rectangles(truth)]
        # The last image has another size than is said here of all.
        return sorted(row for row in found if row[0] != "0009")

    first, second = by_image(coco), by_image(other)
    assert [row[:2] for row in first] == [row[:2] for row in second]
    worst = np.abs(np.array([row[2] for row in first]) - [row[2] for row in second]).max()
    # COCO's have two decimals.
    assert worst <= 0.0101 + off
    assert other.classes == coco.classes


@pytest.mark.parametrize("kind", ["coco", "yolo", "voc", "ars"])
def test_val_is_read_where_nothing_is_said(kind: str) -> None:
    assert [Path(image.name).stem for image in read_truth(GOLDEN / kind, image_size=SIZE).images] in (
        ["0009"],
        ["00003"],
    )
    assert len(read_truth(GOLDEN / kind, split="train", image_size=SIZE).images) == 2
    assert len(read_truth(GOLDEN / kind, split="all", image_size=SIZE).images) == 4


def test_a_file_is_read_alone() -> None:
    file = GOLDEN / "coco" / "annotations" / "instances_train.json"
    assert len(read_truth(file).images) == 2
    assert (
        read_truth(GOLDEN / "yolo" / "data.yaml", image_size=SIZE).images
        == read_truth(GOLDEN / "yolo", image_size=SIZE).images
    )
    with pytest.raises(BadInput, match="has no split 'val': it is not divided"):
        read_truth(file, split="val")


def test_images_are_found_beside_the_labels(tmp_path: Path) -> None:
    for kind, folder in (("coco", "images"), ("voc", "JPEGImages"), ("yolo", "images/val")):
        shutil.copytree(GOLDEN / kind, tmp_path / kind)
        (tmp_path / kind / folder).mkdir(parents=True)
        image = tmp_path / kind / folder / "0009.jpg"
        assert cv2.imwrite(str(image), np.zeros((64, 48, 3), np.uint8))
        truth = read_truth(tmp_path / kind, split="val")
        assert [(one.file, one.size) for one in truth.images] == [(image, (48, 64))]
        assert truth.in_pixels


def test_images_of_coco_itself_are_found(tmp_path: Path) -> None:
    (tmp_path / "annotations").mkdir()
    shutil.copy(
        GOLDEN / "coco" / "annotations" / "instances_val.json", tmp_path / "annotations" / "instances_val2017.json"
    )
    (tmp_path / "val2017").mkdir()
    (tmp_path / "val2017" / "0009.jpg").touch()
    truth = read_truth(tmp_path)
    assert (truth.split, truth.images[0].file) == ("val", tmp_path / "val2017" / "0009.jpg")


def _yolo(folder: Path, yaml: str, **files: str) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "data.yaml").write_text(yaml)
    for name, content in files.items():
        path = folder / f"{name.replace('__', '/')}.txt"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content)
    return folder


def test_foreign_yolo_is_read(tmp_path: Path) -> None:
    """Names as a list or with gaps, a moved `path`, lists of images, `../` of some exports, outlines, blank lines."""
    rows = "1 0.5 0.5 0.5 0.5\n\n0 0.1 0.1 0.3 0.1 0.3 0.4\n"
    folder = _yolo(
        tmp_path / "a",
        "path: /no/such/folder\ntrain: ../train/images\nval: [images/one, images/two]\nnc: 2\nnames: [no, '1']\n",
        labels__one__a=rows,
        labels__two__b=rows,
        train__labels__c=rows,
    )
    truth = read_truth(folder, image_size=(100, 100))
    assert [image.name for image in truth.images] == ["images/one/a", "images/two/b"]
    assert truth.classes == ("no", "1")
    assert truth.bbox[:2] == pytest.approx(np.array([[25, 25, 75, 75], [10, 10, 30, 40]]))
    assert [image.name for image in read_truth(folder, split="train").images] == ["train/images/c"]

    listed = _yolo(
        tmp_path / "b", "val: val.txt\nnames: {3: car, 7: bus}\n", val="./images/x.png\n", labels__x="7 0.5 0.5 1 1\n"
    )
    truth = read_truth(listed)
    assert (truth.classes, truth.numbers, truth.class_.tolist()) == (("car", "bus"), (3, 7), [1])
    assert [image.name for image in truth.images] == ["images/x"]


def test_an_image_without_a_label_file_shows_nothing(tmp_path: Path) -> None:
    folder = _yolo(tmp_path / "a", "val: images\nnames: [a]\n", labels__x="0 0.5 0.5 1 1\n")
    (folder / "images").mkdir()
    for name in ("x", "y"):
        assert cv2.imwrite(str(folder / "images" / f"{name}.png"), np.zeros((6, 8, 3), np.uint8))
    truth = read_truth(folder)
    assert [image.name for image in truth.images] == ["images/x.png", "images/y.png"]
    assert truth.bbox.tolist() == [[0, 0, 8, 6]]


def test_difficult_objects_and_crowds_are_ignored(tmp_path: Path) -> None:
    shutil.copytree(GOLDEN / "voc", tmp_path / "voc")
    file = tmp_path / "voc" / "Annotations" / "0009.xml"
    file.write_text(file.read_text().replace("<difficult>0", "<difficult>1", 1))
    truth = read_truth(tmp_path / "voc")
    assert (truth.ignored.tolist(), truth.crowd.any()) == ([True, False, False], False)

    content = json.loads((GOLDEN / "coco" / "annotations" / "instances_val.json").read_text())
    content["annotations"][0]["iscrowd"] = 1
    content["annotations"][1]["ignore"] = 1
    (tmp_path / "instances.json").write_text(json.dumps(content))
    truth = read_truth(tmp_path / "instances.json")
    assert truth.ignored.tolist() == [True, True, False]
    assert truth.crowd.tolist() == [True, False, False]


def test_voc_files_in_a_folder_of_their_own_are_read(tmp_path: Path) -> None:
    """As label programs write them, beside the images or not."""
    for file in (GOLDEN / "voc" / "Annotations").iterdir():
        shutil.copy(file, tmp_path / file.name)
    assert cv2.imwrite(str(tmp_path / "0009.jpg"), np.zeros((64, 48, 3), np.uint8))
    truth = read_truth(tmp_path)
    assert (truth.format, len(truth.images), len(truth.bbox)) == ("voc", 4, 12)
    assert [one.file for one in truth.images if one.file] == [tmp_path / "0009.jpg"]


def test_frames_of_a_cvat_video_are_found_by_name_and_number(tmp_path: Path) -> None:
    """Frame 1 of 3 is labelled; pictures are called as CVAT calls them, or there are none."""
    sides = 'xtl="1" ytl="2" xbr="3" ybr="4" outside="0"'
    (tmp_path / "annotations.xml").write_text(
        "<annotations><meta><task><size>3</size></task></meta>"
        f'<track id="0" label="cup"><box frame="1" {sides}/></track></annotations>'
    )
    truth = read_truth(tmp_path)
    assert sorted((image.name, image.coco_id) for image in truth.images) == [(f"frame_00000{i}", i) for i in range(3)]
    assert truth.warnings == ()
    (tmp_path / "found.json").write_text('[{"image_id": 2, "category_id": "cup", "bbox": [1, 2, 2, 2], "score": 1}]')
    (tmp_path / "found.csv").write_text("image,class,x0,y0,x1,y1,score\nframe_000002.png,cup,1,2,3,4,1\n")
    for name in ("found.json", "found.csv"):
        found = read_predictions(tmp_path / name, truth)
        assert [truth.images[place].name for place in found.image] == ["frame_000002"]
        detector = evaluate(truth, [found], coco=False).detectors[0]
        # In an empty frame, which is one of the truth's.
        assert (detector.counts.tp, detector.averages.at_50) == (0, 0)
    (tmp_path / "images").mkdir()
    for number in range(3):
        assert cv2.imwrite(str(tmp_path / "images" / f"{number:05d}.png"), np.zeros((6, 8, 3), np.uint8))
    truth = read_truth(tmp_path)
    assert sorted(image.name for image in truth.images) == [f"images/0000{i}.png" for i in range(3)]
    assert all(image.file == tmp_path / image.name for image in truth.images)
    assert any("splits are not read" in line for line in read_truth(GOLDEN / "cvat-video").warnings)


def test_labels_that_are_odd_are_told(tmp_path: Path) -> None:
    rows = "0 0.5 0.5 0.2 0.2\n0 0.5 0.5 0.2 0.2\n0 0.5 0.5 0.2 0\n"
    folder = _yolo(tmp_path, "val: images\nnames: [a]\n", labels__x=rows)
    said = "\n".join(read_truth(folder, image_size=(10, 10)).warnings)
    assert "labels without an area: 1;" in said
    assert "labels that repeat another of the same class and rectangle in their image: 1;" in said


def _coco(change: Callable[[dict], object]) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        content = json.loads((GOLDEN / "coco" / "annotations" / "instances_val.json").read_text())
        change(content)
        (folder / "instances_val.json").write_text(json.dumps(content))
        return folder

    return write


def _voc(before: str, after: str, name: str = "Annotations/0009.xml") -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        shutil.copytree(GOLDEN / "voc", folder / "voc")
        file = folder / "voc" / name
        content = file.read_text()
        assert before in content
        file.write_text(content.replace(before, after, 1))
        return folder / "voc"

    return write


def _rows(rows: str, yaml: str = "val: images\nnames: [a, b]\n") -> Callable[[Path], Path]:
    return lambda folder: _yolo(folder, yaml, labels__x=rows)


@pytest.mark.parametrize(
    ("write", "said"),
    [
        (_rows("0 0.5 0.5 0.2\n"), r"x\.txt:1: 3 numbers follow the class: a rectangle has four \(cx cy w h\)"),
        (
            _rows("0 0.5 0.5 0.2 0.2\n0 0.5 0.5 0.2 0.2 0.9\n"),
            r"x\.txt:2: 5 numbers follow .* confidence: leave it out",
        ),
        (
            _rows("0 0.5 0.5 0.2 0.2\n\n2 0.5 0.5 0.2 0.2\n"),
            r"x\.txt:3: class 2 is none of data\.yaml's \(0: a, 1: b\)",
        ),
        (_rows("0.5 0.5 0.5 0.2 0.2\n"), r"x\.txt:1: '0\.5' is no class number"),
        (_rows("0 0.5 nan 0.2 0.2\n"), r"x\.txt:1: 'nan' is no number"),
        (_rows("0 0.5 wide 0.2 0.2\n"), r"x\.txt:1: 'wide' is no number"),
        (_rows("0 0.5 0.5 -0.2 0.2\n"), r"x\.txt:1: width -0\.2 and height 0\.2 must not be negative"),
        (_rows("0 320 240 100 50\n"), r"x\.txt:1: 320 is no share of the image's width"),
        (_rows("\n"), "holds no label in its 1 images"),
        (_rows("", "val: images\nnames: [a, a]\n"), "two of its names are the same"),
        (_rows("", "val: images\n"), "has no names"),
        (_rows("", "val: images\nnames: {a: 0}\n"), "'a': '?0'? is no class"),
        (_rows("", "names: [a]\n"), "names no split"),
        (_rows("", "val: elsewhere\nnames: [a]\n"), "val: elsewhere is not there"),
        (_rows("", "val: {a: b}\nnames: [a]\n"), "val must be a path"),
        (_rows("", "val: images\nnames: [a\n"), r"data\.yaml:2: is no YAML"),
        (_rows("", "- a\n"), "is no mapping"),
        (_rows("", "names:\n" + "- " * 2_000), r"data\.yaml: is nested too deeply"),
        (_rows("0 0.5 0.5 1 1 0 0 2\n", "val: images\nnames: [a]\nkpt_shape: [2, 2]\n"), "four .* and 4 of keypoints"),
        (_rows("0 0.5 0.5 1 1\n", "val: images\nnames: [a]\nkpt_shape: 9\n"), "kpt_shape must be"),
        (
            _coco(lambda c: c["annotations"][1].update(bbox=[1, 2, -3, 4])),
            "annotation 8?[0-9]+: bbox .* no negative width",
        ),
        (_coco(lambda c: c["annotations"][1].update(bbox=[1, 2, float("nan"), 4])), "must be finite"),
        (_coco(lambda c: c["annotations"][1].update(bbox=[1, 2, 3])), "bbox must be x, y, width and height"),
        (_coco(lambda c: c["annotations"][1].pop("bbox")), "bbox must be x, y, width and height, not None"),
        (_coco(lambda c: c["annotations"][1].update(area=-1)), "area -1 must be finite"),
        (_coco(lambda c: c["annotations"][1].update(image_id=99)), "there is no image 99 among its images"),
        (_coco(lambda c: c["annotations"][1].update(category_id=99)), "there is no category 99"),
        (_coco(lambda c: c["annotations"][1].pop("image_id")), r"annotations\[1\]\.image_id: Field required"),
        (_coco(lambda c: c["images"].append(c["images"][0])), "image id [0-9]+ is there twice"),
        (_coco(lambda c: c["images"].append({**c["images"][0], "id": 77})), r"two images are called '0009\.jpg'"),
        (
            _coco(lambda c: c["categories"].append({**c["categories"][0], "id": 77})),
            "two of its categories have one name",
        ),
        (_coco(lambda c: c["annotations"].clear()), "holds no label in its 1 images"),
        (_coco(lambda c: (c["annotations"].clear(), c["images"].clear())), "holds no image"),
        (_voc("<xmax>", "<xmax>wide"), r"0009\.xml:\d+: <xmax> holds 'wide\d+', which is no number"),
        (_voc("<xmin>", "<xmin>99"), r"0009\.xml:\d+: <bndbox>: .* ends before it begins"),
        (_voc("<annotation>", "<nothing>"), r"0009\.xml:\d+: begins with <nothing>, not with <annotation>"),
        (_voc("<width>48", "<width>48.5"), r"0009\.xml:\d+: <size> must hold width and height in whole pixels"),
        (_voc("<bndbox>", "<b/><x>"), r"0009\.xml:\d+: is not XML"),
        (_voc("<name>cube</name>", ""), r"0009\.xml:\d+: <object> has no name"),
        (_voc("<name>cube", "<name>cone"), r"dataset\.json: names no class 'cone'"),
        (_voc("0009", "0123", "ImageSets/Main/val.txt"), r"val\.txt:1: lists '0123'"),
        (_voc("0009", "", "ImageSets/Main/val.txt"), r"val\.txt: is empty: the split has no image"),
    ],
)
def test_a_bad_truth_is_named(tmp_path: Path, write: Callable[[Path], Path], said: str) -> None:
    with pytest.raises(BadInput, match=said):
        read_truth(write(tmp_path))


def test_a_truth_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(BadFile, match="is missing"):
        read_truth(tmp_path / "nothing")
    with pytest.raises(BadInput, match="holds no labels that are known"):
        read_truth(tmp_path)
    with pytest.raises(BadInput, match="truth of the format 'kitti' is not read"):
        read_truth(tmp_path, format="kitti")
    with pytest.raises(BadInput, match="split 'valid' is none of train, val, test, all"):
        read_truth(GOLDEN / "coco", split="valid")
    for kind in ("yolo", "voc"):
        with pytest.raises(BadFile, match="holds no"):
            read_truth(tmp_path, format=kind)
    for kind in ("coco", "cvat"):
        with pytest.raises(BadFile):
            read_truth(tmp_path, format=kind)


@pytest.mark.parametrize("kind", ["kitti", "tfrecord", "webdataset", "parquet", "bop", "dope", "masks", "compass"])
def test_our_datasets_that_are_no_truth_say_what_to_give_instead(kind: str) -> None:
    said = rf"is a dataset of the format {kind}; evaluate takes coco, yolo, voc, cvat and ars .* --format coco"
    with pytest.raises(BadInput, match=said):
        read_truth(GOLDEN / kind)


@pytest.mark.parametrize(
    ("file", "title"),
    [
        ("training/label_2/000000.txt", "KITTI"),
        ("records/train.tfrecord-00000-of-00001", "TFRecord"),
        ("shard-000000.tar", "WebDataset"),
        ("labels.parquet", "Parquet"),
        ("test/000001/scene_gt.json", "BOP"),
    ],
)
def test_other_datasets_that_are_no_truth_say_what_to_give_instead(tmp_path: Path, file: str, title: str) -> None:
    (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / file).touch()
    with pytest.raises(BadInput, match=rf"looks like {title}; evaluate takes .* Convert it to a COCO file"):
        read_truth(tmp_path)


def test_an_empty_split_is_named(tmp_path: Path) -> None:
    folder = _yolo(tmp_path, "val: images/val\ntrain: images/train\nnames: [a]\n", labels__train__x="0 0.5 0.5 1 1\n")
    (tmp_path / "images" / "val").mkdir(parents=True)
    with pytest.raises(BadFile, match="split val is empty: images/val holds no image"):
        read_truth(folder, split="val")
    assert len(read_truth(folder, split="all").images) == 1


def test_images_of_which_some_are_missing_are_named(tmp_path: Path) -> None:
    folder = _yolo(tmp_path, "val: v.txt\nnames: [a]\n", v="images/x.png\nimages/y.png\n", labels__x="0 0.5 0.5 1 1\n")
    (folder / "images").mkdir()
    assert cv2.imwrite(str(folder / "images" / "y.png"), np.zeros((6, 8, 3), np.uint8))
    with pytest.raises(BadFile, match="1 of its 2 images are missing, images/x first"):
        read_truth(folder)
    (folder / "v.txt").write_text("images/z.png\n")
    with pytest.raises(BadFile, match=r"lists images/z\.png, of which there is neither"):
        read_truth(folder)


def test_sizes_are_not_told_apart_where_none_is_known(tmp_path: Path, make_predictions) -> None:
    truth = read_truth(GOLDEN / "yolo")
    found = make_predictions([(0, c, box, 0.5) for c, box in zip(truth.class_, truth.bbox, strict=True)])
    coco = evaluate(truth, [found]).detectors[0].coco
    assert coco is not None
    assert (coco.ap, coco.ar_100, coco.ap_small, coco.ar_small) == (1, 1, None, None)
