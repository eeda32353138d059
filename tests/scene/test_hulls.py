"""What browsers are sent of the hulls of boxes."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
import trimesh

from ars_web.geometry.box import Box
from ars_web.scene.boxes import rgb
from ars_web.scene.server import SceneServers
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.hull_mesh import HullMesh
from ars_web.sessions.model import HullOptions, VirtualBox
from ars_web.sessions.store import SessionStore
from ars_web.workspace import BoxPreview

VIEW = "a" * 32
HULL = "/boxes/1/at/hull"


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


def ball(subdivisions: int = 1) -> HullMesh:
    """One that fills its box."""
    mesh = trimesh.creation.icosphere(subdivisions=subdivisions, radius=0.5)
    return HullMesh(np.asarray(mesh.vertices), np.asarray(mesh.faces))


@pytest.fixture
def hulled(editor: SessionEditor, store: SessionStore, sid: str) -> VirtualBox:
    """The table's cube, with a hull."""
    return with_hull(editor, sid, store.state(sid).boxes[1], ball())


def with_hull(editor: SessionEditor, sid: str, box: VirtualBox, hull: HullMesh | None) -> VirtualBox:
    return editor.put_object(
        sid,
        box_id=box.id,
        class_id=box.class_id,
        box=box.box,
        hull=hull,
        hull_options=None if hull is None else HullOptions(),
        expected_revision=box.revision,
        author="a",
    )


def shows(visitor: Any, hull: HullMesh) -> None:
    """Wait until the node of box 1 has this mesh."""

    def is_so(v: Any) -> bool:
        node = v.nodes.get(HULL, {})
        if not node.get("visible"):
            return False
        vertices, faces = hull.vertices.astype(np.float32), hull.faces
        return np.array_equal(node["vertices"], vertices.ravel()) and np.array_equal(node["faces"], faces.ravel())

    visitor.listen_until(is_so)


def test_a_hull_is_a_translucent_mesh_of_its_class_colour_within_its_box(
    hulled: VirtualBox, visitor: Any, store: SessionStore, sid: str
) -> None:
    shows(visitor, ball())
    node = visitor.nodes[HULL]
    assert np.allclose(node["scale"], hulled.box.size)
    assert tuple(node["color"]) == rgb(store.state(sid).classes[0].color)
    assert 0 < node["opacity"] < 1
    # It hangs on the box's place, and on nothing else.
    assert np.allclose(visitor.nodes["/boxes/1/at"]["position"], hulled.box.T_world_box[:3, 3])


def test_a_hull_scales_with_its_box_while_that_is_dragged(hulled: VirtualBox, visitor: Any, scenes, sid: str) -> None:
    shows(visitor, ball())
    larger = Box(hulled.box.T_world_box, hulled.box.size * [1.0, 2.0, 3.0])
    scenes.preview(sid, VIEW, BoxPreview(1, larger))
    visitor.listen_until(lambda v: np.allclose(v.nodes[HULL]["scale"], larger.size))
    scenes.preview(sid, VIEW, None)
    visitor.listen_until(lambda v: np.allclose(v.nodes[HULL]["scale"], hulled.box.size))


def test_another_hull_takes_its_place_and_undo_brings_the_first_back(
    visitor: Any, editor: SessionEditor, store: SessionStore, sid: str
) -> None:
    first = with_hull(editor, sid, store.state(sid).boxes[1], ball())
    shows(visitor, ball())
    with_hull(editor, sid, first, ball(2))
    shows(visitor, ball(2))
    editor.undo(sid, author="a")
    shows(visitor, ball())
    assert visitor.nodes["/boxes/1/at/body"]["visible"] is False  # which would hide what is in it
    editor.undo(sid, author="a")
    visitor.listen_until(lambda v: v.nodes[HULL]["visible"] is False)
    visitor.listen_until(lambda v: v.nodes["/boxes/1/at/body"]["visible"] is True)
    assert not [m for m in visitor.told if m["type"] == "RemoveSceneNodeMessage"]


def test_a_hull_hides_with_a_deleted_box_and_comes_back_with_it(
    hulled: VirtualBox, visitor: Any, editor: SessionEditor, sid: str
) -> None:
    shows(visitor, ball())
    assert HULL.startswith("/boxes/1/at/")  # what is below a node that is not seen is not seen
    editor.delete_box(sid, 1, expected_revision=hulled.revision, author="a")
    visitor.listen_until(lambda v: v.nodes["/boxes/1/at"]["visible"] is False)
    editor.undo(sid, author="a")
    visitor.listen_until(lambda v: v.nodes["/boxes/1/at"]["visible"] is True)
    shows(visitor, ball())


def test_who_comes_later_sees_the_hull_as_it_is_by_then(
    visitor: Any, scenes, editor: SessionEditor, store: SessionStore, sid: str, visit: Callable[..., Any]
) -> None:
    first = with_hull(editor, sid, store.state(sid).boxes[1], ball())
    shows(visitor, ball())
    with_hull(editor, sid, first, ball(2))
    shows(visitor, ball(2))
    with visit(scenes.address(sid, view="b" * 32, author="page-b")) as later:
        shows(later, ball(2))
