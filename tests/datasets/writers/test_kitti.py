"""KITTI, read as the readme of its development kit says: corners from sizes, place and turn, projected by P2."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from ars_web.datasets.jobs import plan_export, run_export
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.planned import ExportPlan
from ars_web.datasets.samples import kept, label_table
from ars_web.datasets.writers.kitti import WRITER, kitti_names
from ars_web.datasets.writers.upright import count_tilts, tilts, upright
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.sessions.model import FrameTable, SessionSnapshot

Make = Callable[..., SessionSnapshot]

WIDE = Camera(1242, 375, 721.0, 721.0, 609.5, 172.5)
"""About KITTI's own."""


@dataclass
class Row:
    """One object of a label file."""

    type: str
    truncated: float
    occluded: int
    alpha: float
    bbox: np.ndarray
    hwl: np.ndarray
    location: np.ndarray
    rotation_y: float

    @property
    def corners(self) -> np.ndarray:
        """(8, 3) before the camera, as the devkit's computeBox3D has them."""
        h, w, length = self.hwl
        x = np.array([1, 1, -1, -1, 1, 1, -1, -1]) * length / 2
        y = np.array([0, 0, 0, 0, -h, -h, -h, -h])
        z = np.array([1, -1, -1, 1, 1, -1, -1, 1]) * w / 2
        c, s = np.cos(self.rotation_y), np.sin(self.rotation_y)
        return np.stack([c * x + s * z, y, -s * x + c * z], axis=1) + self.location


def load(path: Path) -> list[Row]:
    found: list[Row] = []
    for line in path.read_text().splitlines():
        words = line.split(" ")
        assert len(words) == 15
        v = [float(word) for word in words[1:]]
        found.append(
            Row(words[0], v[0], int(words[2]), v[2], np.array(v[3:7]), np.array(v[7:10]), np.array(v[10:13]), v[13])
        )
    return found


def calibration(path: Path) -> dict[str, np.ndarray]:
    lines = (line.split(": ") for line in path.read_text().splitlines())
    return {name: np.array(numbers.split(), dtype=float).reshape(3, -1) for name, numbers in lines}


def written(snapshots: list[SessionSnapshot], out: Path, **changes: object) -> ExportPlan:
    options = ExportOptions.model_validate({"images": "none", **changes})
    plan = plan_export(snapshots, format="kitti", options=options, out=out, frames_per_shard=5)
    run_export(plan)
    return plan


@pytest.fixture
def level(make_snapshot: Make) -> SessionSnapshot:
    """A street: five level cameras that look about, boxes that stand on the ground, z up, turned as they like."""
    random = np.random.default_rng(1)
    boxes: list[Box] = []
    for i in range(6):
        T = rigid_transform.from_rotation(
            rigid_transform.rotation_about_z(float(random.uniform(-3, 3))),
            np.array([8.0 + 4 * i, (-1) ** i * 2.5, 0.8]),
        )
        boxes.append(Box(T, np.array([3.9, 1.6, 1.5]) + 0.1 * i))
    snapshot = make_snapshot(5, objects=boxes, classes=("Car", "delivery van"), one_camera=True)
    # x right, y down, z ahead: along the world's x.
    ahead = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    Ts = np.stack(
        [
            rigid_transform.from_rotation(rigid_transform.rotation_about_z(a) @ ahead, np.array([0, 0, 1.65]))
            for a in np.linspace(-0.3, 0.3, 5)
        ]
    )
    frames = FrameTable(snapshot.frames.names, snapshot.frames.images, snapshot.frames.camera_ids, Ts)
    return replace(snapshot, cameras={0: WIDE}, frames=frames)


