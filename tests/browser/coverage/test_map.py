"""Coverage mode's heat map, its frames and its panel: what is shown is what the API says."""

import re
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import expect

MUG = 8
"""The mug's id."""


def flat(found: dict[str, Any], kind: str) -> list[int]:
    return found["equal_area"]["counts"] if kind == "Equal area" else np.array(found["counts"]).ravel().tolist()


@pytest.mark.parametrize("kind", ["Equal angles", "Equal area"])
def test_the_maps_bins_are_the_apis(open_coverage, kind: str) -> None:
    with open_coverage() as shown:
        found = shown.coverage(f"box_id={MUG}")
        shown.page.get_by_role("button", name=kind, exact=True).click()
        expect(shown.page.get_by_role("grid", name="Views of mug by direction")).to_be_visible()
        expected = flat(found, kind)
        assert shown.counts() == expected
        seen = next(i for i, count in enumerate(expected) if count)
        words = f"{expected[seen]} {'view' if expected[seen] == 1 else 'views'}"
        expect(shown.bin(seen)).to_have_attribute("aria-label", re.compile(f"azimuth .*from top: {words}$"))
        hole = expected.index(0)
        expect(shown.bin(hole)).to_have_attribute("aria-label", re.compile("from top: no view$"))
        assert shown.page.locator(".heat-map .dots circle").count() == expected.count(0)
        shown.bin(seen).hover()
        expect(shown.page.locator(".reading")).to_contain_text(words)
        number = shown.page.locator('[data-number="unseen"]')
        expect(number).to_have_text(f"{round(100 * found['equal_area']['empty_fraction'])}%")
        expect(shown.page.locator('[data-number="frames"]')).to_have_text(str(found["frames"]))


def test_a_bins_frames_are_shown_and_entered_and_led_back_from(open_coverage) -> None:
    with open_coverage() as shown:
        counts = shown.counts()
        index = int(np.argmax(counts))
        shown.bin(index).click()
        expect(shown.bin(index)).to_have_attribute("aria-selected", "true")
        where = f"azimuth={index // 9}&polar={index % 9}"
        items = shown.answer(f"/coverage/frames?box_id={MUG}&azimuth_bins=18&polar_bins=9&{where}")["items"]
        assert len(items) == counts[index]
        frames = shown.page.get_by_role("region", name="Frames from this direction").locator("[data-frame]")
        expect(frames).to_have_count(len(items))
        assert frames.evaluate_all("all => all.map(one => Number(one.dataset.frame))") == [
            one["frame"] for one in items
        ]
        frames.first.click()
        assert shown.in_store("[store.mode.value, store.frame.value]") == ["frame", items[0]["frame"]]
        shown.page.keyboard.press("f")
        expect(shown.page.get_by_role("tab", name="Coverage")).to_have_attribute("aria-selected", "true")
        expect(shown.bin(index)).to_have_attribute("aria-selected", "true")
        shown.bin(counts.index(0)).click()
        expect(shown.page.get_by_text("No frame sees it from this direction.")).to_be_visible()


