"""The masks of a session's database."""

from collections.abc import Sequence
from typing import Any

import orjson
from sqlalchemy import Connection, Row, delete, select
from sqlalchemy.dialects.sqlite import insert as upsert

from ars_web.errors import ArsError, StoreError
from ars_web.sessions import tables
from ars_web.sessions.edits import MaskChange
from ars_web.sessions.model import Mask, checked_origin
from ars_web.sessions.outlines import polygons_from_json, polygons_json


def load_masks(connection: Connection) -> dict[int, Mask]:
    """All masks by id, ascending.

    Raises:
        StoreError: one is damaged.
    """
    return {row.id: _mask(row) for row in connection.execute(select(tables.mask).order_by(tables.mask.c.id))}


def apply_changes(connection: Connection, changes: Sequence[MaskChange]) -> None:
    """Bring the rows to what `changes` leave."""
    gone = [change.mask_id for change in changes if change.after is None]
    # First: another mask may take the place of one that goes, in the same frame.
    for mask_id in gone:
        connection.execute(delete(tables.mask).where(tables.mask.c.id == mask_id))
    for change in changes:
        if change.after is not None:
            row = _row(change.after)
            values = {key: value for key, value in row.items() if key != "id"}
            connection.execute(
                upsert(tables.mask).values(**row).on_conflict_do_update(index_elements=["id"], set_=values)
            )


def _mask(row: Row[Any]) -> Mask:
    try:
        polygons = polygons_from_json(orjson.loads(row.polygons))
        origin = checked_origin(row.origin)
    except (ValueError, KeyError, TypeError, ArsError) as error:
        raise StoreError(f"mask {row.id} in the session's database is damaged: {error}") from error
    return Mask(row.id, row.box_id, row.frame, row.class_id, polygons, origin, row.accepted, row.revision)


def _row(mask: Mask) -> dict[str, Any]:
    return {
        "id": mask.id,
        "box_id": mask.box_id,
        "frame": mask.frame,
        "class_id": mask.class_id,
        "polygons": orjson.dumps(polygons_json(mask.polygons)).decode(),
        "origin": mask.origin,
        "accepted": mask.accepted,
        "revision": mask.revision,
    }
