"""The smart tool: objects of the generated recording found from a rough rectangle, scribbles, and what is refused."""

import sys
from dataclasses import dataclass

import cv2
import numpy as np
import pytest
import shapely

from ars_web.demo import building, rendering, scene
from ars_web.errors import BadInput
from ars_web.geometry.mask_regions import iou, mask_from_polygons, polygons_from_mask
from ars_web.masks.grab_cut import GrabCutSegmenter
from ars_web.masks.segmenter import SegmentPrompt, Stroke
from ars_web.recordings.images import read_image

GOOD = 0.85
SMALLEST = 150
"""Pixels of an object in the small images that is looked for."""

Rectangle = tuple[float, float, float, float]


@dataclass(frozen=True)
class Sight:
    """An object that is wholly visible in a photograph."""

    name: str
    frame: int
    image: np.ndarray
    truth: np.ndarray
    rectangle: Rectangle


def overlap(a: np.ndarray, b: np.ndarray) -> float:
    return float((a & b).sum() / (a | b).sum())


@pytest.fixture(scope="module")
def whole(demo_recording) -> list[Sight]:
    """Every object in every frame that shows it whole, with a rectangle about a tenth too large, drawn by a hand that
    shakes."""
    parts = building.place(scene.things(), desk=scene.desk())
    rays = rendering.ray_table(demo_recording.camera)
    random = np.random.default_rng(0)
    found: list[Sight] = []
    for frame, name in enumerate(demo_recording.image_names):
        looked = rendering.look(parts, rays, np.array(demo_recording.Ts_world_camera[frame]))
        image = read_image(demo_recording.folder / "images" / name)
        height, width = image.shape[:2]
        for number, thing in enumerate(demo_recording.objects):
            truth = looked.objects == number
            box = demo_recording.bbox_amodal[frame, number]
            hidden = truth.sum() < 0.995 * looked.alone[number].sum()
            inside = np.isfinite(box).all() and (box[:2] > 3).all() and (box[2:] < (width - 3, height - 3)).all()
            if truth.sum() < SMALLEST or hidden or not inside:
                continue
            size = np.tile(box[2:] - box[:2], 2)
            rough = box + (np.array([-0.1, -0.1, 0.1, 0.1]) + random.uniform(-0.04, 0.04, 4)) * size
            found.append(Sight(thing.name, frame, image, truth, tuple(rough.tolist())))
    return found


def test_every_object_that_is_wholly_visible_is_found_from_a_rough_rectangle(whole, capsys):
    """Mean and median over its frames; the images are small, 480 x 360."""
    by_name: dict[str, list[float]] = {}
    for sight in whole:
        found = GrabCutSegmenter().segment(sight.image, SegmentPrompt(rectangle=sight.rectangle))
        by_name.setdefault(sight.name, []).append(overlap(found, sight.truth))
    with capsys.disabled():
        for name, ious in sorted(by_name.items()):
            each = " ".join(f"{iou:.2f}" for iou in ious)
            sys.stdout.write(f"  {name:12} mean {np.mean(ious):.3f} of {len(ious)}: {each}\n")
    assert len(by_name) >= 8
    for name, ious in by_name.items():
        assert min(np.mean(ious), np.median(ious)) >= GOOD, name


def test_scribbles_mend_what_the_rectangle_alone_gets_wrong(whole):
    """Three strokes, each where the answer before is most wrong, and the answer before to begin from."""
    before: list[float] = []
    after: list[float] = []
    for sight in whole[::6]:
        inside: list[Stroke] = []
        outside: list[Stroke] = []
        mask = GrabCutSegmenter().segment(sight.image, SegmentPrompt(rectangle=sight.rectangle))
        before.append(overlap(mask, sight.truth))
        for _ in range(3):
            missed, added = sight.truth & ~mask, mask & ~sight.truth
            strokes, wrong = (inside, missed) if missed.sum() >= added.sum() else (outside, added)
            depth = cv2.distanceTransform(np.pad(wrong, 1).astype(np.uint8), cv2.DIST_L2, 5)[1:-1, 1:-1]
            row, column = np.unravel_index(int(depth.argmax()), depth.shape)
            if depth.max() < 1:
                break
            strokes.append(Stroke(np.array([[column + 0.5, row + 0.5]]), max(1.0, float(depth.max()))))
            prompt = SegmentPrompt(sight.rectangle, tuple(inside), tuple(outside), mask)
            mask = GrabCutSegmenter().segment(sight.image, prompt)
        after.append(overlap(mask, sight.truth))
    assert np.mean(after) > np.mean(before)
    assert np.mean(after) > 0.9


def photograph(width: int = 200, height: int = 160) -> tuple[np.ndarray, np.ndarray]:
    """A red disc on green, and where it is."""
    random = np.random.default_rng(1)
    image = np.full((height, width, 3), (60, 150, 50), dtype=np.uint8)
    ys, xs = np.mgrid[:height, :width]
    truth = np.hypot(xs + 0.5 - 0.45 * width, ys + 0.5 - 0.5 * height) < 0.2 * height
    image[truth] = (40, 40, 200)
    return (image + random.normal(0, 4, image.shape)).clip(0, 255).astype(np.uint8), truth


