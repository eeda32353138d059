"""The first page in a real browser, from a real server process."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest
from playwright.sync_api import Browser, Page, expect

TOKEN = "token-of-the-browser-test"


@contextmanager
def watched(browser: Browser, base: str, **options: object) -> Iterator[Page]:
    """A page of which nothing leaves `base`, and nothing is complained about."""
    context = browser.new_context(viewport={"width": 1280, "height": 720}, **options)  # pyright: ignore
    page = context.new_page()
    complaints: list[str] = []
    elsewhere: list[str] = []
    page.on(
        "console", lambda message: complaints.append(message.text) if message.type in ("error", "warning") else None
    )
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("request", lambda request: None if request.url.startswith(f"{base}/") else elsewhere.append(request.url))
    yield page
    context.close()
    assert complaints == []
    assert elsewhere == []


@pytest.fixture
def server(served, demo_recording, tmp_path: Path) -> Iterator[tuple[str, str, httpx.Client]]:
    """The base address, the one-time URL, and a client with the token, of a server without sessions."""
    options = ["--token", TOKEN, "--root", f"demo={demo_recording.folder}"]
    with served(tmp_path / "sessions", *options) as (_, login):
        base = login.partition("/login")[0]
        headers = {"Authorization": f"Bearer {TOKEN}"}
        with httpx.Client(base_url=base, headers=headers, timeout=60) as client:
            yield base, login, client


def make_session(client: httpx.Client, name: str) -> str:
    made = client.post("/api/sessions", json={"name": name, "root": "demo", "path": "", "classes": ["mug"]})
    assert made.status_code == 201, made.text
    return made.json()["id"]


def test_the_one_time_url_leads_to_the_sessions(
    server: tuple[str, str, httpx.Client], browser: Browser, tmp_path: Path
) -> None:
    base, login, client = server
    name = '<img src=x onerror="alert(1)"> & demo'
    sid = make_session(client, name)
    place = {"position": [0, 0, 0], "wxyz": [1, 0, 0, 0]}
    client.post(f"/api/sessions/{sid}/boxes", json={"class_id": 0, "T_world_box": place, "size": [0.1, 0.1, 0.1]})
    with watched(browser, base) as page:
        page.goto(login)
        assert page.url == f"{base}/"  # the code is gone from the address, and with it from the history
        cards = page.get_by_role("article")
        expect(cards).to_have_count(1)
        expect(cards.get_by_role("heading")).to_have_text(name)  # as text, not as HTML
        for what, value in (("frames", "9"), ("boxes", "1"), ("classes", "1")):
            expect(cards.locator(".counts div", has_text=what).locator("dd")).to_have_text(value)
        expect(cards).to_contain_text("just now")
        expect(cards).to_contain_text("ars, revision 1")
        picture = cards.get_by_role("img", name="Frame 4 of")
        picture.scroll_into_view_if_needed()
        page.wait_for_function("image => image.complete && image.naturalWidth > 0", arg=picture.element_handle())
        page.screenshot(path=tmp_path / "sessions.png")
        cards.get_by_role("link", name="boxes of").click()
        page.wait_for_url(f"{base}/api/sessions/{sid}/boxes")


def test_without_a_login_the_page_says_how(
    server: tuple[str, str, httpx.Client], browser: Browser, tmp_path: Path
) -> None:
    base, _, client = server
    make_session(client, "secret name")
    with watched(browser, base) as page:
        page.goto(f"{base}/")
        expect(page.get_by_role("heading", name="Log in")).to_be_visible()
        assert "secret name" not in page.content()
        page.screenshot(path=tmp_path / "login.png")
        page.get_by_label("Or enter the token").fill(TOKEN)
        page.get_by_role("button", name="Log in").click()
        expect(page.get_by_role("heading", name="secret name")).to_be_visible()
        page.reload()
        expect(page.get_by_role("heading", name="secret name")).to_be_visible()
        assert page.evaluate("document.cookie") == ""  # HttpOnly


def test_a_wrong_token_is_said_so_beside_the_field(server: tuple[str, str, httpx.Client], browser: Browser) -> None:
    base, _, _ = server
    context = browser.new_context()
    page = context.new_page()
    page.goto(f"{base}/")
    page.get_by_label("Or enter the token").fill("wrong")
    page.get_by_role("button", name="Log in").click()
    expect(page.get_by_role("alert")).to_have_text("this is not the server's token")
    context.close()


def test_no_sessions_yet_teaches_how_to_make_one(
    server: tuple[str, str, httpx.Client], browser: Browser, tmp_path: Path
) -> None:
    base, login, client = server
    with watched(browser, base, color_scheme="dark") as page:
        page.goto(login)
        expect(page.get_by_text("ars-web demo")).to_be_visible()
        page.screenshot(path=tmp_path / "empty.png")
        make_session(client, "made elsewhere")
        page.evaluate("window.dispatchEvent(new Event('focus'))")
        expect(page.get_by_role("heading", name="made elsewhere")).to_be_visible()


def test_a_server_that_is_gone_is_said_so_and_can_be_tried_again(
    served, demo_recording, browser: Browser, tmp_path: Path
) -> None:
    with served(tmp_path / "sessions") as (process, login):
        context = browser.new_context()
        page = context.new_page()
        page.goto(login)
        expect(page.get_by_text("No sessions yet")).to_be_visible()
        process.kill()
        process.wait()
        page.evaluate("window.dispatchEvent(new Event('focus'))")
        expect(page.get_by_role("alert")).to_contain_text("does not answer")
        expect(page.get_by_role("button", name="Try again")).to_be_visible()
        context.close()


def test_script_that_was_slipped_into_the_page_does_not_run(
    server: tuple[str, str, httpx.Client], browser: Browser
) -> None:
    """What the content security policy is for, should a text ever become HTML."""
    login = server[1]
    context = browser.new_context()
    page = context.new_page()
    page.goto(login)
    page.evaluate(
        """() => {
            const image = document.createElement("div");
            image.innerHTML = '<img src="/none" onerror="window.slipped = 1">';
            document.body.append(image);
            const script = document.createElement("script");
            script.textContent = "window.slipped = 2";
            document.body.append(script);
        }"""
    )
    page.wait_for_load_state("networkidle")
    assert page.evaluate("window.slipped") is None
    context.close()
