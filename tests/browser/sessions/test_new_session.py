"""Sessions made on the sessions page, in a real browser, from a real server process."""

import base64
import os
import re
import shutil
import zipfile
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect


def browse(page: Page) -> None:
    """Open the folders of the declared root."""
    page.get_by_role("button", name="New session").click()
    expect(page.get_by_role("button", name="Open desk")).to_be_visible()


def test_a_folder_is_looked_at_before_it_is_imported(desk) -> None:
    desk.lose_pose(2)
    with desk.watched() as page:
        page.goto(desk.login)
        browse(page)
        expect(page.get_by_role("listitem").filter(has_text="desk")).to_contain_text("ars")
        page.get_by_role("button", name="Choose desk").click()
        dialog = page.get_by_role("dialog", name="New session")
        expect(dialog.get_by_label("Name of the session")).to_have_value("desk")
        expect(dialog.get_by_label("Name of the session")).to_be_focused()
        for what, value in (("Frames", "8"), ("Cameras", "1"), ("Boxes", "0")):
            expect(dialog.locator(".facts div", has_text=what).locator("strong")).to_have_text(value)
        expect(dialog.get_by_role("list", name="Warnings")).to_contain_text("1 of 9 cannot be used")
        expect(dialog.get_by_role("row").nth(1)).to_contain_text("desk/robot_poses.txt:3")
        desk.shows(dialog.get_by_role("list", name="Sample frames").get_by_role("img").first)
        assert desk.sessions() == []
        dialog.get_by_label("Name of the session").fill("<b>my desk</b>")
        dialog.get_by_label("Classes").fill("mug, , box ")
        with page.expect_navigation(url=re.compile(f"{desk.base}/sessions/")):
            dialog.get_by_role("button", name="Import").click()
        (made,) = desk.sessions()
        assert (made["name"], made["frames"], made["skipped"]) == ("<b>my desk</b>", 8, 1)
        classes = desk.client.get(f"/api/sessions/{made['id']}/classes").json()
        assert [one["name"] for one in classes] == ["mug", "box"]
        assert page.url.startswith(f"{desk.base}/sessions/{made['id']}")


def test_a_damaged_file_is_named_with_its_line_and_can_be_mended(desk) -> None:
    poses = desk.recording / "robot_poses.txt"
    sound = poses.read_text()
    lines = sound.splitlines()
    lines[4] += " 1.0"
    poses.write_text("\n".join(lines) + "\n")
    with desk.watched(refused=1) as page:
        page.goto(desk.login)
        browse(page)
        page.get_by_role("button", name="Choose desk").click()
        expect(page.get_by_role("alert")).to_contain_text("desk/robot_poses.txt:5: has 8 values")
        expect(page.get_by_role("button", name="Import")).to_be_disabled()
        poses.write_text(sound)
        page.get_by_role("button", name="Look again").click()
        expect(page.get_by_label("Name of the session")).to_have_value("desk")
        expect(page.get_by_role("alert")).to_have_count(0)
        # Escape goes back one step, and one more.
        page.keyboard.press("Escape")
        expect(page.get_by_role("button", name="Choose desk")).to_be_visible()
        page.keyboard.press("Escape")
        expect(page.get_by_role("dialog")).to_have_count(0)
        assert desk.sessions() == []


def test_an_import_that_fails_says_so_where_it_was_asked_for(desk) -> None:
    with desk.watched() as page:
        page.goto(desk.login)
        browse(page)
        page.get_by_role("button", name="Choose desk").click()
        page.get_by_label("Classes").fill("mug")
        # Damaged between the look and the import.
        poses = desk.recording / "robot_poses.txt"
        poses.write_text(poses.read_text() + "1 2 three\n")
        page.get_by_role("button", name="Import").click()
        expect(page.get_by_role("alert")).to_contain_text("desk/robot_poses.txt:10: ")
        expect(page.get_by_label("Classes")).to_have_value("mug")
        assert desk.sessions() == []


