"""The right panel: boxes, numbers, telling frames, classes, history and conflicts, by a real server and Chromium."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Locator, Page, expect
from scipy.spatial.transform import Rotation

from ars_web.recordings.registry import read_recording
from ars_web.sessions.store import SessionStore

expect.set_options(timeout=20_000)  # for busy machines; what is waited for comes at once elsewhere


@pytest.fixture
def plain_session(tmp_path: Path, demo_recording) -> tuple[Path, str]:
    """The sessions folder and the id of the small demo, without boxes and classes."""
    with SessionStore(tmp_path / "sessions") as store:
        made = store.create(read_recording(demo_recording.folder, format="ars"), name="plain")
    return tmp_path / "sessions", made.id


def saved(page: Page, revision: int) -> None:
    expect(page.locator(".saved")).to_have_text(f"Saved, revision {revision}")


def row(page: Page, name: str) -> Locator:
    return page.get_by_role("grid", name="Boxes").get_by_role("row").filter(has=page.get_by_text(name, exact=True))


def field(page: Page, name: str) -> Locator:
    return page.get_by_role("spinbutton", name=name, exact=True)


def type_into(page: Page, name: str, text: str) -> None:
    field(page, name).fill(text)
    field(page, name).press("Enter")


def in_store(page: Page, what: str) -> Any:
    return page.evaluate(f"async () => {{ const store = await import('/static/store.js'); return {what}; }}")


def by_another(workspace, path: str, revision: int, changes: dict[str, Any] | None) -> None:
    """Change something as somebody else; None deletes it."""
    headers = {"If-Match": f'"{revision}"'}
    address = f"/api/sessions/{workspace.sid}{path}"
    if changes is None:
        assert workspace.client.delete(address, headers=headers).status_code == 204
    else:
        assert workspace.client.patch(address, json=changes, headers=headers).status_code == 200


def refusals(workspace, *statuses: int) -> None:
    """Take out what Chromium says of requests that are to be refused."""
    expected = [f"the server responded with a status of {status}" for status in statuses]
    workspace.complaints[:] = [one for one in workspace.complaints if not any(part in one for part in expected)]


def test_boxes_are_listed_selected_by_keys_and_renamed_in_place(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session) as workspace:
        page, boxes = workspace.page, workspace.answer("/boxes")
        rows = page.get_by_role("grid", name="Boxes").get_by_role("row")
        for box in boxes:
            shown = row(page, box["name"])
            sides = [str(int(side * 1000 + 0.5)) for side in box["size"]]
            words = sides[0] if len(set(sides)) == 1 else " \u00d7 ".join(sides)
            shown.scroll_into_view_if_needed()
            expect(shown).to_contain_text(f"{words} mm")
        page.get_by_role("grid", name="Boxes").focus()
        page.keyboard.press("Home")
        expect(rows.filter(has_text=boxes[0]["name"]).first).to_have_attribute("aria-selected", "true")
        page.keyboard.press("ArrowDown")
        page.keyboard.press("ArrowDown")
        assert in_store(page, "store.selected.value") == boxes[2]["id"]
        expect(page.get_by_role("region", name=boxes[2]["name"], exact=True)).to_be_visible()
        page.keyboard.press("ArrowLeft")  # elsewhere it would move the box
        page.keyboard.press("End")
        expect(row(page, boxes[-1]["name"])).to_be_in_viewport()

        page.keyboard.press("F2")
        name = page.get_by_role("textbox", name=f"Name of {boxes[-1]['name']}")
        expect(name).to_be_focused()
        name.fill("never")
        name.press("Escape")
        expect(page.get_by_role("grid", name="Boxes")).to_be_focused()
        page.keyboard.press("F2")
        name.fill("")
        name.press("Enter")
        expect(page.get_by_role("alert")).to_contain_text("A box needs a name")
        name.fill("<img src=x onerror=alert(1)>")
        name.press("Enter")
        saved(page, 1)
        expect(row(page, "<img src=x onerror=alert(1)>")).to_be_visible()
        assert workspace.answer(f"/boxes/{boxes[-1]['id']}")["name"] == "<img src=x onerror=alert(1)>"

        row(page, boxes[-2]["name"]).dblclick()
        page.keyboard.type("by mouse")
        page.get_by_role("tab", name="Boxes").click()  # leaving the field keeps what is typed
        saved(page, 2)
        assert workspace.answer(f"/boxes/{boxes[-2]['id']}")["name"] == "by mouse"
        assert workspace.answer("/boxes")[0] == boxes[0]


def test_hiding_is_this_pages_own_and_locking_is_everybodys(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session) as workspace:
        page, (box, *_) = workspace.page, workspace.answer("/boxes")
        shown = row(page, box["name"])
        eye = page.get_by_role("button", name=f"Hide {box['name']}", exact=True)
        eye.click()
        expect(eye).to_have_attribute("aria-pressed", "true")
        assert in_store(page, "[...store.hidden.value]") == [box["id"]]
        assert in_store(page, "store.selected.value") is None  # the click was the button's
        eye.click()
        assert in_store(page, "[...store.hidden.value]") == []

        shown.hover()
        page.get_by_role("button", name=f"Lock {box['name']}", exact=True).click()
        saved(page, 1)
        assert workspace.answer(f"/boxes/{box['id']}")["locked"]
        shown.click()
        expect(field(page, "Position X")).not_to_be_editable()
        field(page, "Position X").press("ArrowUp")
        expect(page.get_by_role("button", name="Delete", exact=True)).to_be_disabled()
        page.get_by_role("button", name="Unlock", exact=True).click()
        saved(page, 2)
        assert not workspace.answer(f"/boxes/{box['id']}")["locked"]
        expect(field(page, "Position X")).to_be_editable()


def test_the_menu_of_a_box_does_what_it_says(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session) as workspace:
        page, boxes = workspace.page, workspace.answer("/boxes")
        box, other = boxes[0], next(b for b in boxes if b["class_id"] != boxes[0]["class_id"])
        classes = {c["id"]: c["name"] for c in workspace.answer("/classes")}

        def choose(item: str) -> None:
            row(page, box["name"]).click(button="right")
            page.get_by_role("menuitem", name=item).click()

        choose("Class")
        page.get_by_role("menuitem", name=classes[other["class_id"]], exact=True).click()
        saved(page, 1)
        assert workspace.answer(f"/boxes/{box['id']}")["class_id"] == other["class_id"]
        choose("Duplicate")
        saved(page, 2)
        assert len(workspace.answer("/boxes")) == len(boxes) + 1
        assert in_store(page, "store.selected.value") == workspace.answer("/boxes")[-1]["id"]
        now = workspace.answer(f"/boxes/{box['id']}")
        lifted = {**now["T_world_box"], "position": [*now["T_world_box"]["position"][:2], 1.0]}
        by_another(workspace, f"/boxes/{box['id']}", now["revision"], {"T_world_box": lifted})
        saved(page, 3)
        choose("Rest on ground")
        saved(page, 4)
        z = workspace.answer(f"/boxes/{box['id']}")["T_world_box"]["position"][2]
        assert z == pytest.approx(box["size"][2] / 2)  # they stand upright
        choose("Hide")
        assert in_store(page, "[...store.hidden.value]") == [box["id"]]
        choose("Rename")
        page.keyboard.type("renamed")
        page.keyboard.press("Enter")
        saved(page, 5)
        page.get_by_role("grid", name="Boxes").focus()
        page.keyboard.press("Shift+F10")  # the keyboard's way to the menu
        page.get_by_role("menuitem", name="Delete").click()
        saved(page, 6)
        assert box["id"] not in [b["id"] for b in workspace.answer("/boxes")]


def test_numbers_are_typed_with_units_and_sums_and_each_is_one_edit(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session) as workspace:
        page, (box, *_) = workspace.page, workspace.answer("/boxes")
        row(page, box["name"]).click()
        x = box["T_world_box"]["position"][0]
        expect(field(page, "Position X")).to_have_value(f"{x * 1000:.1f}")
        field(page, "Position X").click()
        page.keyboard.press("End")
        page.keyboard.type("+10/4")
        page.keyboard.press("Enter")
        saved(page, 1)
        type_into(page, "Size Y", "8,5 cm")
        saved(page, 2)
        type_into(page, "Rotation yaw", "-33°")
        saved(page, 3)
        field(page, "Position Z").fill("0.123 m")
        page.keyboard.press("Tab")  # leaving it stores it, too
        saved(page, 4)
        after = workspace.answer(f"/boxes/{box['id']}")
        assert after["T_world_box"]["position"] == pytest.approx(
            [x + 0.0025, box["T_world_box"]["position"][1], 0.123], abs=1e-9
        )
        assert after["size"] == pytest.approx([box["size"][0], 0.085, box["size"][2]], abs=1e-12)
        yaw = Rotation.from_quat(after["T_world_box"]["wxyz"], scalar_first=True).as_euler("xyz", degrees=True)[2]
        assert yaw == pytest.approx(-33)
        expect(field(page, "Size Y")).to_have_value("85.0")
        type_into(page, "Size Y", "85")  # what it is already
        saved(page, 4)


def test_what_cannot_be_read_stays_with_the_reason_and_escape_restores(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session) as workspace:
        page, (box, *_) = workspace.page, workspace.answer("/boxes")
        row(page, box["name"]).click()
        size = field(page, "Size X")
        before = size.input_value()
        for text, words in (
            ("8 q", "not a unit of length"),
            ("-5", "longer than 0 mm"),
            ("11 m*1000", "at most 10 km"),
        ):
            type_into(page, "Size X", text)
            expect(page.get_by_role("alert")).to_contain_text(words)
            expect(size).to_have_value(text)
            expect(size).to_have_attribute("aria-invalid", "true")
        expect(size).to_have_accessible_description(re.compile("at most 10 km"))
        field(page, "Size Y").click()  # it stays wrong, and is not stored
        expect(size).to_have_value("11 m*1000")
        size.click()
        page.keyboard.press("Escape")
        expect(size).to_have_value(before)
        expect(page.get_by_role("alert")).to_have_count(0)
        expect(size).to_be_focused()
        page.keyboard.press("Escape")
        expect(page.get_by_role("grid", name="Boxes")).to_be_focused()
        saved(page, 0)
        assert workspace.answer(f"/boxes/{box['id']}") == box


def test_what_the_server_refuses_stays_in_the_field_with_its_words(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session) as workspace:
        page, (box, *_) = workspace.page, workspace.answer("/boxes")
        row(page, box["name"]).click()
        type_into(page, "Position X", "1e300 m")
        expect(page.get_by_role("alert")).not_to_be_empty()
        expect(field(page, "Position X")).to_have_value("1e300 m")
        assert workspace.answer(f"/boxes/{box['id']}") == box
        refusals(workspace, 422)


def test_arrows_and_the_letter_step_and_become_one_edit_each_time(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session) as workspace:
        page, (box, *_) = workspace.page, workspace.answer("/boxes")
        row(page, box["name"]).click()
        y = box["T_world_box"]["position"][1]
        # All at once: a pause between them would make two edits, and a busy machine pauses.
        field(page, "Position Y").evaluate(
            """(input) => [["Up", {}], ["Up", {}], ["Up", { shiftKey: true }], ["Down", { altKey: true }]].forEach(
                ([way, held]) => input.dispatchEvent(
                    new KeyboardEvent("keydown", { key: `Arrow${way}`, bubbles: true, cancelable: true, ...held })))"""
        )
        expect(field(page, "Position Y")).to_have_value(f"{y * 1000 + 11.9:.1f}")
        saved(page, 1)
        assert workspace.answer(f"/boxes/{box['id']}")["T_world_box"]["position"][1] == pytest.approx(y + 0.0119)

        letter = page.get_by_role("group", name="Size, mm").locator(".letter").first
        place = letter.bounding_box()
        assert place is not None
        middle = (place["x"] + place["width"] / 2, place["y"] + place["height"] / 2)
        page.mouse.move(*middle)
        page.mouse.down()
        page.mouse.move(middle[0] + 30, middle[1], steps=10)
        expect(field(page, "Size X")).to_have_value(f"{box['size'][0] * 1000 + 10:.1f}")
        saved_text = page.locator(".saved").inner_text()
        page.mouse.up()
        saved(page, 2)
        assert saved_text == "Saved, revision 1"  # nothing was stored before the button was let go
        assert workspace.answer(f"/boxes/{box['id']}")["size"][0] == pytest.approx(box["size"][0] + 0.010)

        page.mouse.move(*middle)
        page.mouse.down()
        page.mouse.move(middle[0] + 60, middle[1], steps=5)
        page.keyboard.press("Escape")
        page.mouse.up()
        expect(field(page, "Size X")).to_have_value(f"{box['size'][0] * 1000 + 10:.1f}")
        page.mouse.click(*middle)
        expect(field(page, "Size X")).to_be_focused()
        saved(page, 2)


def test_one_angle_does_not_make_the_others_jump_at_the_pole(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session) as workspace:
        page, (box, *_) = workspace.page, workspace.answer("/boxes")
        row(page, box["name"]).click()
        for revision, (name, text) in enumerate((("yaw", "20"), ("pitch", "90"), ("roll", "30"), ("pitch", "100")), 1):
            type_into(page, f"Rotation {name}", text)
            saved(page, revision)
            page.keyboard.press("Escape")
        shown = [field(page, f"Rotation {name}").input_value() for name in ("roll", "pitch", "yaw")]
        assert shown == ["30.0°", "100.0°", "20.0°"]
        stored = Rotation.from_quat(workspace.answer(f"/boxes/{box['id']}")["T_world_box"]["wxyz"], scalar_first=True)
        typed = Rotation.from_euler("xyz", [30, 100, 20], degrees=True)
        assert (typed.inv() * stored).magnitude() < 1e-9


def test_tab_goes_round_the_numbers_and_escape_leaves_them(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session) as workspace:
        page, (box, *_) = workspace.page, workspace.answer("/boxes")
        row(page, box["name"]).click()
        page.keyboard.press("Enter")
        names = [f"Position {axis}" for axis in "XYZ"]
        names += [f"Rotation {axis}" for axis in ("roll", "pitch", "yaw")] + [f"Size {axis}" for axis in "XYZ"]
        for name in [*names, names[0]]:
            expect(field(page, name)).to_be_focused()
            page.keyboard.press("Tab")
        page.keyboard.press("Shift+Tab")
        page.keyboard.press("Shift+Tab")
        expect(field(page, names[-1])).to_be_focused()


def test_numbers_follow_a_drag_and_leave_what_is_being_typed(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session) as workspace:
        page, (box, *_) = workspace.page, workspace.answer("/boxes")
        row(page, box["name"]).click()
        field(page, "Size X").fill("12+")
        place = {"position": [0.5, 0.25, 0.125], "wxyz": box["T_world_box"]["wxyz"]}
        preview = {"box_id": box["id"], "T_world_box": place, "size": [0.3, 0.2, 0.1]}
        page.evaluate("async (p) => void ((await import('/static/store.js')).preview.value = p)", preview)
        for name, text in (("Position X", "500.0"), ("Position Z", "125.0"), ("Size Y", "200.0"), ("Size X", "12+")):
            expect(field(page, name)).to_have_value(text)
        expect(field(page, "Size X")).to_be_focused()
        expect(row(page, box["name"])).to_contain_text("300 \u00d7 200 \u00d7 100 mm")


def drawn(page: Page) -> list[list[list[float]]]:
    """The points of each frame's lines, frame by frame."""
    return page.locator(".tile").evaluate_all(
        """(tiles) => tiles.map((tile) => [...tile.querySelectorAll('.edge polyline')].flatMap(
            (line) => line.getAttribute('points').split(' ').map((point) => point.split(',').map(Number))))"""
    )


