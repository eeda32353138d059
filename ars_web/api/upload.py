"""`/api/sessions/upload`: a session from a zipped recording."""

from contextlib import ExitStack
from pathlib import Path
from typing import Any

from fastapi import APIRouter, Request, Response
from pydantic import BaseModel, ConfigDict, ValidationError
from starlette.concurrency import run_in_threadpool

from ars_web.api.dependencies import IdempotencyKey, Services, ServicesDep, etag
from ars_web.api.models import Name, SessionJson
from ars_web.api.multipart_form import MultipartForm
from ars_web.api.problems import documented
from ars_web.api.roots import told_within
from ars_web.errors import BadInput
from ars_web.recordings.options import ReadOptions
from ars_web.recordings.registry import READERS, read_recording
from ars_web.sessions.archive import extract_zip
from ars_web.sessions.model import SessionSummary
from ars_web.sessions.session_folders import unseen_folder
from ars_web.sessions.uploads import as_uploaded, only_folder

router = APIRouter(tags=["sessions"])

_BODY: dict[str, Any] = {
    "required": True,
    "content": {
        "multipart/form-data": {
            "schema": {
                "type": "object",
                "required": ["file", "name"],
                "properties": {
                    "file": {"type": "string", "format": "binary", "description": "a recording, as a zip"},
                    "name": {"type": "string", "description": "the session's name"},
                    "format": {"type": "string", "enum": ["auto", *READERS], "default": "auto"},
                },
            }
        }
    },
}


class UploadFields(BaseModel):
    """The form's parts beside the file."""

    model_config = ConfigDict(extra="forbid")

    name: Name
    format: str = "auto"


@router.post(
    "/api/sessions/upload",
    status_code=201,
    operation_id="sessions-upload",
    responses=documented(413),
    openapi_extra={"requestBody": _BODY},
)
async def upload(request: Request, response: Response, services: ServicesDep, key: IdempotencyKey) -> SessionJson:
    """Make a session from a zipped recording; its images are kept with the session."""
    things = ExitStack()
    try:
        folder = await run_in_threadpool(things.enter_context, unseen_folder(services.store.folder))
        form = MultipartForm(folder / "upload.zip", known=UploadFields.model_fields)
        await form.receive(
            request.headers.get("content-type", ""),
            request.stream(),
            declared=request.headers.get("content-length"),
            most=services.largest_upload,
        )
        made = await run_in_threadpool(_import, form, folder / "recording", services, key)
    finally:
        await run_in_threadpool(things.close)  # it takes away a folder that may be large
    response.headers["Location"] = f"/api/sessions/{made.id}"
    response.headers["ETag"] = etag(made.revision)
    return SessionJson.of(made)


def _import(form: MultipartForm, unpacked: Path, services: Services, key: str | None) -> SessionSummary:
    fields = _checked(form.fields)
    extract_zip(form.archive, unpacked)
    form.archive.unlink()
    options = ReadOptions(within=unpacked)
    with told_within(options):
        recording = read_recording(only_folder(unpacked), format=fields.format, options=options)
    recording = as_uploaded(recording, unpacked=unpacked, file_name=form.file_name or form.archive.name)
    return services.store.create(recording, name=fields.name, copy_images=True, key=key)


def _checked(fields: dict[str, bytes]) -> UploadFields:
    try:
        return UploadFields.model_validate({name: value.decode() for name, value in fields.items()})
    except UnicodeDecodeError as error:
        raise BadInput("a part of the form is not text in UTF-8") from error
    except ValidationError as error:
        faults = [f"{fault['loc'][0]}: {fault['msg']}" for fault in error.errors(include_input=False)]
        raise BadInput("; ".join(faults)) from error
