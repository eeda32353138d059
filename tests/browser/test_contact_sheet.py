"""The contact sheet: what it draws is what the server says, and follows the boxes."""

import re

import numpy as np
import pytest
from playwright.sync_api import Locator, Page, expect

SMALL = {"viewport": {"width": 1280, "height": 1000}}


def tiles(page: Page) -> Locator:
    return page.get_by_role("dialog", name="Contact sheet").get_by_role("button", name=re.compile("^Enter frame"))


def tile(page: Page, frame: int) -> Locator:
    return page.get_by_role("button", name=f"Enter frame {frame}", exact=True)


def drawn(page: Page, frame: int) -> dict[int, list[list[float]]]:
    """The coordinates of each box's lines on a tile, by the box's id."""
    paths = (
        tile(page, frame)
        .locator("path[data-box]")
        .evaluate_all("paths => paths.map((path) => [path.dataset.box, path.getAttribute('d')])")
    )
    return {
        int(box): [[float(x) for x in line.replace("L", " ").split()] for line in path.split("M")[1:]]
        for box, path in paths
    }


def wait_for_boxes(page: Page, frame: int, ids: set[int]) -> None:
    page.wait_for_function(
        """([frame, ids]) => {
            const paths = document.querySelectorAll(`[aria-label="Enter frame ${frame}"] path[data-box]`);
            return [...paths].map((path) => Number(path.dataset.box)).sort().join() === ids.sort().join();
        }""",
        arg=[frame, sorted(ids)],
    )


def test_every_tile_shows_its_photo_with_the_boxes_as_the_server_draws_them(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session, **SMALL) as workspace:
        page = workspace.page
        page.get_by_role("button", name="Contact sheet").click()
        expect(tiles(page)).to_have_count(9)
        for frame in range(9):
            labels = {label["box_id"]: label for label in workspace.answer(f"/frames/{frame}/labels?shape=box")}
            seen = {box for box, label in labels.items() if label["bbox"] is not None}
            wait_for_boxes(page, frame, seen)
            assert (frame == 8) == (not seen)  # the demo's last image shows nothing
            for box, lines in drawn(page, frame).items():
                expected = labels[box]["wireframe"]
                assert len(lines) == len(expected)
                for line, told in zip(lines, expected, strict=True):
                    assert np.abs(np.array(line).reshape(-1, 2) - told).max() <= 0.0051
            picture = tile(page, frame).locator("img")
            page.wait_for_function("image => image.naturalWidth > 0", arg=picture.element_handle())
            # The lines lie in the photo's own pixels.
            assert tile(page, frame).locator("svg.wireframes").get_attribute("viewBox") == "0 0 480 360"
        expect(tile(page, 4)).to_contain_text(workspace.answer("/frames?offset=4&limit=1")["items"][0]["name"][-9:])


def test_a_box_that_is_changed_is_drawn_anew(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session, **SMALL) as workspace:
        page = workspace.page
        page.keyboard.press("c")
        seen = {label["box_id"] for label in workspace.answer("/frames/3/labels") if label["bbox"] is not None}
        wait_for_boxes(page, 3, seen)
        before = drawn(page, 3)
        gone = min(seen)
        box = workspace.answer(f"/boxes/{gone}")
        place = {"position": [0.0, 0.0, 500.0], "wxyz": [1, 0, 0, 0]}
        changed = workspace.client.patch(
            f"/api/sessions/{workspace.sid}/boxes/{gone}",
            json={"T_world_box": place},
            headers={"If-Match": f'"{box["revision"]}"'},
        )
        assert changed.status_code == 200, changed.text
        wait_for_boxes(page, 3, seen - {gone})
        assert drawn(page, 3) == {id_: lines for id_, lines in before.items() if id_ != gone}


