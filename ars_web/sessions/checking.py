"""What is wrong with a session, in words, for `ars-web check` and before a stranger's session is taken in."""

import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
from sqlalchemy import Connection, Integer, func, select
from sqlalchemy.sql.sqltypes import Boolean, Float, LargeBinary

from ars_web.errors import ArsError
from ars_web.geometry.rigid_transform import ROTATION_TOLERANCE
from ars_web.sessions import hull_rows, mesh_rows, rows, tables
from ars_web.sessions.edits import BoxChange, ClassChange, Edit, differences, replay
from ars_web.sessions.model import SessionState
from ars_web.sessions.names import checked_image_name
from ars_web.sessions.outlines import checked_polygons

_STORED_AS = {Boolean: ("integer",), Integer: ("integer",), Float: ("real", "integer"), LargeBinary: ("blob",)}


def check_session(connection: Connection, folder: Path) -> list[str]:
    """All that is wrong with the session in `folder`."""
    return check_database(connection) or check_contents(connection) + check_images(connection, folder)


def check_strange(path: Path) -> list[str]:
    """What no session's database has: damaged pages, triggers, views. Asked before anything else is, so that
    nothing of a stranger's runs."""
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("PRAGMA trusted_schema = OFF")
        found = connection.execute("SELECT type, name, tbl_name FROM sqlite_master").fetchall()
    known = {*tables.metadata.tables, "alembic_version"}
    return [
        f"it has a {kind} {name!r}, which ars-web never makes"
        for kind, name, table in found
        if kind not in ("table", "index") or table not in known
    ]


def check_database(connection: Connection) -> list[str]:
    """What is wrong with the database as such: damaged pages, rows that refer to nothing, values of a wrong kind."""
    said = [str(row[0]) for row in connection.exec_driver_sql("PRAGMA quick_check(5)")]
    if said != ["ok"]:
        return [f"the database is damaged: {'; '.join(said)}"]
    broken = connection.exec_driver_sql("PRAGMA foreign_key_check").all()
    problems = [f"a row of {row[0]} refers to a row of {row[2]} that is not there" for row in broken[:5]]
    if not connection.execute(select(func.count()).select_from(tables.session)).scalar_one():
        problems.append("the row that describes the session is gone")
    return problems + _wrong_kinds(connection)


def check_contents(connection: Connection) -> list[str]:
    """What is wrong with the log, the state and the recording; what cannot be read at all ends the search."""
    try:
        # Masks name frames, which must be sound.
        return check_log(connection) + check_recording(connection) or check_masks(connection)
    except (ArsError, ValueError, TypeError, AttributeError) as error:
        return [f"the session cannot be read: {error}"]


def check_portable(connection: Connection) -> list[str]:
    """What is wrong with the contents of a session that came from elsewhere."""
    outside = select(tables.frame.c.name).where(tables.frame.c.image.is_not(None)).limit(1)
    first = connection.execute(outside).scalar_one_or_none()
    if first is not None:
        return [f"the image of frame {first!r} lies outside of it; export the session, do not copy its folder"]
    return check_contents(connection)


def _wrong_kinds(connection: Connection) -> list[str]:
    """SQLite takes any kind of value in any column; a session from elsewhere may hold what no code expects."""
    problems: list[str] = []
    for table in tables.metadata.sorted_tables:
        for column in table.columns:
            kinds = next((k for type_, k in _STORED_AS.items() if isinstance(column.type, type_)), ("text",))
            allowed = (*kinds, "null") if column.nullable else kinds
            wrong = select(func.count()).select_from(table).where(func.typeof(column).not_in(allowed))
            if connection.execute(wrong).scalar_one():
                problems.append(f"{table.name}.{column.name} holds a value that is no {' or '.join(allowed)}")
    return problems


