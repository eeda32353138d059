"""YOLO's folders: what a row is, where names are found, and what is refused."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ars_web.annotations.foreign import ForeignLabels
from ars_web.annotations.registry import read_labels
from ars_web.errors import ArsError, BadFile, BadInput
from ars_web.recordings.options import ReadOptions

ROW = "1 0.5 0.25 0.2 0.1\n"


@pytest.fixture
def write(tmp_path: Path) -> Callable[[dict[str, str | bytes]], Path]:
    """Writes files by their paths into a folder, and returns it."""

    def writing(files: dict[str, str | bytes]) -> Path:
        folder = tmp_path / "set"
        for name, content in files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())
        folder.mkdir(exist_ok=True)
        return folder

    return writing


def test_rows_are_rectangles_or_outlines_in_shares(write: Callable[..., Path]) -> None:
    folder = write(
        {
            "classes.txt": "cup\nbook\n",
            "labels/a.txt": ROW + "\n0 0.1 0.1 0.3 0.1 0.2 0.4\r\n0 0 0 1 0 1 1 0 1\n",
            "labels/b.txt": "",
        }
    )
    found = read_labels(folder)
    assert (found.format, found.in_shares) == ("yolo", True)
    assert [image.name for image in found.images] == ["labels/a.txt", "labels/b.txt"]
    (rectangle,) = found.rectangles
    assert (rectangle.image, rectangle.class_name, rectangle.where) == (0, "book", "labels/a.txt, line 1")
    np.testing.assert_allclose(rectangle.bbox, [0.4, 0.2, 0.6, 0.3])
    triangle, corners = found.outlines
    assert (triangle.class_name, triangle.where) == ("cup", "labels/a.txt, line 3")
    np.testing.assert_array_equal(triangle.polygons[0].outer, [[0.1, 0.1], [0.3, 0.1], [0.2, 0.4]])
    assert len(corners.polygons[0].outer) == 4


@pytest.mark.parametrize(
    ("names", "text"),
    [
        ("data.yaml", "path: .\ntrain: images/train\nnames:\n  0: 'no'\n  1: \"a: b\"\n"),
        ("data.yaml", "names: [no, 'a: b']  # two\nnc: 2\n"),
        ("data.yaml", "names:\n- no\n- 'a: b'\n"),
        ("dataset.yaml", "names: {1: 'a: b', 7: bus, 0: no}\n"),
        ("classes.txt", "no\r\na: b\n\n"),
        ("obj.names", "\ufeffno\na: b"),
        ("labels/classes.txt", "no\na: b"),
    ],
)
def test_names_are_found_and_stay_as_they_are(write: Callable[..., Path], names: str, text: str) -> None:
    folder = write({names: text, "labels/train/a.txt": "0 0.5 0.5 1 1\n" + ROW, "train.txt": "images/a.png\n"})
    for path in (folder, folder / "labels", folder / "labels/train", folder / names):
        if path.parent == folder / "labels" and path.name == "classes.txt":
            continue
        found = read_labels(path)
        assert [one.class_name for one in found.rectangles] == ["no", "a: b"]
        assert len(found.images) == 1


def test_text_files_beside_labels_are_none(write: Callable[..., Path]) -> None:
    flat = write({"classes.txt": "cup\nbook\n", "a.txt": ROW, "train.txt": "a.png\n", "README.dataset.txt": "words\n"})
    assert [image.name for image in read_labels(flat).images] == ["a.txt"]
    divided = write({"train/labels/b.txt": ROW, "valid/labels/c.txt": ROW, "notes.txt": "words\n"})
    assert [image.name for image in read_labels(divided).images] == ["train/labels/b.txt", "valid/labels/c.txt"]


def test_keypoints_after_a_rectangle_are_left_alone(write: Callable[..., Path]) -> None:
    folder = write(
        {"data.yaml": "kpt_shape: [2, 2]\nnames: [cup]\n", "labels/a.txt": "0 0.5 0.5 0.2 0.2 0.4 0.4 0.6 0.6\n"}
    )
    found = read_labels(folder)
    assert (len(found.rectangles), found.outlines) == (1, ())


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ("2 0.5 0.5 0.1 0.1", "class 2 is none of classes.txt's (0: cup, 1: book)"),
        ("cup 0.5 0.5 0.1 0.1", "'cup' is no class"),
        ("-1 0.5 0.5 0.1 0.1", "'-1' is no class"),
        ("1 0.5 0.5 0.1", "3 numbers follow the class"),
        ("1", "0 numbers follow the class"),
        ("1 0.5 0.5 0.1 0.1 0.9", "a fifth is a detector's confidence: leave it out"),
        ("1 0.5 0.5 0.1 0.1 0.9 0.1 0.2", "7 numbers follow the class"),
        ("1 0.5 x 0.1 0.1", "'x' is no number"),
        ("1 0.5 nan 0.1 0.1", "'nan' is no number"),
        ("1 0.5 1_0 0.1 0.1", "'1_0' is no number"),
        ("1 320 240 64 48", "320 is no share of the image's width or height, 0 to 1; divide pixels by them"),
        ("1 0.5 0.5 0 0.1", "width 0 and height 0.1 holds nothing"),
        ("1 0.5 0.5 0.1 -0.1", "width 0.1 and height -0.1 must not be negative"),
        ("\u00b2 0.5 0.5 0.1 0.1", "is no class"),
    ],
)
def test_a_broken_line_is_named(write: Callable[..., Path], row: str, said: str) -> None:
    folder = write({"classes.txt": "cup\nbook\n", "labels/a.txt": f"{ROW}{row}\n{ROW}"})
    with pytest.raises(BadFile) as raised:
        read_labels(folder)
    assert str(raised.value).startswith(f"{folder / 'labels/a.txt'}:2: ")
    assert said in str(raised.value)


@pytest.mark.parametrize(
    ("files", "said"),
    [
        ({"data.yaml": "names: [cup\n", "a.txt": ""}, r"data\.yaml:1: is no YAML"),
        (
            {"data.yaml": "names: cup\n", "a.txt": ""},
            r"data\.yaml: has no names; give the classes as a list, or by their numbers",
        ),
        (
            {"data.yaml": "names: {0: cup, two: book}\n", "a.txt": ""},
            "names: 'two': 'book' is no class; they are NUMBER",
        ),
        ({"data.yaml": "names: [cup, []]\n", "a.txt": ""}, "names: '1': .* is no class"),
        ({"data.yaml": "# names\n", "a.txt": ""}, "is no mapping; it needs names"),
        ({"data.yaml": "names:\n" + "- " * 2_000, "a.txt": ""}, "nested too deeply"),
        ({"data.yaml": "names: [cup]\n" + "#" * (1 << 18), "a.txt": ""}, "over 256 KiB"),
        ({"data.yaml": b"names: [\xff\xfe]\n", "a.txt": ""}, "is no YAML"),
        ({"classes.txt": "cup\n\nbook\n", "a.txt": ""}, r"classes\.txt:2: a class without a name"),
        ({"classes.txt": b"caf\xe9\n", "a.txt": ""}, r"classes\.txt: is not UTF-8; save it as UTF-8"),
        ({"data.yaml": "names: []\n", "a.txt": ""}, r"data\.yaml: names no class"),
        ({"data.yaml": "names: [a]\nkpt_shape: 9\n", "a.txt": ""}, "kpt_shape must be"),
        ({"classes.txt": "cup\n"}, "holds no label files"),
        (
            {"classes.txt": "", "labels/a.txt": "0 0.5 0.5 1 1\n"},
            r"a\.txt:1: class 0 is none of classes\.txt's \(which has none\)",
        ),
        ({"classes.txt": "cup\n", "a.txt": "1\x000".encode("utf-16")}, r"a\.txt: is UTF-16"),
    ],
)
def test_broken_names_are_named(write: Callable[..., Path], files: dict[str, str | bytes], said: str) -> None:
    with pytest.raises(BadFile, match=said):
        read_labels(write(files))


def test_a_folder_without_names_says_what_is_needed(write: Callable[..., Path]) -> None:
    for files in ({}, {"a.txt": ROW}):
        with pytest.raises(BadInput, match=r"yolo: YOLO, text files of rows class cx cy w h, and data\.yaml"):
            read_labels(write(files))
    with pytest.raises(BadInput, match="holds no labels"):
        read_labels(write({"a.txt": ROW}), format="yolo")


def test_names_outside_what_may_be_read_are_not_looked_at(write: Callable[..., Path]) -> None:
    folder = write({"classes.txt": "cup\nbook\n", "labels/a.txt": ROW})
    assert read_labels(folder / "labels", options=ReadOptions(within=folder)).rectangles
    with pytest.raises(BadFile, match=r"has no data\.yaml"):
        read_labels(folder / "labels", options=ReadOptions(within=folder / "labels"))


def read_or_refused(path: Path) -> ForeignLabels | ArsError:
    try:
        return read_labels(path)
    except ArsError as error:
        return error


@pytest.mark.parametrize("seed", range(40))
def test_damaged_files_are_read_or_refused(write: Callable[..., Path], seed: int) -> None:
    random = np.random.default_rng(seed)
    sound = {"data.yaml": b"names: {0: cup, 1: 'a b'}\n", "labels/a.txt": (ROW + "0 0 0 1 0 1 1\n").encode()}
    files: dict[str, str | bytes] = {}
    for name, content in sound.items():
        data = bytearray(content)
        for place in random.integers(0, len(data), size=random.integers(0, 4)):
            data[place] = random.integers(0, 256)
        files[name] = bytes(data[: random.integers(1, len(data) + 1)] if random.random() < 0.3 else data)
    found = read_or_refused(write(files))
    assert isinstance(found, ForeignLabels) or "set" in str(found)
