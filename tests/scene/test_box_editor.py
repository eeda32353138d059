"""Drags in a scene: previewed for all, stored once on release, never by a browser that vanishes."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from viser import _messages

from ars_web.geometry import rigid_transform
from ars_web.scene.server import SceneServers
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.store import SessionStore
from ars_web.workspace import Conflicted, Dragged, NewBox, Picked, Refused, ViewEvent, ViewState

VIEW = "a" * 32
OTHER = "b" * 32
GIZMO = "/edit/gizmo"
AT = "/boxes/1/at"


@pytest.fixture
def scenes(store: SessionStore, editor: SessionEditor) -> Iterator[SceneServers]:
    with SceneServers(store, editor) as scenes:
        yield scenes


class Page:
    """A page with its scene: what it was told, and its hands on the gizmo."""

    def __init__(self, scenes: SceneServers, sid: str, view: str, visitor: Any) -> None:
        self.told: list[ViewEvent] = []
        self.visitor = visitor
        self._scenes, self._sid, self._view = scenes, sid, view
        scenes.attach(sid, view, author=f"page-{view[:8]}", send=self.told.append)

    def show(self, **state: Any) -> None:
        self._scenes.show(self._sid, self._view, ViewState(**state))

    def of(self, kind: type) -> list[Any]:
        return [event for event in self.told if isinstance(event, kind)]

    def gizmo(self) -> Any:
        """What the browser shows of it."""
        return self.visitor.nodes[GIZMO]

    def pose(self) -> np.ndarray:
        gizmo = self.gizmo()
        return rigid_transform.from_position_wxyz(
            np.array(gizmo["position"]), np.array(gizmo.get("wxyz", (1.0, 0.0, 0.0, 0.0)))
        )

    def say(self, kind: Any, **fields: Any) -> None:
        owner = next(m["owner"] for m in self.visitor.told if m.get("name") == GIZMO and "owner" in m)
        self.visitor.say(kind(name=GIZMO, owner=owner, **fields))

    def grab(self) -> None:
        self.visitor.listen_until(lambda v: v.nodes.get(GIZMO, {}).get("visible") and "position" in v.nodes[GIZMO])
        self.say(_messages.TransformControlsDragStartMessage)

    def drag(self, T: np.ndarray) -> None:
        wxyz = tuple(map(float, rigid_transform.wxyz_from_rotation(T[:3, :3])))
        self.say(_messages.TransformControlsUpdateMessage, wxyz=wxyz, position=tuple(map(float, T[:3, 3])))

    def let_go(self) -> None:
        self.say(_messages.TransformControlsDragEndMessage)


@pytest.fixture
def page(scenes: SceneServers, sid: str, visit: Callable[..., Any]) -> Iterator[Page]:
    address = scenes.address(sid, view=VIEW, author=f"page-{VIEW[:8]}")
    with visit(address) as visitor:
        page = Page(scenes, sid, VIEW, visitor)
        yield page


def moved(T: np.ndarray, *by: float) -> np.ndarray:
    T = T.copy()
    T[:3, 3] += by
    return T


def test_a_move_is_previewed_and_stored_once_on_release(
    page: Page, store: SessionStore, sid: str, until: Callable[..., None]
) -> None:
    before = store.state(sid)
    page.show(selected=1, tool="move", axes="world", snap_length=0.001)
    page.grab()
    start = page.pose()
    page.drag(moved(start, 0.0304, 0.0, 0.0))
    until(lambda: len(page.of(Dragged)) == 2)
    assert store.state(sid).revision == before.revision  # nothing is stored meanwhile
    page.drag(moved(start, 0.0496, 0.0, 0.0))
    page.let_go()
    until(lambda: page.of(Dragged)[-1].phase == "end")
    events = page.of(Dragged)
    assert [event.phase for event in events] == ["start", "move", "move", "end"]
    assert [event.text for event in events] == ["", "X +30.0 mm", "X +50.0 mm", "X +50.0 mm"]
    assert all(event.own for event in events)
    after = store.state(sid)
    assert after.revision == before.revision + 1
    wanted = moved(before.boxes[1].box.T_world_box, 0.05, 0.0, 0.0)
    assert np.abs(after.boxes[1].box.T_world_box - wanted).max() < 1e-15
    assert store.edits(sid)[-1].author == f"page-{VIEW[:8]}"
    page.visitor.listen_until(lambda v: np.allclose(v.nodes[AT].get("position", 0), wanted[:3, 3], atol=1e-12))


def test_a_drag_there_and_back_stores_nothing(
    page: Page, store: SessionStore, sid: str, until: Callable[..., None]
) -> None:
    before = store.state(sid)
    page.show(selected=1, tool="rotate", snap_angle=np.radians(5))
    page.grab()
    start = page.pose()
    turned = start.copy()
    turned[:3, :3] = start[:3, :3] @ rigid_transform.rotation_about_z(0.3)
    page.drag(turned)
    page.drag(start)
    page.let_go()
    until(lambda: page.of(Dragged) and page.of(Dragged)[-1].phase == "cancel")
    assert [event.text for event in page.of(Dragged)[:3]] == ["", "Z +15.0°", "X 0.0°"]
    assert store.state(sid).revision == before.revision


def test_others_see_the_drag_and_are_told(
    page: Page, scenes: SceneServers, sid: str, visit: Callable[..., Any], until: Callable[..., None]
) -> None:
    page.show(selected=1, tool="move", axes="world")
    with visit(scenes.address(sid, view=OTHER, author=f"page-{OTHER[:8]}")) as visitor:
        other = Page(scenes, sid, OTHER, visitor)
        page.grab()
        to = moved(page.pose(), 0.2, 0.0, 0.0)
        page.drag(to)
        visitor.listen_until(lambda v: np.allclose(v.nodes.get(AT, {}).get("position", 0), to[:3, 3]))
        until(lambda: len(other.of(Dragged)) == 2)
        assert [event.own for event in other.of(Dragged)] == [False, False]


def test_a_box_that_was_changed_meanwhile_is_a_conflict_and_shown_as_it_is(
    page: Page, editor: SessionEditor, store: SessionStore, sid: str, until: Callable[..., None]
) -> None:
    box = store.state(sid).boxes[1]
    page.show(selected=1, tool="move", axes="world")
    page.grab()
    start = page.pose()
    page.drag(moved(start, 0.1, 0.0, 0.0))
    until(lambda: len(page.of(Dragged)) == 2)
    theirs = moved(box.box.T_world_box, 0.0, 0.5, 0.0)
    current = editor.change_box(sid, 1, expected_revision=box.revision, T_world_box=theirs, author="someone else")
    page.let_go()
    until(lambda: bool(page.of(Conflicted)))
    [conflict] = page.of(Conflicted)
    assert conflict.current.revision == current.revision
    assert np.allclose(conflict.yours.box.T_world_box, moved(start, 0.1, 0.0, 0.0))
    assert "changed meanwhile" in conflict.detail or "revision" in conflict.detail
    assert store.state(sid).boxes[1].revision == current.revision
    page.visitor.listen_until(lambda v: np.allclose(v.nodes[AT].get("position", 0), theirs[:3, 3], atol=1e-12))


def test_a_browser_that_vanishes_stores_nothing(
    scenes: SceneServers, store: SessionStore, sid: str, visit: Callable[..., Any], until: Callable[..., None]
) -> None:
    before = store.state(sid)
    with visit(scenes.address(sid, view=VIEW, author=f"page-{VIEW[:8]}")) as visitor:
        page = Page(scenes, sid, VIEW, visitor)
        page.show(selected=1, tool="move")
        page.grab()
        page.drag(moved(page.pose(), 0.1, 0.0, 0.0))
        until(lambda: len(page.of(Dragged)) == 2)
    until(lambda: page.of(Dragged)[-1].phase == "cancel")
    assert store.state(sid).revision == before.revision


def test_a_line_that_breaks_cancels_the_drag(
    page: Page, scenes: SceneServers, store: SessionStore, sid: str, until: Callable[..., None]
) -> None:
    before = store.state(sid)
    page.show(selected=1, tool="move")
    page.grab()
    start = page.pose()
    page.drag(moved(start, 0.1, 0.0, 0.0))
    until(lambda: len(page.of(Dragged)) == 2)
    scenes.detach(sid, VIEW)
    until(lambda: page.of(Dragged)[-1].phase == "cancel")
    page.drag(moved(start, 0.2, 0.0, 0.0))
    page.let_go()
    place = before.boxes[1].box.T_world_box[:3, 3]
    page.visitor.listen_until(lambda v: np.allclose(v.nodes[AT].get("position", 0), place, atol=1e-12))
    assert store.state(sid).revision == before.revision


def test_another_tool_cancels_the_drag(page: Page, store: SessionStore, sid: str, until: Callable[..., None]) -> None:
    before = store.state(sid)
    page.show(selected=1, tool="move")
    page.grab()
    page.drag(moved(page.pose(), 0.1, 0.0, 0.0))
    until(lambda: len(page.of(Dragged)) == 2)
    page.show(selected=1, tool="select")
    until(lambda: page.of(Dragged)[-1].phase == "cancel")
    page.visitor.listen_until(lambda v: v.nodes[GIZMO]["visible"] is False)
    page.let_go()
    assert store.state(sid).revision == before.revision


@pytest.mark.parametrize("state", [{"tool": "select"}, {"tool": "move", "hidden": frozenset({1})}, {"tool": "locked"}])
def test_what_cannot_be_dragged_has_no_gizmo(
    page: Page, editor: SessionEditor, store: SessionStore, sid: str, state: dict[str, Any]
) -> None:
    page.show(selected=1, tool="move")
    page.visitor.listen_until(lambda v: v.nodes.get(GIZMO, {}).get("visible") is True)
    if state["tool"] == "locked":
        revision = store.state(sid).boxes[1].revision
        editor.change_box(sid, 1, expected_revision=revision, locked=True, author="someone else")
    else:
        page.show(selected=1, **state)
    page.visitor.listen_until(lambda v: v.nodes[GIZMO]["visible"] is False)


def test_a_second_drag_while_the_first_is_stored_follows_it(
    page: Page, store: SessionStore, sid: str, until: Callable[..., None]
) -> None:
    before = store.state(sid)
    page.show(selected=1, tool="move", axes="world")
    page.grab()
    start = page.pose()
    page.drag(moved(start, 0.1, 0.0, 0.0))
    page.let_go()
    page.say(_messages.TransformControlsDragStartMessage)
    page.drag(moved(start, 0.1, 0.1, 0.0))
    page.let_go()
    until(lambda: [e.phase for e in page.of(Dragged)].count("end") == 2)
    after = store.state(sid)
    assert page.of(Conflicted) == []
    assert after.revision == before.revision + 2
    wanted = moved(before.boxes[1].box.T_world_box, 0.1, 0.1, 0.0)
    assert np.abs(after.boxes[1].box.T_world_box - wanted).max() < 1e-9


def test_the_gizmo_has_the_axes_that_are_wanted(
    page: Page, editor: SessionEditor, store: SessionStore, sid: str
) -> None:
    box = store.state(sid).boxes[1]
    turned = box.box.T_world_box.copy()
    turned[:3, :3] = rigid_transform.rotation_from_wxyz(np.array([0.9, 0.1, 0.3, 0.2]))
    editor.change_box(sid, 1, expected_revision=box.revision, T_world_box=turned, author="someone else")

    def shown(R: np.ndarray, **props: Any) -> None:
        def as_wanted(v: Any) -> bool:
            gizmo = v.nodes.get(GIZMO, {})
            pose = rigid_transform.rotation_from_wxyz(np.array(gizmo.get("wxyz", (1.0, 0.0, 0.0, 0.0))))
            return bool(gizmo) and np.allclose(pose, R) and all(_plain(gizmo[key]) == props[key] for key in props)

        page.visitor.listen_until(as_wanted)

    def _plain(value: Any) -> Any:
        return list(value) if isinstance(value, list | tuple) else value

    page.show(selected=1, tool="move", axes="box")
    shown(turned[:3, :3], disable_rotations=True, disable_axes=False)
    page.show(selected=1, tool="move", axes="world")
    shown(np.eye(3), disable_rotations=True)
    page.show(selected=1, tool="rotate", axes="box")
    shown(turned[:3, :3], disable_rotations=False, disable_axes=True, active_axes=[True, True, True])
    page.show(selected=1, tool="rotate", axes="box", upright=True)
    shown(np.eye(3), active_axes=[True, True, False])


def test_a_new_box_stands_where_the_view_looks_and_is_selected(
    page: Page, scenes: SceneServers, store: SessionStore, sid: str, until: Callable[..., None]
) -> None:
    page.show(selected=1)
    page.visitor.listen_until(lambda v: f"{AT}/selected" in v.nodes)
    scenes.act(sid, VIEW, NewBox(0))
    until(lambda: bool(page.of(Picked)))
    added = store.state(sid).boxes[page.of(Picked)[0].box_id]
    # The visitor's camera is two metres up and looks down; the class's one box is 10 cm wide.
    assert added.box.T_world_box[:3, 3] == pytest.approx([0.0, 0.0, 0.05])
    assert added.box.size.tolist() == [0.1, 0.1, 0.1]
    page.visitor.listen_until(lambda v: f"/boxes/{added.id}/at" in v.nodes)
    scenes.act(sid, VIEW, NewBox(7))
    until(lambda: bool(page.of(Refused)))
    assert page.of(Refused) == [Refused("there is no class 7; choose another one for the new box")]


def test_a_new_box_before_the_scene_is_there_is_refused_in_words(
    scenes: SceneServers, sid: str, page: Page, until: Callable[..., None]
) -> None:
    told: list[ViewEvent] = []
    scenes.attach(sid, OTHER, author="page-b", send=told.append)
    scenes.act(sid, OTHER, NewBox(0))
    until(lambda: told == [Refused("the 3D scene is not connected yet; add the box once it shows")])


def test_a_new_box_before_any_scene_is_open_is_refused_in_words(scenes: SceneServers, sid: str) -> None:
    told: list[ViewEvent] = []
    scenes.attach(sid, VIEW, author="page-a", send=told.append)
    scenes.act(sid, VIEW, NewBox(0))
    assert told == [Refused("the 3D scene is not connected yet; add the box once it shows")]


def test_a_fault_in_storing_a_drag_ends_it_for_the_page(
    page: Page, editor: SessionEditor, store: SessionStore, sid: str, monkeypatch: pytest.MonkeyPatch, until: Callable
) -> None:
    def fault(*_: Any, **__: Any) -> None:
        raise RuntimeError("a fault of this program")

    monkeypatch.setattr(editor, "change_box", fault)
    page.show(selected=1, tool="move")
    page.grab()
    page.drag(moved(page.pose(), 0.1, 0.0, 0.0))
    page.let_go()
    until(lambda: [event.phase for event in page.of(Dragged)][-1:] == ["cancel"])
    assert "fault" in page.of(Refused)[0].detail
