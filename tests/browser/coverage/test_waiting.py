"""Coverage mode while answers take long, where they are refused, and where there is little room."""

import re
from typing import Any

import numpy as np
from playwright.sync_api import Route, expect


def test_a_direction_that_is_asked_about_is_not_told_with_anothers_frames(open_coverage) -> None:
    with open_coverage() as shown:
        counts = shown.counts()
        frames = shown.page.get_by_role("region", name="Frames from this direction")
        shown.bin(int(np.argmax(counts))).click()
        expect(frames.get_by_role("heading")).to_have_text(re.compile(r"^\d+ views? from here$"))
        held: list[Route] = []
        shown.page.route("**/coverage/frames**", lambda route: held.append(route))
        shown.bin(counts.index(0)).click()
        expect(frames.get_by_role("status")).to_have_text("Looking for its frames…")
        expect(frames.get_by_role("heading")).to_have_text("Frames")
        expect(frames.locator("[data-frame]")).to_have_count(0)
        shown.until(lambda: held)
        held[0].continue_()
        expect(frames.get_by_role("heading")).to_have_text("No frame from here")


def test_bins_of_another_size_than_asked_for_are_not_chosen(open_coverage) -> None:
    with open_coverage() as shown:
        counts = shown.counts()
        held: list[Route] = []
        shown.page.route("**/coverage?**", lambda route: held.append(route))
        shown.page.get_by_label("Size of a bin").select_option("30")
        shown.until(lambda: held)
        expect(shown.page.locator(".reading")).to_have_text("Counting the views…")
        shown.bin(int(np.argmax(counts))).click()
        assert shown.in_store("store.direction.value") is None
        for route in held:
            route.continue_()
        shown.until(lambda: shown.bins.count() == 12 * 6)
        seen = int(np.argmax(shown.counts()))
        shown.bin(seen).click()
        assert shown.in_store("store.direction.value") == {"by": "angle", "index": seen}


def test_what_went_wrong_lies_beside_the_map_and_goes_when_it_is_mended(open_coverage) -> None:
    with open_coverage() as shown:
        shown.counts()
        shown.page.route("**/coverage?**", lambda route: route.abort())
        shown.page.get_by_label("At least visible").fill("30")
        shown.page.keyboard.press("Enter")
        problem = shown.page.locator(".map-column > .problem")
        expect(problem).to_contain_text("does not answer")
        told, grid = problem.bounding_box(), shown.page.locator(".heat-map").bounding_box()
        assert told is not None
        assert grid is not None
        assert told["y"] + told["height"] <= grid["y"]
        shown.page.unroute("**/coverage?**")
        problem.get_by_role("button", name="Try again").click()
        expect(problem).to_have_count(0)
        shown.complaints[:] = [one for one in shown.complaints if "ERR_FAILED" not in one]  # Chromium says it, too


def test_a_plan_that_is_refused_says_so_in_sight(open_coverage) -> None:
    refusal: dict[str, Any] = {"type": "about:blank", "title": "No", "status": 422, "detail": "Widen one of the three"}
    with open_coverage() as shown:
        shown.counts()
        shown.page.route("**/tour", lambda route: route.fulfill(status=422, json=refusal))
        shown.page.get_by_role("button", name="Plan views").click()
        expect(shown.page.get_by_text("Widen one of the three")).to_be_in_viewport(ratio=1)
        shown.complaints[:] = [one for one in shown.complaints if "status of 422" not in one]


def test_a_narrow_window_shows_frames_and_all_buttons(open_coverage) -> None:
    with open_coverage() as shown:
        shown.page.set_viewport_size({"width": 760, "height": 900})
        shown.bin(int(np.argmax(shown.counts()))).click()
        frame = shown.page.locator("[data-frame]").first
        expect(frame).to_be_in_viewport(ratio=1)
        assert (frame.bounding_box() or {"width": 0})["width"] > 80
        for name in ("Picture", "Numbers", "Report"):
            expect(shown.page.get_by_role("link", name=name)).to_be_in_viewport(ratio=1)


def test_what_is_looked_at_unselected_can_be_looked_at_closer(open_coverage) -> None:
    with open_coverage("#mode=coverage") as shown:
        shown.counts()
        assert shown.in_store("store.selected.value") is None
        shown.page.get_by_role("button", name="Look closer").click()
        assert shown.in_store("store.selected.value") == 1