def test_upright_boxes_are_exact(level: SessionSnapshot, tmp_path: Path) -> None:
    plan = written([level], tmp_path / "d")
    table = label_table(level, range(5))
    keep, _ = kept(table, plan.options)
    compared = 0
    for i in range(5):
        stem = f"{i:06d}"
        found = load(tmp_path / "d" / "training" / "label_2" / f"{stem}.txt")
        P2 = calibration(tmp_path / "d" / "training" / "calib" / f"{stem}.txt")["P2"]
        columns = np.flatnonzero(keep[i])
        assert len(found) == len(columns)
        for row, column in zip(found, columns, strict=True):
            box = level.state.boxes[int(column) + 1].box
            assert row.type == ("delivery_van" if column % 2 else "Car")
            np.testing.assert_allclose(row.hwl, box.size[[2, 1, 0]], atol=1e-6)
            T_camera_world = np.linalg.inv(level.frames.Ts_world_camera[i])
            corners = rigid_transform.transform_points(T_camera_world, box.corners_world)
            distances = np.linalg.norm(corners[:, None] - row.corners[None], axis=2)
            assert distances.min(axis=1).max() < 1e-5
            # The front is the end of the box's own x.
            front = T_camera_world[:3, :3] @ box.T_world_box[:3, 0]
            np.testing.assert_allclose([np.cos(row.rotation_y), -np.sin(row.rotation_y)], front[[0, 2]], atol=1e-5)
            bottom = (T_camera_world @ [*(box.T_world_box[:3, 3] - [0, 0, box.size[2] / 2]), 1])[:3]
            np.testing.assert_allclose(row.location, bottom, atol=1e-6)
            turned = row.alpha - (row.rotation_y - np.arctan2(row.location[0], row.location[2]))
            assert abs((turned + np.pi) % (2 * np.pi) - np.pi) < 1e-5
            assert -np.pi <= row.alpha <= np.pi
            if (row.corners[:, 2] > 1).all() and table.truncated[i, column] == 0:
                pixels = np.column_stack([row.corners, np.ones(8)]) @ P2.T
                pixels = pixels[:, :2] / pixels[:, 2:]
                np.testing.assert_allclose([*pixels.min(axis=0), *pixels.max(axis=0)], row.bbox, atol=0.0052)
                compared += 1
    assert compared > 8
    assert not [line for line in WRITER.losses(plan) if "tilted" in line]