def test_the_frames_that_tell_most_show_the_box_as_it_is_seen_now(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session) as workspace:
        page, (box, *_) = workspace.page, workspace.answer("/boxes")
        row(page, box["name"]).click()
        telling = workspace.answer(f"/boxes/{box['id']}/telling-frames")
        frames = [one["frame"] for one in telling]
        tiles = page.get_by_role("region", name="Where an error shows most").get_by_role("button")
        expect(tiles).to_have_count(len(telling))
        expect(page.locator(".tile svg")).to_have_count(len(telling))
        for tile, one in zip(tiles.all(), telling, strict=True):
            expect(tile).to_have_accessible_name(re.compile(f"^Enter frame {one['frame']}, where 1 mm is"))
            expect(tile).to_contain_text(f"1 mm = {one['px_per_mm']:.1f} px")

        def expected(place: dict[str, Any], size: list[float]) -> list[list[list[float]]]:
            draft = {"boxes": [{"T_world_box": place, "size": size}], "frames": frames}
            seen = workspace.client.post(f"/api/sessions/{workspace.sid}/labels", json=draft).json()
            return [[point for line in one["labels"][0]["wireframe"] for point in line] for one in seen]

        assert drawn(page) == expected(box["T_world_box"], box["size"])
        # As in a drag: the box moves, the frames stay.
        x, y, z = box["T_world_box"]["position"]
        moved = {**box["T_world_box"], "position": [x + 0.02, y, z]}
        preview = {"box_id": box["id"], "T_world_box": moved, "size": box["size"]}
        then = expected(moved, box["size"])
        page.evaluate("async (p) => void ((await import('/static/store.js')).preview.value = p)", preview)
        points = page.locator(".tile .edge polyline").first
        expect(points).to_have_attribute("points", re.compile(f"^{then[0][0][0]:g},{then[0][0][1]:g}"))
        assert drawn(page) == then
        page.evaluate("async () => void ((await import('/static/store.js')).preview.value = null)")

        type_into(page, "Position X", f"{x + 0.3} m")
        saved(page, 1)
        again = workspace.answer(f"/boxes/{box['id']}/telling-frames")
        expect(tiles).to_have_count(len(again))
        for tile, one in zip(tiles.all(), again, strict=True):
            expect(tile).to_have_accessible_name(re.compile(f"^Enter frame {one['frame']},"))
        tiles.last.click()
        assert in_store(page, "[store.mode.value, store.frame.value]") == ["frame", again[-1]["frame"]]


