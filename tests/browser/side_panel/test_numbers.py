"""The selected box's numbers: typed, stepped and drawn, and what drags snap to."""

import re

import numpy as np
import pytest
from playwright.sync_api import expect
from scipy.spatial.transform import Rotation


def test_numbers_are_typed_with_units_and_sums_and_each_is_one_edit(boxed_session, open_panel) -> None:
    with open_panel(*boxed_session) as panel:
        page, (box, *_) = panel.page, panel.answer("/boxes")
        panel.row(box["name"]).click()
        x = box["T_world_box"]["position"][0]
        expect(panel.field("Position X")).to_have_value(f"{x * 1000:.1f}")
        panel.field("Position X").click()
        page.keyboard.press("End")
        page.keyboard.type("+10/4")
        page.keyboard.press("Enter")
        panel.saved(1)
        panel.type_into("Size Y", "8,5 cm")
        panel.saved(2)
        panel.type_into("Rotation yaw", "-33°")
        panel.saved(3)
        panel.field("Position Z").fill("0.123 m")
        page.keyboard.press("Tab")  # leaving it stores it, too
        panel.saved(4)
        after = panel.answer(f"/boxes/{box['id']}")
        assert after["T_world_box"]["position"] == pytest.approx(
            [x + 0.0025, box["T_world_box"]["position"][1], 0.123], abs=1e-9
        )
        assert after["size"] == pytest.approx([box["size"][0], 0.085, box["size"][2]], abs=1e-12)
        yaw = Rotation.from_quat(after["T_world_box"]["wxyz"], scalar_first=True).as_euler("xyz", degrees=True)[2]
        assert yaw == pytest.approx(-33)
        expect(panel.field("Size Y")).to_have_value("85.0")
        panel.type_into("Size Y", "85")  # what it is already
        panel.saved(4)


def test_what_cannot_be_read_stays_with_the_reason_and_escape_restores(boxed_session, open_panel) -> None:
    with open_panel(*boxed_session) as panel:
        page, (box, *_) = panel.page, panel.answer("/boxes")
        panel.row(box["name"]).click()
        size = panel.field("Size X")
        before = size.input_value()
        for text, words in (
            ("8 q", "not a unit of length"),
            ("-5", "longer than 0 mm"),
            ("11 m*1000", "at most 10 km"),
        ):
            panel.type_into("Size X", text)
            expect(page.get_by_role("alert")).to_contain_text(words)
            expect(size).to_have_value(text)
            expect(size).to_have_attribute("aria-invalid", "true")
        panel.type_into("Position Y", "1e8 m")
        expect(page.get_by_text("at most 10000 km from the origin")).to_be_visible()
        panel.field("Position Y").press("Escape")
        expect(size).to_have_accessible_description(re.compile("at most 10 km"))
        panel.field("Size Y").click()  # it stays wrong, and is not stored
        expect(size).to_have_value("11 m*1000")
        size.click()
        page.keyboard.press("Escape")
        expect(size).to_have_value(before)
        expect(page.get_by_role("alert")).to_have_count(0)
        expect(size).to_be_focused()
        page.keyboard.press("Escape")
        expect(size).not_to_be_focused()
        panel.saved(0)
        assert panel.answer(f"/boxes/{box['id']}") == box


def test_arrows_nudge_the_box_once_its_numbers_are_left(boxed_session, open_panel) -> None:
    with open_panel(*boxed_session) as panel:
        page, (box, *_) = panel.page, panel.answer("/boxes")
        panel.row(box["name"]).click()
        page.get_by_role("button", name="World axes").click()
        panel.type_into("Position Y", "120")
        panel.saved(1)
        page.keyboard.press("Escape")
        page.keyboard.press("ArrowDown")
        panel.saved(2)
        assert panel.in_store("store.selected.value") == box["id"]
        assert panel.answer(f"/boxes/{box['id']}")["T_world_box"]["position"][1] == pytest.approx(0.119)


