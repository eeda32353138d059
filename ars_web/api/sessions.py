"""`/api/sessions`: the sessions themselves."""

from fastapi import APIRouter, Response

from ars_web.api import upload
from ars_web.api.dependencies import (
    AuthorDep,
    ExpectedRevision,
    IdempotencyKey,
    ServicesDep,
    StrictRoute,
    etag,
)
from ars_web.api.models import SessionChange, SessionDraft, SessionJson, SkippedFrameJson
from ars_web.api.problems import documented
from ars_web.api.roots import declared_root, safe_join, told_within
from ars_web.errors import Conflict
from ars_web.recordings.options import ReadOptions
from ars_web.recordings.registry import read_recording

router = APIRouter(tags=["sessions"], route_class=StrictRoute)
router.include_router(upload.router)


@router.get("/api/sessions", operation_id="sessions-list", responses=documented())
def sessions(services: ServicesDep) -> list[SessionJson]:
    """All sessions, oldest first."""
    return [SessionJson.of(summary) for summary in services.store.list()]


@router.post("/api/sessions", status_code=201, operation_id="sessions-create", responses=documented(404, 413))
def create(draft: SessionDraft, response: Response, services: ServicesDep, key: IdempotencyKey) -> SessionJson:
    """Make a session from a recording below a declared root; answers when all of it is read.

    Images stay where they are. Nothing outside the root is read.
    """
    root = declared_root(services.roots, draft.root)
    path = safe_join(root, draft.path)
    options = ReadOptions(within=root)
    with told_within(options):
        recording = read_recording(path, format=draft.format, options=options)
    made = services.store.create(recording, name=draft.name, class_names=draft.classes, key=key)
    response.headers["Location"] = f"/api/sessions/{made.id}"
    response.headers["ETag"] = etag(made.revision)
    return SessionJson.of(made)


@router.get("/api/sessions/{sid}", operation_id="sessions-get", responses=documented(404))
def get(sid: str, response: Response, services: ServicesDep) -> SessionJson:
    """One session."""
    summary = services.store.summary(sid)
    response.headers["ETag"] = etag(summary.revision)
    return SessionJson.of(summary)


@router.patch("/api/sessions/{sid}", operation_id="sessions-change", responses=documented(404, 412, 413, 428))
def change(
    sid: str,
    changes: SessionChange,
    response: Response,
    services: ServicesDep,
    author: AuthorDep,
    expected: ExpectedRevision,
) -> SessionJson:
    """Rename a session that is at the revision in `If-Match`."""
    if changes.name is None:
        summary = services.store.summary(sid)
        if summary.revision != expected:
            raise Conflict(f"the session is at revision {summary.revision}, not {expected}", current=summary)
    else:
        summary = services.editor.rename(sid, name=changes.name, expected_revision=expected, author=author)
    response.headers["ETag"] = etag(summary.revision)
    return SessionJson.of(summary)


@router.delete(
    "/api/sessions/{sid}", status_code=204, operation_id="sessions-delete", responses=documented(404, 412, 428)
)
def delete(sid: str, services: ServicesDep, expected: ExpectedRevision) -> None:
    """Put a session that is at the revision in `If-Match` into the trash; `restore` brings it back."""
    services.store.delete(sid, expected_revision=expected)


@router.post("/api/sessions/{sid}/restore", operation_id="sessions-restore", responses=documented(404))
def restore(sid: str, response: Response, services: ServicesDep, key: IdempotencyKey) -> SessionJson:
    """Bring a deleted session back. A repeat that carries an Idempotency-Key answers the session as it is."""
    if key is None or sid not in {summary.id for summary in services.store.list()}:
        services.store.restore(sid)
    summary = services.store.summary(sid)
    response.headers["ETag"] = etag(summary.revision)
    return SessionJson.of(summary)


@router.get("/api/sessions/{sid}/skipped", operation_id="skipped-frames-list", responses=documented(404))
def skipped(sid: str, services: ServicesDep) -> list[SkippedFrameJson]:
    """What the recording lists and could not be used, with the reason."""
    return [SkippedFrameJson(name=s.name, reason=s.reason, where=s.where) for s in services.store.skipped(sid)]
