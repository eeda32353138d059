"""Labels of boxes that have a hull: drawn round the hull unless the box is asked for, wherever labels are made."""

import json
from collections.abc import Callable
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

from ars_web.datasets.forecast import forecast
from ars_web.datasets.jobs import run_export
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.plan import plan_export
from ars_web.datasets.plan_files import digest_of, read_plan, write_plan
from ars_web.datasets.planned import ExportPlan
from ars_web.datasets.preview import draw_frame, labelled_frames
from ars_web.datasets.registry import WRITERS
from ars_web.datasets.samples import frame_labels, label_table, labels_in_frames, outlines_in_frames
from ars_web.datasets.shapes import meshes_of
from ars_web.datasets.worker import start_worker
from ars_web.geometry import labels as geometry
from ars_web.geometry.mesh import Mesh
from ars_web.geometry.mesh_labels import labels_of_meshes
from ars_web.geometry.mesh_outlines import mesh_outline
from ars_web.sessions.hull_mesh import HullMesh
from ars_web.sessions.model import SessionSnapshot

Make = Callable[..., SessionSnapshot]
Tree = Callable[[Path], dict[str, str]]


@pytest.fixture
def snapshot(make_snapshot: Make, octahedron: HullMesh) -> SessionSnapshot:
    """Three boxes, of which the second has a hull."""
    return make_snapshot(12, hulls={2: octahedron})


def plan_of(*snapshots: SessionSnapshot, out: Path, shard: int | None = None, **changes: object) -> ExportPlan:
    kind = str(changes.pop("format", "coco"))
    return plan_export(
        snapshots, format=kind, options=ExportOptions.model_validate(changes), out=out, frames_per_shard=shard
    )


def area(ring: np.ndarray) -> float:
    x, y = ring.T
    return float(abs((x * np.roll(y, -1) - np.roll(x, -1) * y).sum() / 2))


def test_a_table_has_the_hulls_labels_beside_the_boxes_own(snapshot: SessionSnapshot) -> None:
    boxes = [box.box for box in snapshot.state.boxes.values()]
    _, hull, _ = meshes_of(snapshot, shape=None)
    assert hull is not None
    table, plain = label_table(snapshot, range(12)), label_table(snapshot, range(12), shape="box")
    for index in range(12):
        camera = snapshot.cameras[int(snapshot.frames.camera_ids[index])]
        Ts = snapshot.frames.Ts_world_camera[index : index + 1]
        of_boxes, of_hull = geometry.labels_of_boxes(camera, Ts, boxes), labels_of_meshes(camera, Ts, [hull])
        for name in ("bbox", "bbox_amodal", "truncated"):
            found = getattr(table, name)[index]
            np.testing.assert_array_equal(found[[0, 2]], getattr(of_boxes, name)[0, [0, 2]])
            np.testing.assert_array_equal(found[1], getattr(of_hull, name)[0, 0])
            np.testing.assert_array_equal(getattr(plain, name)[index], getattr(of_boxes, name)[0])
    seen = ~np.isnan(table.bbox[:, 1, 0])
    size, box_size = (np.ptp(t.bbox[seen, 1].reshape(-1, 2, 2), axis=1) for t in (table, plain))
    assert (size < box_size - 0.5).all()
    assert ((table.visible[seen, 1] >= 0) & (table.visible[seen, 1] <= 1)).all()


def test_outlines_over_two_cameras_are_each_labels_own(snapshot: SessionSnapshot) -> None:
    frames, boxes = snapshot.frames, [box.box for box in snapshot.state.boxes.values()]
    hulls = meshes_of(snapshot, shape=None)
    wanted = np.random.default_rng(0).random((12, 3)) < 0.7
    found = outlines_in_frames(snapshot.cameras, frames.camera_ids, frames.Ts_world_camera, boxes, wanted, meshes=hulls)
    for row in range(12):
        camera, T = snapshot.cameras[int(frames.camera_ids[row])], frames.Ts_world_camera[row]
        for column, (box, hull) in enumerate(zip(boxes, hulls, strict=True)):
            at = row * 3 + column
            ring = found.points[found.starts[at] : found.starts[at + 1]]
            alone = geometry.outline(camera, T, box) if hull is None else mesh_outline(camera, T, hull)
            assert np.array_equal(ring, alone if wanted[row, column] else np.zeros((0, 2)))


def test_a_frames_labels_are_the_hulls_unless_the_box_is_asked_for(snapshot: SessionSnapshot) -> None:
    usual, hull, box = (frame_labels(snapshot, 3, shape=shape) for shape in (None, "hull", "box"))
    assert [label.bbox for label in usual] == [label.bbox for label in hull]
    assert usual[0].bbox == box[0].bbox
    assert usual[1].bbox is not None
    assert usual[1].bbox != box[1].bbox
    assert area(usual[1].outline) < 0.8 * area(box[1].outline)
    # The edges are the box's, whatever its label is drawn round.
    assert all(map(np.array_equal, usual[1].wireframe, box[1].wireframe))


