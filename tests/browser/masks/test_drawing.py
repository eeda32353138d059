"""Outlines drawn by hand, by keys and by the machine, as the server then has them: in image coordinates."""

import re
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Locator, Page, expect

from ars_web.demo.truth import DemoTruth
from ars_web.geometry.mask_regions import iou, polygons_from_mask, region
from ars_web.geometry.polygon import Polygon
from tests.browser.conftest import Workspace
from tests.browser.masks.conftest import Alone

FRAME = 0
LARGE = {"viewport": {"width": 1440, "height": 900}}

SQUARE = [(100.0, 100.0), (200.0, 104.0), (210.0, 200.0), (96.0, 212.0)]


@dataclass(frozen=True)
class Drawing:
    """One frame, alone in masks mode, with a new object to be outlined in it."""

    workspace: Workspace
    width: int
    height: int

    @property
    def page(self) -> Page:
        return self.workspace.page

    @property
    def canvas(self) -> Locator:
        return self.page.get_by_role("application", name=re.compile(rf"frame {FRAME}\."))

    @property
    def pane(self) -> Locator:
        return self.page.get_by_role("region", name=f"Frame {FRAME}", exact=True)

    @property
    def zoom(self) -> float:
        """Of the whole image."""
        box = self.canvas.bounding_box()
        assert box is not None
        return min(box["width"] / self.width, box["height"] / self.height)

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Where the page shows a place of the image, while it shows the whole."""
        box = self.canvas.bounding_box()
        assert box is not None
        left = box["x"] + (box["width"] - self.zoom * self.width) / 2
        top = box["y"] + (box["height"] - self.zoom * self.height) / 2
        return left + self.zoom * x, top + self.zoom * y

    def click(self, x: float, y: float) -> None:
        self.page.mouse.click(*self.at(x, y))

    def drag(self, *places: tuple[float, float]) -> None:
        self.page.mouse.move(*self.at(*places[0]))
        self.page.mouse.down()
        for place in places[1:]:
            self.page.mouse.move(*self.at(*place), steps=3)
        self.page.mouse.up()

    def saved(self, revision: int) -> list[dict[str, Any]]:
        """The masks, once the page says that a revision is stored."""
        expect(self.page.get_by_text(f"Saved, revision {revision}", exact=True)).to_be_visible()
        return self.workspace.answer("/masks")

    def polygons(self, revision: int) -> list[Polygon]:
        """Of the only mask."""
        (mask,) = self.saved(revision)
        assert mask["frame"] == FRAME
        return [
            Polygon(np.array(one["outer"]), tuple(np.array(hole) for hole in one["holes"])) for one in mask["polygons"]
        ]

    def ring(self, revision: int) -> np.ndarray:
        """The corners of the only polygon, from the one that is nearest to the image's corner on."""
        (polygon,) = self.polygons(revision)
        first = int(np.argmin(polygon.outer.sum(axis=1)))
        return np.roll(polygon.outer, -first, axis=0)

    def area(self, revision: int) -> float:
        return region(self.polygons(revision)).area


@pytest.fixture
def drawing(demo_recording: DemoTruth, boxed_session, open_flatly):
    """The first frame of the small demo, alone, in masks mode."""
    with open_flatly(*boxed_session, **LARGE) as workspace:
        page = workspace.page
        page.get_by_role("tab", name="Masks").click()
        page.get_by_role("button", name="One frame", exact=True).click()
        expect(page.get_by_role("application")).to_have_count(1)
        page.keyboard.press("Control+Home")
        opened = Drawing(workspace, demo_recording.camera.width, demo_recording.camera.height)
        expect(opened.canvas).to_have_attribute("aria-busy", "false")
        yield opened


