"""NDDS JSON, read as DOPE's loader and NDDS' own files have it, and projected by OpenCV."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ars_web.datasets import plan as plans
from ars_web.datasets.jobs import plan_export, run_export
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.planned import ExportPlan, PlannedClass
from ars_web.datasets.readback.comparison import compare
from ars_web.datasets.samples import kept, label_table
from ars_web.datasets.writers.dope import CORNER_ORDER, UNSEEN_POINT, WRITER
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.keypoints import DEFAULT_KEYPOINTS
from ars_web.geometry.symmetry import Symmetry
from ars_web.sessions.model import FrameTable, SessionSnapshot

Make = Callable[..., SessionSnapshot]

PLAIN = Camera(640, 480, 600.0, 610.0, 320.5, 238.5)

ALL = {"train": 1.0, "val": 0.0, "test": 0.0}


def written(snapshots: list[SessionSnapshot], out: Path, **changes: object) -> ExportPlan:
    options = ExportOptions.model_validate({"images": "none", **changes})
    plan = plan_export(snapshots, format="dope", options=options, out=out, frames_per_shard=5)
    run_export(plan)
    return plan


def load(folder: Path) -> dict[str, dict[str, Any]]:
    """The frames' documents by stem, of all splits."""
    paths = [path for path in folder.glob("*/*.json") if not path.name.startswith("_")]
    return {path.stem: json.loads(path.read_bytes()) for path in sorted(paths, key=lambda path: path.name)}


def seen_from_the_origin(make_snapshot: Make, *objects: Box, classes: tuple[str, ...] = ("thing",)) -> SessionSnapshot:
    """One frame whose camera axes are the world's."""
    snapshot = make_snapshot(1, objects=list(objects), classes=classes, one_camera=True)
    frames = FrameTable(
        snapshot.frames.names, snapshot.frames.images, snapshot.frames.camera_ids, np.eye(4)[None].copy()
    )
    return replace(snapshot, cameras={0: PLAIN}, frames=frames)


def test_a_label_of_ndds_itself(make_snapshot: Make, tmp_path: Path) -> None:
    """An object as NDDS wrote it once: turned by half a turn about (0, 1, -1), 19.8 x 9 x 17.7 cm."""
    R = np.array([[-1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, -1.0, 0.0]])
    box = Box(rigid_transform.from_rotation(R, np.array([0.2, -0.06, 0.455])), np.array([0.198, 0.09, 0.177]))
    written([seen_from_the_origin(make_snapshot, box)], tmp_path / "d", split=ALL)
    (document,) = load(tmp_path / "d").values()
    (label,) = document["objects"]
    x, y, z, w = label["quaternion_xyzw"]
    assert np.abs(np.array([x, y, z, w]) @ [0, 0.70710678, -0.70710678, 0]) == pytest.approx(1, abs=1e-8)
    assert label["location"] == pytest.approx([20, -6, 45.5])
    np.testing.assert_allclose(label["pose_transform"], [[0, -1, 0, 0], [-1, 0, 0, 0], [0, 0, 1, 0], [20, -6, 45.5, 1]])
    np.testing.assert_allclose(
        label["cuboid"],
        [[10.1, -14.85, 50], [29.9, -14.85, 50], [29.9, -14.85, 41], [10.1, -14.85, 41],
         [10.1, 2.85, 50], [29.9, 2.85, 50], [29.9, 2.85, 41], [10.1, 2.85, 41]],
        atol=1e-5,
    )  # fmt: skip
    assert label["cuboid_centroid"] == label["location"]


def test_corners_are_in_the_order_that_the_solver_fits() -> None:
    # common/cuboid.py: x to the right, y down, z to the front; front face first, from the top right, to the left.
    right, left, top, bottom, front, rear = 1, -1, -1, 1, 1, -1
    expected = [
        [right, top, front], [left, top, front], [left, bottom, front], [right, bottom, front],
        [right, top, rear], [left, top, rear], [left, bottom, rear], [right, bottom, rear],
    ]  # fmt: skip
    assert CORNER_ORDER.tolist() == expected
    # What BlenderProc's generator wrote from June 2024 to August 2025: place i of Blender's corners is its number.
    blender = [[x, y, z] for x in (-1, 1) for y, z in ((-1, -1), (-1, 1), (1, 1), (1, -1))]
    june_2024 = [blender[[6, 2, 1, 5, 7, 3, 0, 4].index(i)] for i in range(8)]
    august_2025 = [blender[[5, 1, 2, 6, 4, 0, 3, 7].index(i)] for i in range(8)]
    assert august_2025 == expected
    assert june_2024 == [[x, -y, z] for x, y, z in expected]


