import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ars_web.errors import BadFile, BadInput, RefusedPath
from ars_web.geometry.camera import Camera
from ars_web.recordings.registry import ReadOptions, detect_formats, read_recording

KEYS = ("w", "h", "fl_x", "fl_y", "cx", "cy", "camera_model", "k1", "k2", "p1", "p2", "k3")


@pytest.fixture
def transforms(written, truth) -> Callable[..., Path]:
    """A transforms.json with some keys changed; None removes a key."""
    folder = written("nerfstudio")

    def write(**changes: Any) -> Path:
        content = truth.transforms() | changes
        file = folder / "transforms.json"
        file.write_text(json.dumps({key: value for key, value in content.items() if value is not None}, indent=1))
        return file

    return write


def frames_of(truth, **changes: Any) -> list[dict[str, Any]]:
    return [frame | changes for frame in truth.transforms()["frames"]]


def test_cameras_of_single_frames(transforms: Callable[..., Path], truth) -> None:
    frames = frames_of(truth)
    frames[1] |= {"fl_x": 70.0, "cx": 31.0}
    frames[4] |= {"fl_x": 70.0, "cx": 31.0}
    frames[5] |= {"k1": 0.5, "k3": None}
    recording = read_recording(transforms(frames=frames))
    assert [frame.camera_id for frame in recording.frames] == [0, 1, 0, 0, 1, 2]
    assert recording.cameras[0] == truth.camera
    assert (recording.cameras[1].fx, recording.cameras[1].cx, recording.cameras[1].fy) == (70.0, 30.5, truth.camera.fy)
    assert recording.cameras[2].distortion == (0.5, *truth.camera.distortion[1:])


def test_all_intrinsics_in_the_frames(transforms: Callable[..., Path], truth) -> None:
    own = {key: truth.transforms()[key] for key in KEYS}
    file = transforms(frames=frames_of(truth, **own), **dict.fromkeys(KEYS))
    assert read_recording(file).cameras == {0: truth.camera}


@pytest.mark.parametrize("rows", [3, 4])
def test_applied_transform_and_scale_are_undone(
    transforms: Callable[..., Path], truth, random_pose: Callable[[np.random.Generator], np.ndarray], rows: int
) -> None:
    applied = random_pose(np.random.default_rng(1))
    frames = frames_of(truth)
    for frame in frames:
        saved = applied @ np.array(frame["transform_matrix"])
        saved[:3, 3] *= 0.25
        frame["transform_matrix"] = saved.tolist()
    file = transforms(frames=frames, applied_transform=applied[:rows].tolist(), applied_scale=0.25)
    np.testing.assert_allclose(read_recording(file).Ts_world_camera, truth.Ts, atol=1e-9)


def test_matrices_of_three_rows(transforms: Callable[..., Path], truth) -> None:
    frames = frames_of(truth)
    for frame in frames[::2]:
        frame["transform_matrix"] = frame["transform_matrix"][:3]
    np.testing.assert_allclose(read_recording(transforms(frames=frames)).Ts_world_camera, truth.Ts, atol=1e-9)


def test_a_frame_without_an_image_is_skipped_and_listed(transforms: Callable[..., Path], truth) -> None:
    file = transforms()
    (file.parent / "images" / "frame_002.png").unlink()
    recording = read_recording(file)
    assert [frame.name for frame in recording.frames] == [name for name in truth.names if name != "frame_002.png"]
    (skipped,) = recording.skipped
    assert skipped.name == "frame_002.png"
    assert "the image is missing" in skipped.reason
    line = 1 + file.read_text().splitlines().index('   "file_path": "images/frame_002.png",')
    assert skipped.where == f"{file}:{line}"


@pytest.mark.parametrize(
    ("entry", "reason"), [(math.nan, "not finite"), (math.inf, "not finite"), (5.0, "not a rotation")]
)
def test_a_bad_pose_is_skipped(transforms: Callable[..., Path], truth, entry: float, reason: str) -> None:
    frames = frames_of(truth)
    frames[3]["transform_matrix"][0][0] = entry
    recording = read_recording(transforms(frames=frames))
    assert [one.name for one in recording.skipped] == ["frame_003.png"]
    assert reason in recording.skipped[0].reason


