from pathlib import Path

import numpy as np
import pytest

from ars_web.errors import BadFile, BadInput
from ars_web.recordings.registry import ReadOptions, detect_formats, read_recording


@pytest.fixture
def folder(written) -> Path:
    return written("poses")


def spelled(rows: np.ndarray) -> str:
    return "\n".join(" ".join(map(repr, row)) for row in rows.tolist())


def rows_of(Ts: np.ndarray, width: int) -> str:
    if width == 4:
        return "\n\n".join(spelled(T) for T in Ts)
    return spelled(Ts.reshape(-1, 16)[:, :width])


@pytest.mark.parametrize("width", [16, 12, 4])
def test_the_three_ways_to_write_a_matrix(folder: Path, truth, width: int) -> None:
    (folder / "poses.txt").write_text("# T_world_camera\n" + rows_of(truth.Ts, width))
    for path in (folder, folder / "poses.txt"):
        assert detect_formats(path) == ["poses"]
        np.testing.assert_allclose(read_recording(path).Ts_world_camera, truth.Ts, atol=1e-9)


@pytest.mark.parametrize(("width", "line"), [(16, 2), (4, 6)])
def test_one_bad_matrix_is_a_skipped_frame(folder: Path, truth, width: int, line: int) -> None:
    Ts = truth.Ts.copy()
    Ts[1, :3, :3] *= 1.1
    (folder / "poses.txt").write_text(rows_of(Ts, width))
    recording = read_recording(folder)
    assert len(recording.frames) == 5
    (skipped,) = recording.skipped
    assert skipped.name == "frame_001.png"
    assert "is there a scale in it?" in skipped.reason
    assert skipped.where == f"{folder / 'poses.txt'}:{line}"


def test_scaled_matrices_throughout_are_an_error(folder: Path, truth) -> None:
    Ts = truth.Ts.copy()
    Ts[:, :3, :3] *= 1000
    (folder / "poses.txt").write_text(rows_of(Ts, 16))
    with pytest.raises(BadFile, match=r"none of its 6 frames can be used; .*is there a scale in it"):
        read_recording(folder)


def test_a_matrix_that_breaks_off(folder: Path, truth) -> None:
    (folder / "poses.txt").write_text(rows_of(truth.Ts, 4).rsplit("\n", 1)[0])
    with pytest.raises(BadFile, match=r"poses\.txt:28: has 23 lines of 4 numbers; a matrix has four"):
        read_recording(folder)


@pytest.mark.parametrize("text", ["1 2 3\n", "0 0 0 0 0 0 1\n", "nothing\n"])
def test_rows_that_are_no_matrix_are_named(folder: Path, text: str) -> None:
    (folder / "poses.txt").write_text("# c\n" + text)
    with pytest.raises(BadFile, match=r"poses\.txt:2: has \d values; a line has 16 numbers .* or 12 numbers"):
        read_recording(folder)


def test_counts_that_differ_are_an_error(folder: Path, truth) -> None:
    (folder / "poses.txt").write_text(rows_of(truth.Ts[:5], 16))
    with pytest.raises(BadFile, match=r"poses\.txt: has 5 poses for 6 images in .*images; which pose is whose"):
        read_recording(folder)


def test_images_beside_the_poses(folder: Path, truth) -> None:
    for image in (folder / "images").iterdir():
        image.rename(folder / image.name)
    with pytest.raises(BadInput, match=r"could be in .*images or beside it; say which"):
        read_recording(folder)
    (folder / "images").rmdir()
    assert [frame.name for frame in read_recording(folder).frames] == truth.names


def test_no_images_say_what_to_do(folder: Path, tmp_path: Path) -> None:
    (folder / "images").rename(tmp_path / "pictures")
    with pytest.raises(BadFile, match=r"there are no images in .*images and none beside it; say where"):
        read_recording(folder)
    assert len(read_recording(folder, options=ReadOptions(images=tmp_path / "pictures")).frames) == 6


def test_no_camera_says_what_to_do(folder: Path) -> None:
    (folder / "camera_intrinsics.txt").unlink()
    with pytest.raises(BadFile, match=r"camera_intrinsics\.txt: is missing: .*Give a camera file"):
        read_recording(folder)
