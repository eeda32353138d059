"""The truth is true: held against the pixels, against the boxes' exact projection, and against the picture."""

import math

import cv2
import numpy as np
import pytest

from ars_web.demo import measuring, rendering, scene, shapes
from ars_web.demo.recording import load_demo
from ars_web.errors import BadFile, NotFound
from ars_web.geometry import rigid_transform
from ars_web.geometry.labels import labels_of_boxes
from ars_web.recordings.registry import read_recording


@pytest.fixture(scope="module")
def labels(demo_recording):
    """The exact labels of the true boxes."""
    truth = demo_recording
    return labels_of_boxes(truth.camera, truth.Ts_world_camera, [thing.box for thing in truth.objects], tolerance=0.01)


def clipped(bbox, camera):
    x0, y0, x1, y1 = bbox
    return max(x0, 0), max(y0, 0), min(x1, camera.width), min(y1, camera.height)


def test_every_pixel_that_sees_an_object_lies_in_its_amodal_box(demo_recording, sights):
    for i, sight in enumerate(sights):
        for b, alone in enumerate(sight.alone):
            if alone.any():
                rows, columns = np.nonzero(alone)
                x0, y0, x1, y1 = demo_recording.bbox_amodal[i, b]
                # A pixel's centre is seen, not its edge: half a pixel of it may stick out.
                assert x0 <= columns.min() + 0.5 + 0.05
                assert columns.max() + 0.5 - 0.05 <= x1
                assert y0 <= rows.min() + 0.5 + 0.05
                assert rows.max() + 0.5 - 0.05 <= y1


def test_amodal_boxes_are_no_larger_than_the_pixels_seen(demo_recording, sights):
    compared = 0
    for i, sight in enumerate(sights):
        for b, alone in enumerate(sight.alone):
            bbox = demo_recording.bbox_amodal[i, b]
            if alone.any() and tuple(bbox) == clipped(bbox, demo_recording.camera):
                # A corner sharper than a pixel may fall between the pixels' centres.
                np.testing.assert_allclose(measuring.box_of_pixels(alone), bbox, atol=2.0)
                compared += 1
    assert compared > 30


def test_the_boxes_projection_contains_the_surfaces(demo_recording, labels):
    known = np.isfinite(demo_recording.bbox_amodal[..., 0])
    true, ours = demo_recording.bbox_amodal[known], labels.bbox_amodal[known]
    assert known.sum() > 60
    assert (ours[:, :2] <= true[:, :2] + 0.02).all()
    assert (ours[:, 2:] >= true[:, 2:] - 0.02).all()


def test_a_box_shaped_objects_label_is_its_surfaces(demo_recording, labels, sights):
    cartons = [b for b, thing in enumerate(demo_recording.objects) if thing.class_name == "box"]
    assert len(cartons) == 3
    for i, sight in enumerate(sights):
        for b in cartons:
            if np.isfinite(demo_recording.bbox_amodal[i, b]).all():
                np.testing.assert_allclose(labels.bbox_amodal[i, b], demo_recording.bbox_amodal[i, b], atol=0.05)
            if sight.alone[b].sum() > 200:
                np.testing.assert_allclose(labels.bbox[i, b], measuring.box_of_pixels(sight.alone[b]), atol=1.5)
            if not sight.alone[b].any():
                assert not np.isfinite(labels.bbox[i, b]).all()


def test_counts_are_those_of_the_pixels(demo_recording, sights):
    truth = demo_recording
    for i, sight in enumerate(sights):
        for b in range(len(truth.objects)):
            assert truth.px_in_image[i, b] == sight.alone[b].sum()
            assert truth.px_visible[i, b] == (sight.objects == b).sum()
            assert (sight.alone[b] | (sight.objects != b)).all()
            if truth.px_visible[i, b]:
                assert tuple(truth.bbox_visible[i, b]) == tuple(measuring.box_of_pixels(sight.objects == b))
            else:
                assert np.isnan(truth.bbox_visible[i, b]).all()


def test_visible_fractions_are_shares(demo_recording):
    truth = demo_recording
    fractions = truth.visible_fractions
    assert ((fractions >= 0) & (fractions <= 1)).all()
    np.testing.assert_allclose(fractions * truth.px_in_image, truth.px_visible, rtol=1e-12)


def test_the_nearest_object_is_the_one_seen(demo_recording, sights, things):
    """A second opinion on the order in depth: the distance from the camera to each object's surface points."""
    i = 0
    eye = demo_recording.Ts_world_camera[i][:3, 3]
    near = [np.linalg.norm(measuring.surface_points_world(thing) - eye, axis=1) for thing in things]
    for b in range(len(things)):
        depths = sights[i].depths[sights[i].objects == b]
        assert depths.min() >= near[b].min() - 1e-4
        assert depths.max() <= near[b].max() + 1e-4
        both = sights[i].alone[b] & (sights[i].objects != b) & (sights[i].objects >= 0)
        assert (sights[i].depths[both] <= near[b].max()).all()


