"""Kills a server with SIGKILL while clients edit over HTTP, or in the middle of an export, and looks for what was lost.

    python tests/faults/kill_server.py --rounds 200
    python tests/faults/kill_server.py --export

Edits: each round starts the server on the same folder, lets several clients edit at once, and kills it at a random
moment. The next server must have every acknowledged edit, with what was answered, at its revision; its event stream,
from the last revision of the round before, must have no gap; boxes, masks and classes must be what those events lead
to; and a request that was cut off and is repeated with its Idempotency-Key must have been done once.

Export: the server is killed while it exports; the next one finishes by itself, and each file of the dataset must be
that of an undisturbed export.

Ends with 0 if all of that held, with 1 and the first failure if not. `--without` takes one protection away, to show
that a loss would be seen.
"""

import argparse
import hashlib
import io
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time
import uuid
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import httpx
import numpy as np

TOKEN = "token-of-the-kill-test"
CLIENTS = 4
LONGEST_LIFE = 0.5
"""Seconds that clients edit for at most, from the first acknowledgement on."""
PATIENCE = 120.0


class Lost(Exception):
    """Something acknowledged is gone, or something is there that should not be."""


# The server


def serve(folder: Path, without: str | None) -> None:
    """What runs in the process that is killed: the server as the command line starts it, or with a protection gone."""
    from ars_web import app
    from ars_web.datasets.exports import ExportJobs
    from ars_web.sessions.database import Database
    from ars_web.settings import Settings

    if without == "commit":
        held: dict[Path, Any] = {}
        lock = threading.RLock()

        @contextmanager
        def never_committing(self: Database) -> Iterator[Any]:
            with lock:
                if self.path not in held:
                    held[self.path] = self._engine.connect().execution_options(ars_write=True)
                    held[self.path].begin()
                yield held[self.path]

        Database.writing = never_committing
    elif without == "resume":
        ExportJobs.resume_unfinished = lambda self: None
    app.serve(Settings(sessions=folder / "sessions", roots={"data": folder / "root"}, port=0, token=TOKEN))


@dataclass
class Server:
    """A server process."""

    process: subprocess.Popen[str]
    url: str

    def client(self) -> httpx.Client:
        return httpx.Client(base_url=self.url, headers={"Authorization": f"Bearer {TOKEN}"}, timeout=PATIENCE)

    def kill(self) -> None:
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()


@contextmanager
def server(folder: Path, without: str | None) -> Iterator[Server]:
    command = [sys.executable, __file__, "--serve", str(folder), *(["--without", without] if without else [])]
    # The server is the ars_web beside this file, whether or not one is installed.
    search = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=search)
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        yield Server(process, next(word for word in line.split() if word.startswith("http://")).rstrip("/"))
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


# Edits


def a_box(chance: random.Random) -> dict[str, Any]:
    place = {"position": [0, 0, 0], "wxyz": [1, 0, 0, 0]}
    return {"class_id": 0, "T_world_box": place, "size": [chance.uniform(0.01, 1) for _ in range(3)]}


def a_mask(chance: random.Random) -> dict[str, Any]:
    """Of a new object; in thousandths of a pixel, as the server keeps them."""
    corners = [[chance.randrange(32_000) / 1000, chance.randrange(24_000) / 1000] for _ in range(3)]
    polygons = [{"outer": corners, "holes": []}]
    return {"box_id": None, "class_id": 0, "frame": chance.randrange(2), "polygons": polygons}


@dataclass(frozen=True)
class CutOff:
    """A request to add something that was not answered."""

    key: str
    address: str
    body: dict[str, Any]

    def is_of(self, change: dict[str, Any]) -> bool:
        """Whether the change is what the request asked for."""
        after = change["after"] or {}
        part = "size" if change["kind"] == "box" else "polygons"
        return change["before"] is None and part in self.body and after.get(part) == self.body[part]


