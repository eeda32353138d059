"""Whatever is done, in whatever order, the state is what the log leads to."""

from collections.abc import Callable

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ars_web.errors import ArsError
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.keypoints import Keypoint
from ars_web.geometry.polygon import Polygon
from ars_web.geometry.symmetry import NO_SYMMETRY, Symmetry
from ars_web.sessions.editing import MaskDraft, SessionEditor
from ars_web.sessions.edits import differences, replay
from ars_web.sessions.hull_mesh import HullMesh
from ars_web.sessions.model import HullOptions, SessionState
from ars_web.sessions.object_mesh import MeshSource, ObjectMesh, SourcedMesh
from ars_web.sessions.store import SessionStore

steps = st.lists(
    st.tuples(
        st.sampled_from(
            [
                "add",
                "add",
                "move",
                "name",
                "delete",
                "class",
                "unclass",
                "color",
                "size",
                "lock",
                "duplicate",
                "mesh",
                "class mesh",
                "symmetry",
                "keypoints",
                "mask",
                "mask",
                "unmask",
                "object",
                "object",
                "undo",
                "undo",
                "redo",
            ]
        ),
        st.sampled_from(["ann", "bob"]),
        st.integers(0, 7),
    ),
    max_size=50,
)


@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(steps)
def test_whatever_is_done_the_state_is_what_the_log_replays(
    store: SessionStore, make_recording: Callable[..., object], steps: list[tuple[str, str, int]]
):
    sid = store.create(make_recording(), name="table", class_names=["ball"]).id
    editor = SessionEditor(store)
    origin = store.state(sid)
    told: list[int] = []
    editor.listen(lambda _, edit: told.append(edit.revision))
    given_ids: set[int] = set()
    for action, author, n in steps:
        before = store.state(sid)
        try:
            act(editor, sid, before, action, author, n)
        except ArsError:
            assert store.state(sid) is before  # a refusal changes nothing
            continue
        state = store.state(sid)
        new = set(state.boxes) - set(before.boxes)
        places = [(mask.box_id, mask.frame) for mask in state.masks.values()]
        assert len(set(places)) == len(places)
        snapshot = store.snapshot(sid)
        assert {box.hull for box in state.boxes.values()} - {None} == set(snapshot.hulls)
        assert state.meshes_named == set(snapshot.meshes) == set(store.meshes(sid))
        if action == "add":
            assert not new & given_ids
            given_ids |= new
    state = store.state(sid)
    edits = store.edits(sid)
    assert [edit.revision for edit in edits] == list(range(1, state.revision + 1)) == told
    assert differences(replay(origin, edits), state) == []
    with SessionStore(store.folder) as again:
        assert differences(again.state(sid), state) == []


TRIANGLE = np.array([[0.0, 0.0], [9.0, 0.0], [9.0, 7.5]])
MESH_FILE = MeshSource("corner.stl", "mm", "x,y,z", "file")
SHAPES = [
    NO_SYMMETRY,
    Symmetry("discrete", (((0.0, 0.0, 1.0), 4), ((1.0, 0.0, 0.0), 2))),
    Symmetry("continuous", axis=(1.0, 1.0, 0.0), flip=True),
]
TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])


def mesh_of(n: int) -> SourcedMesh:
    return SourcedMesh(ObjectMesh(np.eye(4, 3) * (n + 1) / 8, TETRAHEDRON), MESH_FILE)