def test_a_polygon_is_clicked_and_mended(drawing: Drawing) -> None:
    page, near = drawing.page, {"abs": 0.3}
    for corner in SQUARE:
        drawing.click(*corner)
    expect(drawing.pane.get_by_text("4 points", exact=True)).to_be_visible()
    assert drawing.workspace.answer("/masks") == []
    drawing.click(*SQUARE[0])
    assert drawing.ring(1) == pytest.approx(np.array(SQUARE), **near)

    # A corner is dragged; one is put on an edge; it is removed again.
    drawing.drag((210, 200), (250, 240))
    moved = np.array([*SQUARE[:2], (250, 240), SQUARE[3]])
    assert drawing.ring(2) == pytest.approx(moved, **near)
    drawing.click(150, 102)
    assert drawing.ring(3) == pytest.approx(np.insert(moved, 1, (150, 102), axis=0), **near)
    drawing.drag((150, 102), (150, 80))
    assert drawing.ring(4)[:2] == pytest.approx(np.array([SQUARE[0], (150, 80)]), **near)
    page.keyboard.press("Delete")
    assert drawing.ring(5) == pytest.approx(moved, **near)

    # Steps back are the drawing's own, down to nothing, and forth again.
    for revision in (6, 7, 8):
        page.keyboard.press("Control+z")
        drawing.saved(revision)
    assert drawing.ring(8) == pytest.approx(moved, **near)
    page.keyboard.press("Control+z")
    assert drawing.ring(9) == pytest.approx(np.array(SQUARE), **near)
    page.keyboard.press("Control+z")
    assert drawing.saved(10) == []
    page.keyboard.press("Control+Shift+z")
    assert drawing.ring(11) == pytest.approx(np.array(SQUARE), **near)

    # What another person draws takes its place, and cannot be undone here.
    (mask,) = drawing.workspace.answer("/masks")
    other = {"outer": [[20, 20], [60, 20], [60, 60]], "holes": []}
    page.mouse.move(*drawing.at(*SQUARE[2]))
    page.mouse.down()
    page.mouse.move(*drawing.at(220, 220), steps=3)
    path = f"/api/sessions/{drawing.workspace.sid}/masks/{mask['id']}"
    headers = {"If-Match": f'"{mask["revision"]}"'}
    answer = drawing.workspace.client.put(path, json={"polygons": [other]}, headers=headers)
    assert answer.status_code == 200, answer.text
    expect(page.get_by_text(re.compile("3 points"))).to_be_visible()
    expect(drawing.pane.get_by_role("button", name="Undo in this outline")).to_have_count(0)
    page.mouse.move(*drawing.at(230, 230), steps=3)
    page.mouse.up()  # a drag that was under way ends with what it dragged
    page.keyboard.press("v")
    drawing.drag((50, 30), (80, 40))
    assert drawing.ring(13) == pytest.approx(np.array([(50, 30), (90, 30), (90, 70)]), **near)


def test_an_outline_is_taken_back_given_up_and_closed(drawing: Drawing) -> None:
    page, pane = drawing.page, drawing.pane
    for corner in SQUARE:
        drawing.click(*corner)
    page.keyboard.press("Backspace")
    expect(pane.get_by_text("3 points", exact=True)).to_be_visible()
    page.keyboard.press("Control+z")
    expect(pane.get_by_text("2 points", exact=True)).to_be_visible()
    page.keyboard.press("Escape")
    expect(pane.get_by_text("2 points", exact=True)).to_be_hidden()
    page.keyboard.press("Control+z")
    expect(pane.get_by_text("2 points", exact=True)).to_be_visible()
    page.keyboard.press("Enter")
    expect(pane.get_by_role("status")).to_have_text("An outline needs 3 points, this one has 2.")
    drawing.click(*SQUARE[2])
    page.mouse.dblclick(*drawing.at(*SQUARE[3]))
    assert drawing.ring(1) == pytest.approx(np.array(SQUARE), abs=0.3)

    # Magnified about the pointer, and dragged by the space bar: clicks are as exact as the eye.
    page.mouse.move(*drawing.at(300, 200))
    for _ in range(12):
        page.mouse.wheel(0, -100)
    whole = drawing.zoom
    told = re.compile(r"Magnified ([\d.]+) times")
    button = pane.get_by_role("button", name=told)
    expect(button).to_have_text(re.compile(r"^1\dx$"))
    zoom = whole * np.exp(12 * 100 * 0.0018)
    x, y = drawing.at(300, 200)
    page.keyboard.down("Space")
    page.mouse.down()
    page.mouse.move(x + 30, y + 40, steps=3)
    page.mouse.up()
    page.keyboard.up("Space")
    true = [(300.0, 200.0), (310.5, 203.25), (304.0, 209.0)]
    for corner in true:
        page.mouse.click(x + 30 + zoom * (corner[0] - 300), y + 40 + zoom * (corner[1] - 200))
    expect(pane.get_by_text("3 points", exact=True)).to_be_visible()
    page.keyboard.press("Enter")
    small = min(drawing.polygons(2), key=lambda polygon: len(polygon.outer))
    corners = {tuple(corner) for corner in small.outer.round(1).tolist()}
    for corner in true:
        assert min(np.abs(np.subtract(corner, one)).max() for one in corners) < 0.11

    # The photo is shown brighter, and as it is.
    pane.get_by_role("button", name="Brightness and contrast").click()
    page.get_by_role("slider", name="Brightness").fill("1.8")
    picture = drawing.canvas.locator("canvas").first
    expect(picture).to_have_css("filter", "brightness(1.8) contrast(1)")
    page.get_by_role("button", name="As it is").click()
    expect(picture).to_have_css("filter", "none")


