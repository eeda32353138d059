"""The export panel, by a real server and Chromium: options, what would be written, exports to their end."""

import re
import time
import zipfile
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from playwright.sync_api import Locator, Page, Route, expect

from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.recordings.recording import Frame, RecordedBox, Recording
from ars_web.recordings.registry import read_recording
from ars_web.sessions.store import SessionStore
from tests.browser.conftest import Shelf

LONG = 20_000


@pytest.fixture
def plain_session(shelf: Shelf, demo_recording) -> tuple[Path, str]:
    """The small demo without boxes."""
    with SessionStore(shelf.sessions) as store:
        made = store.create(read_recording(demo_recording.folder, format="ars"), name="plain")
    return shelf.sessions, made.id


@pytest.fixture
def long_session(shelf: Shelf, tmp_path: Path) -> tuple[Path, str]:
    """A box that a camera at rest sees 20,000 times: exporting it takes seconds."""
    image = tmp_path / "image.jpg"
    cv2.imwrite(str(image), np.full((240, 320, 3), 128, np.uint8))
    frames = tuple(Frame(f"images/{i:05d}.jpg", image, 0, np.eye(4)) for i in range(LONG))
    camera = Camera(320, 240, 300.0, 300.0, 159.5, 119.5, "pinhole", ())
    T_world_box = np.eye(4)
    T_world_box[2, 3] = 2.0
    box = RecordedBox("thing", Box(T_world_box, np.full(3, 0.4)))
    with SessionStore(shelf.sessions) as store:
        read = Recording("ars", tmp_path, {0: camera}, frames, class_names=("thing",), boxes=(box,))
        made = store.create(read, name="long")
    return shelf.sessions, made.id


def open_panel(page: Page) -> None:
    page.get_by_role("tab", name="Export").click()
    expect(page.get_by_role("heading", name="Export training set")).to_be_visible()


def field(page: Page, name: str) -> Locator:
    return page.get_by_role("spinbutton", name=name, exact=True)


def problem_at(page: Page, option: str) -> Locator:
    return page.locator(f'.option[data-name="{option}"]').get_by_role("alert")


def forecast(page: Page) -> Locator:
    return page.get_by_role("region", name="What would be written")


def counted(page: Page) -> None:
    expect(forecast(page).locator(".figures")).to_have_attribute("data-stale", "false", timeout=30_000)


def rows(page: Page, state: str) -> Locator:
    return page.get_by_role("region", name="Exports").locator(f'li[data-state="{state}"]')


def warning(page: Page, name: str) -> Locator:
    return page.get_by_role("list", name="Before you start").locator(f'[data-warning="{name}"]')


def figures(page: Page) -> dict[str, Any]:
    """What the panel shows, in the words of an export's report."""
    table = forecast(page).get_by_role("table")
    number = lambda cell: int(cell.inner_text().replace(",", ""))  # noqa: E731
    splits: dict[str, Any] = {}
    for split in {cell.get_attribute("data-split") for cell in table.locator("td").all()}:
        of = table.locator(f'td[data-split="{split}"]')
        splits[split] = {
            "images": number(of.and_(page.locator('[data-count="images"]'))),
            "negatives": number(of.and_(page.locator('[data-count="negatives"]'))),
            "labels": number(of.and_(page.locator('[data-count="all"]'))),
            "classes": {
                row.get_attribute("data-class"): number(row.locator(f'td[data-split="{split}"]'))
                for row in table.locator("tr[data-class]").all()
            },
        }
    dropped = {
        row.get_attribute("data-reason"): number(row.locator("span"))
        for row in forecast(page).locator("[data-reason]").all()
    }
    return {"splits": splits, "dropped": dropped}


def test_a_finished_export_has_the_figures_that_the_panel_showed(boxed_session, open_flatly, tmp_path: Path) -> None:
    with open_flatly(*boxed_session) as workspace:
        page = workspace.page
        open_panel(page)
        page.get_by_role("radio", name="YOLO (Ultralytics)").check()
        field(page, "Every N-th frame").fill("2")
        field(page, "Validation").fill("0.4")
        field(page, "Smallest visible share").fill("0.5")
        expect(field(page, "Training")).to_have_value("0.6")
        counted(page)
        shown = figures(page)

        page.get_by_role("button", name="Export 5 frames").click()
        expect(rows(page, "done")).to_be_visible(timeout=60_000)
        (job,) = workspace.answer("/exports")
        assert job["options"]["frames"]["step"] == 2
        assert {k: job["options"]["split"][k] for k in ("train", "val", "test")} == {
            "train": 0.6,
            "val": 0.4,
            "test": 0,
        }
        assert shown["splits"] == job["report"]["splits"]
        assert shown["dropped"] == {reason: count for reason, count in job["report"]["dropped"].items() if count}
        said = rows(page, "done")
        expect(said).to_contain_text(
            re.compile("Every N-th frame: 2.· Smallest visible share: 0.5.· Training: 0.6.· Validation: 0.4")
        )
        labels = sum(split["labels"] for split in job["report"]["splits"].values())
        expect(said).to_contain_text(f"{labels} labels · 3 training, 2 validation")

        with page.expect_download() as download:
            page.get_by_role("link", name="Download YOLO").click()
        download.value.save_as(tmp_path / "dataset.zip")
        with zipfile.ZipFile(tmp_path / "dataset.zip") as dataset:
            assert sum(name.endswith("/data.yaml") for name in dataset.namelist()) == 1
            assert sum(name.endswith((".png", ".jpg")) for name in dataset.namelist()) == 5


