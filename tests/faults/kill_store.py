"""Kills a process that edits a session, at random moments, and looks for what was lost.

    python tests/faults/kill_store.py --rounds 200

Each round forks an editor, which makes random edits and acknowledges each revision through a pipe, and kills it
with SIGKILL. Then: no acknowledged revision may be missing, revisions must be gap-free, and the tables must be what
the log replays to. Ends with 0 if that held in every round, with 1 and the first failure if not.

`--without` takes one protection away, to show that a loss would be seen; `--die-between` has the editor kill
itself at the worst moment, between appending to the log and applying, in one edit out of ten.
"""

import argparse
import os
import random
import select
import signal
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from sqlalchemy import Connection

from ars_web.errors import ArsError
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.polygon import Polygon
from ars_web.recordings.recording import Frame, Recording
from ars_web.sessions import database, rows
from ars_web.sessions.editing import MaskDraft, SessionEditor
from ars_web.sessions.edits import Edit
from ars_web.sessions.hull_mesh import HullMesh
from ars_web.sessions.model import HullOptions, SessionState
from ars_web.sessions.object_mesh import MeshSource, ObjectMesh, SourcedMesh
from ars_web.sessions.store import SessionStore

TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])

LONGEST_LIFE = 0.4
"""Seconds an editor lives at most."""


def edit_for_ever(folder: Path, sid: str, *, seed: int, pipe: int, without: str | None, die_between: bool) -> None:
    """The editor: acknowledges each revision once it was made, eight bytes each."""
    chance = random.Random(seed)

    def acknowledge(revision: int) -> None:
        os.write(pipe, revision.to_bytes(8))

    if without == "transaction":
        # Every statement commits by itself.
        database._begin = lambda connection: None
    if die_between or without == "order":
        apply_edit = rows.apply_edit

        def die_at_the_worst_moment(connection: Connection, edit: Edit, state: SessionState) -> None:
            if without == "order":
                acknowledge(edit.revision)
            if die_between and chance.random() < 0.1:
                os.kill(os.getpid(), signal.SIGKILL)
            apply_edit(connection, edit, state)

        rows.apply_edit = die_at_the_worst_moment
    with SessionStore(folder) as store:
        editor = SessionEditor(store)
        editor.listen(lambda _, edit: None if without == "order" else acknowledge(edit.revision))
        while True:
            edit_once(store, editor, sid, chance)


def edit_once(store: SessionStore, editor: SessionEditor, sid: str, chance: random.Random) -> None:
    state, author = store.state(sid), chance.choice(["ann", "bob"])
    boxes, masks = list(state.boxes.values()), list(state.masks.values())
    deeds = ["add", "add", "move", "move", "delete", "class", "outline", "object", "unmask", "mesh", "undo", "redo"]
    try:
        match chance.choice(deeds):
            case "add":
                editor.add_box(sid, class_id=0, box=Box(np.eye(4), np.ones(3)), author=author, key=str(chance.random()))
            case "move" if boxes:
                box, size = chance.choice(boxes), np.array([chance.uniform(0.1, 9) for _ in range(3)])
                editor.change_box(sid, box.id, expected_revision=box.revision, size=size, author=author)
            case "delete" if boxes:
                box = chance.choice(boxes)
                editor.delete_box(sid, box.id, expected_revision=box.revision, author=author)
            case "class":
                editor.add_class(sid, name=f"class {state.next_class_id}", author=author)
            case "outline":
                mask = chance.choice([*masks, None])
                # Another outline in the place of one that is there, or the first of a new object.
                editor.put_mask(
                    sid,
                    box_id=None if mask is None else mask.box_id,
                    frame=0,
                    class_id=0 if mask is None else None,
                    polygons=an_outline(chance),
                    expected_revision=None if mask is None else mask.revision,
                    author=author,
                )
            case "object":
                mask = chance.choice([*masks, None])
                box = None if mask is None else state.boxes.get(mask.box_id)
                editor.put_object(
                    sid,
                    box_id=None if mask is None else mask.box_id,
                    class_id=0,
                    box=Box(np.eye(4), np.ones(3)),
                    hull=HullMesh(np.eye(4, 3) * chance.random(), TETRAHEDRON),
                    hull_options=HullOptions(),
                    masks=[MaskDraft(0, an_outline(chance))],
                    expected_revision=None if box is None else box.revision,
                    expected_masks={} if mask is None else {mask.id: mask.revision},
                    author=author,
                )
            case "mesh":
                mesh = ObjectMesh(np.eye(4, 3) * chance.uniform(0.1, 1.0), TETRAHEDRON)
                sourced = SourcedMesh(mesh, MeshSource("m.stl", "m", "x,y,z", "file"))
                revision = state.classes[0].revision
                editor.change_class(sid, 0, expected_revision=revision, mesh=sourced, fit_size=None, author=author)
            case "unmask" if masks:
                mask = chance.choice(masks)
                editor.delete_mask(sid, mask.id, expected_revision=mask.revision, author=author)
            case "undo":
                editor.undo(sid, author=author)
            case _:
                editor.redo(sid, author=author)
    except ArsError:
        pass  # nothing to undo, or two authors at one box: an answer like any other


