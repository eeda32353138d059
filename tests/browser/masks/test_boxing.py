"""An object that is outlined in two frames gets its box, which follows its masks."""

import re
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Locator, Page, expect

from ars_web.demo.truth import DemoTruth
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.mask_regions import iou, polygons_from_mask
from ars_web.geometry.polygon import Polygon
from tests.browser.masks.conftest import Alone, outline

BALL = 4
"""The beach ball, of the demo's objects."""

FRAMES = (0, 3)
"""Both show it whole, from sides that are far apart."""

LARGE = {"viewport": {"width": 1440, "height": 900}}


def pane(page: Page, frame: int) -> Locator:
    """The canvas of the pane that shows a frame."""
    return page.get_by_role("application", name=re.compile(rf"frame {frame}\."))


def place_of(page: Page, frame: int, at: np.ndarray, truth: DemoTruth) -> tuple[float, float]:
    """Where the page shows a place of a frame's image, while its pane shows all of it."""
    box = pane(page, frame).bounding_box()
    assert box is not None
    zoom = min(box["width"] / truth.camera.width, box["height"] / truth.camera.height)
    left = box["x"] + (box["width"] - zoom * truth.camera.width) / 2
    top = box["y"] + (box["height"] - zoom * truth.camera.height) / 2
    return left + zoom * at[0], top + zoom * at[1]


def draw(page: Page, frame: int, corners: np.ndarray, truth: DemoTruth) -> None:
    """Click round an object, and on the first corner again."""
    expect(pane(page, frame)).to_have_attribute("aria-busy", "false")
    for corner in (*corners, corners[0]):
        page.mouse.click(*place_of(page, frame, corner, truth))


def show(page: Page, frames: tuple[int, ...]) -> None:
    """Put frames into the panes, from left to right."""
    for at, frame in enumerate(frames):
        page.get_by_role("application").nth(at).focus()
        scrubber = page.get_by_role("slider", name="Frame", exact=True)
        page.evaluate("(frame) => import('/static/store.js').then((store) => store.actions.goTo(frame))", frame)
        expect(scrubber).to_have_attribute("aria-valuenow", str(frame))
        expect(pane(page, frame)).to_have_attribute("aria-busy", "false")


def box_of(answer: dict[str, Any]) -> Box:
    turn = rigid_transform.rotation_from_wxyz(np.array(answer["T_world_box"]["wxyz"]))
    return Box(
        rigid_transform.from_rotation(turn, np.array(answer["T_world_box"]["position"])), np.array(answer["size"])
    )


def in_masks(page: Page, frames: tuple[int, ...]) -> None:
    """Go to masks mode, with these frames in the panes."""
    page.get_by_role("tab", name="Masks").click()
    expect(page.get_by_role("application")).to_have_count(2)
    show(page, frames)


def saved(page: Page, revision: int) -> None:
    """Wait until the page says that a revision is stored."""
    expect(page.get_by_text(f"Saved, revision {revision}", exact=True)).to_be_visible()


def by_hand(workspace: Any, alone: Alone, frames: tuple[int, ...] = FRAMES) -> dict[str, Any]:
    """The ball's box, made of its outlines by another program."""
    ball = next(one["id"] for one in workspace.answer("/classes") if one["name"] == "ball")
    views = [
        {"frame": frame, "polygons": [{"outer": outline(alone(frame, BALL)).tolist(), "holes": []}]} for frame in frames
    ]
    answer = workspace.client.post(
        f"/api/sessions/{workspace.sid}/boxes/from-masks", json={"class_id": ball, "views": views, "name": "drawn ball"}
    )
    assert answer.status_code == 201, answer.text
    return answer.json()


def drag(page: Page, start: tuple[float, float], end: tuple[float, float]) -> None:
    page.mouse.move(*start)
    page.mouse.down()
    for share in (0.3, 0.7, 1.0):
        page.mouse.move(start[0] + share * (end[0] - start[0]), start[1] + share * (end[1] - start[1]))
    page.mouse.up()