def test_the_recording_has_what_it_is_for(demo_recording):
    """Hidden objects, objects partly out of the image, an image of none, and every class in sight."""
    truth = demo_recording
    fractions, in_image = truth.visible_fractions, truth.px_in_image > 0
    assert ((fractions > 0.05) & (fractions < 0.8) & in_image).any()
    boxes = truth.bbox_amodal
    beyond = (boxes[..., :2] < -5).any(axis=-1) | (boxes[..., 2] > truth.camera.width + 5)
    assert (beyond & in_image & (truth.px_in_image > 100)).any()
    assert (truth.px_in_image[-1] == 0).all()
    assert (truth.px_visible[:-1].sum(axis=1) > 0).all()
    assert {truth.objects[b].class_name for b in np.flatnonzero(in_image.any(axis=0))} == set(truth.class_names)


def test_with_sixty_frames_the_last_three_show_nothing(parts):
    camera = scene.camera(96, 72)
    rays = rendering.ray_table(camera)
    seen = [rendering.look(parts, rays, T).alone.any() for T in scene.camera_path(60)]
    assert seen == [True] * 57 + [False] * 3


def test_boxes_touch_their_surfaces_on_all_six_sides(things):
    for thing in things:
        box = thing.box
        points = rigid_transform.transform_points(
            rigid_transform.invert(box.T_world_box), measuring.surface_points_world(thing)
        )
        # 257 points round a circle may miss its extreme by 8e-5 of the radius.
        np.testing.assert_allclose(points.max(axis=0), box.size / 2, atol=1e-5)
        np.testing.assert_allclose(points.min(axis=0), -box.size / 2, atol=1e-5)


def test_no_object_reaches_into_another_or_the_desk(things, parts):
    for b, thing in enumerate(things):
        points = measuring.surface_points_world(thing)
        assert points[:, 2].min() > -1e-6
        for part in parts[(parts["owner"] != b) & (parts["owner"] >= 0)]:
            local = (points - part["middle"]) @ part["rotation"]
            near = local[np.linalg.norm(local, axis=1) < part["reach"]]
            # A thing may stand on another, as the die does: a micrometre is contact.
            size = tuple(float(s) - 1e-6 for s in part["size"])
            assert not any(shapes.holds(int(part["kind"]), size, tuple(point)) for point in near), thing.name


def test_the_picture_shows_what_the_truth_says(demo_recording, sights, things):
    """The tennis ball is yellow where the truth has it, and the desk is not."""
    ball = [thing.name for thing in things].index("tennis ball")
    for i in np.flatnonzero(demo_recording.px_visible[:, ball] > 100):
        image = cv2.imread(str(demo_recording.folder / "images" / demo_recording.image_names[i])).astype(float)
        yellow = np.minimum(image[..., 1], image[..., 2]) - image[..., 0]
        inside = sights[i].objects == ball
        assert yellow[inside].mean() > 60
        around = cv2.dilate(inside.astype(np.uint8), np.ones((9, 9))) - cv2.dilate(
            inside.astype(np.uint8), np.ones((3, 3))
        )
        assert yellow[around == 1].mean() < yellow[inside].mean() - 40


def test_the_scene_folder_reads_back_to_the_truth(demo_recording):
    recording = read_recording(demo_recording.folder)
    assert recording.format == "ars"
    assert not recording.skipped
    assert list(recording.cameras.values()) == [demo_recording.camera]
    assert [frame.name for frame in recording.frames] == list(demo_recording.image_names)
    np.testing.assert_allclose(recording.Ts_world_camera, demo_recording.Ts_world_camera, atol=1e-9)


def test_the_hand_is_not_the_camera(demo_recording):
    x, y, z, *quaternion = map(float, (demo_recording.folder / "camera_extrinsics.txt").read_text().split())
    assert math.hypot(x, y, z) > 0.05
    assert abs(quaternion[3]) < 0.9


def test_load_demo_returns_what_make_demo_returned(demo_recording):
    again = load_demo(demo_recording.folder)
    assert again.class_names == demo_recording.class_names
    assert again.camera == demo_recording.camera
    assert [(o.class_name, o.name) for o in again.objects] == [(o.class_name, o.name) for o in demo_recording.objects]
    for field in ("Ts_world_camera", "bbox_amodal", "bbox_visible", "px_in_image", "px_visible", "visible_fractions"):
        np.testing.assert_array_equal(getattr(again, field), getattr(demo_recording, field))


def test_load_demo_names_what_is_missing(tmp_path):
    with pytest.raises(NotFound, match=r"no truth\.json"):
        load_demo(tmp_path)


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b'{"version": 1}'])
def test_load_demo_names_the_damaged_file(tmp_path, content):
    (tmp_path / "truth.json").write_bytes(content)
    with pytest.raises(BadFile, match=r"truth\.json: not the truth"):
        load_demo(tmp_path)
