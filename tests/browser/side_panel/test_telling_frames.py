"""The frames in which an error of the selected box shows most."""

import re
from typing import Any

from playwright.sync_api import Page, expect


def drawn(page: Page) -> list[list[list[float]]]:
    """The points of each frame's lines, frame by frame."""
    return page.locator(".tile").evaluate_all(
        """(tiles) => tiles.map((tile) => [...tile.querySelectorAll('.edge polyline')].flatMap(
            (line) => line.getAttribute('points').split(' ').map((point) => point.split(',').map(Number))))"""
    )


def test_the_frames_that_tell_most_show_the_box_as_it_is_seen_now(boxed_session, open_panel) -> None:
    with open_panel(*boxed_session) as panel:
        page, (box, *_) = panel.page, panel.answer("/boxes")
        panel.row(box["name"]).click()
        telling = panel.answer(f"/boxes/{box['id']}/telling-frames")
        frames = [one["frame"] for one in telling]
        tiles = page.get_by_role("region", name="Where an error shows most").get_by_role("button")
        expect(tiles).to_have_count(len(telling))
        expect(page.locator(".tile svg")).to_have_count(len(telling))
        for tile, one in zip(tiles.all(), telling, strict=True):
            expect(tile).to_have_accessible_name(re.compile(f"^Enter frame {one['frame']}, where 1 mm is"))
            expect(tile).to_contain_text(f"1 mm = {one['px_per_mm']:.1f} px")

        def expected(place: dict[str, Any], size: list[float]) -> list[list[list[float]]]:
            draft = {"boxes": [{"T_world_box": place, "size": size}], "frames": frames}
            seen = panel.client.post(f"/api/sessions/{panel.sid}/labels", json=draft).json()
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

        panel.type_into("Position X", f"{x + 0.3} m")
        panel.saved(1)
        again = panel.answer(f"/boxes/{box['id']}/telling-frames")
        expect(tiles).to_have_count(len(again))
        for tile, one in zip(tiles.all(), again, strict=True):
            expect(tile).to_have_accessible_name(re.compile(f"^Enter frame {one['frame']},"))
        tiles.last.click()
        assert panel.in_store("[store.mode.value, store.frame.value]") == ["frame", again[-1]["frame"]]


def test_a_box_that_no_frame_shows_is_said_to_be(boxed_session, open_panel) -> None:
    with open_panel(*boxed_session) as panel:
        page, (box, *_) = panel.page, panel.answer("/boxes")
        panel.row(box["name"]).click()
        panel.type_into("Position Z", "900 m")
        expect(page.get_by_text("No frame shows this box")).to_be_visible()
