"""Classes: adding, changing and deleting them."""

from playwright.sync_api import expect


def test_classes_are_added_changed_and_kept_while_used(boxed_session, open_panel) -> None:
    with open_panel(*boxed_session) as panel:
        page = panel.page
        first = panel.answer("/classes")[0]
        used = sum(box["class_id"] == first["id"] for box in panel.answer("/boxes"))
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
        panel.saved(1)
        expect(section.locator(".class-row").last).to_contain_text("<b>new</b>")

        section.locator(".class-row").last.click()
        editor = page.get_by_role("dialog", name="Class <b>new</b>")
        editor.get_by_label("Name").fill("cup")
        page.keyboard.press("Enter")
        panel.saved(2)
        editor = page.get_by_role("dialog", name="Class cup")
        editor.get_by_role("button", name="Yellow").click()
        panel.saved(3)
        editor.get_by_label("Another colour").fill("#123456")
        panel.saved(4)
        for axis, text in zip("XYZ", ("8 cm", "85/2", "-1"), strict=True):
            editor.get_by_label(f"Usual size {axis}, mm").fill(text)
        page.keyboard.press("Enter")
        expect(editor.get_by_role("alert")).to_contain_text("longer than 0")
        editor.get_by_label("Usual size Z, mm").fill("100")
        page.keyboard.press("Enter")
        panel.saved(5)
        made = panel.answer("/classes")[-1]
        assert (made["name"], made["color"], made["default_size"]) == ("cup", "#123456", [0.08, 0.0425, 0.1])
        expect(section.locator(".class-row").last).to_contain_text("0 boxes, 80 \u00d7 43 \u00d7 100 mm")
        editor.get_by_role("button", name="Delete class").click()
        panel.saved(6)
        expect(editor).to_have_count(0)

        entry.click()
        editor = page.get_by_role("dialog", name=f"Class {first['name']}")
        editor.get_by_role("button", name="Delete class").click()
        expect(editor.get_by_role("alert")).to_contain_text("used by")
        editor.get_by_role("textbox", name="Name").fill("not this")
        page.keyboard.press("Escape")  # keeps nothing of what is typed
        expect(editor).to_have_count(0)
        expect(entry).to_be_focused()
        assert [c["name"] for c in panel.answer("/classes")].count(first["name"]) == 1
        panel.saved(6)
        panel.expect_refusals(409, 412, 422)
