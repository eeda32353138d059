from pathlib import Path

import numpy as np
import pytest

from ars_web.errors import BadFile, BadInput, RefusedPath
from ars_web.recordings.registry import ReadOptions, read_recording


@pytest.fixture
def folder(written) -> Path:
    return written("tum")


def timed(folder: Path, times: list[float], *, names: list[str] | None = None) -> None:
    """Turns the folder into one as TUM has it, with the images' times."""
    (folder / "images").rename(folder / "rgb")
    names = names or [f"rgb/frame_{i:03d}.png" for i in range(len(times))]
    lines = [f"{time!r} {name}" for time, name in zip(times, names, strict=True)]
    (folder / "rgb.txt").write_text("# color images\n# timestamp filename\n" + "\n".join(lines) + "\n")


def pose_times() -> list[float]:
    return [round(1000 + i / 30, 6) for i in range(6)]


def test_images_by_time(folder: Path, truth) -> None:
    timed(folder, [time + 0.004 for time in pose_times()])
    recording = read_recording(folder)
    assert [frame.name for frame in recording.frames] == truth.names
    np.testing.assert_allclose(recording.Ts_world_camera, truth.Ts, atol=1e-9)


def test_times_in_any_order(folder: Path, truth) -> None:
    timed(folder, [time - 0.004 for time in pose_times()])
    for file, comments in ((folder / "trajectory.txt", 1), (folder / "rgb.txt", 2)):
        lines = file.read_text().splitlines()
        file.write_text("\n".join(lines[:comments] + lines[:comments:-1] + [lines[comments]]))
    recording = read_recording(folder)
    by_name = {frame.name: frame.T_world_camera for frame in recording.frames}
    np.testing.assert_allclose([by_name[name] for name in truth.names], truth.Ts, atol=1e-9)


def test_images_far_from_every_pose_are_skipped(folder: Path, truth) -> None:
    times = pose_times()
    timed(folder, [times[0] - 0.03, *times[1:5], times[5] + 5])
    recording = read_recording(folder)
    assert [frame.name for frame in recording.frames] == truth.names[1:5]
    assert [one.name for one in recording.skipped] == [truth.names[0], truth.names[5]]
    assert "no pose within 0.02 s of it; the nearest is 0.03 s away" in recording.skipped[0].reason
    assert recording.skipped[0].where == f"{folder / 'rgb.txt'}:3"


def test_one_pose_serves_one_image(folder: Path, truth) -> None:
    lines = (folder / "trajectory.txt").read_text().splitlines()
    (folder / "trajectory.txt").write_text("\n".join(lines[:2]))
    timed(folder, [1000.01, 1000.001], names=["rgb/frame_000.png", "rgb/frame_001.png"])
    recording = read_recording(folder)
    assert [frame.name for frame in recording.frames] == ["frame_001.png"]
    assert "belongs to an image that is nearer" in recording.skipped[0].reason


def test_a_bad_pose_gives_no_image_its_place(folder: Path, truth) -> None:
    lines = (folder / "trajectory.txt").read_text().splitlines()
    lines[3] = "1000.066667 nan 0 0 0 0 0 1"
    (folder / "trajectory.txt").write_text("\n".join(lines))
    timed(folder, pose_times())
    recording = read_recording(folder)
    assert [one.name for one in recording.skipped] == ["frame_002.png"]
    np.testing.assert_allclose(recording.Ts_world_camera, np.delete(truth.Ts, 2, axis=0), atol=1e-9)


def test_a_bad_pose_without_times_is_skipped_with_its_image(folder: Path) -> None:
    lines = (folder / "trajectory.txt").read_text().splitlines()
    lines[3] = "1000.066667 0 0 0 0 0 0 0"
    (folder / "trajectory.txt").write_text("\n".join(lines))
    (skipped,) = read_recording(folder).skipped
    assert (skipped.name, skipped.where) == ("frame_002.png", f"{folder / 'trajectory.txt'}:4")


def test_no_pose_at_all_can_be_used(folder: Path) -> None:
    timed(folder, pose_times())
    (folder / "trajectory.txt").write_text("1000 nan 0 0 0 0 0 1\n")
    with pytest.raises(BadFile, match=r"none of its 1 poses can be used; the first: its position nan 0 0 .*txt:1"):
        read_recording(folder)


