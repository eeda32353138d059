"""Names that are HTML: of a session, a class, a box, a frame and a person. Each is text, wherever the page shows it."""

from dataclasses import replace
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from ars_web.recordings.recording import RecordedBox
from ars_web.recordings.registry import read_recording
from ars_web.sessions.store import SessionStore

HTML = '<img src=x onerror="window.pwned=1">'


@pytest.fixture
def badly_named(tmp_path, demo_recording) -> tuple[Any, str]:
    """The small demo with one box, all of it named so."""
    read = read_recording(demo_recording.folder, format="ars")
    recording = replace(
        read,
        frames=tuple(replace(frame, name=f"{HTML}{i}.jpg") for i, frame in enumerate(read.frames)),
        class_names=(HTML, "other"),
        boxes=(RecordedBox(HTML, demo_recording.objects[0].box),),
    )
    with SessionStore(tmp_path / "sessions") as store:
        return tmp_path / "sessions", store.create(recording, name=HTML).id


def nothing_came_of_it(page: Page) -> None:
    """No name has become an element, and none has run."""
    for frame in page.frames:
        assert frame.locator("img[src='x']").count() == 0
        assert frame.evaluate("typeof window.pwned") == "undefined"


def test_names_are_text_wherever_they_are_shown(open_workspace, badly_named) -> None:
    sessions, sid = badly_named
    with open_workspace(sessions) as (_, base, page_of):
        workspace, other = page_of(sid), page_of(sid)
        page = workspace.page
        dialogs: list[str] = []
        page.on("dialog", lambda dialog: (dialogs.append(dialog.message), dialog.dismiss()))
        other.page.add_init_script(f"localStorage.setItem('ars-web.name', '{HTML}')")

        # The sessions page, with what it says of a session that was deleted.
        page.goto(base)
        card = page.get_by_role("article", name=HTML, exact=True)
        expect(card.get_by_role("link", name=HTML, exact=True)).to_be_visible()
        card.get_by_role("button", name="What can be done with").click()
        page.get_by_role("menuitem", name="Delete").click()
        page.get_by_role("article", name=f"Deleted {HTML}", exact=True).get_by_role("button", name="Undo").click()
        expect(card.get_by_role("link", name=HTML, exact=True)).to_be_visible()
        nothing_came_of_it(page)

        workspace.open("#frame=4&box=1")
        assert page.title() == f"{HTML} · ARS Web"
        expect(page.get_by_role("button", name=HTML, exact=True).first).to_be_visible()  # the session
        expect(page.get_by_role("grid", name="Boxes").get_by_text(HTML, exact=True)).to_be_visible()
        expect(page.get_by_role("combobox", name=f"Class of {HTML}").get_by_role("option")).to_have_text(
            [HTML, "other"]
        )
        expect(page.get_by_role("region", name="Classes").get_by_text(HTML).first).to_be_visible()
        page.get_by_role("grid", name="Boxes").get_by_text(HTML, exact=True).click(button="right")
        page.get_by_role("menuitem", name="Class").click()
        expect(
            page.get_by_role("menuitem", name=HTML).or_(page.get_by_role("menuitemradio", name=HTML))
        ).to_be_visible()
        page.keyboard.press("Escape")
        nothing_came_of_it(page)

        # In the scene, and over it in a frame.
        expect(page.frame_locator(".stage iframe").locator(".ars-name")).to_have_text([HTML])
        workspace.enter(4)
        expect(page.get_by_text(f"{HTML}4.jpg", exact=True)).to_be_visible()

        # Another person: in the top bar, on the scrubber, beside the box, in tooltips, and in the history.
        other.open("#frame=2&box=1")
        expect(page.get_by_role("group", name=f"Also here: {HTML}", exact=True)).to_be_visible()
        expect(page.get_by_title(f"{HTML} is at frame 2", exact=True)).to_be_attached()
        expect(page.get_by_role("img", name=f"Selected by {HTML}")).to_be_visible()
        field = other.page.get_by_role("spinbutton", name="Size X", exact=True)
        field.fill("33")
        field.press("Enter")
        workspace.until(lambda: workspace.revision() == 1)
        page.keyboard.press("y")
        item = page.get_by_role("region", name="History", exact=True).get_by_role("listitem")
        expect(item.get_by_text(HTML).first).to_be_visible()
        expect(item.locator(".who")).to_contain_text(HTML)
        page.keyboard.press("y")
        nothing_came_of_it(page)
        nothing_came_of_it(other.page)

        page.keyboard.press("Control+k")
        page.get_by_role("combobox", name="Command, box or frame number").fill("<img")
        expect(page.get_by_role("option", name=f"Select {HTML}")).to_be_visible()
        page.keyboard.press("Escape")
        page.keyboard.press("c")
        sheet = page.get_by_role("dialog", name="Contact sheet")
        expect(sheet.get_by_text(f"{HTML}0.jpg", exact=True)).to_be_visible()
        page.keyboard.press("Escape")
        page.get_by_role("tab", name="Export").click()
        expect(page.get_by_role("region", name="What would be written").get_by_text(HTML).first).to_be_visible()
        nothing_came_of_it(page)
        assert dialogs == []
