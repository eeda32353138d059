"""`…/classes/{class_id}/mesh`, `…/boxes/{box_id}/mesh`, `…/boxes/{box_id}/polygon` and `…/meshes/{digest}`."""

from collections.abc import Mapping
from contextlib import ExitStack
from typing import TypeVar

from fastapi import APIRouter, Request, Response
from pydantic import Field, ValidationError
from starlette.concurrency import run_in_threadpool

from ars_web.api.dependencies import (
    AuthorDep,
    ExpectedRevision,
    JsonResponse,
    Services,
    ServicesDep,
    StrictRoute,
    etag,
)
from ars_web.api.mesh_models import BoxMeshFields, MeshFields, MeshJson, MeshSurface, form_body
from ars_web.api.models import BoxAnswer, ClassAnswer
from ars_web.api.multipart_form import MultipartForm
from ars_web.api.problems import documented
from ars_web.errors import BadInput, NotFound
from ars_web.meshes.mesh_file import MOST_BYTES
from ars_web.sessions.boxes_json import box_json, class_json, mesh_json
from ars_web.sessions.drafting import box_at
from ars_web.sessions.mesh_reading import object_from_file, object_from_polygon
from ars_web.sessions.object_mesh import SourcedMesh
from ars_web.sessions.polygon_json import PolygonJson
from ars_web.sessions.session_folders import unseen_folder

router = APIRouter(prefix="/api/sessions/{sid}", tags=["meshes"], route_class=StrictRoute)

FORM_BYTES = 1 << 16
"""Of a form beside its file."""

Fields = TypeVar("Fields", MeshFields, BoxMeshFields)


class ClassMeshAnswer(ClassAnswer):
    """A class that was given a mesh."""

    notes: list[str] = Field(description="what was changed of the mesh, in words")


class BoxMeshAnswer(BoxAnswer):
    """A box that was given a mesh."""

    mesh: MeshJson
    notes: list[str] = Field(description="what was changed of the mesh, in words")


@router.put(
    "/classes/{class_id}/mesh",
    operation_id="classes-put-mesh",
    responses=documented(404, 412, 413, 428),
    openapi_extra=form_body(fit_size=True),
)
async def put_class_mesh(
    sid: str,
    class_id: int,
    request: Request,
    response: Response,
    services: ServicesDep,
    author: AuthorDep,
    expected: ExpectedRevision,
) -> ClassMeshAnswer:
    """Give a class, which is at the revision in `If-Match`, the mesh of its objects, or another one.

    It takes up to 200,000 faces. What its numbers mean is asked for and never guessed. It moves and turns with each
    box of the class and does not scale with it.
    """
    fields, mesh, notes = await _received(request, services, MeshFields)
    after = await run_in_threadpool(
        services.editor.change_class,
        sid,
        class_id,
        expected_revision=expected,
        mesh=mesh,
        fit_size=None if fields.fit_size is None else fields.fit_size == "true",
        author=author,
    )
    response.headers["ETag"] = etag(after.revision)
    return ClassMeshAnswer.model_validate({**class_json(after, {mesh.mesh.digest: mesh}), "notes": notes})


@router.delete("/classes/{class_id}/mesh", operation_id="classes-delete-mesh", responses=documented(404, 412, 428))
def delete_class_mesh(
    sid: str,
    class_id: int,
    response: Response,
    services: ServicesDep,
    author: AuthorDep,
    expected: ExpectedRevision,
) -> ClassAnswer:
    """Take its mesh from a class that is at the revision in `If-Match`; undo brings it back."""
    after = services.editor.change_class(sid, class_id, expected_revision=expected, mesh=None, author=author)
    response.headers["ETag"] = etag(after.revision)
    return ClassAnswer.of(after, {})


@router.put(
    "/boxes/{box_id}/mesh",
    operation_id="boxes-put-mesh",
    responses=documented(404, 409, 412, 413, 428),
    openapi_extra=form_body(fit_size=False),
)
async def put_box_mesh(
    sid: str,
    box_id: int,
    request: Request,
    response: Response,
    services: ServicesDep,
    author: AuthorDep,
    expected: ExpectedRevision,
) -> BoxMeshAnswer:
    """Give the object in a box, which is at the revision in `If-Match`, a mesh of its own, which counts before its
    class's; a locked box answers 409 (`locked`)."""
    _, mesh, notes = await _received(request, services, BoxMeshFields)
    return await run_in_threadpool(_give, services, response, sid, box_id, mesh, notes, expected, author)


