"""The list of boxes: selecting, renaming, hiding, locking, the menu, long lists and none at all."""

import re
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Route, expect

from ars_web.recordings.registry import read_recording
from ars_web.sessions.store import SessionStore
from tests.browser.conftest import Shelf


@pytest.fixture
def plain_session(shelf: Shelf, demo_recording) -> tuple[Path, str]:
    """The sessions folder and the id of the small demo, without boxes and classes."""
    with SessionStore(shelf.sessions) as store:
        made = store.create(read_recording(demo_recording.folder, format="ars"), name="plain")
    return shelf.sessions, made.id


def test_boxes_are_listed_selected_by_keys_and_renamed_in_place(boxed_session, open_panel) -> None:
    with open_panel(*boxed_session) as panel:
        page, boxes = panel.page, panel.answer("/boxes")
        rows = page.get_by_role("grid", name="Boxes").get_by_role("row")
        for box in boxes:
            shown = panel.row(box["name"])
            sides = [str(int(side * 1000 + 0.5)) for side in box["size"]]
            words = sides[0] if len(set(sides)) == 1 else " \u00d7 ".join(sides)
            shown.scroll_into_view_if_needed()
            expect(shown).to_contain_text(f"{words} mm")
        page.get_by_role("grid", name="Boxes").focus()
        page.keyboard.press("Home")
        expect(rows.filter(has_text=boxes[0]["name"]).first).to_have_attribute("aria-selected", "true")
        page.keyboard.press("ArrowDown")
        page.keyboard.press("ArrowDown")
        assert panel.in_store("store.selected.value") == boxes[2]["id"]
        expect(page.get_by_role("region", name=boxes[2]["name"], exact=True)).to_be_visible()
        page.keyboard.press("ArrowLeft")  # elsewhere it would move the box
        page.keyboard.press("End")
        expect(panel.row(boxes[-1]["name"])).to_be_in_viewport()

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
        panel.saved(1)
        expect(panel.row("<img src=x onerror=alert(1)>")).to_be_visible()
        assert panel.answer(f"/boxes/{boxes[-1]['id']}")["name"] == "<img src=x onerror=alert(1)>"

        panel.row(boxes[-2]["name"]).dblclick()
        page.keyboard.type("by mouse")
        page.get_by_role("tab", name="Boxes").click()  # leaving the field keeps what is typed
        panel.saved(2)
        assert panel.answer(f"/boxes/{boxes[-2]['id']}")["name"] == "by mouse"
        assert panel.answer("/boxes")[0] == boxes[0]


def test_a_name_that_is_typed_on_while_the_first_is_stored_stays(boxed_session, open_panel) -> None:
    with open_panel(*boxed_session) as panel:
        page = panel.page
        held: list[Route] = []
        page.route("**/boxes/1", lambda route: held.append(route))
        page.get_by_role("grid", name="Boxes").locator("[data-box='1']").click()
        page.keyboard.press("F2")
        field = page.get_by_role("textbox", name="Name of")
        with page.expect_request("**/boxes/1"):
            field.fill("lid")
            field.press("Enter")
        field.fill("lid of the pot")
        held.pop().continue_()
        page.unroute("**/boxes/1")
        panel.saved(1)
        expect(field).to_have_value("lid of the pot")
        field.press("Enter")
        panel.saved(2)
        expect(field).to_have_count(0)
        assert panel.answer("/boxes/1")["name"] == "lid of the pot"


def test_hiding_is_this_pages_own_and_locking_is_everybodys(boxed_session, open_panel) -> None:
    with open_panel(*boxed_session) as panel:
        page, (box, *_) = panel.page, panel.answer("/boxes")
        shown = panel.row(box["name"])
        eye = page.get_by_role("button", name=f"Hide {box['name']}", exact=True)
        eye.click()
        expect(eye).to_have_attribute("aria-pressed", "true")
        assert panel.in_store("[...store.hidden.value]") == [box["id"]]
        assert panel.in_store("store.selected.value") is None  # the click was the button's
        eye.click()
        assert panel.in_store("[...store.hidden.value]") == []

        shown.hover()
        page.get_by_role("button", name=f"Lock {box['name']}", exact=True).click()
        panel.saved(1)
        assert panel.answer(f"/boxes/{box['id']}")["locked"]
        shown.click()
        expect(panel.field("Position X")).not_to_be_editable()
        panel.field("Position X").press("ArrowUp")
        expect(page.get_by_role("button", name="Delete", exact=True)).to_be_disabled()
        page.get_by_role("button", name="Unlock", exact=True).click()
        panel.saved(2)
        assert not panel.answer(f"/boxes/{box['id']}")["locked"]
        expect(panel.field("Position X")).to_be_editable()


