"""A session's rows as the model's records, and back. Every query and statement is here."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import orjson
from jaxtyping import Float
from sqlalchemy import Connection, Row, and_, delete, func, insert, or_, select, update
from sqlalchemy.dialects.sqlite import insert as upsert

from ars_web.errors import StoreError
from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.recordings.recording import Recording, SkippedFrame, StoredImage
from ars_web.recordings.stores import is_address
from ars_web.sessions import hull_rows, mask_rows, tables
from ars_web.sessions.edit_json import (
    changes_from_json,
    changes_json,
    default_size_from_json,
    state_from_json,
    state_json,
    utc_from_text,
    utc_text,
)
from ars_web.sessions.edits import BoxChange, ClassChange, Edit, MaskChange
from ars_web.sessions.history import LogEntry
from ars_web.sessions.model import FrameTable, ObjectClass, SessionState, SessionSummary, VirtualBox
from ars_web.sessions.shape_json import keypoints_from_text, keypoints_text, symmetry_from_text, symmetry_text

IMAGES = "images"
"""The folder, in a session's own, of images that were copied in."""

FRAMES_AT_ONCE = 2000


@dataclass(frozen=True)
class Request:
    """A request that was answered: what it asked for, as a digest, and the revision that was the answer."""

    digest: str
    revision: int


def load_revision(connection: Connection) -> int:
    """The session's revision."""
    return connection.execute(select(tables.session.c.revision)).scalar_one()


def load_summary(connection: Connection, sid: str) -> SessionSummary:
    """What a list shows of the session, counted now."""
    row = connection.execute(select(tables.session)).one()
    counts = [
        # Frames and skipped frames are numbered without gaps: their count is at hand without counting.
        select(func.coalesce(func.max(tables.frame.c.idx) + 1, 0)),
        select(func.coalesce(func.max(tables.skipped.c.idx) + 1, 0)),
        select(func.count()).select_from(tables.object_class),
        select(func.count()).select_from(tables.box),
    ]
    frames, skipped, classes, boxes = (connection.execute(count).scalar_one() for count in counts)
    return SessionSummary(
        id=sid,
        name=row.name,
        revision=row.revision,
        format=row.format,
        source=row.source,
        frames=frames,
        classes=classes,
        boxes=boxes,
        skipped=skipped,
        created=utc_from_text(row.created),
        changed=utc_from_text(row.changed),
    )


def load_state(connection: Connection) -> SessionState:
    """All that edits can change, from the tables."""
    row = connection.execute(select(tables.session)).one()
    classes = connection.execute(select(tables.object_class).order_by(tables.object_class.c.id))
    boxes = connection.execute(select(tables.box).order_by(tables.box.c.id))
    return SessionState(
        revision=row.revision,
        name=row.name,
        classes={c.id: _class(c) for c in classes},
        boxes={b.id: _box(b) for b in boxes},
        next_class_id=row.next_class_id,
        next_box_id=row.next_box_id,
        masks=mask_rows.load_masks(connection),
        next_mask_id=row.next_mask_id,
    )


def load_origin(connection: Connection) -> SessionState:
    """The state at revision 0."""
    return state_from_json(connection.execute(select(tables.session.c.origin)).scalar_one())


def load_cameras(connection: Connection) -> dict[int, Camera]:
    """The recording's cameras by id."""
    return {
        c.id: Camera(c.width, c.height, c.fx, c.fy, c.cx, c.cy, c.model, tuple(orjson.loads(c.distortion)))
        for c in connection.execute(select(tables.camera).order_by(tables.camera.c.id))
    }


def load_frames(connection: Connection, folder: Path) -> FrameTable:
    """All frames; `folder` is the session's own, where copied images lie.

    Raises:
        StoreError: a pose is not 96 bytes long.
    """
    f = tables.frame.c
    rows = connection.execute(select(f.name, f.image, f.camera_id, f.pose).order_by(f.idx)).all()
    names = tuple(row[0] for row in rows)
    own = folder / IMAGES
    images = tuple(own / row[0] if row[1] is None else _image(row[1]) for row in rows)
    camera_ids = np.array([row[2] for row in rows], dtype=np.int64)
    poses = _transforms(b"".join(row[3] for row in rows), count=len(rows))
    camera_ids.flags.writeable = False
    poses.flags.writeable = False
    return FrameTable(names, images, camera_ids, poses)


def load_skipped(connection: Connection) -> tuple[SkippedFrame, ...]:
    """What the recording listed and could not be used."""
    s = tables.skipped.c
    return tuple(
        SkippedFrame(row.name, row.reason, row.place)
        for row in connection.execute(select(s.name, s.reason, s.place).order_by(s.idx))
    )


def load_edits(connection: Connection, *, after: int = 0, limit: int | None = None) -> list[Edit]:
    """The log's entries with a revision above `after`, oldest first, at most `limit` of them."""
    e = tables.edit
    return [
        _edit(row)
        for row in connection.execute(select(e).where(e.c.revision > after).order_by(e.c.revision).limit(limit))
    ]


