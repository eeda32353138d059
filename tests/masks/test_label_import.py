"""Labels of other programs in a session: poses, outlines and rectangles of known boxes, in a ring of cameras."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from ars_web.datasets.jobs import plan_export, run_export
from ars_web.datasets.options import ExportOptions
from ars_web.errors import BadFile, BadInput
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box, iou
from ars_web.geometry.labels import labels_of_boxes, outline
from ars_web.geometry.symmetry import Symmetry
from ars_web.masks.label_import import MOST_VIEWS, ImportedLabels, LabelImport
from ars_web.recordings.registry import read_recording
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.label_import import UNTOLD
from ars_web.sessions.label_matching import NO_FRAME
from ars_web.sessions.store import SessionStore


def _box(x: float, y: float, turn: float, size: tuple[float, float, float]) -> Box:
    R = rigid_transform.rotation_about_z(turn)
    return Box(rigid_transform.from_rotation(R, np.array([x, y, 0.05])), np.array(size))


BOXES = [_box(-0.05, 0.0, 0.4, (0.06, 0.04, 0.05)), _box(0.06, 0.03, -0.2, (0.03, 0.05, 0.07))]


def holds(hull_box: Box, box: Box) -> bool:
    """Whether a box that was made of outlines from above is round the true one, to 2 mm, and little larger but in
    height, which they do not tell."""
    corners = rigid_transform.transform_points(rigid_transform.invert(hull_box.T_world_box), box.corners_world)
    return bool((np.abs(corners) <= hull_box.size / 2 + 0.002).all()) and iou(hull_box, box) > 0.4


@pytest.fixture(scope="module")
def ring_folder(tmp_path_factory: pytest.TempPathFactory, ring_scene: ModuleType) -> Path:
    return ring_scene.write(tmp_path_factory.mktemp("ring") / "ring")


@pytest.fixture
def store(tmp_path: Path) -> Iterator[SessionStore]:
    with SessionStore(tmp_path / "sessions") as store:
        yield store


@pytest.fixture
def sid(store: SessionStore, ring_folder: Path) -> str:
    """Twelve frames, `00000.jpg` to `00011.jpg`, and the class `cup`."""
    return store.create(read_recording(ring_folder), name="ring", class_names=("cup",)).id


@pytest.fixture
def take(store: SessionStore, sid: str) -> Callable[..., ImportedLabels]:
    def run(path: Path, **more: Any) -> ImportedLabels:
        return LabelImport(store, SessionEditor(store)).run(sid, path, author="ana", **more)

    return run


@pytest.fixture
def coco(ring_scene: ModuleType, tmp_path: Path) -> Callable[..., Path]:
    """A COCO file of BOXES, all of class `cup`, in the ring's frames; `change` sees each annotation."""

    def write(
        *,
        frames: int = 6,
        outlines: bool = True,
        change: Callable[[dict[str, Any]], object] = lambda one: one.update(track_id=one["box"]),
        **image: Any,
    ) -> Path:
        Ts = ring_scene.poses()
        annotations: list[dict[str, Any]] = []
        for i in range(frames):
            for b, box in enumerate(BOXES):
                x0, y0, x1, y1 = labels_of_boxes(ring_scene.CAMERA, Ts[i : i + 1], [box]).bbox[0, 0].tolist()
                one = {"id": len(annotations) + 1, "image_id": i, "category_id": 3, "box": b, "frame": i}
                one["bbox"] = [x0, y0, x1 - x0, y1 - y0]
                if outlines:
                    one["segmentation"] = [outline(ring_scene.CAMERA, Ts[i], box).ravel().tolist()]
                change(one)
                annotations.append(one)
        images = [
            {"id": i, "file_name": f"{i:05d}.jpg", "width": ring_scene.WIDTH, "height": ring_scene.HEIGHT, **image}
            for i in range(frames)
        ]
        content = {"images": images, "annotations": annotations, "categories": [{"id": 3, "name": "cup"}]}
        file = tmp_path / "instances.json"
        file.write_text(json.dumps(content))
        return file

    return write


