"""`/api/sessions/{sid}/boxes/{box_id}/refine` and `next-view`: a box fitted to where its object is seen, and where to
outline that next."""

from fastapi import APIRouter, Response
from pydantic import BaseModel, Field

from ars_web.api.dependencies import (
    AuthorDep,
    IdempotencyKey,
    JsonResponse,
    OptionalRevision,
    ServicesDep,
    StrictRoute,
    etag,
)
from ars_web.api.hull_preview import NextViewJson, next_view_json
from ars_web.api.models import BoxAnswer
from ars_web.api.problems import PreconditionMissing, documented
from ars_web.errors import NotFound
from ars_web.masks.box_fitting import BoxFitting
from ars_web.masks.fit_json import FitJson, fitted_json, sightings_of
from ars_web.masks.next_frame import next_frame
from ars_web.masks.views import photographs

router = APIRouter(prefix="/api/sessions/{sid}/boxes/{box_id}", tags=["boxes"], route_class=StrictRoute)


class ResidualsJson(BaseModel):
    """How far the box's label is off in one frame."""

    frame: int
    px: tuple[float, float, float, float] = Field(
        description="how far its sides x0 y0 x1 y1 lie to the right of or below the seen ones; 0 for a side at the"
        " image's border that the label reaches"
    )
    rms_px: float
    outlier: bool = Field(description="whether it agrees much worse than the other frames do")


class RefinedAnswer(BaseModel):
    """A box fitted to where its object is seen; its ETag is the box's."""

    box: BoxAnswer
    residuals: list[ResidualsJson]
    rms_px: float = Field(description="of all sides in all frames")
    moved_mm: float = Field(description="the most that a corner moved")
    corner_error_mm: float = Field(
        description="one standard deviation of the worst corner, if every side was seen to a pixel"
    )
    warnings: list[str] = Field(description="what is doubtful, and what to do about it, for the user")


@router.post(
    "/refine",
    operation_id="boxes-refine",
    response_model=RefinedAnswer,
    responses=documented(404, 409, 412, 413, 428),
)
def refine(
    sid: str,
    box_id: int,
    wish: FitJson,
    services: ServicesDep,
    author: AuthorDep,
    expected: OptionalRevision,
    key: IdempotencyKey,
) -> Response:
    """Move, turn and size a box that is at the revision in `If-Match` until its labels agree best with where its object
    is seen: by least squares on what would be exported, from a place that may be some centimetres off.

    A hull stays where it is in the world. With `dry_run` nothing is stored, and `If-Match` is not needed.
    """
    fitting = BoxFitting(services.store, services.editor)
    taken = photographs(services.store, sid)
    sightings = None if wish.views is None else sightings_of(taken, wish.views)
    if wish.dry_run:
        fitted = fitting.try_fit(sid, box_id, sightings, orientation=wish.orientation)
    elif expected is None:
        raise PreconditionMissing
    else:
        fitted = fitting.fit(
            sid,
            box_id,
            sightings,
            orientation=wish.orientation,
            expected_revision=expected,
            author=author,
            key=key,
            request=wish.model_dump(mode="json"),
        )
    answer = JsonResponse(fitted_json(fitted))
    answer.headers["ETag"] = etag(fitted.box.revision)
    return answer


@router.get(
    "/next-view",
    operation_id="boxes-next-view",
    response_model=NextViewJson | None,
    responses=documented(404, views=True),
)
def next_view(sid: str, box_id: int, services: ServicesDep) -> Response:
    """The frame in which to outline an object next, by its box or its accepted masks; null where no frame would add to
    them. Frames in which other boxes hide it come last."""
    state = services.store.state(sid)
    if box_id not in state.boxes and not state.masks_of(box_id):
        raise NotFound(f"session {sid} has no object {box_id}: no box, and no masks")
    found = next_frame(services.store, sid, state, box_id)
    return JsonResponse(None if found is None else next_view_json(found))