def load_newest_edits(connection: Connection, *, before: int | None, limit: int) -> list[Edit]:
    """The log's `limit` newest entries with a revision below `before` (None: of all), newest first."""
    e = tables.edit
    newest = select(e).order_by(e.c.revision.desc()).limit(limit)
    return [_edit(row) for row in connection.execute(newest if before is None else newest.where(e.c.revision < before))]


def load_inversions(connection: Connection, edits: Sequence[Edit]) -> list[LogEntry]:
    """The later undos and redos that bear on whether these edits stand, newest first; found by index."""
    e = tables.edit.c
    if not edits:
        return []
    newest = max(edit.revision for edit in edits)
    revisions = [edit.revision for edit in edits]
    # A later inversion of one of the edits, an inversion of that one, and so on. Their own ones are at hand.
    found = (
        select(e.revision, e.undoes, e.redoes)
        .where(or_(e.undoes.in_(revisions), e.redoes.in_(revisions)), e.revision > newest)
        .cte(recursive=True)
    )
    inverts = or_(e.undoes == found.c.revision, e.redoes == found.c.revision)
    # An edit inverts an earlier one. A damaged log may say otherwise, and the search must end.
    following = select(e.revision, e.undoes, e.redoes).join(found, and_(inverts, e.revision > found.c.revision))
    everything = found.union(following)
    chosen = select(everything).order_by(everything.c.revision.desc())
    return [LogEntry(revision, undoes, redoes) for revision, undoes, redoes in connection.execute(chosen)]


def load_edit(connection: Connection, revision: int) -> Edit:
    """The log's entry that made `revision`, which must exist."""
    return _edit(connection.execute(select(tables.edit).where(tables.edit.c.revision == revision)).one())


def newest_entries(connection: Connection, *, author: str) -> Iterator[LogEntry]:
    """The author's log, newest first, read only as far as it is asked for."""
    e = tables.edit.c
    newest = select(e.revision, e.undoes, e.redoes).where(e.author == author).order_by(e.revision.desc())
    with connection.execute(newest) as rows:
        for revision, undoes, redoes in rows:
            yield LogEntry(revision, undoes, redoes)


def load_request(connection: Connection, key: str) -> Request | None:
    """The request that came with an idempotency key."""
    r = tables.request.c
    found = connection.execute(select(r.digest, r.revision).where(r.key == key)).first()
    return None if found is None else Request(found.digest, found.revision)


def insert_request(connection: Connection, key: str, request: Request) -> None:
    """Keep what came with an idempotency key."""
    connection.execute(insert(tables.request).values(key=key, digest=request.digest, revision=request.revision))


def insert_recording(
    connection: Connection,
    recording: Recording,
    *,
    state: SessionState,
    at: datetime,
    copied: bool,
    progress: Callable[[int, int], None] | None = None,
) -> None:
    """Fill an empty database: the recording, and `state` as what the log starts from."""
    connection.execute(
        insert(tables.session).values(
            id=1,
            name=state.name,
            revision=state.revision,
            next_class_id=state.next_class_id,
            next_box_id=state.next_box_id,
            next_mask_id=state.next_mask_id,
            format=recording.format,
            source=str(recording.source),
            created=utc_text(at),
            changed=utc_text(at),
            origin=state_json(state),
        )
    )
    _insert_all(connection, tables.camera, [_camera_row(id_, c) for id_, c in recording.cameras.items()])
    total = len(recording.frames)
    for start in range(0, total, FRAMES_AT_ONCE):
        chunk = recording.frames[start : start + FRAMES_AT_ONCE]
        rows = [
            {
                "idx": start + i,
                "name": frame.name,
                "image": None if copied else str(_unlinked(frame.image)),
                "camera_id": frame.camera_id,
                "pose": _pose_bytes(frame.T_world_camera),
            }
            for i, frame in enumerate(chunk)
        ]
        _insert_all(connection, tables.frame, rows)
        if progress is not None and not copied:
            progress(start + len(chunk), total)
    _insert_all(
        connection,
        tables.skipped,
        [{"idx": i, "name": s.name, "reason": s.reason, "place": s.where} for i, s in enumerate(recording.skipped)],
    )
    _insert_all(connection, tables.object_class, [_class_row(c) for c in state.classes.values()])
    _insert_all(connection, tables.box, [_box_row(b) for b in state.boxes.values()])


def _image(text: str) -> Path | StoredImage:
    return StoredImage(text) if is_address(text) else Path(text)


def _unlinked(image: Path | StoredImage) -> Path | StoredImage:
    """Where the image lies: a link is followed now, so that whoever changes it later shows nothing else here.

    Readers have followed the links to its folder already.
    """
    return image.resolve() if isinstance(image, Path) and image.is_symlink() else image