def check_log(connection: Connection) -> list[str]:
    """Whether the log has no gap, and leads from its beginning to the very state that the tables hold."""
    edits, state = rows.load_edits(connection), rows.load_state(connection)
    revisions = [edit.revision for edit in edits]
    if revisions != list(range(1, state.revision + 1)):
        missing = sorted(set(range(1, state.revision + 1)) - set(revisions))
        beyond = [revision for revision in revisions if revision > state.revision]
        return [f"the log does not lead to revision {state.revision}: missing {missing[:5]}, beyond it {beyond[:5]}"]
    origin = rows.load_origin(connection)
    problems = [] if origin.revision == 0 else [f"the log starts at revision {origin.revision}, not 0"]
    try:
        unlike = differences(replay(origin, edits), state)
    except ArsError as error:
        return [*problems, f"the log cannot be replayed: {error}"]
    missing = sorted(_hulls_named(origin, edits) - {hull.digest for hull in hull_rows.all_hulls(connection)})
    problems += [f"a box of the log has hull {digest}, which is not there" for digest in missing[:5]]
    meshes = {sourced.mesh.digest for sourced in mesh_rows.all_meshes(connection)}
    missing = sorted(_meshes_named(origin, edits) - meshes)
    problems += [f"a class or a box of the log has mesh {digest}, which is not there" for digest in missing[:5]]
    return problems + [f"the log and the tables differ in {what}" for what in unlike[:5]]


def _hulls_named(origin: SessionState, edits: list[Edit]) -> set[str]:
    changes = (change for edit in edits for change in edit.changes if isinstance(change, BoxChange))
    boxes = (*origin.boxes.values(), *(box for change in changes for box in (change.before, change.after)))
    return {box.hull for box in boxes if box is not None and box.hull is not None}


def _meshes_named(origin: SessionState, edits: list[Edit]) -> set[str]:
    changes = (change for edit in edits for change in edit.changes if isinstance(change, BoxChange | ClassChange))
    changed = (thing for change in changes for thing in (change.before, change.after))
    return {*origin.meshes_named, *(thing.mesh for thing in changed if thing is not None and thing.mesh is not None)}


def check_masks(connection: Connection) -> list[str]:
    """Whether every outline can be one of its frame's image."""
    frames, cameras = rows.load_frames(connection, Path()), rows.load_cameras(connection)
    for mask in rows.load_state(connection).masks.values():
        camera = cameras[int(frames.camera_ids[mask.frame])]
        try:
            checked_polygons(mask.polygons, width=camera.width, height=camera.height)
        except ArsError as error:
            return [f"mask {mask.id}, of object {mask.box_id} in frame {mask.frame}: {error}"]
    return []


def check_recording(connection: Connection) -> list[str]:
    """Whether frames are numbered without gaps, have sound names and poses, and cameras can be cameras."""
    rows.load_cameras(connection)
    rows.load_skipped(connection)
    frames = rows.load_frames(connection, Path())
    problems: list[str] = []
    last = connection.execute(select(func.max(tables.frame.c.idx))).scalar_one()
    if last is None or last != len(frames) - 1 or connection.execute(select(func.min(tables.frame.c.idx))).scalar_one():
        problems.append("frames are not numbered from 0 without gaps, or there are none")
    for name in frames.names:
        try:
            checked_image_name(name)
        except ArsError as error:
            problems.append(str(error))
            break
    R = frames.Ts_world_camera[:, :3, :3]
    off = np.abs(np.swapaxes(R, 1, 2) @ R - np.eye(3)).max(axis=(1, 2))
    unsound = np.flatnonzero(~(off < ROTATION_TOLERANCE) | ~np.isfinite(frames.Ts_world_camera).all(axis=(1, 2)))
    if unsound.size:
        problems.append(f"{unsound.size} poses are no rigid transforms, the first that of frame {unsound[0]}")
    return problems


def check_images(connection: Connection, folder: Path) -> list[str]:
    """Whether every frame's image is where the session says."""
    images = rows.load_frames(connection, folder).images
    # Those on a store are looked at by whoever exports them.
    missing = [image for image in images if isinstance(image, Path) and not image.is_file()]
    if not missing:
        return []
    return [
        f"{len(missing)} images are not where they were, the first is {missing[0]}: bring them back, or import the"
        " recording again with --copy"
    ]