def test_upright_stands_a_tilted_box_on_its_nearest_side(boxed_session, open_panel) -> None:
    with open_panel(*boxed_session) as panel:
        page, (box, *_) = panel.page, panel.answer("/boxes")
        panel.row(box["name"]).click()
        for revision, (name, text) in enumerate((("roll", "84"), ("pitch", "3"), ("yaw", "-40")), 1):
            panel.type_into(f"Rotation {name}", text)
            panel.saved(revision)
        page.keyboard.press("Escape")
        page.keyboard.press("u")
        panel.saved(4)
        tilted = Rotation.from_euler("xyz", [84, 3, -40], degrees=True)
        stored = Rotation.from_quat(panel.answer(f"/boxes/{box['id']}")["T_world_box"]["wxyz"], scalar_first=True)
        assert np.abs(stored.as_matrix()[2]) == pytest.approx([0, 1, 0], abs=1e-9)  # the box's y, which was nearest
        leaned = np.arccos(np.abs(tilted.as_matrix()[2]).max())
        assert (stored * tilted.inv()).magnitude() == pytest.approx(leaned)  # and no further than it leaned
        page.keyboard.press("u")
        page.keyboard.press("u")
        page.keyboard.press("Control+z")
        panel.saved(5)  # one step for the standing up: what stands already is not stored again


def test_what_the_server_refuses_stays_in_the_field_with_its_words(boxed_session, open_panel) -> None:
    with open_panel(*boxed_session) as panel:
        page, (box, *_) = panel.page, panel.answer("/boxes")
        panel.row(box["name"]).click()
        # What no test can bring about: a disk without room.
        full = {"title": "No room", "status": 507, "detail": "the disk is full; make room and try again"}
        page.route(f"**/boxes/{box['id']}", lambda route: route.fulfill(status=507, json=full), times=1)
        panel.type_into("Position X", "1 m")
        expect(page.get_by_role("alert")).to_have_text(full["detail"])
        expect(panel.field("Position X")).to_have_value("1 m")
        assert panel.answer(f"/boxes/{box['id']}") == box
        panel.field("Position X").press("Enter")
        panel.saved(1)
        expect(page.get_by_role("alert")).to_have_count(0)
        assert panel.answer(f"/boxes/{box['id']}")["T_world_box"]["position"][0] == 1
        panel.expect_refusals(507)


def test_arrows_and_the_letter_step_and_become_one_edit_each_time(boxed_session, open_panel) -> None:
    with open_panel(*boxed_session) as panel:
        page, (box, *_) = panel.page, panel.answer("/boxes")
        panel.row(box["name"]).click()
        y = box["T_world_box"]["position"][1]
        # All at once: a pause between them would make two edits, and a busy machine pauses.
        panel.field("Position Y").evaluate(
            """(input) => [["Up", {}], ["Up", {}], ["Up", { shiftKey: true }], ["Down", { altKey: true }]].forEach(
                ([way, held]) => input.dispatchEvent(
                    new KeyboardEvent("keydown", { key: `Arrow${way}`, bubbles: true, cancelable: true, ...held })))"""
        )
        expect(panel.field("Position Y")).to_have_value(f"{y * 1000 + 11.9:.1f}")
        panel.saved(1)
        assert panel.answer(f"/boxes/{box['id']}")["T_world_box"]["position"][1] == pytest.approx(y + 0.0119)

        letter = page.get_by_role("group", name="Size, mm").locator(".letter").first
        place = letter.bounding_box()
        assert place is not None
        middle = (place["x"] + place["width"] / 2, place["y"] + place["height"] / 2)
        page.mouse.move(*middle)
        page.mouse.down()
        page.mouse.move(middle[0] + 30, middle[1], steps=10)
        expect(panel.field("Size X")).to_have_value(f"{box['size'][0] * 1000 + 10:.1f}")
        saved_text = page.locator(".saved").inner_text()
        page.mouse.up()
        panel.saved(2)
        assert saved_text == "Saved, revision 1"  # nothing was stored before the button was let go
        assert panel.answer(f"/boxes/{box['id']}")["size"][0] == pytest.approx(box["size"][0] + 0.010)

        page.mouse.move(*middle)
        page.mouse.down()
        page.mouse.move(middle[0] + 60, middle[1], steps=5)
        page.keyboard.press("Escape")
        page.mouse.up()
        expect(panel.field("Size X")).to_have_value(f"{box['size'][0] * 1000 + 10:.1f}")
        page.mouse.click(*middle)
        expect(panel.field("Size X")).to_be_focused()
        panel.saved(2)


