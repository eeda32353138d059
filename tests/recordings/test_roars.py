import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ars_web.errors import BadFile, BadInput, RefusedPath
from ars_web.recordings.recording import Recording
from ars_web.recordings.registry import ReadOptions, read_recording

QUAT = Rotation.from_euler("xyz", [0.3, -0.4, 0.9])


def instance(label: int, **changes: Any) -> dict[str, Any]:
    frame = [0.1, 0.2, 0.3, *QUAT.as_quat().tolist()]
    return {"_type": "TrainingInstance", "frame": frame, "size": [0.2, 0.4, 0.6], "label": label} | changes


def training_class(label: int, name: str, *instances: dict[str, Any]) -> dict[str, Any]:
    return {"_type": "TrainingClass", "label": label, "name": name, "instances": list(instances)}


@pytest.fixture
def manifest(written, truth) -> Callable[..., Path]:
    """A manifest with some keys changed; None removes a key."""
    file = written("roars")

    def write(**changes: Any) -> Path:
        content = truth.manifest("scene") | changes
        file.write_text(json.dumps({key: value for key, value in content.items() if value is not None}))
        return file

    return write


def test_classes_and_boxes_come_along(manifest: Callable[..., Path]) -> None:
    classes = {
        "10": training_class(10, "ten", instance(10, size=[1, 2, 3])),
        "-1": training_class(-1, "No-Class"),
        "1": training_class(1, "one"),
        "0": training_class(0, "zero", instance(0), instance(1)),
    }
    recording = read_recording(manifest(classes=classes))
    assert recording.class_names == ("zero", "one", "ten")
    assert [box.class_name for box in recording.boxes] == ["zero", "one", "ten"]
    assert recording.skipped == ()
    box = recording.boxes[0].box
    np.testing.assert_array_equal(box.size, [0.2, 0.4, 0.6])
    np.testing.assert_allclose(box.T_world_box[:3, :3], QUAT.as_matrix(), atol=1e-12)
    # The file's frame is at the bottom face: half a height along the box's own z lies the centre.
    np.testing.assert_allclose(box.T_world_box[:3, 3], np.array([0.1, 0.2, 0.3]) + QUAT.apply([0, 0, 0.3]), atol=1e-12)
    np.testing.assert_array_equal(recording.boxes[2].box.size, [1, 2, 3])


def test_a_box_of_no_class_is_listed(manifest: Callable[..., Path]) -> None:
    classes = {"-1": training_class(-1, "No-Class", instance(-1)), "0": training_class(0, "zero", instance(5))}
    recording = read_recording(manifest(classes=classes))
    assert recording.class_names == ("zero",)
    assert recording.boxes == ()
    assert [skipped.name for skipped in recording.skipped] == ["classes.-1.instances[0]", "classes.0.instances[0]"]
    assert all("no class" in skipped.reason for skipped in recording.skipped)


def test_a_class_without_a_name_gets_its_label(manifest: Callable[..., Path]) -> None:
    assert read_recording(manifest(classes={"3": training_class(3, " ")})).class_names == ("class 3",)


def test_a_folder_with_one_manifest(manifest: Callable[..., Path]) -> None:
    file = manifest()
    assert len(read_recording(file.parent).frames) == 6
    (file.parent / "other.roars").write_text(file.read_text())
    with pytest.raises(BadInput, match=r"holds other\.roars, scene\.roars; give the one that is meant"):
        read_recording(file.parent)


def test_the_scene_may_be_absolute_or_moved(manifest: Callable[..., Path], tmp_path: Path) -> None:
    file = manifest()
    scene = (file.parent / "scene").rename(tmp_path / "moved")
    assert len(read_recording(manifest(scene_path=str(scene))).frames) == 6
    with pytest.raises(BadFile, match=r"scene\.roars: its scene_path scene is no folder .* say where the images are"):
        read_recording(manifest())
    assert len(read_recording(manifest(), options=ReadOptions(images=scene / "images")).frames) == 6


