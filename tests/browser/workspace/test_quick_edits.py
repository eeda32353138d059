"""Edits that come while others are on their way: none is lost, doubled, or put over somebody else's."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from playwright.sync_api import Page, Route, expect


class Held:
    """The page's changes of boxes, held back on their way to the server."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.routes: list[Route] = []
        self._holding = True
        page.route("**/boxes/*", self._hold)

    def _hold(self, route: Route) -> None:
        if self._holding and route.request.method == "PATCH":
            self.routes.append(route)
        else:
            route.continue_()

    def wait(self, count: int) -> None:
        """Until so many are held."""
        for _ in range(1000):
            if len(self.routes) == count:
                return
            self.page.wait_for_timeout(20)
        raise AssertionError(f"{len(self.routes)} changes were sent, not {count}")

    def release(self) -> None:
        """Let the oldest go on."""
        self.routes.pop(0).continue_()

    def release_all(self) -> None:
        """Let the held ones go on, and what comes from now on."""
        self._holding = False
        while self.routes:
            self.release()


@pytest.fixture
def opened(open_flatly, boxed_session):
    """`with opened() as (workspace, box)`: the first box selected, stepped along the world's axes."""

    @contextmanager
    def with_box() -> Iterator[tuple[Any, dict[str, Any]]]:
        with open_flatly(*boxed_session) as workspace:
            box = workspace.answer("/boxes")[0]
            workspace.page.get_by_role("grid", name="Boxes").get_by_text(box["name"], exact=True).click()
            workspace.page.get_by_role("button", name="World axes").click()
            yield workspace, box

    return with_box


def x_of(workspace, box: dict[str, Any]) -> float:
    return workspace.answer(f"/boxes/{box['id']}")["T_world_box"]["position"][0]


def saved(workspace, revision: int) -> None:
    expect(workspace.page.locator(".saved")).to_have_text(f"Saved, revision {revision}")


def in_store(workspace, what: str) -> Any:
    return workspace.page.evaluate(f"async () => {{ const store = await import('/static/store.js'); return {what}; }}")


def test_steps_go_on_from_those_that_are_on_their_way(opened) -> None:
    with opened() as (workspace, box):
        page, before = workspace.page, x_of(workspace, box)
        held = Held(page)
        page.keyboard.press("ArrowRight")
        held.wait(1)
        page.keyboard.press("ArrowRight")
        page.wait_for_function("async () => (await import('/static/store.js')).unsaved.value === 2")
        held.release()
        held.wait(1)
        page.keyboard.press("ArrowRight")
        held.release_all()
        saved(workspace, 3)
        assert x_of(workspace, box) == pytest.approx(before + 0.003, abs=1e-12)
        assert in_store(workspace, "store.typed.value") is None


def test_a_step_back_is_stored_though_the_step_there_is_still_on_its_way(opened) -> None:
    with opened() as (workspace, box):
        page, before = workspace.page, x_of(workspace, box)
        held = Held(page)
        page.keyboard.press("ArrowRight")
        held.wait(1)
        page.keyboard.press("ArrowLeft")
        page.wait_for_function("async () => (await import('/static/store.js')).unsaved.value === 2")
        held.release_all()
        saved(workspace, 2)
        assert x_of(workspace, box) == pytest.approx(before, abs=1e-12)


def test_undo_waits_for_the_edit_that_is_on_its_way_and_takes_that_back(opened) -> None:
    with opened() as (workspace, box):
        page, before = workspace.page, x_of(workspace, box)
        held = Held(page)
        page.keyboard.press("ArrowRight")
        held.wait(1)
        page.keyboard.press("Control+z")
        page.evaluate("() => fetch('/api/health')")  # whatever was sent before is answered, too
        held.release_all()
        saved(workspace, 2)
        assert x_of(workspace, box) == before
        assert [edit["undoes"] for edit in workspace.answer("/history")["items"]] == [1, None]


@contextmanager
def drawn(page: Page) -> Iterator[None]:
    """Draw the size's first number by its letter, and let it go at the end."""
    place = page.get_by_role("group", name="Size, mm").locator(".letter").first.bounding_box()
    assert place is not None
    page.mouse.move(place["x"] + 4, place["y"] + 4)
    page.mouse.down()
    page.mouse.move(place["x"] + 34, place["y"] + 4, steps=5)
    yield
    page.mouse.up()


def test_what_is_stepped_does_not_go_over_what_somebody_else_did_meanwhile(opened) -> None:
    with opened() as (workspace, box):
        page, path = workspace.page, f"/api/sessions/{workspace.sid}/boxes/{box['id']}"
        with drawn(page):
            theirs = workspace.client.patch(path, json={"size": [0.5, 0.5, 0.5]}, headers={"If-Match": '"0"'})
            assert theirs.status_code == 200
            page.wait_for_function("async () => (await import('/static/store.js')).revision.value === 1")
        card = page.get_by_role("region", name="Conflict", exact=True)
        expect(card).to_be_visible()
        assert workspace.answer(f"/boxes/{box['id']}")["size"] == [0.5, 0.5, 0.5]
        card.get_by_role("button", name="Use mine").click()
        saved(workspace, 2)
        assert workspace.answer(f"/boxes/{box['id']}")["size"] == pytest.approx(
            [box["size"][0] + 0.010, *box["size"][1:]], abs=1e-9
        )
        workspace.complaints[:] = [one for one in workspace.complaints if "status of 412" not in one]


def test_what_is_stepped_of_a_box_that_is_deleted_meanwhile_is_shown_and_not_drawn_any_more(opened) -> None:
    with opened() as (workspace, box):
        page, path = workspace.page, f"/api/sessions/{workspace.sid}/boxes/{box['id']}"
        with drawn(page):
            assert workspace.client.delete(path, headers={"If-Match": '"0"'}).status_code == 204
            page.wait_for_function("async () => (await import('/static/store.js')).revision.value === 1")
        expect(page.get_by_role("region", name="Conflict", exact=True)).to_contain_text("deleted")
        assert in_store(workspace, "store.typed.value") is None
        assert workspace.client.post(f"/api/sessions/{workspace.sid}/undo").status_code == 200
        saved(workspace, 2)
        shown = in_store(workspace, f"store.shownBoxes.value.get({box['id']})")
        assert shown["size"] == pytest.approx(box["size"], abs=1e-12)
        workspace.complaints[:] = [one for one in workspace.complaints if "status of 412" not in one]


def test_a_page_that_is_closed_while_a_step_is_held_back_stores_it(opened) -> None:
    with opened() as (workspace, box):
        page, before = workspace.page, x_of(workspace, box)
        page.on("dialog", lambda dialog: dialog.accept())
        page.keyboard.press("ArrowRight")
        page.goto(f"{workspace.client.base_url}/api/health")
        for _ in range(500):
            if x_of(workspace, box) != before:
                break
            page.wait_for_timeout(20)
        assert x_of(workspace, box) == pytest.approx(before + 0.001, abs=1e-12)
