"""`/api/sessions/{sid}/undo`, `redo` and `events`: how a session changed, and how it changes now."""

from typing import Annotated

from fastapi import APIRouter, Header, Query, Response
from fastapi.responses import StreamingResponse
from starlette.concurrency import run_in_threadpool

from ars_web.api.dependencies import AuthorDep, IdempotencyKey, ServicesDep, StrictRoute, etag
from ars_web.api.models import EditJson, HistoryPage
from ars_web.api.problems import documented

router = APIRouter(prefix="/api/sessions/{sid}", tags=["history"], route_class=StrictRoute)

Revision = Annotated[int | None, Query(ge=0, lt=2**53, description="the last revision that the client has")]


@router.get("/history", operation_id="history-list", responses=documented(404))
def history(
    sid: str,
    response: Response,
    services: ServicesDep,
    author: AuthorDep,
    limit: Annotated[int, Query(ge=1, le=500)] = 50,
    before: Annotated[int | None, Query(ge=1, lt=2**53, description="only edits below this revision")] = None,
) -> HistoryPage:
    """What was done in the session, the newest first; `before` the last one's revision for those that follow."""
    found = services.store.history(sid, author=author, before=before, limit=limit)
    response.headers["ETag"] = etag(found.revision)
    return HistoryPage.of(found, author=author)


@router.post("/undo", operation_id="history-undo", responses=documented(404, 409))
def undo(sid: str, response: Response, services: ServicesDep, author: AuthorDep, key: IdempotencyKey) -> EditJson:
    """Take back the caller's newest edit that stands, by an edit that inverts it."""
    edit = services.editor.undo(sid, author=author, key=key)
    response.headers["ETag"] = etag(edit.revision)
    return EditJson.of(edit)


@router.post("/redo", operation_id="history-redo", responses=documented(404, 409))
def redo(sid: str, response: Response, services: ServicesDep, author: AuthorDep, key: IdempotencyKey) -> EditJson:
    """Make again what the caller's newest undo took back."""
    edit = services.editor.redo(sid, author=author, key=key)
    response.headers["ETag"] = etag(edit.revision)
    return EditJson.of(edit)


@router.get(
    "/events",
    operation_id="events-stream",
    response_class=StreamingResponse,
    responses={
        200: {
            "description": "events `ready`, `edit` (data as EditJson), `reset`, `gone`; each id is a revision",
            "content": {"text/event-stream": {"schema": {"type": "string"}}},
        },
        **documented(404),
    },
)
async def events(
    sid: str,
    services: ServicesDep,
    after: Revision = None,
    last_event_id: Annotated[
        int | None, Header(ge=0, lt=2**53, description="as `after`, which it overrides; browsers send it by themselves")
    ] = None,
) -> StreamingResponse:
    """Server-Sent Events: every edit after a revision, those of the past first; without one, from now on."""
    await run_in_threadpool(services.store.revision, sid)  # an unknown session is answered before the stream begins
    start = after if last_event_id is None else last_event_id
    return StreamingResponse(
        services.events.stream(sid, after=start),
        media_type="text/event-stream",
        headers={"X-Accel-Buffering": "no"},  # proxies that gather what they pass on would hold events back
    )
