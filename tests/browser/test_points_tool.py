"""A box from four corners, clicked where the truth says they are."""

import re
from itertools import combinations

import httpx
import numpy as np
import pytest
from playwright.sync_api import Locator, Page, expect

from ars_web.demo.truth import DemoObject, DemoTruth
from ars_web.geometry import camera as cameras
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box

LARGE = {"viewport": {"width": 2400, "height": 1500}}
"""A pane shows an image pixel as two or more of its own, so that a click is exact to a quarter of one."""

SIGNS = np.array([[-1, -1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1]])
"""P0 to P3 of a box: up its height, along x, along y."""


def seen_at(truth: DemoTruth, frame: int, points_world: np.ndarray) -> np.ndarray:
    """Image coordinates of points of the world."""
    T_camera_world = rigid_transform.invert(truth.Ts_world_camera[frame])
    in_camera = rigid_transform.transform_points(T_camera_world, points_world)
    return cameras.image_from_pixels(cameras.pixels_from_camera_points(truth.camera, in_camera))


def corners_of(thing: DemoObject) -> np.ndarray:
    return rigid_transform.transform_points(thing.box.T_world_box, SIGNS * thing.box.size / 2)


@pytest.fixture
def seen_twice(demo_recording: DemoTruth) -> tuple[DemoObject, int, int]:
    """An object, and two frames from well different sides that show its four corners inside the image."""
    truth = demo_recording
    width, height = truth.camera.width, truth.camera.height
    for thing in truth.objects:
        corners = corners_of(thing)
        whole = []
        for frame in range(len(truth.image_names)):
            at = seen_at(truth, frame, corners)
            if np.isfinite(at).all() and (at > 10).all() and (at < [width - 10, height - 10]).all():
                whole.append(frame)
        for a, b in combinations(whole, 2):
            towards = corners.mean(axis=0) - truth.Ts_world_camera[[a, b], :3, 3]
            towards /= np.linalg.norm(towards, axis=1, keepdims=True)
            if 25 < np.degrees(np.arccos(towards[0] @ towards[1])) < 60:
                return thing, a, b
    raise AssertionError("the demo shows no object from two sides")


def pane(page: Page, side: str) -> Locator:
    return page.get_by_role("application", name=f"{side} pane")


def show(page: Page, side: str, frame: int) -> None:
    field = page.get_by_label(f"Frame of the {side.lower()} pane")
    field.fill(str(frame))
    field.press("Enter")
    shown = page.get_by_role("application", name=f"{side} pane, frame {frame}.")
    expect(shown).to_have_attribute("aria-busy", "false")


def place_of(page: Page, side: str, at: np.ndarray, image: tuple[int, int]) -> tuple[float, float]:
    """Where the page shows a place of the image, while the pane shows all of it."""
    box = pane(page, side).bounding_box()
    assert box is not None
    zoom = min(box["width"] / image[0], box["height"] / image[1])
    left = box["x"] + (box["width"] - zoom * image[0]) / 2
    top = box["y"] + (box["height"] - zoom * image[1]) / 2
    return left + zoom * at[0], top + zoom * at[1]


def click(page: Page, side: str, at: np.ndarray, truth: DemoTruth) -> None:
    page.mouse.click(*place_of(page, side, at, (truth.camera.width, truth.camera.height)))


def furthest_corner(box: dict, thing: DemoObject) -> float:
    """Metres from a corner of the box to the truth's nearest, at most."""
    turn = rigid_transform.rotation_from_wxyz(np.array(box["T_world_box"]["wxyz"]))
    made = Box(rigid_transform.from_rotation(turn, np.array(box["T_world_box"]["position"])), np.array(box["size"]))
    apart = np.linalg.norm(made.corners_world[:, None] - thing.box.corners_world[None], axis=-1)
    return float(apart.min(axis=1).max())


def card(page: Page, corner: int) -> Locator:
    return page.get_by_role("list", name="Corners").get_by_role("button", name=f"P{corner}")


