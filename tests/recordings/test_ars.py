import json
from pathlib import Path

import numpy as np
import pytest

from ars_web.errors import BadFile
from ars_web.recordings.registry import ReadOptions, read_recording


@pytest.fixture
def scene(written) -> Path:
    return written("ars")


def change_line(file: Path, number: int, text: str) -> None:
    lines = file.read_text().splitlines()
    lines[number - 1] = text
    file.write_text("\n".join(lines))


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("nan 0 0 0 0 0 1", "position nan 0 0 is not finite"),
        ("0 0 0 0 0 0 0", "quaternion has length 0, not 1"),
        ("0 0 0 0 0 0 1.5", "quaternion has length 1.5, not 1"),
        ("0 0 0 inf 0 0 1", "quaternion is not finite"),
    ],
)
def test_one_bad_pose_is_a_skipped_frame(scene: Path, truth, line: str, reason: str) -> None:
    change_line(scene / "robot_poses.txt", 3, line)
    recording = read_recording(scene)
    assert [frame.name for frame in recording.frames] == [name for i, name in enumerate(truth.names) if i != 2]
    np.testing.assert_allclose(recording.Ts_world_camera, np.delete(truth.Ts, 2, axis=0), atol=1e-9)
    (skipped,) = recording.skipped
    assert skipped.name == "frame_002.png"
    assert reason in skipped.reason
    assert skipped.where == f"{scene / 'robot_poses.txt'}:3"


def test_a_line_that_is_no_pose_is_an_error(scene: Path) -> None:
    change_line(scene / "robot_poses.txt", 3, "0 0 0 0 0 1")
    with pytest.raises(BadFile, match=r"robot_poses\.txt:3: has 6 values; a line has 7 numbers \(x y z qx qy qz qw\)"):
        read_recording(scene)


@pytest.mark.parametrize("change", ["one more image", "one image less"])
def test_counts_that_differ_are_an_error(scene: Path, image_writer, change: str) -> None:
    if change == "one more image":
        image_writer(scene / "images" / "frame_006.png")
    else:
        (scene / "images" / "frame_005.png").unlink()
    count = 7 if change == "one more image" else 5
    with pytest.raises(BadFile, match=rf"robot_poses\.txt: has 6 poses for {count} images in .*images; which pose"):
        read_recording(scene)


def test_jpeg_comes_before_png(scene: Path, truth, image_writer) -> None:
    for i in range(6):
        image_writer(scene / "images" / f"shot_{i}.JPG")
    assert [frame.name for frame in read_recording(scene).frames] == [f"shot_{i}.JPG" for i in range(6)]


def test_hidden_files_and_folders_beside_are_not_looked_at(scene: Path) -> None:
    (scene / "images" / "._frame_000.png").write_bytes(b"x")
    (scene / "images" / "notes.txt").write_text("x")
    (scene / "depth").mkdir()
    assert len(read_recording(scene).frames) == 6


def test_images_of_two_kinds_are_no_riddle(scene: Path, image_writer) -> None:
    (scene / "images" / "frame_002.png").unlink()
    image_writer(scene / "images" / "frame_002.jpg")
    with pytest.raises(BadFile, match=r"6 poses for 1 images in .*\(5 PNG images beside the JPEG ones, frame_000\.png"):
        read_recording(scene)


def test_names_that_sort_two_ways_are_an_error(scene: Path) -> None:
    for old, new in ((2, 9), (3, 10)):
        (scene / "images" / f"frame_00{old}.png").rename(scene / "images" / f"frame_{new}.png")
    with pytest.raises(BadFile, match=r"sort two ways: frame_10\.png or frame_9\.png first; .* pad the numbers"):
        read_recording(scene)


def test_the_camera_in_the_wrist_may_stand_one_number_a_line(scene: Path, truth) -> None:
    file = scene / "camera_extrinsics.txt"
    file.write_text("\n".join(file.read_text().split()))
    np.testing.assert_allclose(read_recording(scene).Ts_world_camera, truth.Ts, atol=1e-9)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("0 0 0 0 0 0 1\n0 0 0 0 0 0 1", r"extrinsics\.txt: has 14 numbers; the camera in the wrist is 7"),
        ("0 0 0 0 0 0 2", r"extrinsics\.txt:1: its quaternion has length 2, not 1"),
        ("0\n0\n0", r"extrinsics\.txt: has 3 numbers"),
    ],
)
def test_bad_camera_in_the_wrist(scene: Path, text: str, message: str) -> None:
    (scene / "camera_extrinsics.txt").write_text(text)
    with pytest.raises(BadFile, match=message):
        read_recording(scene)


@pytest.mark.parametrize("name", ["camera_extrinsics.txt", "camera_intrinsics.txt"])
def test_a_missing_file_is_named(scene: Path, name: str) -> None:
    (scene / name).unlink()
    with pytest.raises(BadFile, match=f"{name}: is missing"):
        read_recording(scene)


def test_a_missing_or_empty_image_folder(scene: Path, tmp_path: Path) -> None:
    with pytest.raises(BadFile, match="none: the folder is missing"):
        read_recording(scene, options=ReadOptions(images=tmp_path / "none"))
    (tmp_path / "empty").mkdir()
    with pytest.raises(BadFile, match="empty: holds no JPEG and no PNG image"):
        read_recording(scene, options=ReadOptions(images=tmp_path / "empty"))
    with pytest.raises(BadFile, match=r"robot_poses\.txt: is not a folder"):
        read_recording(scene, options=ReadOptions(images=scene / "robot_poses.txt"))


def test_a_file_is_no_scene(scene: Path) -> None:
    with pytest.raises(BadFile, match="an ARS scene is a folder"):
        read_recording(scene / "robot_poses.txt", format="ars")


def test_an_image_that_asks_to_be_turned_is_skipped(scene: Path) -> None:
    image = scene / "images" / "frame_001.png"
    data = image.read_bytes()
    exif = b"II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x06\0\0\0\0\0\0\0"
    image.write_bytes(data[:33] + len(exif).to_bytes(4, "big") + b"eXIf" + exif + bytes(4) + data[33:])
    (skipped,) = read_recording(scene).skipped
    assert skipped.name == "frame_001.png"
    assert "Exif orientation 6" in skipped.reason


def test_a_truncated_image_is_skipped(scene: Path) -> None:
    image = scene / "images" / "frame_005.png"
    image.write_bytes(image.read_bytes()[:-20])
    (skipped,) = read_recording(scene).skipped
    assert skipped.name == "frame_005.png"
    assert "truncated" in skipped.reason


def test_a_name_that_cannot_be_printed_is_skipped(scene: Path) -> None:
    (scene / "images" / "frame_001.png").rename(scene / "images" / "frame_001\n.png")
    (skipped,) = read_recording(scene).skipped
    assert skipped.name == "frame_001\n.png"
    assert "cannot be printed" in skipped.reason


def test_nothing_is_read_of_other_json_beside(scene: Path) -> None:
    (scene / "truth.json").write_text(json.dumps({"frames": []}))
    assert read_recording(scene).format == "ars"