def test_two_outlines_make_a_box(demo_recording: DemoTruth, boxed_session, open_flatly, alone: Alone) -> None:
    truth = demo_recording
    with open_flatly(*boxed_session, **LARGE) as workspace:
        page = workspace.page
        before = {box["id"] for box in workspace.answer("/boxes")}
        in_masks(page, FRAMES)
        make = page.get_by_role("button", name="Make box")
        page.get_by_label("Class of the new object").select_option(label="ball")
        draw(page, FRAMES[0], outline(alone(FRAMES[0], BALL)), truth)
        saved(page, 1)
        expect(page.get_by_role("row", name="ball new")).to_be_visible()
        another = page.context.new_page()
        another.goto(page.url)
        expect(another.get_by_role("row", name="ball Selected by someone new")).to_be_visible()
        expect(page.get_by_text("the object lies inside the dashed band")).to_be_visible()
        expect(make).to_have_attribute("aria-disabled", "true")
        draw(page, FRAMES[1], outline(alone(FRAMES[1], BALL)), truth)
        saved(page, 2)
        facts = page.get_by_role("region", name="Views")
        expect(facts).to_contain_text(re.compile(r"Angle between views\d+°"))
        expect(facts).to_contain_text(re.compile(r"Hull so far[^n]* mm"))
        make.click()
        saved(page, 3)
        (made,) = (box for box in workspace.answer("/boxes") if box["id"] not in before)
        assert made["has_hull"]
        assert {mask["box_id"] for mask in workspace.answer("/masks")} == {made["id"]}
        true = truth.objects[BALL].box
        apart = np.linalg.norm(np.array(made["T_world_box"]["position"]) - true.T_world_box[:3, 3])
        assert apart < 0.25 * true.size.max()
        assert (np.array(made["size"]) > 0.9 * true.size).all()
        expect(page.get_by_role("row", name=made["name"])).to_have_attribute("aria-selected", "true")
        expect(another.get_by_role("row", name=f"{made['name']} Selected by someone")).to_be_visible()
        expect(another.get_by_role("row", name="ball Selected by someone new")).to_have_count(0)


def test_a_box_follows_its_masks_and_undo_takes_both_back(
    demo_recording: DemoTruth, boxed_session, open_flatly, alone: Alone
) -> None:
    truth = demo_recording
    with open_flatly(*boxed_session, **LARGE) as workspace:
        page = workspace.page
        made = by_hand(workspace, alone)
        page.get_by_role("row", name="drawn ball").click()
        in_masks(page, FRAMES)
        masks = page.get_by_role("region", name="Masks of drawn ball")
        expect(masks.get_by_role("listitem")).to_have_count(2)
        corners = outline(alone(FRAMES[0], BALL))
        highest = corners[corners[:, 1].argmin()]
        drag(
            page,
            place_of(page, FRAMES[0], highest, truth),
            place_of(page, FRAMES[0], highest - [0, 30], truth),
        )
        saved(page, 2)
        larger = workspace.answer(f"/boxes/{made['id']}")
        assert np.prod(larger["size"]) > 1.1 * np.prod(made["size"])
        assert workspace.answer("")["revision"] == 2  # the mask, its hull and its box: one step
        page.get_by_role("button", name="Undo", exact=True).click()
        saved(page, 3)
        restored = workspace.answer(f"/boxes/{made['id']}")
        assert restored["size"] == made["size"]
        assert restored["T_world_box"] == made["T_world_box"]
        (mask,) = (one for one in workspace.answer("/masks") if one["frame"] == FRAMES[0])
        assert np.allclose(mask["polygons"][0]["outer"], corners, atol=1e-3)
        # And the drawing is the stored one again: its corner can be taken where it was.
        drag(
            page,
            place_of(page, FRAMES[0], highest, truth),
            place_of(page, FRAMES[0], highest - [0, 20], truth),
        )
        saved(page, 4)
        page.reload()
        expect(masks.get_by_role("listitem")).to_have_count(2)
        expect(page.get_by_role("application")).to_have_count(2)
        for frame in FRAMES:
            expect(pane(page, frame)).to_be_visible()
            expect(masks.get_by_role("button", name=re.compile(f"^Frame {frame} ?polygon, "))).to_be_visible()


