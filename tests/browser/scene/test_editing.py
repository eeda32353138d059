"""Boxes dragged by a real mouse: by the gizmo, and by the handles on their faces."""

import math
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import viser

from ars_web.errors import Conflict
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.scene.box_editor import BoxEditor
from ars_web.scene.boxes import BoxNodes
from ars_web.scene.gizmo import PIXELS
from ars_web.sessions.model import ObjectClass, SessionState, VirtualBox
from ars_web.workspace import Conflicted, Dragged, ViewEvent, ViewState

EYE, TARGET = np.array([0.55, -0.75, 0.6]), np.array([0.0, 0.0, 0.1])


def a_state() -> SessionState:
    R = rigid_transform.rotation_about_z(0.4)
    box = Box(rigid_transform.from_rotation(R, np.array([0.02, 0.03, 0.1])), np.array([0.085, 0.12, 0.2]))
    stored = VirtualBox(1, 0, "mug", box, revision=1)
    return SessionState(1, "s", {0: ObjectClass(0, "mug", "#56b4e9", 1)}, {1: stored}, 1, 2)


class Table:
    """A session of one box, kept in memory, on a viser server."""

    def __init__(self, server: viser.ViserServer, workers: ThreadPoolExecutor) -> None:
        self.nodes = BoxNodes(server)
        self.state = a_state()
        self.nodes.show(self.state)
        self.told: list[ViewEvent] = []
        self.commits: list[int] = []
        self._workers = workers

    @property
    def box(self) -> Box:
        return self.state.boxes[1].box

    def commit(self, box_id: int, revision: int, T: np.ndarray, size: np.ndarray) -> VirtualBox:
        self.commits.append(revision)
        now = self.state.boxes[box_id]
        if now.revision != revision:
            raise Conflict("changed meanwhile", current=now)
        self.change(Box(T, size))
        return self.state.boxes[box_id]

    def change(self, box: Box, **more: Any) -> None:
        revision = self.state.revision + 1
        changed = replace(self.state.boxes[1], box=box, revision=revision, **more)
        self.state = replace(self.state, revision=revision, boxes={1: changed})
        self.nodes.show(self.state)

    def edited_by(self, page: Any, view: str = "a") -> BoxEditor:
        return BoxEditor(
            page.client, self.nodes, by=view, commit=self.commit, workers=self._workers, tell=self.told.append
        )

    def phases(self) -> list[str]:
        return [event.phase for event in self.told if isinstance(event, Dragged)]


@pytest.fixture
def table(viser_server: viser.ViserServer) -> Iterator[Table]:
    with ThreadPoolExecutor(2) as workers:
        yield Table(viser_server, workers)


def gizmo_length(page: Any, centre: np.ndarray) -> float:
    """Of an arrow, metres: it has PIXELS on the screen at its depth."""
    fov, height = page.scene.evaluate("() => [__viserMutable.camera.fov, __viserMutable.canvas.clientHeight]")
    forward = (TARGET - EYE) / np.linalg.norm(TARGET - EYE)
    return float(PIXELS * (centre - EYE) @ forward * 2 * math.tan(math.radians(fov) / 2) / height)


def show(page: Any, editor: BoxEditor, until: Callable[..., None], node: str, **state: Any) -> None:
    editor.show(ViewState(selected=1, **state))
    until(lambda: page.node(node, "visible"), page=page.page)
    page.settle()


