"""Makes the README's pictures in a real browser: python docs/workspace.py

They are docs/workspace.png, docs/coverage.jpg and docs/export.jpg, of the demo's session, with nothing drawn in
afterwards. Needs what `make test` needs.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import sync_playwright

PICTURE = Path(__file__).with_name("workspace.png")
COVERAGE = Path(__file__).with_name("coverage.jpg")
EXPORT = Path(__file__).with_name("export.jpg")
SIZE = {"width": 1440, "height": 900}
FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


def main() -> None:
    """Serve the demo from a folder that is thrown away, and take the picture."""
    chromium = os.environ.get("ARS_WEB_CHROMIUM") or shutil.which("chromium") or shutil.which("google-chrome")
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "ars_web", "demo", "--sessions", folder, "--no-browser"]
        server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        try:
            login = next(found[0] for line in server.stdout if (found := re.search(r"http://\S+/login\?\S+", line)))
            with sync_playwright() as playwright:
                browser = playwright.chromium.launch(executable_path=chromium, args=FLAGS)
                page = browser.new_page(viewport=SIZE, color_scheme="dark")
                take(page, login)
                take_coverage(page)
                take_export(page)
                browser.close()
        finally:
            server.terminate()
            server.wait()


def take(page, login: str) -> None:
    """Stand at a frame with the mug selected, its face handles shown, and take the picture."""
    page.add_init_script("localStorage.setItem('ars-web.hints-seen', '1')")
    page.goto(login)
    page.locator(".stage .cover").wait_for(state="detached", timeout=120_000)
    page.get_by_role("grid", name="Boxes").get_by_text("mug", exact=True).click()
    page.evaluate("import('/static/store.js').then((store) => store.actions.enterFrame(26))")
    page.wait_for_function("import('/static/store.js').then((store) => store.entered.value === 26)", timeout=60_000)
    page.keyboard.press("s")
    page.wait_for_function(
        "document.querySelectorAll('.telling img').length === 0 || [...document.images].every((i) => i.complete)"
    )
    page.wait_for_timeout(4000)  # thumbnails and the photo, drawn in software
    page.screenshot(path=PICTURE)


def take_coverage(page) -> None:
    """Look at where the mug is seen from, at the frames of one direction, and at the views planned next."""
    page.get_by_role("tab", name="Coverage").click()
    page.get_by_role("grid", name="Views of mug by direction").wait_for(timeout=120_000)
    page.get_by_label("Views at most").fill("6")
    page.get_by_role("button", name="Plan views").click()
    page.locator(".tour-views li").first.wait_for(timeout=120_000)
    page.get_by_role("button", name="Look closer").click()
    page.locator('.bin:not([data-count="0"])').nth(8).click()
    page.locator(".bin-frames [data-frame]").first.wait_for(timeout=120_000)
    page.wait_for_timeout(6000)  # the sphere and the pictures, drawn in software
    page.screenshot(path=COVERAGE, type="jpeg", quality=80)


def take_export(page) -> None:
    """Choose a format in export mode, and take the picture once it is counted and drawn."""
    page.get_by_role("tab", name="Export").click()
    page.get_by_role("radio", name="YOLO, outlines").check()
    page.locator('.format-picture img[data-format="yolo-seg"][data-stale="false"]').wait_for(timeout=120_000)
    page.locator('.figures[data-stale="false"]').wait_for(timeout=120_000)
    page.wait_for_timeout(2000)  # thumbnails
    page.screenshot(path=EXPORT, type="jpeg", quality=80)


if __name__ == "__main__":
    main()