def test_points_poses_and_boxes_are_where_the_objects_are(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(12)
    plan = written([snapshot], tmp_path / "d")
    table = label_table(snapshot, range(12))
    keep, _ = kept(table, plan.options)
    documents = load(tmp_path / "d")
    assert list(documents) == [f"{i:04d}" for i in range(12)]
    compared = 0
    for i, document in enumerate(documents.values()):
        camera = snapshot.cameras[int(i % 5 == 4)]
        inner = document["camera_data"]["intrinsics"]
        assert (inner["fx"], inner["cy"]) == (camera.fx, camera.cy)
        place = rigid_transform.from_rotation(
            Rotation.from_quat(document["camera_data"]["quaternion_xyzw_worldframe"]).as_matrix(),
            np.array(document["camera_data"]["location_worldframe"]) / 100,
        )
        np.testing.assert_allclose(place, snapshot.frames.Ts_world_camera[i], atol=1e-7)
        columns = np.flatnonzero(keep[i])
        assert len(document["objects"]) == len(columns)
        for label, column in zip(document["objects"], columns.tolist(), strict=True):
            box = snapshot.state.boxes[column + 1]
            assert (label["class"], label["name"], label["instance_id"]) == (
                ("cube", "tall one")[column % 2], box.name, box.id,
            )  # fmt: skip
            assert label["visibility"] == pytest.approx(table.visible[i, column], abs=5.1e-5)
            R = Rotation.from_quat(label["quaternion_xyzw"]).as_matrix()
            T_camera_box = np.linalg.inv(snapshot.frames.Ts_world_camera[i]) @ box.box.T_world_box
            np.testing.assert_allclose(R, T_camera_box[:3, :3], atol=1e-8)
            np.testing.assert_allclose(np.array(label["location"]) / 100, T_camera_box[:3, 3], atol=1e-8)
            (y0, x0), (y1, x1) = label["bounding_box"]["top_left"], label["bounding_box"]["bottom_right"]
            np.testing.assert_allclose(np.array([x0, y0, x1, y1]) + 0.5, table.bbox[i, column], atol=5.1e-5)
            points = np.array([label["cuboid_centroid"], *label["cuboid"]]) / 100
            if (points[:, 2] < 0.2).any():
                continue
            distortion = np.array(camera.distortion) if camera.distortion else np.zeros(5)
            pixels, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), camera.K, distortion)
            read = [label["projected_cuboid_centroid"], *label["projected_cuboid"]]
            np.testing.assert_allclose(read, pixels[:, 0], atol=1e-3)
            compared += 1
    assert compared > 10


def test_a_corner_behind_the_camera_is_off_every_image(make_snapshot: Make, tmp_path: Path) -> None:
    T = np.eye(4)
    T[2, 3] = 0.5
    beside = Box(T, np.array([0.2, 0.2, 2.0]))
    behind = Box(rigid_transform.from_rotation(np.eye(3), np.array([0, 0, -1.0])), np.array([0.1, 0.1, 0.1]))
    written([seen_from_the_origin(make_snapshot, beside, behind)], tmp_path / "d", split=ALL)
    (document,) = load(tmp_path / "d").values()
    (label,) = document["objects"]
    assert label["instance_id"] == 1
    points = np.array(label["projected_cuboid"])
    far = CORNER_ORDER[:, 2] > 0
    assert (points[~far] == UNSEEN_POINT).all()
    assert (points[far] > 0).all()
    assert label["projected_cuboid_centroid"] == [320.5, 238.5]
    # DOPE's points that it has not are there too.
    assert UNSEEN_POINT == -100


