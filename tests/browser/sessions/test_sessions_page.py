"""The sessions page in a real browser, from a real server process."""

from pathlib import Path

from playwright.sync_api import Browser, expect


def test_the_one_time_url_leads_to_the_sessions(desk, tmp_path: Path) -> None:
    name = '<img src=x onerror="alert(1)"> & demo'
    sid = desk.make_session(name)
    place = {"position": [0, 0, 0], "wxyz": [1, 0, 0, 0]}
    desk.client.post(f"/api/sessions/{sid}/boxes", json={"class_id": 0, "T_world_box": place, "size": [0.1, 0.1, 0.1]})
    with desk.watched() as page:
        page.goto(desk.login)
        assert page.url == f"{desk.base}/"  # the code is gone from the address, and with it from the history
        cards = page.get_by_role("article")
        expect(cards).to_have_count(1)
        expect(cards.get_by_role("heading")).to_have_text(name)  # as text, not as HTML
        for what, value in (("frames", "9"), ("boxes", "1"), ("classes", "1")):
            expect(cards.locator(".counts div", has_text=what).locator("dd")).to_have_text(value)
        expect(cards).to_contain_text("Changed just now")
        expect(cards).to_contain_text("revision 1")
        expect(cards.get_by_text("skipped")).to_have_count(0)
        desk.shows(cards.get_by_role("img", name="Frame 4 of"))
        page.screenshot(path=tmp_path / "sessions.png")
        cards.get_by_role("link", name=name).click()
        page.wait_for_url(f"{desk.base}/sessions/{sid}*")


def test_without_a_login_the_page_says_how(desk, tmp_path: Path) -> None:
    desk.make_session("secret name")
    with desk.watched() as page:
        page.goto(f"{desk.base}/")
        expect(page.get_by_role("heading", name="Log in")).to_be_visible()
        assert "secret name" not in page.content()
        page.screenshot(path=tmp_path / "login.png")
        page.get_by_label("Or enter the token").fill(desk.token)
        page.get_by_role("button", name="Log in").click()
        expect(page.get_by_role("heading", name="secret name")).to_be_visible()
        page.reload()
        expect(page.get_by_role("heading", name="secret name")).to_be_visible()
        assert page.evaluate("document.cookie") == ""  # HttpOnly


def test_a_wrong_token_is_said_so_beside_the_field(desk) -> None:
    context = desk.browser.new_context()
    page = context.new_page()
    page.goto(f"{desk.base}/")
    page.get_by_label("Or enter the token").fill("wrong")
    page.get_by_role("button", name="Log in").click()
    expect(page.get_by_role("alert")).to_have_text("this is not the server's token")
    context.close()


def test_no_sessions_yet_teaches_how_to_make_one(desk, tmp_path: Path) -> None:
    with desk.watched(color_scheme="dark") as page:
        page.goto(desk.login)
        for way in ("make demo", "ars-web demo"):
            expect(page.get_by_text(way, exact=True)).to_be_visible()
        expect(page.get_by_role("button", name="Choose a zip")).to_be_visible()
        expect(page.get_by_role("button", name="Browse folders")).to_be_visible()
        page.screenshot(path=tmp_path / "empty.png")
        desk.make_session("made elsewhere")
        page.evaluate("window.dispatchEvent(new Event('focus'))")
        expect(page.get_by_role("heading", name="made elsewhere")).to_be_visible()


def test_a_server_that_is_gone_is_said_so_and_can_be_tried_again(served, browser: Browser, tmp_path: Path) -> None:
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


def test_without_a_root_one_is_told_how_to_declare_one(served, browser: Browser, tmp_path: Path) -> None:
    with served(tmp_path / "sessions") as (_, login), browser.new_context() as context:
        page = context.new_page()
        page.goto(login)
        expect(page.get_by_text("ars-web serve --root NAME=PATH")).to_be_visible()
        page.get_by_role("button", name="New session").click()
        dialog = page.get_by_role("dialog", name="New session")
        expect(dialog.get_by_text("ars-web serve --root NAME=PATH")).to_be_visible()