def act(editor: SessionEditor, sid: str, state: SessionState, action: str, author: str, n: int) -> None:
    boxes, classes, masks = list(state.boxes.values()), list(state.classes.values()), list(state.masks.values())
    objects = [*state.boxes, *(mask.box_id for mask in masks), None]
    R = rigid_transform.rotation_about_z(0.1 * n)
    T = rigid_transform.from_rotation(R, np.array([0.1 * n, 0.0, 1.0]))
    if action == "add":
        class_id = classes[n % len(classes)].id if classes else 0
        editor.add_box(sid, class_id=class_id, box=Box(T, np.array([0.1, 0.2, 0.3])), author=author)
    elif action == "mask":
        box_id = objects[n % len(objects)]
        before = next((m for m in masks if (m.box_id, m.frame) == (box_id, n % 3)), None)
        editor.put_mask(
            sid,
            box_id=box_id,
            frame=n % 3,
            class_id=0 if box_id is None else None,
            polygons=(Polygon(TRIANGLE + n),),
            accepted=n % 2 == 0,
            expected_revision=None if before is None else before.revision,
            author=author,
        )
    elif action == "unmask" and masks:
        mask = masks[n % len(masks)]
        editor.delete_mask(sid, mask.id, expected_revision=mask.revision, author=author)
    elif action == "object":
        box_id = objects[n % len(objects)]
        box = state.boxes.get(box_id or 0)
        had = [mask for mask in masks if mask.box_id == box_id]
        editor.put_object(
            sid,
            box_id=box_id,
            class_id=had[0].class_id if had else 0,
            box=Box(T, np.array([0.1, 0.2, 0.3])),
            hull=HullMesh(np.eye(4, 3) * (n + 1) / 8, TETRAHEDRON),
            hull_options=HullOptions(widen=float(n)),
            masks=[MaskDraft(n % 3, (Polygon(TRIANGLE * 2 + n),), "proposed", n < 4)],
            drop_masks=[mask.id for mask in had if mask.frame != n % 3][:1],
            expected_revision=None if box is None else box.revision,
            expected_masks={mask.id: mask.revision for mask in had},
            author=author,
        )
    elif action == "class":
        editor.add_class(sid, name=f"class {n}", author=author)
    elif action == "undo":
        editor.undo(sid, author=author)
    elif action == "redo":
        editor.redo(sid, author=author)
    elif action in ("unclass", "color", "size", "class mesh", "symmetry", "keypoints") and classes:
        a_class = classes[n % len(classes)]
        if action == "class mesh":
            mesh = mesh_of(n) if n else None
            editor.change_class(
                sid, a_class.id, expected_revision=a_class.revision, mesh=mesh, fit_size=None, author=author
            )
        elif action == "symmetry":
            shape = SHAPES[n % len(SHAPES)]
            editor.change_class(sid, a_class.id, expected_revision=a_class.revision, symmetry=shape, author=author)
        elif action == "keypoints":
            points = [Keypoint(f"k{i}", (0.1 * n, -0.5, 1 / 3)) for i in range(n)]
            editor.change_class(sid, a_class.id, expected_revision=a_class.revision, keypoints=points, author=author)
        elif action == "color":
            editor.change_class(sid, a_class.id, expected_revision=a_class.revision, color=f"#00000{n}", author=author)
        elif action == "size":
            size = (0.1 * n, 0.2, 0.3) if n else None
            editor.change_class(sid, a_class.id, expected_revision=a_class.revision, default_size=size, author=author)
        else:
            editor.delete_class(sid, a_class.id, expected_revision=a_class.revision, author=author)
    elif boxes:
        box = boxes[n % len(boxes)]
        if action == "delete":
            editor.delete_box(sid, box.id, expected_revision=box.revision, author=author)
        elif action == "duplicate":
            editor.duplicate_box(sid, box.id, author=author)
        elif action == "mesh":
            mesh = mesh_of(n) if n else None
            editor.change_box(sid, box.id, expected_revision=box.revision, mesh=mesh, author=author)
        elif action == "lock":
            editor.change_box(sid, box.id, expected_revision=box.revision, locked=not box.locked, author=author)
        elif action == "move":
            editor.change_box(sid, box.id, expected_revision=box.revision, T_world_box=T, author=author)
        else:
            editor.change_box(sid, box.id, expected_revision=box.revision, name=f"n{n}", author=author)