def append_edit(connection: Connection, edit: Edit, state: SessionState) -> None:
    """Append `edit` to the log and bring the tables to `state`, which is the state after it."""
    connection.execute(
        insert(tables.edit).values(
            revision=edit.revision,
            author=edit.author,
            summary=edit.summary,
            changes=changes_json(edit.changes),
            undoes=edit.undoes,
            redoes=edit.redoes,
            at=utc_text(edit.at),
        )
    )
    apply_edit(connection, edit, state)


def apply_edit(connection: Connection, edit: Edit, state: SessionState) -> None:
    """Bring the tables to `state`, touching only what `edit` changes."""
    # A class may be made with the boxes and masks that use it, and only goes when they are gone.
    classes = [change for change in edit.changes if isinstance(change, ClassChange)]
    boxes = [change for change in edit.changes if isinstance(change, BoxChange)]
    for change in classes:
        if change.after is not None:
            _upsert(connection, tables.object_class, _class_row(change.after))
    for change in boxes:
        if change.after is None:
            connection.execute(delete(tables.box).where(tables.box.c.id == change.box_id))
        else:
            _upsert(connection, tables.box, _box_row(change.after))
    mask_rows.apply_changes(connection, [change for change in edit.changes if isinstance(change, MaskChange)])
    for change in classes:
        if change.after is None:
            connection.execute(delete(tables.object_class).where(tables.object_class.c.id == change.class_id))
    connection.execute(
        update(tables.session).values(
            name=state.name,
            revision=state.revision,
            next_class_id=state.next_class_id,
            next_box_id=state.next_box_id,
            next_mask_id=state.next_mask_id,
            changed=utc_text(edit.at),
        )
    )


def _insert_all(connection: Connection, table: Any, rows: list[dict[str, Any]]) -> None:
    if rows:
        connection.execute(insert(table), rows)


def _upsert(connection: Connection, table: Any, row: dict[str, Any]) -> None:
    values = {key: value for key, value in row.items() if key != "id"}
    connection.execute(upsert(table).values(**row).on_conflict_do_update(index_elements=["id"], set_=values))


def _edit(row: Row[Any]) -> Edit:
    return Edit(
        revision=row.revision,
        author=row.author,
        summary=row.summary,
        changes=changes_from_json(row.changes),
        undoes=row.undoes,
        redoes=row.redoes,
        at=utc_from_text(row.at),
    )


def _class(row: Row[Any]) -> ObjectClass:
    size = None if row.default_size is None else default_size_from_json(row.default_size)
    symmetry, keypoints = symmetry_from_text(row.symmetry), keypoints_from_text(row.keypoints)
    return ObjectClass(row.id, row.name, row.color, row.revision, size, row.mesh, symmetry, keypoints)


def _box(row: Row[Any]) -> VirtualBox:
    box = Box(_transforms(row.pose, count=1)[0], np.array([row.size_x, row.size_y, row.size_z]))
    options = hull_rows.options_from_text(row.hull_options)
    return VirtualBox(row.id, row.class_id, row.name, box, row.revision, row.locked, row.hull, options, row.mesh)


def _box_row(box: VirtualBox) -> dict[str, Any]:
    x, y, z = box.box.size.tolist()
    return {
        "id": box.id,
        "class_id": box.class_id,
        "name": box.name,
        "pose": _pose_bytes(box.box.T_world_box),
        "size_x": x,
        "size_y": y,
        "size_z": z,
        "revision": box.revision,
        "locked": box.locked,
        "hull": box.hull,
        "hull_options": hull_rows.options_text(box.hull_options),
        "mesh": box.mesh,
    }


def _class_row(a_class: ObjectClass) -> dict[str, Any]:
    size = a_class.default_size
    return {
        "id": a_class.id,
        "name": a_class.name,
        "color": a_class.color,
        "revision": a_class.revision,
        "default_size": None if size is None else orjson.dumps(size).decode(),
        "mesh": a_class.mesh,
        "symmetry": symmetry_text(a_class.symmetry),
        "keypoints": keypoints_text(a_class.keypoints),
    }


def _camera_row(camera_id: int, camera: Camera) -> dict[str, Any]:
    return {
        "id": camera_id,
        "width": camera.width,
        "height": camera.height,
        "fx": camera.fx,
        "fy": camera.fy,
        "cx": camera.cx,
        "cy": camera.cy,
        "model": camera.model,
        "distortion": orjson.dumps(camera.distortion).decode(),
    }


def _pose_bytes(T: Float[np.ndarray, "4 4"]) -> bytes:
    return np.ascontiguousarray(T[:3], dtype="<f8").tobytes()


def _transforms(poses: bytes, *, count: int) -> Float[np.ndarray, "n 4 4"]:
    if len(poses) != 96 * count:
        raise StoreError(f"a stored pose is damaged: {count} of them have {len(poses)} bytes, not {96 * count}")
    Ts = np.zeros((count, 4, 4))
    Ts[:, :3] = np.frombuffer(poses, dtype="<f8").reshape(count, 3, 4)
    Ts[:, 3, 3] = 1.0
    return Ts