def test_an_arrow_moves_the_box_along_its_axis_by_whole_snaps(
    scene_page: Callable[..., Any], table: Table, until: Callable[..., None]
) -> None:
    page = scene_page()
    page.look(EYE, TARGET)
    editor = table.edited_by(page)
    before = table.box
    show(page, editor, until, "/edit/gizmo", tool="move", axes="box", snap_length=0.005)
    centre, axis = before.T_world_box[:3, 3], before.T_world_box[:3, 0]
    grip = 0.7 * gizmo_length(page, centre)
    page.drag(page.screen_of(centre + axis * grip), page.screen_of(centre + axis * (grip + 0.1)))
    until(lambda: table.phases().count("move") >= 3, page=page.page)
    assert table.commits == []
    page.page.mouse.up()
    until(lambda: table.phases()[-1:] == ["end"], page=page.page)
    assert table.commits == [1]
    along = before.T_world_box[:3, :3].T @ (table.box.T_world_box[:3, 3] - centre)
    assert along[0] == pytest.approx(0.1, abs=0.006)
    assert abs(along[0] - round(along[0] / 0.005) * 0.005) < 1e-12
    assert np.abs(along[1:]).max() < 1e-12
    assert np.array_equal(table.box.T_world_box[:3, :3], before.T_world_box[:3, :3])
    # The gizmo is where the box is now, and a second drag back brings the first place back.
    now = table.box.T_world_box[:3, 3]
    until(lambda: np.allclose(page.pose("/edit/gizmo")[0], now, atol=1e-9), page=page.page)
    page.settle()
    page.drag(page.screen_of(now + axis * grip), page.screen_of(now + axis * (grip - along[0])))
    page.page.mouse.up()
    until(lambda: table.phases().count("end") == 2, page=page.page)
    assert np.abs(table.box.T_world_box - before.T_world_box).max() < 1e-9


def test_a_ring_turns_an_upright_box_about_the_vertical(
    scene_page: Callable[..., Any], table: Table, until: Callable[..., None]
) -> None:
    page = scene_page()
    page.look(EYE, TARGET)
    editor = table.edited_by(page)
    before = table.box
    show(page, editor, until, "/edit/gizmo", tool="rotate", snap_angle=math.radians(5), upright=True)
    centre = before.T_world_box[:3, 3]
    radius = 0.65 * gizmo_length(page, centre)

    def on_ring(degrees: float) -> tuple[float, float]:
        angle = math.radians(degrees)
        return page.screen_of(centre + radius * np.array([math.cos(angle), math.sin(angle), 0.0]))

    page.drag(on_ring(45), on_ring(75))
    page.page.mouse.up()
    until(lambda: table.phases()[-1:] == ["end"], page=page.page)
    turned = table.box.T_world_box[:3, :3] @ before.T_world_box[:3, :3].T
    angle = math.degrees(math.atan2(turned[1, 0], turned[0, 0]))
    assert angle == pytest.approx(30, abs=5.1)
    assert abs(angle - round(angle / 5) * 5) < 1e-9
    assert np.abs(table.box.T_world_box[2, :3] - [0, 0, 1]).max() < 1e-15
    assert np.array_equal(table.box.T_world_box[:3, 3], centre)


def test_a_handle_resizes_to_whole_snaps_and_keeps_the_opposite_face(
    scene_page: Callable[..., Any], table: Table, until: Callable[..., None]
) -> None:
    """One handle is at the back, behind the box and under its lines: it can be taken all the same."""
    page = scene_page()
    page.look(EYE, TARGET)
    editor = table.edited_by(page)
    show(page, editor, until, "/edit/handle/x+", tool="resize", snap_length=0.005)
    for ended, (axis, side) in enumerate([(0, -1), (2, 1), (1, 1)], start=1):
        before = table.box
        normal = before.T_world_box[:3, axis] * side
        face = before.T_world_box[:3, 3] + normal * before.size[axis] / 2
        page.drag(page.screen_of(face), page.screen_of(face + normal * 0.06))
        page.page.mouse.up()
        until(lambda ended=ended: table.phases().count("end") == ended, page=page.page)
        size = table.box.size
        assert size[axis] == pytest.approx(before.size[axis] + 0.06, abs=0.006)
        assert abs(size[axis] / 0.005 - round(size[axis] / 0.005)) < 1e-9
        opposite = [box.T_world_box[:3, 3] - normal * box.size[axis] / 2 for box in (before, table.box)]
        assert np.abs(opposite[0] - opposite[1]).max() < 1e-12
        assert table.told[-1].text == f"Size {'XYZ'[axis]} {size[axis] * 1e3:.1f} mm"
        page.settle()


