"""`/api/sessions/{sid}/boxes/from-masks` and `boxes/{box_id}/hull`: boxes of outlines, and their visual hulls."""

from fastapi import APIRouter, Response

from ars_web.api.dependencies import (
    AuthorDep,
    IdempotencyKey,
    JsonResponse,
    OptionalRevision,
    Services,
    ServicesDep,
    StrictRoute,
    etag,
)
from ars_web.api.mask_models import HullAnswer, HullChangeJson, MadeBoxAnswer
from ars_web.api.problems import PreconditionMissing, documented
from ars_web.errors import NotFound
from ars_web.masks.masks_json import BoxFromMasksJson, hull_json, made_box_json, outlines_of
from ars_web.masks.views import hull_of, photographs
from ars_web.sessions.model import HullOptions, VirtualBox

router = APIRouter(prefix="/api/sessions/{sid}/boxes", tags=["boxes"], route_class=StrictRoute)


@router.post(
    "/from-masks",
    status_code=201,
    operation_id="boxes-from-masks",
    response_model=MadeBoxAnswer,
    responses=documented(404, 409, 413, views=True),
)
def from_masks(
    sid: str, draft: BoxFromMasksJson, services: ServicesDep, author: AuthorDep, key: IdempotencyKey
) -> Response:
    """Add the box of an object by its outlines in two frames or more: the box round its visual hull, which is stored
    with it, and so are the outlines.

    Outlines that no one object can have answer 422 (`views-disagree`) with the frames and by how many pixels they are
    off; nothing is stored then.
    """
    made = services.objects.from_masks(
        sid,
        outlines_of(photographs(services.store, sid), draft.views),
        **draft.asked,
        author=author,
        key=key,
    )
    return _made(services, sid, made, status=201)


@router.get("/{box_id}/hull", operation_id="boxes-hull", response_model=HullAnswer, responses=documented(404))
def hull(sid: str, box_id: int, services: ServicesDep) -> Response:
    """The hull that is stored with a box, where the box is now; the ETag is the box's."""
    box = services.store.state(sid).boxes.get(box_id)
    if box is None:
        raise NotFound(f"session {sid} has no box {box_id}")
    answer = JsonResponse(hull_json(hull_of(services.store, sid, box)))
    answer.headers["ETag"] = etag(box.revision)
    return answer


@router.put(
    "/{box_id}/hull",
    operation_id="boxes-make-hull",
    response_model=MadeBoxAnswer,
    responses=documented(404, 409, 412, 413, 428, views=True),
)
def make(
    sid: str,
    box_id: int,
    changes: HullChangeJson,
    services: ServicesDep,
    author: AuthorDep,
    expected: OptionalRevision,
) -> Response:
    """Make the box of an object from its accepted masks, or make it again.

    A box that is there must be at the revision in `If-Match`; an object that has masks and no box yet needs none.
    """
    before = services.store.state(sid).boxes.get(box_id)
    if before is not None and expected is None:
        raise PreconditionMissing
    made = services.objects.remake(
        sid,
        box_id,
        options=changes.options((None if before is None else before.hull_options) or HullOptions()),
        class_id=changes.class_id,
        name=changes.name,
        expected_revision=expected,
        author=author,
    )
    return _made(services, sid, made, status=200)


def _made(services: Services, sid: str, box: VirtualBox, *, status: int) -> Response:
    hull = hull_of(services.store, sid, box)
    answer = JsonResponse(made_box_json(box, hull), status_code=status)
    answer.headers["ETag"] = etag(box.revision)
    if status == 201:
        answer.headers["Location"] = f"/api/sessions/{sid}/boxes/{box.id}"
    return answer