def test_a_box_that_no_frame_shows_is_said_to_be(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session) as workspace:
        page, (box, *_) = workspace.page, workspace.answer("/boxes")
        row(page, box["name"]).click()
        type_into(page, "Position Z", "900 m")
        expect(page.get_by_text("No frame shows this box")).to_be_visible()


def test_classes_are_added_changed_and_kept_while_used(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session) as workspace:
        page = workspace.page
        first = workspace.answer("/classes")[0]
        used = sum(box["class_id"] == first["id"] for box in workspace.answer("/boxes"))
        section = page.get_by_role("region", name="Classes")
        entry = section.locator(".class-row").first
        expect(entry).to_contain_text(first["name"])
        expect(entry).to_contain_text(f"{used} box")

        page.get_by_role("button", name="Add class").click()
        page.get_by_role("textbox", name="Name of the new class").fill(first["name"])
        page.keyboard.press("Enter")
        expect(section.get_by_role("alert")).to_contain_text("already")
        page.get_by_role("textbox", name="Name of the new class").fill("<b>new</b>")
        page.keyboard.press("Enter")
        saved(page, 1)
        expect(section.locator(".class-row").last).to_contain_text("<b>new</b>")

        section.locator(".class-row").last.click()
        editor = page.get_by_role("dialog", name="Class <b>new</b>")
        editor.get_by_label("Name").fill("cup")
        page.keyboard.press("Enter")
        saved(page, 2)
        editor = page.get_by_role("dialog", name="Class cup")
        editor.get_by_role("button", name="Yellow").click()
        saved(page, 3)
        editor.get_by_label("Another colour").fill("#123456")
        saved(page, 4)
        for axis, text in zip("XYZ", ("8 cm", "85/2", "-1"), strict=True):
            editor.get_by_label(f"Usual size {axis}, mm").fill(text)
        page.keyboard.press("Enter")
        expect(editor.get_by_role("alert")).to_contain_text("longer than 0")
        editor.get_by_label("Usual size Z, mm").fill("100")
        page.keyboard.press("Enter")
        saved(page, 5)
        made = workspace.answer("/classes")[-1]
        assert (made["name"], made["color"], made["default_size"]) == ("cup", "#123456", [0.08, 0.0425, 0.1])
        expect(section.locator(".class-row").last).to_contain_text("0 boxes, 80 \u00d7 43 \u00d7 100 mm")
        editor.get_by_role("button", name="Delete class").click()
        saved(page, 6)
        expect(editor).to_have_count(0)

        entry.click()
        editor = page.get_by_role("dialog", name=f"Class {first['name']}")
        editor.get_by_role("button", name="Delete class").click()
        expect(editor.get_by_role("alert")).to_contain_text("used by")
        page.keyboard.press("Escape")
        expect(editor).to_have_count(0)
        expect(entry).to_be_focused()
        assert [c["name"] for c in workspace.answer("/classes")].count(first["name"]) == 1
        refusals(workspace, 409, 412, 422)