def test_an_outline_that_no_object_of_the_others_has_is_said_on_its_pane_and_not_stored(
    demo_recording: DemoTruth, boxed_session, open_flatly, alone: Alone
) -> None:
    truth = demo_recording
    with open_flatly(*boxed_session, **LARGE) as workspace:
        page = workspace.page
        made = by_hand(workspace, alone)
        page.get_by_role("row", name="drawn ball").click()
        in_masks(page, (FRAMES[0], 2))
        elsewhere = np.array([[20.0, 20], [60, 20], [60, 60], [20, 60]])
        draw(page, 2, elsewhere, truth)
        problem = page.get_by_role("region", name="Frame 2", exact=True).get_by_role("alert")
        expect(problem).to_contain_text("Not stored")
        expect(problem).to_contain_text("px")
        assert workspace.answer("")["revision"] == 1
        assert workspace.answer(f"/boxes/{made['id']}")["size"] == made["size"]
        assert [mask["frame"] for mask in workspace.answer("/masks")] == list(FRAMES)
        workspace.complaints.clear()  # Chromium tells of what the server refused
        # Where it is mended, it is stored.
        page.keyboard.press("Control+z")
        expect(problem).to_have_count(0)


def test_the_smart_tool_finds_an_object_from_a_rough_rectangle(
    demo_recording: DemoTruth, boxed_session, open_flatly, alone: Alone
) -> None:
    truth = demo_recording
    with open_flatly(*boxed_session, **LARGE) as workspace:
        page = workspace.page
        in_masks(page, FRAMES)
        page.get_by_label("Class of the new object").select_option(label="ball")
        page.keyboard.press("q")
        mask = alone(FRAMES[0], BALL)
        rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
        rough = 0.15 * (columns[-1] - columns[0])
        first, last = np.array([columns[0], rows[0]]) - rough, np.array([columns[-1], rows[-1]]) + rough
        drag(page, place_of(page, FRAMES[0], first, truth), place_of(page, FRAMES[0], last, truth))
        saved(page, 1)
        (found,) = workspace.answer("/masks")
        assert found["origin"] == "smart"
        polygons = [Polygon(np.array(one["outer"]), tuple(map(np.array, one["holes"]))) for one in found["polygons"]]
        assert iou(polygons, polygons_from_mask(mask)) >= 0.85


def test_how_a_hull_is_made_is_stored_at_once_and_the_box_follows(
    demo_recording: DemoTruth, boxed_session, open_flatly, alone: Alone
) -> None:
    with open_flatly(*boxed_session, **LARGE) as workspace:
        page = workspace.page
        made = by_hand(workspace, alone)
        box = f"/boxes/{made['id']}"
        page.get_by_role("row", name="drawn ball").click()
        page.get_by_role("tab", name="Masks").click()
        page.get_by_role("group", name="Box axes").get_by_role("button", name="Free").click()
        saved(page, 2)
        assert workspace.answer(box)["hull_options"]["orientation"] == "free"
        error = page.get_by_label("Expected mask error")
        error.fill("many")
        error.press("Enter")
        expect(page.get_by_role("region", name="How the box is made").get_by_role("alert")).to_contain_text(
            "such as 1.5"
        )
        error.fill("2,5 px")
        error.press("Enter")
        saved(page, 3)
        assert workspace.answer(box)["hull_options"]["widen_px"] == 2.5
        assert workspace.answer(f"{box}/hull")["volume"] > made["hull"]["volume"]
        page.get_by_role("button", name="Support plane").click()
        plane = page.get_by_role("group", name="Support plane")
        plane.get_by_label("Stands at z").fill("1 cm")
        plane.get_by_label("Stands at z").press("Enter")
        saved(page, 4)
        assert workspace.answer(box)["hull_options"]["ground"] == pytest.approx(0.01)
        hull = workspace.answer(f"{box}/hull")
        assert min(z for _, _, z in hull["vertices"]) > 0.01 - 1e-6
        plane.get_by_role("button", name="No plane").click()
        saved(page, 5)
        assert workspace.answer(box)["hull_options"]["ground"] is None