@dataclass
class Client:
    """One client's own memory: what was acknowledged, and the request that was cut off."""

    acknowledged: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])
    cut_off: CutOff | None = None

    def edit(self, url: str, sid: str, seed: int) -> None:
        """Edit until the server is gone."""
        chance = random.Random(seed)
        mine: dict[str, list[dict[str, Any]]] = {"boxes": [], "masks": []}
        headers = {"Authorization": f"Bearer {TOKEN}"}
        with httpx.Client(base_url=url, headers=headers, timeout=PATIENCE) as client:
            try:
                while True:
                    self.edit_once(client, f"/api/sessions/{sid}", mine, chance)
            except httpx.TransportError:
                return

    def edit_once(
        self, client: httpx.Client, path: str, mine: dict[str, list[dict[str, Any]]], chance: random.Random
    ) -> None:
        action = chance.choice(["add", "add", "add", "change", "change", "delete", "undo", "redo"])
        kind = chance.choice(list(mine))
        one_is_there = mine[kind] != []
        if action in ("undo", "redo"):
            answer = client.post(f"{path}/{action}")
            if answer.status_code == 200:
                self.acknowledged.append({"revision": answer.json()["revision"], "edit": answer.json()})
        elif action == "add" or not one_is_there:
            cut = CutOff(uuid.uuid4().hex, f"{path}/{kind}", a_box(chance) if kind == "boxes" else a_mask(chance))
            self.cut_off = cut
            answer = client.post(cut.address, json=cut.body, headers={"Idempotency-Key": cut.key})
            assert answer.status_code == 201, answer.text
            self.cut_off = None
            mine[kind].append(answer.json())
            self.acknowledged.append({"revision": answer.json()["revision"], "after": answer.json()})
        else:
            thing = mine[kind].pop(chance.randrange(len(mine[kind])))
            one, tag = f"{path}/{kind}/{thing['id']}", {"If-Match": f'"{thing["revision"]}"'}
            if action == "change":
                if kind == "boxes":
                    answer = client.patch(one, json={"size": a_box(chance)["size"]}, headers=tag)
                else:
                    answer = client.put(one, json={"polygons": a_mask(chance)["polygons"]}, headers=tag)
                if answer.status_code == 200:  # else another client's undo took it
                    mine[kind].append(answer.json())
                    self.acknowledged.append({"revision": answer.json()["revision"], "after": answer.json()})
            else:
                answer = client.delete(one, headers=tag)
                if answer.status_code == 204:
                    self.acknowledged.append({"deleted": thing, "kind": kind})


@dataclass
class Session:
    """What the session must be, as far as its events have been followed."""

    id: str
    revision: int = 0
    boxes: dict[int, Any] = field(default_factory=dict[int, Any])
    masks: dict[int, Any] = field(default_factory=dict[int, Any])
    classes: dict[int, Any] = field(default_factory=dict[int, Any])

    def things(self, kind: str) -> dict[int, Any]:
        """Those that a kind of change is about."""
        return {"box": self.boxes, "mask": self.masks, "class": self.classes}[kind]


def edit_and_kill(running: Server, session: Session, chance: random.Random) -> list[Client]:
    """What each client remembers when the server has gone."""
    clients = [Client() for _ in range(CLIENTS)]
    threads = [
        threading.Thread(target=client.edit, args=(running.url, session.id, chance.getrandbits(32)))
        for client in clients
    ]
    for thread in threads:
        thread.start()
    wait_for(lambda: any(client.acknowledged for client in clients))
    time.sleep(chance.uniform(0, LONGEST_LIFE))  # the moment of the kill; nothing is waited for
    running.kill()
    for thread in threads:
        thread.join()
    return clients