def test_history_says_who_did_what_and_what_of_it_stands(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session) as workspace:
        page, (box, other, *_) = workspace.page, workspace.answer("/boxes")
        page.get_by_role("tab", name="History").click()
        history = page.get_by_role("tabpanel", name="History")
        expect(history).to_contain_text("Nothing was changed yet")
        expect(history.get_by_role("button", name="Undo")).to_be_disabled()
        by_another(workspace, f"/boxes/{other['id']}", other["revision"], {"name": "elsewhere"})
        edits = history.get_by_role("listitem")
        expect(edits).to_have_count(1)
        expect(edits.first).not_to_contain_text("you")

        page.get_by_role("tab", name="Boxes").click()
        row(page, box["name"]).click()
        type_into(page, "Position X", "5 cm")
        saved(page, 2)
        page.get_by_role("tab", name="History").click()
        expect(edits.first).to_contain_text(re.compile(r"Move .*you.*just now"))
        undo = history.get_by_role("button", name=re.compile("^Undo: Move"))
        undo.click()
        saved(page, 3)
        assert workspace.answer(f"/boxes/{box['id']}")["T_world_box"] == box["T_world_box"]
        expect(edits).to_have_count(3)
        expect(edits.nth(1).locator("s")).to_contain_text("Move")
        expect(edits.nth(1)).to_contain_text("undone")
        expect(edits.nth(2).locator("s")).to_have_count(0)
        expect(history.get_by_role("button", name="Undo")).to_be_disabled()  # the other edit is not ours
        history.get_by_role("button", name=re.compile("^Redo: Move")).click()
        saved(page, 4)
        expect(edits.filter(has=page.locator("s"))).to_have_count(1)
        x = workspace.answer(f"/boxes/{box['id']}")["T_world_box"]["position"][0]
        assert x == pytest.approx(0.05)


