"""How a wrist held the camera, read once more from the recording that a session was made from."""

import json
from pathlib import Path

import numpy as np
import pytest

from ars_web.errors import BadFile, NotFound, RefusedPath
from ars_web.geometry import rigid_transform
from ars_web.recordings.hand_eye import recorded_hand_eye

SEVEN = (0.1, -0.2, 0.3, 0.0, 0.0, 0.6, 0.8)
T_WRIST_CAMERA = rigid_transform.from_position_wxyz(np.array(SEVEN[:3]), np.array([0.8, 0.0, 0.0, 0.6]))


def scene_folder(folder: Path, text: str) -> Path:
    folder.mkdir()
    (folder / "camera_extrinsics.txt").write_text(text)
    return folder


@pytest.mark.parametrize("separator", [" ", "\n"])
def test_a_scene_folder_holds_it_in_a_file(tmp_path: Path, separator: str) -> None:
    folder = scene_folder(tmp_path / "scene", separator.join(map(str, SEVEN)) + "\n")
    assert recorded_hand_eye("ars", folder) == pytest.approx(T_WRIST_CAMERA)


def test_a_manifest_holds_it(tmp_path: Path) -> None:
    camera = dict.fromkeys(("width", "height", "fx", "fy", "cx", "cy"), 50.0)
    content = {"scene_path": ".", "image_filenames_lists": [], "robot_poses": [], "camera_params": camera}
    manifest = tmp_path / "scene.roars"
    manifest.write_text(json.dumps({**content, "robot_to_camera_pose": SEVEN}))
    assert recorded_hand_eye("roars", manifest) == pytest.approx(T_WRIST_CAMERA)
    assert recorded_hand_eye("roars", tmp_path) == pytest.approx(T_WRIST_CAMERA)
    manifest.write_text(json.dumps({**content, "robot_to_camera_pose": [0.0] * 7}))
    with pytest.raises(BadFile, match=r"scene\.roars: robot_to_camera_pose: .*length 0"):
        recorded_hand_eye("roars", manifest)


def test_other_formats_do_not_have_it(tmp_path: Path) -> None:
    with pytest.raises(NotFound, match="format colmap does not say how a wrist held its camera"):
        recorded_hand_eye("colmap", tmp_path)


@pytest.mark.parametrize("source", ["gone", "archive.zip"])
def test_a_recording_that_is_gone_is_told(tmp_path: Path, source: str, monkeypatch: pytest.MonkeyPatch) -> None:
    # An uploaded archive is known by its name alone, which must not be looked for where the server happens to run.
    monkeypatch.chdir(tmp_path)
    (tmp_path / "archive.zip").touch()
    named = Path(source) if source == "archive.zip" else tmp_path / source
    with pytest.raises(NotFound, match=f"{source} any more"):
        recorded_hand_eye("ars", named)


def test_a_damaged_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(BadFile, match=r"camera_extrinsics\.txt: has 2 numbers; the camera in the wrist is 7"):
        recorded_hand_eye("ars", scene_folder(tmp_path / "short", "1\n2\n"))
    with pytest.raises(BadFile, match=r"camera_extrinsics\.txt:1: .*quaternion has length 0"):
        recorded_hand_eye("ars", scene_folder(tmp_path / "still", "0 0 0 0 0 0 0\n"))


def test_links_that_lead_elsewhere_are_not_followed(tmp_path: Path) -> None:
    elsewhere = scene_folder(tmp_path / "elsewhere", " ".join(map(str, SEVEN)))
    folder = tmp_path / "scene"
    folder.mkdir()
    (folder / "camera_extrinsics.txt").symlink_to(elsewhere / "camera_extrinsics.txt")
    with pytest.raises(RefusedPath, match="leads outside"):
        recorded_hand_eye("ars", folder)