def test_a_running_export_is_cancelled_and_removed(long_session, open_flatly) -> None:
    with open_flatly(*long_session) as workspace:
        page = workspace.page
        open_panel(page)
        page.get_by_role("button", name=re.compile("^(Start export|Export )", re.I)).and_(
            page.locator(".start *")
        ).click()
        progress = rows(page, "running")
        expect(progress).to_contain_text(re.compile(r"[\d,]+ of 20,000 frames"), timeout=60_000)
        page.get_by_role("button", name="Cancel YOLO").click()
        expect(rows(page, "cancelled")).to_be_visible(timeout=30_000)
        assert [job["state"] for job in workspace.answer("/exports")] == ["cancelled"]

        page.get_by_role("button", name="Remove YOLO").click()
        expect(page.get_by_role("button", name="Keep")).to_be_focused()
        page.get_by_role("button", name="Keep").click()
        expect(page.get_by_role("button", name="Remove YOLO")).to_be_visible()
        page.get_by_role("button", name="Remove YOLO").click()
        remove = page.get_by_role("group", name="Remove this export").get_by_role("button", name="Remove")
        refused = rows(page, "cancelled").get_by_role("alert")
        gone = page.get_by_text("None yet.")
        remove.click()
        expect(gone.or_(refused)).to_be_visible(timeout=30_000)
        deadline = time.monotonic() + 120
        while refused.is_visible():
            # On a busy machine workers take longer to stop than the server waits for them.
            expect(refused).to_contain_text("still being stopped; try again in a moment")
            assert time.monotonic() < deadline
            with page.expect_response(lambda answer: answer.request.method == "DELETE"):
                remove.click()
            expect(gone.or_(refused.and_(page.locator("li:not(:has(.bad[aria-disabled=true])) *")))).to_be_visible(
                timeout=30_000
            )
        expect(gone).to_be_visible()
        workspace.complaints[:] = [one for one in workspace.complaints if "409" not in one]
        assert workspace.answer("/exports") == []


def test_what_cannot_be_is_said_at_its_field(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session) as workspace:
        page = workspace.page
        open_panel(page)
        counted(page)
        start = page.locator(".start button")
        for name, option, text, reason in (
            ("Smallest visible share", "min_visible", "2", "2 is too large: it can be 1 at most."),
            ("Every N-th frame", "frames.step", "few", "“few” is not a number."),
            ("Every N-th frame", "frames.step", "1.5", "1.5 is not a whole number."),
            ("First frame", "frames.start", "9", "There is no frame 9: the last one is 8."),
            ("Up to frame", "frames.stop", "0", "No frame would be left: the first one is 0."),
            # Only the server knows that this number is beyond it.
            ("Seed", "split.seed", "1e30", "Input should be a valid integer"),
        ):
            field(page, name).fill(text)
            expect(problem_at(page, option)).to_contain_text(reason)
            expect(field(page, name)).to_have_attribute("aria-invalid", "true")
            expect(start).to_have_attribute("aria-disabled", "true")
            start.dispatch_event("click")
            expect(field(page, name)).to_be_focused()
            field(page, name).fill({"min_visible": "0", "frames.step": "1", "frames.stop": ""}.get(option, "0"))
            expect(problem_at(page, option)).to_have_count(0)
            counted(page)
        page.get_by_role("textbox", name="These frames alone").fill("3, 8-4")
        expect(problem_at(page, "frames.list")).to_contain_text("8-4 runs backwards; type 4-8.")
        page.get_by_role("textbox", name="These frames alone").fill("3, 4 - 8, 20")
        expect(problem_at(page, "frames.list")).to_contain_text("There is no frame 20: the last one is 8.")
        page.get_by_role("textbox", name="These frames alone").fill("")
        page.get_by_role("radio", name="Session").check()
        expect(problem_at(page, "split.by")).to_contain_text("2 shares need 2 sessions at least")
        assert workspace.answer("/exports") == []
        refused = [one for one in workspace.complaints if "422" in one]
        assert len(refused) == 1
        workspace.complaints[:] = [one for one in workspace.complaints if one not in refused]