def test_older_history_loads_as_one_scrolls_to_it(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session) as workspace:
        page, (box, *_) = workspace.page, workspace.answer("/boxes")
        for i in range(120):
            revision = workspace.answer(f"/boxes/{box['id']}")["revision"]
            by_another(workspace, f"/boxes/{box['id']}", revision, {"name": f"name {i}"})
        saved(page, 120)
        page.get_by_role("tab", name="History").click()
        edits = page.get_by_role("tabpanel", name="History").get_by_role("listitem")
        expect(edits).to_have_count(50)
        edits.last.scroll_into_view_if_needed()
        page.mouse.move(1200, 400)
        while edits.count() < 120:
            page.mouse.wheel(0, 4000)
            expect(edits).not_to_have_count(50)
        expect(edits).to_have_count(120)
        expect(page.get_by_text("Older changes are loading")).to_have_count(0)
        workspace.client.post(f"/api/sessions/{workspace.sid}/undo")
        expect(edits).to_have_count(121)
        expect(edits.nth(1).locator("s")).to_be_visible()


def conflicting(workspace, box: dict[str, Any], changes: dict[str, Any] | None) -> None:
    """Type a number that reaches the server just after another's change did."""
    page = workspace.page

    def first_the_other(route) -> None:
        by_another(workspace, f"/boxes/{box['id']}", box["revision"], changes)
        route.continue_()

    page.route(f"**/boxes/{box['id']}", first_the_other, times=1)
    row(page, box["name"]).click()
    type_into(page, "Position Y", "0.123 m")


