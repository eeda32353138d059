"""The meshes of a session's database. They are named by what they hold, and only ever added."""

from collections.abc import Collection, Iterator
from typing import Any

from sqlalchemy import Connection, Row, select
from sqlalchemy.dialects.sqlite import insert as upsert

from ars_web.errors import ArsError, NotFound, StoreError
from ars_web.sessions import tables
from ars_web.sessions.hull_rows import AT_ONCE
from ars_web.sessions.object_mesh import MeshSource, ObjectMesh, SourcedMesh


def keep_mesh(connection: Connection, sourced: SourcedMesh) -> str:
    """Add the mesh unless it is there, from wherever it came first; its digest."""
    mesh, source = sourced.mesh, sourced.source
    row = {
        "digest": mesh.digest,
        "vertices": mesh.vertex_bytes,
        "faces": mesh.face_bytes,
        "source": source.name,
        "unit": source.unit,
        "axes": source.axes,
        "origin": source.origin,
    }
    connection.execute(upsert(tables.mesh).values(**row).on_conflict_do_nothing(index_elements=["digest"]))
    return mesh.digest


def load_mesh(connection: Connection, digest: str) -> SourcedMesh:
    """The mesh of that name.

    Raises:
        NotFound: there is none.
        StoreError: it is damaged.
    """
    row = connection.execute(select(tables.mesh).where(tables.mesh.c.digest == digest)).first()
    if row is None:
        raise NotFound(f"this session has no mesh {digest!r}")
    return _mesh(row)


def load_meshes(connection: Connection, digests: Collection[str]) -> dict[str, SourcedMesh]:
    """The meshes of those names that are there.

    Raises:
        StoreError: one is damaged.
    """
    found: dict[str, SourcedMesh] = {}
    wanted = sorted(set(digests))
    for start in range(0, len(wanted), AT_ONCE):
        chunk = wanted[start : start + AT_ONCE]
        for row in connection.execute(select(tables.mesh).where(tables.mesh.c.digest.in_(chunk))):
            found[row.digest] = _mesh(row)
    return found


def all_meshes(connection: Connection) -> Iterator[SourcedMesh]:
    """Every mesh, one at a time.

    Raises:
        StoreError: one is damaged.
    """
    with connection.execute(select(tables.mesh).order_by(tables.mesh.c.digest)) as rows:
        for row in rows:
            yield _mesh(row)


def _mesh(row: Row[Any]) -> SourcedMesh:
    try:
        mesh = ObjectMesh.from_bytes(row.vertices, row.faces)
        source = MeshSource(row.source, row.unit, row.axes, row.origin)
    except ArsError as error:
        raise StoreError(f"mesh {row.digest!r} in the session's database is damaged: {error}") from error
    if mesh.digest != row.digest:
        raise StoreError(f"mesh {row.digest!r} in the session's database is damaged: it holds another one")
    return SourcedMesh(mesh, source)
