"""How near the photo is seen, by the keys of the workspace, wherever in it the focus is."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import expect


def test_keys_zoom_the_photo_to_the_box_and_back(
    open_workspace: Callable[..., Any], mug: tuple[Path, str, int]
) -> None:
    sessions, sid, box_id = mug
    with open_workspace(sessions) as (_, _, page_of):
        workspace = page_of(sid).open()
        page = workspace.page
        workspace.enter(0)
        page.get_by_role("grid", name="Boxes").get_by_text("mug", exact=True).click()  # the page has the focus

        def zoom() -> float:
            return page.evaluate("import('/static/store.js').then((store) => store.zoom.value)")

        for key, wanted in (("+", 1.25), ("=", 1.5625), ("-", 1.25), ("0", 1.0)):
            page.keyboard.press(key)
            workspace.until(lambda wanted=wanted: zoom() == pytest.approx(wanted))

        stage = page.locator(".stage iframe").bounding_box()
        assert stage is not None
        page.keyboard.press("l")
        workspace.until(lambda: zoom() > 1.25)
        x, y = workspace.on_screen(f"/boxes/{box_id}/at")
        assert stage["x"] + 0.2 * stage["width"] < x < stage["x"] + 0.8 * stage["width"]
        assert stage["y"] + 0.2 * stage["height"] < y < stage["y"] + 0.8 * stage["height"]
        expect(page.get_by_role("tab", name="Frame")).to_have_attribute("aria-selected", "true")  # it was not left

        page.locator(".stage iframe").focus()  # the same keys, once each, where the scene has the focus
        page.keyboard.press("0")
        workspace.until(lambda: zoom() == 1)
        page.keyboard.press("+")
        workspace.until(lambda: zoom() == pytest.approx(1.25))


def test_a_frame_that_a_page_began_in_is_left_for_the_whole_recording(
    open_workspace: Callable[..., Any], mug: tuple[Path, str, int]
) -> None:
    sessions, sid, _ = mug
    with open_workspace(sessions) as (_, _, page_of):

        def place(workspace: Any) -> Any:
            return workspace.scene.evaluate("() => window.__viserMutable.camera.position.toArray()")

        workspace = page_of(sid).open()
        whole = place(workspace)
        workspace.open("#frame=1&mode=frame")
        workspace.page.reload()  # an address that differs in this alone is no other page
        workspace.settle()
        workspace.until(
            lambda: workspace.page.evaluate("import('/static/store.js').then((store) => store.entered.value)") == 1
        )
        assert place(workspace) != pytest.approx(whole, abs=0.01)
        workspace.page.keyboard.press("f")
        workspace.until(lambda: place(workspace) == pytest.approx(whole, abs=0.01))