@pytest.mark.parametrize("line", ["1000.5", "soon rgb/frame_000.png"])
def test_a_bad_line_of_times(folder: Path, line: str) -> None:
    timed(folder, pose_times())
    with (folder / "rgb.txt").open("a") as file:
        file.write(line)
    with pytest.raises(BadFile, match=r"rgb\.txt:9: is not `timestamp file`"):
        read_recording(folder)


def test_times_of_no_image(folder: Path) -> None:
    timed(folder, [])
    with pytest.raises(BadFile, match=r"rgb\.txt: lists no image"):
        read_recording(folder)


def test_a_time_that_is_nan_has_no_pose(folder: Path) -> None:
    timed(folder, [float("nan"), *pose_times()[1:]])
    (skipped,) = read_recording(folder).skipped
    assert skipped.name == "frame_000.png"


def test_counts_that_differ_are_an_error(folder: Path) -> None:
    (folder / "images" / "frame_000.png").unlink()
    with pytest.raises(BadFile, match=r"trajectory\.txt: has 6 poses for 5 images in .*images; without an rgb\.txt"):
        read_recording(folder)


def test_images_and_camera_one_level_up(folder: Path, truth) -> None:
    below = folder / "formats"
    below.mkdir()
    (folder / "trajectory.txt").rename(below / "tum.txt")
    recording = read_recording(below / "tum.txt")
    assert recording.cameras == {0: truth.camera}
    assert [frame.name for frame in recording.frames] == truth.names
    with pytest.raises(RefusedPath):
        read_recording(below / "tum.txt", options=ReadOptions(within=below))


def test_two_image_folders_are_ambiguous(folder: Path, image_writer) -> None:
    image_writer(folder / "rgb" / "frame_000.png")
    with pytest.raises(BadInput, match=r"could be in .*images or in .*rgb; say which"):
        read_recording(folder)
    assert len(read_recording(folder, options=ReadOptions(images=folder / "images")).frames) == 6


def test_no_image_folder_says_what_to_do(folder: Path, tmp_path: Path) -> None:
    (folder / "images").rename(tmp_path / "pictures")
    with pytest.raises(BadFile, match=r"there is no image folder at .*images, .*rgb or .*images; say where"):
        read_recording(folder)
    assert len(read_recording(folder, options=ReadOptions(images=tmp_path / "pictures")).frames) == 6


def test_no_camera_says_what_to_do(folder: Path, tmp_path: Path, truth) -> None:
    camera = (folder / "camera_intrinsics.txt").rename(tmp_path / "camera.txt")
    with pytest.raises(BadFile, match=r"camera_intrinsics\.txt: is missing: .*Give a camera file \(w h fx fy cx cy k1"):
        read_recording(folder)
    assert read_recording(folder, options=ReadOptions(camera=camera)).cameras == {0: truth.camera}


def test_two_different_cameras_are_ambiguous(folder: Path, tmp_path: Path) -> None:
    pictures = tmp_path / "other" / "images"
    pictures.parent.mkdir()
    (folder / "images").rename(pictures)
    options = ReadOptions(images=pictures)
    (pictures.parent / "camera_intrinsics.txt").write_text((folder / "camera_intrinsics.txt").read_text())
    assert len(read_recording(folder, options=options).frames) == 6
    (pictures.parent / "camera_intrinsics.txt").write_text("64 48 60 60 32 24")
    with pytest.raises(BadInput, match="hold different cameras; give the camera file that is meant"):
        read_recording(folder, options=options)


def test_two_trajectories_are_ambiguous(folder: Path) -> None:
    (folder / "groundtruth.txt").write_text((folder / "trajectory.txt").read_text())
    with pytest.raises(BadInput, match=r"holds the trajectories groundtruth\.txt, trajectory\.txt; give one"):
        read_recording(folder)
    assert len(read_recording(folder / "trajectory.txt").frames) == 6


def test_a_bad_line_is_named(folder: Path) -> None:
    with (folder / "trajectory.txt").open("a") as file:
        file.write("\n1000.9 0 0 0 0 0 1\n")
    with pytest.raises(BadFile, match=r"trajectory\.txt:8: has 7 values; a line has 8 numbers \(timestamp tx ty tz"):
        read_recording(folder)