def an_outline(chance: random.Random) -> tuple[Polygon, ...]:
    return (Polygon(np.array([[chance.uniform(0, 8), chance.uniform(0, 8)] for _ in range(4)])),)


def one_round(folder: Path, sid: str, *, chance: random.Random, without: str | None, die_between: bool) -> int:
    """Fork an editor, kill it; the last revision that it acknowledged."""
    read, write = os.pipe()
    seed, life = chance.getrandbits(32), chance.uniform(0.0, LONGEST_LIFE)
    child = os.fork()
    if child == 0:
        os.close(read)
        try:
            edit_for_ever(folder, sid, seed=seed, pipe=write, without=without, die_between=die_between)
        finally:
            os._exit(3)  # an editor ends by being killed
    os.close(write)
    acknowledged, deadline = bytearray(), time.monotonic() + life
    while (left := deadline - time.monotonic()) > 0:
        if select.select([read], [], [], left)[0]:
            chunk = os.read(read, 1 << 16)
            if not chunk:
                break  # it killed itself
            acknowledged += chunk
    os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    while chunk := os.read(read, 1 << 16):
        acknowledged += chunk
    os.close(read)
    if not os.WIFSIGNALED(status):
        raise SystemExit(f"the editor ended by itself, with {os.waitstatus_to_exitcode(status)}")
    whole = len(acknowledged) // 8 * 8
    return int.from_bytes(acknowledged[whole - 8 : whole]) if whole else 0


def problems_after(folder: Path, sid: str, *, acknowledged: int) -> list[str]:
    """What was lost or torn."""
    with SessionStore(folder) as store:
        revision = store.revision(sid)
        lost = [f"revision {acknowledged} was acknowledged, the session is at {revision}"]
        torn = [problem for problem in store.check() if "images are not where" not in problem]
        return (lost if revision < acknowledged else []) + torn


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=20)
    parser.add_argument("--seed", type=int, default=None)
    parser.add_argument("--without", choices=["transaction", "order"])
    parser.add_argument("--die-between", action="store_true")
    asked = parser.parse_args()
    seed = random.randrange(1 << 32) if asked.seed is None else asked.seed
    chance = random.Random(seed)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "sessions"
        with SessionStore(folder) as store:
            frame = Frame("0.jpg", Path(place) / "0.jpg", 0, np.eye(4))
            recording = Recording("ars", Path(place), {0: Camera(8, 8, 5.0, 5.0, 4.0, 4.0)}, (frame,))
            sid = store.create(recording, name="killed", class_names=["cube"]).id
        last = 0
        for i in range(asked.rounds):
            acknowledged = one_round(folder, sid, chance=chance, without=asked.without, die_between=asked.die_between)
            last = max(last, acknowledged)
            problems = problems_after(folder, sid, acknowledged=last)
            if problems:
                sys.stdout.write(f"seed {seed}, kill {i + 1}: {'; '.join(problems)}\n")
                return 1
    sys.stdout.write(f"{asked.rounds} kills, {last} acknowledged edits, none lost, no gap, the log gives the tables\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