@pytest.fixture
def long_recording(desk) -> Path:
    """One whose import takes some seconds: 30,000 frames, each the same image."""
    recording, long = desk.recording, desk.root / "long"
    (long / "images").mkdir(parents=True)
    for calibration in recording.glob("camera_*.txt"):
        shutil.copy(calibration, long)
    image = next((recording / "images").iterdir())
    for i in range(30_000):
        os.link(image, long / "images" / f"{i:06}{image.suffix}")
    pose = (recording / "robot_poses.txt").read_text().splitlines()[0]
    (long / "robot_poses.txt").write_text(f"{pose}\n" * 30_000)
    return long


def test_an_import_goes_on_while_its_dialog_is_closed_and_can_be_cancelled(desk, long_recording: Path) -> None:
    with desk.watched() as page:
        page.goto(desk.login)
        browse(page)
        page.get_by_role("button", name=f"Choose {long_recording.name}").click()
        page.get_by_role("button", name="Import").click()
        expect(page.get_by_role("progressbar", name="Importing long")).to_be_visible()
        page.keyboard.press("Escape")
        expect(page.get_by_role("dialog")).to_have_count(0)
        strip = page.get_by_role("group", name="New session")
        expect(strip.get_by_role("progressbar", name="Importing long")).to_be_visible()
        strip.get_by_role("button", name="Cancel").click()
        expect(strip).to_have_count(0)
        assert [job["state"] for job in desk.client.get("/api/imports").json()] == ["cancelled"]
        assert desk.sessions() == []


def zipped(recording: Path, file: Path) -> Path:
    with zipfile.ZipFile(file, "w") as archive:
        for path in sorted(recording.rglob("*")):
            archive.write(path, path.relative_to(recording.parent))
    return file


DROP = """([name, data]) => {
    const carried = new DataTransfer();
    const bytes = Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0));
    carried.items.add(new File([bytes], name));
    for (const kind of ["dragenter", "dragover", "drop"]) {
        document.body.dispatchEvent(new DragEvent(kind, { bubbles: true, cancelable: true, dataTransfer: carried }));
    }
}"""


def test_a_zip_that_is_dropped_is_looked_at_and_imported(desk, tmp_path: Path) -> None:
    archive = zipped(desk.recording, tmp_path / "my desk.zip")
    with desk.watched() as page:
        page.goto(desk.login)
        expect(page.get_by_text("No sessions yet")).to_be_visible()
        page.evaluate(DROP, ["photo.jpg", ""])
        expect(page.get_by_role("alert")).to_contain_text("photo.jpg is not a zip")
        page.evaluate(DROP, [archive.name, base64.b64encode(archive.read_bytes()).decode()])
        expect(page.get_by_label("Name of the session")).to_have_value("my desk")
        with page.expect_navigation(url=re.compile(f"{desk.base}/sessions/")):
            page.get_by_role("button", name="Import").click()
        (made,) = desk.sessions()
        assert (made["name"], made["frames"]) == ("my desk", 9)


def test_a_zip_that_is_chosen_and_is_none_says_so(desk, tmp_path: Path) -> None:
    (tmp_path / "broken.zip").write_bytes(b"this is no zip")
    with desk.watched(refused=1) as page:
        page.goto(desk.login)
        page.get_by_label("Zip of a recording").first.set_input_files(tmp_path / "broken.zip")
        expect(page.get_by_role("alert")).to_contain_text("zip")
        expect(page.get_by_role("dialog").get_by_role("button", name="Choose a zip")).to_be_visible()


def test_sending_a_zip_can_be_cancelled(desk, tmp_path: Path) -> None:
    archive = zipped(desk.recording, tmp_path / "desk.zip")
    with desk.watched() as page:
        held: list[object] = []
        page.route("**/api/imports/uploads", lambda route: held.append(route))  # and never goes on
        page.goto(desk.login)
        page.get_by_label("Zip of a recording").first.set_input_files(archive)
        expect(page.get_by_role("progressbar", name="Sending desk.zip")).to_be_visible()
        with page.expect_event("requestfailed"):
            page.get_by_role("button", name="Cancel").click()
        expect(page.get_by_role("progressbar")).to_have_count(0)
        expect(page.get_by_role("dialog").get_by_role("button", name="Choose a zip")).to_be_visible()
        expect(page.get_by_role("alert")).to_have_count(0)
        assert len(held) == 1
