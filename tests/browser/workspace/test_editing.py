"""Editing in the workspace as a person does, with the server's state looked at after each step."""

import numpy as np
import pytest
from playwright.sync_api import Route, expect
from scipy.spatial.transform import Rotation

MUG = "mug"


def axes_world(box) -> np.ndarray:
    """(3, 3), the box's axes as columns, in the world."""
    w, x, y, z = box["T_world_box"]["wxyz"]
    return Rotation.from_quat([x, y, z, w]).as_matrix()


@pytest.fixture
def mug(boxed_session, demo_recording):
    """Sessions folder, session, and the mug's id, as the server counts boxes."""
    sessions, sid = boxed_session
    index = next(i for i, thing in enumerate(demo_recording.objects) if thing.class_name == MUG)
    return sessions, sid, index + 1


def test_a_box_is_moved_resized_typed_taken_back_and_made_again(open_workspace, mug):
    sessions, sid, mug_id = mug
    with open_workspace(sessions) as (_, _, page_of):
        workspace = page_of(sid).open("#frame=4")
        page = workspace.page
        page.get_by_role("grid", name="Boxes").get_by_text(MUG, exact=True).click()
        workspace.enter(4)
        before = workspace.box(mug_id)

        # Move it along its own x by the gizmo's arrow.
        page.keyboard.press("g")
        centre = workspace.on_screen("/edit/gizmo")
        toward = workspace.on_screen("/edit/gizmo", 0.05) - centre
        toward /= np.linalg.norm(toward)
        workspace.drag(centre + toward * 70, centre + toward * 130)
        workspace.saved(1)
        moved = workspace.box(mug_id)
        step = np.array(moved["T_world_box"]["position"]) - before["T_world_box"]["position"]
        along = axes_world(before).T @ step
        assert along[0] > 0.002
        assert np.abs(along[1:]).max() < 1e-6
        assert moved["size"] == before["size"]
        assert moved["T_world_box"]["wxyz"] == pytest.approx(before["T_world_box"]["wxyz"], abs=1e-9)

        # Pull its +z face up: the bottom stays where it was.
        page.keyboard.press("s")
        top = workspace.on_screen("/edit/handle/z+")
        bottom = workspace.on_screen("/edit/handle/z-")
        workspace.drag(top, top + (top - bottom) * 0.5)
        workspace.saved(2)
        pulled = workspace.box(mug_id)
        assert pulled["size"][2] > moved["size"][2] + 0.005
        assert pulled["size"][:2] == pytest.approx(moved["size"][:2], abs=1e-12)
        grown = pulled["size"][2] - moved["size"][2]
        lifted = axes_world(moved).T @ (np.array(pulled["T_world_box"]["position"]) - moved["T_world_box"]["position"])
        assert lifted == pytest.approx([0, 0, grown / 2], abs=1e-9)

        # Type a size, by arithmetic.
        size = page.get_by_role("spinbutton", name="Size X")
        size.fill("(10+5)*2")
        size.press("Enter")
        workspace.saved(3)
        assert workspace.box(mug_id)["size"] == pytest.approx([0.03, *pulled["size"][1:]], abs=1e-12)

        # Take all back, one by one, and make it again.
        for revision, expected in ((4, pulled), (5, moved), (6, before)):
            page.keyboard.press("Control+z")
            workspace.saved(revision)
            assert _place(workspace.box(mug_id)) == _place(expected)
        page.keyboard.press("Control+Shift+z")
        workspace.saved(7)
        assert _place(workspace.box(mug_id)) == _place(moved)

        # A reload comes back to the same place, with what is stored.
        page.wait_for_function("location.hash.includes('mode=frame')")
        page.reload()
        workspace.settle()
        page.get_by_text("Saved, revision 7").wait_for()
        assert page.get_by_role("tab", name="Frame").get_attribute("aria-selected") == "true"
        shown = page.get_by_role("spinbutton", name="Position X").input_value()
        assert float(shown) == pytest.approx(moved["T_world_box"]["position"][0] * 1000, abs=0.051)


def test_a_box_is_turned_and_nudged(open_workspace, mug):
    sessions, sid, mug_id = mug
    with open_workspace(sessions) as (_, _, page_of):
        workspace = page_of(sid).open(f"#frame=4&box={mug_id}")
        page = workspace.page
        before = workspace.box(mug_id)

        # At once, however busy the machine is: steps close together are one edit.
        page.evaluate(
            """(steps) => steps.forEach((step) => document.body.dispatchEvent(
                new KeyboardEvent("keydown", {bubbles: true, cancelable: true, ...step})))""",
            [{"key": "ArrowRight"}, {"key": "ArrowRight"}, {"key": "PageUp", "shiftKey": True}],
        )
        workspace.saved(1)
        nudged = workspace.box(mug_id)
        step = axes_world(before).T @ (np.array(nudged["T_world_box"]["position"]) - before["T_world_box"]["position"])
        assert step == pytest.approx([0.002, 0, 0.010], abs=1e-9)

        page.keyboard.press("r")
        page.keyboard.press("Shift+PageUp")
        workspace.saved(2)
        turned = axes_world(nudged).T @ axes_world(workspace.box(mug_id))
        assert np.degrees(Rotation.from_matrix(turned).as_rotvec()) == pytest.approx([0, 0, 2.0], abs=1e-6)

        page.keyboard.press("k")
        workspace.until(lambda: workspace.box(mug_id)["locked"])
        page.keyboard.press("ArrowRight")
        page.get_by_text("is locked").first.wait_for()
        assert workspace.revision() == 3


def test_an_answer_that_comes_late_takes_no_newer_problem_away(open_workspace, mug):
    sessions, sid, mug_id = mug
    with open_workspace(sessions) as (_, _, page_of):
        workspace = page_of(sid).open(f"#frame=4&box={mug_id}")
        page = workspace.page
        late = []

        def keep_back(route: Route) -> None:
            late.append((route, route.fetch()))

        page.route("**/api/**/boxes/*", keep_back)
        page.keyboard.press("k")
        page.get_by_role("button", name="Unlock").first.wait_for()  # told over the live line
        page.keyboard.press("ArrowRight")
        page.get_by_text("is locked").first.wait_for()
        workspace.until(lambda: late)
        for route, response in late:
            route.fulfill(response=response)
        workspace.saved(1)
        page.wait_for_timeout(200)  # what the late answer brings is drawn by then
        expect(page.get_by_text("is locked").first).to_be_visible(timeout=1)


def _place(box) -> tuple:
    return tuple(box["T_world_box"]["position"]), tuple(box["T_world_box"]["wxyz"]), tuple(box["size"])