def look(http: httpx.Client, session: Session, clients: list[Client]) -> None:
    """Compare the session with what was acknowledged; bring `session` up to date."""
    path = f"/api/sessions/{session.id}"
    # What was cut off is repeated first: done before or not, it is done once now.
    repeated = [cut for client in clients if (cut := client.cut_off) is not None]
    for cut in repeated:
        answer = http.post(cut.address, json=cut.body, headers={"Idempotency-Key": cut.key})
        if answer.status_code != 201:
            raise Lost(f"repeating what was cut off: {answer.text}")
    newest = http.get(path).json()["revision"]
    edits = {edit["revision"]: edit for edit in events(http, path, session.revision, newest)}
    if list(edits) != list(range(session.revision + 1, newest + 1)):
        raise Lost(f"revisions after {session.revision} up to {newest} have a gap: {list(edits)}")
    for client in clients:
        for told in client.acknowledged:
            found(told, edits, newest)
    for edit in edits.values():
        for change in edit["changes"]:
            things = session.things(change["kind"])
            if change["before"] != without_outline(things.get(change["id"])):
                raise Lost(f"revision {edit['revision']} does not follow from what was before it")
            if change["after"] is None:
                del things[change["id"]]
            else:
                things[change["id"]] = change["after"]
    session.revision = newest
    for part, things in (("boxes", session.boxes), ("masks", session.masks), ("classes", session.classes)):
        if http.get(f"{path}/{part}").json() != [things[i] for i in sorted(things)]:
            raise Lost(f"{part} are not what the events up to revision {newest} lead to")
    done = [
        change
        for edit in edits.values()
        for change in edit["changes"]
        if edit["undoes"] is None and edit["redoes"] is None
    ]
    for cut in repeated:
        times = sum(cut.is_of(change) for change in done)
        if times != 1:
            raise Lost(f"what was cut off and repeated was done {times} times")


def without_outline(thing: dict[str, Any] | None) -> dict[str, Any] | None:
    """As events tell of what was there before: a mask is without its outline."""
    return None if thing is None else {k: v for k, v in thing.items() if k not in ("polygons", "points")}


def found(told: dict[str, Any], edits: dict[int, Any], newest: int) -> None:
    """Raises Lost where what a client was told is not in the log."""
    if "deleted" in told:
        before, kind = without_outline(told["deleted"]), {"boxes": "box", "masks": "mask"}[told["kind"]]
        changes = [change for edit in edits.values() for change in edit["changes"] if change["kind"] == kind]
        if not any(change["before"] == before and change["after"] is None for change in changes):
            raise Lost(f"the deletion of {kind} {told['deleted']['id']} was acknowledged and is not in the log")
        return
    edit = edits.get(told["revision"])
    if edit is None:
        raise Lost(f"revision {told['revision']} was acknowledged, the session is at {newest}")
    same = edit == told["edit"] if "edit" in told else told["after"] in [change["after"] for change in edit["changes"]]
    if not same:
        raise Lost(f"revision {told['revision']} is not the edit that was acknowledged")


def events(http: httpx.Client, path: str, after: int, newest: int) -> Iterator[dict[str, Any]]:
    """The edits after a revision, from the event stream, as a browser asks for them when it comes back."""
    if after == newest:
        return
    with http.stream("GET", f"{path}/events", headers={"Last-Event-ID": str(after)}) as stream:
        name = ""
        for line in stream.iter_lines():
            if line.startswith("event: "):
                name = line.removeprefix("event: ")
            elif line.startswith("data: ") and name == "edit":
                edit = json.loads(line.removeprefix("data: "))
                yield edit
                if edit["revision"] >= newest:
                    return


def kill_edits(folder: Path, rounds: int, seed: int, without: str | None) -> str:
    chance = random.Random(seed)
    write_scene(folder / "root" / "scene", frames=2)
    with server(folder, None) as running, running.client() as client:
        session = Session(new_session(client))
        session.classes = {one["id"]: one for one in client.get(f"/api/sessions/{session.id}/classes").json()}
    acknowledged, clients = 0, list[Client]()
    for _ in range(rounds):
        with server(folder, without) as running:
            if clients:
                with running.client() as client:
                    look(client, session, clients)
            clients = edit_and_kill(running, session, chance)
            acknowledged += sum(len(client.acknowledged) for client in clients)
        if without is not None:
            break  # what a server without the protection says is not to be trusted
    with server(folder, None) as running, running.client() as client:
        look(client, session, clients)
    return f"{rounds} kills, {acknowledged} edits acknowledged, revision {session.revision}: none lost, no gap"


# Exports


