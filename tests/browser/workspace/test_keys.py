"""Keys: held down, written by AltGr, and in fields that have a use for them."""

import pytest
from playwright.sync_api import Page, expect


def hold(page: Page, key: str, times: int) -> None:
    """What a browser tells while a key is held down."""
    for _ in range(times):
        page.keyboard.down(key)
    page.keyboard.up(key)


def selected(page: Page) -> int | None:
    return page.evaluate("async () => (await import('/static/store.js')).selected.value")


def test_a_key_that_is_held_down_does_once_what_is_not_a_step(open_flatly, boxed_session) -> None:
    with open_flatly(*boxed_session) as workspace:
        page, boxes = workspace.page, workspace.answer("/boxes")
        page.get_by_role("grid", name="Boxes").get_by_text(boxes[0]["name"], exact=True).click()
        hold(page, "u", 4)
        assert page.evaluate("async () => (await import('/static/store.js')).upright.value") is True
        page.keyboard.press("u")
        page.keyboard.down("Control")
        hold(page, "d", 5)
        page.keyboard.up("Control")
        expect(page.locator(".saved")).to_have_text("Saved, revision 1")
        assert len(workspace.answer("/boxes")) == len(boxes) + 1
        page.keyboard.press("Escape")
        frame = page.get_by_role("slider", name="Frame", exact=True)
        before = int(frame.get_attribute("aria-valuenow") or "")
        hold(page, ".", 3)
        expect(frame).to_have_attribute("aria-valuenow", str(before + 3))


@pytest.mark.parametrize("modifiers", [{}, {"altKey": True}, {"altKey": True, "ctrlKey": True}])
def test_brackets_are_brackets_however_a_keyboard_writes_them(open_flatly, boxed_session, modifiers) -> None:
    with open_flatly(*boxed_session) as workspace:
        page = workspace.page
        press = """([key, modifiers]) =>
            document.body.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true, ...modifiers }))"""
        page.evaluate(press, ["]", modifiers])
        assert selected(page) == 1
        page.evaluate(press, ["]", modifiers])
        assert selected(page) == 2
        page.evaluate(press, ["[", modifiers])
        assert selected(page) == 1
        page.evaluate(press, ["v", {"altKey": True}])
        page.evaluate(press, ["Escape", {"altKey": True}])
        assert selected(page) == 1


def test_arrows_move_the_slider_that_has_the_focus(open_flatly, boxed_session) -> None:
    with open_flatly(*boxed_session) as workspace:
        page = workspace.page
        page.keyboard.press("f")
        photo = page.get_by_role("slider", name="Photo over the 3D scene")
        frame = page.get_by_role("slider", name="Frame", exact=True)
        before = frame.get_attribute("aria-valuenow")
        photo.focus()
        page.keyboard.press("ArrowLeft")
        expect(photo).to_have_value("0.95")
        page.keyboard.press("Home")
        expect(photo).to_have_value("0")
        expect(frame).to_have_attribute("aria-valuenow", before or "")


def test_escape_leaves_the_sessions_name_and_enter_stores_it_once(open_flatly, boxed_session) -> None:
    with open_flatly(*boxed_session) as workspace:
        page = workspace.page
        asked: list[str] = []
        page.on("request", lambda request: asked.append(request.url) if request.method == "PATCH" else None)
        page.get_by_role("button", name="demo", exact=True).click()
        name = page.get_by_role("textbox", name="Name of the session")
        name.fill("not this")
        name.press("Escape")
        expect(page.get_by_role("button", name="demo", exact=True)).to_be_visible()
        page.get_by_role("button", name="demo", exact=True).click()
        name.fill("kitchen")
        name.press("Enter")
        expect(page.get_by_role("button", name="kitchen", exact=True)).to_be_visible()
        expect(page.locator(".saved")).to_have_text("Saved, revision 1")
        assert workspace.answer("")["name"] == "kitchen"
        assert len(asked) == 1