def test_the_filter_leaves_the_frames_that_show_the_selected_box(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session, **SMALL) as workspace:
        page = workspace.page
        page.keyboard.press("c")
        only = page.get_by_role("checkbox", name=re.compile("Only frames that show"))
        expect(only).to_be_disabled()  # nothing is selected
        page.keyboard.press("Escape")
        page.keyboard.press("]")
        first = workspace.answer("/boxes")[0]
        page.keyboard.press("c")
        expect(page.get_by_text(f"Only frames that show {first['name']}")).to_be_visible()
        only.check()
        showing = [
            frame for frame in range(9) if workspace.answer(f"/frames/{frame}/labels?shape=box")[0]["bbox"] is not None
        ]
        assert 0 < len(showing) < 9
        expect(tiles(page)).to_have_count(len(showing))
        expect(page.get_by_text(f"{len(showing)} of 9")).to_be_visible()
        for frame in showing:
            expect(tile(page, frame).locator(f"path.selected[data-box='{first['id']}']")).to_have_count(1)


def test_it_is_a_dialog_that_keeps_the_focus_and_gives_it_back(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session, **SMALL) as workspace:
        page = workspace.page
        opener = page.get_by_role("button", name="Contact sheet")
        opener.focus()
        page.keyboard.press("Enter")
        sheet = page.get_by_role("dialog", name="Contact sheet")
        expect(tile(page, 4)).to_be_focused()  # the frame at hand
        page.keyboard.press("ArrowLeft")
        expect(tile(page, 3)).to_be_focused()
        page.keyboard.press("End")
        expect(tile(page, 8)).to_be_focused()
        for _ in range(12):
            page.keyboard.press("Tab")
            # Past its ends the browser's own parts come, but nothing of the page below.
            assert sheet.evaluate(
                "sheet => sheet.contains(document.activeElement) || document.activeElement === document.body"
            )
        page.keyboard.press("Escape")
        expect(sheet).to_have_count(0)
        expect(opener).to_be_focused()
        page.keyboard.press("Enter")
        tile(page, 6).click()
        expect(sheet).to_have_count(0)
        expect(page.get_by_role("slider", name="Frame", exact=True)).to_have_attribute("aria-valuenow", "6")
        expect(page.get_by_role("tab", name="Frame")).to_have_attribute("aria-selected", "true")


def test_fewer_frames_and_larger_pictures(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session, **SMALL) as workspace:
        page = workspace.page
        page.keyboard.press("c")
        expect(tiles(page)).to_have_count(9)
        apart = page.get_by_label("Every so many frames")
        apart.fill("4")
        apart.press("Enter")
        expect(tiles(page)).to_have_count(3)
        assert [one.get_attribute("aria-label") for one in tiles(page).all()] == [
            "Enter frame 0",
            "Enter frame 4",
            "Enter frame 8",
        ]
        before = tile(page, 0).bounding_box()
        page.get_by_label("Size of the pictures").fill("400")
        after = tile(page, 0).bounding_box()
        assert before is not None
        assert after is not None
        assert after["width"] >= 400 > before["width"]
        apart.fill("0")
        apart.press("Enter")
        expect(apart).to_have_value("4")
        expect(tiles(page)).to_have_count(3)


def test_what_is_typed_stays_while_the_sheet_changes(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session, **SMALL) as workspace:
        page = workspace.page
        page.keyboard.press("c")
        seen = {label["box_id"] for label in workspace.answer("/frames/3/labels") if label["bbox"] is not None}
        wait_for_boxes(page, 3, seen)
        apart = page.get_by_label("Every so many frames")
        apart.fill("4")
        gone = min(seen)
        revision = workspace.answer(f"/boxes/{gone}")["revision"]
        address = f"/api/sessions/{workspace.sid}/boxes/{gone}"
        assert workspace.client.delete(address, headers={"If-Match": f'"{revision}"'}).status_code == 204
        wait_for_boxes(page, 3, seen - {gone})
        assert apart.input_value() == "4"
        apart.press("Enter")
        expect(tiles(page)).to_have_count(3)


