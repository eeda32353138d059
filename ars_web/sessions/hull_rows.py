"""The hulls of a session's database. They are named by what they hold, and only ever added."""

from collections.abc import Collection, Iterator
from typing import Any

import orjson
from sqlalchemy import Connection, Row, select
from sqlalchemy.dialects.sqlite import insert as upsert

from ars_web.errors import ArsError, NotFound, StoreError
from ars_web.sessions import tables
from ars_web.sessions.hull_json import options_from_json, options_json
from ars_web.sessions.hull_mesh import HullMesh
from ars_web.sessions.model import HullOptions

AT_ONCE = 500
"""Rows asked for by name in one statement; SQLite takes some thousands."""


def keep_hull(connection: Connection, hull: HullMesh) -> str:
    """Add `hull` unless it is there; its digest."""
    row = {"digest": hull.digest, "vertices": hull.vertex_bytes, "faces": hull.face_bytes}
    connection.execute(upsert(tables.hull).values(**row).on_conflict_do_nothing(index_elements=["digest"]))
    return hull.digest


def load_hull(connection: Connection, digest: str) -> HullMesh:
    """The hull of that name.

    Raises:
        NotFound: there is none.
        StoreError: it is damaged.
    """
    row = connection.execute(select(tables.hull).where(tables.hull.c.digest == digest)).first()
    if row is None:
        raise NotFound(f"this session has no hull {digest!r}")
    return _hull(row)


def load_hulls(connection: Connection, digests: Collection[str]) -> dict[str, HullMesh]:
    """The hulls of those names that are there.

    Raises:
        StoreError: one is damaged.
    """
    found: dict[str, HullMesh] = {}
    wanted = sorted(set(digests))
    for start in range(0, len(wanted), AT_ONCE):
        chunk = wanted[start : start + AT_ONCE]
        for row in connection.execute(select(tables.hull).where(tables.hull.c.digest.in_(chunk))):
            found[row.digest] = _hull(row)
    return found


def all_hulls(connection: Connection) -> Iterator[HullMesh]:
    """Every hull, one at a time.

    Raises:
        StoreError: one is damaged.
    """
    with connection.execute(select(tables.hull).order_by(tables.hull.c.digest)) as rows:
        for row in rows:
            yield _hull(row)


def options_text(options: HullOptions | None) -> str | None:
    """How a hull was made, as a box's row has it."""
    return None if options is None else orjson.dumps(options_json(options)).decode()


def options_from_text(text: str | None) -> HullOptions | None:
    """What `options_text` wrote.

    Raises:
        StoreError: it is something else.
    """
    try:
        return None if text is None else options_from_json(orjson.loads(text))
    except (ValueError, KeyError, TypeError, ArsError) as error:
        raise StoreError(f"how a box was made cannot be read from the session's database: {error}") from error


def _hull(row: Row[Any]) -> HullMesh:
    try:
        hull = HullMesh.from_bytes(row.vertices, row.faces)
    except ArsError as error:
        raise StoreError(f"hull {row.digest!r} in the session's database is damaged: {error}") from error
    if hull.digest != row.digest:
        raise StoreError(f"hull {row.digest!r} in the session's database is damaged: it holds another one")
    return hull
