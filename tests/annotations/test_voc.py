"""Pascal VOC's files: where rectangles begin and end, and what is refused."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ars_web.annotations.foreign import ForeignLabels
from ars_web.annotations.registry import read_labels
from ars_web.errors import ArsError, BadFile, BadInput

SOUND = """<annotation verified="yes">
  <folder>images</folder>
  <filename>a.png</filename>
  <size><width>64</width><height>48</height><depth>3</depth></size>
  <object>
    <name>cup</name>
    <part><name>handle</name><bndbox><xmin>1</xmin><ymin>1</ymin><xmax>2</xmax><ymax>2</ymax></bndbox></part>
    <bndbox><xmin>11</xmin><ymin>21</ymin><xmax>30</xmax><ymax>40.5</ymax></bndbox>
  </object>
  <object>
    <name>book</name>
    <bndbox><ymax>7</ymax><xmax>5</xmax><xmin>5</xmin><ymin>7</ymin></bndbox>
  </object>
</annotation>
"""


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    """Writes files of Annotations/ by their names, and returns the folder above."""

    def writing(**files: str | bytes) -> Path:
        (tmp_path / "set" / "Annotations").mkdir(parents=True, exist_ok=True)
        for name, content in files.items():
            data = content if isinstance(content, bytes) else content.encode()
            (tmp_path / "set" / "Annotations" / f"{name}.xml").write_bytes(data)
        return tmp_path / "set"

    return writing


def test_pixels_are_counted_from_one_and_the_last_is_inside(write: Callable[..., Path]) -> None:
    folder = write(one=SOUND)
    for path in (folder, folder / "Annotations", folder / "Annotations" / "one.xml"):
        found = read_labels(path)
        assert (found.format, found.in_shares) == ("voc", False)
        ((image,), (cup, book)) = found.images, found.rectangles
        assert (image.name, image.size) == ("a.png", (64, 48))
        # Columns 11 to 30 are twenty: from 10 to 30; a single pixel is one wide.
        assert (cup.class_name, cup.bbox.tolist(), cup.where) == ("cup", [10, 20, 30, 40.5], "object 0, line 5")
        assert (book.class_name, book.bbox.tolist()) == ("book", [4, 6, 5, 7])


def test_an_empty_file_among_annotations_is_named(write: Callable[..., Path]) -> None:
    with pytest.raises(BadFile, match=r"two\.xml:1: is not XML: no element found"):
        read_labels(write(one=SOUND, two=""))


def test_a_folder_is_one_set_and_an_image_may_show_nothing(write: Callable[..., Path]) -> None:
    nothing = "<annotation><size><width>0</width><height>0</height></size></annotation>"
    found = read_labels(write(one=SOUND, two=nothing))
    assert [(image.name, image.size) for image in found.images] == [("a.png", (64, 48)), ("two.xml", None)]
    assert [one.image for one in found.rectangles] == [0, 0]
    assert found.rectangles[0].where == "one.xml, object 0, line 5"


@pytest.mark.parametrize(
    ("old", "new", "line", "said"),
    [
        ("<xmin>11<", "<xmin>eleven<", 8, "<xmin> holds 'eleven', which is no number"),
        ("<xmin>11<", "<xmin>nan<", 8, "<xmin> holds 'nan'"),
        ("<xmin>11<", "<xmin>1_1<", 8, "<xmin> holds '1_1'"),
        ("<xmin>11</xmin>", "", 8, "<bndbox> has no xmin"),
        ("<xmin>11<", "<xmin>31<", 8, "31, 21 to 30, 40.5 ends before it begins"),
        ("<name>book</name>", "<name> </name>", 11, "<object> has no name"),
        ("<name>book</name>", "", 10, "<object> has no name"),
        ("<width>64<", "<width>64.5<", 4, "whole pixels"),
        ("<width>64</width>", "", 4, "<size> has no width"),
        ("</object>\n  <object>", "</object>\n  <object><object>", 14, "is not XML: mismatched tag"),
        ("<annotation verified", '<!DOCTYPE a [<!ENTITY b "c">]>\n<annotation verified', 1, "has a document type"),
    ],
)
def test_what_is_broken_is_named_by_its_line(
    write: Callable[..., Path], old: str, new: str, line: int, said: str
) -> None:
    assert old in SOUND
    folder = write(one=SOUND.replace(old, new, 1))
    with pytest.raises(BadFile) as raised:
        read_labels(folder)
    assert str(raised.value).startswith(f"{folder / 'Annotations' / 'one.xml'}:{line}: ")
    assert said in str(raised.value)


def test_an_object_without_a_rectangle_is_refused(write: Callable[..., Path]) -> None:
    with pytest.raises(BadFile, match=r"one\.xml:1: <object> has no <bndbox>"):
        read_labels(write(one="<annotation><object><name>cup</name></object></annotation>"))


def test_a_folder_without_files_says_what_is_needed(write: Callable[..., Path]) -> None:
    with pytest.raises(BadInput, match="voc: Pascal VOC, an XML file for each image"):
        read_labels(write())
    with pytest.raises(BadInput, match="holds no labels"):
        read_labels(write(one="<annotations></annotations>"), format="voc")


def read_or_refused(path: Path) -> ForeignLabels | ArsError:
    try:
        return read_labels(path)
    except ArsError as error:
        return error


@pytest.mark.parametrize("seed", range(40))
def test_damaged_files_are_read_or_refused(write: Callable[..., Path], seed: int) -> None:
    random = np.random.default_rng(seed)
    data = bytearray(SOUND.encode())
    for place in random.integers(0, len(data), size=random.integers(1, 5)):
        data[place] = random.integers(0, 256)
    found = read_or_refused(write(one=bytes(data)))
    assert isinstance(found, ForeignLabels) or "set" in str(found)