def test_pixels_are_indices_from_0(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(12, one_camera=True)
    plan = written([snapshot], tmp_path / "d")
    table = label_table(snapshot, range(12))
    keep, _ = kept(table, plan.options)
    at_border = 0
    for i in range(12):
        for row, column in zip(
            load(tmp_path / "d" / "training" / "label_2" / f"{i:06d}.txt"), np.flatnonzero(keep[i]), strict=True
        ):
            np.testing.assert_allclose(row.bbox, np.clip(table.bbox[i, column] - 0.5, 0, [63, 47, 63, 47]), atol=0.0051)
            at_border += row.bbox[3] == 47
            assert row.truncated == pytest.approx(table.truncated[i, column], abs=0.0051)
            visible = table.visible[i, column]
            assert row.occluded == (2 if visible < 0.5 else 1 if visible < 0.95 else 0)
    assert at_border


def test_tilted_boxes_are_told_and_keep_their_centres(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(12, one_camera=True)
    plan = written([snapshot], tmp_path / "d")
    # The cameras look down from 0.5 m high and 1 m away; every box stands on the ground.
    angle = np.degrees(np.arctan2(0.5, 1.0))
    (loss,) = [line for line in WRITER.losses(plan) if "tilted" in line]
    assert f"the median by {angle:.1f} and the worst by {angle:.1f}" in loss
    found = count_tilts(plan, beyond=1.0)
    assert found.count == found.tilted > 20
    assert count_tilts(plan, beyond=30.0).tilted == 0
    assert loss in plan_report(tmp_path / "d")
    for i in range(9):
        rows = load(tmp_path / "d" / "training" / "label_2" / f"{i:06d}.txt")
        centres = [row.location - [0, row.hwl[0] / 2, 0] for row in rows]
        T_camera_world = np.linalg.inv(snapshot.frames.Ts_world_camera[i])
        true = [(T_camera_world @ box.box.T_world_box)[:3, 3] for box in snapshot.state.boxes.values()]
        for centre in centres:
            assert min(float(np.linalg.norm(centre - other)) for other in true) < 1e-5


def plan_report(folder: Path) -> str:
    return (folder / "dataset.json").read_text()


def test_the_upright_box_is_the_nearest() -> None:
    """Beside all turns about y, a tenth of a degree apart."""
    from scipy.spatial.transform import Rotation

    R = Rotation.random(40, random_state=3).as_matrix()
    sizes = np.array([[1.0, 2.0, 3.0]])
    found = upright(rigid_transform.from_rotation(R[:, None], np.zeros((40, 1, 3))), sizes)
    for rotation, yaw, hwl in zip(R, found.yaw[:, 0], found.height_width_length[:, 0], strict=True):
        up = int(np.argmax(np.abs(rotation[1])))
        along, across = [axis for axis in range(3) if axis != up]
        assert hwl.tolist() == [sizes[0, up], sizes[0, across], sizes[0, along]]
        down = rotation[:, up] * np.sign(rotation[1, up])
        ours = np.stack([rotation[:, along], down, np.cross(rotation[:, along], down)], axis=1)
        angles = np.radians(np.arange(0, 360, 0.1))
        c, s, zero, one = np.cos(angles), np.sin(angles), np.zeros(3600), np.ones(3600)
        turns = np.stack([c, zero, s, zero, one, zero, -s, zero, c], axis=1).reshape(-1, 3, 3)
        best = angles[np.linalg.norm(turns - ours, axis=(1, 2)).argmin()]
        assert abs((best - yaw + np.pi) % (2 * np.pi) - np.pi) < np.radians(0.06)
        assert tilts(rotation) == pytest.approx(np.arccos(down[1]))


def test_names_have_no_spaces_and_none_is_there_twice(make_snapshot: Make, tmp_path: Path) -> None:
    assert kitti_names(["Car", "tall one", "tall_one", "dontcare", 'a\t"b"\n', "é", "car"]) == [
        "Car", "tall_one", "tall_one_2", "dontcare_2", 'a_"b"_', "é", "car_2",
    ]  # fmt: skip
    names = ("tall\x00 one", "tall_ one")
    plan = written([make_snapshot(3, classes=names)], tmp_path / "d")
    (loss,) = [line for line in WRITER.losses(plan) if "names" in line]
    assert r"'tall\x00 one' is 'tall__one'" in loss
    assert "'tall_ one' is 'tall__one_2'" in loss
    types = {row.type for path in (tmp_path / "d").glob("training/label_2/*") for row in load(path)}
    assert types == {"tall__one", "tall__one_2"}


def test_the_layout_is_the_devkits(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(5)
    written([snapshot], tmp_path / "d", images="link", split={"train": 0.6, "val": 0.4, "test": 0.0})
    training = tmp_path / "d" / "training"
    stems = [f"{i:06d}" for i in range(5)]
    assert sorted(path.name for path in (training / "image_2").iterdir()) == [f"{stem}.png" for stem in stems]
    assert (training / "image_2" / "000000.png").read_bytes().startswith(b"\x89PNG")
    lists = {path.stem: path.read_text().split() for path in (tmp_path / "d" / "ImageSets").iterdir()}
    assert sorted(lists["train"] + lists["val"]) == stems == sorted(lists["trainval"])
    assert (tmp_path / "d" / "frames.txt").read_text().splitlines()[0] == "000000 recording-s1!0000.jpg"
    found = calibration(training / "calib" / "000004.txt")
    assert list(found) == ["P0", "P1", "P2", "P3", "R0_rect", "Tr_velo_to_cam", "Tr_imu_to_velo"]
    np.testing.assert_array_equal(found["P2"], [[50, 0, 23.5, 0], [0, 50, 31.5, 0], [0, 0, 1, 0]])
    np.testing.assert_array_equal(found["R0_rect"], np.eye(3))
    np.testing.assert_array_equal(found["Tr_velo_to_cam"], np.eye(3, 4))


def test_no_boxes_no_frames_in_a_split_and_none_behind_the_camera(make_snapshot: Make, tmp_path: Path) -> None:
    plan = written([make_snapshot(3, objects=[])], tmp_path / "empty", split={"train": 1.0, "val": 0.0, "test": 0.0})
    assert {path.read_bytes() for path in (tmp_path / "empty" / "training" / "label_2").iterdir()} == {b""}
    assert (tmp_path / "empty" / "ImageSets" / "val.txt").read_bytes() == b""
    assert not [line for line in WRITER.losses(plan) if "tilted" in line]
    written([make_snapshot(12)], tmp_path / "away")
    files = sorted((tmp_path / "away" / "training" / "label_2").iterdir())
    assert [path.read_text() for path in files[-2:]] == ["", ""]
    assert all(row.location[2] > 0 for path in files for row in load(path))