@pytest.mark.parametrize("choice", ["Keep theirs", "Use mine"])
def test_a_conflict_shows_both_and_asks(boxed_session, open_flatly, choice: str) -> None:
    with open_flatly(*boxed_session) as workspace:
        page, (box, *_) = workspace.page, workspace.answer("/boxes")
        x, y, z = box["T_world_box"]["position"]
        place = {**box["T_world_box"], "position": [x + 0.02, y, z]}
        conflicting(workspace, box, {"T_world_box": place})
        card = page.get_by_role("region", name="Conflict")
        expect(card).to_contain_text("was changed meanwhile")
        expect(card).to_contain_text("Rotation and size are the same in both")
        expect(card.locator("tr[data-differs=true]")).to_have_count(2)
        expect(card.locator("tr[data-differs=true] td").nth(0)).to_have_text(f"{(x + 0.02) * 1000:.1f}")
        expect(card.locator("tr[data-differs=true] strong").nth(0)).to_have_text(f"{x * 1000:.1f}")
        expect(card.locator("tr[data-differs=true] strong").nth(1)).to_have_text("123.0")
        card.get_by_role("button", name=choice).click()
        expect(card).to_have_count(0)
        saved(page, 1 if choice == "Keep theirs" else 2)
        expected = place["position"] if choice == "Keep theirs" else [x, 0.123, z]
        assert workspace.answer(f"/boxes/{box['id']}")["T_world_box"]["position"] == pytest.approx(expected)
        refusals(workspace, 412)


