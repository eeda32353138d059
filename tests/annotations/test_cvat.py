"""CVAT files, for images and for video: shapes as files made by hand say, and what is refused."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ars_web.annotations.cvat_shapes import box_between
from ars_web.annotations.registry import read_labels
from ars_web.errors import BadFile
from ars_web.geometry.mask_regions import mask_from_polygons

FILES = Path(__file__).parent / "files"


@pytest.fixture
def changed(tmp_path: Path) -> Callable[..., Path]:
    def write(name: str, old: str, new: str) -> Path:
        text = (FILES / name).read_text()
        assert old in text
        file = tmp_path / "annotations.xml"
        file.write_text(text.replace(old, new, 1))
        return file

    return write


def test_images_by_hand() -> None:
    found = read_labels(FILES / "cvat_images.xml")
    assert found.format == "cvat"
    assert [(image.name, image.size) for image in found.images] == [
        ("images/00000.jpg", (320, 240)),
        ("images/00001.jpg", (320, 240)),
    ]
    polygon, mask = found.outlines
    assert (polygon.image, polygon.class_name, polygon.instance) == (0, "cup", "track_id 4")
    np.testing.assert_array_equal(polygon.polygons[0].outer, [[10, 20], [60.5, 20], [60.5, 70.25]])
    assert [(r.class_name, r.instance, r.bbox.tolist()) for r in found.rectangles] == [
        ("book", None, [100, 50, 140, 70]),
        ("pen", None, [110, 40, 130, 80]),
    ]
    assert mask.class_name == "coin"
    assert [one.reason.split(":")[0] for one in found.left_out] == [
        "it is a box that is turned in the image",
        "its mask is empty",
        "it is a ellipse",
        "it is a polyline",
        "it is a points",
        "it is a tag",
    ]
    assert found.left_out[0].where == "images/00000.jpg, <box> 3, line 13"


def test_a_mask_runs_along_the_rows_of_its_rectangle() -> None:
    """Runs 1, 2, 2, 2, 1 in 4 x 2 pixels at (5, 7): the middle two of both rows."""
    inside = mask_from_polygons(read_labels(FILES / "cvat_images.xml").outlines[1].polygons, 20, 20)
    assert inside[7:9, 6:8].all()
    assert inside.sum() == 4


def test_a_track_is_one_object_and_its_box_moves_evenly() -> None:
    found = read_labels(FILES / "cvat_video.xml")
    frames = [found.images[one.image].number for one in found.rectangles]
    # From 6 to 8, where it leaves; in 8 and 9 it is outside; 10 is its last.
    assert frames == [2, 3, 4, 5, 6, 7, 10]
    assert {one.instance for one in found.rectangles} == {"track 0"}
    np.testing.assert_allclose(found.rectangles[1].bbox, [12, 20, 32, 41])
    np.testing.assert_allclose(found.rectangles[5].bbox, [18, 20, 38, 44])
    assert all(image.is_index and image.size == (320, 240) for image in found.images)


def test_frames_of_a_video_that_show_nothing_are_images_too() -> None:
    """The head says 12 frames; tracks are in eight of them."""
    found = read_labels(FILES / "cvat_video.xml")
    assert sorted(image.number for image in found.images) == list(range(12))
    assert {found.images[one.image].number for one in (*found.rectangles, *found.outlines)} == {*range(2, 8), 10}


HEAD = "<size>12</size>"


@pytest.mark.parametrize(
    ("head", "numbers"),
    [
        ("<size>9</size><start_frame>2</start_frame><stop_frame>10</stop_frame>", range(2, 11)),
        ("<start_frame>2</start_frame><stop_frame>10</stop_frame><frame_filter></frame_filter>", range(2, 11)),
        # The last frame is the video's, not the last that is taken.
        (
            "<size>6</size><start_frame>0</start_frame><stop_frame>11</stop_frame><frame_filter>step=2</frame_filter>",
            range(0, 12, 2),
        ),
        ("<size>12</size><start_frame>0</start_frame><stop_frame>0</stop_frame>", range(12)),
    ],
)
def test_the_head_of_a_video_says_which_frames_it_has(changed, head: str, numbers: range) -> None:
    file = changed("cvat_video.xml", HEAD, head)
    # The polygons' second frame is no even one.
    file.write_text(file.read_text().replace('frame="5"', 'frame="4"'))
    found = read_labels(file)
    assert sorted(image.number for image in found.images) == list(numbers)
    boxed = [found.images[one.image].number for one in found.rectangles]
    assert boxed == [number for number in (*range(2, 8), 10) if number in numbers]
    if numbers.step == 2:
        # Halfway from 2 to 6, as in the frames between.
        np.testing.assert_allclose(found.rectangles[1].bbox, [14, 20, 34, 42])


@pytest.mark.parametrize(
    "head",
    [
        # Tracks list frames beyond these: a job's places, or another task's.
        "<size>8</size>",
        "<size>4</size><start_frame>0</start_frame><frame_filter>step=3</frame_filter>",
        "<size>12</size><frame_filter>every second</frame_filter>",
        "",
    ],
)
def test_a_head_that_does_not_fit_the_tracks_adds_no_frame(changed, head: str) -> None:
    found = read_labels(changed("cvat_video.xml", HEAD, head))
    assert sorted(image.number for image in found.images) == [*range(2, 8), 10]


def test_a_jobs_places_are_numbers_where_there_is_no_step(changed) -> None:
    text = changed("cvat_video.xml", HEAD, "<start_frame>1</start_frame><stop_frame>10</stop_frame>").read_text()
    file = changed("cvat_video.xml", "<annotations>", "<annotations>")
    file.write_text(text.replace("<task>", "<job>").replace("</task>", "</job>"))
    assert sorted(image.number for image in read_labels(file).images) == list(range(1, 11))
    file.write_text(file.read_text().replace("<mode>", "<frame_filter>step=1</frame_filter><mode>"))
    assert len(read_labels(file).images) == 7


def test_a_tracks_polygons_are_those_that_are_listed() -> None:
    found = read_labels(FILES / "cvat_video.xml")
    assert [found.images[one.image].number for one in found.outlines] == [2, 5]
    assert {one.instance for one in found.outlines} == {"track 1"}


def test_a_box_turns_the_shorter_way_round() -> None:
    before, after = np.array([0.0, 0, 10, 10, 350]), np.array([4.0, 0, 14, 10, 10])
    np.testing.assert_allclose(box_between(before, after, 0.25), [1, 0, 11, 10, 355])


@pytest.mark.parametrize(
    ("name", "old", "new", "said"),
    [
        ("cvat_images.xml", 'xtl="100.00"', "", ":11: <box> has no xtl"),
        ("cvat_images.xml", 'xtl="100.00"', 'xtl="nan"', ":11: <box>: xtl holds 'nan', which is no number"),
        ("cvat_images.xml", 'xtl="100.00"', 'xtl="150"', ":11: <box>: 150, 50 to 140, 70 has no width or height"),
        ("cvat_images.xml", "10.00,20.00;", "", ":8: <polygon>: a polygon needs three corners at least"),
        ("cvat_images.xml", "10.00,20.00;", "10.00;", ":8: <polygon>: points must be x,y;x,y"),
        ("cvat_images.xml", 'rle="1, 2, 2, 2, 1"', 'rle="1, 2, 2"', ":14: <mask>: the runs of a mask add up to 5"),
        ("cvat_images.xml", 'rle="1, 2, 2, 2, 1"', 'rle="1, 2.5"', ":14: <mask>: the runs of a mask must be whole"),
        ("cvat_images.xml", 'width="320"', 'width="-3"', ":7: <image>: width must be a whole number"),
        ("cvat_images.xml", 'label="cup"', "", ":8: <polygon> has no label"),
        ("cvat_images.xml", "</meta>", "</mata>", ":6: is not XML: mismatched tag"),
        ("cvat_images.xml", "<annotations>", "<annotations_of>", "begins with <annotations_of>"),
        ("cvat_video.xml", 'frame="6"', 'frame="2"', ":13: track 0 has two shapes in frame 2"),
        ("cvat_video.xml", 'frame="10"', 'frame="x"', "frame holds 'x', which is no number"),
        ("cvat_video.xml", "<width>320</width>", "", ":8: <original_size> must hold width and height"),
        ("cvat_video.xml", 'frame="6"', 'frame="90000000"', "its tracks leave over 1000000 boxes"),
        ("cvat_video.xml", HEAD, "<size>many</size>", ":6: <size> must hold a whole number of frames, not 'many'"),
        ("cvat_video.xml", HEAD, "<size>90000000</size>", ":5: <task> says that it has 90000000 frames; over 1000000"),
        ("cvat_video.xml", "</task>", "</task><task/>", ":11: track 0: the file holds 2 tasks, and the frames of each"),
    ],
)
def test_damage_is_named_with_its_line(changed, name: str, old: str, new: str, said: str) -> None:
    file = changed(name, old, new)
    with pytest.raises(BadFile) as refused:
        read_labels(file, format="cvat")
    assert str(refused.value).startswith(str(file))
    assert said in str(refused.value)


@pytest.mark.parametrize(
    "doctype",
    [
        '<!DOCTYPE a [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">]>',
        '<!DOCTYPE a [<!ENTITY secret SYSTEM "file:///etc/hostname">]>',
        '<!DOCTYPE annotations SYSTEM "http://127.0.0.1:1/x.dtd">',
    ],
)
def test_document_types_and_their_entities_are_refused(tmp_path: Path, doctype: str) -> None:
    file = tmp_path / "annotations.xml"
    file.write_text(f'<?xml version="1.0"?>\n{doctype}\n<annotations><image name="&b;"/></annotations>')
    with pytest.raises(BadFile, match=r"annotations\.xml:2: has a document type"):
        read_labels(file)


def test_what_is_nested_too_deeply_or_holds_nothing_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "annotations.xml"
    file.write_text(f"<annotations>{'<a>' * 50}{'</a>' * 50}</annotations>")
    with pytest.raises(BadFile, match="nested too deeply"):
        read_labels(file)
    file.write_text("<annotations><meta/></annotations>")
    with pytest.raises(BadFile, match="holds no <image> and no <track>"):
        read_labels(file)