def test_the_menu_of_a_box_does_what_it_says(boxed_session, open_panel) -> None:
    with open_panel(*boxed_session) as panel:
        page, boxes = panel.page, panel.answer("/boxes")
        box, other = boxes[0], next(b for b in boxes if b["class_id"] != boxes[0]["class_id"])
        classes = {c["id"]: c["name"] for c in panel.answer("/classes")}

        def choose(item: str) -> None:
            panel.row(box["name"]).click(button="right")
            page.get_by_role("menuitem", name=item).click()

        choose("Class")
        page.get_by_role("menuitem", name=classes[other["class_id"]], exact=True).click()
        panel.saved(1)
        assert panel.answer(f"/boxes/{box['id']}")["class_id"] == other["class_id"]
        choose("Duplicate")
        panel.saved(2)
        assert len(panel.answer("/boxes")) == len(boxes) + 1
        assert panel.in_store("store.selected.value") == panel.answer("/boxes")[-1]["id"]
        now = panel.answer(f"/boxes/{box['id']}")
        lifted = {**now["T_world_box"], "position": [*now["T_world_box"]["position"][:2], 1.0]}
        panel.by_another(f"/boxes/{box['id']}", now["revision"], {"T_world_box": lifted})
        panel.saved(3)
        choose("Rest on ground")
        panel.saved(4)
        z = panel.answer(f"/boxes/{box['id']}")["T_world_box"]["position"][2]
        assert z == pytest.approx(box["size"][2] / 2)  # they stand upright
        choose("Hide")
        assert panel.in_store("[...store.hidden.value]") == [box["id"]]
        choose("Rename")
        page.keyboard.type("renamed")
        page.keyboard.press("Enter")
        panel.saved(5)
        page.get_by_role("grid", name="Boxes").focus()
        page.keyboard.press("Shift+F10")  # the keyboard's way to the menu
        page.get_by_role("menuitem", name="Delete").click()
        panel.saved(6)
        assert box["id"] not in [b["id"] for b in panel.answer("/boxes")]


def test_who_else_has_a_box_selected_is_seen_at_it(boxed_session, open_panel) -> None:
    with open_panel(*boxed_session) as panel:
        page, (box, *_) = panel.page, panel.answer("/boxes")
        other = page.context.new_page()
        other.add_init_script("localStorage.setItem('ars-web.name', 'Ada King')")
        other.goto(page.url.partition("#")[0])
        other.get_by_role("grid", name="Boxes").get_by_text(box["name"], exact=True).click()
        expect(panel.row(box["name"]).get_by_role("img", name="Selected by Ada King")).to_have_text("AK")
        other.close()
        expect(panel.row(box["name"]).get_by_role("img")).to_have_count(0)


def test_a_thousand_boxes_stay_few_rows_and_are_found_by_name(plain_session, open_panel) -> None:
    with open_panel(*plain_session) as panel:
        page = panel.page
        base = f"/api/sessions/{panel.sid}"
        panel.client.post(f"{base}/classes", json={"name": "bolt"})
        rng = np.random.default_rng(1)
        for i in range(1000):
            place = {"position": rng.uniform(-1, 1, 3).tolist(), "wxyz": [1.0, 0.0, 0.0, 0.0]}
            draft = {"class_id": 0, "T_world_box": place, "size": [0.01, 0.01, 0.01], "name": f"bolt {i}"}
            assert panel.client.post(f"{base}/boxes", json=draft).status_code == 201
        panel.saved(1001)
        grid = page.get_by_role("grid", name="Boxes")
        expect(grid).to_have_attribute("aria-rowcount", "1000")
        grid.focus()
        page.keyboard.press("End")
        expect(panel.row("bolt 999")).to_be_in_viewport()
        assert grid.get_by_role("row").count() < 40
        page.get_by_role("searchbox", name="Find boxes").fill("bolt 77")
        expect(grid).to_have_attribute("aria-rowcount", "11")
        page.get_by_role("searchbox", name="Find boxes").fill("nut")
        expect(page.get_by_text("No box or class is called")).to_be_visible()


def test_no_boxes_yet_teaches_the_ways_to_make_one(plain_session, open_panel) -> None:
    with open_panel(*plain_session) as panel:
        page = panel.page
        page.get_by_role("button", name=re.compile("New box here")).click()
        expect(page.get_by_role("alert")).to_contain_text("A box needs a class")
        expect(page.get_by_role("textbox", name="Name of the new class")).to_be_focused()
        page.keyboard.type("mug")
        page.keyboard.press("Enter")
        panel.saved(1)
        expect(page.get_by_role("alert")).to_have_count(0)
        page.get_by_role("button", name=re.compile("From four points")).click()
        assert panel.in_store("store.tool.value") == "points"
