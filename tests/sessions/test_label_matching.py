"""Which frames images are, by name and by number."""

from pathlib import Path

import numpy as np
import pytest

from ars_web.annotations.foreign import ForeignImage, ForeignLabels, ForeignOutline, ForeignRectangle
from ars_web.errors import BadFile
from ars_web.geometry.camera import Camera
from ars_web.geometry.polygon import Polygon
from ars_web.sessions.label_matching import NO_FRAME, TWO_IMAGES, Matching, in_pixels, matched_images
from ars_web.sessions.model import FrameTable

CAMERAS = {0: Camera(320, 240, 300.0, 300.0, 159.5, 119.5)}


def match(names: list[str], *images: ForeignImage) -> Matching:
    frames = FrameTable(
        tuple(names),
        tuple(Path(name) for name in names),
        np.zeros(len(names), dtype=np.int64),
        np.tile(np.eye(4), (len(names), 1, 1)),
    )
    return matched_images(ForeignLabels("coco", Path("labels.json"), images), frames, CAMERAS)


def named(*names: str) -> list[ForeignImage]:
    return [ForeignImage(name=name, size=(320, 240)) for name in names]


def numbered(*numbers: int, is_index: bool = False) -> list[ForeignImage]:
    return [ForeignImage(number=number, is_index=is_index) for number in numbers]


def test_a_name_is_the_frames_own_or_its_file_name_or_that_without_its_ending() -> None:
    found = match(["a/1.jpg", "b/1.jpg", "c/2.png"], *named("b/1.jpg", "elsewhere/2.png", "2.jpg", "1.jpg"))
    # 1.jpg could be either of two; 2.png and 2.jpg both fit the third frame.
    assert found.frames == {0: 1}
    assert found.problems == {1: TWO_IMAGES, 2: TWO_IMAGES, 3: NO_FRAME}


def test_an_exact_name_goes_before_one_that_fits() -> None:
    found = match(["2.png", "3.png"], *named("old/2.png", "2.png", "images\\3.bmp"))
    assert found.frames == {1: 0, 2: 1}
    assert found.problems == {0: TWO_IMAGES}


def test_folders_tell_images_of_one_file_name_apart() -> None:
    """As YOLO's label files have them, and as programs do that keep images elsewhere."""
    frames = ["images/left/1.png", "images/right/1.png"]
    found = match(frames, *named("labels/right/1.txt", "labels/left/1.txt", "set/images/left/2.png", "1.txt"))
    assert found.frames == {0: 1, 1: 0}
    assert found.problems == {2: NO_FRAME, 3: NO_FRAME}
    # Of the left camera's frames alone, the right one's image fits by its file name, the left one's by more.
    found = match(["images/left/1.png"], *named("labels/right/1.txt", "labels/left/1.txt"))
    assert (found.frames, found.problems) == ({1: 0}, {0: TWO_IMAGES})
    # A folder that fits goes before the file's ending.
    assert match(["left/1.png", "right/1.jpg"], *named("left/1.jpg")).frames == {0: 0}


def test_a_name_may_be_the_one_of_an_export() -> None:
    found = match(["left/1.png", "right/1.png", "caf\u00e9 2.jpg"], *named("left_1.png", "x/right_1.txt", "caf__2.jpg"))
    assert found.frames == {0: 0, 1: 1, 2: 2}


def test_a_name_that_comes_twice_is_no_frames() -> None:
    found = match(["1.png", "2.png"], *named("1.png", "1.png", "2.png"))
    assert (found.frames, found.problems) == ({2: 1}, {0: TWO_IMAGES, 1: TWO_IMAGES})