def test_shapes_join_and_are_cut_out(drawing: Drawing) -> None:
    page = drawing.page
    page.keyboard.press("t")
    drawing.drag((100, 100), (200, 200))
    assert drawing.area(1) == pytest.approx(100 * 100, rel=0.01)
    drawing.drag((180, 120), (240, 180))
    assert drawing.area(2) == pytest.approx(100 * 100 + 40 * 60, rel=0.01)

    # A hole, with Alt; it is filled again by the brush.
    page.keyboard.down("Alt")
    drawing.drag((120, 120), (140, 160))
    page.keyboard.up("Alt")
    assert drawing.area(3) == pytest.approx(12400 - 20 * 40, rel=0.01)
    assert [len(polygon.holes) for polygon in drawing.polygons(3)] == [1]
    page.keyboard.press("k")
    size = drawing.pane.get_by_role("slider", name="Brush size")
    expect(size).to_have_attribute("aria-valuetext", "24 pixels")
    drawing.drag((130, 118), (130, 162))
    assert drawing.area(4) == pytest.approx(12400, rel=0.01)
    page.keyboard.press("]")
    expect(size).to_have_attribute("aria-valuetext", "27 pixels")
    page.keyboard.press("[")
    expect(size).to_have_attribute("aria-valuetext", "24 pixels")

    # Strokes follow each other faster than the server answers.
    page.keyboard.press("e")
    drawing.drag((90, 150), (250, 150))
    drawing.drag((150, 90), (150, 210))
    cross = 12400 - 24 * 140 - 24 * 100 + 24 * 24
    assert drawing.area(6) == pytest.approx(cross, rel=0.02)
    assert len(drawing.polygons(6)) == 4

    # In the place of it all, freehand.
    page.keyboard.press("d")
    drawing.pane.get_by_role("button", name="New", exact=True).click()
    turns = np.linspace(0, 2 * np.pi, 24)
    drawing.drag(*[(300 + 60 * np.cos(turn), 200 + 60 * np.sin(turn)) for turn in turns])
    assert drawing.area(7) == pytest.approx(np.pi * 60**2, rel=0.02)