def test_a_box_that_was_placed_by_hand_is_fitted_to_its_masks(
    demo_recording: DemoTruth, boxed_session, open_flatly, alone: Alone
) -> None:
    truth = demo_recording
    tea = 0
    with open_flatly(*boxed_session, **LARGE) as workspace:
        page, client = workspace.page, workspace.client
        box = workspace.answer("/boxes")[tea]
        address = f"/api/sessions/{workspace.sid}"
        x, y, z = box["T_world_box"]["position"]
        rough = {"T_world_box": {**box["T_world_box"], "position": [x + 0.02, y - 0.015, z]}}
        assert client.patch(f"{address}/boxes/{box['id']}", json=rough, headers={"If-Match": '"0"'}).status_code == 200
        for frame in (0, 2, 4, 5):
            polygons = [{"outer": outline(alone(frame, tea), tolerance=0.5).tolist(), "holes": []}]
            mask = {"box_id": box["id"], "class_id": box["class_id"], "frame": frame, "polygons": polygons}
            assert client.post(f"{address}/masks", json=mask).status_code == 201
        page.get_by_role("row", name=box["name"]).first.click()
        page.get_by_role("tab", name="Masks").click()
        page.get_by_role("button", name="Fit to masks").click()
        told = page.get_by_role("group", name="How well the box fits its masks")
        expect(told).to_contain_text(re.compile(r"Moved by \d+\.\d mm"))
        expect(told.get_by_role("listitem")).to_have_count(4)
        fitted = box_of(workspace.answer(f"/boxes/{box['id']}"))
        apart = np.linalg.norm(fitted.T_world_box[:3, 3] - truth.objects[tea].box.T_world_box[:3, 3])
        assert apart < 0.004


def test_the_machine_outlines_the_rest_in_one_step(
    demo_recording: DemoTruth, boxed_session, open_flatly, alone: Alone
) -> None:
    with open_flatly(*boxed_session, **LARGE) as workspace:
        page = workspace.page
        made = by_hand(workspace, alone)
        page.get_by_role("row", name="drawn ball").click()
        page.get_by_role("tab", name="Masks").click()
        page.get_by_role("button", name="Outline the rest").click()
        expect(page.get_by_text(re.compile(r"\d+ masks? added")).first).to_be_visible()
        saved(page, 2)
        masks = workspace.answer("/masks")
        added = [mask for mask in masks if mask["origin"] == "proposed"]
        assert added
        rows = page.get_by_role("region", name="Masks of drawn ball").get_by_role("listitem")
        expect(rows).to_have_count(len(masks))
        narrower = workspace.answer(f"/boxes/{made['id']}")
        true = demo_recording.objects[BALL].box.size
        assert np.abs(np.array(narrower["size"]) - true).max() < np.abs(np.array(made["size"]) - true).max()


def test_what_is_drawn_while_the_server_does_not_answer_is_stored_once_it_does(
    demo_recording: DemoTruth, boxed_session, open_flatly, alone: Alone
) -> None:
    with open_flatly(*boxed_session, **LARGE) as workspace:
        page = workspace.page
        in_masks(page, FRAMES)
        page.route("**/masks", lambda route: route.abort())
        draw(page, FRAMES[0], outline(alone(FRAMES[0], BALL)), demo_recording)
        told = page.get_by_role("region", name=f"Frame {FRAMES[0]}", exact=True).get_by_role("alert")
        expect(told).to_contain_text("Not stored: The server does not answer")
        expect(page.get_by_role("status").filter(has_text="Saving")).to_be_visible()
        assert workspace.answer("/masks") == []
        page.unroute("**/masks")
        saved(page, 1)
        expect(told).to_have_count(0)
        assert [mask["frame"] for mask in workspace.answer("/masks")] == [FRAMES[0]]
        workspace.complaints.clear()  # Chromium tells of what did not arrive