def test_fisheye(transforms: Callable[..., Path], truth) -> None:
    changes = {"k1": 0.1, "k2": 0.02, "k3": 0.003, "k4": 0.0004, "p1": None, "p2": 0}
    c = truth.camera
    expected = Camera(c.width, c.height, c.fx, c.fy, c.cx, c.cy, "fisheye", (0.1, 0.02, 0.003, 0.0004))
    assert read_recording(transforms(camera_model="OPENCV_FISHEYE", **changes)).cameras == {0: expected}
    assert read_recording(transforms(camera_model=None, is_fisheye=True, **changes)).cameras == {0: expected}


def test_pinhole_without_its_optional_names(transforms: Callable[..., Path], truth) -> None:
    removed = dict.fromkeys(["fl_y", "cx", "cy", "k1", "k2", "k3", "p1", "p2"])
    camera = read_recording(transforms(camera_model="PINHOLE", **removed)).cameras[0]
    assert camera == Camera(64, 48, truth.camera.fx, truth.camera.fx, 31.5, 23.5)


def test_a_blender_style_set(transforms: Callable[..., Path], truth) -> None:
    frames = [frame | {"file_path": f"./images/frame_{i:03d}"} for i, frame in enumerate(frames_of(truth))]
    file = transforms(frames=frames, camera_angle_x=0.8, **dict.fromkeys(KEYS))
    file = file.rename(file.parent / "transforms_train.json")
    for path in (file, file.parent):
        recording = read_recording(path)
        focal = 64 / (2 * math.tan(0.4))
        assert recording.cameras == {0: Camera(64, 48, focal, focal, 31.5, 23.5)}
        assert [frame.name for frame in recording.frames] == truth.names
    (file.parent / "images" / "frame_001.png").unlink()
    assert [one.name for one in read_recording(file).skipped] == ["frame_001"]


def test_images_of_several_folders_keep_their_folders_in_their_names(transforms: Callable[..., Path], truth) -> None:
    file = transforms()
    frames = frames_of(truth)
    for i, frame in enumerate(frames):
        moved = file.parent / "images" / f"cam{i % 2}" / f"{i // 2}.png"
        moved.parent.mkdir(exist_ok=True)
        (file.parent / "images" / truth.names[i]).rename(moved)
        frame["file_path"] = str(moved) if i == 0 else f"../nerfstudio/images/cam{i % 2}/{i // 2}.png"
    recording = read_recording(transforms(frames=frames))
    assert [frame.name for frame in recording.frames] == [f"cam{i % 2}/{i // 2}.png" for i in range(6)]
    moved = (file.parent / "images").rename(file.parent / "pictures")
    again = read_recording(file, options=ReadOptions(images=moved))
    assert [frame.name for frame in again.frames] == [f"cam{i % 2}/{i // 2}.png" for i in range(6)]


def test_paths_that_lead_out_are_refused_within(transforms: Callable[..., Path], truth, tmp_path: Path) -> None:
    image = tmp_path / "nerfstudio" / "images" / "frame_000.png"
    (tmp_path / "secret.png").write_bytes(image.read_bytes())
    for leading in ("../secret.png", str(tmp_path / "secret.png"), "images/../../secret"):
        frames = frames_of(truth)
        frames[2]["file_path"] = leading
        file = transforms(frames=frames)
        assert len(read_recording(file).frames) == 6
        with pytest.raises(RefusedPath, match=r"secret.* leads outside"):
            read_recording(file, options=ReadOptions(within=file.parent))
        with pytest.raises(RefusedPath, match=r"secret.* leads outside"):
            read_recording(transforms(frames=frames, w=None), options=ReadOptions(within=file.parent))


def test_a_path_with_a_nul_is_skipped(transforms: Callable[..., Path], truth, tmp_path: Path) -> None:
    frames = frames_of(truth)
    frames[2]["file_path"] = "ima\0ges/frame_002.png"
    for options in (ReadOptions(), ReadOptions(within=tmp_path)):
        recording = read_recording(transforms(frames=frames), options=options)
        assert len(recording.frames) == 5
        assert "cannot be printed" in recording.skipped[0].reason


