"""BOP scenes, loaded as docs/bop_datasets_format.md of the BOP toolkit says, and projected by their own cameras."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from io import BytesIO
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from ars_web.datasets.jobs import plan_export, run_export
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.planned import ExportPlan, PlannedSession
from ars_web.datasets.readback.comparison import compare
from ars_web.datasets.samples import kept, label_table
from ars_web.datasets.writers.bop import WRITER
from ars_web.datasets.writers.bop_info import pixel_box, whole_pixels
from ars_web.datasets.writers.bop_models import diameter, model_info
from ars_web.datasets.writers.bop_objects import objects_of
from ars_web.datasets.writers.mask_png import mask_png
from ars_web.datasets.writers.posed import lens_error
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera, normalised_from_pixels
from ars_web.geometry.symmetry import Symmetry, turn_about
from ars_web.sessions.hull_mesh import HullMesh
from ars_web.sessions.model import SessionSnapshot

Make = Callable[..., SessionSnapshot]


@dataclass
class SceneImage:
    """One image of a scene: its camera, and (object, R_m2c, t_m2c, info) of each label."""

    K: np.ndarray
    R_w2c: np.ndarray
    t_w2c: np.ndarray
    labels: list[tuple[int, np.ndarray, np.ndarray, dict[str, object]]]


def load(folder: Path, split: str) -> dict[tuple[int, int], SceneImage]:
    """By scene and image number."""
    found: dict[tuple[int, int], SceneImage] = {}
    for scene in sorted((folder / split).iterdir()):
        cameras, gts, infos = (
            json.loads((scene / f"scene_{name}.json").read_bytes()) for name in ("camera", "gt", "gt_info")
        )
        assert list(cameras) == list(gts) == list(infos)
        for number, camera in cameras.items():
            labels = [
                (gt["obj_id"], np.reshape(gt["cam_R_m2c"], (3, 3)), np.array(gt["cam_t_m2c"]), info)
                for gt, info in zip(gts[number], infos[number], strict=True)
            ]
            found[int(scene.name), int(number)] = SceneImage(
                np.reshape(camera["cam_K"], (3, 3)),
                np.reshape(camera["cam_R_w2c"], (3, 3)),
                np.array(camera["cam_t_w2c"]),
                labels,
            )
    return found


def load_ply(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Vertices with their normals, and faces."""
    lines = path.read_text().splitlines()
    end = lines.index("end_header")
    count = next(int(line.split()[-1]) for line in lines if line.startswith("element vertex"))
    rows = [line.split() for line in lines[end + 1 :]]
    assert all(row[0] == "3" for row in rows[count:])
    return np.array(rows[:count], dtype=float), np.array([row[1:] for row in rows[count:]], dtype=int)


def written(snapshots: list[SessionSnapshot], out: Path, **changes: object) -> ExportPlan:
    options = ExportOptions.model_validate({"images": "none", "masks": "none", **changes})
    plan = plan_export(snapshots, format="bop", options=options, out=out, frames_per_shard=5)
    run_export(plan)
    return plan