@pytest.mark.parametrize("with_world", [True, False])
def test_a_bop_scene_becomes_boxes_where_they_are(
    bop_scene: ModuleType, ring_scene: ModuleType, store: SessionStore, sid: str, take, tmp_path: Path, with_world: bool
) -> None:
    """The session's cameras are what counts, so a scene without a world of its own does as well."""
    scene = bop_scene.write(ring_scene, tmp_path / "bop", frames=12, images=False, with_world=with_world)
    made = take(scene)
    assert (made.boxes, made.masks, made.left_out) == (3, 0, ())
    assert made.new_classes == ("obj_000001", "obj_000007")
    state = store.state(sid)
    z = (0.0, 0.0, 1.0)
    assert state.classes[1].symmetry == Symmetry("discrete", ((z, 2),))
    assert state.classes[2].symmetry == Symmetry("continuous", axis=z)
    assert [(box.name, box.class_id) for box in state.boxes.values()] == [
        ("obj_000001", 1),
        ("obj_000001 2", 1),
        ("obj_000007", 2),
    ]
    for box, (_, want) in list(zip(state.boxes.values(), bop_scene.OBJECTS, strict=True))[:2]:
        assert iou(box.box, want) > 1 - 1e-6
    (edit,) = store.edits(sid, after=0, limit=10)
    assert (edit.summary, edit.author) == ("Import labels (bop) of 3 objects", "ana")
    SessionEditor(store).undo(sid, author="ana")
    assert (store.state(sid).boxes, list(store.state(sid).classes)) == ({}, [0])


def test_a_bop_dataset_of_this_program_says_what_its_images_and_objects_are(
    bop_scene: ModuleType, ring_scene: ModuleType, store: SessionStore, sid: str, take, tmp_path: Path
) -> None:
    """Images are numbered anew in it, a model need not fill its box, and two sizes of a class are two models."""
    scene = bop_scene.write(ring_scene, tmp_path / "bop", frames=12, images=False, models=bop_scene.CENTRED)
    objects: dict[str, Any] = {}
    for obj_id in ("1", "7"):
        model = bop_scene.CENTRED[obj_id]
        size = [model["size_x"] + 2, model["size_y"] + 2, model["size_z"] + 2]
        objects[obj_id] = {"class": "cup", "shape": "hull", "size_mm": size, "boxes": []}
    (tmp_path / "bop" / "objects.json").write_text(json.dumps(objects))
    # Backwards: image i is frame 11 - i.
    (tmp_path / "bop" / "frames.txt").write_text("".join(f"{i:06d} ring!{11 - i:05d}.jpg\n" for i in range(12)))
    for name in ("scene_gt.json", "scene_camera.json"):
        content = json.loads((scene / name).read_text())
        val = tmp_path / "bop" / "val" / "000001"
        val.mkdir(parents=True, exist_ok=True)
        turned = {str(11 - int(i)): one for i, one in content.items()}
        (scene / name).write_text(json.dumps({i: one for i, one in turned.items() if int(i) >= 4}))
        (val / name).write_text(json.dumps({i: one for i, one in turned.items() if int(i) < 4}))
    made = take(tmp_path / "bop")
    assert (made.boxes, made.left_out, made.new_classes) == (3, (), ())
    first = store.state(sid).boxes[1]
    assert (first.class_id, first.name) == (0, "cup")
    np.testing.assert_allclose(first.box.size, [0.062, 0.042, 0.082])
    np.testing.assert_allclose(first.box.T_world_box[:3, 2:], bop_scene.OBJECTS[0][1].T_world_box[:3, 2:], atol=1e-9)


def test_a_class_that_is_there_keeps_its_symmetry(
    bop_scene: ModuleType, ring_scene: ModuleType, store: SessionStore, sid: str, take, tmp_path: Path
) -> None:
    SessionEditor(store).add_class(sid, name="obj_000007", author="ana")
    made = take(bop_scene.write(ring_scene, tmp_path / "bop", images=False))
    assert made.new_classes == ("obj_000001",)
    assert store.state(sid).classes[1].symmetry.kind == "none"
    assert made.notes[1:] == ("The class obj_000007 keeps the symmetry that it has; the file says another.",)


def test_poses_that_are_a_little_off_give_the_middle(
    bop_scene: ModuleType, ring_scene: ModuleType, store: SessionStore, sid: str, take, tmp_path: Path
) -> None:
    """3 mm and 1 degree of noise, and one pose in twelve quite wrong."""
    scene = bop_scene.write(ring_scene, tmp_path / "bop", frames=12, images=False)
    truth = json.loads((scene / "scene_gt.json").read_text())
    random = np.random.default_rng(3)
    for i, objects in truth.items():
        for one in objects:
            wxyz = np.array([1.0, *random.normal(0, 0.5 * np.radians(1.0) / np.sqrt(3), 3)])
            R = np.array(one["cam_R_m2c"]).reshape(3, 3) @ rigid_transform.rotation_from_wxyz(wxyz)
            one["cam_R_m2c"] = R.ravel().tolist()
            one["cam_t_m2c"] = (np.array(one["cam_t_m2c"]) + random.normal(0, 2.0, 3)).tolist()
        if i == "5":
            objects[0]["cam_t_m2c"][2] += 30.0
    (scene / "scene_gt.json").write_text(json.dumps(truth))
    made = take(scene)
    assert made.boxes == 3
    for box, (_, want) in zip(store.state(sid).boxes.values(), bop_scene.OBJECTS, strict=True):
        assert np.linalg.norm(box.box.T_world_box[:3, 3] - want.T_world_box[:3, 3]) < 0.003