def test_by_keys_alone(open_coverage) -> None:
    with open_coverage("#box=8") as shown:
        keys, focused = shown.page.keyboard, shown.page.locator(":focus")
        keys.press("4")
        expect(shown.page.get_by_role("tab", name="Coverage")).to_have_attribute("aria-selected", "true")
        counts = shown.counts()
        for _ in range(60):
            keys.press("Tab")
            if shown.page.evaluate("document.activeElement?.getAttribute('role')") == "gridcell":
                break
        keys.press("Home")
        row = int(focused.get_attribute("data-index") or -1)
        keys.press("ArrowLeft")  # round the back
        expect(focused).to_have_attribute("data-index", str(17 * 9 + row))
        keys.press("End")
        expect(focused).to_have_attribute("data-index", str(17 * 9 + row))
        wanted = int(np.argmax(counts))
        for key, times in (
            ("ArrowUp", row - wanted % 9),
            ("ArrowDown", wanted % 9 - row),
            ("ArrowRight", 1 + wanted // 9),
        ):
            for _ in range(times):
                keys.press(key)
        expect(focused).to_have_attribute("data-index", str(wanted))
        keys.press("Enter")
        expect(shown.page.locator("[data-frame]")).to_have_count(counts[wanted])
        keys.press("Tab")
        keys.press("Tab")
        frame = focused.get_attribute("data-frame")
        keys.press("Enter")
        expect(shown.page.get_by_role("slider", name="Frame", exact=True)).to_have_attribute(
            "aria-valuenow", frame or ""
        )
        keys.press("4")
        keys.press("Escape")
        assert shown.in_store("store.direction.value") is None
        keys.press("Escape")
        assert shown.in_store("store.mode.value") == "scene"


def test_moving_a_box_changes_the_map(open_coverage) -> None:
    with open_coverage() as shown:
        before = shown.counts()
        box = shown.answer(f"/boxes/{MUG}")
        w, x, y, z = box["T_world_box"]["wxyz"]
        turned = {**box["T_world_box"], "wxyz": [w - z, x + y, y - x, z + w]}  # a quarter turn about z
        answer = shown.server.client.patch(
            f"/api/sessions/{shown.sid}/boxes/{MUG}",
            json={"T_world_box": turned},
            headers={"If-Match": f'"{box["revision"]}"'},
        )
        assert answer.status_code == 200
        after = flat(shown.coverage(f"box_id={MUG}"), "Equal angles")
        assert after != before
        shown.until(lambda: shown.counts() == after)


def test_objects_and_classes_are_listed_with_what_is_unseen(open_coverage) -> None:
    with open_coverage() as shown:
        listed = shown.page.get_by_role("radiogroup", name="Object").get_by_role("radio")
        items = shown.answer("/coverage/objects?azimuth_bins=18&polar_bins=9")["items"]
        expect(listed).to_have_count(len(items))
        for row, item in zip(listed.all(), items, strict=True):
            expect(row).to_have_attribute(
                "aria-label", re.compile(rf", {round(100 * item['empty_fraction'])}% unseen$")
            )
        box = next(row for row in listed.all() if row.get_attribute("data-object") == "box 1")
        box.click()
        shown.until(lambda: shown.counts() == flat(shown.coverage("box_id=1"), "Equal angles"))
        whole = shown.answer("/boxes/1")["class_id"]
        shown.page.locator(f'[data-object="class {whole}"]').click()
        shown.until(lambda: shown.counts() == flat(shown.coverage(f"class_id={whole}"), "Equal angles"))
        assert shown.in_store("store.sphereBox.value") == 1
        address = shown.page.get_by_role("link", name="Numbers").get_attribute("href") or ""
        assert shown.server.client.get(address).json() == shown.coverage(f"class_id={whole}")
        picture = shown.page.get_by_role("link", name="Picture").get_attribute("href") or ""
        assert picture == address.replace("/coverage?", "/coverage/picture?")


def test_bins_and_visibility_are_the_users_and_mistakes_are_told_in_place(open_coverage) -> None:
    with open_coverage() as shown:
        shown.page.get_by_label("Size of a bin").select_option("30")
        shown.until(lambda: shown.bins.count() == 12 * 6)
        visible = shown.page.get_by_label("At least visible")
        visible.fill("120")
        visible.press("Enter")
        expect(shown.page.get_by_text("A share from 0 to 100 %, such as 50.")).to_be_visible()
        expect(visible).to_have_attribute("aria-invalid", "true")
        visible.fill("95")
        visible.press("Enter")
        expected = shown.coverage(f"box_id={MUG}&min_visible=0.95", bins="azimuth_bins=12&polar_bins=6")
        assert expected != shown.coverage(f"box_id={MUG}", bins="azimuth_bins=12&polar_bins=6")
        shown.until(lambda: shown.counts() == flat(expected, "Equal angles"))
        expect(visible).to_have_attribute("aria-invalid", "false")


def test_views_are_planned_and_listed_with_what_they_fill(open_coverage) -> None:
    with open_coverage() as shown:
        shown.page.get_by_label("Views at most").fill("4")
        least = shown.page.get_by_label("Distance, least")
        least.fill("far")
        expect(least).to_have_attribute("aria-invalid", "true")
        button = shown.page.get_by_role("button", name="Plan views")
        expect(button).to_have_attribute("aria-disabled", "true")
        least.fill("450 mm")
        shown.page.get_by_label("Distance, most").fill("1.2 m/2")
        button.click()
        views = shown.page.get_by_role("group", name="Planned views").locator(".tour-views button")
        expect(views.first).to_be_visible()
        tour = shown.in_store("store.tour.value")
        assert 1 <= len(tour) <= 4
        expect(views).to_have_count(len(tour))
        distances = views.evaluate_all(r"all => all.map(one => Number(one.ariaLabel.match(/(\d+) mm away/)[1]))")
        assert all(449 <= distance <= 601 for distance in distances)
        views.first.click()
        assert shown.in_store("store.direction.value.by") == "area"
        chosen = shown.in_store("store.direction.value.index")
        expect(shown.bin(chosen)).to_have_attribute("data-count", "0")
        with shown.page.expect_download() as download:
            shown.page.get_by_role("link", name="Tour").click()
        assert download.value.suggested_filename == "tour.json"
        shown.page.get_by_label("Height, least").fill("40 m")
        shown.page.get_by_label("Height, most").fill("41 m")
        shown.page.get_by_role("button", name="Plan again").click()
        expect(shown.page.get_by_role("region", name="Where to look next").get_by_role("alert")).to_be_visible()
        shown.complaints[:] = [one for one in shown.complaints if "status of 4" not in one]  # Chromium says it, too


def test_without_a_box_it_says_how_to_make_one(open_coverage) -> None:
    with open_coverage("#mode=coverage", empty=True) as shown:
        dock = shown.page.get_by_role("region", name="Coverage", exact=True)
        expect(dock).to_contain_text("make one first")
        expect(shown.page.get_by_role("button", name=re.compile("From four points"))).to_be_visible()
        expect(shown.bins).to_have_count(0)