def test_corners_clicked_in_two_frames_make_the_box_of_the_truth(
    demo_recording: DemoTruth, boxed_session, open_flatly, seen_twice
) -> None:
    thing, a, b = seen_twice
    corners = corners_of(thing)
    at = {frame: seen_at(demo_recording, frame, corners) for frame in (a, b)}
    with open_flatly(*boxed_session, **LARGE) as workspace:
        page = workspace.page
        before = {box["id"] for box in workspace.answer("/boxes")}
        page.keyboard.press("p")
        expect(page.get_by_text("Click P0 in either frame")).to_be_visible()
        pane(page, "Right").wait_for()
        show(page, "Left", a)
        show(page, "Right", b)
        make = page.get_by_role("button", name="Make box")
        for corner in range(4):
            expect(card(page, corner)).to_have_attribute("aria-current", "step")
            expect(make).to_be_disabled()
            click(page, "Left", at[a][corner], demo_recording)
            expect(page.get_by_text(f"Now click P{corner} in frame {b}")).to_be_visible()
            click(page, "Right", at[b][corner], demo_recording)
            expect(card(page, corner)).to_contain_text(re.compile(r"0\.\d px"))
            expect(card(page, corner)).to_contain_text(re.compile(r"[2-6]\d°"))
        names = {one["name"]: one["id"] for one in workspace.answer("/classes")}
        page.get_by_label("Class of the box").select_option(label=thing.class_name)
        make.click()
        expect(page.get_by_text(re.compile(r"edges were set right by \d\.\d°"))).to_be_visible()
        expect(page.get_by_role("button", name="Select", exact=True)).to_have_attribute("aria-pressed", "true")
        boxes = [box for box in workspace.answer("/boxes") if box["id"] not in before]
        assert len(boxes) == 1
        assert boxes[0]["class_id"] == names[thing.class_name]
        assert furthest_corner(boxes[0], thing) < 0.002
        # It is the one that is selected.
        page.wait_for_function("id => location.hash.includes(`box=${id}`)", arg=boxes[0]["id"])


def test_all_of_it_can_be_done_by_keys(demo_recording: DemoTruth, boxed_session, open_flatly, seen_twice) -> None:
    thing, a, b = seen_twice
    corners = corners_of(thing)
    image = np.array([demo_recording.camera.width, demo_recording.camera.height])
    with open_flatly(*boxed_session) as workspace:
        page = workspace.page
        before = {box["id"] for box in workspace.answer("/boxes")}
        page.keyboard.press("p")
        pane(page, "Right").wait_for()
        cursor = {}
        for side, frame in (("Left", a), ("Right", b)):
            show(page, side, frame)
            cursor[side] = image / 2
        for corner in range(4):
            for side, frame in (("Left", a), ("Right", b)):
                pane(page, side).focus()
                goal = seen_at(demo_recording, frame, corners)[corner]
                for axis, keys in enumerate((("ArrowLeft", "ArrowRight"), ("ArrowUp", "ArrowDown"))):
                    tenths = round((goal[axis] - cursor[side][axis]) * 10)
                    key = keys[tenths > 0]
                    tens, rest = divmod(abs(tenths), 100)
                    ones, tenth = divmod(rest, 10)
                    for name, times in ((f"Shift+{key}", tens), (key, ones), (f"Alt+{key}", tenth)):
                        for _ in range(times):
                            page.keyboard.press(name)
                    cursor[side][axis] += tenths / 10
                page.keyboard.press("Enter")
            expect(card(page, corner)).to_contain_text("px")
        make = page.get_by_role("button", name="Make box")
        expect(make).to_be_enabled()
        make.press("Enter")
        expect(page.get_by_text(re.compile("edges were set right"))).to_be_visible()
        boxes = [box for box in workspace.answer("/boxes") if box["id"] not in before]
        assert len(boxes) == 1
        assert furthest_corner(boxes[0], thing) < 0.001