def test_two_files_in_a_folder_are_ambiguous(transforms: Callable[..., Path]) -> None:
    file = transforms()
    (file.parent / "transforms_test.json").write_text(file.read_text())
    with pytest.raises(BadInput, match=r"holds transforms\.json, transforms_test\.json; give the one that is meant"):
        read_recording(file.parent)
    assert len(read_recording(file).frames) == 6


def test_a_mark_and_another_name(transforms: Callable[..., Path]) -> None:
    file = transforms()
    renamed = file.with_name("cameras.json")
    renamed.write_bytes(b"\xef\xbb\xbf" + file.read_bytes())
    assert detect_formats(renamed) == ["nerfstudio"]
    assert len(read_recording(renamed).frames) == 6


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"fl_x": None}, r"json:\d+: the camera of images/frame_000\.png: there is neither fl_x nor camera_angle_x"),
        ({"fl_x": None, "camera_angle_x": 4}, "a camera angle must be between 0 and pi radians, not 4"),
        ({"fl_x": -5}, "focal lengths must be positive"),
        ({"w": 64.5}, "an image size is a whole number of pixels, not 64.5 x 48"),
        ({"camera_model": "EQUIRECTANGULAR"}, "camera_model 'EQUIRECTANGULAR' cannot be expressed exactly; known are"),
        ({"k4": 0.1}, "an OPENCV camera with k4 0.1 cannot be expressed exactly"),
        ({"camera_model": "OPENCV_FISHEYE"}, "a fisheye camera with p1 0.001 and p2 -0.002 cannot be expressed"),
        ({"frames": []}, r"json: lists no frame"),
        ({"frames": [{"file_path": "a.png"}]}, r"json: frames\[0\]\.transform_matrix: Field required"),
        ({"frames": [{"transform_matrix": []}]}, r"json: frames\[0\]\.file_path: Field required"),
        (
            {"frames": [{"file_path": "a.png", "transform_matrix": [[1, 2], [3, 4]]}]},
            r"json:\d+: the transform_matrix of a\.png is not 4 x 4 numbers",
        ),
        ({"applied_transform": [[2, 0, 0, 0], [0, 2, 0, 0], [0, 0, 2, 0]]}, "applied_transform: not a rotation"),
        ({"applied_transform": [[1, 0, 0, 0]]}, "applied_transform is not 3 x 4 or 4 x 4"),
        ({"applied_scale": 0}, "applied_scale must be a positive number, not 0"),
        ({"applied_scale": math.nan}, "applied_scale must be a positive number, not nan"),
    ],
)
def test_damaged_files_are_named(transforms: Callable[..., Path], changes: dict[str, Any], message: str) -> None:
    with pytest.raises(BadFile, match=rf"transforms\.json.*{message.removeprefix('json')}"):
        read_recording(transforms(**changes), format="nerfstudio")


def test_an_image_that_is_listed_twice_is_an_error(transforms: Callable[..., Path], truth) -> None:
    frames = frames_of(truth)
    frames[4]["file_path"] = "./images/frame_001.png"
    with pytest.raises(BadFile, match=r"lists frame_001\.png twice, in .*json:\d+ and in .*json:\d+; a frame has one"):
        read_recording(transforms(frames=frames))


def test_json_that_breaks_off_names_its_line(transforms: Callable[..., Path]) -> None:
    file = transforms()
    lines = file.read_text().splitlines()
    file.write_text("\n".join(lines[:60]))
    with pytest.raises(BadFile, match=r"transforms\.json:60: Invalid JSON"):
        read_recording(file)


def test_bytes_that_are_not_utf8(transforms: Callable[..., Path]) -> None:
    file = transforms()
    file.write_bytes(file.read_bytes().replace(b"frame_003", b"frame_\xff"))
    with pytest.raises(BadFile, match=r"transforms\.json:\d+: Invalid JSON"):
        read_recording(file)
