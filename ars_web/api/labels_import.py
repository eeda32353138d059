"""`/api/sessions/{sid}/labels/import` and `…/upload`: labels of other programs, into a session."""

import hashlib
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from fastapi import APIRouter, Request
from pydantic import ValidationError
from starlette.concurrency import run_in_threadpool

from ars_web.annotations.registry import READERS
from ars_web.api.dependencies import AuthorDep, IdempotencyKey, Services, ServicesDep, StrictRoute
from ars_web.api.label_import_models import ImportedLabelsJson, LabelsDraft, LabelsFields
from ars_web.api.multipart_form import MultipartForm
from ars_web.api.problems import documented
from ars_web.api.roots import declared_root, safe_join, told_within
from ars_web.errors import BadInput
from ars_web.masks.label_import import LabelImport
from ars_web.masks.label_import_json import imported_json
from ars_web.recordings.options import ReadOptions
from ars_web.sessions.archive import extract_zip
from ars_web.sessions.session_folders import unseen_folder
from ars_web.sessions.uploads import only_folder

router = APIRouter(prefix="/api/sessions/{sid}/labels", tags=["labels"], route_class=StrictRoute)

_UPLOAD_BODY: dict[str, Any] = {
    "required": True,
    "content": {
        "multipart/form-data": {
            "schema": {
                "type": "object",
                "required": ["file"],
                "properties": {
                    "file": {
                        "type": "string",
                        "format": "binary",
                        "description": "a COCO or CVAT file, or a zip with labels of any format",
                    },
                    "format": {"type": "string", "enum": ["auto", *READERS], "default": "auto"},
                    "dry_run": {"type": "string", "enum": ["true", "false"], "default": "false"},
                },
            }
        }
    },
}

_ZIP_MARK = b"PK\x03\x04"
_LONGEST_NAME = 60


@router.post("/import", operation_id="labels-import", responses=documented(404, 409, 413))
def import_labels(
    sid: str, draft: LabelsDraft, services: ServicesDep, author: AuthorDep, key: IdempotencyKey
) -> ImportedLabelsJson:
    """Add the labels of a file below a declared root, in one edit; what does not come in is told, counted by reason.

    Posed objects that rest become boxes; outlines become masks, and the box of their hull; rectangles in three frames
    or more become the box that fits them. A file that is damaged, or about other images, is refused as a whole.
    """
    options = ReadOptions(within=declared_root(services.roots, draft.root))
    path = safe_join(declared_root(services.roots, draft.root), draft.path)
    request = ["root", draft.root, draft.path]
    return _imported(services, sid, path, options, draft, author=author, key=key, request=request)


@router.post(
    "/upload",
    operation_id="labels-upload",
    responses=documented(404, 409, 413),
    openapi_extra={"requestBody": _UPLOAD_BODY},
)
async def upload(
    sid: str, request: Request, services: ServicesDep, author: AuthorDep, key: IdempotencyKey
) -> ImportedLabelsJson:
    """Add the labels of a file that is sent, or of a zip, as `import` does. The file is not kept."""
    things = ExitStack()
    try:
        folder = await run_in_threadpool(things.enter_context, unseen_folder(services.store.folder))
        form = MultipartForm(folder / "upload", known=LabelsFields.model_fields)
        await form.receive(
            request.headers.get("content-type", ""),
            request.stream(),
            declared=request.headers.get("content-length"),
            most=services.largest_upload,
        )
        return await run_in_threadpool(_sent, services, sid, form, author, key)
    finally:
        await run_in_threadpool(things.close)


def _sent(services: Services, sid: str, form: MultipartForm, author: str, key: str | None) -> ImportedLabelsJson:
    fields = _fields(form.fields)
    with form.archive.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
        file.seek(0)
        is_zip = file.read(len(_ZIP_MARK)) == _ZIP_MARK
    within = form.archive.parent / "sent"
    within.mkdir()
    # What it is called says what is wrong with it; where it lies is nobody's business.
    name = (form.file_name or "")[:_LONGEST_NAME].lstrip(".")
    path = form.archive.rename(within / (name or "labels"))
    if is_zip:
        unpacked = form.archive.parent / "labels"
        with told_within(ReadOptions(within=within)):
            extract_zip(path, unpacked)
        path, within = only_folder(unpacked), unpacked
    options = ReadOptions(within=within)
    return _imported(services, sid, path, options, fields, author=author, key=key, request=["upload", digest])


def _imported(
    services: Services,
    sid: str,
    path: Path,
    options: ReadOptions,
    asked: LabelsFields,
    *,
    author: str,
    key: str | None,
    request: list[str],
) -> ImportedLabelsJson:
    with told_within(options):
        made = LabelImport(services.store, services.editor).run(
            sid,
            path,
            format=asked.format,
            options=options,
            dry_run=asked.dry_run,
            author=author,
            key=key,
            request=request,
        )
    return ImportedLabelsJson.model_validate(imported_json(made))


def _fields(fields: dict[str, bytes]) -> LabelsFields:
    try:
        return LabelsFields.model_validate({name: value.decode() for name, value in fields.items()})
    except UnicodeDecodeError as error:
        raise BadInput("a part of the form is not text in UTF-8") from error
    except ValidationError as error:
        faults = [f"{fault['loc'][0]}: {fault['msg']}" for fault in error.errors(include_input=False)]
        raise BadInput("; ".join(faults)) from error
