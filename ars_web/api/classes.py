"""`/api/sessions/{sid}/classes`: the kinds of objects."""

from fastapi import APIRouter, Response

from ars_web.api.dependencies import AuthorDep, ExpectedRevision, IdempotencyKey, ServicesDep, StrictRoute, etag
from ars_web.api.models import ClassAnswer, ClassDraft, ClassPatch
from ars_web.api.problems import documented
from ars_web.errors import NotFound
from ars_web.geometry.symmetry import NO_SYMMETRY, Symmetry
from ars_web.sessions.editing import UNSET
from ars_web.sessions.model import ObjectClass
from ars_web.sessions.store import SessionStore

router = APIRouter(prefix="/api/sessions/{sid}/classes", tags=["classes"], route_class=StrictRoute)


@router.get("", operation_id="classes-list", responses=documented(404))
def classes(sid: str, response: Response, services: ServicesDep) -> list[ClassAnswer]:
    """The session's classes, by id; the ETag is the session's revision."""
    state = services.store.state(sid)
    response.headers["ETag"] = etag(state.revision)
    return [_answer(services.store, sid, c) for c in state.classes.values()]


@router.post("", status_code=201, operation_id="classes-create", responses=documented(404, 413))
def create(
    sid: str, draft: ClassDraft, response: Response, services: ServicesDep, author: AuthorDep, key: IdempotencyKey
) -> ClassAnswer:
    """Add a class."""
    made = services.editor.add_class(
        sid, name=draft.name, color=draft.color, default_size=draft.default_size, author=author, key=key
    )
    response.headers["Location"] = f"/api/sessions/{sid}/classes/{made.id}"
    response.headers["ETag"] = etag(made.revision)
    return _answer(services.store, sid, made)


@router.get("/{class_id}", operation_id="classes-get", responses=documented(404))
def get(sid: str, class_id: int, response: Response, services: ServicesDep) -> ClassAnswer:
    """One class."""
    found = services.store.state(sid).classes.get(class_id)
    if found is None:
        raise NotFound(f"session {sid} has no class {class_id}")
    response.headers["ETag"] = etag(found.revision)
    return _answer(services.store, sid, found)


@router.patch("/{class_id}", operation_id="classes-change", responses=documented(404, 412, 413, 428))
def change(
    sid: str,
    class_id: int,
    changes: ClassPatch,
    response: Response,
    services: ServicesDep,
    author: AuthorDep,
    expected: ExpectedRevision,
) -> ClassAnswer:
    """Change a class that is at the revision in `If-Match`."""
    after = services.editor.change_class(
        sid,
        class_id,
        expected_revision=expected,
        name=changes.name,
        color=changes.color,
        default_size=changes.default_size if "default_size" in changes.model_fields_set else UNSET,
        symmetry=_symmetry(changes) if "symmetry" in changes.model_fields_set else UNSET,
        keypoints=[one.keypoint for one in changes.keypoints or ()]
        if "keypoints" in changes.model_fields_set
        else UNSET,
        author=author,
    )
    response.headers["ETag"] = etag(after.revision)
    return _answer(services.store, sid, after)


@router.delete("/{class_id}", status_code=204, operation_id="classes-delete", responses=documented(404, 412, 428))
def delete(sid: str, class_id: int, services: ServicesDep, author: AuthorDep, expected: ExpectedRevision) -> None:
    """Delete a class that no box uses and that is at the revision in `If-Match`; its id is never used again."""
    services.editor.delete_class(sid, class_id, expected_revision=expected, author=author)


def _symmetry(changes: ClassPatch) -> Symmetry:
    return NO_SYMMETRY if changes.symmetry is None else changes.symmetry.symmetry


def _answer(store: SessionStore, sid: str, a_class: ObjectClass) -> ClassAnswer:
    # By its name, which never means another mesh, whatever happened to the class meanwhile.
    meshes = {} if a_class.mesh is None else {a_class.mesh: store.mesh(sid, a_class.mesh)}
    return ClassAnswer.of(a_class, meshes)