def test_marks_survive_another_frame_and_go_one_by_one(
    demo_recording: DemoTruth, boxed_session, open_flatly, seen_twice
) -> None:
    thing, a, b = seen_twice
    corners = corners_of(thing)
    with open_flatly(*boxed_session, **LARGE) as workspace:
        page = workspace.page
        page.keyboard.press("]")  # a box is selected, which must not be deleted by the tool's keys
        count = len(workspace.answer("/boxes"))
        page.keyboard.press("p")
        pane(page, "Right").wait_for()
        show(page, "Left", a)
        show(page, "Right", b)
        for corner in range(2):
            click(page, "Left", seen_at(demo_recording, a, corners)[corner], demo_recording)
            click(page, "Right", seen_at(demo_recording, b, corners)[corner], demo_recording)
            expect(card(page, corner)).to_contain_text("px")
        other = next(frame for frame in range(9) if frame not in (a, b))
        show(page, "Right", other)
        expect(card(page, 1)).to_contain_text("px")
        expect(page.get_by_text(re.compile("^Edges so far: z"))).to_be_visible()
        show(page, "Right", b)

        pane(page, "Right").focus()
        page.keyboard.press("Backspace")
        expect(card(page, 1)).to_contain_text("1 of 2 frames")
        page.keyboard.press("Escape")
        expect(card(page, 1)).to_contain_text("not marked")
        page.keyboard.press("Control+z")
        expect(card(page, 0)).to_contain_text("1 of 2 frames")
        page.keyboard.press("Escape")
        expect(card(page, 0)).to_contain_text("not marked")
        page.keyboard.press("Escape")
        expect(page.get_by_role("region", name="Box from four points")).to_have_count(0)
        assert len(workspace.answer("/boxes")) == count
        assert workspace.answer("")["revision"] == 0


def test_a_corner_that_was_clicked_wrongly_is_said_and_can_be_dragged(
    demo_recording: DemoTruth, boxed_session, open_flatly, seen_twice
) -> None:
    thing, a, b = seen_twice
    image = (demo_recording.camera.width, demo_recording.camera.height)
    in_a, in_b = (seen_at(demo_recording, frame, corners_of(thing))[0] for frame in (a, b))
    with open_flatly(*boxed_session, **LARGE) as workspace:
        page = workspace.page
        page.keyboard.press("p")
        pane(page, "Right").wait_for()
        show(page, "Left", a)
        show(page, "Right", b)
        click(page, "Left", in_a, demo_recording)
        # Across the curve, as far from it as can be: the longer way to the image's upper or lower border.
        curve = workspace.answer(f"/frames/{b}/epipolar?of={a}&x={in_a[0]}&y={in_a[1]}")["lines"]
        assert min(np.abs(np.array(line) - in_b).sum(axis=1).min() for line in curve) < 20
        wrong = np.array([in_b[0], in_b[1] + (60 if in_b[1] < image[1] / 2 else -60)])
        click(page, "Right", wrong, demo_recording)
        expect(page.get_by_text("do not belong together")).to_be_visible()
        page.mouse.move(*place_of(page, "Right", wrong, image))
        page.mouse.down()
        page.mouse.move(*place_of(page, "Right", (wrong + in_b) / 2, image))
        page.mouse.move(*place_of(page, "Right", in_b, image))
        page.mouse.up()
        expect(page.get_by_text("do not belong together")).to_have_count(0)
        expect(card(page, 0)).to_contain_text(re.compile(r"0\.\d px"))


def test_both_panes_at_one_frame_is_said(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session) as workspace:
        page = workspace.page
        page.keyboard.press("p")
        pane(page, "Right").wait_for()
        show(page, "Left", 2)
        show(page, "Right", 2)
        expect(page.get_by_text("Both panes show frame 2.").first).to_be_visible()
        page.get_by_role("button", name="Good angle").last.click()
        expect(page.get_by_text("Both panes show frame 2.")).to_have_count(0)
        expect(page.get_by_text(re.compile("° apart")).first).to_be_visible()