def test_a_changed_option_is_marked_counted_and_reset(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session) as workspace:
        page = workspace.page
        open_panel(page)
        counted(page)
        before = figures(page)
        listed = page.get_by_role("textbox", name="These frames alone")
        listed.fill("0-2, 5")
        expect(field(page, "Every N-th frame")).to_be_disabled()
        expect(page.get_by_role("button", name="Export 4 frames")).to_be_visible()
        page.get_by_role("button", name="Reset These frames alone to none").click()
        expect(listed).to_have_value("")
        field(page, "Test").press("ArrowUp")
        expect(field(page, "Test")).to_have_value("0.05")
        expect(field(page, "Training")).to_have_value("0.75")
        expect(forecast(page).get_by_role("columnheader", name="Test")).to_be_visible()
        page.get_by_role("button", name="Reset Split").click()
        expect(field(page, "Training")).to_have_value("0.8")
        expect(forecast(page).get_by_role("columnheader", name="Test")).to_have_count(0)
        counted(page)
        assert figures(page) == before


def test_without_boxes_the_next_thing_to_do_is_the_scene(plain_session, open_flatly) -> None:
    with open_flatly(*plain_session) as workspace:
        page = workspace.page
        open_panel(page)
        expect(warning(page, "no-boxes")).to_contain_text("There are no boxes yet")
        page.get_by_role("button", name="Place boxes in the scene").click()
        expect(page.get_by_role("tab", name="Scene")).to_have_attribute("aria-selected", "true")


def test_warnings_name_the_cause_and_mend_it(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session) as workspace:
        page = workspace.page
        path = f"/api/sessions/{workspace.sid}/classes"
        assert workspace.client.post(path, json={"name": "unused"}).status_code == 201
        open_panel(page)
        expect(warning(page, "class-without-box")).to_contain_text("“unused” has no box")
        field(page, "Smallest area").fill("10000000")
        expect(warning(page, "all-dropped")).to_contain_text("“Smallest area” at 10000000")
        page.get_by_role("button", name="Set it back to 4").click()
        expect(warning(page, "all-dropped")).to_have_count(0)
        field(page, "Validation").fill("0")
        expect(warning(page, "empty-val")).to_contain_text("no image to validate on")
        page.get_by_role("button", name="Give validation 0.2").click()
        expect(warning(page, "empty-val")).to_have_count(0)
        expect(field(page, "Validation")).to_have_value("0.2")


def test_figures_follow_edits_and_exports_of_others(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session) as workspace:
        page = workspace.page
        open_panel(page)
        counted(page)
        mugs = forecast(page).locator('tr[data-class="mug"] td').first
        expect(mugs).not_to_have_text("0")
        (mug,) = [one for one in workspace.answer("/classes") if one["name"] == "mug"]
        for box in workspace.answer("/boxes"):
            if box["class_id"] == mug["id"]:
                headers = {"If-Match": f'"{box["revision"]}"'}
                address = f"/api/sessions/{workspace.sid}/boxes/{box['id']}"
                assert workspace.client.delete(address, headers=headers).status_code == 204
        expect(mugs).to_have_text("0")
        expect(warning(page, "class-without-box")).to_contain_text("“mug” has no box")

        address = f"/api/sessions/{workspace.sid}/exports"
        assert workspace.client.post(address, json={"format": "coco", "options": {}}).status_code == 202
        page.get_by_role("button", name="Look for new exports").click()
        expect(rows(page, "done")).to_contain_text("COCO", timeout=60_000)


def test_a_newer_question_ends_the_older_and_old_figures_stay_meanwhile(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session) as workspace:
        page = workspace.page
        open_panel(page)
        counted(page)
        held: list[Route] = []

        def hold(route: Route) -> None:
            if '"step":2' in (route.request.post_data or ""):
                held.append(route)
            else:
                route.continue_()

        page.route("**/exports/preview", hold)
        with page.expect_request(lambda request: '"step":2' in (request.post_data or "")):
            field(page, "Every N-th frame").fill("2")
        expect(forecast(page).get_by_role("status")).to_have_text("Counting…")
        expect(forecast(page)).to_have_attribute("aria-busy", "true")
        expect(forecast(page).locator(".figures")).to_have_attribute("data-stale", "true")
        expect(forecast(page).locator('[data-count="frames"]')).to_have_text("9")
        with page.expect_event("requestfailed", lambda request: '"step":2' in (request.post_data or "")):
            field(page, "Every N-th frame").fill("3")
        expect(forecast(page).locator('[data-count="frames"]')).to_have_text("3")
        counted(page)
        assert len(held) == 1