def test_a_hull_follows_its_box(snapshot: SessionSnapshot) -> None:
    moved = snapshot.state.boxes[2]
    T_world_box = moved.box.T_world_box.copy()
    T_world_box[2, 3] += 0.05
    box = replace(moved, box=replace(moved.box, T_world_box=T_world_box, size=moved.box.size * 2))
    after = replace(snapshot, state=replace(snapshot.state, boxes={**snapshot.state.boxes, 2: box}))
    (before, _), (now, _) = (
        (hull.vertices_world, hull.faces) for one in (snapshot, after) if (hull := meshes_of(one, shape=None)[1])
    )
    np.testing.assert_allclose(
        now, (before - moved.box.T_world_box[:3, 3]) * 2 + T_world_box[:3, 3], rtol=0, atol=1e-12
    )


def test_a_plan_carries_hulls_to_other_processes(
    snapshot: SessionSnapshot, make_snapshot: Make, tmp_path: Path
) -> None:
    plan = plan_of(make_snapshot(3, sid="s0"), snapshot, make_snapshot(2, sid="s2", objects=[]), out=tmp_path / "d")
    write_plan(plan, tmp_path)
    again = read_plan(tmp_path, out=plan.out)
    assert digest_of(again) == digest_of(plan)
    assert [[hull is not None for hull in session.meshes] for session in again.sessions] == [
        [False] * 3, [False, True, False], [],
    ]  # fmt: skip
    (one, two) = (session.meshes[1] for session in (plan.sessions[1], again.sessions[1]))
    assert isinstance(one, Mesh)
    assert isinstance(two, Mesh)
    assert np.array_equal(one.vertices_world, two.vertices_world)
    assert np.array_equal(one.faces, two.faces)


def test_hulls_are_in_the_plans_digest_where_labels_use_them(
    make_snapshot: Make, octahedron: HullMesh, tmp_path: Path
) -> None:
    thinner = HullMesh(octahedron.vertices * [1, 1, 0.75], octahedron.faces)

    def digest(hulls: dict[int, HullMesh], **changes: object) -> str:
        return digest_of(plan_of(make_snapshot(6, hulls=hulls), out=tmp_path / "d", images="none", **changes))

    assert len({digest({}), digest({2: octahedron}), digest({2: thinner}), digest({1: octahedron})}) == 4
    assert digest({}, shape="box") == digest({2: octahedron}, shape="box")


@pytest.mark.parametrize("kind", WRITERS)
def test_bytes_depend_neither_on_shards_nor_on_threads(
    snapshot: SessionSnapshot, make_snapshot: Make, tree: Tree, tmp_path: Path, kind: str
) -> None:
    trees: list[dict[str, str]] = []
    for shard in (1, 4, 100):
        out = tmp_path / f"{kind}-{shard}"
        plan = plan_of(snapshot, make_snapshot(5, sid="s2"), out=out, shard=shard, format=kind, images="none")
        run_export(plan, executor_factory=lambda: ThreadPoolExecutor(2))
        trees.append(tree(out))
    assert trees[0] == trees[1] == trees[2]


def test_a_worker_process_writes_the_same(snapshot: SessionSnapshot, tree: Tree, tmp_path: Path) -> None:
    def one_process() -> Executor:
        return ProcessPoolExecutor(1, mp_context=get_context("spawn"), initializer=start_worker)

    run_export(plan_of(snapshot, out=tmp_path / "a"))
    run_export(plan_of(snapshot, out=tmp_path / "b", shard=3), executor_factory=one_process)
    assert tree(tmp_path / "a") == tree(tmp_path / "b")


def coco_annotations(folder: Path, split: str) -> dict[int, dict[str, object]]:
    document = json.loads((folder / "annotations" / f"instances_{split}.json").read_bytes())
    return {annotation["id"]: annotation for annotation in document["annotations"]}


def test_coco_has_the_hulls_boxes_and_segments(snapshot: SessionSnapshot, tmp_path: Path) -> None:
    everything = {"train": 1.0, "val": 0.0, "test": 0.0}
    for shape in (None, "box"):
        run_export(plan_of(snapshot, out=tmp_path / str(shape), shape=shape, split=everything, images="none"))
    usual, plain = (coco_annotations(tmp_path / name, "train") for name in ("None", "box"))
    table = label_table(snapshot, range(12))
    compared = 0
    for number, annotation in usual.items():
        frame, column = divmod(number - 1, 3)
        x, y, w, h = annotation["bbox"]
        np.testing.assert_allclose([x, y, x + w, y + h], table.bbox[frame, column], atol=0.0051)
        if column != 1:
            assert annotation["segmentation"] == plain[number]["segmentation"]
            assert annotation["bbox"] == plain[number]["bbox"]
            continue
        (hull_ring,), (box_ring,) = annotation["segmentation"], plain[number]["segmentation"]
        ring = np.array(hull_ring).reshape(-1, 2)
        np.testing.assert_allclose([*ring.min(axis=0), *ring.max(axis=0)], [x, y, x + w, y + h], atol=0.12)
        assert annotation["area"] == pytest.approx(area(ring), abs=0.2)
        assert annotation["area"] < area(np.array(box_ring).reshape(-1, 2))
        compared += 1
    assert compared >= 5


