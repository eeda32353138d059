"""Small recordings made by hand, and a store of their sessions."""

import json
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.polygon import Polygon
from ars_web.recordings.recording import Frame, Recording
from ars_web.sessions import migration
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.hull_mesh import HullMesh
from ars_web.sessions.object_mesh import MeshSource, ObjectMesh, SourcedMesh
from ars_web.sessions.store import SessionStore

MakeRecording = Callable[..., Recording]


@pytest.fixture
def make_recording(tmp_path: Path) -> MakeRecording:
    """A recording of `frames` frames on a circle; with `images`, there are files where it says."""

    def make(frames: int = 3, *, images: bool = False, **more: object) -> Recording:
        source = tmp_path / "recording"
        listed: list[Frame] = []
        for i in range(frames):
            name = f"cam{i % 2}/{i:05d}.jpg"
            path = source / "images" / name
            if images:
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(b"image %d" % i * 50)
            T = rigid_transform.from_rotation(
                rigid_transform.rotation_about_z(0.1 * i), np.array([np.cos(i), np.sin(i), 0.5])
            )
            listed.append(Frame(name, path, i % 2, T))
        cameras = {
            0: Camera(640, 480, 500.1, 500.2, 319.5, 239.5),
            1: Camera(320, 240, 250.0, 250.0, 159.5, 119.5, "brown", (0.1, -0.2, 1e-3, 2e-3, 0.3)),
        }
        return Recording("ars", source, cameras, tuple(listed), **{"class_names": ("cube",), **more})

    return make


@pytest.fixture
def store(tmp_path: Path) -> Iterator[SessionStore]:
    with SessionStore(tmp_path / "sessions") as store:
        yield store


@pytest.fixture
def editor(store: SessionStore) -> SessionEditor:
    return SessionEditor(store)


@pytest.fixture
def sid(store: SessionStore, make_recording: MakeRecording) -> str:
    """A session of three frames with one class, `cube`, of id 0."""
    return store.create(make_recording(), name="table").id


@pytest.fixture
def a_box() -> Callable[..., Box]:
    def make(x: float = 0.0, size: float = 0.1) -> Box:
        R = rigid_transform.rotation_about_z(0.3 + x)
        return Box(rigid_transform.from_rotation(R, np.array([x, 0.2, 0.3])), np.array([size, 0.2, 0.3]))

    return make


@pytest.fixture
def outline() -> Callable[..., tuple[Polygon, ...]]:
    """A triangle with a hole, at x, y pixels, in any frame's image."""

    def make(x: float = 20.0, y: float = 30.0) -> tuple[Polygon, ...]:
        corners = np.array([[0.0, 0.0], [60.0, 0.0], [60.0, 50.0]]) + np.array([x, y])
        return (Polygon(corners, (corners / 4 + np.array([x + 25, y + 5]) - corners[0] / 4,)),)

    return make


@pytest.fixture
def a_hull() -> Callable[..., HullMesh]:
    """A tetrahedron in its box, as high as asked."""

    def make(height: float = 1.0) -> HullMesh:
        corners = np.array([[-0.5, -0.5, -0.5], [0.5, -0.5, -0.5], [0.0, 0.5, -0.5], [0.1, 0.1, height - 0.5]])
        return HullMesh(corners, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]))

    return make


@pytest.fixture
def a_mesh() -> Callable[..., SourcedMesh]:
    """A tetrahedron, as high in metres as asked, and the file that it might be from."""

    def make(height: float = 1.0, *, name: str = "corner.stl") -> SourcedMesh:
        corners = np.array([[0.0, 0.0, 0.0], [0.25, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, height]])
        mesh = ObjectMesh(corners, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]))
        return SourcedMesh(mesh, MeshSource(name, "mm", "x,-z,y", "centre"))

    return make


@pytest.fixture
def made_by_older_program() -> Callable[[Path, str], None]:
    """Makes a session's database, which nobody has open, anew as the program with an older schema would have."""
    return _make_older


def _make_older(path: Path, schema: str) -> None:
    older = path.with_name("older.sqlite")
    migration.bring_up_to_date(older, target=schema)
    with closing(sqlite3.connect(older)) as connection:
        connection.execute("ATTACH ? AS newer", (str(path),))
        for (table,) in connection.execute("SELECT name FROM main.sqlite_master WHERE type = 'table'").fetchall():
            if table != "alembic_version":
                newer, names = (
                    [row[1] for row in connection.execute(f"PRAGMA {base}.table_info({table})")]
                    for base in ("newer", "main")
                )
                # Nothing of what came later is there, and what went since has its default: no box had a hull.
                assert not set(_LATER[schema]) & set(names)
                assert set(names) - set(newer) <= {"has_hull"}
                columns = ", ".join(name for name in names if name in newer)
                connection.execute(f"INSERT INTO main.{table} ({columns}) SELECT {columns} FROM newer.{table}")
        for select, update in (
            ("SELECT origin, id FROM session", "UPDATE session SET origin = ? WHERE id = ?"),
            ("SELECT changes, revision FROM edit", "UPDATE edit SET changes = ? WHERE revision = ?"),
        ):
            _forget_what_is_new(connection, select, update, later=_LATER[schema])
        connection.commit()
    path.unlink()
    older.rename(path)


_OF_0003 = ("locked", "default_size")
_OF_0004 = ("hull", "hull_options", "masks", "next_mask_id")
_OF_0005 = ("mesh", "symmetry", "keypoints")
_LATER = {
    "0001": (*_OF_0003, *_OF_0004, *_OF_0005),
    "0002": (*_OF_0003, *_OF_0004, *_OF_0005),
    "0003": (*_OF_0004, *_OF_0005),
    "0004": _OF_0005,
}
"""What databases of a schema do not hold, in columns and JSON."""


def _forget_what_is_new(connection: sqlite3.Connection, select: str, update: str, *, later: tuple[str, ...]) -> None:
    """Have JSON in the database be as older programs wrote it."""

    def older(item: dict[str, object]) -> dict[str, object]:
        said = {key: value for key, value in item.items() if key not in later}
        return {**said, "has_hull": False} if "rotation" in item and "hull" in later else said

    for text, key in connection.execute(select).fetchall():
        connection.execute(update, (json.dumps(json.loads(text, object_hook=older)), key))