def test_an_absolute_scene_is_refused_outside(
    manifest: Callable[..., Path], tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    file = manifest(scene_path=str(tmp_path_factory.mktemp("outside")))
    with pytest.raises(RefusedPath):
        read_recording(file, options=ReadOptions(within=tmp_path))
    with pytest.raises(RefusedPath):
        read_recording(manifest(scene_path="../../.."), options=ReadOptions(within=tmp_path))


def test_a_scene_or_an_image_with_a_nul(manifest: Callable[..., Path], truth, tmp_path: Path) -> None:
    with pytest.raises(RefusedPath, match="has a NUL in it"):
        read_recording(manifest(scene_path="sc\0ene"))
    file = manifest(image_filenames_lists=["a\0b.png", *truth.names[1:]])
    assert len(read_recording(file, options=ReadOptions(within=tmp_path)).frames) == 5


def test_names_may_be_relative_to_the_scene(manifest: Callable[..., Path], truth) -> None:
    file = manifest(images_path=None, image_filenames_lists=[f"images/{name}" for name in truth.names])
    assert [frame.name for frame in read_recording(file).frames] == truth.names


def test_a_missing_image_and_a_nan_are_skipped(manifest: Callable[..., Path], truth) -> None:
    poses = truth.manifest("scene")["robot_poses"]
    poses[1][0] = float("nan")
    file = manifest(robot_poses=poses)
    (file.parent / "scene" / "images" / "frame_004.png").unlink()
    recording: Recording = read_recording(file)
    assert len(recording.frames) == 4
    assert [(one.name, one.where) for one in recording.skipped] == [
        ("frame_001.png", str(file)),
        ("frame_004.png", str(file)),
    ]
    assert "nan" in recording.skipped[0].reason
    assert "missing" in recording.skipped[1].reason


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"robot_poses": [[0, 0, 0, 0, 0, 0, 1]]}, "has 1 robot_poses for 6 images"),
        ({"robot_poses": [[0, 0, 0]] * 6}, "robot_poses: pose 0 has 3 numbers, a pose has 7: x y z qx qy qz qw"),
        ({"robot_poses": [["a"] * 7] * 6}, r"robot_poses\[0\]\[0\]: Input should be a valid number"),
        ({"robot_to_camera_pose": [0, 0, 0, 0, 0, 0, 0]}, "robot_to_camera_pose: its quaternion has length 0"),
        ({"camera_params": {"width": 64}}, r"camera_params\.height: Field required"),
        ({"scene_path": None, "robot_poses": []}, "scene_path: Field required"),
        ({"classes": {"a": training_class(0, "x")}}, r"classes\.a"),
        ({"classes": {"0": training_class(0, "x"), "1": training_class(1, "x")}}, "two of its classes have one name"),
        (
            {"classes": {"0": training_class(0, "x", instance(0, size=[1, 0, 1]))}},
            r"classes\.0\.instances\[0\]: a box's size must be",
        ),
        (
            {"classes": {"0": training_class(0, "x", instance(0, size=[1, 1]))}},
            r"classes\.0\.instances\[0\]: a size has 3 lengths, not 2",
        ),
        (
            {"classes": {"0": training_class(0, "x", instance(0, frame=[0] * 7))}},
            r"classes\.0\.instances\[0\]: its quaternion has length 0",
        ),
    ],
)
def test_damaged_manifests_are_named(manifest: Callable[..., Path], changes: dict[str, Any], message: str) -> None:
    with pytest.raises(BadFile, match=rf"scene\.roars: {message}"):
        read_recording(manifest(**changes), format="roars")


def test_a_camera_that_is_none(manifest: Callable[..., Path], truth) -> None:
    camera = truth.manifest("scene")["camera_params"] | {"fx": -1}
    with pytest.raises(BadFile, match=r"scene\.roars: camera_params: focal lengths must be positive"):
        read_recording(manifest(camera_params=camera))


@pytest.mark.parametrize("cut", [0.3, 0.9])
def test_json_that_breaks_off_names_its_line(manifest: Callable[..., Path], cut: float) -> None:
    file = manifest()
    text = json.dumps(json.loads(file.read_text()), indent=1)
    file.write_text(text[: int(len(text) * cut)])
    with pytest.raises(BadFile, match=r"scene\.roars:\d+: Invalid JSON"):
        read_recording(file, format="roars")


def test_deep_nesting_is_refused(manifest: Callable[..., Path]) -> None:
    file = manifest()
    file.write_text('{"classes":' * 100_000)
    with pytest.raises(BadFile, match=r"scene\.roars:1: Invalid JSON: recursion limit"):
        read_recording(file, format="roars")