@router.put("/boxes/{box_id}/polygon", operation_id="boxes-put-polygon", responses=documented(404, 409, 412, 413, 428))
def put_polygon(
    sid: str,
    box_id: int,
    draft: PolygonJson,
    response: Response,
    services: ServicesDep,
    author: AuthorDep,
    expected: ExpectedRevision,
) -> BoxMeshAnswer:
    """Have the object in a box, which is at the revision in `If-Match`, be a planar polygon: a mesh of its own that is
    seen from both sides. Corners a little off their plane are moved into it."""
    box = box_at(services.store.state(sid), box_id, expected)
    mesh = object_from_polygon(draft.corners, box.box, in_world=draft.frame_of == "world")
    return _give(services, response, sid, box_id, mesh, [], expected, author)


@router.delete("/boxes/{box_id}/mesh", operation_id="boxes-delete-mesh", responses=documented(404, 409, 412, 428))
def delete_box_mesh(
    sid: str,
    box_id: int,
    response: Response,
    services: ServicesDep,
    author: AuthorDep,
    expected: ExpectedRevision,
) -> BoxAnswer:
    """Take its own mesh, or polygon, from a box that is at the revision in `If-Match`: its class's counts again."""
    after = services.editor.change_box(sid, box_id, expected_revision=expected, mesh=None, author=author)
    response.headers["ETag"] = etag(after.revision)
    return BoxAnswer.of(after)


@router.get("/boxes/{box_id}/mesh", operation_id="boxes-mesh", responses=documented(404))
def box_mesh(sid: str, box_id: int, response: Response, services: ServicesDep) -> MeshJson:
    """The mesh that the object in a box has: its own, else its class's. The ETag is the box's."""
    state = services.store.state(sid)
    box = state.boxes.get(box_id)
    digest = None if box is None else state.mesh_of(box)
    if box is None or digest is None:
        raise NotFound(f"session {sid} has no box {box_id}" if box is None else f"box {box_id} has no mesh")
    response.headers["ETag"] = etag(box.revision)
    return MeshJson.of(services.store.mesh(sid, digest))


@router.get("/meshes/{digest}", operation_id="meshes-get", response_model=MeshSurface, responses=documented(404))
def get(sid: str, digest: str, services: ServicesDep) -> Response:
    """A mesh that a class or a box has, or had."""
    sourced = services.store.mesh(sid, digest)
    mesh = sourced.mesh
    return JsonResponse({**mesh_json(sourced), "vertices": mesh.vertices.tolist(), "faces": mesh.faces.tolist()})


def _give(
    services: Services,
    response: Response,
    sid: str,
    box_id: int,
    mesh: SourcedMesh,
    notes: list[str],
    expected: int,
    author: str,
) -> BoxMeshAnswer:
    after = services.editor.change_box(sid, box_id, expected_revision=expected, mesh=mesh, author=author)
    response.headers["ETag"] = etag(after.revision)
    return BoxMeshAnswer.model_validate({**box_json(after), "mesh": mesh_json(mesh), "notes": notes})


async def _received(request: Request, services: Services, kind: type[Fields]) -> tuple[Fields, SourcedMesh, list[str]]:
    """The form's fields, and the mesh that its file holds."""
    things = ExitStack()
    try:
        folder = await run_in_threadpool(things.enter_context, unseen_folder(services.store.folder))
        form = MultipartForm(folder / "mesh", known=kind.model_fields)
        await form.receive(
            request.headers.get("content-type", ""),
            request.stream(),
            declared=request.headers.get("content-length"),
            most=min(services.largest_upload, MOST_BYTES + FORM_BYTES),
            remedy="simplify the mesh, or leave its pictures out",
        )
        return await run_in_threadpool(_read, form, kind)
    finally:
        await run_in_threadpool(things.close)


def _read(form: MultipartForm, kind: type[Fields]) -> tuple[Fields, SourcedMesh, list[str]]:
    fields = _checked(form.fields, kind)
    name = form.file_name or "mesh"
    mesh, notes = object_from_file(form.archive, name=name, unit=fields.unit, axes=fields.axes, origin=fields.origin)
    return fields, mesh, list(notes)


def _checked(given: Mapping[str, bytes], kind: type[Fields]) -> Fields:
    try:
        return kind.model_validate({name: value.decode() for name, value in given.items()})
    except UnicodeDecodeError as error:
        raise BadInput("a part of the form is not text in UTF-8") from error
    except ValidationError as error:
        faults = [f"{fault['loc'][0]}: {fault['msg']}" for fault in error.errors(include_input=False)]
        raise BadInput("; ".join(faults)) from error