def test_all_of_it_can_be_done_by_keys(drawing: Drawing) -> None:
    page, status = drawing.page, drawing.pane.get_by_role("status")
    drawing.canvas.focus()
    middle = (drawing.width / 2, drawing.height / 2)

    def walk(x: int, y: int) -> None:
        for axis, keys in ((x, ("ArrowLeft", "ArrowRight")), (y, ("ArrowUp", "ArrowDown"))):
            for _ in range(abs(axis) // 10):
                page.keyboard.press(f"Shift+{keys[axis > 0]}")
            for _ in range(abs(axis) % 10):
                page.keyboard.press(keys[axis > 0])

    page.keyboard.press("Enter")
    for step in ((40, 0), (0, 43), (-40, 0)):
        walk(*step)
        page.keyboard.press("Enter")
    page.keyboard.press("Enter")
    ring = np.add(middle, [(0, 0), (40, 0), (40, 43), (0, 43)])
    assert drawing.ring(1) == pytest.approx(ring)

    # A corner is chosen, moved, given a neighbour and removed.
    page.keyboard.press("PageDown")
    page.keyboard.press("PageDown")
    expect(status).to_have_text(f"Point 2 of 4, at {middle[0] + 40:.1f}, {middle[1]:.1f}.")
    walk(3, -2)
    ring[1] += (3, -2)
    assert drawing.ring(2) == pytest.approx(ring)
    page.keyboard.press("Insert")
    assert drawing.ring(3) == pytest.approx(np.insert(ring, 2, ring[1:3].mean(axis=0), axis=0))
    page.keyboard.press("Delete")
    assert drawing.ring(4) == pytest.approx(ring)
    page.keyboard.press("Escape")

    page.keyboard.press("t")
    page.keyboard.press("Enter")
    expect(status).to_have_text("First corner. Move on and press Enter for the other.")
    walk(60, 60)
    page.keyboard.press("Enter")
    drawing.saved(5)
    page.keyboard.press("k")
    page.keyboard.press("Enter")
    drawing.saved(6)
    page.keyboard.press("Control+z")
    page.keyboard.press("Control+z")
    assert drawing.ring(8) == pytest.approx(ring)

    # Keys that remove and move are the outline's, even where there is none: a selected box stays as it is.
    boxes = drawing.workspace.answer("/boxes")
    page.evaluate("(id) => import('/static/store.js').then((store) => store.actions.select(id))", boxes[0]["id"])
    expect(page.get_by_role("application", name=f"Outline of {boxes[0]['name']}, frame {FRAME}")).to_be_visible()
    drawing.canvas.focus()
    for key in ("Delete", "Backspace", "PageUp", "PageDown", "ArrowUp", "p", "Delete", "PageUp"):
        page.keyboard.press(key)
    page.keyboard.press("t")
    drawing.drag((100, 100), (150, 150))
    assert len(drawing.saved(9)) == 2
    assert drawing.workspace.answer("/boxes") == boxes


def test_what_the_server_does_not_take_stays_open_with_the_reason(drawing: Drawing) -> None:
    page = drawing.page
    page.keyboard.press("t")
    drawing.drag((100, 100), (200, 200))
    drawing.saved(1)
    page.keyboard.press("p")
    page.route("**/polygons/combine", lambda route: route.abort())
    for corner in ((250, 100), (300, 100), (300, 150)):
        drawing.click(*corner)
    page.keyboard.press("Enter")
    expect(drawing.pane.get_by_role("alert")).to_contain_text("This was not drawn:")
    expect(drawing.pane.get_by_text("3 points", exact=True)).to_be_visible()
    page.unroute("**/polygons/combine")
    page.keyboard.press("Enter")
    assert drawing.area(2) == pytest.approx(100 * 100 + 50 * 50 / 2, rel=0.01)
    expect(drawing.pane.get_by_role("alert")).to_be_hidden()
    drawing.workspace.complaints[:] = [told for told in drawing.workspace.complaints if "ERR_FAILED" not in told]


def test_the_smart_tool_finds_an_object_from_a_rough_box(
    drawing: Drawing, demo_recording: DemoTruth, alone: Alone
) -> None:
    page = drawing.page
    page.keyboard.press("q")
    truth = alone(FRAME, [thing.name for thing in demo_recording.objects].index("tea"))
    rows, columns = np.nonzero(truth)
    box = (columns.min() - 8, rows.min() - 8, columns.max() + 9, rows.max() + 9)
    drawing.drag((box[0], box[1]), (box[2], box[3]))
    found = drawing.polygons(1)
    assert iou(found, polygons_from_mask(truth)) >= 0.85
    (mask,) = drawing.saved(1)
    assert mask["origin"] == "smart"

    # It is kept by Enter, and mended by marks: what is beside it is taken away.
    keep = drawing.pane.get_by_role("button", name="Keep")
    expect(keep).to_be_visible()
    page.keyboard.press("Enter")
    expect(keep).to_be_hidden()
    part = columns < (columns.min() + columns.max()) / 2
    row = float(np.median(rows[part]))
    page.keyboard.down("Shift")
    drawing.drag((columns.min() - 4, row), (columns.min() + 0.4 * np.ptp(columns), row))
    page.keyboard.up("Shift")
    mended = drawing.polygons(2)
    assert region(mended).area < 0.97 * region(found).area
    page.keyboard.press("Control+z")
    assert iou(drawing.polygons(3), found) > 0.999
