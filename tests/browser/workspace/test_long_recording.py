"""36,000 frames in the whole workspace: the page opens, the last frame is entered, and a box edited there."""

import cv2
import numpy as np
import pytest
from playwright.sync_api import expect

from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.recordings.recording import Frame, RecordedBox, Recording
from ars_web.sessions.store import SessionStore

FRAMES = 36_000
LAST = FRAMES - 1


@pytest.fixture
def long_session(tmp_path):
    """A camera that winds round a box, looking at it, for 36,000 frames that all show the same small image."""
    image = tmp_path / "image.jpg"
    assert cv2.imwrite(str(image), np.full((240, 320, 3), 128, np.uint8))
    turn = np.linspace(0.0, 40.0, FRAMES)
    centres = np.stack([1.2 * np.cos(turn), 1.2 * np.sin(turn), 0.8 + 0.3 * np.sin(0.37 * turn)], axis=1)
    forward = -centres / np.linalg.norm(centres, axis=1, keepdims=True)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    Ts = rigid_transform.from_rotation(np.stack([right, np.cross(forward, right), forward], axis=-1), centres)
    recording = Recording(
        format="ars",
        source=tmp_path,
        cameras={0: Camera(320, 240, 300.0, 300.0, 159.5, 119.5)},
        frames=tuple(Frame(f"{i:05d}.jpg", image, 0, T) for i, T in enumerate(Ts)),
        class_names=("thing",),
        boxes=(RecordedBox("thing", Box(np.eye(4), np.array([0.2, 0.15, 0.1]))),),
    )
    with SessionStore(tmp_path / "sessions") as store:
        return tmp_path / "sessions", store.create(recording, name="long").id, Ts


def test_the_last_of_36_000_frames_is_entered_and_its_box_edited(open_workspace, long_session) -> None:
    sessions, sid, Ts = long_session
    with open_workspace(sessions) as (_, _, page_of):
        workspace = page_of(sid).open("#frame=0&box=1")
        page = workspace.page
        strip = page.get_by_role("listbox", name="Film strip")
        scrubber = page.get_by_role("slider", name="Frame", exact=True)
        expect(scrubber).to_have_attribute("aria-valuemax", str(LAST))
        page.wait_for_function("() => document.querySelectorAll('.strip img').length > 3")
        points = workspace.scene.evaluate(
            """() => {
                let found = 0;
                window.__viserMutable.nodeRefFromName['/cameras/points'].traverse(
                    (node) => node.isPoints && (found = node.geometry.attributes.position.count));
                return found;
            }"""
        )
        assert points == FRAMES

        page.keyboard.press("Control+End")
        expect(scrubber).to_have_attribute("aria-valuenow", str(LAST))
        last = strip.get_by_role("option", selected=True)
        expect(last).to_have_attribute("aria-label", f"Frame {LAST}")
        expect(last).to_be_in_viewport(ratio=0.95)
        expect(last.locator("img")).to_have_js_property("naturalWidth", 160)
        assert strip.get_by_role("option").count() < 40

        workspace.enter(LAST)
        eye = workspace.scene.evaluate("() => window.__viserMutable.camera.position.toArray()")
        assert np.linalg.norm(eye) == pytest.approx(np.linalg.norm(Ts[LAST, :3, 3]), abs=1e-5)
        expect(page.get_by_text(f"{LAST:05d}.jpg", exact=True)).to_be_visible()

        size = page.get_by_role("spinbutton", name="Size X", exact=True)
        size.fill("185/2")
        size.press("Enter")
        workspace.until(lambda: workspace.revision() == 1)
        assert workspace.box(1)["size"] == pytest.approx([0.0925, 0.15, 0.1], abs=1e-12)
        expect(page.locator(".saved")).to_have_text("Saved, revision 1")
        workspace.until(
            lambda: (
                workspace.scene.evaluate(
                    "() => window.__viserSceneTree.getState()['/boxes/1/at/edges'].message.props.scale"
                )
                == pytest.approx([0.0925, 0.15, 0.1], abs=1e-6)
            )
        )
