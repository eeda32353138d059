"""`/api/exports`: training sets in the making, and their download."""

import asyncio
from collections.abc import Iterator
from threading import Event

from fastapi import APIRouter, Request, Response
from fastapi.responses import StreamingResponse
from starlette.concurrency import run_in_threadpool

from ars_web.api.dependencies import IdempotencyKey, ServicesDep, StrictRoute
from ars_web.api.models import ExportDraft, ExportJson
from ars_web.api.problems import documented
from ars_web.api.zip_stream import zip_stream
from ars_web.datasets.forecast import Forecast
from ars_web.errors import Conflict

router = APIRouter(tags=["exports"], route_class=StrictRoute)


@router.get("/api/sessions/{sid}/exports", operation_id="exports-list", responses=documented(404))
def exports(sid: str, services: ServicesDep) -> list[ExportJson]:
    """The exports of a session, the newest first."""
    services.store.revision(sid)
    return [ExportJson.of(job) for job in services.exports.list(sid)]


@router.post(
    "/api/sessions/{sid}/exports",
    status_code=202,
    operation_id="exports-create",
    responses=documented(404, 413),
)
def create(sid: str, draft: ExportDraft, response: Response, services: ServicesDep, key: IdempotencyKey) -> ExportJson:
    """Start an export; ask for it again to see how far it is."""
    job = services.exports.start(sid, format=draft.format, options=draft.options, key=key)
    response.headers["Location"] = f"/api/exports/{job.id}"
    return ExportJson.of(job)


@router.post(
    "/api/sessions/{sid}/exports/preview",
    operation_id="exports-preview",
    responses=documented(404, 409, 413),
)
async def preview(
    sid: str, draft: ExportDraft, request: Request, services: ServicesDep, key: IdempotencyKey
) -> Forecast:
    """What an export would write of the session as it is now: the counts that its report then has.

    Nothing is written, so a repeat is harmless. Long sessions take seconds; who hangs up stops the work.
    """
    left = Event()
    watch = asyncio.create_task(_when_left(request, left))
    try:
        return await run_in_threadpool(
            services.exports.forecast, sid, format=draft.format, options=draft.options, cancelled=left.is_set
        )
    finally:
        watch.cancel()


@router.delete(
    "/api/exports/{export_id}", status_code=204, operation_id="exports-delete", responses=documented(404, 409)
)
def delete(export_id: str, services: ServicesDep) -> None:
    """Delete an export that has ended, and its dataset. It cannot change any more, so no `If-Match` is needed."""
    services.exports.delete(export_id)


@router.get("/api/exports/{export_id}", operation_id="exports-get", responses=documented(404))
def get(export_id: str, services: ServicesDep) -> ExportJson:
    """An export: how far it is, and its report once it is done."""
    return ExportJson.of(services.exports.get(export_id))


@router.post("/api/exports/{export_id}/cancel", operation_id="exports-cancel", responses=documented(404, 409))
def cancel(export_id: str, services: ServicesDep, key: IdempotencyKey) -> ExportJson:
    """Stop an export within two seconds; one that has ended stays as it is, so a repeat is harmless."""
    services.exports.cancel(export_id)
    return ExportJson.of(services.exports.cancel(export_id))


@router.get(
    "/api/exports/{export_id}/download",
    operation_id="exports-download",
    response_class=StreamingResponse,
    responses={
        200: {"description": "the dataset as a zip, not compressed", "content": {"application/zip": {}}},
        **documented(404, 409),
    },
)
def download(export_id: str, services: ServicesDep) -> StreamingResponse:
    """The finished dataset as one zip, written while it is sent."""
    job = services.exports.get(export_id)
    if job.state != "done":
        raise Conflict(f"export {export_id} is {job.state}; it can be downloaded once it is done")
    name = f"{job.session_id}-{job.format}-{job.id}"
    pieces: Iterator[bytes] = zip_stream(services.exports.dataset_folder(export_id), top=name)
    return StreamingResponse(
        pieces,
        media_type="application/zip",
        headers={"Content-Disposition": f'attachment; filename="{name}.zip"'},
    )


async def _when_left(request: Request, left: Event) -> None:
    """Set `left` once the client is gone. The request's body has been read: what comes now is its end."""
    while (await request.receive())["type"] != "http.disconnect":
        pass
    left.set()