def test_the_outline_is_right_to_half_a_pixel():
    image, truth = photograph()
    found = GrabCutSegmenter().segment(image, SegmentPrompt(rectangle=(50, 40, 130, 120)))
    (outline,) = polygons_from_mask(found)
    disc = shapely.Polygon(outline.outer)
    np.testing.assert_allclose(disc.centroid.coords[0], (90, 80), atol=0.5)
    assert np.sqrt(disc.area / np.pi) == pytest.approx(32, abs=0.5)
    assert iou(polygons_from_mask(truth), [outline]) > 0.97


def test_a_large_photograph_gives_the_same_place():
    image, truth = photograph(2000, 1600)
    found = GrabCutSegmenter().segment(image, SegmentPrompt(rectangle=(500, 400, 1300, 1200)))
    assert overlap(found, truth) > 0.97


def test_a_stroke_alone_is_enough():
    image, truth = photograph()
    found = GrabCutSegmenter().segment(image, SegmentPrompt(inside=(Stroke(np.array([[80.0, 80], [100, 80]]), 10),)))
    assert overlap(found, truth) > 0.95


def test_strokes_are_kept_to():
    image, truth = photograph()
    beside = Stroke(np.array([[90.0, 48], [90.0, 80]]), 6)
    on = Stroke(np.array([[110.0, 112], [125.0, 112]]), 4)
    found = GrabCutSegmenter().segment(image, SegmentPrompt((50, 40, 130, 120), (on,), (beside,)))
    assert not found[50:78, 89:92].any()
    assert found[112, 112:124].all()
    assert overlap(found, truth) > 0.8


def test_nothing_outside_the_rectangle_is_found():
    image, _ = photograph()
    found = GrabCutSegmenter().segment(image, SegmentPrompt(rectangle=(50, 40, 90, 120)))
    assert not found[:, 90:].any()


def test_a_start_is_begun_from():
    image, truth = photograph()
    rough = mask_from_polygons(polygons_from_mask(cv2.dilate(truth.astype(np.uint8), np.ones((9, 9))) > 0), 200, 160)
    found = GrabCutSegmenter().segment(image, SegmentPrompt(start=rough))
    assert overlap(found, truth) > 0.95


def test_a_start_beside_the_rectangle_does_not_count():
    image, truth = photograph()
    beside = np.zeros_like(truth)
    beside[5:20, 150:190] = True
    found = GrabCutSegmenter().segment(image, SegmentPrompt(rectangle=(50, 40, 130, 120), start=beside))
    assert overlap(found, truth) > 0.95


def test_the_same_question_has_the_same_answer(whole):
    prompt = SegmentPrompt(rectangle=whole[0].rectangle)
    first = GrabCutSegmenter().segment(whole[0].image, prompt)
    cv2.setRNGSeed(99)
    np.testing.assert_array_equal(GrabCutSegmenter().segment(whole[0].image, prompt), first)


@pytest.mark.parametrize(
    "rectangle", [(300, 10, 350, 60), (-50, -50, -1, -1), (10, 200, 60, 260), (199.5, 10, 260, 60)]
)
def test_a_rectangle_outside_the_image_is_refused_with_the_remedy(rectangle):
    with pytest.raises(BadInput, match=r"lies outside the image, which is 200 x 160 pixels.*draw it round the object"):
        GrabCutSegmenter().segment(photograph()[0], SegmentPrompt(rectangle=rectangle))


def test_a_rectangle_that_reaches_beyond_the_image_is_cut():
    image, truth = photograph()
    found = GrabCutSegmenter().segment(image, SegmentPrompt(rectangle=(50, 40, 900, 120)))
    assert (found & truth).sum() > 0.5 * truth.sum()


@pytest.mark.parametrize("rectangle", [(60, 10, 10, 60), (10, 10, 10, 60), (10, 10, float("nan"), 60)])
def test_a_rectangle_that_is_none_is_refused(rectangle):
    with pytest.raises(BadInput, match="x0 < x1"):
        SegmentPrompt(rectangle=rectangle)


def test_a_prompt_that_says_nothing_is_refused():
    with pytest.raises(BadInput, match="give a rectangle round it, or a stroke on it"):
        SegmentPrompt(outside=(Stroke(np.array([[3.0, 4]])),))
    with pytest.raises(BadInput, match="give a rectangle"):
        SegmentPrompt(start=np.zeros((160, 200), dtype=np.bool_))


def test_a_stroke_outside_the_image_is_refused():
    with pytest.raises(BadInput, match="lies outside the image"):
        GrabCutSegmenter().segment(photograph()[0], SegmentPrompt(inside=(Stroke(np.array([[500.0, 4]])),)))


def test_strokes_that_leave_nothing_are_refused_with_the_remedy():
    all_over = Stroke(np.array([[20.0, 80], [180, 80]]), 200)
    with pytest.raises(BadInput, match="take some back"):
        GrabCutSegmenter().segment(photograph()[0], SegmentPrompt((50, 40, 130, 120), (), (all_over,)))


@pytest.mark.parametrize("points", [[], [[1.0, float("inf")]], [[1.0]]])
def test_a_stroke_that_is_none_is_refused(points):
    with pytest.raises(BadInput, match="a stroke needs"):
        Stroke(np.array(points))


@pytest.mark.parametrize("width", [0.0, -2.0, float("nan"), 1e6])
def test_a_brush_that_is_none_is_refused(width):
    with pytest.raises(BadInput, match="brush"):
        Stroke(np.array([[1.0, 2.0]]), width)