def test_one_angle_does_not_make_the_others_jump_at_the_pole(boxed_session, open_panel) -> None:
    with open_panel(*boxed_session) as panel:
        page, (box, *_) = panel.page, panel.answer("/boxes")
        panel.row(box["name"]).click()
        for revision, (name, text) in enumerate((("yaw", "20"), ("pitch", "90"), ("roll", "30"), ("pitch", "100")), 1):
            panel.type_into(f"Rotation {name}", text)
            panel.saved(revision)
            page.keyboard.press("Escape")
        shown = [panel.field(f"Rotation {name}").input_value() for name in ("roll", "pitch", "yaw")]
        assert shown == ["30.0°", "100.0°", "20.0°"]
        stored = Rotation.from_quat(panel.answer(f"/boxes/{box['id']}")["T_world_box"]["wxyz"], scalar_first=True)
        typed = Rotation.from_euler("xyz", [30, 100, 20], degrees=True)
        assert (typed.inv() * stored).magnitude() < 1e-9


def test_tab_goes_round_the_numbers_and_escape_leaves_them(boxed_session, open_panel) -> None:
    with open_panel(*boxed_session) as panel:
        page, (box, *_) = panel.page, panel.answer("/boxes")
        panel.row(box["name"]).click()
        page.keyboard.press("Enter")
        names = [f"Position {axis}" for axis in "XYZ"]
        names += [f"Rotation {axis}" for axis in ("roll", "pitch", "yaw")] + [f"Size {axis}" for axis in "XYZ"]
        for name in [*names, names[0]]:
            expect(panel.field(name)).to_be_focused()
            page.keyboard.press("Tab")
        page.keyboard.press("Shift+Tab")
        page.keyboard.press("Shift+Tab")
        expect(panel.field(names[-1])).to_be_focused()


def test_numbers_follow_a_drag_and_leave_what_is_being_typed(boxed_session, open_panel) -> None:
    with open_panel(*boxed_session) as panel:
        page, (box, *_) = panel.page, panel.answer("/boxes")
        panel.row(box["name"]).click()
        panel.field("Size X").fill("12+")
        place = {"position": [0.5, 0.25, 0.125], "wxyz": box["T_world_box"]["wxyz"]}
        preview = {"box_id": box["id"], "T_world_box": place, "size": [0.3, 0.2, 0.1]}
        page.evaluate("async (p) => void ((await import('/static/store.js')).preview.value = p)", preview)
        for name, text in (("Position X", "500.0"), ("Position Z", "125.0"), ("Size Y", "200.0"), ("Size X", "12+")):
            expect(panel.field(name)).to_have_value(text)
        expect(panel.field("Size X")).to_be_focused()
        expect(panel.row(box["name"])).to_contain_text("300 \u00d7 200 \u00d7 100 mm")


def test_steps_to_snap_to_are_typed(boxed_session, open_panel) -> None:
    with open_panel(*boxed_session) as panel:
        page, (box, *_) = panel.page, panel.answer("/boxes")
        panel.row(box["name"]).click()
        page.get_by_role("button", name="Steps to snap to").click()
        popover = page.get_by_role("dialog", name="Steps to snap to")
        popover.get_by_label("Move and resize").fill("0.5 cm")
        popover.get_by_label("Turn").fill("45/2")
        page.keyboard.press("Enter")
        assert panel.in_store("[store.snapLength.value, store.snapAngle.value]") == [0.005, 22.5]
        popover.get_by_label("Turn").fill("1000")
        page.keyboard.press("Enter")
        expect(popover.get_by_role("alert")).to_contain_text("0° to 180°")
        page.keyboard.press("Escape")
        expect(popover).to_have_count(0)
        assert panel.in_store("store.selected.value") == box["id"]  # Escape backed out one step only