def test_an_object_that_is_carried_is_left_out_and_told(
    bop_scene: ModuleType, ring_scene: ModuleType, take, tmp_path: Path
) -> None:
    scene = bop_scene.write(ring_scene, tmp_path / "bop", frames=12, images=False)
    truth = json.loads((scene / "scene_gt.json").read_text())
    for i, objects in truth.items():
        T_world_box = bop_scene.OBJECTS[2][1].T_world_box.copy()
        T_world_box[0, 3] += 0.015 * int(i)
        objects[2] = bop_scene.truth_of(ring_scene.poses()[int(i)], 7, T_world_box)
    (scene / "scene_gt.json").write_text(json.dumps(truth))
    made = take(scene)
    assert made.boxes == 2
    (reason,) = made.left_out
    assert reason.count == 12
    assert "it does not rest: its poses are" in reason.reason
    assert reason.examples[0] == "image 0, object 2 (obj_id 7)"


def test_a_bop_scene_of_other_cameras_is_noted_and_images_beyond_are_told(
    bop_scene: ModuleType, ring_scene: ModuleType, take, tmp_path: Path
) -> None:
    scene = bop_scene.write(ring_scene, tmp_path / "bop", frames=4, images=False)
    for name in ("scene_gt.json", "scene_camera.json"):
        content = json.loads((scene / name).read_text())
        content["70"] = content["0"]
        (scene / name).write_text(json.dumps(content))
    cameras = json.loads((scene / "scene_camera.json").read_text())
    cameras["1"]["cam_K"][0] = 700.0
    (scene / "scene_camera.json").write_text(json.dumps(cameras))
    made = take(scene)
    assert made.boxes == 3
    assert [(one.reason, one.count) for one in made.left_out] == [(NO_FRAME, 3)]
    assert "digits in a frame's name" in made.notes[0]
    assert "The cameras of 1 images differ" in made.notes[1]
    assert "700.0" in made.notes[1]


def test_outlines_become_masks_and_the_box_of_their_hull(coco, store: SessionStore, sid: str, take) -> None:
    made = take(coco())
    assert (made.boxes, made.masks, made.new_classes, made.left_out) == (2, 12, (), ())
    assert [one.made_of for one in made.objects] == ["outlines", "outlines"]
    state = store.state(sid)
    for box, want in zip(state.boxes.values(), BOXES, strict=True):
        assert box.has_hull
        assert box.class_id == 0
        assert holds(box.box, want)
        assert [mask.frame for mask in state.masks_of(box.id)] == list(range(6))
    assert len(store.edits(sid, after=0, limit=10)) == 1
    SessionEditor(store).undo(sid, author="ana")
    assert (store.state(sid).boxes, store.state(sid).masks) == ({}, {})


def test_rectangles_give_the_box_that_fits_them(coco, store: SessionStore, sid: str, take) -> None:
    made = take(coco(outlines=False, frames=8))
    assert (made.boxes, made.masks, made.left_out) == (2, 0, ())
    assert [one.made_of for one in made.objects] == ["rectangles", "rectangles"]
    for box, want in zip(store.state(sid).boxes.values(), BOXES, strict=True):
        assert iou(box.box, want) > 0.98
    assert "fitted to 8 rectangles, 0.0 px off" in made.objects[0].note


def test_too_few_rectangles_or_such_that_fit_nothing_are_left_out(coco, take) -> None:
    (few,) = take(coco(outlines=False, frames=2)).left_out
    assert few.count == 4
    assert "fewer than 3" in few.reason

    def astray(one: dict[str, Any]) -> None:
        one["track_id"] = one["box"]
        if one["frame"] % 2:
            one["bbox"] = [10.0 + 5 * one["frame"], 20.0, 30.0, 90.0]

    made = take(coco(outlines=False, change=astray))
    assert made.boxes == 0
    assert made.notes == ("Nothing of the file can come in; what is left out says why.",)
    assert all("no box can be fitted to those of its object" in one.reason for one in made.left_out)


def test_several_of_a_class_need_to_be_told_from_each_other(coco, store: SessionStore, sid: str, take) -> None:
    made = take(coco(change=lambda one: None))
    assert (made.boxes, made.masks) == (0, 0)
    assert [(one.reason, one.count) for one in made.left_out] == [(UNTOLD, 12)]
    assert store.state(sid).revision == 0


