"""The history, and conflicts between two who change one box."""

import re
from typing import Any

import pytest
from playwright.sync_api import expect


def test_history_says_who_did_what_and_what_of_it_stands(boxed_session, open_panel) -> None:
    with open_panel(*boxed_session) as panel:
        page, (box, other, *_) = panel.page, panel.answer("/boxes")
        page.get_by_role("tab", name="History").click()
        history = page.get_by_role("tabpanel", name="History")
        expect(history).to_contain_text("Nothing was changed yet")
        expect(history.get_by_role("button", name="Undo")).to_be_disabled()
        panel.by_another(f"/boxes/{other['id']}", other["revision"], {"name": "elsewhere"})
        edits = history.get_by_role("listitem")
        expect(edits).to_have_count(1)
        expect(edits.first).not_to_contain_text("you")

        page.get_by_role("tab", name="Boxes").click()
        panel.row(box["name"]).click()
        panel.type_into("Position X", "5 cm")
        panel.saved(2)
        page.get_by_role("tab", name="History").click()
        expect(edits.first).to_contain_text(re.compile(r"Move .*you.*just now"))
        undo = history.get_by_role("button", name=re.compile("^Undo: Move"))
        undo.click()
        panel.saved(3)
        assert panel.answer(f"/boxes/{box['id']}")["T_world_box"] == box["T_world_box"]
        expect(edits).to_have_count(3)
        expect(edits.nth(1).locator("s")).to_contain_text("Move")
        expect(edits.nth(1)).to_contain_text("undone")
        expect(edits.nth(2).locator("s")).to_have_count(0)
        expect(history.get_by_role("button", name="Undo")).to_be_disabled()  # the other edit is not ours
        history.get_by_role("button", name=re.compile("^Redo: Move")).click()
        panel.saved(4)
        expect(edits.filter(has=page.locator("s"))).to_have_count(1)
        x = panel.answer(f"/boxes/{box['id']}")["T_world_box"]["position"][0]
        assert x == pytest.approx(0.05)


def test_older_history_loads_as_one_scrolls_to_it(boxed_session, open_panel) -> None:
    with open_panel(*boxed_session) as panel:
        page, (box, *_) = panel.page, panel.answer("/boxes")
        for i in range(120):
            revision = panel.answer(f"/boxes/{box['id']}")["revision"]
            panel.by_another(f"/boxes/{box['id']}", revision, {"name": f"name {i}"})
        panel.saved(120)
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
        panel.client.post(f"/api/sessions/{panel.sid}/undo")
        expect(edits).to_have_count(121)
        expect(edits.nth(1).locator("s")).to_be_visible()


def conflicting(panel, box: dict[str, Any], changes: dict[str, Any] | None) -> None:
    """Type a number that reaches the server just after another's change did."""
    page = panel.page

    def first_the_other(route) -> None:
        panel.by_another(f"/boxes/{box['id']}", box["revision"], changes)
        route.continue_()

    page.route(f"**/boxes/{box['id']}", first_the_other, times=1)
    panel.row(box["name"]).click()
    panel.type_into("Position Y", "0.123 m")


@pytest.mark.parametrize("choice", ["Keep theirs", "Use mine"])
def test_a_conflict_shows_both_and_asks(boxed_session, open_panel, choice: str) -> None:
    with open_panel(*boxed_session) as panel:
        page, (box, *_) = panel.page, panel.answer("/boxes")
        x, y, z = box["T_world_box"]["position"]
        place = {**box["T_world_box"], "position": [x + 0.02, y, z]}
        conflicting(panel, box, {"T_world_box": place})
        card = page.get_by_role("region", name="Conflict")
        expect(card).to_contain_text("was changed meanwhile")
        expect(card).to_contain_text("Rotation and size are the same in both")
        expect(card.locator("tr[data-differs=true]")).to_have_count(2)
        expect(card.locator("tr[data-differs=true] td").nth(0)).to_have_text(f"{(x + 0.02) * 1000:.1f}")
        expect(card.locator("tr[data-differs=true] strong").nth(0)).to_have_text(f"{x * 1000:.1f}")
        expect(card.locator("tr[data-differs=true] strong").nth(1)).to_have_text("123.0")
        card.get_by_role("button", name=choice).click()
        expect(card).to_have_count(0)
        panel.saved(1 if choice == "Keep theirs" else 2)
        expected = place["position"] if choice == "Keep theirs" else [x, 0.123, z]
        assert panel.answer(f"/boxes/{box['id']}")["T_world_box"]["position"] == pytest.approx(expected)
        panel.expect_refusals(412)


def test_a_conflict_with_a_deletion_says_so(boxed_session, open_panel) -> None:
    with open_panel(*boxed_session) as panel:
        page, (box, *_) = panel.page, panel.answer("/boxes")
        conflicting(panel, box, None)
        card = page.get_by_role("region", name="Conflict")
        expect(card).to_contain_text("was deleted meanwhile")
        expect(card.locator("tbody tr").nth(1)).to_contain_text("123.0")  # what was typed is not lost
        card.get_by_role("button", name="Leave it deleted").click()
        expect(card).to_have_count(0)
        assert box["id"] not in [one["id"] for one in panel.answer("/boxes")]
        panel.expect_refusals(412)
