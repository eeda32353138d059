"""Meshes, symmetries and keypoints are edits like any other: undone, redone, kept, locked."""

from collections.abc import Callable

import pytest

from ars_web.errors import BadInput, Conflict, Locked, NotFound
from ars_web.geometry.box import Box
from ars_web.geometry.keypoints import Keypoint
from ars_web.geometry.symmetry import NO_SYMMETRY, Symmetry
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.edits import differences, replay
from ars_web.sessions.model import ObjectClass, VirtualBox
from ars_web.sessions.object_mesh import MeshSource, ObjectMesh, SourcedMesh
from ars_web.sessions.store import SessionStore

MakeMesh = Callable[..., SourcedMesh]

TIP = (Keypoint("tip", (0.0, 0.0, 0.5)),)
ROUND = Symmetry("continuous", axis=(0.0, 0.0, 1.0), flip=True)


@pytest.fixture
def change(store: SessionStore, editor: SessionEditor, sid: str) -> Callable[..., ObjectClass]:
    """Changes class 0 as it is now."""

    def make(**what: object) -> ObjectClass:
        revision = store.state(sid).classes[0].revision
        return editor.change_class(sid, 0, expected_revision=revision, author="me", **what)

    return make


@pytest.fixture
def box(editor: SessionEditor, sid: str, a_box: Callable[..., Box]) -> VirtualBox:
    return editor.add_box(sid, class_id=0, box=a_box(), author="me")


def test_each_change_is_one_step_that_is_undone_and_made_again(
    store: SessionStore, editor: SessionEditor, sid: str, change: Callable[..., ObjectClass], a_mesh: MakeMesh
):
    origin = store.state(sid)
    change(symmetry=ROUND)
    change(keypoints=TIP)
    change(mesh=a_mesh(), fit_size=None)
    change(mesh=a_mesh(0.5), symmetry=NO_SYMMETRY, keypoints=())
    change(mesh=None)
    states = [origin, *(replay(origin, store.edits(sid)[:n]) for n in range(1, 6))]
    assert [(s.classes[0].symmetry, s.classes[0].keypoints, s.classes[0].mesh) for s in states] == [
        (NO_SYMMETRY, (), None),
        (ROUND, (), None),
        (ROUND, TIP, None),
        (ROUND, TIP, a_mesh().mesh.digest),
        (NO_SYMMETRY, (), a_mesh(0.5).mesh.digest),
        (NO_SYMMETRY, (), None),
    ]
    assert [edit.summary for edit in store.edits(sid)] == [
        "Set symmetry of cube",
        "Set keypoints of cube",
        "Give a mesh to class cube",
        "Change class cube",
        "Take the mesh from class cube",
    ]
    for expected in reversed(states[:-1]):
        editor.undo(sid, author="me")
        now, then = store.state(sid).classes[0], expected.classes[0]
        assert (now.symmetry, now.keypoints, now.mesh, now.default_size) == (
            then.symmetry, then.keypoints, then.mesh, then.default_size,
        )  # fmt: skip
        assert set(store.snapshot(sid).meshes) == {then.mesh} - {None}
    for expected in states[1:]:
        editor.redo(sid, author="me")
        assert store.state(sid).classes[0].mesh == expected.classes[0].mesh
    with SessionStore(store.folder) as again:
        assert differences(replay(origin, again.edits(sid)), again.state(sid)) == []
        assert all("images are not where" in problem for problem in again.check())


def test_the_same_again_makes_no_edit(
    store: SessionStore, sid: str, change: Callable[..., ObjectClass], a_mesh: MakeMesh
):
    made = change(symmetry=ROUND, keypoints=TIP, mesh=a_mesh(), fit_size=True)
    assert change(symmetry=ROUND, keypoints=list(TIP), mesh=a_mesh(name="another.obj"), fit_size=True) == made
    assert change(symmetry=Symmetry("continuous", axis=(0.0, 0.0, 7.0), flip=True)) == made
    assert store.revision(sid) == 1
    # The first file that it came from is kept.
    assert store.mesh(sid, a_mesh().mesh.digest).source.name == "corner.stl"
    assert store.meshes(sid).keys() == {a_mesh().mesh.digest}


def test_the_usual_size_follows_the_mesh_where_that_is_asked_for(change: Callable[..., ObjectClass], a_mesh: MakeMesh):
    assert change(mesh=a_mesh()).default_size is None
    assert change(mesh=a_mesh(0.5), fit_size=None).default_size == (0.25, 0.5, 0.5)
    assert change(mesh=a_mesh(2.0), fit_size=None).default_size == (0.25, 0.5, 0.5)
    assert change(mesh=a_mesh(2.0), fit_size=True).default_size == (0.25, 0.5, 2.0)
    assert change(mesh=None, default_size=None).default_size is None
    flat = SourcedMesh(ObjectMesh(a_mesh().mesh.vertices[:3], [[0, 1, 2], [0, 2, 1]]), a_mesh().source)
    with pytest.raises(BadInput, match=r"the mesh is flat .*: no box fits it; give the class a size yourself"):
        change(mesh=flat, fit_size=True)
    assert change(mesh=flat, fit_size=None).default_size is None
    with pytest.raises(BadInput, match="there is no mesh that the class's usual size could be fitted to"):
        change(fit_size=True)