def test_one_of_a_class_in_each_image_is_one_object(coco, store: SessionStore, sid: str, take) -> None:
    file = coco(change=lambda one: None)
    content = json.loads(file.read_text())
    content["annotations"] = [one for one in content["annotations"] if one["box"] == 1]
    file.write_text(json.dumps(content))
    made = take(file)
    assert (made.boxes, made.masks) == (1, 6)
    assert holds(next(iter(store.state(sid).boxes.values())).box, BOXES[1])


def test_outlines_that_fit_no_object_come_in_without_a_box(coco, store: SessionStore, sid: str, take) -> None:
    def shifted(one: dict[str, Any]) -> None:
        one["track_id"] = one["box"]
        if one["frame"] == 2 and one["box"] == 0:
            one["segmentation"] = [[10.0, 10.0, 40.0, 10.0, 40.0, 40.0]]

    made = take(coco(change=shifted))
    assert (made.boxes, made.masks) == (1, 12)
    assert made.objects[0].box is None
    assert made.objects[0].note.startswith("no box: ")
    assert made.objects[0].box_id == 1
    assert len(store.state(sid).masks_of(1)) == 6


def test_of_many_outlines_some_count_for_the_hull(coco, store: SessionStore, sid: str, take, monkeypatch) -> None:
    monkeypatch.setattr("ars_web.masks.label_import.MOST_VIEWS", 4)
    made = take(coco(frames=12))
    masks = store.state(sid).masks_of(1)
    assert [mask.frame for mask in masks if mask.accepted] == [0, 4, 7, 11]
    assert len(masks) == 12
    assert made.objects[0].note == "4 of its outlines count for its hull"
    assert MOST_VIEWS > 12


def test_outlines_from_sides_that_are_alike_are_told(coco, take) -> None:
    made = take(coco(frames=2))
    assert made.boxes == 2
    for one in made.objects:
        assert "its outlines are from at most 3" in one.note
        assert "degrees apart: the box is far too long" in one.note


def test_a_dry_run_says_the_same_and_stores_nothing(coco, store: SessionStore, sid: str, take) -> None:
    tried = take(coco(), dry_run=True)
    assert (tried.boxes, tried.masks, tried.revision) == (2, 12, None)
    assert [one.box_id for one in tried.objects] == [None, None]
    assert store.state(sid).revision == 0
    made = take(coco())
    assert made.revision == 1
    assert [one.box.T_world_box.tolist() for one in made.objects] == [
        one.box.T_world_box.tolist() for one in tried.objects
    ]


def test_a_repeat_with_its_key_adds_nothing(coco, store: SessionStore, sid: str, take) -> None:
    first = take(coco(), key="k", request="file 1")
    again = take(coco(), key="k", request="file 1")
    assert [one.box_id for one in first.objects] == [one.box_id for one in again.objects] == [1, 2]
    assert store.state(sid).revision == 1
    with pytest.raises(BadInput, match="was used for another request"):
        take(coco(), key="k", request="file 2")


@pytest.mark.parametrize(
    ("image", "said"),
    [
        ({"width": 640}, "00000.jpg has 640 x 240 pixels there, frame 0 (00000.jpg) 320 x 240"),
        ({"file_name": "other.jpg"}, "none of its 6 images is a frame of the session: its first is other.jpg"),
    ],
)
def test_labels_of_other_images_are_refused(coco, store: SessionStore, sid: str, take, image, said: str) -> None:
    with pytest.raises(BadFile) as refused:
        take(coco(**image))
    assert said in str(refused.value)
    assert store.state(sid).revision == 0


@pytest.mark.parametrize("with_ids", [True, False])
def test_what_this_program_exports_comes_back(
    store: SessionStore, sid: str, take, tmp_path: Path, with_ids: bool
) -> None:
    """An annotation's id says whose it is, where dataset.json says that it is this program's."""
    editor = SessionEditor(store)
    for box in BOXES:
        editor.add_box(sid, class_id=0, box=box, author="ana")
    options = ExportOptions.model_validate({"images": "none", "split": {"train": 1.0, "val": 0.0}})
    run_export(plan_export([store.snapshot(sid)], format="coco", options=options, out=tmp_path / "out"))
    if not with_ids:
        (tmp_path / "out" / "dataset.json").unlink()
    made = take(tmp_path / "out")
    if not with_ids:
        assert [one.reason for one in made.left_out] == [UNTOLD]
        return
    assert (made.boxes, made.masks) == (2, 24)
    for box, want in zip(list(store.state(sid).boxes.values())[2:], BOXES, strict=True):
        assert holds(box.box, want)