@pytest.mark.parametrize("viewport", [{"width": 1280, "height": 720}, {"width": 700, "height": 600}])
def test_only_what_is_in_sight_exists(boxed_session, open_flatly, viewport) -> None:
    with open_flatly(*boxed_session, viewport=viewport) as workspace:
        page = workspace.page
        page.keyboard.press("c")
        tile(page, 4).wait_for()
        page.get_by_label("Size of the pictures").fill("480")
        page.wait_for_function("() => document.querySelectorAll('.tile').length < 9")
        expect(page.get_by_role("dialog").get_by_role("listitem").first).to_have_attribute("aria-setsize", "9")
        assert page.get_by_role("dialog").evaluate("sheet => sheet.scrollWidth <= sheet.clientWidth")


def test_a_frame_chosen_while_outlining_is_shown_beside_the_others(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session, **SMALL) as workspace:
        page = workspace.page
        page.keyboard.press("3")
        panes = page.get_by_role("region", name=re.compile(r"^Frame \d+"))
        expect(panes).to_have_count(2)
        page.keyboard.press("c")
        tile(page, 7).click()
        expect(page.get_by_role("dialog", name="Contact sheet")).to_have_count(0)
        expect(panes).to_have_count(2)
        expect(page.get_by_role("button", name="Frame 7", exact=True).first).to_be_visible()


def marks(page: Page, frame: int) -> dict[int, list[list[float]]]:
    """The rings of each object on a tile, by its box's id."""
    paths = (
        tile(page, frame)
        .locator("svg.marks g[data-box] path")
        .evaluate_all("paths => paths.map((path) => [path.parentNode.dataset.box, path.getAttribute('d')])")
    )
    return {
        int(box): [[float(x) for x in ring.rstrip("Z").replace("L", " ").split()] for ring in path.split("M")[1:]]
        for box, path in paths
    }


def test_objects_are_drawn_as_exports_would_hold_them(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session, **SMALL) as workspace:
        page = workspace.page
        page.keyboard.press("c")
        page.get_by_role("combobox", name="As exported").select_option("silhouette")
        told = workspace.answer("/frames/3/marks?function=silhouette&shape=hull")
        expected = {
            one["box_id"]: [[side for corner in ring for side in corner] for ring in one["rings"]]
            for one in told
            if one["rings"]
        }
        expect(tile(page, 3).locator("svg.marks path")).to_have_count(len(expected))
        assert marks(page, 3) == expected
        expect(tile(page, 3).locator("svg.wireframes")).to_have_count(0)
        # Meshes there are none of: that is said, and the way back is at hand.
        page.get_by_role("combobox", name="Shapes").select_option("mesh")
        expect(page.get_by_role("dialog").get_by_role("alert")).to_contain_text("give a class its mesh")
        page.get_by_role("combobox", name="Shapes").select_option("box")
        expect(page.get_by_role("dialog").get_by_role("alert")).to_have_count(0)
        expect(tile(page, 3).locator("svg.marks path")).to_have_count(len(expected))
        workspace.complaints[:] = [one for one in workspace.complaints if "422" not in one]


def test_the_frame_at_hand_is_shown_flat_with_keypoints_as_exported(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session, **SMALL) as workspace:
        page = workspace.page
        page.keyboard.press("f")
        page.get_by_role("combobox", name="As exported").select_option("keypoints")
        flat = page.get_by_role("region", name="Frame 4 as exported")
        told = workspace.answer("/frames/4/marks?function=keypoints&shape=hull")
        for state in ("seen", "hidden"):
            count = sum(point["state"] == state and point["at"] is not None for one in told for point in one["points"])
            expect(flat.locator(f'circle[data-state="{state}"]')).to_have_count(count)
        page.keyboard.press(".")
        expect(page.get_by_role("region", name="Frame 5 as exported").get_by_role("img")).to_be_visible()
        page.locator("body").press("o")
        expect(page.get_by_role("region", name=re.compile("as exported"))).to_have_count(0)
