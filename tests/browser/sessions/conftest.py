"""The sessions page in the browser, of a server that knows one folder with one recording."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx
import pytest
from playwright.sync_api import Browser, Locator, Page

TOKEN = "token-of-the-browser-test"


@dataclass(frozen=True)
class Desk:
    """A server, and a browser to look at its page.

    Attributes:
        login: the one-time URL.
        client: asks the server directly.
        root: the declared folder `demo`; in it `desk`, the demo's recording, to be damaged at will.
    """

    base: str
    login: str
    token: str
    client: httpx.Client
    root: Path
    browser: Browser

    @property
    def recording(self) -> Path:
        return self.root / "desk"

    @contextmanager
    def watched(self, *, refused: int = 0, **options: object) -> Iterator[Page]:
        """A page of which nothing leaves the server, and nothing is complained about but `refused` requests."""
        context = self.browser.new_context(**{"viewport": {"width": 1280, "height": 720}, **options})
        page = context.new_page()
        complaints: list[str] = []
        elsewhere: list[str] = []
        page.on("console", lambda told: complaints.append(told.text) if told.type in ("error", "warning") else None)
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("request", lambda asked: None if asked.url.startswith(f"{self.base}/") else elsewhere.append(asked.url))
        yield page
        context.close()
        assert [one for one in complaints if "the server responded with a status of 4" not in one] == []
        assert len(complaints) == refused
        assert elsewhere == []

    def make_session(self, name: str) -> str:
        """The id of a session made of the recording."""
        draft = {"name": name, "root": "demo", "path": "desk", "classes": ["mug"]}
        made = self.client.post("/api/sessions", json=draft)
        assert made.status_code == 201, made.text
        return made.json()["id"]

    def sessions(self) -> list[dict[str, object]]:
        """As the server has them."""
        return self.client.get("/api/sessions").json()

    def lose_pose(self, frame: int) -> None:
        """Make a frame's pose one that nobody knows."""
        poses = (self.recording / "robot_poses.txt").read_text().splitlines()
        poses[frame] = "nan 0 -1 0 0 0 1"
        (self.recording / "robot_poses.txt").write_text("\n".join(poses) + "\n")

    def shows(self, picture: Locator) -> None:
        """Wait until an image is there."""
        picture.scroll_into_view_if_needed()
        picture.page.wait_for_function(
            "image => image.complete && image.naturalWidth > 0", arg=picture.element_handle()
        )


@pytest.fixture
def desk(served, demo_recording, tmp_path: Path, browser: Browser) -> Iterator[Desk]:
    """A server without sessions."""
    root = tmp_path / "recordings"
    shutil.copytree(demo_recording.folder, root / "desk")
    with served(tmp_path / "sessions", "--token", TOKEN, "--root", f"demo={root}") as (_, login):
        base = login.partition("/login")[0]
        headers = {"Authorization": f"Bearer {TOKEN}"}
        with httpx.Client(base_url=base, headers=headers, timeout=60) as client:
            yield Desk(base, login, TOKEN, client, root, browser)