def test_a_boxs_own_mesh_comes_before_its_classs_and_goes_with_it(
    store: SessionStore,
    editor: SessionEditor,
    sid: str,
    box: VirtualBox,
    change: Callable[..., ObjectClass],
    a_mesh: MakeMesh,
):
    assert store.state(sid).mesh_of(box) is None
    of_class = change(mesh=a_mesh()).mesh
    assert (store.state(sid).mesh_of(box), box.has_mesh) == (of_class, False)
    own = editor.change_box(sid, 1, expected_revision=1, mesh=a_mesh(0.5), author="me")
    assert own.has_mesh
    assert store.state(sid).mesh_of(own) == own.mesh == a_mesh(0.5).mesh.digest
    copy = editor.duplicate_box(sid, 1, author="me")
    assert copy.mesh == own.mesh
    # Made anew from masks, it keeps its mesh.
    remade = editor.put_object(
        sid, box_id=1, class_id=0, box=copy.box, hull=None, hull_options=None, expected_revision=3, author="me"
    )
    assert remade.mesh == own.mesh
    editor.delete_box(sid, 1, expected_revision=5, author="me")
    editor.delete_box(sid, 2, expected_revision=4, author="me")
    assert set(store.snapshot(sid).meshes) == {of_class}
    editor.undo(sid, author="me")
    assert set(store.snapshot(sid).meshes) == {of_class, own.mesh}
    assert store.mesh(sid, own.mesh or "").mesh.extent.tolist() == [0.25, 0.5, 0.5]
    with pytest.raises(NotFound, match="no mesh '0a'"):
        store.mesh(sid, "0a")
    assert [edit.summary for edit in store.edits(sid)[1:4]] == [
        "Give a mesh to class cube", "Give a mesh to cube", "Duplicate cube",
    ]  # fmt: skip


def test_a_locked_box_keeps_its_mesh(
    store: SessionStore,
    editor: SessionEditor,
    sid: str,
    box: VirtualBox,
    change: Callable[..., ObjectClass],
    a_mesh: MakeMesh,
):
    editor.change_box(sid, 1, expected_revision=1, mesh=a_mesh(), locked=False, author="me")
    editor.change_box(sid, 1, expected_revision=2, locked=True, author="me")
    for mesh in (a_mesh(0.5), None):
        with pytest.raises(Locked, match=r"box 1 \('cube'\) is locked: unlock it before its mesh can be changed"):
            editor.change_box(sid, 1, expected_revision=3, mesh=mesh, author="me")
    assert editor.change_box(sid, 1, expected_revision=3, mesh=a_mesh(), author="me").revision == 3
    with pytest.raises(NotFound):  # the refused one was not stored
        store.mesh(sid, a_mesh(0.5).mesh.digest)
    # What its class is does not lie with the box.
    assert change(mesh=a_mesh(0.5)).mesh is not None
    assert editor.change_box(sid, 1, expected_revision=3, mesh=None, locked=False, author="me").mesh is None


def test_a_stale_change_is_a_conflict_and_stores_nothing(
    store: SessionStore, editor: SessionEditor, sid: str, change: Callable[..., ObjectClass], a_mesh: MakeMesh
):
    change(symmetry=ROUND)
    with pytest.raises(Conflict) as refused:
        editor.change_class(sid, 0, expected_revision=0, mesh=a_mesh(), author="you")
    assert refused.value.current == store.state(sid).classes[0]
    with pytest.raises(NotFound):
        store.mesh(sid, a_mesh().mesh.digest)
    with pytest.raises(BadInput, match="two keypoints called 'tip'"):
        change(keypoints=TIP * 2)
    editor.change_class(sid, 0, expected_revision=1, mesh=a_mesh(), author="you")
    with pytest.raises(Conflict):  # someone else changed the class since
        editor.undo(sid, author="me")


@pytest.mark.parametrize(
    ("source", "message"),
    [
        (("", "mm", "x,y,z", "file"), "needs a name that is not empty"),
        (("a\n.stl", "mm", "x,y,z", "file"), "control character"),
        (("a.stl", "ft", "x,y,z", "file"), "unit must be one of mm, cm, m, in, not 'ft'"),
        (("a.stl", "mm", "x,y", "file"), "axes must be such as x,-z,y, not 'x,y'"),
        (("a.stl", "mm", "x,y,z", "top"), "origin must be one of centre, file, not 'top'"),
    ],
)
def test_where_a_mesh_came_from_must_be_said(source: tuple[str, str, str, str], message: str):
    with pytest.raises(BadInput, match=message):
        MeshSource(*source)
