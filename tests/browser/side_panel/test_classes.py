"""Classes: adding, changing and deleting them."""

from playwright.sync_api import Route, expect


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


def test_what_is_typed_while_an_answer_is_awaited_stays(boxed_session, open_panel) -> None:
    with open_panel(*boxed_session) as panel:
        page = panel.page
        first = panel.answer("/classes")[0]
        held: list[Route] = []
        page.route(f"**/classes/{first['id']}", lambda route: held.append(route))
        page.get_by_role("region", name="Classes").locator(".class-row").first.click()
        editor = page.get_by_role("dialog", name="Class ")
        name = editor.get_by_role("textbox", name="Name", exact=True)
        with page.expect_request(f"**/classes/{first['id']}"):
            name.fill("cup")
            name.press("Enter")
        name.fill("cup and saucer")
        held.pop().continue_()
        panel.saved(1)
        expect(name).to_have_value("cup and saucer")
        sides = [editor.get_by_label(f"Usual size {axis}, mm") for axis in "XYZ"]
        for side, text in zip(sides, ("80", "70", "60"), strict=True):
            side.fill(text)
        page.unroute(f"**/classes/{first['id']}")
        page.route(f"**/classes/{first['id']}", lambda route: held.append(route))
        with page.expect_request(f"**/classes/{first['id']}"):
            sides[2].press("Enter")
        sides[2].fill("65")
        held.pop().continue_()
        expect(page.locator(".class-row").first).to_contain_text("80 \u00d7 70 \u00d7 60")
        expect(sides[2]).to_have_value("65")


CUBE = (
    "v 0 0 0\nv 80 0 0\nv 80 60 0\nv 0 60 0\nv 0 0 110\nv 80 0 110\nv 80 60 110\nv 0 60 110\n"
    "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"
)


def test_symmetry_and_keypoints_are_stored_at_once_and_undone(boxed_session, open_panel) -> None:
    with open_panel(*boxed_session) as panel:
        page = panel.page
        (first, *_) = panel.answer("/classes")
        symmetry = lambda: panel.answer("/classes")[0]["symmetry"]  # noqa: E731
        points = lambda: panel.answer("/classes")[0]["keypoints"]  # noqa: E731
        page.get_by_role("region", name="Classes").locator(".class-row").first.click()
        editor = page.get_by_role("dialog", name=f"Class {first['name']}")
        choice = editor.get_by_role("combobox", name="Symmetry")
        choice.select_option("discrete")
        panel.saved(1)
        editor.get_by_role("combobox", name="Part of turn 1").select_option("4")
        panel.saved(2)
        editor.get_by_role("button", name="Add turn").click()
        panel.saved(3)
        assert symmetry()["rotations"] == [{"axis": [0, 0, 1], "order": 4}, {"axis": [1, 0, 0], "order": 2}]
        choice.select_option("continuous")
        panel.saved(4)
        editor.get_by_role("checkbox", name="Both ends alike").check()
        panel.saved(5)
        assert symmetry() == {"kind": "continuous", "rotations": [], "axis": [0, 0, 1], "flip": True}

        expect(editor.get_by_text("centre and corners")).to_be_visible()
        editor.get_by_role("button", name="Add keypoint").click()
        panel.saved(6)
        editor.get_by_role("textbox", name="Name of keypoint 1").fill("spout")
        page.keyboard.press("Enter")
        panel.saved(7)
        editor.get_by_role("textbox", name="X of spout").fill("half")
        page.keyboard.press("Enter")
        expect(editor.get_by_role("alert")).to_contain_text("“half” is not a number")
        editor.get_by_role("textbox", name="X of spout").fill("0,5")
        page.keyboard.press("Enter")
        panel.saved(8)
        assert points() == [{"name": "spout", "place": [0.5, 0, 0]}]
        editor.get_by_role("button", name="Remove spout").click()
        panel.saved(9)
        assert points() == []
        page.keyboard.press("Escape")
        page.get_by_role("button", name="Undo").first.click()
        panel.saved(10)
        assert points() == [{"name": "spout", "place": [0.5, 0, 0]}]


def test_a_mesh_is_given_once_its_unit_and_axes_are_said(boxed_session, open_panel) -> None:
    with open_panel(*boxed_session) as panel:
        page = panel.page
        (first, *_) = panel.answer("/classes")
        page.get_by_role("region", name="Classes").locator(".class-row").first.click()
        editor = page.get_by_role("dialog", name=f"Class {first['name']}")
        mesh = editor.get_by_role("group", name="Mesh", exact=True)
        with page.expect_file_chooser() as chooser:
            mesh.get_by_role("button", name="Choose a file").click()
        chooser.value.set_files({"name": "carton.obj", "mimeType": "text/plain", "buffer": CUBE.encode()})
        use = mesh.get_by_role("button", name="Use this mesh")
        use.click()
        expect(mesh.get_by_role("alert")).to_contain_text("in which unit the file's numbers are")
        mesh.get_by_role("combobox", name="Unit of the file").select_option("mm")
        use.click()
        expect(mesh.get_by_role("alert")).to_contain_text("which axes of the file")
        mesh.get_by_role("combobox", name="Axes of the file").select_option("other")
        mesh.get_by_role("textbox", name="Other axes").fill("y,x,z")
        use.click()
        expect(mesh.get_by_role("alert")).to_contain_text("mirror")
        assert panel.answer("/classes")[0]["mesh"] is None
        mesh.get_by_role("combobox", name="Axes of the file").select_option("x,-z,y")
        use.click()
        panel.saved(1)
        expect(mesh).to_contain_text("carton.obj")
        expect(mesh).to_contain_text("80 \u00d7 110 \u00d7 60 mm, 8 vertices, 12 faces")
        stored = panel.answer("/classes")[0]["mesh"]
        assert stored["source"] == {"name": "carton.obj", "unit": "mm", "axes": "x,-z,y", "origin": "centre"}
        mesh.get_by_role("button", name="Remove mesh").click()
        panel.saved(2)
        assert panel.answer("/classes")[0]["mesh"] is None
        page.keyboard.press("Escape")
        page.get_by_role("button", name="Undo").first.click()
        panel.saved(3)
        page.get_by_role("region", name="Classes").locator(".class-row").first.click()
        expect(mesh).to_contain_text("80 \u00d7 110 \u00d7 60 mm")
        assert panel.answer("/classes")[0]["mesh"] == stored
        panel.expect_refusals(422)
