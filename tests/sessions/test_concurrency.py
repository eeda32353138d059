"""Many threads and several processes at one session: no update is lost, no revision skipped."""

import contextlib
import subprocess
import sys
import threading
from collections.abc import Callable

from ars_web.errors import Conflict
from ars_web.geometry.box import Box
from ars_web.geometry.polygon import Polygon
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.edits import BoxChange, Edit, same
from ars_web.sessions.hull_mesh import HullMesh
from ars_web.sessions.model import VirtualBox
from ars_web.sessions.store import SessionStore

MakeBox = Callable[..., Box]
EACH = 25

COUNT_UP = """
import sys
from pathlib import Path
from ars_web.errors import Conflict
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.store import SessionStore

with SessionStore(Path(sys.argv[1])) as store:
    editor, sid, author = SessionEditor(store), sys.argv[2], sys.argv[3]
    print("ready", flush=True)
    sys.stdin.readline()
    done = 0
    while done < int(sys.argv[4]):
        box = store.state(sid).boxes[1]
        try:
            editor.change_box(sid, 1, expected_revision=box.revision, name=str(int(box.name) + 1), author=author)
            done += 1
        except Conflict:
            pass
"""


def assert_every_step_was_kept(store: SessionStore, sid: str, steps: int) -> None:
    """The box's name counts up by one: a lost update would leave it short."""
    edits = store.edits(sid, after=1)
    assert store.state(sid).boxes[1].name == str(steps)
    assert [edit.revision for edit in edits] == list(range(2, steps + 2))
    changes = [edit.changes[0] for edit in edits]
    assert [c.after.name for c in changes if isinstance(c, BoxChange) and c.after] == [str(i + 1) for i in range(steps)]
    assert all("images are not where" in problem for problem in store.check())


def test_threads_racing_for_one_box_lose_nothing(store: SessionStore, editor: SessionEditor, sid: str, a_box: MakeBox):
    editor.add_box(sid, class_id=0, box=a_box(), name="0", author="me")
    told: list[int] = []

    def hear(_: str, edit: Edit) -> None:
        told.append(edit.revision)

    editor.listen(hear)
    together = threading.Barrier(8, timeout=30)
    finished: list[str] = []

    def count_up(author: str) -> None:
        together.wait()
        done = 0
        while done < EACH:
            box = store.state(sid).boxes[1]
            name = str(int(box.name) + 1)
            with contextlib.suppress(Conflict):
                editor.change_box(sid, 1, expected_revision=box.revision, name=name, author=author)
                done += 1
        finished.append(author)

    threads = [threading.Thread(target=count_up, args=(f"t{i}",)) for i in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(120)
    assert len(finished) == 8
    assert_every_step_was_kept(store, sid, 8 * EACH)
    assert told == list(range(2, 8 * EACH + 2))


def test_processes_racing_for_one_box_lose_nothing(
    store: SessionStore, editor: SessionEditor, sid: str, a_box: MakeBox
):
    editor.add_box(sid, class_id=0, box=a_box(), name="0", author="me")
    racers = [
        subprocess.Popen(
            [sys.executable, "-c", COUNT_UP, store.folder, sid, f"p{i}", str(EACH)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        for i in range(2)
    ]
    for racer in racers:
        assert racer.stdout is not None
        assert racer.stdout.readline() == "ready\n"
    for racer in racers:
        assert racer.stdin is not None
        racer.stdin.write("go\n")
        racer.stdin.flush()
    for racer in racers:
        racer.communicate(timeout=120)
    assert [racer.returncode for racer in racers] == [0, 0]
    assert_every_step_was_kept(store, sid, 2 * EACH)


def test_threads_that_outline_at_once_get_an_object_each_and_make_one_box_of_one(
    store: SessionStore,
    editor: SessionEditor,
    sid: str,
    a_box: MakeBox,
    a_hull: Callable[..., HullMesh],
    outline: Callable[..., tuple[Polygon, ...]],
):
    shared = editor.put_mask(
        sid, box_id=None, frame=0, class_id=0, polygons=outline(), expected_revision=None, author="me"
    )
    together = threading.Barrier(6, timeout=30)
    own: list[int] = []
    made: list[VirtualBox] = []
    refused: list[object] = []

    def outline_and_make(author: str) -> None:
        together.wait()
        mask = editor.put_mask(
            sid, box_id=None, frame=1, class_id=0, polygons=outline(), expected_revision=None, author=author
        )
        own.append(mask.box_id)
        try:
            box = editor.put_object(
                sid, box_id=shared.box_id, class_id=0, box=a_box(), hull=a_hull(), hull_options=None,
                expected_masks={shared.id: shared.revision}, author=author,
            )  # fmt: skip
            made.append(box)
        except Conflict as error:
            refused.append(error.current)

    threads = [threading.Thread(target=outline_and_make, args=(f"t{i}",)) for i in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert sorted(own) == [2, 3, 4, 5, 6, 7]
    assert [box.id for box in made] == [1]
    assert [same(told, made[0]) for told in refused if isinstance(told, VirtualBox)] == [True] * 5
    assert store.revision(sid) == 8
    assert all("images are not where" in problem for problem in store.check())