def test_a_session_is_renamed_in_its_place(desk) -> None:
    sid = desk.make_session("desk")
    with desk.watched() as page:
        page.goto(desk.login)
        menu = page.get_by_role("button", name="What can be done with desk")
        menu.click()
        page.get_by_role("menuitem", name="Rename").click()
        field = page.get_by_label("New name of desk")
        expect(field).to_be_focused()
        page.keyboard.type("never this")
        page.keyboard.press("Escape")
        expect(page.get_by_role("heading", name="desk")).to_be_visible()
        assert desk.client.get(f"/api/sessions/{sid}").json()["name"] == "desk"
        menu.click()
        page.keyboard.press("Enter")  # on the first item
        expect(field).to_be_focused()
        page.keyboard.type("desk, second try")
        page.keyboard.press("Enter")
        expect(page.get_by_role("heading", name="desk, second try")).to_be_visible()
        assert desk.client.get(f"/api/sessions/{sid}").json()["name"] == "desk, second try"


def test_a_change_that_met_another_is_said_at_its_card(desk) -> None:
    sid = desk.make_session("desk")
    with desk.watched(refused=1) as page:
        page.goto(desk.login)
        page.get_by_role("button", name="What can be done with desk").click()
        renamed = desk.client.patch(f"/api/sessions/{sid}", json={"name": "theirs"}, headers={"If-Match": '"0"'})
        assert renamed.status_code == 200, renamed.text
        page.get_by_role("menuitem", name="Delete").click()
        card = page.get_by_role("article", name="theirs")
        expect(card.get_by_role("alert")).to_contain_text("changed elsewhere")
        assert desk.client.get(f"/api/sessions/{sid}").status_code == 200


def test_what_was_deleted_stays_in_sight_until_it_is_dismissed(desk) -> None:
    first, second = (desk.make_session(name) for name in ("first", "second"))
    with desk.watched() as page:
        page.goto(desk.login)
        expect(page.get_by_role("article")).to_have_count(2)

        def delete() -> None:
            page.get_by_role("button", name="What can be done with second").click()
            page.get_by_role("menuitem", name="Delete").click()
            expect(page.get_by_text("Deleted second.")).to_be_visible()
            assert [one["id"] for one in desk.sessions()] == [first]

        delete()
        page.evaluate("window.dispatchEvent(new Event('focus'))")
        expect(page.get_by_role("article").first).to_contain_text("Deleted second")  # in its place
        expect(page.get_by_role("button", name="Undo")).to_be_focused()
        page.keyboard.press("Enter")
        expect(page.get_by_role("link", name="second")).to_be_visible()
        assert {one["id"] for one in desk.sessions()} == {first, second}
        delete()
        page.get_by_role("button", name="Dismiss").click()
        expect(page.get_by_role("article")).to_have_count(1)
        assert [one["id"] for one in desk.sessions()] == [first]


def test_among_many_one_is_found_by_its_name(desk) -> None:
    for i in range(9):
        desk.make_session(f"take {i}")
    with desk.watched() as page:
        page.goto(desk.login)
        headings = page.get_by_role("article").get_by_role("heading")
        expect(headings).to_have_text([f"take {i}" for i in reversed(range(9))])  # the last changed first
        page.get_by_label("Find a session").fill("TAKE 3")
        expect(headings).to_have_text(["take 3"])
        page.get_by_label("Find a session").fill("mug")
        expect(page.get_by_text("No session has “mug” in its name.")).to_be_visible()
        page.get_by_role("button", name="Show all").click()
        expect(headings).to_have_count(9)


def test_skipped_frames_are_told_with_reason_and_place(desk) -> None:
    desk.lose_pose(2)
    desk.make_session("desk")
    with desk.watched() as page:
        page.goto(desk.login)
        page.get_by_role("button", name="1 frame skipped").click()
        row = page.get_by_role("dialog", name="Skipped frames of desk").get_by_role("row").nth(1)
        expect(row).to_contain_text("not finite")
        expect(row).to_contain_text("robot_poses.txt:3")
        page.keyboard.press("Escape")
        expect(page.get_by_role("dialog")).to_have_count(0)


def test_script_that_was_slipped_into_the_page_does_not_run(desk) -> None:
    """What the content security policy is for, should a text ever become HTML."""
    context = desk.browser.new_context()
    page = context.new_page()
    page.goto(desk.login)
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
