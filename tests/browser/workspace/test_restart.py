"""A server that dies or sleeps while a page is open: the page says so, keeps what is typed, and comes back."""

import signal
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from playwright.sync_api import Page, Route, expect
from scipy.spatial.transform import Rotation

from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.store import SessionStore
from tests.browser.conftest import TOKEN

CAMERA = "() => window.__viserMutable.camera.position.toArray()"


@pytest.fixture
def boxed_session(demo_in, tmp_path: Path) -> tuple[Path, str]:
    """The small demo's session in a folder of its own: its servers are killed."""
    return demo_in(tmp_path / "sessions")


@pytest.fixture
def port() -> int:
    """A free one, to come back to."""
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


@pytest.fixture
def same_again(served, port: int) -> Callable[..., Any]:
    """`with same_again(sessions):` another server on the port and the folder of the first, with its token, which the
    cookie outlives the server with."""
    return lambda sessions: served(sessions, "--token", TOKEN, "--port", str(port))


def typed(page: Page, name: str, text: str) -> None:
    field = page.get_by_role("spinbutton", name=name, exact=True)
    field.fill(text)
    field.press("Enter")


def drawn_at(workspace, box_id: int) -> bool:
    """Whether the scene draws the box where the server has it."""
    node = workspace.scene.evaluate(
        "(name) => window.__viserMutable.nodeRefFromName[name]?.position.toArray()", f"/boxes/{box_id}/at"
    )
    return node == pytest.approx(workspace.box(box_id)["T_world_box"]["position"], abs=1e-6)


def edits(workspace) -> list[str]:
    """What was done in the session, the newest first."""
    answer = workspace.client.get(f"/api/sessions/{workspace.sid}/history")
    return [edit["summary"] for edit in answer.json()["items"]]


def test_a_killed_server_comes_back_to_a_page_that_kept_what_was_typed(
    open_workspace, same_again, port: int, mug
) -> None:
    sessions, sid, mug_id = mug
    with open_workspace(sessions, "--port", str(port)) as (process, _, page_of):
        workspace = page_of(sid).open(f"#frame=4&box={mug_id}")
        page, saved = workspace.page, workspace.page.locator(".saved")
        workspace.enter(4)
        page.get_by_role("spinbutton", name="Position X", exact=True).focus()
        standing = workspace.scene.evaluate(CAMERA)
        process.kill()
        assert process.wait() == -signal.SIGKILL
        expect(saved).to_have_text("Reconnecting")
        typed(page, "Position X", "12.5")
        expect(saved).to_have_text("Not saved yet: reconnecting")
        assert page.get_by_role("spinbutton", name="Position X", exact=True).input_value() == "12.5"
        with same_again(sessions):
            expect(saved).to_have_text("Saved, revision 1", timeout=60_000)
            assert workspace.box(mug_id)["T_world_box"]["position"][0] == pytest.approx(0.0125, abs=1e-12)
            assert len(edits(workspace)) == 1

            # The scene is there again too, at the same frame, and can be edited.
            workspace.until(lambda: drawn_at(workspace, mug_id))
            workspace.scene.wait_for_function("() => window.__viserMutable.nodeRefFromName['/photo']?.visible")
            workspace.until(lambda: workspace.scene.evaluate(CAMERA) == pytest.approx(standing, abs=1e-6))
            workspace.settle()
            page.keyboard.press("Escape")
            page.keyboard.press("g")
            centre = workspace.on_screen("/edit/gizmo")
            along = workspace.on_screen("/edit/gizmo", 0.05) - centre
            along /= np.linalg.norm(along)
            workspace.drag(centre + along * 70, centre + along * 110)
            workspace.until(lambda: workspace.revision() == 2)
            workspace.until(lambda: drawn_at(workspace, mug_id))
            assert len(edits(workspace)) == 2


def test_what_somebody_else_did_meanwhile_is_not_overwritten(open_workspace, same_again, port: int, mug) -> None:
    sessions, sid, mug_id = mug
    with open_workspace(sessions, "--port", str(port)) as (process, _, page_of):
        workspace = page_of(sid).open(f"#frame=4&box={mug_id}")
        process.kill()
        process.wait()
        expect(workspace.page.locator(".saved")).to_have_text("Reconnecting")
        typed(workspace.page, "Position X", "12.5")
        with SessionStore(sessions) as store:
            changed = SessionEditor(store).change_box(
                sid, mug_id, expected_revision=0, size=np.array([0.1, 0.2, 0.3]), author="cli"
            )
        with same_again(sessions):
            card = workspace.page.get_by_role("region", name="Conflict", exact=True)
            expect(card).to_be_visible(timeout=60_000)
            assert workspace.box(mug_id)["T_world_box"]["position"] == changed.box.T_world_box[:3, 3].tolist()
            card.get_by_role("button", name="Use mine").click()
            workspace.until(lambda: workspace.revision() == 2)
            assert workspace.box(mug_id)["T_world_box"]["position"][0] == pytest.approx(0.0125, abs=1e-12)


