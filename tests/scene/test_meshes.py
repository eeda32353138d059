"""What browsers are sent of the meshes of boxes and classes."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from ars_web.scene.server import SceneServers
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.object_mesh import MeshSource, ObjectMesh, SourcedMesh
from ars_web.sessions.store import SessionStore

VIEW = "a" * 32
MESH = "/boxes/1/at/mesh"
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])


@pytest.fixture
def visitor(store: SessionStore, editor: SessionEditor, sid: str, visit: Callable[..., Any]) -> Iterator[Any]:
    with SceneServers(store, editor) as scenes:
        scenes.attach(sid, VIEW, author="page-a", send=lambda event: None)
        with visit(scenes.address(sid, view=VIEW, author="page-a")) as visitor:
            visitor.listen_until(lambda v: "visible" in v.nodes.get("/boxes/1/at/body", {}))
            yield visitor


def a_mesh(height: float) -> SourcedMesh:
    mesh = ObjectMesh(np.eye(4, 3) * [0.1, 0.1, height], FACES)
    return SourcedMesh(mesh, MeshSource("corner.stl", "m", "x,y,z", "file"))


def shows(visitor: Any, sourced: SourcedMesh) -> None:
    """Wait until the node of box 1 has this mesh."""
    vertices = sourced.mesh.vertices.astype(np.float32).ravel()

    def is_so(v: Any) -> bool:
        node = v.nodes.get(MESH, {})
        return bool(node.get("visible")) and np.array_equal(node["vertices"], vertices)

    visitor.listen_until(is_so)


def test_a_mesh_is_shown_in_metres_a_boxs_own_before_its_classs(
    visitor: Any, editor: SessionEditor, store: SessionStore, sid: str
) -> None:
    box = store.state(sid).boxes[1]
    a_class = store.state(sid).classes[box.class_id]
    editor.change_class(sid, a_class.id, expected_revision=a_class.revision, mesh=a_mesh(0.2), author="a")
    shows(visitor, a_mesh(0.2))
    assert visitor.nodes["/boxes/1/at/body"]["visible"] is False
    editor.change_box(sid, 1, expected_revision=box.revision, mesh=a_mesh(0.3), author="a")
    shows(visitor, a_mesh(0.3))
    box = store.state(sid).boxes[1]
    editor.change_box(sid, 1, expected_revision=box.revision, size=box.box.size * 2, author="a")
    visitor.listen_until(lambda v: np.allclose(v.nodes["/boxes/1/at/body"]["scale"], box.box.size * 2))
    assert np.allclose(visitor.nodes[MESH]["scale"], 1.0)
    editor.undo(sid, author="a")
    editor.undo(sid, author="a")
    shows(visitor, a_mesh(0.2))
    editor.undo(sid, author="a")
    visitor.listen_until(lambda v: v.nodes[MESH]["visible"] is False)
    visitor.listen_until(lambda v: v.nodes["/boxes/1/at/body"]["visible"] is True)