@pytest.mark.parametrize(
    ("names", "images", "frames", "how"),
    [
        (["000010.png", "000020.png"], numbered(20, 10, 30), {0: 1, 1: 0}, "digits"),
        (["f_001.png", "f_002.png", "f_003.png"], numbered(0, 1, 2), {0: 0, 1: 1, 2: 2}, "index"),
        (["f_001.png", "f_002.png", "f_003.png"], numbered(1, 2, 3), {0: 0, 1: 1, 2: 2}, "digits"),
        (["a.png", "b.png"], numbered(0, 1), {0: 0, 1: 1}, "index"),
        (["x/7.png", "y/7.png", "8.png"], numbered(7, 8), {1: 2}, "digits"),
        (["f_001.png", "f_002.png", "f_003.png"], numbered(0, 2, is_index=True), {0: 0, 1: 2}, "index"),
        (["f_100.png", "f_101.png"], numbered(100, is_index=True), {0: 0}, "digits"),
    ],
)
def test_numbers(names: list[str], images: list[ForeignImage], frames: dict[int, int], how: str) -> None:
    found = match(names, *images)
    assert found.frames == frames
    assert how in found.notes[0]


def test_images_of_another_recording_are_refused() -> None:
    with pytest.raises(BadFile, match=r"labels\.json: none of its 2 images .* its first is x\.png, .* first 1\.png"):
        match(["1.png", "2.png"], *named("x.png", "y.png"))


def test_images_of_another_size_are_refused() -> None:
    with pytest.raises(BadFile, match=r"2\.png has 640 x 480 pixels there, frame 1 \(2\.png\) 320 x 240"):
        match(["1.png", "2.png"], *named("1.png"), ForeignImage(name="2.png", size=(640, 480)))


def test_other_cameras_are_told() -> None:
    same = ForeignImage(number=0, K=(300.1, 299.9, 159.4, 119.8))
    other = ForeignImage(number=1, K=(310.0, 300.0, 159.5, 119.5))
    assert len(match(["0.png", "1.png"], same).notes) == 1
    assert (
        "(image 1: fx, fy, cx, cy 310.0, 300.0, 159.5, 119.5 there, 300.0" in match(["0.png", "1.png"], other).notes[1]
    )


def test_shares_become_pixels_of_each_frames_camera() -> None:
    cameras = {0: Camera(320, 240, 300.0, 300.0, 159.5, 119.5), 1: Camera(100, 50, 80.0, 80.0, 49.5, 24.5)}
    frames = FrameTable(
        ("1.png", "2.png"), (Path("1.png"), Path("2.png")), np.array([0, 1]), np.tile(np.eye(4), (2, 1, 1))
    )
    ring, hole = np.array([[0, 0], [1, 0], [0, 1.0]]), np.array([[0.1, 0.1], [0.2, 0.1], [0.1, 0.2]])
    labels = ForeignLabels(
        "yolo",
        Path("labels"),
        (*(ForeignImage(name=f"{name}.txt") for name in ("2", "1", "3")),),
        outlines=(ForeignOutline(0, "cup", None, (Polygon(ring, (hole,)),), "first"),),
        rectangles=tuple(ForeignRectangle(i, "cup", None, np.array([0.1, 0.2, 0.5, 1.0]), "") for i in range(3)),
        in_shares=True,
    )
    found = in_pixels(labels, matched_images(labels, frames, cameras), frames, cameras)
    assert not found.in_shares
    np.testing.assert_allclose([one.bbox for one in found.rectangles[:2]], [[10, 10, 50, 50], [32, 48, 160, 240]])
    np.testing.assert_allclose(found.outlines[0].polygons[0].outer, [[0, 0], [100, 0], [0, 50]])
    np.testing.assert_allclose(found.outlines[0].polygons[0].holes[0], [[10, 5], [20, 5], [10, 10]])
    # The third is no frame, so nothing tells its size.
    np.testing.assert_array_equal(found.rectangles[2].bbox, [0.1, 0.2, 0.5, 1.0])
    pixels = ForeignLabels("voc", Path("labels"), labels.images, rectangles=labels.rectangles)
    assert in_pixels(pixels, matched_images(labels, frames, cameras), frames, cameras) is pixels