def test_a_conflict_with_a_deletion_says_so(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session) as workspace:
        page, (box, *_) = workspace.page, workspace.answer("/boxes")
        conflicting(workspace, box, None)
        card = page.get_by_role("region", name="Conflict")
        expect(card).to_contain_text("was deleted meanwhile")
        expect(card.locator("tbody tr").nth(1)).to_contain_text("123.0")  # what was typed is not lost
        card.get_by_role("button", name="Leave it deleted").click()
        expect(card).to_have_count(0)
        assert box["id"] not in [one["id"] for one in workspace.answer("/boxes")]
        refusals(workspace, 412)


def test_who_else_has_a_box_selected_is_seen_at_it(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session) as workspace:
        page, (box, *_) = workspace.page, workspace.answer("/boxes")
        other = page.context.new_page()
        other.add_init_script("localStorage.setItem('ars-web.name', 'Ada King')")
        other.goto(page.url.partition("#")[0])
        row(other, box["name"]).click()
        expect(row(page, box["name"]).get_by_role("img", name="Selected by Ada King")).to_have_text("AK")
        other.close()
        expect(row(page, box["name"]).get_by_role("img")).to_have_count(0)


def test_a_thousand_boxes_stay_few_rows_and_are_found_by_name(plain_session, open_flatly) -> None:
    with open_flatly(*plain_session) as workspace:
        page = workspace.page
        base = f"/api/sessions/{workspace.sid}"
        workspace.client.post(f"{base}/classes", json={"name": "bolt"})
        rng = np.random.default_rng(1)
        for i in range(1000):
            place = {"position": rng.uniform(-1, 1, 3).tolist(), "wxyz": [1.0, 0.0, 0.0, 0.0]}
            draft = {"class_id": 0, "T_world_box": place, "size": [0.01, 0.01, 0.01], "name": f"bolt {i}"}
            assert workspace.client.post(f"{base}/boxes", json=draft).status_code == 201
        saved(page, 1001)
        grid = page.get_by_role("grid", name="Boxes")
        expect(grid).to_have_attribute("aria-rowcount", "1000")
        grid.focus()
        page.keyboard.press("End")
        expect(row(page, "bolt 999")).to_be_in_viewport()
        assert grid.get_by_role("row").count() < 40
        page.get_by_role("searchbox", name="Find boxes").fill("bolt 77")
        expect(grid).to_have_attribute("aria-rowcount", "11")
        page.get_by_role("searchbox", name="Find boxes").fill("nut")
        expect(page.get_by_text("No box or class is called")).to_be_visible()


def test_no_boxes_yet_teaches_the_ways_to_make_one(plain_session, open_flatly) -> None:
    with open_flatly(*plain_session) as workspace:
        page = workspace.page
        page.get_by_role("button", name=re.compile("New box here")).click()
        expect(page.get_by_role("alert")).to_contain_text("A box needs a class")
        expect(page.get_by_role("textbox", name="Name of the new class")).to_be_focused()
        page.keyboard.type("mug")
        page.keyboard.press("Enter")
        saved(page, 1)
        expect(page.get_by_role("alert")).to_have_count(0)
        page.get_by_role("button", name=re.compile("From four points")).click()
        assert in_store(page, "store.tool.value") == "points"


def test_steps_to_snap_to_are_typed(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session) as workspace:
        page, (box, *_) = workspace.page, workspace.answer("/boxes")
        row(page, box["name"]).click()
        page.get_by_role("button", name="Steps to snap to").click()
        popover = page.get_by_role("dialog", name="Steps to snap to")
        popover.get_by_label("Move and resize").fill("0.5 cm")
        popover.get_by_label("Turn").fill("45/2")
        page.keyboard.press("Enter")
        assert in_store(page, "[store.snapLength.value, store.snapAngle.value]") == [0.005, 22.5]
        popover.get_by_label("Turn").fill("1000")
        page.keyboard.press("Enter")
        expect(popover.get_by_role("alert")).to_contain_text("0° to 180°")
        page.keyboard.press("Escape")
        expect(popover).to_have_count(0)
        assert in_store(page, "store.selected.value") == box["id"]  # Escape backed out one step only