def test_symmetric_objects_are_written_in_the_pose_nearest_to_the_camera(
    make_snapshot: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    about_z = [rigid_transform.rotation_about_z(np.radians(degrees)) for degrees in (10, 100, 190, 280)]
    objects = [
        Box(rigid_transform.from_rotation(R, np.array([0.2 * i - 0.3, 0, 1.0])), np.array([0.1, 0.1, 0.05]))
        for i, R in enumerate(about_z)
    ]
    snapshot = seen_from_the_origin(make_snapshot, *objects)
    for kind, symmetry, angle in (
        ("plain", Symmetry(), None),
        ("discrete", Symmetry("discrete", rotations=(((0.0, 0.0, 1.0), 4),)), 10),
        ("continuous", Symmetry("continuous", axis=(0.0, 0.0, 1.0)), 0),
    ):
        planned = (PlannedClass("thing", DEFAULT_KEYPOINTS, symmetry),)
        monkeypatch.setattr(plans, "merged_classes", lambda snapshots, planned=planned: planned)
        plan = written([snapshot], tmp_path / kind, split=ALL)
        (document,) = load(tmp_path / kind).values()
        found = [
            Rotation.from_quat(label["quaternion_xyzw"]).as_euler("zyx", degrees=True)[0]
            for label in document["objects"]
        ]
        expected = [10, 100, -170, -80] if angle is None else [angle] * 4
        np.testing.assert_allclose(found, expected, atol=1e-6)
        settings = json.loads((tmp_path / kind / "train" / "_object_settings.json").read_bytes())
        assert ("symmetries_discrete" in settings["exported_objects"][0]) == (kind == "discrete")
        assert ("symmetries_continuous" in settings["exported_objects"][0]) == (kind == "continuous")
        assert compare(plan, plan.out).agrees


def test_settings_are_those_of_ndds(make_snapshot: Make, tmp_path: Path) -> None:
    written([make_snapshot(6, classes=("cube", "tall one", "third"))], tmp_path / "d", images="copy")
    for split in ("train", "val"):
        folder = tmp_path / "d" / split
        cameras = json.loads((folder / "_camera_settings.json").read_bytes())["camera_settings"]
        assert [camera["name"] for camera in cameras] == ["s1_0", "s1_1"]
        assert cameras[1]["intrinsic_settings"] == {
            "resX": 48, "resY": 64, "fx": 50.0, "fy": 50.0, "cx": 23.5, "cy": 31.5, "s": 0,
        }  # fmt: skip
        assert cameras[1]["captured_image_size"] == {"width": 48, "height": 64}
        assert cameras[1]["horizontal_fov"] == pytest.approx(np.degrees(2 * np.arctan(24 / 50)))
        objects = json.loads((folder / "_object_settings.json").read_bytes())
        assert objects["exported_object_classes"] == ["cube", "tall one", "third"]
        assert objects["exported_objects"][0]["cuboid_dimensions"] == [20.0, 15.0, 10.0]
        assert objects["exported_objects"][0]["fixed_model_transform"] == np.eye(4).tolist()
        # DOPE's loader takes images that have a JSON file beside them.
        assert all(path.with_suffix(".json").is_file() for path in folder.glob("*.jpg"))
        assert list(folder.glob("*.jpg"))


def test_what_is_lost_is_told(make_snapshot: Make, tmp_path: Path) -> None:
    def losses(images: str) -> list[str]:
        options = ExportOptions.model_validate({"images": images})
        snapshot = make_snapshot(4, classes=("Cube", "cube"))
        return list(WRITER.losses(plan_export([snapshot], format="dope", options=options, out=tmp_path / "d")))

    lens, several, names = losses("link")
    assert "up to 6.5 px off" in lens
    assert "Cube (2)" in several
    assert "Cube and cube" in names
    assert losses("rectify") == [several, names]


def test_odd_names_no_boxes_and_no_frames_in_a_split(make_snapshot: Make, tmp_path: Path) -> None:
    odd = 'a "tall" \\ <&> é\n'
    written([make_snapshot(3, classes=(odd,))], tmp_path / "odd", split=ALL)
    assert {label["class"] for d in load(tmp_path / "odd").values() for label in d["objects"]} == {odd}
    written([make_snapshot(3, objects=[])], tmp_path / "empty", split=ALL)
    assert [document["objects"] for document in load(tmp_path / "empty").values()] == [[], [], []]
    settings = json.loads((tmp_path / "empty" / "val" / "_object_settings.json").read_bytes())
    assert settings == {"exported_object_classes": [], "exported_objects": []}
    assert sorted(path.name for path in (tmp_path / "empty" / "val").iterdir()) == [
        "_camera_settings.json",
        "_object_settings.json",
    ]
