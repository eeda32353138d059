"""The right panel of a session's page, by a real server and Chromium; without its 3D scene."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import pytest
from playwright.sync_api import Locator, Page, expect


@dataclass(frozen=True)
class SidePanel:
    """The panel, and the page's server asked directly.

    Attributes:
        complaints: errors and warnings of the page.
    """

    page: Page
    client: httpx.Client
    sid: str
    answer: Callable[[str], Any]
    complaints: list[str]

    def saved(self, revision: int) -> None:
        """Wait until the page says so."""
        expect(self.page.locator(".saved")).to_have_text(f"Saved, revision {revision}")

    def row(self, name: str) -> Locator:
        """A box in the list."""
        rows = self.page.get_by_role("grid", name="Boxes").get_by_role("row")
        return rows.filter(has=self.page.get_by_text(name, exact=True))

    def field(self, name: str) -> Locator:
        """A number of the selected box."""
        return self.page.get_by_role("spinbutton", name=name, exact=True)

    def type_into(self, name: str, text: str) -> None:
        """Type a number of the selected box, and Enter."""
        self.field(name).fill(text)
        self.field(name).press("Enter")

    def in_store(self, what: str) -> Any:
        """What the page knows or shows, by an expression of `store`."""
        return self.page.evaluate(f"async () => {{ const store = await import('/static/store.js'); return {what}; }}")

    def by_another(self, path: str, revision: int, changes: dict[str, Any] | None) -> None:
        """Change something as somebody else; None deletes it."""
        headers = {"If-Match": f'"{revision}"'}
        address = f"/api/sessions/{self.sid}{path}"
        if changes is None:
            assert self.client.delete(address, headers=headers).status_code == 204
        else:
            assert self.client.patch(address, json=changes, headers=headers).status_code == 200

    def expect_refusals(self, *statuses: int) -> None:
        """Take out what Chromium says of requests that were to be refused."""
        expected = [f"the server responded with a status of {status}" for status in statuses]
        self.complaints[:] = [one for one in self.complaints if not any(part in one for part in expected)]


OpenPanel = Callable[[Path, str], AbstractContextManager[SidePanel]]


@pytest.fixture
def open_panel(open_flatly) -> OpenPanel:
    """`with open_panel(sessions, sid) as panel`: a session's page."""

    @contextmanager
    def opened(sessions: Path, sid: str) -> Iterator[SidePanel]:
        with open_flatly(sessions, sid) as workspace:
            yield SidePanel(workspace.page, workspace.client, sid, workspace.answer, workspace.complaints)

    return opened