def test_models_land_where_their_boxes_are_seen(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(12)
    plan = written([snapshot], tmp_path / "d", images="rectify")
    table = label_table(snapshot, range(12))
    keep, _ = kept(table, plan.options)
    models = {number: load_ply(tmp_path / "d" / "models" / f"obj_{number:06d}.ply")[0][:, :3] for number in (1, 2, 3)}
    images = {n: image for split in ("train", "val") for (_, n), image in load(tmp_path / "d", split).items()}
    assert sorted(images) == list(range(12))
    compared = 0
    for number, image in images.items():
        # FLAT's images are as they were, so that its labels can be compared with the session's.
        flat = number % 5 == 4
        T_camera_world = np.linalg.inv(snapshot.frames.Ts_world_camera[number])
        np.testing.assert_allclose(image.R_w2c, T_camera_world[:3, :3], atol=1e-9)
        np.testing.assert_allclose(image.t_w2c, T_camera_world[:3, 3] * 1000, atol=1e-4)
        if flat:
            assert len(image.labels) == keep[number].sum()
        for (object_id, R, t, _), column in zip(image.labels, np.flatnonzero(keep[number]), strict=False):
            points = models[object_id] @ R.T + t
            if not flat or (points[:, 2] < 100).any():
                continue
            pixels = (points / points[:, 2:]) @ image.K.T
            low, high = pixels[:, :2].min(axis=0) + 0.5, pixels[:, :2].max(axis=0) + 0.5
            np.testing.assert_allclose([*low, *high], table.bbox_amodal[number, column], atol=1e-3)
            compared += 1
    assert compared >= 2


def test_rotations_are_row_by_row_and_lengths_are_millimetres(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(2, one_camera=True)
    written([snapshot], tmp_path / "d")
    image = load(tmp_path / "d", "train")[0, 0]
    box = snapshot.state.boxes[2].box
    T = np.linalg.inv(snapshot.frames.Ts_world_camera[0]) @ box.T_world_box
    object_id, R, t, _ = image.labels[[label[0] for label in image.labels].index(3)]
    assert object_id == 3
    np.testing.assert_allclose(R, T[:3, :3], atol=1e-9)
    assert np.abs(R - R.T).max() > 0.1
    np.testing.assert_allclose(t, T[:3, 3] * 1000, atol=1e-5)


def test_models_are_boxes_with_normals_outwards_and_their_centre_at_the_origin(
    make_snapshot: Make, tmp_path: Path
) -> None:
    written([make_snapshot(2)], tmp_path / "d")
    info = json.loads((tmp_path / "d" / "models" / "models_info.json").read_bytes())
    assert list(info) == ["1", "2", "3"]
    rows, faces = load_ply(tmp_path / "d" / "models" / "obj_000001.ply")
    np.testing.assert_allclose(rows[:, :3].min(axis=0), [-100, -75, -50])
    np.testing.assert_allclose(rows[:, :3].max(axis=0), [100, 75, 50])
    assert len(faces) == 12
    for face in faces:
        a, b, c = rows[face, :3]
        normal = np.cross(b - a, c - a)
        np.testing.assert_allclose(normal / np.linalg.norm(normal), rows[face[0], 3:], atol=1e-6)
        assert normal @ a > 0
    assert info["1"] == {
        "diameter": pytest.approx(np.linalg.norm([200, 150, 100])),
        "min_x": -100, "size_x": 200, "min_y": -75, "size_y": 150, "min_z": -50, "size_z": 100,
    }  # fmt: skip


def test_boxes_that_are_alike_are_one_object(make_snapshot: Make, tmp_path: Path, octahedron: HullMesh) -> None:
    def box(x: float, *size: float) -> Box:
        T = np.eye(4)
        T[0, 3] = x
        return Box(T, np.array(size))

    alike = [box(0, 0.1, 0.1, 0.2), box(0.2, 0.1, 0.1, 0.2), box(0.4, 0.10009, 0.1, 0.2), box(0.6, 0.1002, 0.1, 0.2)]
    snapshot = make_snapshot(2, objects=alike, classes=("can",), hulls={2: octahedron})
    plan = written([snapshot, make_snapshot(2, sid="s2", objects=alike[:1], classes=("can",))], tmp_path / "d")
    assert [(o.id, o.shape, o.boxes) for o in objects_of(plan.sessions)] == [
        (1, "box", [(0, 0), (0, 2), (1, 0)]),
        (2, "hull", [(0, 1)]),
        (3, "box", [(0, 3)]),
    ]
    table = json.loads((tmp_path / "d" / "objects.json").read_bytes())
    assert [entry["class"] for entry in table.values()] == ["can"] * 3
    assert table["2"]["boxes"] == [{"session": "s1", "box_id": 2, "name": "box 2"}]
    (loss,) = [line for line in WRITER.losses(plan) if "one object a class" in line]
    assert "can (3)" in loss
    tips, _ = load_ply(tmp_path / "d" / "models" / "obj_000002.ply")
    assert np.abs(tips[:, :3]).max() == pytest.approx(100)


def test_symmetries_are_told_of_models() -> None:
    box = Box(np.eye(4), np.array([0.1, 0.1, 0.2]))
    (an_object,) = objects_of([PlannedSession("s", "s", 1, {}, (1,), ("a",), (box,), (None,), ("box",), (0,))])
    plain = model_info(an_object, Symmetry())
    assert not {"symmetries_discrete", "symmetries_continuous"} & set(plain)
    quarter = model_info(an_object, Symmetry("discrete", rotations=(((0.0, 0.0, 1.0), 4),)))
    turns = [np.reshape(matrix, (4, 4)) for matrix in quarter["symmetries_discrete"]]
    assert len(turns) == 3
    z = np.array([0.0, 0.0, 1.0])
    assert any(np.allclose(turn[:3, :3], turn_about(z, np.pi / 2)) for turn in turns)
    assert all(np.allclose(turn[3], [0, 0, 0, 1]) and np.allclose(turn[:3, 3], 0) for turn in turns)
    round_one = model_info(an_object, Symmetry("continuous", axis=(0.0, 0.0, 1.0), flip=True))
    assert round_one["symmetries_continuous"] == [{"axis": [0, 0, 1], "offset": [0, 0, 0]}]
    (flip,) = round_one["symmetries_discrete"]
    np.testing.assert_allclose(np.reshape(flip, (4, 4))[:3, :3] @ z, -z, atol=1e-9)


def test_diameters_are_those_of_all_pairs() -> None:
    points = np.random.default_rng(2).normal(size=(700, 3))
    slow = max(float(np.linalg.norm(points - point, axis=1).max()) for point in points)
    assert diameter(points) == pytest.approx(slow, rel=1e-12)
    flat = points * [1, 1, 0]
    assert diameter(flat) == pytest.approx(max(float(np.linalg.norm(flat - p, axis=1).max()) for p in flat))


def test_boxes_and_counts_of_pixels_are_the_toolkits(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(12, one_camera=True)
    plan = written([snapshot], tmp_path / "d")
    table = label_table(snapshot, range(12))
    keep, _ = kept(table, plan.options)
    images = {n: image for split in ("train", "val") for (_, n), image in load(tmp_path / "d", split).items()}
    truncated = 0
    for number, image in images.items():
        columns = np.flatnonzero(keep[number])
        for (_, _, _, info), column in zip(image.labels, columns, strict=True):
            assert 0 < info["px_count_valid"] <= info["px_count_all"]
            assert 0 <= info["px_count_visib"] <= info["px_count_valid"]
            assert info["visib_fract"] == pytest.approx(info["px_count_visib"] / info["px_count_all"], abs=1e-6)
            x, y, w, h = info["bbox_obj"]
            seen = table.bbox_amodal[number, column]
            # Of the pixels whose centre is within, the first and the last.
            assert np.abs(np.array([x, y, x + w + 1, y + h + 1]) - seen).max() <= 0.5 + 1e-9
            truncated += table.truncated[number, column] > 0.05
            if table.truncated[number, column] > 0.05:
                assert info["px_count_all"] > info["px_count_valid"]
            if info["px_count_visib"] == 0:
                assert info["bbox_visib"] == [-1, -1, -1, -1]
            else:
                vx, vy, vw, vh = info["bbox_visib"]
                assert vx >= 0
                assert vy >= 0
                assert vx + vw < 64
                assert vy + vh < 48
    assert truncated


def test_whole_silhouettes_end_with_the_toolkits_canvas() -> None:
    sizes = np.array([[64, 48]])
    bbox = np.array([[[-1e12, 3.2, 1e12, 5.6], [10.0, 10.0, 10.1, 10.1]]])
    assert pixel_box(bbox, sizes, canvas=1).tolist() == [[[-64, 3, 191, 2], [10, 10, 0, 0]]]
    assert pixel_box(bbox, sizes, canvas=0).tolist()[0][0] == [0, 3, 63, 2]
    assert whole_pixels(np.array([[100, 100]]), np.array([[1.0, 0.5]]), sizes).tolist() == [[9 * 64 * 48, 200]]


def test_targets_count_what_is_seen_enough(make_snapshot: Make, tmp_path: Path) -> None:
    snapshots = [make_snapshot(12), make_snapshot(6, sid="s2")]
    written(snapshots, tmp_path / "d", split={"train": 0.4, "val": 0.3, "test": 0.3, "by": "frame"})
    for split in ("val", "test"):
        targets = json.loads((tmp_path / "d" / f"{split}_targets_bop19.json").read_bytes())
        expected: list[dict[str, int]] = []
        for (scene, number), image in load(tmp_path / "d", split).items():
            seen = [label[0] for label in image.labels if label[3]["visib_fract"] >= 0.1]
            expected += [
                {"im_id": number, "inst_count": seen.count(i), "obj_id": i, "scene_id": scene}
                for i in sorted(set(seen))
            ]
        assert targets == sorted(expected, key=lambda target: (target["im_id"], target["obj_id"]))
        assert targets
    assert not (tmp_path / "d" / "train_targets_bop19.json").exists()


def test_scenes_are_sessions_and_images_have_their_numbers(make_snapshot: Make, tmp_path: Path) -> None:
    snapshots = [make_snapshot(6), make_snapshot(4, sid="s2", suffix=".png")]
    plan = written(snapshots, tmp_path / "d", images="copy", split={"train": 0.5, "val": 0.5, "test": 0.0})
    out = tmp_path / "d"
    names = sorted(str(path.relative_to(out)) for path in out.glob("*/*/rgb/*"))
    assert len(names) == 10
    assert {name.split("/")[1] for name in names} == {"000000", "000001"}
    assert {Path(name).stem for name in names} == {f"{i:06d}" for i in range(10)}
    for split in ("train", "val"):
        for scene, number in load(out, split):
            (path,) = (out / split / f"{scene:06d}" / "rgb").glob(f"{number:06d}.*")
            assert path.read_bytes() == Path(plan.frames.sources[number]).read_bytes()
    lines = (out / "frames.txt").read_text().splitlines()
    assert lines[0] == "000000 recording-s1!0000.jpg"
    assert lines[9] == "000009 recording-s2!0003.png"
    camera = json.loads((out / "camera.json").read_bytes())
    assert (camera["width"], camera["fx"], camera["depth_scale"]) == (64, 50.0, 1.0)


def true_masks(snapshot: SessionSnapshot, frame: int) -> tuple[np.ndarray, np.ndarray]:
    """(b, h, w) where each box is met by the ray through a pixel's middle, and (h, w) which is met first; the slabs of
    each box one after the other, for each pixel."""
    camera = snapshot.cameras[int(snapshot.frames.camera_ids[frame])]
    columns, rows = np.meshgrid(np.arange(camera.width, dtype=float), np.arange(camera.height, dtype=float))
    flat = normalised_from_pixels(camera, np.stack([columns, rows], axis=-1))
    rays = np.concatenate([flat, np.ones((*flat.shape[:2], 1))], axis=-1)
    entries: list[np.ndarray] = []
    for box in snapshot.state.boxes.values():
        T_box_camera = np.linalg.inv(box.box.T_world_box) @ snapshot.frames.Ts_world_camera[frame]
        directions, start = rays @ T_box_camera[:3, :3].T, T_box_camera[:3, 3]
        with np.errstate(divide="ignore"):
            hits = (np.array([-0.5, 0.5])[:, None, None, None] * box.box.size - start) / directions
        enter, leave = hits.min(axis=0).max(axis=-1), hits.max(axis=0).min(axis=-1)
        entries.append(np.where((enter < leave) & (leave > 0), np.maximum(enter, 0), np.inf))
    depths = np.array(entries)
    return np.isfinite(depths), np.where(np.isfinite(depths).any(axis=0), depths.argmin(axis=0), -1)


def test_masks_are_the_pixels_whose_rays_meet_the_object(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(12)
    plan = written([snapshot], tmp_path / "d", masks="write", min_area_px=40.0)
    keep, _ = kept(label_table(snapshot, range(12)), plan.options)
    assert 0 < (~keep[:10]).sum()
    hidden = compared = 0
    for split in ("train", "val"):
        for (scene, number), image in load(tmp_path / "d", split).items():
            whole, nearest = true_masks(snapshot, number)
            columns = np.flatnonzero(keep[number]).tolist()
            names = [f"{number:06d}_{label:06d}.png" for label in range(len(columns))]
            folder = tmp_path / "d" / split / f"{scene:06d}"
            assert sorted(path.name for path in folder.glob(f"mask/{number:06d}_*")) == names
            for (_, _, _, info), column, name in zip(image.labels, columns, names, strict=True):
                mask, visible = (
                    cv2.imread(str(folder / kind / name), cv2.IMREAD_UNCHANGED) for kind in ("mask", "mask_visib")
                )
                assert (mask.dtype, set(np.unique(mask)) <= {0, 255}) == (np.uint8, True)
                # A ray through an edge may go either way.
                assert ((mask > 0) != whole[column]).sum() <= 1
                assert ((visible > 0) != (nearest == column)).sum() <= 1
                assert (info["px_count_valid"], info["px_count_visib"]) == ((mask > 0).sum(), (visible > 0).sum())
                hidden += info["px_count_visib"] < info["px_count_valid"]
                for key, pixels in (("bbox_obj", mask), ("bbox_visib", visible)):
                    rows, cols = np.nonzero(pixels)
                    box = [-1] * 4
                    if len(rows):
                        # As misc.calc_2d_bbox of the toolkit.
                        box = [cols.min(), rows.min(), np.ptp(cols), np.ptp(rows)]
                    if key == "bbox_visib" or info["px_count_all"] == info["px_count_valid"]:
                        assert info[key] == box
                compared += 1
    assert hidden
    assert compared > 10


def test_silhouettes_beyond_the_image_are_counted(make_snapshot: Make, tmp_path: Path) -> None:
    snapshot = make_snapshot(12, one_camera=True)
    written([snapshot], tmp_path / "a", masks="write", split={"train": 1.0, "val": 0.0, "test": 0.0})
    written([snapshot], tmp_path / "b", split={"train": 1.0, "val": 0.0, "test": 0.0})
    cut = 0
    for a, b in zip(*(load(tmp_path / name, "train").values() for name in "ab"), strict=True):
        for (_, _, _, exact), (_, _, _, estimated) in zip(a.labels, b.labels, strict=True):
            for key in ("px_count_all", "px_count_valid"):
                # Of an outline's pixels those at its border may be in or out.
                assert abs(exact[key] - estimated[key]) <= 2 + 0.3 * estimated[key]
            if exact["px_count_all"] > exact["px_count_valid"]:
                # The whole object's, whichever sides of the image cut it.
                assert exact["bbox_obj"] == estimated["bbox_obj"]
                x, y, w, h = exact["bbox_obj"]
                cut += x < 0 or y < 0 or x + w > 63 or y + h > 47
    assert cut


def test_mask_files_are_read_by_others() -> None:
    random = np.random.default_rng(5)
    for rows, columns, row, column in ((0, 0, 0, 0), (48, 64, 0, 0), (5, 9, 43, 55), (1, 1, 0, 63), (7, 3, 20, 0)):
        mask = random.random((rows, columns)) < 0.5
        expected = np.zeros((48, 64), dtype=np.uint8)
        expected[row : row + rows, column : column + columns] = mask * 255
        content = mask_png(mask, row=row, column=column, width=64, height=48)
        for read in (
            cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED),
            np.asarray(Image.open(BytesIO(content))),
        ):
            np.testing.assert_array_equal(read, expected)
        assert Image.open(BytesIO(content)).mode == "L"
    large = mask_png(np.ones((300, 200), dtype=bool), row=400, column=900, width=1920, height=1080)
    assert cv2.imdecode(np.frombuffer(large, np.uint8), cv2.IMREAD_UNCHANGED).sum() == 255 * 60_000
    assert len(large) < 12_000


def test_masks_that_are_not_asked_for_are_a_loss(make_snapshot: Make, tmp_path: Path) -> None:
    options = ExportOptions.model_validate({"images": "rectify", "masks": "none"})
    plan = plan_export([make_snapshot(2)], format="bop", options=options, out=tmp_path / "d")
    assert any("masks" in line for line in WRITER.losses(plan))


def test_a_lens_is_a_loss_with_its_largest_error(make_snapshot: Make, tmp_path: Path) -> None:
    def losses(images: str) -> list[str]:
        options = ExportOptions.model_validate({"images": images})
        plan = plan_export([make_snapshot(4)], format="bop", options=options, out=tmp_path / "d")
        return list(WRITER.losses(plan))

    lens, several = losses("link")
    assert "camera 0 of session s1" in lens
    assert "images: rectify" in lens
    assert "cube (2)" in several
    assert losses("rectify") == [several]
    # OpenCV's own way from a pixel to its ray, along the border, where this lens is worst.
    bent = Camera(64, 48, 50.0, 51.0, 31.0, 24.5, "brown", (-0.2, 0.05, 0.001, -0.001, 0.0))
    corners = np.array([[0.0, 0.0], [63.0, 0.0], [63.0, 47.0], [0.0, 47.0]])
    straight = cv2.undistortPoints(corners[:, None], bent.K, np.array(bent.distortion), P=bent.K)[:, 0]
    worst = float(np.linalg.norm(straight - corners, axis=1).max())
    assert lens_error(bent) == pytest.approx(worst, abs=0.05)
    assert f"{lens_error(bent):.1f} px" in lens
    assert lens_error(Camera(64, 48, 50.0, 51.0, 31.0, 24.5)) == 0.0


def test_odd_names_and_empty_classes(make_snapshot: Make, tmp_path: Path) -> None:
    odd = 'a|b "c" \\ é\n<&>'
    snapshot = make_snapshot(
        3, classes=(odd, "never seen", "n2"), objects=[make_snapshot(1, sid="x").state.boxes[1].box]
    )
    plan = written([snapshot], tmp_path / "d")
    assert json.loads((tmp_path / "d" / "objects.json").read_bytes())["1"]["class"] == odd
    text = (tmp_path / "d" / "dataset_info.md").read_text()
    (row,) = [line for line in text.splitlines() if line.startswith("| 1 |")]
    assert 'a\\|b "c" \\\\ é <&>' in row
    assert any("never seen, n2" in line for line in WRITER.losses(plan))


def test_no_boxes_no_frames_in_a_split_and_a_box_behind_the_camera(make_snapshot: Make, tmp_path: Path) -> None:
    written([make_snapshot(3, objects=[])], tmp_path / "empty", split={"train": 1.0, "val": 0.0, "test": 0.0})
    images = load(tmp_path / "empty", "train")
    assert [image.labels for image in images.values()] == [[], [], []]
    assert list((tmp_path / "empty" / "val").iterdir()) == []
    assert json.loads((tmp_path / "empty" / "val_targets_bop19.json").read_bytes()) == []
    assert json.loads((tmp_path / "empty" / "models" / "models_info.json").read_bytes()) == {}
    # The last frames look away from all boxes.
    written([make_snapshot(12)], tmp_path / "away", split={"train": 1.0, "val": 0.0, "test": 0.0})
    labels = [image.labels for image in load(tmp_path / "away", "train").values()]
    assert labels[-2:] == [[], []]
    assert all(label[2][2] > 0 for found in labels for label in found)


def test_documents_have_one_image_a_line_as_the_toolkits(make_snapshot: Make, tmp_path: Path) -> None:
    written([make_snapshot(5)], tmp_path / "d", split={"train": 1.0, "val": 0.0, "test": 0.0})
    for name in ("camera", "gt", "gt_info"):
        lines = (tmp_path / "d" / "train" / "000000" / f"scene_{name}.json").read_text().splitlines()
        assert (lines[0], lines[-1], len(lines)) == ("{", "}", 7)
        assert all(a.endswith(",") and not b.startswith(",") for a, b in pairwise(lines[1:-1]))


def test_a_pixel_of_a_mask_that_is_off_is_counted(make_snapshot: Make, tmp_path: Path) -> None:
    options = ExportOptions.model_validate({"images": "none", "masks": "write"})
    plan = plan_export([make_snapshot(4, one_camera=True)], format="bop", options=options, out=tmp_path / "d")
    run_export(plan)
    assert compare(plan, plan.out).wrong_pixels == 0
    path = next(iter(sorted((tmp_path / "d").glob("*/*/mask_visib/*.png"))))
    pixels = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    pixels[0, 0] = 255 - pixels[0, 0]
    assert cv2.imwrite(str(path), pixels)
    found = compare(plan, plan.out)
    assert (found.wrong_pixels, found.agrees) == (1, False)