def test_dots_are_on_the_faces_and_as_large_on_the_screen_from_near_and_far(
    scene_page: Callable[..., Any], table: Table, until: Callable[..., None]
) -> None:
    page = scene_page()
    editor = table.edited_by(page)
    for distance in (0.5, 3.0):
        page.look(TARGET + (EYE - TARGET) * distance, TARGET)
        show(page, editor, until, "/edit/handle/x+", tool="resize")
        dot = page.scene.locator(".ars-dot:not([hidden])")
        until(lambda dot=dot: dot.count() == 6, page=page.page)
        box = table.box
        wanted = [
            page.screen_of(box.T_world_box[:3, 3] + box.T_world_box[:3, axis] * side * box.size[axis] / 2)
            for axis in range(3)
            for side in (1, -1)
        ]
        bounds = [dot.nth(i).bounding_box() for i in range(6)]
        found = np.array([[b["x"] + b["width"] / 2, b["y"] + b["height"] / 2] for b in bounds])
        for place in wanted:
            assert np.linalg.norm(found - place, axis=1).min() < 1.0
        assert {(b["width"], b["height"]) for b in bounds} == {(13, 13)}
    editor.show(ViewState(selected=None, tool="resize"))
    until(lambda: page.scene.locator(".ars-dot:not([hidden])").count() == 0, page=page.page)


def test_dots_go_with_their_handles(scene_page: Callable[..., Any], table: Table, until: Callable[..., None]) -> None:
    page = scene_page()
    editor = table.edited_by(page)
    dot = page.scene.locator(".ars-dot:not([hidden])")
    show(page, editor, until, "/edit/handle/x+", tool="resize")
    until(lambda: dot.count() == 6, page=page.page)
    page.client.scene.reset()  # as viser's client does where its server went away
    until(lambda: dot.count() == 0, page=page.page)


def test_a_second_browser_sees_the_drag_while_it_lasts(
    scene_page: Callable[..., Any], table: Table, until: Callable[..., None]
) -> None:
    watching = scene_page(400, 300)
    page = scene_page()
    page.look(EYE, TARGET)
    editor = table.edited_by(page)
    centre, axis = table.box.T_world_box[:3, 3], np.array([0.0, 0.0, 1.0])
    show(page, editor, until, "/edit/gizmo", tool="move", axes="world")
    grip = 0.7 * gizmo_length(page, centre)
    page.drag(page.screen_of(centre + axis * grip), page.screen_of(centre + axis * (grip + 0.08)))
    until(lambda: watching.pose("/boxes/1/at")[0][2] > centre[2] + 0.06, page=watching.page)
    assert table.commits == []
    page.page.mouse.up()
    until(lambda: table.phases()[-1:] == ["end"], page=page.page)


def test_a_conflict_shows_the_stored_box_again(
    scene_page: Callable[..., Any], table: Table, until: Callable[..., None]
) -> None:
    page = scene_page()
    page.look(EYE, TARGET)
    editor = table.edited_by(page)
    centre, axis = table.box.T_world_box[:3, 3], np.array([0.0, 0.0, 1.0])
    show(page, editor, until, "/edit/gizmo", tool="move", axes="world")
    grip = 0.7 * gizmo_length(page, centre)
    page.drag(page.screen_of(centre + axis * grip), page.screen_of(centre + axis * (grip + 0.08)))
    until(lambda: "move" in table.phases(), page=page.page)
    theirs = table.box.T_world_box.copy()
    theirs[0, 3] += 0.3
    table.change(Box(theirs, table.box.size))
    page.page.mouse.up()
    until(lambda: any(isinstance(event, Conflicted) for event in table.told), page=page.page)
    for node in ("/boxes/1/at", "/edit/gizmo"):
        until(lambda node=node: np.allclose(page.pose(node)[0], theirs[:3, 3], atol=1e-9), page=page.page)


def test_a_locked_box_cannot_be_taken(scene_page: Callable[..., Any], table: Table, until: Callable[..., None]) -> None:
    page = scene_page()
    page.look(EYE, TARGET)
    editor = table.edited_by(page)
    show(page, editor, until, "/edit/handle/x+", tool="resize")
    table.change(table.box, locked=True)
    until(lambda: not page.node("/edit/handle/x+", "visible"), page=page.page)
    face = table.box.T_world_box[:3, 3] + table.box.T_world_box[:3, 0] * table.box.size[0] / 2
    page.drag(page.screen_of(face), (300, 300))
    page.page.mouse.up()
    page.settle()
    assert table.told == []