def test_yolo_has_the_hulls_boxes(snapshot: SessionSnapshot, tmp_path: Path) -> None:
    for shape in (None, "hull", "box"):
        run_export(plan_of(snapshot, out=tmp_path / str(shape), format="yolo", shape=shape, images="none"))
    found = {
        shape: {path.stem: path.read_text().splitlines() for path in (tmp_path / shape / "labels").rglob("*.txt")}
        for shape in ("None", "hull", "box")
    }
    assert found["None"] == found["hull"]
    table = label_table(snapshot, range(12))
    camera = [snapshot.cameras[i] for i in snapshot.frames.camera_ids.tolist()]
    for frame in range(12):
        rows = [np.array(row.split()[1:], dtype=float) for row in found["None"][f"{frame:04d}"]]
        seen = np.flatnonzero(~np.isnan(table.bbox[frame, :, 0]))
        assert len(rows) == len(seen)
        for (cx, cy, w, h), column in zip(rows, seen, strict=True):
            size = np.array([camera[frame].width, camera[frame].height] * 2)
            sides = np.array([cx - w / 2, cy - h / 2, cx + w / 2, cy + h / 2]) * size
            np.testing.assert_allclose(sides, table.bbox[frame, column], atol=1e-4)
    changed = [stem for stem, rows in found["None"].items() if rows != found["box"][stem]]
    assert len(changed) >= 5


@pytest.mark.parametrize(
    ("with_hull", "shape", "told"),
    [((), None, "box"), ((2,), None, "hull or box"), ((1, 2, 3), None, "hull"), ((1, 2, 3), "box", "box")],
)
def test_the_dataset_tells_what_its_labels_are_drawn_round(
    make_snapshot: Make, octahedron: HullMesh, tmp_path: Path, with_hull: tuple[int, ...], shape: str | None, told: str
) -> None:
    snapshot = make_snapshot(3, hulls=dict.fromkeys(with_hull, octahedron))
    run_export(plan_of(snapshot, out=tmp_path / "d", shape=shape, images="none"))
    document = json.loads((tmp_path / "d" / "dataset.json").read_bytes())
    assert document["shape"] == told
    assert document["options"]["shape"] == shape


def test_a_forecast_counts_the_hulls_labels(make_snapshot: Make, octahedron: HullMesh, tmp_path: Path) -> None:
    # So small a share of its box that it is left out where the box is not.
    speck = HullMesh(octahedron.vertices * 0.02, octahedron.faces)
    plan = plan_of(make_snapshot(12, hulls={2: speck}), out=tmp_path / "d", images="none")
    found = forecast(plan)
    assert found.dropped["area"] >= 5
    assert found.splits == run_export(plan).splits


def test_frames_are_told_by_the_hull_that_is_drawn_in_them(make_snapshot: Make, octahedron: HullMesh) -> None:
    # A hull at the far end of its box, which the box alone would not leave out of any frame.
    box = make_snapshot(1).state.boxes[2].box
    wide = replace(box, size=np.array([0.2, 0.15, 4.0]))
    top = HullMesh(octahedron.vertices * 0.05 + [0, 0, 0.45], octahedron.faces)
    plain, with_hull = (make_snapshot(12, objects=[wide], hulls=hulls) for hulls in ({}, {1: top}))
    assert len(labelled_frames(with_hull)) < len(labelled_frames(plain))


def test_a_picture_shows_the_hull(snapshot: SessionSnapshot, make_snapshot: Make) -> None:
    assert not np.array_equal(draw_frame(snapshot, 3), draw_frame(make_snapshot(12), 3))


def test_visible_shares_are_of_the_hulls_part_of_the_image(snapshot: SessionSnapshot) -> None:
    frames, boxes = snapshot.frames, [box.box for box in snapshot.state.boxes.values()]
    hulls = meshes_of(snapshot, shape=None)
    table = labels_in_frames(snapshot.cameras, frames.camera_ids, frames.Ts_world_camera, boxes, meshes=hulls)
    assert np.array_equal(np.isnan(table.visible), np.isnan(table.bbox[..., 0]))
