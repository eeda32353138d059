"""BOP scenes as recordings: poses in metres, a camera of each image's own K, and the boxes of what rests."""

import json
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from ars_web.errors import BadFile, RefusedPath
from ars_web.geometry.box import iou
from ars_web.recordings.registry import ReadOptions, detect_formats, read_recording


@pytest.fixture
def scene(bop_scene: ModuleType, ring_scene: ModuleType, tmp_path: Path) -> Path:
    return bop_scene.write(ring_scene, tmp_path / "bop")


def changed(file: Path, change: Callable[[Any], object]) -> None:
    content = json.loads(file.read_text())
    change(content)
    file.write_text(json.dumps(content))


def test_a_scene_is_found_and_read(scene: Path, ring_scene: ModuleType) -> None:
    assert detect_formats(scene) == ["bop"]
    found = read_recording(scene)
    assert [frame.name for frame in found.frames] == [f"{i:06d}.png" for i in range(6)]
    np.testing.assert_allclose(found.Ts_world_camera, ring_scene.poses()[:6], atol=1e-9)
    (camera,) = found.cameras.values()
    want = ring_scene.CAMERA
    assert (camera.fx, camera.cx, camera.width, camera.model) == (want.fx, want.cx, want.width, "pinhole")
    assert read_recording(scene / "scene_camera.json").frames[2].name == "000002.png"


def test_boxes_come_with_it_at_their_centres(scene: Path, bop_scene: ModuleType) -> None:
    found = read_recording(scene)
    assert found.class_names == ("obj_000001", "obj_000007")
    assert [one.class_name for one in found.boxes] == ["obj_000001", "obj_000001", "obj_000007"]
    for one, (_, want) in zip(found.boxes[:2], bop_scene.OBJECTS, strict=False):
        assert iou(one.box, want) > 1 - 1e-6
    cylinder, want = found.boxes[2].box, bop_scene.OBJECTS[2][1]
    np.testing.assert_allclose(cylinder.T_world_box[:3, [2, 3]], want.T_world_box[:3, [2, 3]], atol=1e-9)
    np.testing.assert_allclose(cylinder.size, want.size)


def test_an_image_without_a_world_pose_is_skipped_and_so_is_one_that_is_missing(scene: Path) -> None:
    changed(scene / "scene_camera.json", lambda cameras: cameras["2"].pop("cam_t_w2c"))
    (scene / "rgb" / "000004.png").unlink()
    found = read_recording(scene)
    assert [frame.name for frame in found.frames] == [f"{i:06d}.png" for i in (0, 1, 3, 5)]
    assert [one.name for one in found.skipped] == ["000002.png", "000004.png"]
    assert "has no cam_R_w2c and cam_t_w2c" in found.skipped[0].reason
    assert len(found.boxes) == 3


def test_cameras_of_several_K_are_several(scene: Path) -> None:
    changed(scene / "scene_camera.json", lambda cameras: cameras["1"]["cam_K"].__setitem__(2, 100.0))
    found = read_recording(scene)
    assert [frame.camera_id for frame in found.frames] == [0, 1, 0, 0, 0, 0]
    assert found.cameras[1].cx == 100.0


def test_what_moves_or_has_no_model_is_listed_and_not_imported(
    bop_scene: ModuleType, ring_scene: ModuleType, tmp_path: Path
) -> None:
    scene = bop_scene.write(ring_scene, tmp_path / "bop")

    def carry(truth: Any) -> None:
        for i, objects in truth.items():
            T = ring_scene.poses()[int(i)]
            T_world_box = bop_scene.OBJECTS[2][1].T_world_box.copy()
            T_world_box[0, 3] += 0.02 * int(i)
            objects[2] = bop_scene.truth_of(T, 7, T_world_box)
            objects[1]["obj_id"] = 99

    changed(scene / "scene_gt.json", carry)
    found = read_recording(scene)
    assert [one.class_name for one in found.boxes] == ["obj_000001"]
    reasons = {one.name: one.reason for one in found.skipped}
    assert "does not rest" in reasons["obj_000007, first in image 0"]
    assert "its size is not known" in reasons["obj_id 99"]


@pytest.mark.parametrize(
    ("file", "change", "said"),
    [
        ("scene_camera.json", lambda c: c["1"]["cam_K"].pop(), "image 1: cam_K has 8 numbers, not 9"),
        ("scene_camera.json", lambda c: c["1"]["cam_K"].__setitem__(1, 3.0), "image 1: cam_K must be fx 0 cx"),
        ("scene_camera.json", lambda c: c["1"].pop("cam_K"), "1.cam_K: Field required"),
        ("scene_camera.json", lambda c: c["3"].update(cam_R_w2c=[1.0]), "image 3: cam_R_w2c has 1 numbers"),
        ("scene_gt.json", lambda t: t["3"][1].update(cam_R_m2c=[2.0, 0, 0, 0, 1, 0, 0, 0, 1]), "image 3, object 1"),
        ("scene_gt.json", lambda t: t["3"][1]["cam_t_m2c"].__setitem__(0, float("nan")), "not finite"),
        ("scene_gt.json", lambda t: t["3"][1].pop("obj_id"), "3[1].obj_id: Field required"),
    ],
)
def test_damage_is_named_with_its_place(scene: Path, file: str, change: Callable[[Any], object], said: str) -> None:
    changed(scene / file, change)
    with pytest.raises(BadFile) as refused:
        read_recording(scene)
    assert str(refused.value).startswith(str(scene / file))
    assert said in str(refused.value)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda m: m["1"].update(size_x=-3.0), "model 1: a box's size must be"),
        (lambda m: m["1"].update(min_z=float("inf")), "model 1: min_x, min_y, min_z must be finite"),
        (lambda m: m["1"]["symmetries_discrete"][0].__setitem__(0, 5.0), "symmetries_discrete[0]: not a rotation"),
        (
            lambda m: m["1"].update(symmetries_discrete=[[0.8, -0.6, 0, 4, 0.6, 0.8, 0, -12, 0, 0, 1, 0, 0, 0, 0, 1]]),
            "model 1: symmetries_discrete: a turn by 36.87 degrees is no whole part",
        ),
        (lambda m: m["7"]["symmetries_continuous"][0].update(axis=[0, 0, 0]), "must have a direction"),
    ],
)
def test_damaged_models_are_named(scene: Path, change: Callable[[Any], object], said: str) -> None:
    file = scene.parents[1] / "models" / "models_info.json"
    changed(file, change)
    with pytest.raises(BadFile, match=r"models_info\.json") as refused:
        read_recording(scene)
    assert said in str(refused.value)


def test_models_beyond_what_may_be_read_are_not_looked_for(scene: Path) -> None:
    found = read_recording(scene, options=ReadOptions(within=scene))
    assert found.boxes == ()
    outside = scene.parents[1] / "elsewhere"
    (scene / "rgb").rename(outside)
    (scene / "rgb").symlink_to(outside)
    with pytest.raises(RefusedPath):
        read_recording(scene, options=ReadOptions(within=scene))
