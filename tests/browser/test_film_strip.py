"""The scrubber and the film strip, over recordings of nine and of 36,000 frames."""

import re
from pathlib import Path
from urllib.parse import urlparse

import cv2
import numpy as np
import pytest
from playwright.sync_api import Locator, Page, Request, expect

from ars_web.geometry.camera import Camera
from ars_web.recordings.recording import Frame, Recording
from ars_web.sessions.store import SessionStore
from tests.browser.conftest import Shelf

FRAMES = 36_000
ASKED = re.compile(r"/frames/(\d+)/image$")


@pytest.fixture(scope="module")
def long_session(shelf: Shelf, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """A camera that walks along a wall for 36,000 frames, which all show the same small image. Looked at only."""
    folder = tmp_path_factory.mktemp("long")
    image = folder / "image.jpg"
    cv2.imwrite(str(image), np.full((240, 320, 3), 128, np.uint8))
    Ts = np.tile(np.eye(4), (FRAMES, 1, 1))
    Ts[:, 0, 3] = np.linspace(0.0, 20.0, FRAMES)
    frames = tuple(Frame(f"images/{i:05d}.jpg", image, 0, T) for i, T in enumerate(Ts))
    camera = Camera(320, 240, 300.0, 300.0, 159.5, 119.5, "pinhole", ())
    with SessionStore(shelf.sessions) as store:
        made = store.create(Recording("ars", folder, {0: camera}, frames), name="long")
    return shelf.sessions, made.id


def scrubber(page: Page) -> Locator:
    return page.get_by_role("slider", name="Frame", exact=True)


def strip(page: Page) -> Locator:
    return page.get_by_role("listbox", name="Film strip")


def current(page: Page) -> Locator:
    return strip(page).get_by_role("option", selected=True)


def wait_for_pictures(page: Page) -> None:
    page.wait_for_function(
        """() => {
            const strip = document.querySelector('[aria-label="Film strip"]');
            const { left, right } = strip.getBoundingClientRect();
            const inSight = ({ left: l, right: r }) => r > left && l < right;
            const images = [...strip.querySelectorAll('.slot')]
                .filter((slot) => inSight(slot.getBoundingClientRect()))
                .map((slot) => slot.querySelector('img'));
            return images.length > 3 && images.every((image) => image.complete && image.naturalWidth > 0);
        }"""
    )


def test_36_000_frames_hold_few_thumbnails_and_every_place_is_one_key_away(long_session, open_flatly) -> None:
    with open_flatly(*long_session) as workspace:
        page = workspace.page
        wait_for_pictures(page)
        expect(scrubber(page)).to_have_attribute("aria-valuemax", str(FRAMES - 1))
        shown = strip(page).get_by_role("option")
        assert shown.count() < 40

        scrubber(page).focus()
        for key, frame in (
            ("End", FRAMES - 1),
            ("ArrowLeft", FRAMES - 2),
            ("Home", 0),
            ("ArrowRight", 1),
            ("PageUp", 11),
        ):
            page.keyboard.press(key)
            expect(scrubber(page)).to_have_attribute("aria-valuenow", str(frame))
            expect(current(page)).to_have_attribute("aria-label", f"Frame {frame}")
            expect(current(page)).to_be_in_viewport(ratio=0.95)
        assert shown.count() < 40

        box = scrubber(page).bounding_box()
        assert box is not None
        page.mouse.move(box["x"] + box["width"] / 4, box["y"] + box["height"] / 2)
        page.mouse.down()
        expect(scrubber(page)).to_have_attribute("aria-valuenow", re.compile(r"^(899\d|90\d\d)$"))
        page.mouse.move(box["x"] + box["width"] / 2, box["y"] - 100)
        expect(scrubber(page)).to_have_attribute("aria-valuenow", re.compile(r"^(179[89]\d|180\d\d)$"))
        page.mouse.up()
        expect(current(page)).to_be_in_viewport(ratio=0.95)
        wait_for_pictures(page)


def test_pictures_are_asked_for_where_the_strip_rests_and_not_on_the_way(long_session, open_flatly) -> None:
    with open_flatly(*long_session) as workspace:
        page = workspace.page
        closer = page.get_by_role("button", name="Closer frames")
        while closer.is_enabled():
            closer.click()
        wait_for_pictures(page)
        scrubber(page).focus()
        page.keyboard.press("Home")
        expect(current(page)).to_have_attribute("aria-label", "Frame 0")
        wait_for_pictures(page)
        expect(strip(page).get_by_role("option").first).to_have_attribute("aria-setsize", str(FRAMES))

        asked: list[int] = []

        def note(request: Request) -> None:
            if found := ASKED.search(urlparse(request.url).path):
                asked.append(int(found[1]))

        page.on("request", note)
        # 60 refreshes of the screen, from one end of four million pixels to the other.
        held = strip(page).evaluate(
            """strip => new Promise((done) => {
                const last = strip.scrollWidth - strip.clientWidth;
                let at = 0, most = 0;
                const step = () => {
                    at += 1;
                    strip.scrollLeft = last * Math.min(1, at / 60);
                    most = Math.max(most, strip.querySelectorAll('.slot').length);
                    if (at < 62) requestAnimationFrame(step); else done(most);
                };
                requestAnimationFrame(step);
            })"""
        )
        assert held < 40
        wait_for_pictures(page)
        assert asked
        assert min(asked) > FRAMES - 100


def test_the_spacing_follows_the_wheel_about_the_pointer(long_session, open_flatly) -> None:
    with open_flatly(*long_session) as workspace:
        page = workspace.page
        wait_for_pictures(page)
        length = strip(page).evaluate("strip => strip.scrollWidth")
        box = strip(page).bounding_box()
        assert box is not None
        page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        under = (
            "({x, y}) => Number(document.elementFromPoint(x, y).closest('.slot').querySelector('.index').textContent)"
        )
        middle = {"x": box["x"] + box["width"] / 2, "y": box["y"] + box["height"] / 2}
        before = page.evaluate(under, middle)
        page.keyboard.down("Control")
        for _ in range(3):
            page.mouse.wheel(0, -100)
        page.keyboard.up("Control")
        page.wait_for_function("was => document.querySelector('.strip').scrollWidth > 5 * was", arg=length)
        assert abs(page.evaluate(under, middle) - before) <= 500
        assert page.evaluate("devicePixelRatio") == 1  # the browser's own zoom did not take the wheel


def test_a_thumbnail_leads_to_its_frame_and_into_it(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session) as workspace:
        page = workspace.page
        strip(page).get_by_role("option", name="Frame 2").click()
        expect(scrubber(page)).to_have_attribute("aria-valuenow", "2")
        expect(page.get_by_role("tab", name="Scene")).to_have_attribute("aria-selected", "true")
        strip(page).get_by_role("option", name="Frame 3").dblclick()
        expect(scrubber(page)).to_have_attribute("aria-valuenow", "3")
        expect(page.get_by_role("tab", name="Frame")).to_have_attribute("aria-selected", "true")
        page.get_by_role("tab", name="Scene").click()
        strip(page).focus()
        page.keyboard.press("ArrowRight")
        expect(scrubber(page)).to_have_attribute("aria-valuenow", "4")
        page.keyboard.press("Enter")
        expect(page.get_by_role("tab", name="Frame")).to_have_attribute("aria-selected", "true")


def test_the_strip_follows_the_frame_but_not_against_a_hand_that_scrolls_it(long_session, open_flatly) -> None:
    with open_flatly(*long_session) as workspace:
        page = workspace.page
        wait_for_pictures(page)
        page.evaluate("document.activeElement.blur()")
        page.keyboard.press("Control+End")
        expect(current(page)).to_be_in_viewport(ratio=0.95)
        # In one go: whatever the machine is busy with, the frame changes right after the wheel.
        scrolled = strip(page).evaluate(
            """strip => {
                strip.dispatchEvent(new WheelEvent('wheel', { deltaY: -3000, bubbles: true, cancelable: true }));
                dispatchEvent(new KeyboardEvent('keydown', { key: ',', code: 'Comma' }));
                return strip.scrollLeft;
            }"""
        )
        expect(scrubber(page)).to_have_attribute("aria-valuenow", str(FRAMES - 2))
        wait_for_pictures(page)
        assert strip(page).evaluate("strip => strip.scrollLeft") == scrolled


def test_a_picture_that_is_gone_says_why_and_moves_nothing(shelf: Shelf, tmp_path: Path, open_flatly) -> None:
    paths = [tmp_path / f"{i}.png" for i in range(6)]
    for path in paths:
        cv2.imwrite(str(path), np.full((240, 320, 3), 90, np.uint8))
    frames = tuple(Frame(path.name, path, 0, np.eye(4)) for path in paths)
    camera = Camera(320, 240, 300.0, 300.0, 159.5, 119.5, "pinhole", ())
    with SessionStore(shelf.sessions) as store:
        made = store.create(Recording("ars", tmp_path, {0: camera}, frames), name="holes")
    paths[2].unlink()
    with open_flatly(shelf.sessions, made.id) as workspace:
        page = workspace.page
        broken = strip(page).get_by_role("option", name="Frame 2")
        expect(broken.get_by_title(re.compile("not there any more"))).to_be_visible()
        boxes = [strip(page).get_by_role("option", name=f"Frame {i}").bounding_box() for i in range(6)]
        assert {(box["width"], box["height"]) for box in boxes if box is not None} == {(80, 60)}
        # The browser itself says on its console that the image is not there.
        assert all("404" in complaint for complaint in workspace.complaints)
        workspace.complaints.clear()


def test_pointing_at_the_scrubber_shows_the_frame(boxed_session, open_flatly) -> None:
    with open_flatly(*boxed_session) as workspace:
        page = workspace.page
        box = scrubber(page).bounding_box()
        assert box is not None
        page.mouse.move(box["x"] + box["width"] * 6.5 / 9, box["y"] + box["height"] / 2)
        preview = page.locator(".scrub-preview")
        expect(preview).to_have_text("6")
        page.wait_for_function("() => document.querySelector('.scrub-preview img')?.naturalWidth > 0")
        expect(scrubber(page)).to_have_attribute("aria-valuenow", "4")
        page.mouse.move(box["x"] + 100, box["y"] - 200)
        expect(preview).to_have_count(0)
