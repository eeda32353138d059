"""`/api/sessions/{sid}/masks`: the outlines of objects in frames."""

from fastapi import APIRouter, Response

from ars_web.api.dependencies import (
    AuthorDep,
    ExpectedRevision,
    IdempotencyKey,
    JsonResponse,
    ServicesDep,
    StrictRoute,
    etag,
)
from ars_web.api.mask_models import MaskAnswer, MaskChangeJson, MaskDraftJson
from ars_web.api.problems import documented
from ars_web.errors import NotFound
from ars_web.masks.views import camera_of, photographs
from ars_web.sessions.mask_json import mask_json
from ars_web.sessions.model import Mask

router = APIRouter(prefix="/api/sessions/{sid}/masks", tags=["masks"], route_class=StrictRoute)


@router.get("", operation_id="masks-list", response_model=list[MaskAnswer], responses=documented(404))
def masks(sid: str, services: ServicesDep) -> Response:
    """The session's masks, by id; the ETag is the session's revision."""
    state = services.store.state(sid)
    answer = JsonResponse([mask_json(mask) for mask in state.masks.values()])
    answer.headers["ETag"] = etag(state.revision)
    return answer


@router.post(
    "",
    status_code=201,
    operation_id="masks-create",
    response_model=MaskAnswer,
    responses=documented(404, 409, 413, views=True),
)
def create(sid: str, draft: MaskDraftJson, services: ServicesDep, author: AuthorDep, key: IdempotencyKey) -> Response:
    """Add the outline of an object in a frame where it has none.

    Where the object's box is made from its masks, hull and box follow in the same edit, or nothing is stored.
    """
    camera = camera_of(photographs(services.store, sid), draft.frame)
    made = services.objects.add_mask(
        sid,
        box_id=draft.box_id,
        frame=draft.frame,
        class_id=draft.class_id,
        polygons=draft.outline(camera),
        origin=draft.origin,
        accepted=draft.accepted,
        author=author,
        key=key,
    )
    return _answer(sid, made, created=True)


@router.get("/{mask_id}", operation_id="masks-get", response_model=MaskAnswer, responses=documented(404))
def get(sid: str, mask_id: int, services: ServicesDep) -> Response:
    """One mask."""
    return _answer(sid, _mask(services, sid, mask_id))


@router.put(
    "/{mask_id}",
    operation_id="masks-change",
    response_model=MaskAnswer,
    responses=documented(404, 409, 412, 413, 428, views=True),
)
def change(
    sid: str,
    mask_id: int,
    changes: MaskChangeJson,
    services: ServicesDep,
    author: AuthorDep,
    expected: ExpectedRevision,
) -> Response:
    """Change a mask that is at the revision in `If-Match`.

    Where the object's box is made from its masks, hull and box follow in the same edit, or nothing is stored.
    """
    given = changes.polygons is not None or changes.mask_png is not None
    camera = camera_of(photographs(services.store, sid), _mask(services, sid, mask_id).frame) if given else None
    after = services.objects.change_mask(
        sid,
        mask_id,
        polygons=None if camera is None else changes.outline(camera),
        origin=changes.origin,
        accepted=changes.accepted,
        expected_revision=expected,
        author=author,
    )
    return _answer(sid, after)


@router.delete(
    "/{mask_id}", status_code=204, operation_id="masks-delete", responses=documented(404, 409, 412, 428, views=True)
)
def delete(sid: str, mask_id: int, services: ServicesDep, author: AuthorDep, expected: ExpectedRevision) -> None:
    """Delete a mask that is at the revision in `If-Match`; undo brings it back.

    Where the object's box is made from its masks, hull and box follow in the same edit, or nothing is deleted.
    """
    services.objects.delete_mask(sid, mask_id, expected_revision=expected, author=author)


def _mask(services: ServicesDep, sid: str, mask_id: int) -> Mask:
    found = services.store.state(sid).masks.get(mask_id)
    if found is None:
        raise NotFound(f"session {sid} has no mask {mask_id}")
    return found


def _answer(sid: str, mask: Mask, *, created: bool = False) -> Response:
    answer = JsonResponse(mask_json(mask), status_code=201 if created else 200)
    answer.headers["ETag"] = etag(mask.revision)
    if created:
        answer.headers["Location"] = f"/api/sessions/{sid}/masks/{mask.id}"
    return answer