def kill_export(folder: Path, without: str | None) -> str:
    """Kill a server that exports, let the next one finish, compare with an undisturbed export."""
    write_scene(folder / "root" / "scene", frames=160, size=(640, 480))
    body = {"format": "yolo", "options": {"images": "rectify"}}
    with server(folder, None) as running, running.client() as client:
        sid = new_session(client)
        place = {"position": [0, 0, 0.5], "wxyz": [1, 0, 0, 0]}
        client.post(f"/api/sessions/{sid}/boxes", json={"class_id": 0, "T_world_box": place, "size": [0.2, 0.2, 0.2]})
        started = client.post(f"/api/sessions/{sid}/exports", json=body)
        undisturbed = files_of(client, ended(client, started.headers["location"]))
    with server(folder, None) as running, running.client() as client:
        job = client.post(f"/api/sessions/{sid}/exports", json=body).headers["location"]
        done = wait_for(lambda: (now := client.get(job).json())["done"] > 0 and now)
        if done["state"] != "running":
            raise Lost(f"the export was not caught in its middle: {done}")
        running.kill()
    with server(folder, without) as running, running.client() as client:
        # Jobs run one after the other: when a new one has ended, one that goes on by itself has, too.
        small = {"format": "coco", "options": {"images": "none", "frames": {"list": [0]}}}
        ended(client, client.post(f"/api/sessions/{sid}/exports", json=small).headers["location"])
        state = client.get(job).json()
        if state["state"] != "done":
            raise Lost(f"the export that was killed is {state['state']} for ever")
        files = files_of(client, state)
    if files != undisturbed:
        different = sorted({name for name, _ in files.items() ^ undisturbed.items()})
        raise Lost(f"{len(different)} files differ from an undisturbed export's, such as {different[0]}")
    return f"killed at {done['done']} of {done['total']} frames; {len(files)} files as in an undisturbed export"


def ended(client: httpx.Client, job: str) -> dict[str, Any]:
    return wait_for(lambda: (now := client.get(job).json())["state"] in ("done", "failed") and now)


def files_of(client: httpx.Client, job: dict[str, Any]) -> dict[str, str]:
    """The SHA-256 of each file of a dataset by its path."""
    data = client.get(f"/api/exports/{job['id']}/download").content
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return {n.partition("/")[2]: hashlib.sha256(archive.read(n)).hexdigest() for n in archive.namelist()}


def wait_for(condition: Any) -> Any:
    deadline = time.monotonic() + PATIENCE
    pause = threading.Event()
    while not (value := condition()):
        if time.monotonic() > deadline:
            raise Lost(f"nothing came in {PATIENCE:g} s")
        pause.wait(0.01)
    return value


def new_session(client: httpx.Client) -> str:
    made = client.post("/api/sessions", json={"name": "s", "root": "data", "path": "scene", "classes": ["thing"]})
    assert made.status_code == 201, made.text
    return made.json()["id"]


def write_scene(folder: Path, *, frames: int, size: tuple[int, int] = (32, 24)) -> None:
    """An ARS scene of noise, which takes a while to decode and to encode."""
    width, height = size
    noise = np.random.default_rng(0).integers(0, 256, (height, width, 3), dtype=np.uint8)
    (folder / "images").mkdir(parents=True)
    for i in range(frames):
        assert cv2.imwrite(str(folder / "images" / f"{i:05d}.jpg"), np.roll(noise, i, axis=1))
    (folder / "robot_poses.txt").write_text("".join(f"{0.001 * i} 0 -1 0 0 0 1\n" for i in range(frames)))
    (folder / "camera_extrinsics.txt").write_text("0 0 0 0 0 0 1\n")
    intrinsics = [width, height, width, width, width / 2, height / 2, -0.1, 0.01, 0, 0]
    (folder / "camera_intrinsics.txt").write_text(" ".join(map(str, intrinsics)) + "\n")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=20)
    parser.add_argument("--export", action="store_true")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--without", choices=["commit", "resume"])
    parser.add_argument("--serve", type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.serve is not None:
        serve(given.serve, given.without)
        return 0
    with tempfile.TemporaryDirectory() as folder:
        try:
            if given.export:
                done = kill_export(Path(folder), given.without)
            else:
                done = kill_edits(Path(folder), given.rounds, given.seed, given.without)
        except Lost as loss:
            sys.stdout.write(f"LOST: {loss}\n")
            return 1
    sys.stdout.write(f"{done}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
