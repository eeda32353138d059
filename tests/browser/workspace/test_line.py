"""The page's line to the server where it is cut, closed for good, or begins anew."""

import json
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, Route, WebSocketRoute, expect

TOKEN = "token-of-the-line-test"

LIVE = "**/live?*"


class Line:
    """Stands between a page and its server."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.opened = 0
        self.told: list[Any] = []
        self.newest: WebSocketRoute | None = None
        page.route_web_socket(LIVE, self._open)

    def _open(self, line: WebSocketRoute) -> None:
        self.opened += 1
        self.newest = line
        server = line.connect_to_server()

        def pass_on(message: str | bytes) -> None:
            self.told.append(json.loads(message))
            line.send(message)

        server.on_message(pass_on)

    def say(self, **message: Any) -> None:
        """As the server would."""
        assert self.newest is not None
        self.newest.send(json.dumps(message))

    def close(self, code: int, reason: str) -> None:
        """As the server would."""
        assert self.newest is not None
        self.newest.close(code=code, reason=reason)

    def until(self, condition: Callable[[], bool]) -> None:
        for _ in range(1000):
            if condition():
                return
            self.page.wait_for_timeout(20)
        raise AssertionError("the condition did not come about")

    def anew(self) -> "Line":
        """Load the page, with its line through here."""
        before = self.opened
        self.page.reload()
        self.until(lambda: self.opened == before + 1)
        expect(self.page.locator(".saved")).to_have_attribute("data-state", "saved")
        return self


def in_store(page: Page, what: str) -> Any:
    return page.evaluate(f"async () => {{ const store = await import('/static/store.js'); return {what}; }}")


def test_a_line_that_is_closed_for_good_is_not_asked_for_again(open_flatly, boxed_session) -> None:
    with open_flatly(*boxed_session) as workspace:
        line = Line(workspace.page)
        for code in (1009, 4400, 4403, 4404, 4409):
            line.anew().close(code, "this is why")
            expect(workspace.page.get_by_role("alert")).to_have_text("this is why. Load the page again.")
        line.anew().say(type="gone", revision=0)
        opened = line.opened
        line.close(4410, "the session was deleted")
        expect(workspace.page.locator(".saved")).to_have_attribute("data-state", "lost")
        expect(workspace.page.get_by_role("alert")).to_contain_text("It can be brought back from the sessions page.")
        workspace.page.keyboard.press("b")
        expect(workspace.page.get_by_text("add the box once it is")).to_be_visible()
        workspace.page.evaluate("() => dispatchEvent(new Event('online'))")  # which asks for a lost line at once
        assert workspace.page.evaluate("() => new Promise((done) => setTimeout(() => done(true), 600))")
        assert line.opened == opened


def test_another_s_drag_ends_with_the_line(open_flatly, boxed_session) -> None:
    with open_flatly(*boxed_session) as workspace:
        page, line = workspace.page, Line(workspace.page).anew()
        box = workspace.answer("/boxes")[0]
        for count, code in enumerate((1001, 1011, 4429), line.opened + 1):
            dragged = {"box_id": box["id"], "T_world_box": box["T_world_box"], "size": [9, 9, 9], "text": "Size X"}
            line.say(type="dragged", phase="move", own=True, **dragged)
            page.wait_for_function("async () => (await import('/static/store.js')).dragged.value !== null")
            line.close(code, "come back")
            line.until(lambda count=count: line.opened == count)
            expect(page.locator(".saved")).to_have_attribute("data-state", "saved")
            assert in_store(page, "[store.preview.value, store.dragged.value]") == [None, None]


def test_an_edit_that_comes_while_all_is_read_anew_is_not_lost(open_flatly, boxed_session) -> None:
    with open_flatly(*boxed_session) as workspace:
        page, line = workspace.page, Line(workspace.page).anew()
        box = workspace.answer("/boxes")[0]
        held: list[Route] = []
        page.route("**/classes", lambda route: held.append(route))
        with page.expect_response("**/boxes"):
            line.say(type="reset", revision=0)
        line.until(lambda: len(held) == 1)
        path = f"/api/sessions/{workspace.sid}/boxes/{box['id']}"
        changed = workspace.client.patch(path, json={"name": "seen"}, headers={"If-Match": '"0"'})
        assert changed.status_code == 200
        line.until(lambda: any(message["type"] == "edit" for message in line.told))
        held[0].continue_()
        expect(page.get_by_role("grid", name="Boxes").get_by_text("seen", exact=True)).to_be_visible()
        expect(page.locator(".saved")).to_have_text("Saved, revision 1")


@pytest.fixture
def port() -> int:
    """A free one, to come back to."""
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


def test_a_page_whose_login_is_worth_nothing_any_more_says_so_and_saves_what_is_typed_once_it_is(
    served, demo_in, tmp_path: Path, browser: Browser, port: int
) -> None:
    sessions, sid = demo_in(tmp_path / "sessions")
    context = browser.new_context(viewport={"width": 1280, "height": 720})
    context.route("**/scene/**", lambda route: route.fulfill(body="", content_type="text/html"))
    context.add_init_script("localStorage.setItem('ars-web.hints-seen', '1')")
    page, base = context.new_page(), f"http://127.0.0.1:{port}"
    saved = page.locator(".saved")
    with served(sessions, "--token", TOKEN, "--port", str(port)):
        assert context.request.post(f"{base}/login", data={"token": TOKEN}).ok
        page.goto(f"{base}/sessions/{sid}#box=1")
        expect(saved).to_have_text("Saved, revision 0")
    expect(saved).to_have_text("Reconnecting")
    field = page.get_by_role("spinbutton", name="Position X", exact=True)
    field.fill("12.5")
    field.press("Enter")
    expect(saved).to_have_text("Not saved yet: reconnecting")
    with served(sessions, "--token", "another" + TOKEN, "--port", str(port)):
        expect(page.locator(".page-problem")).to_contain_text("logged out")
        assert context.request.post(f"{base}/login", data={"token": "another" + TOKEN}).ok
        expect(saved).to_have_text("Saved, revision 1")
        expect(page.locator(".page-problem")).to_have_count(0)
    expect(saved).to_have_text("Reconnecting")
    with served(sessions, "--token", "third" + TOKEN, "--port", str(port)):
        expect(page.get_by_role("heading", name="Log in")).to_be_visible()
    context.close()