def test_an_edit_whose_answer_was_lost_is_stored_once(open_workspace, mug) -> None:
    sessions, sid, mug_id = mug
    with open_workspace(sessions) as (_, _, page_of):
        workspace = page_of(sid).open(f"#frame=4&box={mug_id}")
        page, lost = workspace.page, []

        def lose(route: Route) -> None:
            if route.request.method == "PATCH" and not lost:
                lost.append(route.fetch().status)
                route.abort("connectionreset")
            else:
                route.continue_()

        page.route("**/boxes/*", lose)
        typed(page, "Rotation yaw", "33.3")
        workspace.until(lambda: lost == [200])
        expect(page.locator(".saved")).to_have_text("Saved, revision 1")
        expect(page.get_by_role("region", name="Conflict", exact=True)).to_have_count(0)
        w, x, y, z = workspace.box(mug_id)["T_world_box"]["wxyz"]
        assert Rotation.from_quat([x, y, z, w]).as_euler("ZYX", degrees=True)[0] == pytest.approx(33.3, abs=1e-6)
        page.unroute("**/boxes/*")
        typed(page, "Size Z", "91")
        workspace.until(lambda: workspace.revision() == 2)
        assert len(edits(workspace)) == 2


def test_a_page_without_network_comes_back_with_it(open_workspace, mug) -> None:
    sessions, sid, mug_id = mug
    with open_workspace(sessions) as (_, _, page_of):
        workspace = page_of(sid).open(f"#frame=4&box={mug_id}")
        page, saved = workspace.page, workspace.page.locator(".saved")
        page.context.set_offline(True)
        typed(page, "Position X", "12.5")
        expect(saved).to_have_attribute("data-state", "saving")
        workspace.client.patch(
            f"/api/sessions/{sid}/boxes/{mug_id - 1}", json={"name": "seen later"}, headers={"If-Match": '"0"'}
        )
        page.context.set_offline(False)
        expect(saved).to_have_text("Saved, revision 2", timeout=60_000)
        expect(page.get_by_role("grid", name="Boxes").get_by_text("seen later", exact=True)).to_be_visible()
        assert workspace.box(mug_id)["T_world_box"]["position"][0] == pytest.approx(0.0125, abs=1e-12)
        assert len(edits(workspace)) == 2


def test_a_line_that_went_silent_is_given_up_and_made_anew(served, browser, mug) -> None:
    """As after a laptop's sleep: nobody closed the connection, time has gone on, and the other end is not there."""
    sessions, sid, mug_id = mug
    with served(sessions, "--token", TOKEN) as (process, login), browser.new_context() as context:
        base = login.partition("/login")[0]
        context.route("**/scene/**", lambda route: route.fulfill(body="", content_type="text/html"))
        assert context.request.post(f"{base}/login", data={"token": TOKEN}).ok
        page = context.new_page()
        page.clock.install()
        page.goto(f"{base}/sessions/{sid}#box={mug_id}")
        saved = page.locator(".saved")
        expect(saved).to_have_text("Saved, revision 0")
        process.send_signal(signal.SIGSTOP)
        try:
            typed(page, "Position X", "12.5")
            expect(saved).to_have_text("Saving")
            page.clock.fast_forward(60_000)
            expect(saved).to_have_text("Not saved yet: reconnecting")
        finally:
            process.send_signal(signal.SIGCONT)
        expect(saved).to_have_text("Saved, revision 1", timeout=60_000)
        headers = {"Authorization": f"Bearer {TOKEN}", "If-Match": '"1"'}
        with httpx.Client(base_url=f"{base}/api/sessions/{sid}", headers=headers, timeout=60) as client:
            history = client.get("/history").json()["items"]
            assert [edit["revision"] for edit in history] == [1]
            # The new line brings what others do.
            assert client.patch(f"/boxes/{mug_id}", json={"name": "after the sleep"}).status_code == 200
            expect(saved).to_have_text("Saved, revision 2")
            box = client.get(f"/boxes/{mug_id}").json()
            assert box["T_world_box"]["position"][0] == pytest.approx(0.0125, abs=1e-12)