def test_the_picture_is_the_chosen_format_s_and_what_cannot_be_is_said_in_its_place(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session) as workspace:
        page = workspace.page
        open_panel(page)
        picture = page.get_by_role("figure", name="What the format holds").get_by_role("img")
        address = f"/api/sessions/{workspace.sid}/exports/picture?format=yolo-seg"
        with page.expect_response(lambda answer: answer.url.endswith(address)) as answered:
            page.get_by_role("radio", name="YOLO, outlines").check()
        expect(picture).to_have_attribute("alt", "A frame with its labels as YOLO, outlines holds them")
        expect(picture).to_have_attribute("data-stale", "false")
        assert answered.value.headers["content-type"] == "image/jpeg"
        assert picture.evaluate("image => image.naturalWidth / image.naturalHeight") == pytest.approx(480 / 360)
        with page.expect_response(lambda answer: "max_truncated=0.2" in answer.url) as answered:
            field(page, "Largest share outside").fill("0.2")
            expect(picture).to_have_attribute("data-stale", "true")  # the old one stays meanwhile
        assert answered.value.status == 200
        expect(picture).to_have_attribute("data-stale", "false")

        page.locator('.option[data-name="shape"]').get_by_role("radio", name="Mesh").check()
        for place in (problem_at(page, "shape"), page.get_by_role("figure").get_by_role("alert")):
            expect(place).to_contain_text("give a class its mesh")
        expect(page.locator(".start button")).to_have_attribute("aria-disabled", "true")
        page.get_by_role("button", name="Reset Label shape to Hull").click()
        expect(problem_at(page, "shape")).to_have_count(0)
        expect(picture).to_have_attribute("data-stale", "false")
        workspace.complaints[:] = [one for one in workspace.complaints if "422" not in one]


def test_what_a_format_cannot_hold_is_said_before_and_after(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session) as workspace:
        page = workspace.page
        told = {"format": "kitti", "options": {"images": "none"}}
        counts = workspace.client.post(f"/api/sessions/{workspace.sid}/exports/preview", json=told).json()
        losses = [text[0].upper() + text[1:] for text in counts["losses"]]
        assert losses
        assert workspace.client.post(f"/api/sessions/{workspace.sid}/exports", json=told).status_code == 202
        open_panel(page)
        page.get_by_role("radio", name="KITTI object detection").check()
        counted(page)
        expect(warning(page, "losses").locator(".problem")).to_have_text(losses)
        said = rows(page, "done").get_by_role("list", name="What it does not hold")
        expect(said.get_by_role("listitem")).to_have_text(losses)


def test_frames_are_chosen_by_what_they_show_and_the_panel_says_what_they_cover(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session) as workspace:
        page = workspace.page
        open_panel(page)
        even = page.get_by_role("radio", name="Even", exact=True)
        expect(even).to_be_disabled()
        field(page, "How many frames").fill("4")
        expect(even).to_be_enabled()
        counted(page)
        made = page.get_by_role("region", name="How frames are chosen")
        shown = {
            row.get_attribute("data-frames"): int(row.locator(".count").inner_text())
            for row in made.locator("dl > div").all()
        }
        assert shown["evenly"] <= shown["chosen"] <= shown["candidates"]

        sector = page.get_by_role("textbox", name="Cameras from one side", exact=True)
        sector.fill("10 to 10")
        expect(problem_at(page, "frames.sector")).to_contain_text("Nothing lies between 10° and 10°")
        sector.fill("0 to 180")
        field(page, "Near twins by time").fill("1")
        counted(page)
        expect(made).to_contain_text("looked from another side")
        chosen = int(forecast(page).locator('[data-count="frames"]').inner_text())
        page.get_by_role("button", name=re.compile(rf"Export {chosen} frames?")).click()
        expect(rows(page, "done")).to_be_visible(timeout=60_000)
        (job,) = workspace.answer("/exports")
        frames = job["options"]["frames"]
        assert (frames["count"], frames["near_frames"], frames["sector"]) == (4, 1, [0, 180])
        assert sum(split["images"] for split in job["report"]["splits"].values()) == chosen


def test_the_report_is_of_the_options_that_are_set(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session) as workspace:
        page = workspace.page
        open_panel(page)
        field(page, "Every N-th frame").fill("2")
        with page.expect_popup() as opened:
            page.get_by_role("link", name="Report", exact=True).click()
        report = opened.value
        expect(report.get_by_text("--frames-step 2").first).to_be_visible(timeout=60_000)
        report.close()
        link, held = page.get_by_role("link", name="Report", exact=True), page.locator(".start [aria-disabled]")
        field(page, "Every N-th frame").fill("none")
        expect(link).to_have_count(0)
        expect(held.get_by_text("Report")).to_have_attribute("title", re.compile("^Set right first"))
        field(page, "Every N-th frame").fill("1")
        expect(link).to_have_count(1)
