"""What browsers are sent of the boxes."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.scene.boxes import BoxNodes, rgb
from ars_web.scene.hardening import guarded_server
from ars_web.scene.server import SceneServers
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.store import SessionStore
from ars_web.workspace import BoxPreview, ViewState

VIEW, OTHER = "a" * 32, "b" * 32


@pytest.fixture
def scenes(store: SessionStore, editor: SessionEditor) -> Iterator[SceneServers]:
    with SceneServers(store, editor) as scenes:
        yield scenes


@pytest.fixture
def visitor(scenes: SceneServers, sid: str, visit: Callable[..., Any]) -> Iterator[Any]:
    scenes.attach(sid, VIEW, author="page-a", send=lambda event: None)
    with visit(scenes.address(sid, view=VIEW, author="page-a")) as visitor:
        visitor.listen_until(lambda v: "visible" in v.nodes.get("/boxes/1/at/body", {}))
        yield visitor


def at(visitor: Any, name: str, **wanted: Any) -> None:
    """Wait until a node is as wanted, numbers to the last digits."""

    def is_so(v: Any) -> bool:
        node = v.nodes.get(name, {})
        return all(key in node and _equal(node[key], value) for key, value in wanted.items())

    visitor.listen_until(is_so)


def _equal(a: Any, b: Any) -> bool:
    return a == b if isinstance(b, str | bool) else bool(np.allclose(a, b, rtol=0, atol=1e-12))


def moved(box: Box, *by: float) -> np.ndarray:
    T = box.T_world_box.copy()
    T[:3, 3] += by
    return T


def test_a_nudge_far_from_the_origin_arrives(
    visitor: Any, editor: SessionEditor, store: SessionStore, sid: str
) -> None:
    box = store.state(sid).boxes[1]
    far = moved(box.box, 60.0, 0.0, 0.0)
    box = editor.change_box(sid, 1, expected_revision=box.revision, T_world_box=far, author="a")
    at(visitor, "/boxes/1/at", position=far[:3, 3])
    far[0, 3] += 2e-5  # 0.02 mm, at 60 m
    box = editor.change_box(sid, 1, expected_revision=box.revision, T_world_box=far, author="a")
    at(visitor, "/boxes/1/at", position=far[:3, 3])
    far[:3, :3] = far[:3, :3] @ rigid_transform.rotation_about_z(1e-6)
    editor.change_box(sid, 1, expected_revision=box.revision, T_world_box=far, author="a")
    at(visitor, "/boxes/1/at", wxyz=rigid_transform.wxyz_from_rotation(far[:3, :3]))


def test_size_and_colour_follow(visitor: Any, editor: SessionEditor, store: SessionStore, sid: str) -> None:
    state = store.state(sid)
    size = np.array([0.2, 0.3, 0.4])
    editor.change_box(sid, 1, expected_revision=state.boxes[1].revision, size=size, author="a")
    at(visitor, "/boxes/1/at/edges", scale=size)
    at(visitor, "/boxes/1/at/body", scale=size)
    editor.change_class(sid, 0, expected_revision=state.classes[0].revision, color="#123456", author="a")
    at(visitor, "/boxes/1/at/body", color=rgb("#123456"))


def test_a_deleted_box_is_hidden_and_comes_back_by_its_name(
    visitor: Any, editor: SessionEditor, store: SessionStore, sid: str
) -> None:
    editor.delete_box(sid, 1, expected_revision=store.state(sid).boxes[1].revision, author="a")
    at(visitor, "/boxes/1/at", visible=False)
    editor.undo(sid, author="a")
    at(visitor, "/boxes/1/at", visible=True)
    assert not [m for m in visitor.told if m["type"] == "RemoveSceneNodeMessage"]


def test_hiding_is_each_views_own(
    visitor: Any, scenes: SceneServers, editor: SessionEditor, sid: str, visit: Callable[..., Any]
) -> None:
    scenes.attach(sid, OTHER, author="page-b", send=lambda event: None)
    with visit(scenes.address(sid, view=OTHER, author="page-b")) as other:
        scenes.show(sid, VIEW, ViewState(hidden=frozenset({1})))
        at(visitor, "/boxes/1", visible=False)
        scenes.show(sid, VIEW, ViewState())
        at(visitor, "/boxes/1", visible=True)
        scenes.preview(sid, VIEW, BoxPreview(1, Box(np.eye(4), np.array([0.5, 0.5, 0.5]))))
        at(other, "/boxes/1/at/edges", scale=[0.5, 0.5, 0.5])
        assert not [m for m in other.told if m.get("name") == "/boxes/1" and m.get("visible") is False]


def test_the_selected_box_has_a_thicker_line_that_follows_previews(
    visitor: Any, scenes: SceneServers, store: SessionStore, sid: str
) -> None:
    box = store.state(sid).boxes[1].box
    scenes.show(sid, VIEW, ViewState(selected=1))
    at(visitor, "/boxes/1/at/selected", scale=box.size, visible=True)
    assert visitor.nodes["/boxes/1/at/selected"]["thickness"] > visitor.nodes["/boxes/1/at/edges"]["thickness"]
    scenes.preview(sid, VIEW, BoxPreview(1, Box(moved(box, 0.3, 0.0, 0.0), box.size * 2)))
    at(visitor, "/boxes/1/at/selected", scale=box.size * 2)
    at(visitor, "/boxes/1/at", position=moved(box, 0.3, 0.0, 0.0)[:3, 3])
    scenes.preview(sid, VIEW, None)
    at(visitor, "/boxes/1/at/selected", scale=box.size)
    at(visitor, "/boxes/1/at", position=box.T_world_box[:3, 3])
    scenes.show(sid, VIEW, ViewState(selected=None))
    at(visitor, "/boxes/1/at/selected", visible=False)


def test_a_box_that_was_deleted_since_it_was_stored_is_not_drawn_again(
    editor: SessionEditor, store: SessionStore, sid: str
) -> None:
    server = guarded_server()
    try:
        nodes = BoxNodes(server)
        before = store.state(sid).boxes[1]
        nodes.show(store.state(sid))
        T = moved(before.box, 0.1, 0.0, 0.0)
        stored = editor.change_box(sid, 1, expected_revision=before.revision, T_world_box=T, author="a")
        nodes.settle(stored)
        assert nodes.stored(1) == stored
        editor.delete_box(sid, 1, expected_revision=stored.revision, author="b")
        nodes.show(store.state(sid))
        nodes.settle(stored)  # by a thread that was slow
        assert nodes.stored(1) is None
    finally:
        server.stop()