def test_the_film_strip_is_for_the_pane_at_hand(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session) as workspace:
        page = workspace.page
        page.keyboard.press("p")
        pane(page, "Right").wait_for()
        left, right = (page.get_by_label(f"Frame of the {side} pane") for side in ("left", "right"))
        was = left.input_value()
        pane(page, "Right").focus()
        thumbnail = page.get_by_role("listbox", name="Film strip").get_by_role("option", name="Frame 1", exact=True)
        thumbnail.click()
        expect(right).to_have_value("1")
        expect(left).to_have_value(was)


def test_a_click_is_where_it_is_at_any_zoom(demo_recording: DemoTruth, boxed_session, open_flatly) -> None:
    """As the server is told it, which draws the curve in the other frame."""
    image = (demo_recording.camera.width, demo_recording.camera.height)
    goal = np.array([301.3, 127.6])
    with open_flatly(*boxed_session) as workspace:
        page = workspace.page
        page.keyboard.press("p")
        pane(page, "Right").wait_for()
        show(page, "Left", 2)
        show(page, "Right", 5)

        def told(act) -> np.ndarray:
            with page.expect_request(re.compile("/frames/5/epipolar")) as request:
                act()
            address = httpx.URL(request.value.url)
            return np.array([float(address.params["x"]), float(address.params["y"])])

        x, y = place_of(page, "Left", goal, image)
        coarse = told(lambda: page.mouse.click(x, y))
        assert np.abs(coarse - goal).max() < 1.2  # the pane is smaller than the image
        page.keyboard.press("Backspace")
        page.mouse.move(x, y)
        for _ in range(30):
            page.mouse.wheel(0, -200)
        expect(page.get_by_role("button", name="32x")).to_be_visible()  # and no further
        # What was under the pointer still is, and a pixel of the pane is now a 32nd of the image's.
        assert np.abs(told(lambda: page.mouse.click(x, y)) - coarse).max() < 1 / 32
        page.keyboard.press("Backspace")
        assert np.abs(told(lambda: page.mouse.click(x + 16, y)) - coarse - [0.5, 0.0]).max() < 1 / 32
        page.keyboard.press("Backspace")
        # A drag on the image takes it along, and marks nothing.
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x + 40, y + 64)
        page.mouse.up()
        expect(card(page, 0)).to_contain_text("not marked")
        assert np.abs(told(lambda: page.mouse.click(x, y)) - coarse - [-40 / 32, -2.0]).max() < 1 / 32
        # Arrows move the mark by a pixel, by ten, by a tenth.
        before = told(lambda: page.keyboard.press("Shift+ArrowDown"))
        assert np.abs(told(lambda: page.keyboard.press("ArrowRight")) - before - [1, 0]).max() < 1e-6
        assert np.abs(told(lambda: page.keyboard.press("Alt+ArrowUp")) - before - [1, -0.1]).max() < 1e-6


def test_fingers_zoom_pan_and_mark(demo_recording: DemoTruth, boxed_session, open_flatly) -> None:
    image = (demo_recording.camera.width, demo_recording.camera.height)
    with open_flatly(*boxed_session, has_touch=True) as workspace:
        page = workspace.page
        page.keyboard.press("p")
        pane(page, "Right").wait_for()
        show(page, "Left", 2)
        x, y = place_of(page, "Left", np.array(image) / 2, image)
        fingers = page.context.new_cdp_session(page)

        def touch(kind: str, *places: tuple[float, float]) -> None:
            points = [{"x": px, "y": py, "id": i} for i, (px, py) in enumerate(places)]
            fingers.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

        touch("touchStart", (x - 20, y))
        touch("touchStart", (x - 20, y), (x + 20, y))
        touch("touchMove", (x - 40, y), (x + 40, y))
        touch("touchMove", (x - 80, y), (x + 80, y))
        touch("touchEnd", (x - 80, y))
        touch("touchEnd")
        box = pane(page, "Left").bounding_box()
        assert box is not None
        whole = min(box["width"] / image[0], box["height"] / image[1])
        expect(page.get_by_role("button", name=f"{4 * whole:.1f}x")).to_be_visible()
        expect(card(page, 0)).to_contain_text("not marked")
        page.touchscreen.tap(x, y)
        expect(card(page, 0)).to_contain_text("1 of 2 frames")
