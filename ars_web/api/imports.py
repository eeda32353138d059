"""`/api/imports`: looking at a recording, sending one, and making a session of it while one watches."""

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response
from starlette.concurrency import run_in_threadpool

from ars_web.api.dependencies import IdempotencyKey, Services, ServicesDep, StrictRoute
from ars_web.api.import_models import ImportDraft, ImportJson, LookDraft, LookJson, UploadJson
from ars_web.api.multipart_form import MultipartForm
from ars_web.api.pictures import PictureRequest, picture, recorded_image
from ars_web.api.problems import documented
from ars_web.api.roots import declared_root, safe_join, told_within
from ars_web.recordings.options import ReadOptions
from ars_web.sessions.import_jobs import ImportOrder
from ars_web.sessions.uploads import Upload

router = APIRouter(prefix="/api/imports", tags=["imports"], route_class=StrictRoute)

_UPLOAD_BODY: dict[str, Any] = {
    "required": True,
    "content": {
        "multipart/form-data": {
            "schema": {
                "type": "object",
                "required": ["file"],
                "properties": {"file": {"type": "string", "format": "binary", "description": "a recording, as a zip"}},
            }
        }
    },
}


@dataclass(frozen=True)
class _Place:
    """Where a draft's recording lies."""

    path: Path
    options: ReadOptions
    upload: Upload | None


@router.post(
    "/uploads",
    status_code=201,
    operation_id="uploads-create",
    responses=documented(413),
    openapi_extra={"requestBody": _UPLOAD_BODY},
)
async def upload(request: Request, services: ServicesDep, key: IdempotencyKey) -> UploadJson:
    """Send a zipped recording. It is unpacked, and waits for a day to be looked at and imported."""
    things = ExitStack()
    try:
        folder = await run_in_threadpool(things.enter_context, services.uploads.receiving())
        form = MultipartForm(folder / "upload.zip", known=())
        await form.receive(
            request.headers.get("content-type", ""),
            request.stream(),
            declared=request.headers.get("content-length"),
            most=services.largest_upload,
        )
        return UploadJson.of(await run_in_threadpool(_keep, services, form, key))
    finally:
        await run_in_threadpool(things.close)  # it takes away a folder that may be large


def _keep(services: Services, form: MultipartForm, key: str | None) -> Upload:
    with told_within(ReadOptions(within=form.archive.parent)):
        return services.uploads.keep(form.archive, file_name=form.file_name or form.archive.name, key=key)


@router.post("/look", operation_id="imports-look", responses=documented(404, 413))
def look(draft: LookDraft, services: ServicesDep, key: IdempotencyKey) -> LookJson:
    """What an import would make: the recording is read as by an import, and nothing is stored. A repeat looks again."""
    place = _place(draft, services)
    with told_within(place.options):
        found = services.looks.look(place.path, format=draft.format, options=place.options)
    source = found.recording.source
    made_before = [summary.name for summary in services.store.list() if Path(summary.source) == source]
    warnings = [f"the session {made_before[-1]} was made of this recording already"] if made_before else []
    return LookJson.of(found, place.options, warnings=warnings)


@router.get(
    "/look/image",
    operation_id="look-image-get",
    response_class=Response,
    responses={
        200: {"description": "the image", "content": {"image/jpeg": {}, "image/png": {}}},
        **documented(404, 413),
    },
)
def look_image(
    services: ServicesDep,
    look: Annotated[str, Query(max_length=100, description="the id of a look")],
    frame: Annotated[int, Query(ge=0, lt=2**53, description="one of its sample frames")],
    width: Annotated[int, Query(ge=1, le=4096, description="pixels; never wider than the image is")] = 320,
) -> Response:
    """A sample frame of a recording that was looked at."""
    found = services.looks.image(look, frame)
    with told_within(ReadOptions(within=found.within)):
        path = recorded_image(found.path, own=found.within)
        data, media_type = picture(PictureRequest(path, found.camera, width, rectified=False))
    return Response(data, media_type=media_type)


@router.get("", operation_id="imports-list", responses=documented())
def imports(services: ServicesDep) -> list[ImportJson]:
    """The imports since the server was started, the newest first."""
    return [ImportJson.of(job) for job in services.imports.list()]


@router.post("", status_code=202, operation_id="imports-create", responses=documented(404, 413))
def create(draft: ImportDraft, response: Response, services: ServicesDep, key: IdempotencyKey) -> ImportJson:
    """Start an import; ask for it again to see how far it is. Images below a root stay where they are, those of an
    upload are kept with the session."""
    place = _place(draft, services)
    order = ImportOrder(
        path=place.path,
        name=draft.name,
        format=draft.format,
        classes=tuple(draft.classes),
        options=place.options,
        upload=place.upload,
    )
    job = services.imports.start(order, key=key)
    response.headers["Location"] = f"/api/imports/{job.id}"
    return ImportJson.of(job)


@router.get("/{import_id}", operation_id="imports-get", responses=documented(404))
def get(import_id: str, services: ServicesDep) -> ImportJson:
    """An import: how far it is, and its session once it is done."""
    return ImportJson.of(services.imports.get(import_id))


@router.post("/{import_id}/cancel", operation_id="imports-cancel", responses=documented(404))
def cancel(import_id: str, services: ServicesDep, key: IdempotencyKey) -> ImportJson:
    """Stop an import, which then leaves nothing; one that has ended, or is about to, stays as it is."""
    return ImportJson.of(services.imports.cancel(import_id))


def _place(draft: LookDraft, services: Services) -> _Place:
    sent = services.uploads.get(draft.upload) if draft.upload is not None else None
    root = declared_root(services.roots, draft.root or "") if sent is None else sent.folder
    base = root if sent is None else sent.recording
    options = ReadOptions(
        images=None if draft.images is None else safe_join(base, draft.images),
        camera=None if draft.camera is None else safe_join(base, draft.camera),
        within=root,
    )
    return _Place(safe_join(base, draft.path), options, sent)
